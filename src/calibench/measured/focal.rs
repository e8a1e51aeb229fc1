//! Is the camera one of another focal length? From afar, views of few marks hardly tell theirs, and a search
//! ends where wrong tilts make up for it: lengths far off are tried, each with tilts of its own.

use super::descent::{Minimum, descend};
use super::problem::{Problem, State};
use super::tilts::with_better_tilts;
use crate::camera::Parameter;

/// Where a focal length is known worse than this part of itself, it is asked whether it is known at all.
pub(super) const DOUBTFUL: f64 = 0.03;
/// Focal lengths so many times as long and as short are tried.
pub(super) const OTHER_FOCAL: f64 = 3.0;

/// Where minima of other focal lengths may lie, each with tilts of its own; none where the minimum tells its
/// own well.
pub(super) fn starts(problem: &Problem<'_>, minimum: &Minimum) -> Vec<State> {
    if !is_doubtful(problem, minimum) {
        return Vec::new();
    }
    let exact = Problem { moves_marks: false, ..*problem };
    let freed = |factor| {
        let held = at_focal(problem, minimum, factor)?;
        Some(with_better_tilts(&exact, descend(&exact, held.state)?).state)
    };
    [OTHER_FOCAL, 1.0 / OTHER_FOCAL].into_iter().filter_map(freed).collect()
}

/// The minimum with the focal lengths held so many times as long; `None` where none is found.
pub(super) fn at_focal(problem: &Problem<'_>, minimum: &Minimum, factor: f64) -> Option<Minimum> {
    // A double sphere makes up for its focal length with xi, at the same picture: that is no other distance.
    let rest = Problem {
        free: problem.free.without(Parameter::Fx).without(Parameter::Fy).without(Parameter::Xi),
        fy_per_fx: None,
        ..*problem
    };
    let mut state = minimum.state.clone();
    (state.camera.fx, state.camera.fy) = (factor * state.camera.fx, factor * state.camera.fy);
    state.cam_from_target.iter_mut().for_each(|pose| pose.translation.z *= factor);
    descend(&rest, state)
}

/// Whether the standard deviation of fx is a large part of it, or none is to be had.
fn is_doubtful(problem: &Problem<'_>, minimum: &Minimum) -> bool {
    let Some(row) = problem.free.position(Parameter::Fx) else { return false };
    let of_camera = minimum.equations.of_first(problem.free.len()).and_then(|(matrix, _)| matrix.cholesky());
    let sd = of_camera.map(|factor| (problem.variance * factor.inverse()[(row, row)]).sqrt());
    sd.is_none_or(|sd| sd.is_nan() || sd >= DOUBTFUL * minimum.state.camera.fx)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{SIGMA_PX, Scene, stream};
    use super::super::{Noise, calibrate_measured};
    use crate::camera::{Camera, Lens, Model, Parameter};
    use crate::geometry::{Pose, Vec3, rotation};

    /// Twenty marks of a target a tenth as thick as it is wide, nine views from nineteen widths away.
    fn from_afar(trial: u64) -> Scene {
        let mut stream = stream("few", trial);
        let mut uniform = |half: f64| half * (2.0 * stream.uniform() - 1.0);
        let marks = (0..20).map(|_| Vec3::new(uniform(50.0), uniform(40.0), uniform(5.0))).collect();
        let pose = |_: usize| {
            let turn = Vec3::new(uniform(0.9), uniform(0.9), uniform(1.0));
            let place = Vec3::new(uniform(300.0), uniform(200.0), 1900.0 + uniform(300.0));
            Pose { rotation: rotation::exp(&turn), translation: place }
        };
        let cam_from_target: Vec<Pose> = (0..9).map(pose).collect();
        let lens = Lens::new(Model::Division, &[-0.24]).unwrap();
        Scene { camera: Camera::with_lens(900.0, 895.0, 317.0, 236.0, lens), marks, cam_from_target }
    }

    /// Six or seven marks of each view.
    fn few(view: usize, mark: usize) -> bool {
        (0..6 + view % 2).any(|k| (view * 3 + k * 7) % 20 == mark)
    }

    /// Sets in which the search from the rays alone ends at a wrong length, and was refused as one of which
    /// nothing is known: five of the first 200. One such (58) is now answered wrongly, as uncertain and with
    /// misleading deviations; one that was answered (56) is refused.
    #[test]
    fn lengths_that_wrong_tilts_made_up_for_are_left() {
        for trial in [28, 126, 127, 151, 161] {
            let scene = from_afar(trial);
            let (target, views) = scene.drawn_where(few, 0.0, &mut stream("few-noise", trial));
            let found = calibrate_measured(&target, &views, &scene.settings(), Noise::Estimated).unwrap();
            let sd = found.standard_deviation(Parameter::Fx).unwrap();
            let off = (found.calibration.camera.fx - scene.camera.fx) / sd;
            // Of 57 degrees of freedom the noise is known to 9 %.
            let noise = found.calibration.sigma_px / SIGMA_PX;
            assert!(off.abs() < 4.0 && (noise - 1.0).abs() < 0.3, "{trial}: {off} {noise}");
        }
    }
}
