//! Is there a better minimum at another focal length? The profile of the cost: a focal length is held, the rest refitted.
//!
//! With small tilts every plane has two poses that do, and each choice of them has a minimum of its own, at its own focal length. Walking along
//! the focal length with the better tilt of every plane at each step meets them one after another. The same walk tells how far the
//! focal length could be off: where the cost does not rise, the data do not determine it.

use super::minimise::{Minimum, Problem};
use super::retraction::scaled;
use super::search::is_better;
use super::tilt;
use crate::camera::Parameter;

/// A step of the walk: a minimum of the profile is wider.
const STEP: f64 = 1.2;
/// Steps each way: a factor of 3.
const STEPS: usize = 6;
/// The walk turns where the cost has risen by this many variances: what is farther off is far worse.
const RISEN: f64 = 100.0;
/// From steps of the walk whose cost exceeds the least by fewer variances than this, the search goes on with the focal length free.
const PROMISING: f64 = 12.0;
/// Walks, each from a better minimum than the one before.
const WALKS: usize = 4;

/// What a walk found.
pub(super) struct Walked {
    pub best: Minimum,
    /// Searches on the way.
    pub starts: usize,
    /// `(focal length over the best one's, cost)` of the last walk, in order.
    pub profile: Vec<(f64, f64)>,
}

/// Walks both ways from a minimum, and again from any better one, for noise of `noise_px`.
pub(super) fn along_focal_length(problem: &Problem<'_>, minimum: Minimum, noise_px: f64) -> Walked {
    let mut walked = Walked { best: minimum, starts: 0, profile: Vec::new() };
    let Some(focal) = [Parameter::Fx, Parameter::Fy].into_iter().find(|&p| problem.free.contains(p)) else {
        return walked;
    };
    let variance = noise_px * noise_px;
    for _ in 0..WALKS {
        let origin = walked.best.system.cost;
        let mut profile = Vec::new();
        let mut better: Option<Minimum> = None;
        for factor in [STEP, 1.0 / STEP] {
            let mut state = walked.best.state.clone();
            let mut total = 1.0;
            for _ in 0..STEPS {
                total *= factor;
                let held = Problem { free: problem.free.without(focal), ..*problem };
                let start = scaled(&state, problem.free, factor);
                let step = with_better_tilts(&held, held.minimise(start));
                walked.starts += 1;
                profile.push((total, step.system.cost));
                let least = better.as_ref().map_or(origin, |b| b.system.cost);
                if step.system.cost < least + PROMISING * variance {
                    let minimum = with_better_tilts(problem, problem.minimise(step.state.clone()));
                    walked.starts += 1;
                    if is_better(&minimum, better.as_ref().unwrap_or(&walked.best)) {
                        better = Some(minimum);
                    }
                }
                if step.system.cost > origin + RISEN * variance {
                    break;
                }
                state = step.state;
            }
        }
        profile.sort_by(|a, b| a.0.total_cmp(&b.0));
        walked.profile = profile;
        match better {
            Some(minimum) => walked.best = minimum,
            None => break,
        }
    }
    walked
}

/// Rounds of turning tilts and refining together.
const TILT_ROUNDS: usize = 4;

/// Turns planes whose other tilt explains their view better, the camera held, and refines; until none is left.
pub(super) fn with_better_tilts(problem: &Problem<'_>, minimum: Minimum) -> Minimum {
    let mut best = minimum;
    for _ in 0..TILT_ROUNDS {
        let mut turned = best.state.clone();
        let mut gained = false;
        for view in 0..problem.observations.len() {
            let (_, cost) = tilt::resected(problem, &best.state, view, best.state.cam_from_target[view]);
            let other = tilt::mirrored(&best.state.cam_from_target[view]);
            let (pose, other_cost) = tilt::resected(problem, &best.state, view, other);
            if other_cost < cost * (1.0 - 1e-9) {
                turned.cam_from_target[view] = pose;
                gained = true;
            }
        }
        if !gained {
            break;
        }
        let minimum = problem.minimise(turned);
        if !is_better(&minimum, &best) {
            break;
        }
        best = minimum;
    }
    best
}
