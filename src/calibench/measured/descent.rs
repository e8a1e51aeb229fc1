//! Which unknowns make the cost least? Levenberg-Marquardt with damping `lambda diag(H)`, after Nielsen
//! (1999).

use super::equations::Equations;
use super::problem::{Problem, State};
use crate::calibrate::Termination;

/// A minimum, or where the search ended.
pub(super) struct Minimum {
    pub state: State,
    /// At `state`.
    pub equations: Equations,
    pub termination: Termination,
    pub iterations: usize,
}

/// A step that gains less than this part of the cost moves no unknown by more than a millionth of its
/// standard deviation.
const RELATIVE_GAIN: f64 = 1e-14;
/// Small enough not to slow a good start, large enough to tame a singular first matrix.
const FIRST_DAMPING: f64 = 1e-6;
const LEAST_DAMPING: f64 = 1e-12;
/// With this damping a step is a short way down the gradient; if that fails, nothing helps.
const LARGEST_DAMPING: f64 = 1e10;
/// Sums of squares are not known better than this many roundings.
const ROUNDINGS: f64 = 8.0;
/// Undamped steps from a minimum to its last digits: each gains three digits or more on ordinary data.
const LAST_STEPS: usize = 5;

/// The minimum that a start leads to; `None` where the start has no cost.
pub(super) fn descend(problem: &Problem<'_>, start: State) -> Option<Minimum> {
    let rounding = problem.rounding_cost();
    let (mut state, mut iterations) = (start, 0);
    let mut here = problem.equations(&state)?;
    let (mut damping, mut growth) = (FIRST_DAMPING, 2.0);
    let termination = loop {
        if here.unknowns() == 0 {
            break Termination::Converged;
        }
        if iterations >= problem.max_iterations {
            break Termination::IterationLimit;
        }
        if damping > LARGEST_DAMPING {
            break Termination::Stalled;
        }
        let Some(step) = here.solve(damping) else {
            damping *= 10.0;
            continue;
        };
        if damping <= FIRST_DAMPING && step.predicted_gain <= RELATIVE_GAIN * here.cost + rounding {
            break Termination::Converged;
        }
        iterations += 1;
        let next = problem.stepped(&state, &step);
        match problem.equations(&next) {
            Some(ahead) if ahead.cost < here.cost => {
                let kept = (here.cost - ahead.cost) / step.predicted_gain;
                let off = 2.0 * kept - 1.0;
                damping = (damping * (1.0 - off * off * off).max(0.1)).max(LEAST_DAMPING);
                growth = 2.0;
                (here, state) = (ahead, next);
            }
            // The promised gain is below what the sum of squares can show.
            _ if step.predicted_gain <= ROUNDINGS * f64::EPSILON * here.cost + rounding => {
                break Termination::Converged;
            }
            _ => {
                damping = damping.max(LEAST_DAMPING) * growth;
                growth *= 2.0;
            }
        }
    };
    let found = Minimum { state, equations: here, termination, iterations };
    Some(if termination == Termination::Converged { to_last_digits(problem, found) } else { found })
}

/// Undamped steps as long as they shrink.
fn to_last_digits(problem: &Problem<'_>, mut minimum: Minimum) -> Minimum {
    let mut last_gain = f64::INFINITY;
    for _ in 0..LAST_STEPS {
        let Some(step) = minimum.equations.solve(0.0) else { break };
        // A step is shorter than the last by half at least, or it is rounding.
        if step.predicted_gain.is_nan() || step.predicted_gain > 0.25 * last_gain {
            break;
        }
        last_gain = step.predicted_gain;
        let next = problem.stepped(&minimum.state, &step);
        let Some(equations) = problem.equations(&next) else { break };
        (minimum.state, minimum.equations) = (next, equations);
        if last_gain <= 0.0 {
            break;
        }
    }
    minimum
}
