//! Did a target near a plane stand the other way round? Views of few marks from afar, whose two tilts look
//! alike (Schweighofer & Pinz 2006): a search that starts from the wrong one stays there, and bends the
//! camera to it.

use super::descent::{Minimum, descend};
use super::problem::Problem;
use super::resection::refined;
use super::shape::NEARLY_FLAT;
use crate::calibrate::mirrored;
use crate::geometry::Pose;

/// Rounds in which one tilt is turned.
const ROUNDS: usize = 8;
/// So many views are turned in a round until one is better for it: those that it costs least.
const TRIED: usize = 6;
/// A sum of squares that falls by less than this part is the same minimum again.
const GAIN: f64 = 1e-6;

/// The minimum with the tilts turned that lower its cost, each with a camera of its own: a camera that was
/// bent to a wrong tilt does not show by itself that it is wrong. Of targets near a plane; marks stay where
/// they were measured.
pub(super) fn with_better_tilts(problem: &Problem<'_>, mut best: Minimum) -> Minimum {
    for _ in 0..ROUNDS {
        let better = others(problem, &best).into_iter().find_map(|(view, pose)| {
            let mut turned = best.state.clone();
            turned.cam_from_target[view] = pose;
            descend(problem, turned).filter(|found| found.equations.cost < (1.0 - GAIN) * best.equations.cost)
        });
        match better {
            Some(better) => best = better,
            None => break,
        }
    }
    best
}

/// Views with their other tilts, the cheapest first, where the marks of a view as a whole do not contradict
/// it: a tilt that costs more than all that is left over now is not the true one.
fn others(problem: &Problem<'_>, best: &Minimum) -> Vec<(usize, Pose)> {
    let mut dear: Vec<(f64, usize, Pose)> = Vec::new();
    for (view, own) in best.state.cam_from_target.iter().enumerate() {
        let shape = problem.data.shape(view);
        if shape.thickness() > NEARLY_FLAT {
            continue;
        }
        let plane = shape.plane_from_points();
        let other = mirrored(&own.compose(&plane.inverse())).compose(&plane);
        let cost = |pose| refined(problem.data, view, &best.state.camera, pose);
        let (Some((as_is, _)), Some((turned, pose))) = (cost(*own), cost(other)) else { continue };
        if turned - as_is < best.equations.cost {
            dear.push((turned - as_is, view, pose));
        }
    }
    dear.sort_by(|a, b| a.0.total_cmp(&b.0));
    dear.into_iter().take(TRIED).map(|(_, view, pose)| (view, pose)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::data::Data;
    use super::super::problem::State;
    use super::super::tests::{SIGMA_PX, Scene, poses, stream};
    use super::*;
    use crate::camera::{Camera, Model};
    use crate::geometry::Vec3;

    /// Twenty-four marks within 3 mm of a plane of 225 x 135 mm, photographed from 2.5 m; the last view shows
    /// four of them.
    fn from_afar() -> (Scene, Data) {
        let mark = |i: u32| {
            let height = 3.0 * libm::fmod(0.618 * f64::from(i), 1.0);
            Vec3::new(45.0 * f64::from(i % 6) - 112.5, 45.0 * f64::from(i / 6) - 67.5, height)
        };
        let camera = Camera::pinhole(6000.0, 6010.0, 322.0, 241.0).into();
        let scene = Scene { camera, marks: (0..24).map(mark).collect(), cam_from_target: poses(5, 2500.0) };
        let is_seen = |view: usize, mark: usize| view < 4 || [0, 5, 18, 23].contains(&mark);
        let (target, views) = scene.drawn_where(is_seen, 0.0, &mut stream("tilts", 0));
        let data = Data::of(&target, &views).unwrap();
        (scene, data)
    }

    #[test]
    fn a_camera_that_was_bent_to_a_wrong_tilt_is_left() {
        let (scene, data) = from_afar();
        let problem = Problem {
            data: &data,
            free: Model::BrownConrady.standard_free(),
            fy_per_fx: None,
            priors: &[],
            variance: SIGMA_PX * SIGMA_PX,
            moves_marks: false,
            moves_poses: true,
            max_iterations: 200,
        };
        let from_centre = Pose { translation: data.centre, ..Pose::identity() };
        let true_poses = scene.cam_from_target.iter().map(|pose| pose.compose(&from_centre)).collect();
        let truth = State { camera: scene.camera, cam_from_target: true_poses, offsets: Vec::new() };
        let best = descend(&problem, truth).unwrap();
        let mut turned = best.state.clone();
        let plane = data.shape(4).plane_from_points();
        let own = turned.cam_from_target[4].compose(&plane.inverse());
        turned.cam_from_target[4] = mirrored(&own).compose(&plane);
        let wrong = descend(&problem, turned).unwrap();
        assert!(wrong.equations.cost > 1.5 * best.equations.cost, "{}", wrong.equations.cost);
        let found = with_better_tilts(&problem, wrong);
        let ratio = found.equations.cost / best.equations.cost;
        assert!((ratio - 1.0).abs() < 1e-9, "{ratio}");
    }
}
