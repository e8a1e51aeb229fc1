//! What do marks say of a camera with any lens at a given state, before any estimate? Fisher's information.

use super::super::conditioning::Conditioning;
use super::super::minimise::{Descent, RELATIVE_GAIN};
use super::super::noise::Noise;
use super::super::target_frame::TargetFrames;
use super::super::{Covariance, Loss};
use super::problem::{Problem, State};
use super::{marks, shape};
use crate::board::View;
use crate::camera::{Camera, FreeParameters, Lens};
use crate::geometry::{Pose, Vec2, Vec3};

/// How well the marks `points` of a flat board, seen in these poses, separate the free parameters of a
/// camera, and `(J^T J)^-1`, the covariance of camera and poses for noise of 1 px a coordinate: see
/// [`information`](crate::calibrate::information). The covariance is `None` where `J^T J` is singular; all is
/// `None` where the lens has no image of a mark.
///
/// ```
/// use calibench::calibrate::lens_information;
/// use calibench::camera::{FreeParameters, Parameter};
/// use calibench::synth::Truth;
///
/// // Before any photograph is taken: how well would four views tell the focal length, with noise of 0.1 px?
/// let truth = Truth::example();
/// let (_, unit) =
///     lens_information(&truth.camera.into(), FreeParameters::STANDARD, &truth.cam_from_target, &truth.points)
///         .expect("every mark has an image");
/// let covariance = unit.expect("the views determine the camera").scaled(0.1 * 0.1);
/// let deviation = covariance.standard_deviation(Parameter::Fx).expect("fx is free");
/// assert!((0.5..0.9).contains(&deviation));
/// ```
pub fn lens_information(
    camera: &Camera<Lens>,
    free: FreeParameters,
    cam_from_target: &[Pose],
    points: &[Vec2],
) -> Option<(Option<Conditioning>, Option<Covariance>)> {
    let seen = |pose: &Pose| {
        let pixel = |p: &Vec2| camera.pixel(&pose.apply(&Vec3::new(p.x, p.y, 0.0)));
        View::new(points.to_vec(), points.iter().map(pixel).collect::<Option<_>>()?).ok()
    };
    let views: Vec<View> = cam_from_target.iter().map(seen).collect::<Option<_>>()?;
    let frames = TargetFrames::of(&views);
    let region = shape::region(&views);
    let marks = marks::of_views(&views, &frames, &region);
    let problem = Problem {
        views: &marks,
        free,
        held: FreeParameters::NONE,
        fy_per_fx: None,
        priors: &[],
        noise: Noise::of_squares(1.0),
        bend: None,
        loss: Loss::Squares,
        max_iterations: 0,
        relative_gain: RELATIVE_GAIN,
        rounding_cost: 0.0,
        is_certifiable: false,
    };
    let own = cam_from_target.iter().enumerate().map(|(view, pose)| frames.at(view).of_pose(pose)).collect();
    let state = State { camera: *camera, cam_from_target: own, shape: [0.0; 3] };
    let mut system = problem.system();
    problem.linearise_into(&state, &mut system);
    let reduction = system.reduction();
    let conditioning = reduction.as_ref().and_then(|reduction| Conditioning::of(&system, reduction));
    let unit = reduction.and_then(|reduction| reduction.covariance());
    Some((conditioning, unit.map(|unit| frames.covariance(unit, &state.cam_from_target, 1.0))))
}
