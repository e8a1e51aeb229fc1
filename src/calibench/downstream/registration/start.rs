//! Which map is the closed form's? Weighted Kabsch and Umeyama in the plane, and linear least squares.

use super::fit::{Map, Pairs};
use super::{MapModel, RegistrationError};
use crate::geometry::{Affine, Scatter, Vec2};
use nalgebra::Matrix2;

/// The start of the refinement.
pub(super) fn start(model: MapModel, pairs: &Pairs) -> Result<Map, RegistrationError> {
    match model {
        MapModel::Affine => affine(pairs),
        MapModel::Rigid | MapModel::Similarity => turned(model, pairs),
    }
}

fn affine(pairs: &Pairs) -> Result<Map, RegistrationError> {
    let fit = Affine::fit(&pairs.offsets, &pairs.found).map_err(RegistrationError::Affine)?;
    // Rounding leaves 1e-16 of a determinant that cancels.
    if fit.linear.determinant().abs() <= 1e-12 * fit.linear.norm_squared() {
        return Err(RegistrationError::Singular);
    }
    Ok(Map { linear: fit.linear, found_centre: fit.offset })
}

/// With the weighted means taken off both sides, `p` taught, `w` found, `S = sum weight w p^T`: the turned
/// map that fits best has the angle `atan2(S21 - S12, S11 + S22)`; its scale is `|(S11 + S22, S21 - S12)| /
/// sum weight |p|^2` (Umeyama 1991, eqs. 40 to 43, in the plane).
fn turned(model: MapModel, pairs: &Pairs) -> Result<Map, RegistrationError> {
    // Of a pair, by the mean variance of a coordinate; a scale of 1 is near enough for a start.
    let unit = pairs.radius * pairs.radius;
    let weight = |i: usize| 2.0 / (pairs.of_taught[i] * unit + pairs.of_found[i]).trace();
    let count = pairs.offsets.len();
    let total: f64 = (0..count).map(weight).sum();
    let mean = |points: &[Vec2]| points.iter().enumerate().map(|(i, p)| p * weight(i)).sum::<Vec2>() / total;
    let (taught, found) = (mean(&pairs.offsets), mean(&pairs.found));
    let (mut cross, mut square, mut found_square) = (Matrix2::zeros(), 0.0, 0.0);
    for i in 0..count {
        let (p, w) = (pairs.offsets[i] - taught, pairs.found[i] - found);
        cross += weight(i) * w * p.transpose();
        square += weight(i) * p.norm_squared();
        found_square += weight(i) * w.norm_squared();
    }
    let (a, b) = (cross[(0, 0)] + cross[(1, 1)], cross[(1, 0)] - cross[(0, 1)]);
    let size = libm::hypot(a, b);
    refuse_mirrored(pairs, &cross, found_square - size * size / square, square, total)?;
    // Rounding leaves 1e-16 of what cancels.
    if size <= 1e-12 * (square * found_square).sqrt() {
        return Err(RegistrationError::Singular);
    }
    // Offsets are in units of the radius.
    let scale = if model == MapModel::Rigid { pairs.radius } else { size / square };
    let linear = Matrix2::new(a, -b, b, a) * (scale / size);
    Ok(Map { linear, found_centre: found - linear * taught })
}

/// A mirrored map must fit this many times better, in RMS, before the part is called mirrored.
const MIRRORED: f64 = 10.0;
/// And the marks must be this far from a line, on which both maps fit alike.
const WIDE: f64 = 0.01;

/// The mirrored similarity leaves more than the turned one by `4 det S / sum weight |p|^2`.
fn refuse_mirrored(
    pairs: &Pairs,
    cross: &Matrix2<f64>,
    left_by_turned: f64,
    square: f64,
    total: f64,
) -> Result<(), RegistrationError> {
    let left_by_mirrored = (left_by_turned + 4.0 * cross.determinant() / square).max(0.0);
    let is_wide = pairs.offsets.len() > 2 && Scatter::of(&pairs.offsets).flatness > WIDE;
    if is_wide && left_by_turned > MIRRORED * MIRRORED * left_by_mirrored {
        let rms = |left: f64| (left / total).sqrt();
        return Err(RegistrationError::Mirrored {
            mirrored_rms: rms(left_by_mirrored),
            turned_rms: rms(left_by_turned),
        });
    }
    Ok(())
}
