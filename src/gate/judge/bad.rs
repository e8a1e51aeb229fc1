//! What does the solver do where no answer is right? Refuse, flag, admit - or answer wrongly with confidence.

use super::checks::{Basis, Check, Property};
use super::habits::Habits;
use super::{Answers, chance, estimate};
use crate::bad_input::{BadCase, Fault};
use crate::plan::{Plan, Purpose};
use crate::suite::Scenario;
use crate::trial::{Seen, Trial};
use calibench::io::significant;

/// An error of this many stated standard deviations is not admitted by them: by chance it has 2e-9.
const ADMITTED_SD: f64 = 6.0;
/// A focal length this near to the truth is not a wrong answer even where it was luck.
const RIGHT: f64 = 0.01;
/// An error of good size whose squared Mahalanobis distance is rarer than this is wrong.
const WRONG_BELOW: f64 = 1e-9;

/// How a doubtful problem was met.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Conduct {
    Refused,
    Flagged,
    Admitted,
    Right,
    Broken,
    Wrong,
}

impl Conduct {
    fn word(self) -> &'static str {
        match self {
            Conduct::Refused => "refused",
            Conduct::Flagged => "flagged",
            Conduct::Admitted => "uncertainty admitted",
            Conduct::Right => "answered rightly",
            Conduct::Broken => "no answer",
            Conduct::Wrong => "confidently wrong",
        }
    }
}

/// One check a bad problem.
pub(super) fn check(plan: &Plan, seen: &[Option<Seen>], habits: Habits) -> Vec<Check> {
    let of_case = |(case, seen): (&crate::plan::Case, &Option<Seen>)| match case.purpose {
        Purpose::Bad(index) => Some(judge(&plan.bad[index], seen.as_ref()?, habits)),
        _ => None,
    };
    plan.cases.iter().zip(seen).filter_map(of_case).collect()
}

fn judge(case: &BadCase, seen: &Seen, habits: Habits) -> Check {
    let right = |trial: &Trial| {
        let focal = case.truth.fx;
        case.fault == Fault::Degenerate && trial.errors.iter().take(2).all(|e| e.abs() <= RIGHT * focal)
    };
    let conduct = match (case.fault, seen) {
        (Fault::Malformed, Seen::Estimate(trial)) if !is_flagged(trial, habits) => Conduct::Wrong,
        _ => conduct(seen, habits, right),
    };
    let evidence = match (conduct, seen) {
        (Conduct::Refused, Seen::Refused { reason, .. }) => format!("refused: {reason}"),
        (_, Seen::Broken(breakage)) => breakage.to_string(),
        (Conduct::Wrong, _) => match (case.fault, estimate(seen)) {
            (Fault::Malformed, _) | (_, None) => "broken data, answered as if they were sound".to_string(),
            (_, Some(trial)) => wrong(trial, case),
        },
        _ => conduct.word().to_string(),
    };
    let property = match case.fault {
        Fault::Degenerate => Property::Degenerate,
        Fault::Malformed => Property::BadInput,
    };
    let basis = match conduct {
        Conduct::Broken | Conduct::Wrong => Basis::Certain(false),
        // A solver that refuses everything has not looked at the data.
        Conduct::Refused if !habits.answers => Basis::Told,
        _ => Basis::Certain(true),
    };
    let check = Check::new(property, case.id, basis, 1, evidence);
    if conduct == Conduct::Wrong { check.gravely() } else { check }
}

fn wrong(trial: &Trial, case: &BadCase) -> String {
    let stated = match trial.standard_deviations.as_ref().and_then(|s| s.first()) {
        Some(sd) => format!("stated +- {}", significant(*sd, 3)),
        None => "no uncertainty stated".to_string(),
    };
    format!("fx {} ({stated}) where {} is true", significant(trial.camera.fx, 5), case.truth.fx)
}

fn conduct(seen: &Seen, habits: Habits, right: impl Fn(&Trial) -> bool) -> Conduct {
    match seen {
        Seen::Broken(_) => Conduct::Broken,
        Seen::Refused { .. } | Seen::Unsupported(_) => Conduct::Refused,
        Seen::Estimate(trial) if is_flagged(trial, habits) => Conduct::Flagged,
        Seen::Estimate(trial) if admits(trial) => Conduct::Admitted,
        Seen::Estimate(trial) if right(trial) => Conduct::Right,
        Seen::Estimate(_) => Conduct::Wrong,
    }
}

/// Whether a warning tells this answer from good ones.
fn is_flagged(trial: &Trial, habits: Habits) -> bool {
    trial.warnings > 0 && habits.warns_rarely
}

/// Whether the stated standard deviations cover the errors.
fn admits(trial: &Trial) -> bool {
    let Some(stated) = &trial.standard_deviations else { return false };
    !stated.is_empty() && trial.errors.iter().zip(stated).all(|(e, sd)| e.abs() <= ADMITTED_SD * sd)
}

/// How a sample of a doubtful scenario was met.
fn conduct_in_doubt(seen: &Seen, habits: Habits) -> Conduct {
    conduct(seen, habits, |trial| chance::above(trial.nees, trial.errors.len()) > WRONG_BELOW)
}

/// Whether a sample of a doubtful scenario was answered wrongly with confidence.
pub fn misled(seen: &Seen) -> bool {
    conduct_in_doubt(seen, Habits::UNKNOWN) == Conduct::Wrong
}

/// One check over all samples of a doubtful scenario: no more confident wrong answers than textbook least
/// squares gives.
pub(super) fn honesty(scenario: &Scenario, answers: &Answers<'_>) -> Check {
    let mut conducts: Vec<Conduct> = answers
        .for_purpose(Purpose::Sample)
        .map(|(_, seen)| conduct_in_doubt(seen, answers.habits))
        .collect();
    conducts.sort();
    let mut evidence = Vec::new();
    for kind in [
        Conduct::Refused,
        Conduct::Flagged,
        Conduct::Admitted,
        Conduct::Right,
        Conduct::Broken,
        Conduct::Wrong,
    ] {
        let count = conducts.iter().filter(|c| **c == kind).count();
        if count > 0 {
            evidence.push(format!("{count} {}", kind.word()));
        }
    }
    let wrong = conducts.iter().filter(|c| **c == Conduct::Wrong).count();
    let basis = if answers.habits.answers {
        Basis::Chance(chance::at_least(wrong, conducts.len(), scenario.textbook_misled))
    } else {
        evidence.push("good data are refused too, so that this tells nothing".to_string());
        Basis::Told
    };
    Check::new(Property::Honesty, scenario.id, basis, conducts.len(), evidence.join(", ")).gravely()
}

#[cfg(test)]
mod tests {
    use super::super::tests::{answered, change_trials};
    use super::*;

    #[test]
    fn a_warning_flags_an_answer_where_warnings_are_rare() {
        let (plan, mut seen) = answered(1);
        change_trials(&plan, &mut seen, Purpose::Sample, |trial| {
            trial.warnings = 1;
            trial.standard_deviations = None;
        });
        let at = plan.cases.iter().position(|case| case.purpose == Purpose::Sample).unwrap();
        let met = |warns_rarely| {
            let habits = Habits { warns_rarely, ..Habits::UNKNOWN };
            conduct(seen[at].as_ref().unwrap(), habits, |_| false)
        };
        assert_eq!((met(true), met(false)), (Conduct::Flagged, Conduct::Wrong));
    }
}
