//! What does the solver do where no answer is right? Refuse, flag, admit - or answer wrongly with confidence.

use super::checks::{Basis, Check, Property};
use super::habits::Habits;
use super::{Answers, chance, estimate};
use crate::accept::free_of;
use crate::bad_input::{BadCase, Fault};
use crate::plan::{Plan, Purpose};
use crate::suite::Scenario;
use crate::trial::{Seen, Trial};
use calibench::camera::{Camera, Lens, Parameter};
use calibench::evaluate::difference::frame_nodes;
use calibench::geometry::Vec2;
use calibench::io::significant;

/// An error of this many stated standard deviations is not admitted by them: by chance it has 2e-9.
const ADMITTED_SD: f64 = 6.0;
/// A camera that shows everything in the image this near to where the true one does, in focal lengths, is not
/// a wrong answer even where it was luck.
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
    let right = |trial: &Trial| case.fault == Fault::Degenerate && shows_the_same(&trial.camera, case);
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

/// Whether a camera shows the image's rays where the true camera does, all parameters together: the right
/// focal length is no right answer with a principal point or a distortion that nobody's camera has.
fn shows_the_same(camera: &Camera<Lens>, case: &BadCase) -> bool {
    let [width, height] = case.problem.image_size;
    let near = |node: &Vec2| {
        let Ok(ray) = case.truth.ray(node) else { return true };
        camera.pixel(&ray).is_some_and(|pixel| (pixel - node).norm() <= RIGHT * case.truth.fx)
    };
    frame_nodes((width, height)).0.iter().all(near)
}

