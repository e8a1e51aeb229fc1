//! The division model (Lenz 1987; Fitzgibbon 2001), one coefficient: what machine vision uses most.
//!
//! The ideal point is the distorted one divided by `1 + k1 r_d^2`, so that the inverse is the simple
//! direction. As rays, which go on beyond 90 degrees from the axis where `1 + k1 r_d^2` is negative:
//!
//! ```text
//! (X, Y, Z) ~ (x_d, y_d, 1 + k1 r_d^2),   (x_d, y_d) = 2 (X, Y) / (Z + sqrt(Z^2 - 4 k1 s)),   s = X^2 + Y^2
//! ```
//! With `k1 > 0` only points with `Z > 2 sqrt(k1 s)` have images; `k1 < 0` is a barrel, and all points have
//! one but those exactly behind.

use super::pinhole;
use super::{LensModel, Projected, Real};
use crate::camera::{Parameter, UndistortError};
use crate::geometry::{Vec2, Vec3};

pub(super) struct Division;

impl LensModel<1> for Division {
    const PARAMETERS: [Parameter; 1] = [Parameter::K1];
    type Constants<A: Real> = [A; 1];

    #[inline(always)]
    fn constants<A: Real>(coefficients: [A; 1]) -> [A; 1] {
        coefficients
    }

    #[inline(always)]
    fn project<A: Real>(&[k1]: &[A; 1], [x, y, z]: [A; 3]) -> Projected<A, 1> {
        let two = A::splat(2.0);
        let (k, s) = (A::splat(4.0) * k1, x * x + y * y);
        let square = z * z - k * s;
        let root = square.sqrt();
        let denominator = z + root;
        let g = two / denominator;
        // d denominator / d (X, Y, Z, k1) = (-4 k1 X, -4 k1 Y, root + Z, -2 s) / root, and dg = -g^2 / 2 of
        // that.
        let slope = g * g / root;
        let (across, along) = (two * (k1 * slope), -(A::splat(0.5) * (slope * (root + z))));
        let cross = across * (x * y);
        let by_k1 = slope * s;
        Projected {
            at: [x * g, y * g],
            by_point: [[g + across * (x * x), cross, along * x], [cross, g + across * (y * y), along * y]],
            by_lens: [[by_k1 * x, by_k1 * y]],
            inside: square.min(denominator),
        }
    }

    fn monotone_angle(&[k1]: &[f64; 1]) -> f64 {
        if k1 > 0.0 {
            libm::atan(0.5 / k1.sqrt())
        } else if k1 < 0.0 {
            std::f64::consts::PI
        } else {
            std::f64::consts::FRAC_PI_2
        }
    }

    fn ray(&[k1]: &[f64; 1], at: &Vec2) -> Result<Vec3, UndistortError> {
        let square = k1 * at.norm_squared();
        // With k1 > 0 the images beyond r_d^2 = 1 / k1 would be those of the other root.
        if square < 1.0 && at.norm_squared().is_finite() {
            return Ok(Vec3::new(at.x, at.y, 1.0 + square).normalize());
        }
        Err(pinhole::outside(at, 1.0 / k1.abs().sqrt()))
    }
}
