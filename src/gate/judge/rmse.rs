//! Which RMSE does the solver state, and is it as large as it should be?

use super::checks::{Basis, Check, Property};
use super::{Answers, chance};
use crate::suite::Scenario;
use crate::trial::Trial;
use calibench::io::significant;

/// Two definitions differ by more than this part on every scene of the suite; rounding and stopping rules by
/// far less.
const SAME_RATIO: f64 = 2e-3;

/// The ways in which programs divide a sum of squared residuals over `N` points with `d` degrees of freedom.
fn definitions(points: f64, freedom: f64) -> [(&'static str, f64); 5] {
    [
        ("per point: sqrt(sum / N)", 1.0),
        ("per coordinate: sqrt(sum / 2N)", std::f64::consts::FRAC_1_SQRT_2),
        ("by degrees of freedom: sqrt(sum / (2N - p))", (points / freedom).sqrt()),
        ("per point by degrees of freedom: sqrt(sum / (N - p / 2))", (2.0 * points / freedom).sqrt()),
        ("root of the sum", points.sqrt()),
    ]
}

pub(super) fn check(scenario: &Scenario, answers: &Answers<'_>) -> Vec<Check> {
    let samples = answers.samples();
    let stated: Vec<(&Trial, f64)> = samples.iter().filter_map(|t| Some((*t, t.rmse_px?))).collect();
    if stated.is_empty() {
        let silent = |property| Check::new(property, scenario.id, Basis::Told, 0, "no RMSE stated");
        return vec![silent(Property::RmseDefinition), silent(Property::Rmse)];
    }
    let points = scenario.setup.observations() as f64;
    let freedom = scenario.degrees_of_freedom();
    let known = |ratios: &[f64]| {
        definitions(points, freedom as f64).into_iter().find(|(_, factor)| {
            !ratios.is_empty() && ratios.iter().all(|r| (r / factor - 1.0).abs() <= SAME_RATIO)
        })
    };
    let ratios_to = |square: fn(&Trial) -> Option<f64>| -> Vec<f64> {
        let first = stated.iter().filter(|(trial, _)| trial.refitted_square.is_some());
        first.filter_map(|(trial, rmse)| Some(rmse / (square(trial)? / points).sqrt())).collect()
    };
    let (refitted, own) = (ratios_to(|t| t.refitted_square), ratios_to(|t| t.square));
    let mean = |ratios: &[f64]| significant(ratios.iter().sum::<f64>() / ratios.len() as f64, 4);
    // Poses that are not the best ones leave larger residuals, whose RMSE may be stated by the right
    // definition all the same.
    let (found, evidence) = match (known(&refitted), known(&own)) {
        (Some((name, factor)), _) => (Some(factor), format!("stated {name}")),
        (None, Some((name, factor))) => (
            Some(factor),
            format!(
                "stated {name}, of the stated poses; the best poses leave {} of it",
                mean(&own_to_best(&stated))
            ),
        ),
        (None, None) if refitted.is_empty() => (None, "no residuals to compare with".to_string()),
        (None, None) => {
            let told = format!("stated is {} times sqrt(sum / N): no definition known", mean(&refitted));
            (None, told)
        }
    };
    let basis = if refitted.is_empty() { Basis::Told } else { Basis::Certain(found == Some(1.0)) };
    let definition = Check::new(Property::RmseDefinition, scenario.id, basis, refitted.len(), evidence);
    vec![definition, distribution(scenario, &stated, found.unwrap_or(1.0), points, freedom)]
}

/// RMSE that the best poses leave over that of the stated ones.
fn own_to_best(stated: &[(&Trial, f64)]) -> Vec<f64> {
    stated.iter().filter_map(|(trial, _)| Some((trial.refitted_square? / trial.square?).sqrt())).collect()
}

/// `sum N rmse^2 / sigma^2` is chi-squared, whatever the definition once it is known.
fn distribution(
    scenario: &Scenario,
    stated: &[(&Trial, f64)],
    factor: f64,
    points: f64,
    freedom: usize,
) -> Check {
    let scale = points / (factor * factor * scenario.sigma_px * scenario.sigma_px);
    let sum: f64 = stated.iter().map(|(_, rmse)| rmse * rmse * scale).sum();
    let all = freedom * stated.len();
    let expected = (all as f64 / (stated.len() as f64 * points)).sqrt() * scenario.sigma_px;
    let seen = (sum / (stated.len() as f64 * points)).sqrt() * scenario.sigma_px;
    let evidence = format!(
        "root mean square {} px per point, expected {} px",
        significant(seen, 5),
        significant(expected, 5)
    );
    let basis = Basis::Chance(chance::both_sides(sum, all));
    Check::new(Property::Rmse, scenario.id, basis, stated.len(), evidence)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{answered, change_trials, on_scene};
    use super::*;
    use crate::plan::Purpose;

    #[test]
    fn an_rmse_of_another_definition_is_told_by_its_name() {
        // Four views of 63 marks: 252 points, 474 degrees of freedom.
        for (factor, name, is_right) in [
            (1.0, "per point: sqrt(sum / N)", true),
            (0.5f64.sqrt(), "per coordinate: sqrt(sum / 2N)", false),
            ((252.0f64 / 474.0).sqrt(), "by degrees of freedom: sqrt(sum / (2N - p))", false),
            ((252.0f64 / 237.0).sqrt(), "per point by degrees of freedom: sqrt(sum / (N - p / 2))", false),
            (252.0f64.sqrt(), "root of the sum", false),
        ] {
            let (plan, mut seen) = answered(2);
            change_trials(&plan, &mut seen, Purpose::Sample, |trial| {
                trial.rmse_px = trial.rmse_px.map(|px| px * factor);
            });
            let checks = on_scene(&plan, &seen, check);
            assert_eq!(checks[0].evidence, format!("stated {name}"));
            assert_eq!(checks[0].basis, Basis::Certain(is_right));
            // Once the definition is known the size is judged by it.
            let Basis::Chance(p) = checks[1].basis else { panic!("{:?}", checks[1]) };
            assert!(p > 1e-3, "{p}");
        }
    }

    #[test]
    fn an_rmse_of_no_known_definition_is_told_by_its_ratio() {
        let (plan, mut seen) = answered(2);
        change_trials(&plan, &mut seen, Purpose::Sample, |trial| {
            trial.rmse_px = trial.rmse_px.map(|px| 1.1 * px)
        });
        let checks = on_scene(&plan, &seen, check);
        assert_eq!(checks[0].evidence, "stated is 1.100 times sqrt(sum / N): no definition known");
        assert_eq!(checks[0].basis, Basis::Certain(false));
    }

    #[test]
    fn the_size_of_an_rmse_is_judged_by_its_square_over_all_points() {
        let (plan, mut seen) = answered(2);
        change_trials(&plan, &mut seen, Purpose::Sample, |trial| trial.rmse_px = Some(0.015));
        let judged = |factor: f64| {
            on_scene(&plan, &seen, |scenario, answers| {
                let samples = answers.samples();
                let stated: Vec<(&Trial, f64)> = samples.iter().map(|t| (*t, t.rmse_px.unwrap())).collect();
                assert_eq!(scenario.sigma_px, 0.01);
                distribution(scenario, &stated, factor, 252.0, 474)
            })
        };
        // 2 * 252 * 1.5^2 = 1134 on 948 degrees of freedom; expected sqrt(474 / 252) hundredths of a pixel.
        let check = judged(1.0);
        assert_eq!(check.evidence, "root mean square 0.015000 px per point, expected 0.013715 px");
        let Basis::Chance(p) = check.basis else { panic!("{check:?}") };
        assert!((p / chance::both_sides(1134.0, 948) - 1.0).abs() < 1e-9, "{p}");
        // Stated by half of it, it is twice as large.
        assert!(judged(0.5).evidence.starts_with("root mean square 0.030000 px"));
    }

    #[test]
    fn an_rmse_of_poses_that_are_not_the_best_is_of_the_right_definition() {
        let (plan, mut seen) = answered(2);
        change_trials(&plan, &mut seen, Purpose::Sample, |trial| {
            trial.square = trial.square.map(|square| 4.0 * square);
            trial.rmse_px = trial.rmse_px.map(|px| 2.0 * px);
        });
        let checks = on_scene(&plan, &seen, check);
        assert_eq!(checks[0].basis, Basis::Certain(true));
        assert!(
            checks[0].evidence.ends_with("; the best poses leave 0.5000 of it"),
            "{}",
            checks[0].evidence
        );
    }

    #[test]
    fn an_rmse_without_residuals_beside_it_has_no_definition() {
        let (plan, mut seen) = answered(2);
        change_trials(&plan, &mut seen, Purpose::Sample, |trial| {
            (trial.square, trial.refitted_square) = (None, None);
        });
        let checks = on_scene(&plan, &seen, check);
        assert_eq!((checks[0].basis, checks[0].problems), (Basis::Told, 0));
        assert_eq!(checks[0].evidence, "no residuals to compare with");
    }
}
