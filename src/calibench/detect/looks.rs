//! Where are the discs that the first look misses? The same search with other thresholds, and on the image
//! averaged over squares of 2, 4 and 8 pixels.
//!
//! The first look ([`super::blobs`]) has tiles of 16 px and thresholds half-way between mark and ground, and
//! takes for an edge what has 15 % of the image's range. It misses marks that touch a background of the same
//! level by half, marks many tiles wide in noise, and marks that are faint beside something bright. Averaged
//! squares have less noise and wider tiles; what contrast can be an edge's follows from the noise that is
//! left. Where something far brighter lies within a tile of the marks, their threshold would lie above ground
//! and marks alike: a third kind of threshold takes all that is brighter than the ground for as bright as the
//! ground. Every disc is refined in the image itself.

use super::blob::Blob;
use super::components::Polarity;
use super::discs::{BlobOptions, blobs_by};
use super::threshold::{ALL, Search, Thresholds};
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};

/// Sides of the squares over which the image is averaged, px.
const SQUARES: [usize; 4] = [1, 2, 4, 8];
/// Where thresholds lie between mark and ground: nearer to the mark, so that a ground of half the contrast is
/// none of it.
const NEARER: f64 = 0.3;
/// A neighbourhood of 2304 samples spans seven standard deviations of its noise; more is an edge.
const SPANS: f64 = 9.0;
/// Least contrast of an edge, as a fraction of the image's range.
const LEAST_CONTRAST: f64 = 0.02;
/// The least side of an averaged image, px: three tiles.
const LEAST_SIDE: usize = 48;

/// The discs of an image that any look finds, each once; those of finer looks come first.
///
/// It takes several times as long as [`super::blobs`], and finds more that is no mark: for photographs in
/// which that finds no board.
pub fn searched_blobs<T: Level>(image: &Raster<T>, options: &BlobOptions) -> Vec<Blob> {
    let mut found: Vec<Blob> = Vec::new();
    for square in SQUARES {
        if image.width().min(image.height()) / square < LEAST_SIDE {
            break;
        }
        let averaged = averaged(image, square);
        let noise = noise_of(&averaged);
        let nearer = if options.polarity == Polarity::Dark { NEARER } else { 1.0 - NEARER };
        let kinds = [(0.5, ALL), (nearer, ALL), (0.5, ground_and_marks(&averaged, options.polarity))];
        for (part, within) in kinds {
            let search = Search { part, least_contrast: SPANS * noise, least_share: LEAST_CONTRAST, within };
            let Some(thresholds) = Thresholds::by(&averaged, &search) else { continue };
            for blob in blobs_by(image, &averaged, square, &thresholds, options) {
                if !found.iter().any(|other| is_same(other, &blob)) {
                    found.push(blob);
                }
            }
        }
    }
    found
}

/// The levels of ground and marks where something far brighter (for bright marks: darker) surrounds them: of
/// the two parts that the image's levels fall into (Otsu 1979), the marks' part as far as its median, which
/// is of the ground, for that is wider than its marks.
fn ground_and_marks(image: &Raster<f32>, polarity: Polarity) -> (f64, f64) {
    let mut levels: Vec<f32> = image.samples().iter().copied().filter(|level| level.is_finite()).collect();
    levels.sort_by(f32::total_cmp);
    let Some(split) = otsu(&levels) else { return ALL };
    match polarity {
        Polarity::Dark => (f64::NEG_INFINITY, f64::from(levels[split / 2])),
        Polarity::Bright => (f64::from(levels[split + (levels.len() - split) / 2]), f64::INFINITY),
    }
}

/// How many of sorted levels are in the darker of two parts whose means differ most against what is left
/// within them: the greatest `n1 n2 (m1 - m2)^2`. `None` where they are all the same.
fn otsu(levels: &[f32]) -> Option<usize> {
    let total: f64 = levels.iter().map(|level| f64::from(*level)).sum();
    let (mut sum, mut best, mut split) = (0.0, 0.0, None);
    for (below, pair) in levels.windows(2).enumerate() {
        sum += f64::from(pair[0]);
        if pair[0] == pair[1] {
            continue;
        }
        let (n1, n2) = ((below + 1) as f64, (levels.len() - below - 1) as f64);
        let difference = sum / n1 - (total - sum) / n2;
        if n1 * n2 * difference * difference > best {
            (best, split) = (n1 * n2 * difference * difference, Some(below + 1));
        }
    }
    split
}

