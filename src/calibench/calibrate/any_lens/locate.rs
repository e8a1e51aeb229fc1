//! Where was the board in one view, for a camera that is known?

use super::super::minimise::{RELATIVE_GAIN, descend};
use super::super::noise::Noise;
use super::super::target_frame::TargetFrames;
use super::super::{Loss, Settings};
use super::marks::Marks;
use super::problem::{Problem, State, rounding_cost};
use super::{BoardShape, shape, start};
use crate::board::View;
use crate::camera::{Camera, FreeParameters, Lens};
use crate::geometry::{Pose, Vec2};

/// A view's pose, and what it leaves over.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Located {
    /// The pose of least squared, weighted pixel distance.
    pub cam_from_target: Pose,
    /// Predicted - observed, px.
    pub residuals: Vec<Vec2>,
    /// Sum of the weighted squares, px^2, of `2 N - 6` degrees of freedom.
    pub square: f64,
}

/// The pose of a flat board in a view of a camera that is known: from the rays of its marks, refined, the
/// better of its two tilts. `None` with fewer than four marks, or where the camera cannot see them.
///
/// ```
/// use calibench::calibrate::locate;
/// use calibench::synth::Scene;
///
/// let scene = Scene::example();
/// let found = locate(&scene.truth.camera.into(), &scene.exact()[0]).expect("63 marks tell the pose");
/// let truth = &scene.truth.cam_from_target[0];
/// assert!((found.cam_from_target.translation - truth.translation).norm() < 1e-6);
/// ```
pub fn locate(camera: &Camera<Lens>, view: &View) -> Option<Located> {
    located(camera, None, view, Loss::Squares)
}

/// The same of a board of any shape, with the pose of least loss.
pub(in super::super) fn located(
    camera: &Camera<Lens>,
    board: Option<&BoardShape>,
    view: &View,
    loss: Loss,
) -> Option<Located> {
    if view.len() < FEWEST_MARKS {
        return None;
    }
    let views = std::slice::from_ref(view);
    let frames = TargetFrames::of(views);
    let region = board.map_or_else(|| shape::region(views), |board| board.region);
    let marks = [Marks::of(view, frames.at(0), &region)];
    let problem = Problem {
        views: &marks,
        free: FreeParameters::NONE,
        held: FreeParameters::NONE,
        fy_per_fx: None,
        priors: &[],
        noise: Noise::of_squares(0.0),
        bend: None,
        loss,
        max_iterations: Settings::standard().max_iterations,
        relative_gain: RELATIVE_GAIN,
        rounding_cost: rounding_cost(&marks),
        is_certifiable: false,
    };
    let shape = board.map_or([0.0; 3], BoardShape::deformations);
    let state = State { shape, ..start::with_poses(&marks, *camera)? };
    let state = start::with_better_tilts(&problem, descend(&problem, state).state);
    residuals(&marks[0], &state).map(|(residuals, square)| Located {
        cam_from_target: frames.at(0).cam_from_target(&state.cam_from_target[0]),
        residuals,
        square,
    })
}

/// Three marks leave four poses.
const FEWEST_MARKS: usize = 4;

fn residuals(marks: &Marks, state: &State) -> Option<(Vec<Vec2>, f64)> {
    let residual = |mark| state.pixel(0, mark).map(|pixel| pixel - mark.pixel);
    let residuals: Vec<Vec2> = marks.list.iter().map(residual).collect::<Option<_>>()?;
    let weighted = residuals.iter().zip(&marks.list).map(|(r, mark)| (r * mark.weight).norm_squared());
    let square = weighted.sum();
    Some((residuals, square))
}
