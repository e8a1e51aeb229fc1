//! The fisheye of Kannala & Brandt (2006), as in OpenCV's `fisheye`: the radius is a polynomial of the angle.
//!
//! With `r = sqrt(X^2 + Y^2)` and the angle from the axis `theta = atan2(r, Z)`
//!
//! ```text
//! d(theta) = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8),   (x_d, y_d) = d(theta) (X, Y) / r
//! ```
//! With all coefficients 0 it is the equidistant projection. Points beside and behind the camera have images.

use super::roots::{inverse_of_growing, smallest_positive_root};
use super::{LensModel, Projected, Real};
use crate::camera::{Parameter, UndistortError};
use crate::geometry::{Vec2, Vec3};
use std::f64::consts::PI;

pub(super) struct KannalaBrandt;

/// Added to `r^2`, so that a point on the axis has a direction too: no digit of any other point feels it.
const ON_AXIS: f64 = 1e-280;

impl LensModel<4> for KannalaBrandt {
    const PARAMETERS: [Parameter; 4] = [Parameter::K1, Parameter::K2, Parameter::K3, Parameter::K4];
    type Constants<A: Real> = [A; 4];

    #[inline(always)]
    fn constants<A: Real>(coefficients: [A; 4]) -> [A; 4] {
        coefficients
    }

    #[inline(always)]
    fn project<A: Real>(&[k1, k2, k3, k4]: &[A; 4], [x, y, z]: [A; 3]) -> Projected<A, 4> {
        let one = A::splat(1.0);
        let rr = x * x + y * y + A::splat(ON_AXIS);
        let nn = rr + z * z;
        let r = rr.sqrt();
        let theta = r.atan2(z);
        let t = theta * theta;
        let d = theta * (one + t * (k1 + t * (k2 + t * (k3 + t * k4))));
        let slope = one
            + t * (A::splat(3.0) * k1
                + t * (A::splat(5.0) * k2 + t * (A::splat(7.0) * k3 + t * (A::splat(9.0) * k4))));
        let inverse_r = one / r;
        let scale = d * inverse_r;
        // theta moves by (Z dr - r dZ) / n^2, and dr = (X dX + Y dY) / r.
        let by_theta = slope / nn;
        let across = (by_theta * z - scale) * (inverse_r * inverse_r);
        let xy = across * x * y;
        let turn = theta * t * inverse_r;
        let k = |power: A| [turn * power * x, turn * power * y];
        Projected {
            at: [scale * x, scale * y],
            by_point: [
                [scale + across * x * x, xy, -(by_theta * x)],
                [xy, scale + across * y * y, -(by_theta * y)],
            ],
            by_lens: [k(one), k(t), k(t * t), k(t * t * t)],
            // All but what lies exactly behind.
            inside: z + nn.sqrt(),
        }
    }

    fn monotone_angle(&[k1, k2, k3, k4]: &[f64; 4]) -> f64 {
        smallest_positive_root(&[1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3, 9.0 * k4])
            .map_or(PI, |t| t.sqrt().min(PI))
    }

    fn ray(coefficients: &[f64; 4], at: &Vec2) -> Result<Vec3, UndistortError> {
        let [k1, k2, k3, k4] = *coefficients;
        let d = |theta: f64| {
            let t = theta * theta;
            let value = theta * (1.0 + t * (k1 + t * (k2 + t * (k3 + t * k4))));
            (value, 1.0 + t * (3.0 * k1 + t * (5.0 * k2 + t * (7.0 * k3 + t * 9.0 * k4))))
        };
        let limit = Self::monotone_angle(coefficients);
        let radius = at.norm();
        let theta = inverse_of_growing(d, radius, radius, limit)
            .ok_or(UndistortError::OutsideMonotoneRadius { x: at.x, y: at.y, radius, limit: d(limit).0 })?;
        let across = if radius > 0.0 { libm::sin(theta) / radius } else { 0.0 };
        Ok(Vec3::new(across * at.x, across * at.y, libm::cos(theta)))
    }
}
