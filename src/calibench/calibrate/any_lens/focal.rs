//! Is the focal length known at all? Views that face the camera leave it to the distance, with any lens.
//!
//! A covariance is that of the neighbourhood, and noise makes one where nothing is known. So a focal length
//! that is known roughly is set three times as long and as short and all else refitted, as
//! [`super::super::calibrate`] does.

use super::super::minimise::{Minimum, descend};
use super::super::noise::Noise;
use super::super::tie::tied;
use super::super::{CalibrationError, Unknown, identifiability};
use super::WIDTH;
use super::problem::{Problem, ROUGH_GAIN, State};
use crate::camera::Parameter;

/// Where a focal length is known worse than this part of itself, it is asked whether it is known at all.
const DOUBTFUL: f64 = 0.03;
const FACTORS: [f64; 2] = [3.0, 1.0 / 3.0];
/// A coefficient that changes by less than this, and less than this part of itself, did not move along.
const MOVED: f64 = 0.1;

/// Refuses a focal length that may as well be three times as long or as short; `relative` is its standard
/// deviation over itself, `noise` that of a coordinate.
///
/// # Errors
/// [`CalibrationError::NotIdentifiable`].
pub(super) fn refuse_if_open(
    problem: &Problem<'_>,
    minimum: &Minimum<State, WIDTH>,
    noise: Noise,
    relative: f64,
) -> Result<(), CalibrationError> {
    use Parameter::{Fx, Fy, Xi};
    let is_told = problem.priors.iter().any(|prior| matches!(prior.parameter, Fx | Fy));
    if !problem.free.contains(Fx) || is_told || relative < DOUBTFUL {
        return Ok(());
    }
    // Two spheres make up for the focal length with their distance, at the same picture: that is no other
    // depth.
    let free = problem.free.without(Fx).without(Fy).without(Xi);
    let held = problem.held.with(Xi);
    let rest = Problem { free, held, fy_per_fx: None, relative_gain: ROUGH_GAIN, ..*problem };
    let least = identifiability::least_rise(Fx);
    let noise = noise.at_least(problem.rounding_cost);
    for factor in FACTORS {
        let other = descend(&rest, with_focal_length(problem, &minimum.state, factor));
        let rise = (other.system.cost - minimum.system.cost) / noise.rise;
        if rise < least {
            let fx = minimum.state.camera.fx;
            let why = format!(
                "fx {:.5} fits as {fx:.5} does: the cost rises by {rise:.1} variances only, and {least:.0} are needed to rule chance out",
                factor * fx,
            );
            let mut inseparable = vec![Unknown::FocalLength, Unknown::Distance];
            if lens_moves(&minimum.state, &other.state) {
                inseparable.push(Unknown::RadialDistortion);
            }
            return Err(CalibrationError::NotIdentifiable { inseparable, why });
        }
    }
    Ok(())
}

/// Whether a radial coefficient makes up for the focal length too.
fn lens_moves(near: &State, far: &State) -> bool {
    let is_radial = |p: &Parameter| Unknown::Intrinsic(*p).group() == Unknown::RadialDistortion;
    let moves = |p: Parameter| {
        let (here, there) = (near.camera.value(p).unwrap_or(0.0), far.camera.value(p).unwrap_or(0.0));
        (here - there).abs() > MOVED * here.abs().max(1.0)
    };
    near.camera.distortion.model().parameters().filter(is_radial).any(moves)
}

/// The same picture of a small, facing target: focal length and distances times a factor.
fn with_focal_length(problem: &Problem<'_>, state: &State, factor: f64) -> State {
    let mut state = state.clone();
    (state.camera.fx, state.camera.fy) = (factor * state.camera.fx, factor * state.camera.fy);
    state.camera = tied(state.camera, problem.fy_per_fx);
    for pose in &mut state.cam_from_target {
        pose.translation.z *= factor;
    }
    state
}

#[cfg(test)]
mod tests {
    use super::super::super::prior::Prior;
    use super::super::super::target_frame::TargetFrames;
    use super::super::{fixture, marks, shape};
    use super::*;
    use crate::board::View;
    use crate::camera::{Camera, FreeParameters, Lens, Model};
    use crate::geometry::{Pose, Vec2, Vec3, rotation};

