//! How does coverage fall across the edge of a mark? The edge of a square pixel's view, sharp or soft.
//!
//! A pixel crossed by a straight edge of normal `n` sees the edge through boxes of widths `|nx|` and `|ny|`;
//! a soft lens adds a spread of its own. Below a blur of about three quarters of a pixel the orientation
//! matters (a sharp edge along a row is a ramp of exactly one pixel, a diagonal one a parabola-ramp of 1.41),
//! and treating it as isotropic would move centres by some thousandths of a pixel with their phase on the
//! grid. Softer edges are isotropic to that accuracy.

use crate::geometry::Vec2;
use crate::geometry::lanes::Lanes;

/// Half-width of the soft model that has the variance of a sharp edge, 1/12: `sqrt(5 / 12)` px.
pub const SHARPEST_EDGE_PX: f64 = 0.645_497_224_367_902_8;

/// `integral S (1 - S) dd / h` of the soft model: 9/35.
pub const SPREAD_PER_WIDTH: f64 = 9.0 / 35.0;

/// The narrowest box: a narrower one changes no coverage by more than 1e-3 and divides by almost nothing.
const LEAST_BOX_PX: f64 = 0.02;

/// Lens boxes up to which the pixel's orientation shows, px: two of 1.8 px have the variance of a Gaussian of
/// 0.73 px.
const WIDEST_LENS_PX: f64 = 1.8;

/// A model of the edge: coverage as a function of the distance from the edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Edge {
    /// Boxes of `|nx|`, `|ny|` and twice this width: two boxes are a triangle, near enough to a Gaussian.
    Sharp {
        /// Width of each of the boxes that stand for the lens, px.
        lens_px: f64,
    },
    /// The integral of Epanechnikov's parabola: `S(t) = 1/2 - 3/4 t + 1/4 t^3`, `t = d / h` in -1 ... 1,
    /// variance `h^2 / 5`.
    Soft {
        /// `h`, px.
        half_width_px: f64,
    },
}

impl Edge {
    /// The model of an edge whose variance is `half_width_px^2 / 5`.
    pub fn new(half_width_px: f64) -> Edge {
        match Edge::of_boxes(half_width_px) {
            Edge::Sharp { lens_px } if lens_px >= WIDEST_LENS_PX => Edge::Soft { half_width_px },
            sharp => sharp,
        }
    }

    /// The same of boxes, however soft: nearer to a Gaussian than the parabola's integral, and slower. Where
    /// only a part of an edge is looked at, its shape matters.
    pub fn of_boxes(half_width_px: f64) -> Edge {
        // Variance 1/12 of the pixel and c^2 / 12 of each of two boxes of width c.
        let lens_px = (1.2 * half_width_px * half_width_px - 0.5).max(0.0).sqrt();
        Edge::Sharp { lens_px: lens_px.max(LEAST_BOX_PX) }
    }

    /// Distance from which coverage is 0 outside and 1 inside, whatever the direction.
    pub fn reach_px(&self) -> f64 {
        match *self {
            Edge::Sharp { lens_px } => 0.5 * (std::f64::consts::SQRT_2 + LEAST_BOX_PX) + lens_px,
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
                four_boxes(d, n.x.abs().max(LEAST_BOX_PX), n.y.abs().max(LEAST_BOX_PX), lens_px)
            }
        }
    }
}

/// An edge of one normal, for four distances at once.
#[derive(Debug, Clone, Copy)]
pub enum LaneEdge {
    /// Offsets of the sixteen corners of the boxes, equal ones together, with their weights.
    Sharp {
        /// Offsets and weights.
        corners: [(f64, f64); 12],
        /// `a b c^2`.
        volume: f64,
        /// [`Edge::reach_px`].
        reach_px: f64,
    },
    /// [`Edge::Soft`].
    Soft {
        /// `h`, px.
        half_width_px: f64,
    },
}

impl LaneEdge {
    /// The edge of this normal.
    pub fn new(edge: &Edge, n: &Vec2) -> LaneEdge {
        match *edge {
            Edge::Soft { half_width_px } => LaneEdge::Soft { half_width_px },
            Edge::Sharp { lens_px: c } => {
                let (a, b) = (n.x.abs().max(LEAST_BOX_PX), n.y.abs().max(LEAST_BOX_PX));
                let pixel = [(a + b, 1.0), (a - b, -1.0), (b - a, -1.0), (-a - b, 1.0)];
                let lens = [(c, 1.0), (0.0, -2.0), (-c, 1.0)];
                let corners = std::array::from_fn(|k| {
                    let ((pixel, sign), (lens, weight)) = (pixel[k / 3], lens[k % 3]);
                    (0.5 * pixel + lens, sign * weight)
                });
                LaneEdge::Sharp { corners, volume: a * b * c * c, reach_px: edge.reach_px() }
            }
        }
    }

    /// [`Edge::coverage`] at any distance: beyond the reach it is that of the reach.
    #[inline(always)]
    pub(crate) fn coverage<L: Lanes>(&self, d: L) -> (L, L) {
        let clamped = |d: L, most: f64| -((-d.max(L::splat(-most))).max(L::splat(-most)));
        match self {
            LaneEdge::Soft { half_width_px } => {
                let t = clamped(d * L::splat(1.0 / half_width_px), 1.0);
                let square = t * t;
                let covered = L::splat(0.5) - t * (L::splat(0.75) - L::splat(0.25) * square);
                (covered, L::splat(0.75 / half_width_px) * (L::splat(1.0) - square))
            }
            LaneEdge::Sharp { corners, volume, reach_px } => {
                let d = clamped(d, *reach_px);
                let (mut cubes, mut fourths) = (L::zero(), L::zero());
                for (offset, weight) in corners {
                    let x = (d + L::splat(*offset)).max(L::zero());
                    let cube = L::splat(*weight) * (x * x * x);
                    cubes = cubes + cube;
                    fourths = fourths + cube * x;
                }
                (
                    L::splat(1.0) - fourths * L::splat(1.0 / (24.0 * volume)),
                    cubes * L::splat(1.0 / (6.0 * volume)),
                )
            }
        }
    }
}

/// A step seen through four boxes: `1 - F(d)` and the density `f(d)` of the sum of uniform numbers of widths
/// a, b, c and c. With `x_+ = max(x, 0)`, `F = sum of s (d + (+-a +-b +-c +-c) / 2)_+^4 / (24 a b c^2)` over
/// the sixteen sign choices, `s` their product; the two lens boxes together give offsets `-c, 0, c` of weight
/// `1, -2, 1`.
fn four_boxes(d: f64, a: f64, b: f64, c: f64) -> (f64, f64) {
    let (mut cubes, mut fourths) = (0.0, 0.0);
    for (pixel, sign) in [(a + b, 1.0), (a - b, -1.0), (b - a, -1.0), (-a - b, 1.0)] {
        for (lens, weight) in [(c, 1.0), (0.0, -2.0), (-c, 1.0)] {
            let x = (d + 0.5 * pixel + lens).max(0.0);
            let cube = sign * weight * x * x * x;
            cubes += cube;
            fourths += cube * x;
        }
    }
    let volume = a * b * c * c;
    (1.0 - fourths / (24.0 * volume), cubes / (6.0 * volume))
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
            // The narrowest lens adds 2 x 0.02^2 / 12 = 6.7e-5.
            let asked = half_width_px * half_width_px / 5.0;
            assert!((variance - asked).abs() < 7.5e-5, "{variance} {asked}");
        }
    }
}
