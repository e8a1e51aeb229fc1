//! The division model (Lenz 1987; Fitzgibbon 2001), one coefficient: what machine vision uses most.
//!
//! The ideal point is the distorted one divided, so that the inverse is the simple direction:
//!
//! ```text
//! (x, y) = (x_d, y_d) / (1 + k1 r_d^2),   (x_d, y_d) = 2 (x, y) / (1 + sqrt(1 - 4 k1 s)),   s = x^2 + y^2
//! ```
//! With `k1 > 0` only ideal points with `s < 1 / (4 k1)` have images; `k1 < 0` is a barrel.

use super::pinhole::{self, Bent};
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
    fn project<A: Real>(&[k1]: &[A; 1], point: [A; 3]) -> Projected<A, 1> {
        let mut root = A::splat(0.0);
        let mut projected = pinhole::project(point, |[x, y]| {
            let (one, two) = (A::splat(1.0), A::splat(2.0));
            let s = x * x + y * y;
            root = (one - A::splat(4.0) * (k1 * s)).sqrt();
            let g = two / (one + root);
            let square = g * g / root;
            // dg/ds = k1 g^2 / root, dg/dk1 = s g^2 / root.
            let twice_slope = two * (k1 * square);
            let cross = twice_slope * (x * y);
            let by_k1 = s * square;
            Bent {
                at: [x * g, y * g],
                by_ideal: [[g + twice_slope * (x * x), cross], [cross, g + twice_slope * (y * y)]],
                by_lens: [[by_k1 * x, by_k1 * y]],
            }
        });
        projected.inside = projected.inside.min(root);
        projected
    }

    fn monotone_angle(&[k1]: &[f64; 1]) -> f64 {
        if k1 > 0.0 { libm::atan(0.5 / k1.sqrt()) } else { std::f64::consts::FRAC_PI_2 }
    }

    fn ray(&[k1]: &[f64; 1], at: &Vec2) -> Result<Vec3, UndistortError> {
        let square = k1 * at.norm_squared();
        // Beyond r_d^2 = 1 / |k1| lie the images of nothing: behind the camera, or the other root's.
        if square.abs() < 1.0 || (square == 0.0) {
            return Ok(pinhole::ray_of(&(at / (1.0 + square))));
        }
        Err(pinhole::outside(at, 1.0 / k1.abs().sqrt()))
    }
}
