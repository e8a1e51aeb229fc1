//! What does the solver do on good data? A warning tells something only where warnings are rare, a refusal
//! only where good data are answered.

use super::checks::{Basis, Check, Property};
use super::{Answers, chance, estimate};
use crate::plan::Plan;
use crate::plan::Purpose;
use crate::suite::{Demand, Scenario};
use crate::trial::Seen;

/// Share of good problems that may be warned about.
const WARNED: f64 = 0.05;
/// Warnings are taken for rare unless their count over all good data has less than this chance at that share.
const SURELY: f64 = 1e-6;

/// How a solver meets good data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Habits {
    /// Whether its warnings tell good data from bad.
    pub warns_rarely: bool,
    /// Whether it answers good data at all.
    pub answers: bool,
}

impl Habits {
    /// Those of a solver of which nothing is known.
    pub const UNKNOWN: Habits = Habits { warns_rarely: true, answers: true };

    /// Those seen on the samples of all scenes where the law holds.
    pub fn of(plan: &Plan, seen: &[Option<Seen>]) -> Habits {
        let is_good = |scenario: usize| plan.scenarios[scenario].demand == Demand::Law;
        let replies = plan
            .cases
            .iter()
            .zip(seen)
            .filter(|(case, _)| case.purpose == Purpose::Sample && is_good(case.scenario));
        let (mut asked, mut answered, mut warned) = (0, 0, 0);
        for reply in replies.filter_map(|(_, seen)| seen.as_ref()) {
            asked += 1;
            if let Some(trial) = estimate(reply) {
                answered += 1;
                warned += usize::from(trial.warnings > 0);
            }
        }
        Habits {
            warns_rarely: chance::at_least(warned, answered, WARNED) > SURELY,
            answers: asked == 0 || answered > 0,
        }
    }
}

/// Whether good data are warned about seldom enough.
pub(super) fn specificity(scenario: &Scenario, answers: &Answers<'_>) -> Check {
    let samples = answers.samples();
    let warned = samples.iter().filter(|trial| trial.warnings > 0).count();
    let p = chance::at_least(warned, samples.len(), WARNED);
    let evidence = format!(
        "{warned} of {} answers to good data with a warning; {} % allowed",
        samples.len(),
        100.0 * WARNED
    );
    Check::new(Property::Specificity, scenario.id, Basis::Chance(p), samples.len(), evidence)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{answered, change};
    use super::*;
    use std::cell::Cell;

    #[test]
    fn warnings_are_rare_until_they_are_beyond_chance_at_one_in_twenty() {
        let (plan, seen) = answered(5);
        let after = |warned: usize| {
            let (mut seen, left) = (seen.clone(), Cell::new(warned));
            change(&plan, &mut seen, Purpose::Sample, |seen| {
                let Seen::Estimate(trial) = seen else { panic!("it is answered") };
                trial.warnings = usize::from(left.get() > 0);
                left.set(left.get().saturating_sub(1));
            });
            Habits::of(&plan, &seen).warns_rarely
        };
        // Five of five by chance: 0.05^5 = 3e-7. Four of five: 5 * 0.05^4 * 0.95 = 3e-5.
        assert_eq!([0, 1, 4, 5].map(after), [true, true, true, false]);
    }

    #[test]
    fn who_refuses_all_good_data_answers_none_and_who_was_not_asked_is_not_known_to() {
        let (plan, mut seen) = answered(2);
        assert!(Habits::of(&plan, &seen).answers);
        let refuse = |seen: &mut Seen| *seen = Seen::Refused { reason: "no".into(), seconds: 0.0 };
        change(&plan, &mut seen, Purpose::Sample, refuse);
        assert!(!Habits::of(&plan, &seen).answers);
        assert!(Habits::of(&plan, &vec![None; seen.len()]).answers);
    }

    #[test]
    fn warnings_of_good_data_are_counted_against_one_in_twenty() {
        let (plan, mut seen) = answered(3);
        let left = Cell::new(1);
        change(&plan, &mut seen, Purpose::Sample, |seen| {
            let Seen::Estimate(trial) = seen else { panic!("it is answered") };
            trial.warnings = 3 * left.replace(0);
        });
        let check = super::super::tests::on_scene(&plan, &seen, specificity);
        // One at least of three: 1 - 0.95^3.
        let Basis::Chance(p) = check.basis else { panic!("{check:?}") };
        assert!((p - 0.142_625).abs() < 1e-12 && check.problems == 3, "{check:?}");
    }
}