/// Whether two discs have their centres within each other.
fn is_same(one: &Blob, other: &Blob) -> bool {
    let distance = (one.centre_px - other.centre_px).norm();
    distance < one.semi_axes_px().0.max(other.semi_axes_px().0)
}

/// The mean of every square of so many pixels; what is left over at the right and below is left out.
fn averaged<T: Level>(image: &Raster<T>, side: usize) -> Raster<f32> {
    let share = 1.0 / (side * side) as f32;
    Raster::from_fn(image.width() / side, image.height() / side, |x, y| {
        let row = |dy: usize| &image.row(y * side + dy)[x * side..(x + 1) * side];
        let sum: f32 = (0..side).flat_map(row).map(|sample| sample.to_f32()).sum();
        sum * share
    })
}

/// Where a place in an image averaged over squares lies in the image itself.
pub(super) fn in_image(place: Vec2, side: usize) -> Vec2 {
    let side = side as f64;
    place * side + Vec2::repeat(0.5 * (side - 1.0))
}

/// Standard deviation of the noise: the median of second differences along rows, which few edges reach, for a
/// normal law.
fn noise_of(image: &Raster<f32>) -> f64 {
    /// Every so many samples one is looked at.
    const STEP: usize = 7;
    /// Median of the absolute value of a standard normal number.
    const MEDIAN: f64 = 0.674_489_750_196_082;
    let mut differences: Vec<f32> = (0..image.height())
        .flat_map(|y| {
            let row = image.row(y);
            let start = y % STEP;
            row.windows(3).skip(start).step_by(STEP).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs())
        })
        .filter(|difference| difference.is_finite())
        .collect();
    if differences.is_empty() {
        return 0.0;
    }
    let middle = differences.len() / 2;
    let (_, median, _) = differences.select_nth_unstable_by(middle, f32::total_cmp);
    f64::from(*median) / (MEDIAN * 6f64.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    #[test]
    fn noise_is_told_beside_edges() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let image = Raster::from_fn(300, 200, |x, _| {
            let stripe = if x / 20 % 2 == 0 { 0.2 } else { 0.8 };
            (stripe + 0.03 * random.sample::<f64, _>(StandardNormal)) as f32
        });
        let noise = noise_of(&image);
        assert!((0.027..0.040).contains(&noise), "{noise}");
        assert_eq!(noise_of(&Raster::filled(300, 200, 0.5f32)), 0.0);
    }

    #[test]
    fn levels_fall_into_two_parts_where_their_means_differ_most() {
        assert_eq!(otsu(&[1.0, 1.0, 2.0, 8.0, 9.0]), Some(3));
        assert_eq!(otsu(&[1.0; 5]), None);
        assert_eq!(otsu(&[]), None);
    }

    #[test]
    fn faint_discs_on_a_sheet_before_something_bright_are_found() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let image = Raster::from_fn(320, 260, |x, y| {
            let (x, y) = (x as f64, y as f64);
            let is_sheet = (60.0..260.0).contains(&x) && (50.0..210.0).contains(&y);
            // Discs of radius 9 px, 40 px apart, the outer ones 11 px from the sheet's edge.
            let (dx, dy) = ((x - 60.0) % 40.0 - 20.0, (y - 50.0) % 40.0 - 20.0);
            let covered = (9.5 - libm::hypot(dx, dy)).clamp(0.0, 1.0);
            let level = if is_sheet { 0.30 - 0.06 * covered } else { 0.97 };
            (level + 0.003 * random.sample::<f64, _>(StandardNormal)) as f32
        });
        let options = BlobOptions::default();
        assert!(super::super::blobs(&image, &options).len() < 20);
        let found = searched_blobs(&image, &options);
        let is_there = |i: usize| {
            let centre = Vec2::new(80.0 + 40.0 * (i % 5) as f64, 70.0 + 40.0 * (i / 5) as f64);
            found.iter().any(|blob| (blob.centre_px - centre).norm() < 0.3)
        };
        assert_eq!((0..20).filter(|&i| is_there(i)).count(), 20);
    }

    #[test]
    fn places_of_an_averaged_image_are_those_of_the_image() {
        // A step at 31.5 px of the image lies between the averaged pixels 7 and 8.
        let image = Raster::from_fn(64, 64, |x, _| if x < 32 { 0u8 } else { 200 });
        let small = averaged(&image, 4);
        assert_eq!((small.width(), small.get(7, 3), small.get(8, 3)), (16, 0.0, 200.0));
        assert_eq!(in_image(Vec2::new(7.5, 0.0), 4).x, 31.5);
    }
}
