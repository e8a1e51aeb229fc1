//! Are these the marks that were photographed? A wrong board, unit or origin makes every plan wrong without a
//! word.

use super::information::pose_information;
use crate::calibrate::Covariance;
use crate::camera::{Camera, Lens};
use crate::geometry::{Pose, Vec2};

/// How many times the standard deviation of a number of the pose of `view`, the camera known, is that which
/// these marks give, or the other way round: the largest of the six, 1 where they are the marks that the
/// covariance rests on. `None` where the covariance has no such view, a mark has no image, or one of both
/// determines no pose.
pub fn marks_against_covariance(
    camera: &Camera<Lens>,
    covariance: &Covariance,
    (view, cam_from_target): (usize, &Pose),
    (points, sigma_px): (&[Vec2], f64),
) -> Option<f64> {
    let (joint, cross) = (covariance.poses.get(view)?, covariance.cross.get(view)?);
    let known = covariance.intrinsics.clone().cholesky()?;
    let given_camera = joint - cross.transpose() * known.solve(cross);
    let of_marks = pose_information(camera, cam_from_target, points, sigma_px)?.cholesky()?.inverse();
    let ratio = |i: usize| {
        let ratio = (given_camera[(i, i)] / of_marks[(i, i)]).sqrt();
        ratio.max(1.0 / ratio)
    };
    let ratios = (0..6).map(ratio).collect::<Vec<f64>>();
    ratios.iter().all(|ratio| ratio.is_finite()).then(|| ratios.into_iter().fold(1.0, f64::max))
}
