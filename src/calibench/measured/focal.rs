//! Is the camera one of another focal length? From afar, views of few marks hardly tell theirs, and a search
//! ends where wrong tilts make up for it: lengths far off are tried, each with tilts of its own.

use super::descent::{Minimum, descend};
use super::noise::settled;
use super::problem::Problem;
use super::tilts::with_better_tilts;
use super::{MeasuredError, Noise};
use crate::camera::Parameter;

/// Where a focal length is known worse than this part of itself, it is asked whether it is known at all.
pub(super) const DOUBTFUL: f64 = 0.03;
/// Focal lengths so many times as long and as short are tried.
pub(super) const OTHER_FOCAL: f64 = 3.0;
/// Better lengths that lead to better ones.
const ROUNDS: usize = 3;
/// A cost that falls by less than this part is the same minimum again.
const GAIN: f64 = 1e-6;

/// The minimum, or a better one of another focal length where its own is known badly.
///
/// # Errors
/// As [`settled`].
pub(super) fn with_better_focal<'a>(
    mut problem: Problem<'a>,
    noise: Noise,
    mut minimum: Minimum,
) -> Result<(Problem<'a>, Minimum), MeasuredError> {
    for _ in 0..ROUNDS {
        if !is_doubtful(&problem, &minimum) {
            break;
        }
        let exact = Problem { moves_marks: false, ..problem };
        let freed = |other: Minimum| {
            let own = descend(&exact, other.state)?;
            descend(&problem, with_better_tilts(&exact, own).state)
        };
        let others = [OTHER_FOCAL, 1.0 / OTHER_FOCAL].into_iter();
        let others = others.filter_map(|factor| freed(at_focal(&problem, &minimum, factor)?));
        let better = others.filter(|other| other.equations.cost < (1.0 - GAIN) * minimum.equations.cost);
        let Some(best) = better.min_by(|a, b| a.equations.cost.total_cmp(&b.equations.cost)) else { break };
        let iterations = minimum.iterations;
        (problem, minimum) = settled(problem, noise, best.state)?;
        minimum.iterations += iterations;
    }
    Ok((problem, minimum))
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
    use super::super::{MeasuredMark, MeasuredTarget, MeasuredView, Noise, SeenMark, calibrate_measured};
    use crate::calibrate::Settings;
    use crate::camera::{Camera, Lens, Model, Parameter};
    use crate::geometry::{Pose, Vec2, Vec3, rotation};

    /// Twenty marks of a target a tenth as thick as it is wide, nine views of six or seven of them from
    /// nineteen widths away, and the marks that each shows.
    fn few_from_afar(trial: u64) -> (Scene, Vec<Vec<usize>>) {
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
        let camera = Camera::with_lens(900.0, 895.0, 317.0, 236.0, lens);
        let shown = (0..9).map(|view| (0..6 + view % 2).map(|k| (view * 3 + k * 7) % 20).collect()).collect();
        (Scene { camera, marks, cam_from_target }, shown)
    }

    /// Sets in which the search from the rays alone ended at a wrong length, and was refused as one of which
    /// nothing is known.
    #[test]
    fn a_length_that_wrong_tilts_made_up_for_is_left() {
        for trial in [47, 53, 57, 104, 130] {
            let (scene, shown) = few_from_afar(trial);
            let mut stream = stream("few-noise", trial);
            let exact = |(i, p): (usize, &Vec3)| MeasuredMark::new(i.to_string(), *p, 0.0);
            let target = MeasuredTarget::new(scene.marks.iter().enumerate().map(exact).collect()).unwrap();
            let mut view = |(pose, shown): (&Pose, &Vec<usize>)| {
                let seen = shown.iter().map(|&i| {
                    let noise = Vec2::new(stream.normal(), stream.normal());
                    let pixel = scene.camera.pixel(&pose.apply(&scene.marks[i])).unwrap();
                    SeenMark::new(i.to_string(), pixel + SIGMA_PX * noise)
                });
                MeasuredView::new(seen.collect()).unwrap()
            };
            let views: Vec<MeasuredView> = scene.cam_from_target.iter().zip(&shown).map(&mut view).collect();
            let settings = Settings::of_model(Model::Division);
            let found = calibrate_measured(&target, &views, &settings, Noise::Estimated).unwrap().calibration;
            let sd = found.standard_deviation(Parameter::Fx).unwrap();
            let off = (found.camera.fx - scene.camera.fx) / sd;
            // Of 57 degrees of freedom the noise is known to 9 %.
            assert!(off.abs() < 3.0 && (found.sigma_px / SIGMA_PX - 1.0).abs() < 0.3, "{trial} {off}");
        }
    }
}
