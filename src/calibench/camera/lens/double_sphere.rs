//! The double sphere (Usenko, Demmel & Cremers 2018), two coefficients: a fisheye with an inverse in closed
//! form. With `xi = 0` it is the unified camera of Mei & Rives (2007).
//!
//! ```text
//! d1 = |(X, Y, Z)|,   w = xi d1 + Z,   d2 = sqrt(X^2 + Y^2 + w^2)
//! (x_d, y_d) = (X, Y) / (alpha d2 + (1 - alpha) w)
//! ```

use super::{LensModel, Projected, Real};
use crate::camera::{Parameter, UndistortError};
use crate::geometry::{Vec2, Vec3};
use std::cmp::Ordering;
use std::f64::consts::PI;

pub(super) struct DoubleSphere;

impl LensModel<2> for DoubleSphere {
    const PARAMETERS: [Parameter; 2] = [Parameter::Xi, Parameter::Alpha];
    type Constants<A: Real> = [A; 2];

    #[inline(always)]
    fn constants<A: Real>(coefficients: [A; 2]) -> [A; 2] {
        coefficients
    }

    #[inline(always)]
    fn project<A: Real>(&[xi, alpha]: &[A; 2], [x, y, z]: [A; 3]) -> Projected<A, 2> {
        let one = A::splat(1.0);
        let rr = x * x + y * y;
        let d1 = (rr + z * z).sqrt();
        let w = xi * d1 + z;
        let d2 = (rr + w * w).sqrt();
        let beta = one - alpha;
        let below = one / (alpha * d2 + beta * w);
        let (inverse_d1, inverse_d2) = (one / d1, one / d2);
        let (xd, yd) = (x * below, y * below);
        // Of the denominator: by w, then by X and Y at fixed w, then all together.
        let by_w = alpha * (w * inverse_d2) + beta;
        let pull = xi * inverse_d1;
        let direct = alpha * inverse_d2;
        let across = |q: A| direct * q + by_w * (pull * q);
        let (dx, dy, dz) = (across(x), across(y), by_w * (pull * z + one));
        let by = |image: A, d: A| -(image * d * below);
        let (by_xi, by_alpha) = (by_w * d1, d2 - w);
        Projected {
            at: [xd, yd],
            by_point: [
                [below + by(xd, dx), by(xd, dy), by(xd, dz)],
                [by(yd, dx), below + by(yd, dy), by(yd, dz)],
            ],
            by_lens: [[by(xd, by_xi), by(yd, by_xi)], [by(xd, by_alpha), by(yd, by_alpha)]],
            inside: below,
        }
    }

    fn monotone_angle(coefficients: &[f64; 2]) -> f64 {
        // The radius grows with the angle until its slope by the angle is 0: found between angles whose slope
        // has either sign.
        let slope = |angle: f64| {
            let (sin, cos) = (libm::sin(angle), libm::cos(angle));
            let p = DoubleSphere::project(coefficients, [sin, 0.0, cos]);
            if p.inside > 0.0 { p.by_point[0][0] * cos - p.by_point[0][2] * sin } else { -1.0 }
        };
        let steps = 720;
        let at = |k: i32| PI * f64::from(k) / f64::from(steps);
        let Some(first) = (1..=steps).find(|&k| slope(at(k)).partial_cmp(&0.0) != Some(Ordering::Greater))
        else {
            return PI;
        };
        let (mut low, mut high) = (at(first - 1), at(first));
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                return low;
            }
            if slope(middle) > 0.0 { low = middle } else { high = middle }
        }
    }

    fn ray(coefficients: &[f64; 2], at: &Vec2) -> Result<Vec3, UndistortError> {
        let [xi, alpha] = *coefficients;
        let rr = at.norm_squared();
        let root = 1.0 - (2.0 * alpha - 1.0) * rr;
        let refused = || {
            let limit = Self::monotone_angle(coefficients);
            let rim = DoubleSphere::project(coefficients, [libm::sin(limit), 0.0, libm::cos(limit)]);
            UndistortError::OutsideMonotoneRadius { x: at.x, y: at.y, radius: at.norm(), limit: rim.at[0] }
        };
        if root.is_nan() || root < 0.0 {
            return Err(refused());
        }
        let mz = (1.0 - alpha * alpha * rr) / (alpha * root.sqrt() + 1.0 - alpha);
        let under = mz * mz + (1.0 - xi * xi) * rr;
        if under.is_nan() || under < 0.0 {
            return Err(refused());
        }
        let scale = (mz * xi + under.sqrt()) / (mz * mz + rr);
        let ray = Vec3::new(scale * at.x, scale * at.y, scale * mz - xi).normalize();
        let back = DoubleSphere::project(coefficients, [ray.x, ray.y, ray.z]);
        let error = (Vec2::new(back.at[0], back.at[1]) - at).norm();
        if back.inside > 0.0 && error <= 1e-9 * (1.0 + at.norm()) { Ok(ray) } else { Err(refused()) }
    }
}
