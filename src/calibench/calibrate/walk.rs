//! Is there a better minimum at another focal length? The profile of the cost: a focal length is held, the
//! rest refitted.
//!
//! With small tilts every plane has two poses that do, and each choice of them has a minimum of its own, at
//! its own focal length. Walking along the focal length with the better tilt of every plane at each step
//! meets them one after another. The same walk tells how far the focal length could be off: where the cost
//! does not rise, the data do not determine it.

use super::identifiability::least_rise;
use super::minimise::{Minimum, Problem};
use super::noise::Noise;
use super::retraction::scaled;
use super::rival::Met;
use super::search::is_better;
use super::{chunks, tilt};
use crate::camera::Parameter;

/// A step of the walk: a minimum of the profile is wider.
const STEP: f64 = 1.2;
/// Steps each way: a factor of 3.
const STEPS: usize = 6;
/// A principal point this part of the focal length away is far: 27 degrees off the axis.
const FAR_CENTRE: f64 = 0.5;
/// A principal point known to this part of the focal length is not asked.
const KNOWN_CENTRE: f64 = 0.01;
/// The walk turns where the cost has risen by this many variances: what is farther off is far worse.
const RISEN: f64 = 100.0;
/// From steps of the walk whose cost exceeds the least by fewer variances than this, the search goes on with
/// the focal length free.
const PROMISING: f64 = 12.0;
/// Walks, each from a better minimum than the one before.
const WALKS: usize = 4;

/// What a walk found.
pub(super) struct Walked {
    pub best: Minimum,
    /// Searches on the way.
    pub starts: usize,
    /// Where the walk went as far as it goes.
    pub far: Vec<Far>,
    /// Minima met on the way.
    pub met: Vec<Met>,
}

/// A parameter far from its estimate, the rest refitted.
pub(super) struct Far {
    pub parameter: Parameter,
    pub minimum: Minimum,
}

/// Walks from a minimum, and again from any better one it meets, for such noise; `centre_sd` are the
/// standard deviations of the principal point.
pub(super) fn far_away(
    problem: &Problem<'_>,
    minimum: Minimum,
    noise: Noise,
    centre_sd: [Option<f64>; 2],
) -> Walked {
    let mut walked = Walked { best: minimum, starts: 0, far: Vec::new(), met: Vec::new() };
    let rise = noise.at_least(problem.rounding_cost).rise;
    let limit = RISEN * rise;
    for _ in 0..WALKS {
        walked.far.clear();
        let mut better = None;
        for factor in [STEP, 1.0 / STEP] {
            walk(problem, factor, noise, limit, &mut walked, &mut better);
        }
        for (parameter, sd) in [Parameter::Cx, Parameter::Cy].into_iter().zip(centre_sd) {
            if sd.is_some_and(|sd| sd > KNOWN_CENTRE * walked.best.state.camera.fx) {
                step_aside(problem, parameter, least_rise(parameter) * rise, &mut walked);
            }
        }
        match better {
            Some(minimum) => {
                walked.met.push(Met::of(&walked.best));
                walked.best = minimum;
            }
            None => break,
        }
    }
    walked
}

/// Walks along the focal length until the cost has risen by `limit` or the focal length has changed by a
/// factor of 3.
fn walk(
    problem: &Problem<'_>,
    factor: f64,
    noise: Noise,
    limit: f64,
    walked: &mut Walked,
    better: &mut Option<Minimum>,
) {
    let Some(focal) = [Parameter::Fx, Parameter::Fy].into_iter().find(|&p| problem.free.contains(p)) else {
        return;
    };
    let held = Problem { free: problem.free.without(focal), ..*problem };
    let origin = walked.best.system.cost;
    let mut state = walked.best.state.clone();
    for number in 1..=STEPS {
        let step =
            with_better_tilts(&held, held.minimise(scaled(&state, problem.free, problem.fy_per_fx, factor)));
        walked.starts += 1;
        let least = better.as_ref().map_or(origin, |b| b.system.cost);
        if step.system.cost < least + PROMISING * noise.rise {
            let minimum = with_better_tilts(problem, problem.minimise(step.state.clone()));
            walked.starts += 1;
            walked.met.push(Met::of(&minimum));
            if is_better(&minimum, better.as_ref().unwrap_or(&walked.best)) {
                *better = Some(minimum);
            }
        }
        if step.system.cost > origin + limit {
            break;
        }
        state = step.state.clone();
        if number == STEPS {
            walked.far.push(Far { parameter: focal, minimum: step });
        }
    }
}

