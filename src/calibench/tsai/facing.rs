//! Does the plane face the camera? Then its focal length is what noise makes of it.
//!
//! A plane held parallel to the image plane has three unknowns less: two of its tilt, and f, which its
//! distance imitates. If noise explains what it leaves over (F test), f and T_z are not to be had from the
//! view. Nor are they where perspective is seen, which grows with the sine of the tilt, and foreshortening is
//! not, which tells f and grows with its square: where a focal length three times as long or as short lies
//! within three standard deviations, the cost itself being asked, since noise makes small tilts look larger
//! and their standard deviations smaller.

use super::refine::{Fit, Refined};
use super::{SpatialView, TsaiError, TwoStage, refine_view};
use crate::camera::{BrownConrady, Camera, FreeParameters, Parameter};
use crate::distribution::fisher_tail;
use crate::geometry::{Mat3, Pose, Vec3, rotation};

/// A facing plane is believed unless its residuals are rarer than this by chance: the rate at which
/// [`crate::calibrate::calibrate`] asks the same of its views.
const BY_CHANCE: f64 = 1e-6;
/// Focal lengths so many times as long and as short must be excluded, by so many standard deviations; as
/// there.
const OTHER_FOCAL: f64 = 3.0;
const EXCLUDED_SD: f64 = 3.0;
/// Residuals of computed points, px: rounding.
const EXACT_PX: f64 = 1e-7;
/// Sine of the largest tilt that a search for another focal length starts from.
const STEEPEST: f64 = 0.9;

/// Refuses a view in which focal length and depth are inseparable.
pub(super) fn refuse(
    view: &SpatialView,
    found: &TwoStage,
    tilt_rad: f64,
    fy_per_fx: f64,
) -> Result<(), TsaiError> {
    let tilt_deg = tilt_rad.to_degrees();
    let facing = |p_value| Err(TsaiError::Facing { tilt_deg, p_value });
    // One coefficient: those that its conversion adds are of another lens at another focal length.
    let lens = BrownConrady::radial(found.camera.distortion.k1, 0.0);
    let (camera, pose) = (found.camera.with_distortion(lens), found.cam_from_target);
    let start = (&camera, &with_tilt(&pose, view, 1.0, |_| 0.0));
    let Some(held_cost) = least_cost(view, start, &[2, 3, 4, 5]) else {
        // A facing plane that cannot be fitted explains nothing.
        return Ok(());
    };
    let free = FreeParameters::of(&[Parameter::Fx, Parameter::K1]);
    let Ok(tilted) = refine_view(view, (&camera, &pose), free, Some(fy_per_fx)) else {
        return facing(None);
    };
    if held_cost <= EXACT_PX * EXACT_PX * view.len() as f64 {
        return facing(Some(1.0));
    }
    let variance = tilted.sigma_px * tilted.sigma_px;
    let excess = |cost: f64| ((cost - cost_of(&tilted)) / variance).max(0.0);
    let p_value = fisher_tail(excess(held_cost) / 3.0, 3, tilted.degrees_of_freedom);
    if p_value > BY_CHANCE {
        return facing(Some(p_value));
    }
    for factor in [OTHER_FOCAL, 1.0 / OTHER_FOCAL] {
        let camera = with_focal_length(&tilted.camera, factor);
        let steeper = |tilt: f64| libm::asin((factor * libm::sin(tilt)).min(STEEPEST));
        let pose = with_tilt(&tilted.cam_from_target, view, factor, steeper);
        // One that no pose can be found for does not explain the view.
        let cost = least_cost(view, (&camera, &pose), &[0, 1, 2, 3, 4, 5]).unwrap_or(f64::INFINITY);
        let standard_deviations = excess(cost).sqrt();
        if standard_deviations < EXCLUDED_SD {
            return Err(TsaiError::WeakTilt { tilt_deg, other_px: camera.fx, standard_deviations });
        }
    }
    Ok(())
}

fn cost_of(refined: &Refined) -> f64 {
    refined.sigma_px * refined.sigma_px * refined.degrees_of_freedom as f64
}

/// The least cost over k1 and these numbers of the pose, the focal length held.
fn least_cost(view: &SpatialView, start: (&Camera, &Pose), of_pose: &[usize]) -> Option<f64> {
    let fit = Fit::of(view, FreeParameters::of(&[Parameter::K1]), None, of_pose);
    Some(fit.normal(&fit.descend(start)?)?.cost)
}

/// A lens with nearly the same picture at another focal length: radii shrink, so that `k1` grows with its
/// square.
fn with_focal_length(camera: &Camera, factor: f64) -> Camera {
    let k1 = factor * factor * camera.distortion.k1;
    let longer = Camera { fx: factor * camera.fx, fy: factor * camera.fy, ..*camera };
    longer.with_distortion(BrownConrady::radial(k1, 0.0))
}

/// The pose with another tilt, turned about the target's centroid, which moves to so many times its depth.
fn with_tilt(cam_from_target: &Pose, view: &SpatialView, depth: f64, tilt: impl Fn(f64) -> f64) -> Pose {
    let centre = view.points().iter().sum::<Vec3>() / view.len() as f64;
    let scatter = |sum: Mat3, p: &Vec3| sum + (p - centre) * (p - centre).transpose();
    let eigen = view.points().iter().fold(Mat3::zeros(), scatter).symmetric_eigen();
    let normal = cam_from_target.rotation * eigen.eigenvectors.column(eigen.eigenvalues.imin());
    let normal = if normal.z < 0.0 { -normal } else { normal };
    // About this axis the plane turns to face the camera.
    let axis = normal.cross(&Vec3::z());
    let angle = libm::atan2(axis.norm(), normal.z);
    let turn = match axis.norm() > 0.0 {
        true => rotation::exp(&(axis.normalize() * (angle - tilt(angle)))),
        false => Mat3::identity(),
    };
    let rotation = turn * cam_from_target.rotation;
    let moved = cam_from_target.apply(&centre).component_mul(&Vec3::new(1.0, 1.0, depth));
    Pose { rotation, translation: moved - rotation * centre }
}
