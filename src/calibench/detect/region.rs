//! Which pixels lie in an ellipse, or between two? A run of columns in every row, so that no pixel is asked.

use super::blob::semi_axes;
use crate::geometry::Vec2;
use nalgebra::Matrix2;
use std::ops::Range;

/// An ellipse, read row by row.
#[derive(Debug, Clone, Copy)]
pub struct Region {
    centre: Vec2,
    half_height: f64,
    /// Half the width along the row through the centre.
    half_width: f64,
    /// Columns by which the middle of a row's run moves with each row.
    slope: f64,
}

impl Region {
    /// The ellipse with this covariance of area, every point of its outline moved outwards by at least
    /// `by_px` (inwards for a negative one); `None` where nothing is left.
    ///
    /// Semi-axes `a`, `b` become `a + c`, `b + c`. That is the covariance times `1 + 2 c / (a + b)` plus
    /// `(c^2 + 2 c a b / (a + b)) / 4` on the diagonal, and moves the outline by no less than `2 sqrt(a b) /
    /// (a + b)` of `c`, which `c` therefore exceeds `by_px` by.
    pub fn new(centre: Vec2, covariance: &Matrix2<f64>, by_px: f64) -> Option<Region> {
        let (b, a) = semi_axes(covariance);
        let c = by_px * (a + b) / (2.0 * (a * b).sqrt());
        let scale = 1.0 + 2.0 * c / (a + b);
        let round = 0.25 * (c * c + 2.0 * c * a * b / (a + b));
        let [xx, xy, yy] = [
            scale * covariance[(0, 0)] + round,
            scale * covariance[(0, 1)],
            scale * covariance[(1, 1)] + round,
        ];
        let determinant = xx * yy - xy * xy;
        (b + c > 0.0 && determinant > 0.0).then(|| Region {
            centre,
            half_height: 2.0 * yy.sqrt(),
            half_width: 2.0 * (determinant / yy).sqrt(),
            slope: xy / yy,
        })
    }

    /// The rows of an image of this height that it crosses.
    pub fn rows(&self, height: usize) -> Range<usize> {
        between(self.centre.y - self.half_height, self.centre.y + self.half_height, height)
    }

    /// Its columns in a row of this width; empty, about its middle, where it does not reach.
    pub fn columns(&self, y: usize, width: usize) -> Range<usize> {
        let dy = y as f64 - self.centre.y;
        let t = dy / self.half_height;
        let middle = self.centre.x + self.slope * dy;
        let half = self.half_width * (1.0 - t * t).max(0.0).sqrt();
        between(middle - half, middle + half, width)
    }
}

/// The whole numbers below `size` that lie between two others. Casts saturate.
fn between(low: f64, high: f64, size: usize) -> Range<usize> {
    let first_above = |x: f64| if x < 0.0 { 0 } else { (x as usize + 1).min(size) };
    let first = first_above(low);
    first..first_above(high).max(first)
}

/// The runs of a row that lie in `outer` but not in `inner`, left and right of it.
pub fn around(outer: &Range<usize>, inner: &Range<usize>) -> [Range<usize>; 2] {
    let start = inner.start.clamp(outer.start, outer.end);
    let end = inner.end.clamp(start, outer.end);
    [outer.start..start, end..outer.end]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn covariance(a: f64, b: f64, turn: f64) -> Matrix2<f64> {
        let (s, c) = libm::sincos(turn);
        let axes = Matrix2::new(c, -s, s, c);
        axes * Matrix2::new(0.25 * a * a, 0.0, 0.0, 0.25 * b * b) * axes.transpose()
    }

    proptest! {
        #[test]
        fn its_runs_hold_the_pixels_of_the_grown_ellipse(
            x in 5.0f64..55.0, y in 5.0f64..35.0, b in 1.5f64..10.0, ratio in 1.0f64..4.0, turn in 0.0f64..3.2, by in -1.4f64..6.0,
        ) {
            let (centre, a) = (Vec2::new(x, y), ratio * b);
            let (s, c) = libm::sincos(turn);
            let c_px = by * (a + b) / (2.0 * (a * b).sqrt());
            let Some(region) = Region::new(centre, &covariance(a, b, turn), by) else {
                prop_assert!(b + c_px < 1e-9);
                return Ok(());
            };
            let rows = region.rows(40);
            for row in 0..40 {
                let columns = if rows.contains(&row) { region.columns(row, 60) } else { 0..0 };
                for column in 0..60 {
                    let p = Vec2::new(column as f64, row as f64) - centre;
                    let along = (c * p.x + s * p.y) / (a + c_px);
                    let across = (c * p.y - s * p.x) / (b + c_px);
                    let rho_sq = along * along + across * across;
                    // Pixels on the outline belong to either side.
                    prop_assert!((rho_sq - 1.0).abs() < 1e-9 || columns.contains(&column) == (rho_sq < 1.0));
                }
            }
        }

        #[test]
        fn its_outline_keeps_the_distance(b in 1.5f64..10.0, ratio in 1.0f64..4.0, by in -1.0f64..6.0) {
            let a = ratio * b;
            let c = by * (a + b) / (2.0 * (a * b).sqrt());
            for i in 0..200 {
                let (s, k) = libm::sincos(f64::from(i) * 0.0314);
                // A point of the first outline moves to the same parameter of the second: along the first's
                // normal by this much.
                let normal = Vec2::new(b * k, a * s).normalize();
                let moved = normal.dot(&Vec2::new(c * k, c * s));
                prop_assert!(moved.abs() >= by.abs() * (1.0 - 1e-12));
            }
        }
    }

    #[test]
    fn a_ring_is_what_lies_left_and_right() {
        assert_eq!(around(&(2..9), &(4..6)), [2..4, 6..9]);
        assert_eq!(around(&(2..9), &(5..5)), [2..5, 5..9]);
        assert_eq!(around(&(2..9), &(0..12)), [2..2, 9..9]);
        assert_eq!(around(&(4..4), &(7..9)), [4..4, 4..4]);
    }
}
