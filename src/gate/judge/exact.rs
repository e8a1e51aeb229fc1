//! What needs no statistics? The protocol, held values, exact data, and the same bits twice.

use super::checks::{Basis, Check, Property};
use super::{Answers, Terms, equivalent_noise_px, estimate};
use crate::plan::Purpose;
use crate::suite::Scenario;
use crate::trial::Seen;
use calibench::io::significant;

/// An error of exact data that noise of this size on every coordinate would cause: double precision leaves
/// below 1e-10 px, single precision about 1e-5 px.
const EXACT_PX: f64 = 1e-6;

/// Whether every problem had a well-formed answer.
pub(super) fn protocol(scenario: &Scenario, answers: &Answers<'_>) -> Vec<Check> {
    let broken: Vec<_> = answers
        .cases
        .iter()
        .filter_map(|(_, seen)| match seen {
            Seen::Broken(breakage) => Some(breakage),
            _ => None,
        })
        .collect();
    let count = answers.cases.len();
    let evidence = match broken.first() {
        None => format!("{count} well-formed answers"),
        Some(first) => format!("{} of {count} broken, first: {first}", broken.len()),
    };
    let protocol =
        Check::new(Property::Protocol, scenario.id, Basis::Certain(broken.is_empty()), count, evidence);
    let estimates = answers.cases.iter().filter(|(_, seen)| estimate(seen).is_some()).count();
    let changed = answers.cases.iter().filter_map(|(_, seen)| estimate(seen)?.held_changed).next();
    let evidence = match changed {
        None if estimates == 0 => "nothing answered".to_string(),
        None => "kept".to_string(),
        Some((parameter, wanted, got)) => format!("{parameter} held at {wanted}, answered {got}"),
    };
    let held =
        Check::new(Property::HeldValues, scenario.id, Basis::Certain(changed.is_none()), estimates, evidence);
    vec![protocol, held.gravely()]
}

pub(super) fn check(scenario: &Scenario, answers: &Answers<'_>, terms: &Terms) -> Vec<Check> {
    let mut checks = Vec::new();
    checks.extend(answers.for_purpose(Purpose::Exact).next().map(|(_, seen)| exactness(scenario, seen)));
    checks.extend(determinism(scenario, answers));
    checks.extend(time(scenario, answers, terms.median_seconds));
    checks
}

fn exactness(scenario: &Scenario, seen: &Seen) -> Check {
    let Some(trial) = estimate(seen) else {
        let evidence = "no estimate from exact data";
        return Check::new(Property::Exactness, scenario.id, Basis::Certain(false), 1, evidence);
    };
    let camera_px = equivalent_noise_px(scenario, trial.nees, trial.errors.len());
    let worst_pose = trial.pose_nees.iter().flatten().fold(0.0f64, |worst, nees| worst.max(*nees));
    let pose_px = equivalent_noise_px(scenario, worst_pose, 6);
    // Written so that NaN fails.
    let held = camera_px <= EXACT_PX && pose_px <= EXACT_PX;
    let poses = match trial.pose_nees {
        Some(_) => format!("worst pose {} px", significant(pose_px, 2)),
        None => "poses not stated".to_string(),
    };
    let evidence =
        format!("error as of noise of {} px, {poses}; limit {EXACT_PX} px", significant(camera_px, 2));
    // The larger of the two, and NaN if one is.
    let size_px = if camera_px >= pose_px { camera_px } else { pose_px + 0.0 * camera_px };
    Check::new(Property::Exactness, scenario.id, Basis::Certain(held), 1, evidence).of_size(size_px)
}

fn determinism(scenario: &Scenario, answers: &Answers<'_>) -> Option<Check> {
    let first: Vec<_> = answers.for_purpose(Purpose::Sample).collect();
    let pairs: Vec<(&Seen, &Seen)> = answers
        .for_purpose(Purpose::Repeat)
        .filter_map(|(trial, again)| Some((first.iter().find(|(t, _)| *t == trial)?.1, again)))
        .filter(|(a, b)| estimate(a).is_some() || estimate(b).is_some())
        .collect();
    let differs = |(a, b): &&(&Seen, &Seen)| match (a, b) {
        (Seen::Estimate(a), Seen::Estimate(b)) => a.bits != b.bits,
        // A broken answer is the protocol's business.
        (Seen::Broken(_), _) | (_, Seen::Broken(_)) => false,
        _ => true,
    };
    let different = pairs.iter().filter(differs).count();
    let evidence = format!("{different} of {} repeated problems differ in their bits", pairs.len());
    let basis = Basis::Certain(different == 0);
    (!pairs.is_empty()).then(|| Check::new(Property::Determinism, scenario.id, basis, pairs.len(), evidence))
}

