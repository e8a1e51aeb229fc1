//! How does coverage fall across the edge of a mark? The edge of a square pixel's view, sharp or soft.
//!
//! A pixel crossed by a straight edge of normal `n` sees the edge through boxes of widths `|nx|` and `|ny|`; a soft lens
//! adds a spread of its own. Below a blur of about a third of a pixel the orientation matters (a sharp edge along a row is
//! a ramp of exactly one pixel, a diagonal one a parabola-ramp of 1.41), and treating it as isotropic would move centres by
//! some thousandths of a pixel with their phase on the grid. Softer edges are isotropic to that accuracy.

use crate::geometry::Vec2;

/// Half-width of the soft model that has the variance of a sharp edge, 1/12: `sqrt(5 / 12)` px.
pub const SHARPEST_EDGE_PX: f64 = 0.645_497_224_367_902_8;

/// `integral S (1 - S) dd / h` of the soft model: 9/35.
pub const SPREAD_PER_WIDTH: f64 = 9.0 / 35.0;

/// The narrowest box: a narrower one changes no coverage by more than 1e-3 and divides by almost nothing.
const LEAST_BOX_PX: f64 = 0.02;

/// A model of the edge: coverage as a function of the distance from the edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Edge {
    /// Boxes of `|nx|`, `|ny|` and this width.
    Sharp {
        /// Width of the box that stands for the lens, px.
        lens_px: f64,
    },
    /// The integral of Epanechnikov's parabola: `S(t) = 1/2 - 3/4 t + 1/4 t^3`, `t = d / h` in -1 ... 1, variance `h^2 / 5`.
    Soft {
        /// `h`, px.
        half_width_px: f64,
    },
}

impl Edge {
    /// The model of an edge whose variance is `half_width_px^2 / 5`.
    pub fn new(half_width_px: f64) -> Edge {
        // Variance 1/12 of the pixel and w^2 / 12 of a box of width w.
        let lens_px = (2.4 * half_width_px * half_width_px - 1.0).max(0.0).sqrt();
        if lens_px < 1.0 {
            Edge::Sharp { lens_px: lens_px.max(LEAST_BOX_PX) }
        } else {
            Edge::Soft { half_width_px }
        }
    }

    /// Distance from which coverage is 0 outside and 1 inside, whatever the direction.
    pub fn reach_px(&self) -> f64 {
        match *self {
            Edge::Sharp { lens_px } => 0.5 * (std::f64::consts::SQRT_2 + LEAST_BOX_PX + lens_px),
            Edge::Soft { half_width_px } => half_width_px,
        }
    }

    /// Coverage at distance `d` outside an edge of normal `n`, and `-dS/dd`. Domain: `|d| <= reach`.
    pub fn coverage(&self, d: f64, n: &Vec2) -> (f64, f64) {
        match *self {
            Edge::Soft { half_width_px } => {
                let t = (d / half_width_px).clamp(-1.0, 1.0);
                (0.5 - t * (0.75 - 0.25 * t * t), 0.75 * (1.0 - t * t) / half_width_px)
            }
            Edge::Sharp { lens_px } => {
                three_boxes(d, n.x.abs().max(LEAST_BOX_PX), n.y.abs().max(LEAST_BOX_PX), lens_px)
            }
        }
    }
}

/// A step seen through three boxes: `1 - F(d)` and the density `f(d)` of the sum of three uniform numbers of widths a, b, c.
/// `F = sum of s (d + (+-a +-b +-c) / 2)_+^3 / (6 a b c)` over the eight sign choices, `s` their product.
fn three_boxes(d: f64, a: f64, b: f64, c: f64) -> (f64, f64) {
    let (a, b, c) = (0.5 * a, 0.5 * b, 0.5 * c);
    let (mut cubes, mut squares) = (0.0, 0.0);
    for (offset, sign) in [
        (a + b + c, 1.0),
        (a + b - c, -1.0),
        (a - b + c, -1.0),
        (b + c - a, -1.0),
        (a - b - c, 1.0),
        (b - a - c, 1.0),
        (c - a - b, 1.0),
        (-a - b - c, -1.0),
    ] {
        let x = (d + offset).max(0.0);
        let square = sign * x * x;
        squares += square;
        cubes += square * x;
    }
    let volume = 8.0 * a * b * c;
    (1.0 - cubes / (6.0 * volume), squares / (2.0 * volume))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sharp_edge_along_a_row_is_a_ramp_of_one_pixel() {
        let edge = Edge::new(SHARPEST_EDGE_PX);
        for d in [-0.45, -0.2, 0.0, 0.3] {
            let (coverage, slope) = edge.coverage(d, &Vec2::new(0.0, 1.0));
            assert!((coverage - (0.5 - d)).abs() < 1e-9 && (slope - 1.0).abs() < 1e-9, "{d}");
        }
    }

    #[test]
    fn both_models_fall_from_one_to_zero_with_the_asked_variance() {
        for half_width_px in [SHARPEST_EDGE_PX, 0.8, 0.9, 1.2, 3.0] {
            let edge = Edge::new(half_width_px);
            let n = Vec2::new(0.8, 0.6);
            let steps = 4000;
            let width = 2.0 * edge.reach_px() / f64::from(steps);
            let (mut total, mut variance) = (0.0, 0.0);
            for i in 0..steps {
                let d = -edge.reach_px() + (f64::from(i) + 0.5) * width;
                let (_, slope) = edge.coverage(d, &n);
                total += slope * width;
                variance += d * d * slope * width;
                let h = 1e-5;
                let difference = (edge.coverage(d - h, &n).0 - edge.coverage(d + h, &n).0) / (2.0 * h);
                assert!((difference - slope).abs() < 1e-4);
            }
            assert!((edge.coverage(-edge.reach_px(), &n).0 - 1.0).abs() < 1e-9);
            assert!(edge.coverage(edge.reach_px(), &n).0.abs() < 1e-9);
            assert!((total - 1.0).abs() < 1e-5, "{total}");
            // The narrowest box adds 0.02^2 / 12.
            let asked = half_width_px * half_width_px / 5.0;
            assert!((variance - asked).abs() < 5e-5, "{variance} {asked}");
        }
    }
}
