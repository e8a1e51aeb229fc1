//! Which cells of a marker are white? Samples of the photograph at the places that a homography gives, against the
//! marker's own black border and the white about it.

use super::dictionary::Cells;
use crate::detect::chessboard::level::{Pyramid, level_from_photo};
use crate::geometry::{Homography, Vec2};
use crate::raster::{Level, Raster};

/// Where a marker is: its unit square, y down, in the photograph.
pub struct Patch {
    /// From the marker, border included, to the photograph, px.
    pub photo_from_marker: Homography,
    /// Cells of the border's width.
    pub border: usize,
    /// Width of the white about the marker, in its sides.
    pub white: f64,
}

/// Places of a cell that are sampled, along each axis, in cells from its middle.
const SAMPLES: [f64; 4] = [-0.27, -0.09, 0.09, 0.27];

/// Pixels of a cell in the image that is sampled, at least, where the photograph has them: its noise is averaged.
const CELL_PX: f64 = 4.0;

/// Largest part of a border's cells that may look white: a shadow, dirt.
const MOST_OF_BORDER: f64 = 0.2;

/// The inner cells of a marker, `side` along each side, if it has a black border on white ground whose levels differ by
/// `least`.
pub fn read<T: Level>(pyramid: &Pyramid<'_, T>, patch: &Patch, side: usize, least: f64) -> Option<Cells> {
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
    // The white strip about the marker, a sample beside each outer cell, in its middle.
    let (beside, thin) = (0.5 * patch.white * count as f64, (patch.white * count as f64).min(1.0));
    let (mut white, mut black) = (0.0, 0.0);
    for k in places() {
        for (x, y) in [(k, -beside), (k, last + 0.5 + beside), (-beside, k), (last + 0.5 + beside, k)] {
            white += mean(x, y, thin)?;
        }
        for (x, y) in [(k, 0.5), (k, last), (0.5, k), (last, k)] {
            black += mean(x, y, 1.0)?;
        }
    }
    let outer = 4.0 * count as f64;
    (white, black) = (white / outer, black / outer);
    if white - black < least {
        return None;
    }
    let middle = 0.5 * (white + black);
    let (mut cells, mut wrong) = (0, 0);
    let inner = patch.border..patch.border + side;
    for row in 0..count {
        for column in 0..count {
            let is_white = mean(column as f64 + 0.5, row as f64 + 0.5, 1.0)? > middle;
            if inner.contains(&row) && inner.contains(&column) {
                cells = cells << 1 | Cells::from(is_white);
            } else {
                wrong += usize::from(is_white);
            }
        }
    }
    let of_border = (count * count - side * side) as f64;
    (wrong as f64 <= MOST_OF_BORDER * of_border).then_some(cells)
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

fn bilinear<T: Level>(image: &Raster<T>, place: &Vec2) -> Option<f64> {
    let fits = |at: f64, size: usize| at >= 0.0 && at + 1.0 < size as f64;
    if !(fits(place.x, image.width()) && fits(place.y, image.height())) {
        return None;
    }
    let (x, y) = (place.x as usize, place.y as usize);
    let (a, b) = (place.x - x as f64, place.y - y as f64);
    let mix = |row: &[T]| row[x].to_f64() + (row[x + 1].to_f64() - row[x].to_f64()) * a;
    let (upper, lower) = (mix(image.row(y)), mix(image.row(y + 1)));
    Some(upper + (lower - upper) * b)
}
