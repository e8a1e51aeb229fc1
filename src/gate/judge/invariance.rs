//! Does the answer follow where it must? Differences between a problem and its variants.

use super::checks::{Basis, Check, Property};
use super::{Answers, equivalent_noise_px};
use crate::plan::Purpose;
use crate::suite::Scenario;
use crate::trial::Seen;
use crate::variant::Variant;
use calibench::io::significant;

/// A difference that noise of this size would cause is a hundredth of ordinary corner noise: it cannot matter to a user, and
/// is far above what single precision (1e-5 px) or a loose stopping rule leaves.
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
    let (mut pairs, mut one_sided) = (0, 0);
    for (trial, changed) in answers.for_purpose(Purpose::Variant(variant)) {
        let Some((_, original)) = originals.iter().find(|(t, _)| *t == trial) else { continue };
        pairs += 1;
        match (original, changed) {
            (Seen::Estimate(a), Seen::Estimate(b)) => {
                let moved: Vec<f64> = a.errors.iter().zip(&b.errors).map(|(a, b)| b - a).collect();
                let square = scenario.bound.normalised_error_squared(&moved).unwrap_or(f64::INFINITY);
                let px = equivalent_noise_px(scenario, square, moved.len());
                worst_px = Some(worst_px.map_or(px, |worst| worst.max(px)));
            }
            (Seen::Refused { .. }, Seen::Refused { .. }) | (Seen::Broken(_), _) | (_, Seen::Broken(_)) => {}
            _ => one_sided += 1,
        }
    }
    let held = one_sided == 0 && worst_px.is_none_or(|px| px <= SAME_PX);
    let mut evidence = match worst_px {
        Some(px) => format!("moves as by noise of {} px at most; limit {SAME_PX} px", significant(px, 2)),
        None => "no pair of estimates".to_string(),
    };
    if one_sided > 0 {
        evidence.push_str(&format!("; {one_sided} of {pairs} answered only one way round"));
    }
    (pairs > 0).then(|| Check::new(property(variant), scenario.id, Basis::Certain(held), 2 * pairs, evidence))
}
