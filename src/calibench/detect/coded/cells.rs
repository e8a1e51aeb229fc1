//! Which cells of a marker are white? Samples of the photograph at the places that a homography gives,
//! against the marker's own black border and the white about it.

use super::dictionary::Cells;
use crate::detect::bilinear::bilinear;
use crate::detect::chessboard::level::{Pyramid, level_from_photo};
use crate::geometry::{Homography, Vec2};
use crate::raster::Level;

/// Where a marker is: its unit square, y down, in the photograph.
pub struct Patch {
    /// From the marker, border included, to the photograph, px.
    pub photo_from_marker: Homography,
    /// Cells of the border's width.
    pub border: usize,
    /// Width of the white about the marker, in its sides.
    pub white: f64,
    /// Least part of the cells that must lie inside of the image; those outside are taken as black.
    pub inside: f64,
}

/// Places of a cell that are sampled, along each axis, in cells from its middle.
const SAMPLES: [f64; 4] = [-0.27, -0.09, 0.09, 0.27];

/// Pixels of a cell in the image that is sampled, at least, where the photograph has them: its noise is
/// averaged.
const CELL_PX: f64 = 4.0;

/// Largest part of a border's cells that may look white: a shadow, dirt.
const MOST_OF_BORDER: f64 = 0.2;

/// How much of the difference between a cell and those beside it sharpening adds.
const SHARPENED: f64 = 1.0;

/// What a marker's inside looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Inside {
    /// The inner cells as they are.
    pub plain: Cells,
    /// The same after each is compared with those beside it: a blurred white cell between black ones is grey.
    pub sharpened: Cells,
}

/// The inner cells of a marker, `side` along each side, if it has a black border on white ground whose levels
/// differ by `least`.
pub fn read<T: Level>(pyramid: &Pyramid<'_, T>, patch: &Patch, side: usize, least: f64) -> Option<Inside> {
    let count = side + 2 * patch.border;
    let cell = 1.0 / count as f64;
    let at = |x: f64, y: f64| patch.photo_from_marker.apply(&Vec2::new(x, y));
    let level = level_of(pyramid, &at, cell)?;
    let mean = |column: f64, row: f64, reach: f64| {
        let mut sum = 0.0;
        for v in SAMPLES {
            for u in SAMPLES {
                sum += sample(pyramid, level, &at((column + u * reach) * cell, (row + v * reach) * cell)?)?;
            }
        }
        Some(sum / (SAMPLES.len() * SAMPLES.len()) as f64)
    };
    let last = count as f64 - 0.5;
    let places = || (0..count).map(|k| k as f64 + 0.5);
    let centre = |column: f64, row: f64| sample(pyramid, level, &at(column * cell, row * cell)?);
    if !has_white(&centre, count, patch) {
        return None;
    }
    // The white strip about the marker, a sample beside each outer cell, in its middle.
    let (beside, thin) = (0.5 * patch.white * count as f64, (patch.white * count as f64).min(1.0));
    let (mut white, mut black) = (Mean::default(), Mean::default());
    for k in places() {
        for (x, y) in [(k, -beside), (k, last + 0.5 + beside), (-beside, k), (last + 0.5 + beside, k)] {
            white.add(mean(x, y, thin));
        }
        for (x, y) in [(k, 0.5), (k, last), (0.5, k), (last, k)] {
            black.add(mean(x, y, 1.0));
        }
    }
    let (white, black) = (white.of(patch.inside)?, black.of(patch.inside)?);
    if white - black < least {
        return None;
    }
    let (mut means, mut all) = (Vec::with_capacity(count * count), Mean::default());
    for row in places() {
        for column in places() {
            let level = mean(column, row, 1.0);
            all.add(level);
            means.push(level.unwrap_or(black));
        }
    }
    all.of(patch.inside)?;
    inside(&means, count, patch.border, 0.5 * (white + black))
}

/// How far above its border's level the brightest inner cell of a marker is at least, as part of the
/// difference of white and black. Cells that are white all around one another reach the white, however
/// blurred.
const LEAST_WHITE: f64 = 0.25;

