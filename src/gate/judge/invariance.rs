//! Does the answer follow where it must? Differences between a problem and its variants.

use super::checks::{Basis, Check, Property};
use super::statistics::UNANSWERED;
use super::{Answers, chance, equivalent_noise_px};
use crate::plan::Purpose;
use crate::suite::Scenario;
use crate::trial::Seen;
use crate::variant::Variant;
use calibench::io::significant;

/// A difference that noise of this size would cause is a hundredth of ordinary corner noise: it cannot matter
/// to a user, and is far above what single precision (1e-5 px) or a loose stopping rule leaves.
const SAME_PX: f64 = 1e-3;

pub(super) fn check(scenario: &Scenario, answers: &Answers<'_>) -> Vec<Check> {
    Variant::ALL.into_iter().filter_map(|variant| compare(scenario, answers, variant)).collect()
}

fn property(variant: Variant) -> Property {
    match variant {
        Variant::ViewOrder => Property::ViewOrder,
        Variant::PointOrder => Property::PointOrder,
        Variant::TargetUnits => Property::TargetUnits,
        Variant::ImageShift => Property::ImageShift,
        Variant::SwappedAxes => Property::SwappedAxes,
    }
}

fn compare(scenario: &Scenario, answers: &Answers<'_>, variant: Variant) -> Option<Check> {
    let originals: Vec<_> = answers.for_purpose(Purpose::Sample).collect();
    let mut worst_px: Option<f64> = None;
    let (mut pairs, mut one_sided, mut compared) = (0, 0, 0);
    for (trial, changed) in answers.for_purpose(Purpose::Variant(variant)) {
        let Some((_, original)) = originals.iter().find(|(t, _)| *t == trial) else { continue };
        pairs += 1;
        match (original, changed) {
            (Seen::Estimate(a), Seen::Estimate(b)) => {
                compared += 1;
                let square = a.whitened.iter().zip(&b.whitened).map(|(a, b)| (b - a) * (b - a)).sum();
                let px = equivalent_noise_px(scenario, square, a.whitened.len());
                worst_px = Some(worst_px.map_or(px, |worst| worst.max(px)));
            }
            (Seen::Refused { .. }, Seen::Refused { .. })
            | (Seen::Unsupported(_), Seen::Unsupported(_))
            | (Seen::Broken(_), _)
            | (_, Seen::Broken(_)) => {}
            _ => one_sided += 1,
        }
    }
    // A problem left unanswered now and then is a matter of convergence; one left unanswered for what was
    // changed happens every time.
    let basis = if worst_px.is_some_and(|px| px > SAME_PX) {
        Basis::Certain(false)
    } else {
        Basis::Chance(chance::at_least(one_sided, pairs, 2.0 * UNANSWERED))
    };
    let mut evidence = match worst_px {
        Some(px) => format!("moves as by noise of {} px at most; limit {SAME_PX} px", significant(px, 2)),
        None => "no pair of estimates".to_string(),
    };
    if one_sided > 0 {
        evidence.push_str(&format!("; {one_sided} of {pairs} answered only one way round"));
    }
    let problems = 2 * (compared + one_sided);
    let check = Check::new(property(variant), scenario.id, basis, problems, evidence);
    let check = worst_px.into_iter().fold(check, Check::of_size);
    (pairs > 0).then_some(check)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{answered, change_trials, on_scene};
    use super::*;

    #[test]
    fn an_answer_that_moves_by_three_tenths_of_a_deviation_moves_as_by_three_tenths_of_the_noise() {
        let (plan, mut seen) = answered(1);
        let shift = Purpose::Variant(Variant::ImageShift);
        let judged = |seen: &[Option<Seen>]| {
            on_scene(&plan, seen, |scenario, answers| compare(scenario, answers, Variant::ImageShift))
                .unwrap()
        };
        let follows = judged(&seen);
        assert!(matches!(follows.basis, Basis::Chance(_)) && follows.size_px.unwrap() < 1e-6);
        // One way and the other, as the sample's own errors are of both signs.
        for step in [0.3, -0.3] {
            change_trials(&plan, &mut seen, Purpose::Sample, |trial| {
                trial.whitened = vec![1.0, -2.0, 0.5, 0.0, -0.5, 3.0];
            });
            change_trials(&plan, &mut seen, shift, |trial| {
                trial.whitened = [1.0, -2.0, 0.5, 0.0, -0.5, 3.0].map(|z| z + step).to_vec();
            });
            let moves = judged(&seen);
            let expected_px = 0.3 * plan.scenarios[0].sigma_px;
            assert!((moves.size_px.unwrap() - expected_px).abs() < 1e-12);
            assert_eq!((moves.basis, moves.problems), (Basis::Certain(false), 2));
        }
    }

    #[test]
    fn an_answer_one_way_round_is_judged_against_two_in_a_thousand() {
        let (plan, mut seen) = answered(2);
        let shift = Purpose::Variant(Variant::ImageShift);
        let left = std::cell::Cell::new(1);
        super::super::tests::change(&plan, &mut seen, shift, |seen| {
            if left.replace(0) == 1 {
                *seen = Seen::Refused { reason: "no".into(), seconds: 0.0 };
            }
        });
        let check =
            on_scene(&plan, &seen, |scenario, answers| compare(scenario, answers, Variant::ImageShift))
                .unwrap();
        // One at least of two: 1 - 0.998^2.
        let Basis::Chance(p) = check.basis else { panic!("{check:?}") };
        assert!((p - (1.0 - 0.998 * 0.998)).abs() < 1e-12, "{p}");
        assert!(check.evidence.ends_with("; 1 of 2 answered only one way round"), "{}", check.evidence);
        assert_eq!(check.problems, 4);
    }

    #[test]
    fn a_variant_of_which_nothing_was_asked_has_no_check() {
        let (plan, seen) = answered(0);
        let checks = on_scene(&plan, &seen, check);
        assert!(checks.is_empty(), "{checks:?}");
    }
}
