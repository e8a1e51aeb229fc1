//! The thin-prism model behind a tilted sensor, fourteen coefficients (Scheimpflug; OpenCV's
//! `CALIB_TILTED_MODEL`, after Louhichi et al. 2007).
//!
//! With `R = R_y(tau_y) R_x(tau_x)`, `(x_t, y_t)` the point that the thin-prism model gives,
//!
//! ```text
//! q = R (x_t, y_t, 1),   x_d = (R33 q_x - R13 q_z) / q_z,   y_d = (R33 q_y - R23 q_z) / q_z
//! R_x = [[1, 0, 0], [0, cos, sin], [0, -sin, cos]],   R_y = [[cos, 0, -sin], [0, 1, 0], [sin, 0, cos]]
//! ```

use super::pinhole::{self, Bent};
use super::thin_prism::{self, ThinPrism};
use super::{LensModel, Projected, Real, rational};
use crate::camera::{Parameter, UndistortError};
use crate::geometry::{Vec2, Vec3};

pub(super) struct Tilted;

/// Coefficients, and sines and cosines of the tilts.
#[derive(Clone, Copy)]
pub(super) struct Constants<A> {
    prism: [A; 12],
    /// `sin tau_x, cos tau_x, sin tau_y, cos tau_y`.
    tilt: [A; 4],
}

impl LensModel<14> for Tilted {
    const PARAMETERS: [Parameter; 14] = {
        use Parameter::*;
        [K1, K2, P1, P2, K3, K4, K5, K6, S1, S2, S3, S4, TauX, TauY]
    };
    type Constants<A: Real> = Constants<A>;

    #[inline(always)]
    fn constants<A: Real>(c: [A; 14]) -> Constants<A> {
        let (tx, ty) = (c[12], c[13]);
        Constants { prism: std::array::from_fn(|i| c[i]), tilt: [tx.sin(), tx.cos(), ty.sin(), ty.cos()] }
    }

    #[inline(always)]
    fn project<A: Real>(constants: &Constants<A>, point: [A; 3]) -> Projected<A, 14> {
        pinhole::project(point, |ideal| tilt(&constants.tilt, thin_prism::bend(&constants.prism, ideal)))
    }

    fn monotone_angle(coefficients: &[f64; 14]) -> f64 {
        ThinPrism::monotone_angle(&prism_part(coefficients))
    }

    fn ray(coefficients: &[f64; 14], at: &Vec2) -> Result<Vec3, UndistortError> {
        let constants = Tilted::constants(*coefficients);
        let upright = untilted(&constants.tilt, at);
        let limit = rational::monotone_radius(&thin_prism::rational_part(coefficients));
        let start = rational::radial_start(&thin_prism::rational_part(coefficients), &upright);
        pinhole::inverse::<Tilted, 14>(coefficients, at, start, limit)
            .map(|ideal| pinhole::ray_of(&ideal))
            .ok_or_else(|| pinhole::outside(at, limit))
    }
}

fn prism_part(coefficients: &[f64; 14]) -> [f64; 12] {
    std::array::from_fn(|i| coefficients[i])
}

/// `R`, row by row.
#[inline(always)]
fn rotation<A: Real>([sx, cx, sy, cy]: &[A; 4]) -> [[A; 3]; 3] {
    let (sx, cx, sy, cy) = (*sx, *cx, *sy, *cy);
    [[cy, sy * sx, -(sy * cx)], [A::splat(0.0), cx, sx], [sy, -(cy * sx), cy * cx]]
}

/// The image on the tilted sensor of what the lens gives.
#[inline(always)]
fn tilt<A: Real>(angles: &[A; 4], bent: Bent<A, 12>) -> Bent<A, 14> {
    let [sx, cx, sy, cy] = *angles;
    let r = rotation(angles);
    let [x, y] = bent.at;
    let q = r.map(|[a, b, c]| a * x + b * y + c);
    let inverse = A::splat(1.0) / q[2];
    let (px, py) = (q[0] * inverse, q[1] * inverse);
    let r33 = r[2][2];
    // What a change of q moves the image by.
    let moved = |d: [A; 3]| [r33 * ((d[0] - px * d[2]) * inverse), r33 * ((d[1] - py * d[2]) * inverse)];
    let by_x = moved([r[0][0], r[1][0], r[2][0]]);
    let by_y = moved([r[0][1], r[1][1], r[2][1]]);
    let through = |[dx, dy]: [A; 2]| [by_x[0] * dx + by_y[0] * dy, by_x[1] * dx + by_y[1] * dy];
    let zero = A::splat(0.0);
    // d R / d tau_x and d R / d tau_y, and with them those of R33, R13, R23.
    let by_tau_x = tilted_by(
        [[zero, sy * cx, sy * sx], [zero, -sx, cx], [zero, -(cy * cx), -(cy * sx)]],
        [x, y],
        [px, py],
        &moved,
    );
    let by_tau_y = tilted_by(
        [[-sy, cy * sx, -(cy * cx)], [zero, zero, zero], [cy, sy * sx, -(sy * cx)]],
        [x, y],
        [px, py],
        &moved,
    );
    let [[a, b], [c, d]] = bent.by_ideal;
    let ([ax, ay], [bx, by]) = (through([a, c]), through([b, d]));
    Bent {
        at: [r33 * px - r[0][2], r33 * py - r[1][2]],
        by_ideal: [[ax, bx], [ay, by]],
        by_lens: std::array::from_fn(|i| match i {
            12 => by_tau_x,
            13 => by_tau_y,
            _ => through(bent.by_lens[i]),
        }),
        inside: bent.inside.min(q[2]),
    }
}

/// The derivative by an angle, from that of `R`.
#[inline(always)]
fn tilted_by<A: Real>(
    d: [[A; 3]; 3],
    [x, y]: [A; 2],
    [px, py]: [A; 2],
    moved: &impl Fn([A; 3]) -> [A; 2],
) -> [A; 2] {
    let along = moved(d.map(|[a, b, c]| a * x + b * y + c));
    [along[0] + d[2][2] * px - d[0][2], along[1] + d[2][2] * py - d[1][2]]
}

/// The point that the lens gave: `(x_t, y_t, 1)` is along `R^T (p_x, p_y, 1)`.
fn untilted(angles: &[f64; 4], at: &Vec2) -> Vec2 {
    let r = rotation(angles);
    let p = [(at.x + r[0][2]) / r[2][2], (at.y + r[1][2]) / r[2][2], 1.0];
    let q: [f64; 3] = std::array::from_fn(|j| (0..3).map(|i| r[i][j] * p[i]).sum());
    Vec2::new(q[0] / q[2], q[1] / q[2])
}