/// Whether any inner cell stands out of the border, by a sample of each: a tile of a floor is as dark in its
/// middle as at its edge, and there may be thousands. `centre` gives the level in the middle of a cell.
fn has_white(centre: &dyn Fn(f64, f64) -> Option<f64>, count: usize, patch: &Patch) -> bool {
    let (beside, last) = (0.5 * patch.white * count as f64, count as f64 - 0.5);
    let (mut white, mut black) = (Mean::default(), Mean::default());
    for k in (0..count).map(|k| k as f64 + 0.5) {
        for (x, y) in [(k, -beside), (k, last + 0.5 + beside), (-beside, k), (last + 0.5 + beside, k)] {
            white.add(centre(x, y));
        }
        for (x, y) in [(k, 0.5), (k, last), (0.5, k), (last, k)] {
            black.add(centre(x, y));
        }
    }
    let (Some(white), Some(black)) = (white.of(patch.inside), black.of(patch.inside)) else { return false };
    let inner = || (patch.border..count - patch.border).map(|k| k as f64 + 0.5);
    let least = black + LEAST_WHITE * (white - black);
    inner().any(|row| inner().any(|column| centre(column, row).is_some_and(|level| level > least)))
}

/// The mean of the levels inside of the image.
#[derive(Default)]
struct Mean {
    sum: f64,
    inside: usize,
    count: usize,
}

impl Mean {
    fn add(&mut self, level: Option<f64>) {
        self.sum += level.unwrap_or(0.0);
        self.inside += usize::from(level.is_some());
        self.count += 1;
    }

    /// If at least such a part was inside.
    fn of(&self, least: f64) -> Option<f64> {
        (self.inside > 0 && self.inside as f64 >= least * self.count as f64)
            .then(|| self.sum / self.inside as f64)
    }
}

/// The inner cells by the levels of all, `count` along each side; `middle`: between white and black.
fn inside(means: &[f64], count: usize, border: usize, middle: f64) -> Option<Inside> {
    let inner = border..count - border;
    let is_inner = |row: usize, column: usize| inner.contains(&row) && inner.contains(&column);
    let (mut plain, mut sharpened, mut wrong) = (0, 0, 0);
    for row in 0..count {
        for column in 0..count {
            let here = means[row * count + column];
            if is_inner(row, column) {
                // An inner cell has one beside it on each side: the border is around.
                let k = row * count + column;
                let beside = 0.25 * (means[k - 1] + means[k + 1] + means[k - count] + means[k + count]);
                let sharp = here + SHARPENED * (here - beside);
                plain = plain << 1 | Cells::from(here > middle);
                sharpened = sharpened << 1 | Cells::from(sharp > middle);
            } else {
                wrong += usize::from(here > middle);
            }
        }
    }
    let of_border = (count * count - inner.len() * inner.len()) as f64;
    (wrong as f64 <= MOST_OF_BORDER * of_border).then_some(Inside { plain, sharpened })
}

/// The coarsest level in which a cell has enough pixels.
fn level_of<T: Level>(
    pyramid: &Pyramid<'_, T>,
    at: &dyn Fn(f64, f64) -> Option<Vec2>,
    cell: f64,
) -> Option<usize> {
    let (middle, across, down) = (at(0.5, 0.5)?, at(0.5 + cell, 0.5)?, at(0.5, 0.5 + cell)?);
    let cell_px = (across - middle).norm().min((down - middle).norm());
    let fine = (0..pyramid.levels()).take_while(|level| cell_px >= CELL_PX * (1u64 << level) as f64);
    Some(fine.last().unwrap_or(0))
}

/// The level at a place of the photograph, bilinear, in a level of the pyramid; `None` outside.
fn sample<T: Level>(pyramid: &Pyramid<'_, T>, level: usize, place: &Vec2) -> Option<f64> {
    match pyramid.reduced(level) {
        Some(reduced) => bilinear(reduced, &level_from_photo(place, level)),
        None => bilinear(pyramid.photo(), place),
    }
}
