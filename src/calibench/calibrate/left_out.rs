//! Do coefficients that are left out matter? Rao's score test (1948): what the cost would fall by if they
//! were free, to second order at the minimum without them, with no further fit.
//!
//! With the normal equations `H` and the gradient `g` of a problem in which `k` coefficients more are free,
//! at the minimum with these at 0, the cost falls by `g^T H^-1 g`. If they are 0 in truth, that over `k`
//! variances of a coordinate follows Fisher's F of `k` and the residuals' degrees of freedom.

use super::chance::fisher_tail;
use super::minimise::{Minimum, Problem};
use super::system::{Step, System};
use super::{Loss, Role, Settings, Warning};
use crate::camera::Parameter;

/// Coefficients that come together.
pub(super) type LeftOut = &'static [Parameter];

/// What are looked for, each by itself: what most lenses have and the standard choice leaves out.
const ASKED: [LeftOut; 2] = [&[Parameter::P1, Parameter::P2], &[Parameter::K3]];
/// A set whose lens has none of them is told that it has with this probability, for each.
const CHANCE: f64 = 1e-5;

/// The coefficients that nobody has decided on.
pub(super) fn undecided(settings: &Settings) -> Vec<LeftOut> {
    let is_left_out = |list: &LeftOut| list.iter().all(|&p| settings.role(p) == Role::Default);
    ASKED.into_iter().filter(is_left_out).collect()
}

/// Those of `undecided` that the marks ask for; `variance` is that of a coordinate, with so many degrees of
/// freedom.
pub(super) fn asked_for(
    problem: &Problem<'_>,
    minimum: &Minimum,
    undecided: &[LeftOut],
    variance: f64,
    freedom: f64,
) -> Vec<Warning> {
    if problem.loss != Loss::Squares
        || minimum.system.cost <= problem.rounding_cost
        || !minimum.termination.is_minimum()
    {
        return Vec::new();
    }
    let asked = |parameters: &LeftOut| {
        let k = parameters.len();
        let fall = fall(problem, minimum, parameters)? / variance;
        let below = (freedom as usize).checked_sub(k).filter(|&below| below > 0)?;
        let probability = fisher_tail(fall / k as f64, k, below);
        let parameters = parameters.to_vec();
        (probability < CHANCE).then_some(Warning::LeftOut { parameters, fall, probability })
    };
    undecided.iter().filter_map(asked).collect()
}

/// What the cost would fall by with these coefficients free.
fn fall(problem: &Problem<'_>, minimum: &Minimum, parameters: &[Parameter]) -> Option<f64> {
    let free = parameters.iter().fold(problem.free, |free, &parameter| free.with(parameter));
    let wider = Problem { free, ..*problem };
    let mut system = System::new(free, problem.observations.len());
    wider.linearise_into(&minimum.state, &mut system);
    let mut step = Step::default();
    system.solve_into(0.0, &mut step)?;
    Some(step.predicted_gain).filter(|gain| gain.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_decided_on_is_not_asked() {
        use Parameter::{K3, P1, P2};
        let standard = Settings::standard();
        let (tangential, radial): (LeftOut, LeftOut) = (&[P1, P2], &[K3]);
        assert_eq!(undecided(&standard), [tangential, radial]);
        assert_eq!(undecided(&standard.clone().hold(K3, 0.0)), [tangential]);
        assert_eq!(undecided(&standard.clone().estimate(P2)), [radial]);
        assert!(undecided(&standard.estimate(P1).estimate(K3)).is_empty());
    }
}
