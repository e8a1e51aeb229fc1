//! How well can a mark's place be known? The Cramer-Rao bound of a shift of what is seen about it, from the pixels' noise alone:
//!
//! ```text
//! F = sum (grad I) (grad I)^T / sigma^2     over the pixels nearer to the mark than half its distance from the next
//! Cov(place) >= F^-1,      sigma^2 = noise^2 + 1 / (12 * 255^2)
//! ```
//! `I` is the photograph before noise, as part of the range; the second term is the rounding to 256 levels. A detector that knows the
//! whole board, its pose and the lens can do better: marks tell of each other.

use calibench::geometry::Vec2;
use calibench::raster::Raster;
use nalgebra::{Matrix2, Vector2};

/// Variance of a coordinate of a place, px^2: half the trace of the bound. `None` where nothing is seen, or the mark's surroundings are not
/// wholly in the image.
pub fn variance_px2(clean: &Raster<f32>, place: &Vec2, reach_px: f64, noise: f64) -> Option<f64> {
    let from = |at: f64| libm::ceil(at - reach_px);
    let to = |at: f64| libm::floor(at + reach_px);
    let inside = |at: f64, size: usize| from(at) >= 1.0 && to(at) <= size as f64 - 2.0;
    if !(inside(place.x, clean.width()) && inside(place.y, clean.height())) {
        return None;
    }
    let level = |x: usize, y: usize| f64::from(clean.get(x, y));
    let mut sum = Matrix2::zeros();
    for y in from(place.y) as usize..=to(place.y) as usize {
        for x in from(place.x) as usize..=to(place.x) as usize {
            let slope =
                Vector2::new(level(x + 1, y) - level(x - 1, y), level(x, y + 1) - level(x, y - 1)) * 0.5;
            sum += slope * slope.transpose();
        }
    }
    let of_rounding = 1.0 / (12.0 * 255.0 * 255.0);
    let bound = sum.try_inverse()? * (noise * noise + of_rounding);
    Some(0.5 * bound.trace()).filter(|variance| variance.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_tells_of_one_coordinate_only_and_a_corner_of_both() {
        let edge = Raster::from_fn(40, 40, |x, _| if x < 20 { 0.0 } else { 1.0 });
        assert_eq!(variance_px2(&edge, &Vec2::new(20.0, 20.0), 8.0, 0.01), None);
        let corner = Raster::from_fn(40, 40, |x, y| if (x < 20) == (y < 20) { 0.0 } else { 1.0 });
        let variance = variance_px2(&corner, &Vec2::new(19.5, 19.5), 8.0, 0.01).unwrap();
        // 16 rows, in each of which two pixels have a slope of a half; but for the crossing.
        let expected = (1e-4 + 1.0 / (12.0 * 255.0 * 255.0)) / 8.0;
        assert!((variance / expected - 1.0).abs() < 0.2, "{variance} {expected}");
        assert_eq!(variance_px2(&corner, &Vec2::new(3.0, 19.5), 8.0, 0.01), None, "reaches beyond the image");
    }
}
