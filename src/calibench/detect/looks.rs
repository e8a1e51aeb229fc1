//! Where are the discs that the first look misses? The same search with other thresholds, and on the image averaged over squares of 2, 4 and
//! 8 pixels.
//!
//! The first look ([`super::blobs`]) has tiles of 16 px and thresholds half-way between mark and ground, and takes for an edge what has 15 %
//! of the image's range. It misses marks that touch a background of the same level by half, marks many tiles wide in noise, and marks that
//! are faint beside something bright. Averaged squares have less noise and wider tiles; what contrast can be an edge's follows from the noise
//! that is left. Every disc is refined in the image itself.

use super::blob::Blob;
use super::components::Polarity;
use super::discs::{BlobOptions, blobs_by};
use super::threshold::{Search, Thresholds};
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};

/// Sides of the squares over which the image is averaged, px.
const SQUARES: [usize; 4] = [1, 2, 4, 8];
/// Where thresholds lie between mark and ground: nearer to the mark, so that a ground of half the contrast is none of it.
const NEARER: f64 = 0.3;
/// A neighbourhood of 2304 samples spans seven standard deviations of its noise; more is an edge.
const SPANS: f64 = 9.0;
/// Least contrast of an edge, as a fraction of the image's range.
const LEAST_CONTRAST: f64 = 0.02;
/// The least side of an averaged image, px: three tiles.
const LEAST_SIDE: usize = 48;

/// The discs of an image that any look finds, each once; those of finer looks come first.
///
/// It takes several times as long as [`super::blobs`], and finds more that is no mark: for photographs in which that finds no board.
pub fn searched_blobs<T: Level>(image: &Raster<T>, options: &BlobOptions) -> Vec<Blob> {
    let mut found: Vec<Blob> = Vec::new();
    for square in SQUARES {
        if image.width().min(image.height()) / square < LEAST_SIDE {
            break;
        }
        let averaged = averaged(image, square);
        let noise = noise_of(&averaged);
        for part in [0.5, NEARER] {
            let part = if options.polarity == Polarity::Dark { part } else { 1.0 - part };
            let search = Search { part, least_contrast: SPANS * noise, least_share: LEAST_CONTRAST };
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

/// Standard deviation of the noise: the median of second differences along rows, which few edges reach, for a normal law.
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
    fn places_of_an_averaged_image_are_those_of_the_image() {
        // A step at 31.5 px of the image lies between the averaged pixels 7 and 8.
        let image = Raster::from_fn(64, 64, |x, _| if x < 32 { 0u8 } else { 200 });
        let small = averaged(&image, 4);
        assert_eq!((small.width(), small.get(7, 3), small.get(8, 3)), (16, 0.0, 200.0));
        assert_eq!(in_image(Vec2::new(7.5, 0.0), 4).x, 31.5);
    }
}
