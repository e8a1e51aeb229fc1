//! Which checks fail, at one stated rate of false alarms for all of them together?

use super::checks::{Basis, Check, Property, Verdict};
use crate::allowances::Allowance;

/// Chance that a correct solver fails any check of a run, unless the user asks for another.
pub const EXPECTED_FALSE_ALARMS: f64 = 1e-3;

/// By what a run is judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Terms {
    /// Chance that a correct solver fails any check.
    pub false_alarm_rate: f64,
    /// Properties whose failure is known and does not fail the run.
    pub accepted: Vec<Property>,
    /// Failures that are known, with a reason each.
    pub allowances: Vec<Allowance>,
    /// Longest median time for a problem, s; without it, time is told and not judged.
    pub median_seconds: Option<f64>,
}

impl Default for Terms {
    fn default() -> Terms {
        Terms {
            false_alarm_rate: EXPECTED_FALSE_ALARMS,
            accepted: Vec::new(),
            allowances: Vec::new(),
            median_seconds: None,
        }
    }
}

impl Terms {
    /// Whether the failure of a check is known.
    fn allow(&self, check: &Check) -> bool {
        self.accepted.contains(&check.property) || self.allowances.iter().any(|a| a.covers(check))
    }
}

/// Which of these p-values are rejected, by Holm's step-down procedure (1979): with `m` of them in ascending
/// order, the i-th is rejected while it is at most `overall / (m - i + 1)`; the chance of any false rejection
/// is at most `overall`, however they depend on each other.
pub fn rejected(p_values: &[f64], overall: f64) -> Vec<bool> {
    let count = p_values.len();
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| p_values[a].total_cmp(&p_values[b]));
    let mut fails = vec![false; count];
    let ranked = order.iter().enumerate();
    ranked
        .take_while(|&(rank, &i)| p_values[i] <= overall / (count - rank) as f64)
        .for_each(|(_, &i)| fails[i] = true);
    fails
}

/// Decides every check, those that rest on chance by [`rejected`].
pub fn decide(mut checks: Vec<Check>, terms: &Terms) -> Vec<Check> {
    let chances = checks.iter().enumerate().filter_map(|(i, check)| match check.basis {
        Basis::Chance(p) => Some((i, p)),
        _ => None,
    });
    let (at, p_values): (Vec<usize>, Vec<f64>) = chances.unzip();
    let mut fails: Vec<bool> = checks.iter().map(|c| c.basis == Basis::Certain(false)).collect();
    at.iter()
        .zip(rejected(&p_values, terms.false_alarm_rate))
        .for_each(|(&i, is_rejected)| fails[i] = is_rejected);
    for (check, fails) in checks.iter_mut().zip(fails) {
        check.verdict = match (check.basis, fails) {
            (Basis::Told, _) => Verdict::NotJudged,
            // What nothing was asked of does not hold.
            (_, false) if check.problems == 0 => Verdict::NotJudged,
            (_, false) => Verdict::Held,
            (_, true) if terms.allow(check) => Verdict::Accepted,
            (_, true) if check.grave => Verdict::Grave,
            (_, true) => Verdict::Failed,
        };
    }
    checks
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checks(p: &[f64]) -> Vec<Check> {
        p.iter().map(|&p| Check::new(Property::Bias, "s", Basis::Chance(p), 1, "")).collect()
    }

    fn terms(accepted: &[Property]) -> Terms {
        Terms { false_alarm_rate: 0.05, accepted: accepted.to_vec(), ..Terms::default() }
    }

    #[test]
    fn holm_steps_down_and_stops_at_the_first_that_holds() {
        // 0.05/3 = 0.0167, 0.05/2 = 0.025, 0.05: the second is above its limit, so the third holds too.
        let verdicts: Vec<Verdict> =
            decide(checks(&[0.04, 0.01, 0.03]), &terms(&[])).iter().map(|c| c.verdict).collect();
        assert_eq!(verdicts, [Verdict::Held, Verdict::Failed, Verdict::Held]);
        let all = decide(checks(&[0.04, 0.01, 0.02]), &terms(&[]));
        assert!(all.iter().all(|c| c.verdict == Verdict::Failed));
    }

    #[test]
    fn what_rests_on_no_problem_is_not_judged() {
        let empty = |basis| Check::new(Property::Bias, "s", basis, 0, "");
        let decided = decide(
            vec![empty(Basis::Certain(true)), empty(Basis::Chance(1.0)), empty(Basis::Certain(false))],
            &terms(&[]),
        );
        let verdicts: Vec<Verdict> = decided.iter().map(|c| c.verdict).collect();
        assert_eq!(verdicts, [Verdict::NotJudged, Verdict::NotJudged, Verdict::Failed]);
    }

    #[test]
    fn what_is_accepted_does_not_fail() {
        let decided = decide(checks(&[1e-9]), &terms(&[Property::Bias]));
        assert_eq!(decided[0].verdict, Verdict::Accepted);
    }

    #[test]
    fn a_confident_wrong_answer_fails_gravely_and_one_that_holds_does_not() {
        let with = |basis| Check::new(Property::Bias, "s", basis, 1, "").gravely();
        let decided = decide(vec![with(Basis::Certain(false)), with(Basis::Certain(true))], &terms(&[]));
        assert_eq!([decided[0].verdict, decided[1].verdict], [Verdict::Grave, Verdict::Held]);
        // What is accepted of another property is not accepted of this one.
        let decided = decide(checks(&[1e-9]), &terms(&[Property::Rmse]));
        assert_eq!(decided[0].verdict, Verdict::Failed);
    }

    #[test]
    fn a_p_value_at_its_limit_is_rejected() {
        assert_eq!(rejected(&[0.025, 0.06], 0.05), [true, false]);
        assert_eq!(rejected(&[0.03, 0.025], 0.05), [true, true]);
        assert_eq!(rejected(&[], 0.05), [false; 0]);
    }
}