    /// What `then` makes of a minimum with fx and fy free, of a small target that faces the camera in three
    /// views.
    fn facing<T>(then: impl FnOnce(&Problem<'_>, &Minimum<State, WIDTH>) -> T) -> T {
        let camera = Camera::with_lens(600.0, 600.0, 320.0, 240.0, Lens::ideal(Model::KannalaBrandt));
        let poses = [(0.0, 300.0), (0.3, 320.0), (-0.2, 340.0)].map(|(roll, z)| Pose {
            rotation: rotation::from_xyz_rad(0.0, 0.0, roll),
            translation: Vec3::new(0.0, 0.0, z),
        });
        let points: Vec<Vec2> =
            (0..63).map(|i| Vec2::new(f64::from(i % 9) - 4.0, f64::from(i / 9) - 3.0) * 2.0).collect();
        let mut count = 0.0;
        let mut noise = || {
            count += 1.0;
            0.1 * std::f64::consts::SQRT_2 * libm::sin(0.7 * count * count)
        };
        let mut seen = |pose: &Pose| {
            let mut pixel = |p: &Vec2| {
                camera.pixel(&pose.apply(&Vec3::new(p.x, p.y, 0.0))).unwrap() + Vec2::new(noise(), noise())
            };
            View::new(points.clone(), points.iter().map(&mut pixel).collect()).unwrap()
        };
        let views: Vec<View> = poses.iter().map(&mut seen).collect();
        let frames = TargetFrames::of(&views);
        let listed = marks::of_views(&views, &frames, &shape::region(&views));
        let problem = fixture::problem(&listed, FreeParameters::of(&[Parameter::Fx, Parameter::Fy]));
        let cam_from_target =
            poses.iter().enumerate().map(|(view, pose)| frames.at(view).of_pose(pose)).collect();
        then(&problem, &descend(&problem, State { camera, cam_from_target, shape: [0.0; 3] }))
    }

    #[test]
    fn a_focal_length_that_may_be_three_times_as_long_is_refused() {
        let noise = Noise::of_squares(0.01);
        facing(|problem, minimum| {
            let refused = refuse_if_open(problem, minimum, noise, 0.5);
            let Err(CalibrationError::NotIdentifiable { inseparable, .. }) = refused else {
                panic!("{refused:?}")
            };
            assert_eq!(inseparable, [Unknown::FocalLength, Unknown::Distance]);
            // Where it is known well, or beforehand, or held, nothing is asked.
            assert_eq!(refuse_if_open(problem, minimum, noise, 0.02), Ok(()));
            let prior = Prior { parameter: Parameter::Fx, mean: 600.0, standard_deviation: 10.0 };
            assert_eq!(
                refuse_if_open(&Problem { priors: &[prior], ..*problem }, minimum, noise, 0.5),
                Ok(())
            );
            let held = Problem { free: FreeParameters::NONE, ..*problem };
            assert_eq!(refuse_if_open(&held, minimum, noise, 0.5), Ok(()));
        });
        // Tilted boards tell it.
        fixture::at_minimum(FreeParameters::of(&fixture::FREE), 1.0, |problem, minimum| {
            assert_eq!(refuse_if_open(problem, minimum, noise, 0.5), Ok(()));
        });
    }

    #[test]
    fn a_coefficient_moves_along_by_more_than_a_tenth() {
        let state = |k1: f64| {
            let lens = Lens::ideal(Model::KannalaBrandt).with(Parameter::K1, k1).unwrap();
            let camera = Camera::with_lens(600.0, 600.0, 320.0, 240.0, lens);
            State { camera, cam_from_target: Vec::new(), shape: [0.0; 3] }
        };
        for (here, there, moves) in
            [(0.0, 0.05, false), (0.0, -0.2, true), (3.0, 3.2, false), (3.0, 3.4, true), (0.5, 0.5, false)]
        {
            assert_eq!(lens_moves(&state(here), &state(there)), moves, "{here} {there}");
        }
    }

    #[test]
    fn a_facing_target_twice_as_far_looks_the_same_with_twice_the_focal_length() {
        facing(|problem, minimum| {
            let far = with_focal_length(problem, &minimum.state, 2.0);
            let (own, other) = (&minimum.state, &far);
            assert_eq!((other.camera.fx, other.camera.fy), (2.0 * own.camera.fx, 2.0 * own.camera.fy));
            let mark = &problem.views[0].list[0];
            let pixels = [own, other].map(|state| state.pixel(0, mark).unwrap());
            assert!((pixels[1] - pixels[0]).norm() < 0.5, "{pixels:?}");
        });
    }
}
