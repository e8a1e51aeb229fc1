//! What do the closed forms say? Tsai & Lenz 1989 as published, and Park & Martin 1994.

use super::motions::Motion;
use super::{HandEyeError, rotation_vector};
use crate::geometry::{Mat3, Pose, Vec3, rotation};

/// Below this a rotation has no axis: rounding has 1e-16.
const NO_AXIS_RAD: f64 = 1e-9;
/// The least eigenvalue of the normal matrix, as part of the largest, falls with the square of what is
/// missing to a half turn: less than a millionth of a radian here, where rounding has eaten the solution.
const HALF_TURN: f64 = 1e-12;

/// Tsai & Lenz 1989, eqs. 10, 12, 14 and 15. Their `P = 2 sin(angle / 2) axis`; their `P_g` and `P_c` are
/// those of our `A` and `B`, their `P_cg` that of `X`:
///
/// ```text
/// skew(P_g + P_c) P' = P_c - P_g,    P = 2 P' / sqrt(1 + |P'|^2)
/// ```
///
/// over all motions by least squares. The translation follows from the rotation.
pub(super) fn tsai_lenz(motions: &[Motion]) -> Result<Pose, HandEyeError> {
    let (mut normal, mut right) = (Mat3::zeros(), Vec3::zeros());
    for motion in motions {
        let (Some(g), Some(c)) = (half_sine_vector(&motion.a), half_sine_vector(&motion.b)) else { continue };
        let matrix = rotation::skew(&(g + c));
        normal += matrix.transpose() * matrix;
        right += matrix.transpose() * (c - g);
    }
    // At a half turn of X all sums lie along its axis, about which nothing is then said.
    let eigenvalues = normal.symmetric_eigenvalues();
    if eigenvalues.min() <= HALF_TURN * eigenvalues.max() {
        return Err(HandEyeError::HalfTurn);
    }
    let tangent = normal.cholesky().ok_or(HandEyeError::HalfTurn)?.solve(&right);
    let p = tangent * (2.0 / (1.0 + tangent.norm_squared()).sqrt());
    let square = p.norm_squared();
    let rotation = Mat3::identity() * (1.0 - 0.5 * square)
        + (p * p.transpose() + rotation::skew(&p) * (4.0 - square).max(0.0).sqrt()) * 0.5;
    Ok(Pose { rotation, translation: translation(motions, &rotation)? })
}

/// `2 sin(angle / 2) axis`; `None` without an axis.
fn half_sine_vector(pose: &Pose) -> Option<Vec3> {
    let w = rotation_vector(pose);
    let angle = w.norm();
    (angle > NO_AXIS_RAD).then(|| w * (2.0 * libm::sin(0.5 * angle) / angle))
}

/// Park & Martin 1994, their least-squares solution: the rotation that takes the vectors `log B` to `log A`
/// best, the orthogonal factor of `sum log A log B^T`. It has a value for every angle, half turns included.
pub(super) fn park_martin(motions: &[Motion]) -> Result<Pose, HandEyeError> {
    let cross: Mat3 = motions.iter().map(|m| rotation_vector(&m.a) * rotation_vector(&m.b).transpose()).sum();
    let rotation = rotation::nearest(&cross).ok_or(HandEyeError::Singular)?;
    Ok(Pose { rotation, translation: translation(motions, &rotation)? })
}

/// `(R_A - I) t_X = R_X t_B - t_A` over all motions, by least squares.
fn translation(motions: &[Motion], rotation: &Mat3) -> Result<Vec3, HandEyeError> {
    let (mut normal, mut right) = (Mat3::zeros(), Vec3::zeros());
    for Motion { a, b, .. } in motions {
        let matrix = a.rotation - Mat3::identity();
        normal += matrix.transpose() * matrix;
        right += matrix.transpose() * (rotation * b.translation - a.translation);
    }
    Ok(normal.cholesky().ok_or(HandEyeError::Singular)?.solve(&right))
}
