//! How does a lens bend straight lines, and how is that undone exactly?
//!
//! In normalised coordinates `(x, y)` on the plane Z = 1, `s = r^2 = x^2 + y^2` (Brown 1971; the order and
//! signs of the coefficients are OpenCV's):
//!
//! ```text
//! g   = 1 + k1 s + k2 s^2 + k3 s^3
//! x_d = x g + 2 p1 x y + p2 (s + 2 x^2)
//! y_d = y g + p1 (s + 2 y^2) + 2 p2 x y
//! ```

use crate::geometry::Vec2;
use crate::geometry::lanes::Arithmetic;
use nalgebra::Matrix2;

/// Brown-Conrady distortion coefficients; all zero is an ideal lens.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BrownConrady {
    /// Radial, third order.
    pub k1: f64,
    /// Radial, fifth order.
    pub k2: f64,
    /// Tangential.
    pub p1: f64,
    /// Tangential.
    pub p2: f64,
    /// Radial, seventh order.
    pub k3: f64,
}

/// Why a distorted point has no undistorted one.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UndistortError {
    /// The point lies outside the image of the region in which the model is one-to-one.
    #[error(
        "distorted point ({x:.6}, {y:.6}) at radius {radius:.6} has no undistorted point: the model folds back beyond \
         distorted radius {limit:.6}"
    )]
    OutsideMonotoneRadius {
        /// Normalised x.
        x: f64,
        /// Normalised y.
        y: f64,
        /// Distance from the distortion centre.
        radius: f64,
        /// Largest distorted radius that the radial model reaches before it folds.
        limit: f64,
    },
    /// The coordinates are NaN or infinite.
    #[error("point ({x}, {y}) is not finite")]
    NotFinite {
        /// Normalised x.
        x: f64,
        /// Normalised y.
        y: f64,
    },
}

/// Steps of [`BrownConrady::radial_ratio`]. The start errs by about `e = 12 (k1 s)^3`; the steps leave some
/// `3 k1 s e^2`, its square, rounding. For `|k1 s| < 0.1`, most of what lenses do, that is 1e-2, 1e-5, 1e-11.
const NEWTON_STEPS: usize = 3;
/// A last step shorter than this leaves an error of its square, times a number of size 1: rounding.
const SETTLED: f64 = 1e-9;

/// The disc in which the radial map is one-to-one.
#[derive(Debug, Clone, Copy)]
pub(super) struct MonotoneDisc {
    /// Its radius, [`BrownConrady::monotone_radius`].
    radius: f64,
    /// The distorted radius of its rim.
    limit: f64,
}

/// What a few Newton steps found.
pub(super) struct RadialRatio<A> {
    /// Ideal over distorted radius.
    pub ratio: A,
    step: A,
    radius_sq: A,
}

impl<A: Arithmetic> RadialRatio<A> {
    /// Two numbers that are greater than 0 if the ratio is the root inside `disc`: it has settled, and its
    /// point lies inside, where the root is the only one.
    #[inline(always)]
    pub fn margins(&self, disc: &MonotoneDisc) -> [A; 2] {
        [
            A::splat(SETTLED * SETTLED) - self.step * self.step,
            A::splat(disc.radius * disc.radius) - self.radius_sq,
        ]
    }
}

impl BrownConrady {
    /// The radial model with two coefficients.
    pub fn radial(k1: f64, k2: f64) -> BrownConrady {
        BrownConrady { k1, k2, ..BrownConrady::default() }
    }

    /// Whether the lens is ideal.
    pub fn is_ideal(&self) -> bool {
        *self == BrownConrady::default()
    }

    /// `g(s) = 1 + k1 s + k2 s^2 + k3 s^3`.
    fn radial_factor(&self, s: f64) -> f64 {
        1.0 + s * (self.k1 + s * (self.k2 + s * self.k3))
    }

    /// `dg/ds`.
    fn radial_factor_slope(&self, s: f64) -> f64 {
        self.k1 + s * (2.0 * self.k2 + s * 3.0 * self.k3)
    }

    /// Slope of the radial map `r -> r g(r^2)`: `g + 2 s dg/ds`.
    fn radial_slope(&self, s: f64) -> f64 {
        1.0 + s * (3.0 * self.k1 + s * (5.0 * self.k2 + s * 7.0 * self.k3))
    }

    /// The distorted point. Domain: every finite point.
    pub fn distort(&self, ideal: &Vec2) -> Vec2 {
        let (x, y) = (ideal.x, ideal.y);
        let s = x * x + y * y;
        let g = self.radial_factor(s);
        let twice_xy = 2.0 * x * y;
        Vec2::new(
            x * g + self.p1 * twice_xy + self.p2 * (s + 2.0 * x * x),
            y * g + self.p1 * (s + 2.0 * y * y) + self.p2 * twice_xy,
        )
    }