/// The estimated parameter that lies farthest off in stated deviations, or in parts of its own size where
/// none are stated.
fn wrong(trial: &Trial, case: &BadCase) -> String {
    let parameters: Vec<Parameter> = free_of(&case.problem).iter().collect();
    let truth = |parameter| case.truth.value(parameter).unwrap_or(0.0);
    let stated = |i: usize| trial.standard_deviations.as_ref()?.get(i).copied();
    let off = |i: usize| trial.errors[i].abs() / stated(i).unwrap_or(truth(parameters[i]).abs().max(1.0));
    let worst = (0..parameters.len().min(trial.errors.len())).max_by(|&a, &b| off(a).total_cmp(&off(b)));
    let Some(worst) = worst else { return "nothing was estimated".to_string() };
    let parameter = parameters[worst];
    let stated = match stated(worst) {
        Some(sd) => format!("stated +- {}", significant(sd, 3)),
        None => "no uncertainty stated".to_string(),
    };
    let value = significant(trial.camera.value(parameter).unwrap_or(f64::NAN), 5);
    format!("{parameter} {value} ({stated}) where {} is true", truth(parameter))
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
    use super::super::tests::{answered, any_estimate, change_trials};
    use super::*;
    use crate::bad_input::bad_cases;

    #[test]
    fn a_right_focal_length_alone_is_no_right_answer() {
        let (_, any) = any_estimate();
        let cases = bad_cases(1).unwrap();
        let case = cases.iter().find(|case| case.fault == Fault::Degenerate).unwrap();
        let free = free_of(&case.problem);
        let judged = |camera: Camera<Lens>, sd: f64| {
            let error = |p: Parameter| camera.value(p).unwrap() - case.truth.value(p).unwrap();
            let trial = Trial {
                camera,
                errors: free.iter().map(error).collect(),
                standard_deviations: Some(vec![sd; free.len()]),
                warnings: 0,
                ..any.clone()
            };
            judge(case, &Seen::Estimate(Box::new(trial)), Habits::UNKNOWN)
        };
        let truth = case.truth;
        assert_eq!(judged(truth, 1e-3).basis, Basis::Certain(true));
        let lucky = Camera { fx: 1.005 * truth.fx, fy: 1.005 * truth.fy, ..truth };
        assert_eq!(judged(lucky, 1e-3).basis, Basis::Certain(true));
        let elsewhere = Camera { cx: -5000.0, ..truth };
        let check = judged(elsewhere, 1e-3);
        assert_eq!(check.basis, Basis::Certain(false));
        assert!(check.evidence.starts_with("cx -5000.0 (stated +- 0.00100) where"), "{}", check.evidence);
        // What is admitted is no lie.
        assert_eq!(judged(elsewhere, 1e3).basis, Basis::Certain(true));
        let bent = truth.with_value(Parameter::K1, 30.0).unwrap();
        assert!(judged(bent, 1e-3).evidence.starts_with("k1 30"));
        let narrow = Camera { fy: 1e6, ..truth };
        assert!(judged(narrow, 1e-3).evidence.starts_with("fy "));
    }

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

    #[test]
    fn an_error_is_admitted_by_six_stated_deviations_of_every_parameter() {
        let (_, any) = any_estimate();
        let admits = |errors: &[f64], sd: Option<&[f64]>| {
            let standard_deviations = sd.map(<[f64]>::to_vec);
            admits(&Trial { errors: errors.to_vec(), standard_deviations, ..any.clone() })
        };
        assert!(admits(&[5.9, -11.9], Some(&[1.0, 2.0])));
        assert!(!admits(&[6.1, 0.0], Some(&[1.0, 2.0])) && !admits(&[0.0, -12.1], Some(&[1.0, 2.0])));
        assert!(!admits(&[0.0], None) && !admits(&[], Some(&[])) && !admits(&[f64::NAN], Some(&[1.0])));
    }

    #[test]
    fn broken_data_are_refused_or_flagged_and_never_answered() {
        let (_, any) = any_estimate();
        let cases = bad_cases(1).unwrap();
        let case = cases.iter().find(|case| case.fault == Fault::Malformed).unwrap();
        let judged = |seen: Seen, habits| {
            let check = judge(case, &seen, habits);
            (check.property, check.basis, check.grave)
        };
        let answer = |warnings| {
            let sure = Some(vec![1e9; any.errors.len()]);
            Seen::Estimate(Box::new(Trial { warnings, standard_deviations: sure, ..any.clone() }))
        };
        let refused = || Seen::Refused { reason: "no".into(), seconds: 0.0 };
        let held = |is_held| (Property::BadInput, Basis::Certain(is_held), !is_held);
        assert_eq!(judged(answer(0), Habits::UNKNOWN), held(false));
        assert_eq!(judged(answer(1), Habits::UNKNOWN), held(true));
        assert_eq!(judged(refused(), Habits::UNKNOWN), held(true));
        let mute = Habits { answers: false, ..Habits::UNKNOWN };
        assert_eq!(judged(refused(), mute), (Property::BadInput, Basis::Told, false));
    }

    #[test]
    fn confident_wrong_answers_are_counted_against_the_textbooks_rate() {
        let (plan, mut seen) = answered(2);
        change_trials(&plan, &mut seen, Purpose::Sample, |trial| {
            (trial.nees, trial.warnings) = (1e4, 0);
            (trial.errors, trial.standard_deviations) = (vec![7.0; 6], Some(vec![1.0; 6]));
        });
        let scenario = Scenario { textbook_misled: 0.01, ..plan.scenarios[0].clone() };
        let check = honesty(&scenario, &Answers::of(&plan, &seen, 0, Habits::UNKNOWN));
        assert_eq!(check.evidence, "2 confidently wrong");
        let Basis::Chance(p) = check.basis else { panic!("{check:?}") };
        assert!((p / 1e-4 - 1.0).abs() < 1e-9 && check.grave, "{p}");
    }

    #[test]
    fn an_error_that_chance_makes_once_in_a_thousand_million_is_right_and_a_rarer_one_misleads() {
        let (_, any) = any_estimate();
        // Above x on six degrees lies exp(-y) (1 + y + y^2 / 2), y = x / 2: 4.7e-9 and 2.9e-10.
        for (nees, is_misled) in [(6.0, false), (50.0, false), (56.0, true)] {
            let (errors, standard_deviations) = (vec![7.0; 6], Some(vec![1.0; 6]));
            let trial = Trial { nees, warnings: 0, errors, standard_deviations, ..any.clone() };
            assert_eq!(misled(&Seen::Estimate(Box::new(trial))), is_misled, "{nees}");
        }
    }
}
