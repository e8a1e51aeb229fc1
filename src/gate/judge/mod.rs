//! What follows from the answers? One check a property and scenario, then one decision over all of them.

mod assumptions;
mod bad;
mod chance;
mod checks;
mod decide;
mod exact;
mod habits;
mod invariance;
mod rmse;
mod statistics;

pub use assumptions::{Admission, TOLERATED, TooSmall, VISIBLE, admissions};
pub(super) use bad::misled;
pub(super) use chance::at_least;
pub use checks::{Basis, Check, Property, Verdict};
pub use decide::{EXPECTED_FALSE_ALARMS, Terms, decide};

use self::habits::Habits;
use super::plan::{Case, Plan, Purpose};
use super::suite::{Demand, Scenario};
use super::trial::{Seen, Trial};

/// Every check of a plan on the answers seen so far, decided.
pub fn judged(plan: &Plan, seen: &[Option<Seen>], terms: &Terms) -> Vec<Check> {
    decide(check(plan, seen, terms), terms)
}

/// Every check, undecided.
pub fn check(plan: &Plan, seen: &[Option<Seen>], terms: &Terms) -> Vec<Check> {
    let habits = Habits::of(plan, seen);
    let mut checks = bad::check(plan, seen, habits);
    for (index, scenario) in plan.scenarios.iter().enumerate() {
        let answers = Answers::of(plan, seen, index, habits);
        if let Some(reason) = answers.unsupported().filter(|_| habits.answers) {
            let evidence = format!("not supported: {reason}");
            checks.push(Check::new(Property::Convergence, scenario.id, Basis::Told, 0, evidence));
            continue;
        }
        checks.extend(exact::protocol(scenario, &answers));
        match scenario.demand {
            Demand::Honesty => checks.push(bad::honesty(scenario, &answers)),
            Demand::Assumptions => checks.push(assumptions::check(scenario, &answers)),
            Demand::Law => {
                checks.extend(exact::check(scenario, &answers, terms));
                checks.push(habits::specificity(scenario, &answers));
                checks.extend(statistics::check(scenario, &answers));
                checks.extend(rmse::check(scenario, &answers));
                checks.extend(invariance::check(scenario, &answers));
            }
        }
    }
    checks
}

/// The answers of one scenario.
struct Answers<'a> {
    cases: Vec<(&'a Case, &'a Seen)>,
    /// How the solver meets good data.
    habits: Habits,
}

impl<'a> Answers<'a> {
    fn of(plan: &'a Plan, seen: &'a [Option<Seen>], index: usize, habits: Habits) -> Answers<'a> {
        let of_scenario = |case: &Case| case.scenario == index && !matches!(case.purpose, Purpose::Bad(_));
        let cases = plan.cases.iter().zip(seen).filter(|(case, _)| of_scenario(case));
        Answers { cases: cases.filter_map(|(case, seen)| Some((case, seen.as_ref()?))).collect(), habits }
    }

    fn for_purpose(&self, purpose: Purpose) -> impl Iterator<Item = (u64, &'a Seen)> {
        self.cases
            .iter()
            .filter(move |(case, _)| case.purpose == purpose)
            .map(|&(case, seen)| (case.trial, seen))
    }

    /// Why the solver says that it is not made for this scene, if it says so of every problem: of some only
    /// is no reason.
    fn unsupported(&self) -> Option<&'a str> {
        let reasons = self.cases.iter().map(|(_, seen)| match seen {
            Seen::Unsupported(reason) => Some(reason.as_str()),
            _ => None,
        });
        reasons.collect::<Option<Vec<&str>>>()?.first().copied()
    }

    /// The estimates of samples, in order.
    fn samples(&self) -> Vec<&'a Trial> {
        self.for_purpose(Purpose::Sample).filter_map(|(_, seen)| estimate(seen)).collect()
    }
}

fn estimate(seen: &Seen) -> Option<&Trial> {
    match seen {
        Seen::Estimate(trial) => Some(trial),
        _ => None,
    }
}

/// An error of the camera as the noise that would cause it: `sigma sqrt(e^T P^-1 e / k)`, px.
fn equivalent_noise_px(scenario: &Scenario, nees: f64, dimensions: usize) -> f64 {
    scenario.sigma_px * (nees / dimensions as f64).sqrt()
}