    /// `d(x_d, y_d) / d(x, y)`, a symmetric 2 x 2 matrix.
    pub fn jacobian(&self, ideal: &Vec2) -> Matrix2<f64> {
        let (x, y) = (ideal.x, ideal.y);
        let s = x * x + y * y;
        let g = self.radial_factor(s);
        let twice_slope = 2.0 * self.radial_factor_slope(s);
        let off_diagonal = twice_slope * x * y + 2.0 * (self.p1 * x + self.p2 * y);
        Matrix2::new(
            g + twice_slope * x * x + 2.0 * self.p1 * y + 6.0 * self.p2 * x,
            off_diagonal,
            off_diagonal,
            g + twice_slope * y * y + 6.0 * self.p1 * y + 2.0 * self.p2 * x,
        )
    }

    /// The undistorted radius up to which the radial map `r g(r^2)` grows, infinite if it always does: the
    /// square root of the smallest positive root of `1 + 3 k1 s + 5 k2 s^2 + 7 k3 s^3`.
    pub fn monotone_radius(&self) -> f64 {
        smallest_positive_root([1.0, 3.0 * self.k1, 5.0 * self.k2, 7.0 * self.k3])
            .map_or(f64::INFINITY, f64::sqrt)
    }

    /// The region in which the radial map is one-to-one.
    pub(super) fn monotone_disc(&self) -> MonotoneDisc {
        let radius = self.monotone_radius();
        let limit =
            if radius.is_finite() { radius * self.radial_factor(radius * radius) } else { f64::INFINITY };
        MonotoneDisc { radius, limit }
    }

    /// The ideal point whose distorted image is `distorted`, to machine precision.
    ///
    /// The radial part is inverted first: by a few steps of Newton's method from a series, or, where those do
    /// not settle, by Newton's method kept inside a bracket (the map is monotone there, so it cannot fail).
    /// Newton's method in the plane then takes in the tangential part.
    ///
    /// # Errors
    /// Outside the image of the monotone disc there is no unique answer, and it is refused.
    pub fn undistort(&self, distorted: &Vec2) -> Result<Vec2, UndistortError> {
        self.undistort_within(distorted, &self.monotone_disc())
    }

    /// [`BrownConrady::undistort`] for many points: `disc` is that of this lens.
    pub(super) fn undistort_within(
        &self,
        distorted: &Vec2,
        disc: &MonotoneDisc,
    ) -> Result<Vec2, UndistortError> {
        let (x, y) = (distorted.x, distorted.y);
        if self.is_radial() {
            let quick = self.radial_ratio(x * x + y * y);
            if quick.margins(disc).iter().all(|&margin| margin > 0.0) {
                return Ok(Vec2::new(x * quick.ratio, y * quick.ratio));
            }
        }
        if !(x.is_finite() && y.is_finite()) {
            return Err(UndistortError::NotFinite { x, y });
        }
        let MonotoneDisc { radius: monotone_radius, limit } = *disc;
        let radius = distorted.norm();
        let outside = UndistortError::OutsideMonotoneRadius { x, y, radius, limit };
        if self.is_radial() {
            let ideal_radius = self.undistort_radius(radius, monotone_radius, limit).ok_or(outside)?;
            return Ok(if radius > 0.0 { distorted * (ideal_radius / radius) } else { *distorted });
        }
        // The tangential part may carry a point of the disc's rim a little outside: start from the rim then.
        let start_radius =
            self.undistort_radius(radius, monotone_radius, limit).unwrap_or(0.999 * monotone_radius);
        let start = if radius > 0.0 { distorted * (start_radius / radius) } else { *distorted };
        self.newton_in_plane(distorted, start)
            .filter(|ideal| ideal.norm() <= monotone_radius && self.jacobian(ideal).determinant() > 0.0)
            .ok_or(outside)
    }

    /// Whether there is no tangential part.
    pub(super) fn is_radial(&self) -> bool {
        self.p1 == 0.0 && self.p2 == 0.0
    }

