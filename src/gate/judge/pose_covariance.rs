//! Are the stated pose covariances the true ones?
//!
//! As for the camera, a stated variance is the bound's times an estimate of the noise, `chi-squared / d`, for
//! every pose and along every direction; and errors in units of the stated covariance follow an F
//! distribution.

use super::chance;
use super::checks::{Basis, Check, Property};
use crate::principal::OF_POSE;
use crate::suite::Scenario;
use crate::trial::{PoseSpread, Trial};
use calibench::io::significant;

/// One check over the samples: first that every matrix can be a covariance, then how large it is.
pub(super) fn check(scenario: &Scenario, samples: &[&Trial]) -> Check {
    let new = |basis, problems, evidence| {
        Check::new(Property::PoseCovariance, scenario.id, basis, problems, evidence)
    };
    let stated: Vec<&PoseSpread> = samples.iter().filter_map(|t| t.pose_spread.as_deref()).collect();
    if stated.is_empty() {
        return new(Basis::Told, 0, "no pose covariances stated".to_string());
    }
    let faults: Vec<_> = samples.iter().filter_map(|t| t.pose_covariance_fault).collect();
    if let Some(first) = faults.first() {
        let told =
            format!("{} of {} answers have a pose covariance that is {first}", faults.len(), stated.len());
        return new(Basis::Certain(false), stated.len(), told);
    }
    let freedom = scenario.degrees_of_freedom();
    let (single, i) = worst(&stated, freedom, |spread| &spread.over_bound);
    let (along, j) = worst(&stated, freedom, |spread| &spread.principal);
    let mean = |of: fn(&PoseSpread) -> &[f64], i: usize| significant(mean(&stated, of, i), 4);
    let mut evidence = format!(
        "worst {}: stated variance {} of the bound's; along combination {} of 6, best known first, {}",
        OF_POSE[i],
        mean(|spread| &spread.over_bound, i),
        j + 1,
        mean(|spread| &spread.principal, j),
    );
    let mut p = chance::smallest_of(2 * OF_POSE.len(), single.min(along));
    let scores: Vec<f64> = stated
        .iter()
        .filter_map(|spread| Some(chance::normal_score_of_f(spread.own_nees? / 6.0, 6, freedom)))
        .collect();
    if !scores.is_empty() {
        let score = scores.iter().sum::<f64>() / scores.len() as f64;
        p = chance::smallest_of(2, p.min(chance::normal(score * (scores.len() as f64).sqrt())));
        evidence.push_str(&format!("; errors in its units: mean score {}", significant(score, 3)));
    }
    new(Basis::Chance(p), stated.len(), evidence)
}

fn mean(stated: &[&PoseSpread], of: impl Fn(&PoseSpread) -> &[f64], i: usize) -> f64 {
    stated.iter().map(|spread| of(spread)[i]).sum::<f64>() / stated.len() as f64
}

/// The least probable of six ratios of variances: its p-value and place; of those beyond doubt the farthest
/// off.
fn worst(stated: &[&PoseSpread], freedom: usize, of: fn(&PoseSpread) -> &[f64]) -> (f64, usize) {
    let all = freedom * stated.len();
    let judged = |i: usize| {
        let ratio = mean(stated, of, i);
        (chance::both_sides(ratio * all as f64, all), libm::log(ratio).abs(), i)
    };
    let least = (0..OF_POSE.len()).map(judged).min_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)));
    least.map_or((1.0, 0), |(p, _, i)| (p, i))
}

#[cfg(test)]
mod tests {
    use super::super::tests::any_estimate;
    use super::*;

    #[test]
    fn pose_covariances_are_judged_by_their_worst_variance_and_the_errors_in_their_units() {
        let (plan, any) = any_estimate();
        let scenario = &plan.scenarios[0];
        let judged = |over_bound: [f64; 6], principal: [f64; 6], own_nees: Option<f64>| {
            let spread =
                PoseSpread { over_bound: over_bound.to_vec(), principal: principal.to_vec(), own_nees };
            let trial =
                Trial { pose_spread: Some(Box::new(spread)), pose_covariance_fault: None, ..any.clone() };
            let check = check(scenario, &[&trial, &trial]);
            let Basis::Chance(p) = check.basis else { panic!("{check:?}") };
            (p, check.evidence)
        };
        let near =
            |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        // Twice 474 degrees of freedom; twelve variances are looked at, the worst of them tz.
        let (p, evidence) = judged([1.0, 1.1, 1.0, 1.0, 1.0, 1.3], [1.0; 6], None);
        near(p, 12.0 * chance::both_sides(1.3 * 948.0, 948));
        assert!(evidence.starts_with("worst tz: stated variance 1.300 of the bound's"), "{evidence}");
        let (p, evidence) = judged([1.0; 6], [1.0, 0.7, 1.0, 1.0, 1.0, 1.0], None);
        near(p, 12.0 * chance::both_sides(0.7 * 948.0, 948));
        assert!(evidence.contains("along combination 2 of 6, best known first, 0.7000"), "{evidence}");
        // Of two samples the mean score counts with the root of two.
        let score = chance::normal_score_of_f(6.0, 6, 474);
        let (p, _) = judged([1.0; 6], [1.0; 6], Some(36.0));
        near(p, 2.0 * chance::normal(score * 2.0f64.sqrt()));
    }

    #[test]
    fn of_variances_beyond_doubt_the_farthest_off_is_the_worst() {
        let spread = |over_bound: [f64; 6]| PoseSpread {
            over_bound: over_bound.to_vec(),
            principal: vec![1.0; 6],
            own_nees: None,
        };
        let wrong = spread([1.0, 1e3, 1.0, 1e6, 1e-4, 1.0]);
        let (p, i) = worst(&[&wrong; 40], 474, |spread| &spread.over_bound);
        assert_eq!((p, i), (0.0, 3));
    }
}