/// Moves the principal point far away, both ways, the targets with it.
fn step_aside(problem: &Problem<'_>, parameter: Parameter, limit: f64, walked: &mut Walked) {
    let held = Problem { free: problem.free.without(parameter), ..*problem };
    for side in [FAR_CENTRE, -FAR_CENTRE] {
        let mut state = walked.best.state.clone();
        let (focal, row) = match parameter {
            Parameter::Cx => (state.camera.fx, 0),
            _ => (state.camera.fy, 1),
        };
        state.camera = state.camera.with(parameter, state.camera.get(parameter) + side * focal);
        for pose in &mut state.cam_from_target {
            pose.translation[row] -= side * pose.translation.z;
        }
        let minimum = held.minimise(state);
        walked.starts += 1;
        if minimum.system.cost <= walked.best.system.cost + limit {
            walked.far.push(Far { parameter, minimum });
        }
    }
}

/// Rounds of turning tilts and refining together.
const TILT_ROUNDS: usize = 4;

/// Turns planes whose other tilt explains their view better, the camera held, and refines; until none is
/// left.
pub(super) fn with_better_tilts(problem: &Problem<'_>, minimum: Minimum) -> Minimum {
    let mut best = minimum;
    for _ in 0..TILT_ROUNDS {
        let better = chunks::map(problem.observations, |view, _| {
            let own = best.state.cam_from_target[view];
            let (_, cost) = tilt::resected(problem, &best.state, view, own);
            let (pose, other_cost) = tilt::resected(problem, &best.state, view, tilt::mirrored(&own));
            (other_cost < cost * (1.0 - 1e-9)).then_some(pose)
        });
        if better.iter().all(Option::is_none) {
            break;
        }
        let mut turned = best.state.clone();
        for (pose, better) in turned.cam_from_target.iter_mut().zip(better) {
            *pose = better.unwrap_or(*pose);
        }
        let minimum = problem.minimise(turned);
        if !is_better(&minimum, &best) {
            break;
        }
        best = minimum;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::minimise::State;
    use crate::calibrate::normal::Observations;
    use crate::calibrate::tests::plain_problem;
    use crate::camera::{Camera, FreeParameters};
    use crate::geometry::{Mat3, Pose, Vec2, Vec3};

    #[test]
    fn a_principal_point_that_a_facing_target_does_not_tell_may_lie_far_away_on_either_side() {
        let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
        let pose = Pose { rotation: Mat3::identity(), translation: Vec3::new(0.0, 0.0, 100.0) };
        let pair = |i: u32| {
            let point = Vec2::new(f64::from(i % 9) - 4.0, f64::from(i / 9) - 3.0) * 5.0;
            (point, camera.project(&Vec3::new(point.x, point.y, 100.0)).unwrap())
        };
        let observations = [Observations::new((0..63).map(pair))];
        let problem = plain_problem(&observations, FreeParameters::of(&[Parameter::Cx]));
        let held = Problem { free: FreeParameters::NONE, ..problem };
        let best = held.minimise(State { camera, cam_from_target: vec![pose] });
        let mut walked = Walked { best, starts: 0, far: Vec::new(), met: Vec::new() };
        step_aside(&problem, Parameter::Cx, 1.0, &mut walked);
        let far: Vec<f64> = walked.far.iter().map(|far| far.minimum.state.camera.cx).collect();
        // Half of the focal length.
        assert_eq!((walked.starts, far), (2, vec![620.0, 20.0]));
    }
}