    /// Ideal over distorted radius, `q`, for a squared distorted radius `s`: the root of `q g(q^2 s) = 1`, by
    /// a fixed number of Newton steps from the series `1 - k1 s + (3 k1^2 - k2) s^2`. The same operations for
    /// one point and for several at once.
    #[inline(always)]
    pub(super) fn radial_ratio<A: Arithmetic>(&self, s: A) -> RadialRatio<A> {
        let one = A::splat(1.0);
        let a = A::splat(self.k1) * s;
        let b = A::splat(self.k2) * s * s;
        let c = A::splat(self.k3) * s * s * s;
        let (a3, b5, c7) = (A::splat(3.0) * a, A::splat(5.0) * b, A::splat(7.0) * c);
        let mut ratio = one - a + (a3 * a - b);
        let square = ratio * ratio;
        let mut inverse_slope = one / (one + square * (a3 + square * (b5 + square * c7)));
        let mut step = one;
        for k in 0..NEWTON_STEPS {
            let square = ratio * ratio;
            if k > 0 {
                // The inverse follows the slope by a Newton step of its own: division is the slowest
                // operation.
                let slope = one + square * (a3 + square * (b5 + square * c7));
                inverse_slope = inverse_slope * (one + (one - slope * inverse_slope));
            }
            let excess = ratio * (one + square * (a + square * (b + square * c))) - one;
            step = excess * inverse_slope;
            ratio = ratio - step;
        }
        RadialRatio { ratio, step, radius_sq: ratio * ratio * s }
    }

    /// Solves `r g(r^2) = distorted_radius` on `[0, monotone_radius]`.
    fn undistort_radius(&self, distorted_radius: f64, monotone_radius: f64, limit: f64) -> Option<f64> {
        if distorted_radius > limit {
            return None;
        }
        let mut low = 0.0;
        let mut high = monotone_radius;
        let mut r = distorted_radius.min(monotone_radius);
        // 200 bisections of any finite bracket end at neighbouring numbers; Newton needs about five.
        for _ in 0..200 {
            let s = r * r;
            let excess = r * self.radial_factor(s) - distorted_radius;
            if excess == 0.0 {
                return Some(r);
            }
            if excess > 0.0 {
                high = r;
            } else {
                low = r;
            }
            let newton = r - excess / self.radial_slope(s);
            let next = if newton > low && newton < high {
                newton
            } else if high.is_finite() {
                0.5 * (low + high)
            } else {
                // No upper bound yet: the map grows at least linearly in the end, so doubling finds one.
                2.0 * r.max(distorted_radius)
            };
            if (next - r).abs() <= f64::EPSILON * 0.5 * r {
                return Some(next);
            }
            r = next;
        }
        Some(r)
    }

    /// Newton's method for `distort(ideal) = distorted`, with steps halved until they reduce the residual
    /// without leaving the region where the map keeps its orientation.
    fn newton_in_plane(&self, distorted: &Vec2, start: Vec2) -> Option<Vec2> {
        // A solution leaves only rounding; a point with no preimage leaves a distance.
        let rounding = 2.0 * f64::EPSILON * (1.0 + distorted.norm());
        let mut ideal = start;
        let mut residual = self.distort(&ideal) - distorted;
        for _ in 0..50 {
            let step = self.jacobian(&ideal).try_inverse()? * residual;
            let halved = (0..12).map(|halvings| ideal - step / f64::from(1 << halvings));
            let better = halved
                .map(|next| (next, self.distort(&next) - distorted))
                .find(|(next, at)| at.norm() < residual.norm() && self.jacobian(next).determinant() > 0.0);
            let Some((next, next_residual)) = better else { break };
            (ideal, residual) = (next, next_residual);
            if residual.norm() <= 0.25 * rounding {
                break;
            }
        }
        (residual.norm() <= 4.0 * rounding).then_some(ideal)
    }
}

/// Smallest positive root of `c0 + c1 s + c2 s^2 + c3 s^3` with `c0 > 0`, or `None` if it stays positive.
///
/// The extrema split the half-line into at most three monotone pieces; the first sign change is bisected.
fn smallest_positive_root(c: [f64; 4]) -> Option<f64> {
    let value = |s: f64| c[0] + s * (c[1] + s * (c[2] + s * c[3]));
    let mut previous = 0.0;
    for extremum in positive_extrema(c) {
        if value(extremum) <= 0.0 {
            return Some(bisect(value, previous, extremum));
        }
        previous = extremum;
    }
    // Behind the last extremum the sign of the leading coefficient decides.
    let leading = [c[3], c[2], c[1]].into_iter().find(|&x| x != 0.0)?;
    if leading > 0.0 {
        return None;
    }
    let mut high = if previous > 0.0 { 2.0 * previous } else { 1.0 };
    while value(high) > 0.0 {
        high *= 2.0;
        if !high.is_finite() {
            return None;
        }
    }
    Some(bisect(value, previous, high))
}

