//! Which of several minima is the best once the marks' positions are estimated too? All that are met compete,
//! whatever led to them; those that lose may still be rivals.

use super::descent::{Minimum, descend};
use super::noise::settled;
use super::problem::{Problem, State};
use super::{MeasuredError, Noise, focal};
use crate::calibrate::Termination;

/// Better focal lengths that lead to better ones.
const ROUNDS: usize = 3;
/// A cost that falls by less than this part is the same minimum again.
const GAIN: f64 = 1e-6;

/// The best minimum, at the noise that it settles, and the others.
pub(super) struct Found<'a> {
    pub problem: Problem<'a>,
    pub best: Minimum,
    /// Where searches ended in a minimum that is not as good.
    pub others: Vec<State>,
}

/// The best of `minima`, and of those of other focal lengths where it tells its own badly.
///
/// # Errors
/// As [`settled`]; [`MeasuredError::NoStart`] without minima.
pub(super) fn best(
    problem: Problem<'_>,
    noise: Noise,
    minima: Vec<Minimum>,
) -> Result<Found<'_>, MeasuredError> {
    let mut minima = minima.into_iter();
    let first = minima.next().ok_or(MeasuredError::NoStart)?;
    let (problem, mut best) = settled(problem, noise, first.state)?;
    best.iterations += first.iterations;
    let mut found = Found { problem, best, others: Vec::new() };
    for minimum in minima {
        found.meet(minimum.state, noise)?;
    }
    for _ in 0..ROUNDS {
        let before = found.best.equations.cost;
        for state in focal::starts(&found.problem, &found.best) {
            found.meet(state, noise)?;
        }
        if found.best.equations.cost >= (1.0 - GAIN) * before {
            break;
        }
    }
    Ok(found)
}

impl Found<'_> {
    /// Goes on from `state`, and keeps the better minimum.
    fn meet(&mut self, state: State, noise: Noise) -> Result<(), MeasuredError> {
        // Costs are compared at one noise.
        let Some(next) = descend(&self.problem, state) else { return Ok(()) };
        if is_better(&next, &self.best) {
            let (problem, better) = settled(self.problem, noise, next.state)?;
            let iterations = self.best.iterations + next.iterations + better.iterations;
            self.problem = problem;
            self.others.push(std::mem::replace(&mut self.best, Minimum { iterations, ..better }).state);
        } else if next.termination == Termination::Converged {
            self.others.push(next.state);
        }
        Ok(())
    }
}

/// Less cost, and where only one of two searches ended in a minimum, so much less that it is not a valley
/// without end.
fn is_better(next: &Minimum, best: &Minimum) -> bool {
    let ends = |m: &Minimum| m.termination == Termination::Converged;
    let (a, b) = (next.equations.cost, best.equations.cost);
    match (ends(next), ends(best)) {
        (true, false) => a < b * (1.0 + MARGIN),
        (false, true) => a * (1.0 + MARGIN) < b,
        _ => a < b,
    }
}

/// A part of the cost that a handful of a thousand residuals may make.
const MARGIN: f64 = 1e-2;
