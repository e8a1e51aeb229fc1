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
