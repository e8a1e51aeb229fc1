//! Stage 2: focal length and depth, then the lens.
//!
//! With `x, y` and `w = r7 X + r8 Y + r9 Z` known from stage 1, an ideal lens has `f x - X_d T_z = w X_d` and
//! the same for y: linear in f and T_z. Columns `(x, y)` and `(X_d, Y_d)` are parallel where all points lie
//! at one depth: f and T_z are then inseparable. `kappa` is found with both by least squares in ideal pixels.

use super::TsaiError;
use super::alignment::Aligned;
use super::descent::{Normal, descend};
use crate::geometry::{Mat3, Pose, Vec2, Vec3};
use nalgebra::{DMatrix, DVector, Matrix2};

/// Depth, focal length and lens of an aligned view.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Deep {
    pub cam_from_frame: Pose,
    /// fy, px.
    pub focal_px: f64,
    /// fy without the lens, px.
    pub linear_focal_px: f64,
    pub kappa: f64,
}

/// A point of an aligned view: `(x, y)`, the part `w` of its depth, and where it was seen, px.
struct Ray {
    side: Vec2,
    depth: f64,
    seen: Vec2,
}

/// The unknowns of stage 2: f (px), T_z (in the frame's unit), and `kappa / f^2` (px^-2).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Unknowns {
    focal_px: f64,
    depth: f64,
    bend: f64,
}

pub(super) fn depth(aligned: &Aligned, is_flat: bool) -> Result<Deep, TsaiError> {
    let mut rotation = aligned.rotation;
    let mut linear = linear(&rays(aligned, &rotation))?;
    if linear.focal_px < 0.0 && is_flat {
        // The other tilt: f and T_z change their signs with r3, r6, r7 and r8.
        rotation = other_tilt(&rotation);
        linear = Unknowns { focal_px: -linear.focal_px, depth: -linear.depth, ..linear };
    }
    let rays = rays(aligned, &rotation);
    let is_before = |unknowns: &Unknowns| rays.iter().all(|ray| ray.depth + unknowns.depth > 0.0);
    if linear.focal_px <= 0.0 || !is_before(&linear) {
        return Err(TsaiError::Behind { focal_px: linear.focal_px });
    }
    let best = descend(linear, |at| normal(&rays, at), stepped)
        .filter(|best| best.focal_px > 0.0 && best.focal_px.is_finite() && is_before(best))
        .ok_or(TsaiError::NoDepth { focal_px: linear.focal_px })?;
    let (x, y) = (aligned.translation.x, aligned.translation.y);
    Ok(Deep {
        cam_from_frame: Pose { rotation, translation: Vec3::new(x, y, best.depth) },
        focal_px: best.focal_px,
        linear_focal_px: linear.focal_px,
        kappa: best.bend * best.focal_px * best.focal_px,
    })
}

/// The rotation of the plane's mirror image in the image plane.
fn other_tilt(r: &Mat3) -> Mat3 {
    Mat3::from_fn(|i, j| if (i == 2) != (j == 2) { -r[(i, j)] } else { r[(i, j)] })
}

fn rays(aligned: &Aligned, rotation: &Mat3) -> Vec<Ray> {
    let ray = |(point, seen): (&Vec3, &Vec2)| {
        let turned = rotation * point;
        Ray { side: turned.xy() + aligned.translation, depth: turned.z, seen: *seen }
    };
    aligned.points.iter().zip(&aligned.seen).map(ray).collect()
}

/// f and T_z of an ideal lens.
fn linear(rays: &[Ray]) -> Result<Unknowns, TsaiError> {
    let (mut square, mut product) = (Matrix2::zeros(), Vec2::zeros());
    for Ray { side, depth, seen } in rays {
        square += Matrix2::new(side.dot(side), -side.dot(seen), -side.dot(seen), seen.dot(seen));
        product += *depth * Vec2::new(side.dot(seen), -seen.dot(seen));
    }
    // Columns of unit length: what is left of the determinant is the squared sine between them.
    let cosine = square[(0, 1)] / (square[(0, 0)] * square[(1, 1)]).sqrt();
    let solved = square.try_inverse().map(|inverse| inverse * product);
    match solved.filter(|_| 1.0 - cosine * cosine > f64::EPSILON) {
        Some(solved) => Ok(Unknowns { focal_px: solved.x, depth: solved.y, bend: 0.0 }),
        None => Err(TsaiError::NoDepth { focal_px: 0.0 }),
    }
}

/// Normal equations of `X_d (1 + bend r_d^2) - f x / z` and the same for y.
fn normal(rays: &[Ray], at: &Unknowns) -> Option<Normal> {
    let mut normal = Normal::zeros(3);
    for Ray { side, depth, seen } in rays {
        let z = depth + at.depth;
        if z.is_nan() || z <= 0.0 {
            return None;
        }
        let square = seen.norm_squared();
        let residual = seen * (1.0 + at.bend * square) - side * (at.focal_px / z);
        let columns = [-side / z, side * (at.focal_px / (z * z)), seen * square];
        normal.add(&residual, &DMatrix::from_fn(2, 3, |i, j| columns[j][i]));
    }
    Some(normal)
}

fn stepped(at: &Unknowns, step: &DVector<f64>) -> Unknowns {
    Unknowns { focal_px: at.focal_px + step[0], depth: at.depth + step[1], bend: at.bend + step[2] }
}