fn time(scenario: &Scenario, answers: &Answers<'_>, limit_s: Option<f64>) -> Option<Check> {
    let mut milliseconds: Vec<f64> = answers
        .for_purpose(Purpose::Sample)
        .filter_map(|(_, seen)| match seen {
            Seen::Estimate(trial) => Some(1e3 * trial.seconds),
            Seen::Refused { seconds, .. } => Some(1e3 * seconds),
            Seen::Unsupported(_) | Seen::Broken(_) => None,
        })
        .collect();
    if !milliseconds.is_empty() && milliseconds.iter().all(|ms| ms.is_nan()) {
        let evidence = "not known of answers in files";
        return Some(Check::new(Property::Time, scenario.id, Basis::Told, 0, evidence));
    }
    milliseconds.sort_by(f64::total_cmp);
    let last = milliseconds.len().checked_sub(1)?;
    let at = |share: f64| milliseconds[(share * last as f64) as usize];
    let limit = limit_s.map_or(String::new(), |s| format!("; limit {} ms", significant(1e3 * s, 3)));
    let evidence = format!(
        "median {} ms, 95 % within {} ms, longest {} ms{limit}",
        significant(at(0.5), 3),
        significant(at(0.95), 3),
        significant(milliseconds[last], 3)
    );
    let basis = limit_s.map_or(Basis::Told, |s| Basis::Certain(at(0.5) <= 1e3 * s));
    Some(Check::new(Property::Time, scenario.id, basis, milliseconds.len(), evidence))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{answered, change, on_scene};
    use super::*;

    #[test]
    fn a_problem_that_is_refused_when_it_is_asked_again_is_no_repetition() {
        let (plan, mut seen) = answered(1);
        let judged = |seen: &[Option<Seen>]| {
            let check = on_scene(&plan, seen, determinism)?;
            Some((check.basis, check.problems))
        };
        assert_eq!(judged(&seen), Some((Basis::Certain(true), 1)));
        let refuse = |seen: &mut Seen| *seen = Seen::Refused { reason: "no".into(), seconds: 0.0 };
        change(&plan, &mut seen, Purpose::Repeat, refuse);
        assert_eq!(judged(&seen), Some((Basis::Certain(false), 1)));
        // Refused both times it says nothing.
        change(&plan, &mut seen, Purpose::Sample, refuse);
        assert_eq!(judged(&seen), None);
    }

    #[test]
    fn the_median_time_is_held_against_the_limit_in_seconds() {
        let (plan, mut seen) = answered(3);
        let next = std::cell::Cell::new(0.0);
        change(&plan, &mut seen, Purpose::Sample, |seen| {
            next.set(next.get() + 0.01);
            match seen {
                Seen::Estimate(trial) => trial.seconds = next.get(),
                other => panic!("{other:?}"),
            }
        });
        let judged =
            |limit| on_scene(&plan, &seen, |scenario, answers| time(scenario, answers, limit)).unwrap();
        assert_eq!(judged(None).evidence, "median 20.0 ms, 95 % within 20.0 ms, longest 30.0 ms");
        assert_eq!(judged(None).basis, Basis::Told);
        assert!(judged(Some(0.02)).evidence.ends_with("; limit 20.0 ms"));
        assert_eq!(
            (judged(Some(0.021)).basis, judged(Some(0.019)).basis),
            (Basis::Certain(true), Basis::Certain(false))
        );
        // A refusal takes its time too.
        change(&plan, &mut seen, Purpose::Sample, |seen| {
            *seen = Seen::Refused { reason: "no".into(), seconds: 0.25 };
        });
        let check = on_scene(&plan, &seen, |scenario, answers| time(scenario, answers, None)).unwrap();
        assert!(check.evidence.starts_with("median 250 ms"), "{}", check.evidence);
    }

    #[test]
    fn exact_data_leave_an_error_as_of_a_millionth_of_a_pixel_at_most() {
        let (plan, mut seen) = answered(1);
        let sigma_px = plan.scenarios[0].sigma_px;
        // An error of x px in camera or first pose: nees of k (x / sigma)^2.
        let mut judged = |camera_px: f64, pose_px: f64| {
            let nees = |px: f64, count: f64| count * (px / sigma_px) * (px / sigma_px);
            change(&plan, &mut seen, Purpose::Exact, |seen| {
                let Seen::Estimate(trial) = seen else { panic!("it is answered") };
                trial.nees = nees(camera_px, trial.errors.len() as f64);
                trial.pose_nees = Some(vec![0.0, nees(pose_px, 6.0)]);
            });
            let exact = |scenario: &Scenario, answers: &Answers<'_>| {
                exactness(scenario, answers.for_purpose(Purpose::Exact).next().unwrap().1)
            };
            let check = on_scene(&plan, &seen, exact);
            (check.basis, check.size_px)
        };
        for (camera_px, pose_px, is_held) in
            [(0.9e-6, 0.5e-6, true), (0.5e-6, 0.9e-6, true), (1.1e-6, 0.0, false), (0.0, 1.1e-6, false)]
        {
            let (basis, size) = judged(camera_px, pose_px);
            assert_eq!(basis, Basis::Certain(is_held), "{camera_px} {pose_px}");
            assert!((size.unwrap() / camera_px.max(pose_px) - 1.0).abs() < 1e-9);
        }
        let (basis, size) = judged(f64::NAN, 0.0);
        assert_eq!((basis, size), (Basis::Certain(false), None));
    }
}