/// Positive roots of `c1 + 2 c2 s + 3 c3 s^2`, ascending.
fn positive_extrema(c: [f64; 4]) -> Vec<f64> {
    let (a, b, constant) = (3.0 * c[3], 2.0 * c[2], c[1]);
    let mut roots = if a == 0.0 {
        if b == 0.0 { vec![] } else { vec![-constant / b] }
    } else {
        let discriminant = b * b - 4.0 * a * constant;
        if discriminant < 0.0 {
            vec![]
        } else {
            // The form without cancellation.
            let q = -0.5 * (b + discriminant.sqrt().copysign(b));
            if q == 0.0 { vec![0.0] } else { vec![q / a, constant / q] }
        }
    };
    roots.retain(|s| *s > 0.0 && s.is_finite());
    roots.sort_by(f64::total_cmp);
    roots
}

/// The sign change of `value` between `low` (positive) and `high` (not positive).
fn bisect(value: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return low;
        }
        if value(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LENS: BrownConrady = BrownConrady { k1: -0.18, k2: 0.05, p1: 0.0, p2: 0.0, k3: 0.0 };

    #[test]
    fn the_monotone_radius_is_where_the_slope_vanishes() {
        // 1 - 0.54 s + 0.25 s^2 has no real root: this lens never folds.
        assert_eq!(LENS.monotone_radius(), f64::INFINITY);
        // 1 - 0.9 s = 0 at s = 10/9.
        let barrel = BrownConrady::radial(-0.3, 0.0);
        assert!((barrel.monotone_radius() - (10.0f64 / 9.0).sqrt()).abs() < 1e-15);
        let with_k3 = BrownConrady { k3: -0.1, ..LENS };
        assert!(with_k3.radial_slope(with_k3.monotone_radius().powi_2()).abs() < 1e-12);
    }

    trait Square {
        fn powi_2(self) -> f64;
    }
    impl Square for f64 {
        fn powi_2(self) -> f64 {
            self * self
        }
    }

    #[test]
    fn beyond_the_fold_there_is_no_inverse() {
        let barrel = BrownConrady::radial(-0.3, 0.0);
        // The largest reachable radius is (2/3) sqrt(10/9) = 0.7027.
        assert!(barrel.undistort(&Vec2::new(0.70, 0.0)).is_ok());
        let error = barrel.undistort(&Vec2::new(0.6, 0.5)).unwrap_err();
        assert!(
            matches!(error, UndistortError::OutsideMonotoneRadius { limit, .. } if (limit - 0.7027).abs() < 1e-4)
        );
        let tangential = BrownConrady { p1: 1e-3, ..barrel };
        assert!(tangential.undistort(&Vec2::new(0.9, 0.5)).is_err());
        assert!(matches!(LENS.undistort(&Vec2::new(f64::NAN, 0.0)), Err(UndistortError::NotFinite { .. })));
    }

    proptest! {
        #[test]
        fn the_quick_inverse_agrees_with_the_bracketed_one(
            k1 in -0.5f64..0.5, k2 in -0.3f64..0.3, k3 in -0.2f64..0.2, fraction in 0.0f64..0.9,
        ) {
            let lens = BrownConrady { k1, k2, k3, ..BrownConrady::default() };
            let disc = lens.monotone_disc();
            let radius = fraction * disc.limit.min(1.0);
            let quick = lens.radial_ratio(radius * radius);
            let settled = quick.margins(&disc).iter().all(|&margin| margin > 0.0);
            let slow = lens.undistort_radius(radius, disc.radius, disc.limit).unwrap();
            // Each errs by a few roundings over the slope of the map.
            let slope = lens.radial_slope(slow * slow);
            prop_assert!(!settled || (quick.ratio * radius - slow).abs() * slope <= 8.0 * f64::EPSILON * slow);
        }

        #[test]
        fn undistortion_is_exact_inside_the_monotone_disc(
            k1 in -0.5f64..0.5, k2 in -0.3f64..0.3, k3 in -0.2f64..0.2, p1 in -0.01f64..0.01, p2 in -0.01f64..0.01,
            angle in 0.0f64..std::f64::consts::TAU, fraction in 0.0f64..0.9,
        ) {
            let lens = BrownConrady { k1, k2, p1, p2, k3 };
            let radius = fraction * lens.monotone_radius().min(1.0);
            let ideal = Vec2::new(radius * libm::cos(angle), radius * libm::sin(angle));
            prop_assume!(lens.jacobian(&ideal).determinant() > 0.05);
            let back = lens.undistort(&lens.distort(&ideal)).unwrap();
            // The inverse amplifies rounding by 1/det; 20 covers det > 0.05.
            prop_assert!((back - ideal).norm() <= 20.0 * 8.0 * f64::EPSILON, "{:e}", (back - ideal).norm());
        }
    }
}
