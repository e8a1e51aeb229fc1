//! Which lens of the wanted model has the picture that another lens has? Fitted with the poses held.

use super::data::Data;
use super::descent::descend;
use super::problem::{Problem, State};
use crate::calibrate::{Prior, Settings};
use crate::camera::{Camera, FreeParameters, Lens, Model, Parameter};

/// Steps of a lens beside poses that are held.
const STEPS: usize = 60;
/// Double spheres have two families, as a rule each with a minimum of its own: `xi` and `alpha` of one of
/// each.
const SPHERES: [[f64; 2]; 2] = [[-0.2, 0.55], [0.5, 0.6]];

/// States with lenses of the wanted model like that of `state`; what is held or known beforehand has its
/// value.
pub(super) fn with_model(problem: &Problem<'_>, state: &State, settings: &Settings) -> Vec<State> {
    let lenses = candidates(&state.camera, settings.model());
    let with_lens = |camera: Camera<Lens>| {
        let camera = with_values(camera, problem.priors, settings)?;
        fitted(problem, State { camera, ..state.clone() })
    };
    lenses.into_iter().filter_map(with_lens).collect()
}

/// Cameras of the model from which a fit may start.
fn candidates(camera: &Camera<Lens>, model: Model) -> Vec<Camera<Lens>> {
    let same = (camera.distortion.model() == model).then_some(*camera);
    let ideal = Camera { distortion: Lens::ideal(model), ..*camera };
    let others = match model {
        Model::DoubleSphere => SPHERES
            .iter()
            .filter_map(|[xi, alpha]| {
                let longer = Camera { fx: (1.0 + xi) * camera.fx, fy: (1.0 + xi) * camera.fy, ..ideal };
                longer.with_value(Parameter::Xi, *xi)?.with_value(Parameter::Alpha, *alpha)
            })
            .collect(),
        _ => vec![ideal],
    };
    same.into_iter().chain(others).collect()
}

/// The camera with the values that are held or known beforehand.
pub(super) fn with_values(
    camera: Camera<Lens>,
    priors: &[Prior],
    settings: &Settings,
) -> Option<Camera<Lens>> {
    let mut camera = camera;
    for parameter in settings.model().parameters() {
        if let Ok(Some(value)) = settings.held(parameter) {
            camera = camera.with_value(parameter, value)?;
        }
    }
    for prior in priors {
        camera = camera.with_value(prior.parameter, prior.mean)?;
    }
    if let Some(ratio) = settings.fy_per_fx() {
        camera.fy = ratio * camera.fx;
    }
    Some(camera)
}

/// A lens that follows the pixels beside these poses: its radial terms one after another, then all that is
/// free. Terms below a fraction's line follow last: with those above it they can make one curve in many ways.
fn fitted(problem: &Problem<'_>, state: State) -> Option<State> {
    use Parameter::{Alpha, Cx, Cy, Fx, Fy, K1, K2, Xi};
    let wanted = |list: &[Parameter]| {
        let of = list.iter().copied().filter(|&p| problem.free.contains(p));
        of.fold(FreeParameters::NONE, FreeParameters::with)
    };
    let mut state = state;
    for free in [wanted(&[Fx, Fy, K1, Xi, Alpha]), wanted(&[Fx, Fy, Cx, Cy, K1, K2, Xi, Alpha]), problem.free]
    {
        let alone = Problem {
            free,
            priors: &[],
            moves_marks: false,
            moves_poses: false,
            max_iterations: STEPS,
            ..*problem
        };
        state = descend(&alone, state)?.state;
    }
    Some(state)
}

/// Whether the lens has an image of every mark.
pub(super) fn is_seen(data: &Data, state: &State) -> bool {
    let seen = |(view, list): (usize, &Vec<super::data::Seen>)| {
        list.iter().all(|seen| {
            let point = state.cam_from_target[view].apply(&data.positions[seen.mark]);
            state.camera.pixel(&point).is_some()
        })
    };
    data.views.iter().enumerate().all(seen)
}
