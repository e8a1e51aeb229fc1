//! Do many errors together look as theory says? Bias, variance, joint size, poses and stated covariance
//! against the bound.
//!
//! To first order the error of a maximum-likelihood estimate is normal with the Cramer-Rao bound `P` as its
//! covariance, so every statistic below has a known distribution for any number of samples.

use super::checks::{Basis, Check, Property};
use super::habits::Habits;
use super::{Answers, chance, pose_covariance};
use crate::plan::Purpose;
use crate::suite::Scenario;
use crate::trial::{Seen, Trial};
use calibench::camera::Parameter;
use calibench::io::significant;

/// Share of good problems that a solver may leave unanswered.
pub(super) const UNANSWERED: f64 = 1e-3;

pub(super) fn check(scenario: &Scenario, answers: &Answers<'_>) -> Vec<Check> {
    let samples = answers.samples();
    let mut checks = vec![convergence(scenario, answers)];
    if samples.is_empty() {
        return checks;
    }
    let about = About { scenario, samples: &samples, habits: answers.habits };
    checks.push(about.no_silent_failure());
    checks.push(about.bias());
    checks.extend(about.variance());
    checks.push(about.nees());
    checks.push(about.poses());
    checks.push(about.covariance_form());
    checks.push(about.covariance());
    checks.push(pose_covariance::check(scenario, &samples));
    checks
}

fn convergence(scenario: &Scenario, answers: &Answers<'_>) -> Check {
    let mut first = None;
    let (mut asked, mut refused) = (0, 0);
    // Where the protocol is broken nothing is known of the data.
    let heard = answers.for_purpose(Purpose::Sample).filter(|(_, seen)| !matches!(seen, Seen::Broken(_)));
    for (_, seen) in heard {
        asked += 1;
        if let Seen::Refused { reason, .. } | Seen::Unsupported(reason) = seen {
            refused += 1;
            first.get_or_insert(reason);
        }
    }
    let p = chance::at_least(refused, asked, UNANSWERED);
    let evidence = match first {
        None if asked == 0 => "nothing answered".to_string(),
        None => format!("no good problem of {asked} left unanswered"),
        Some(reason) => format!("{refused} of {asked} good problems left unanswered, first: {reason}"),
    };
    Check::new(Property::Convergence, scenario.id, Basis::Chance(p), asked, evidence)
}

/// The samples of a scenario that have an estimate; at least one.
struct About<'a> {
    scenario: &'a Scenario,
    samples: &'a [&'a Trial],
    habits: Habits,
}

/// How far a ratio is from 1, whichever side.
fn distance(ratio: f64) -> f64 {
    if ratio > 0.0 { libm::log(ratio).abs() } else { f64::INFINITY }
}

/// The worst of several p-values, with what it belongs to.
struct Worst {
    p: f64,
    parameter: Parameter,
    value: f64,
}

impl About<'_> {
    fn check(&self, property: Property, p: f64, evidence: String) -> Check {
        Check::new(property, self.scenario.id, Basis::Chance(p), self.samples.len(), evidence)
    }

    fn n(&self) -> f64 {
        self.samples.len() as f64
    }

    fn dimensions(&self) -> usize {
        self.scenario.free.len()
    }

    /// Errors of one parameter in standard deviations of the bound, each of its own sample's.
    fn standardised(&self, i: usize) -> impl Iterator<Item = f64> {
        self.samples.iter().map(move |trial| trial.standardised[i])
    }

    /// The parameter with the smallest p-value of `judge`, which gives the value to tell and its p-value.
    fn worst(&self, judge: impl Fn(usize) -> (f64, f64)) -> Option<Worst> {
        let each = self.scenario.free.iter().enumerate().map(|(i, parameter)| {
            let (value, p) = judge(i);
            Worst { p, parameter, value }
        });
        // Where several are beyond doubt, that which is farthest off.
        each.min_by(|a, b| a.p.total_cmp(&b.p).then(b.value.abs().total_cmp(&a.value.abs())))
    }

    /// An error may be far beyond the bound, or far beyond what this one answer states: a covariance that is
    /// a million times too small in one answer of fifty shows in no mean.
    fn no_silent_failure(&self) -> Check {
        let silent = || self.samples.iter().filter(|trial| trial.warnings == 0 || !self.habits.warns_rarely);
        let largest = |values: &mut dyn Iterator<Item = f64>| {
            values.fold(0.0f64, |worst, x| if x <= worst { worst } else { x })
        };
        let worst = largest(&mut silent().map(|trial| trial.nees));
        let own = largest(&mut silent().filter_map(|trial| trial.own_nees));
        let by_own = chance::above_f(
            own / self.dimensions() as f64,
            self.dimensions(),
            self.scenario.degrees_of_freedom(),
        );
        let p = chance::above(worst, self.dimensions()).min(by_own);
        let p = chance::smallest_of(2 * self.samples.len(), p);
        let stated =
            if own > 0.0 { format!(", {} as stated", significant(own.sqrt(), 3)) } else { String::new() };
        let evidence = format!(
            "worst error {} standard deviations{stated} (root of its squared Mahalanobis distance)",
            significant(worst.sqrt(), 3)
        );
        self.check(Property::NoSilentFailure, p, evidence).gravely()
    }

    /// Each parameter's mean is normal, and all means together are chi-squared: a small error of one
    /// parameter that others should have followed shows in the second only.
    fn bias(&self) -> Check {
        let mean = |i: usize| self.samples.iter().map(|t| t.whitened[i]).sum::<f64>() / self.n();
        let square = self.n() * (0..self.dimensions()).map(|i| mean(i) * mean(i)).sum::<f64>();
        let joint = chance::above(square, self.dimensions());
        let worst = self.worst(|i| {
            let bias = self.standardised(i).sum::<f64>() / self.n();
            (bias, chance::normal(bias * self.n().sqrt()))
        });
        let Some(worst) = worst else { return self.check(Property::Bias, joint, "nothing is free".into()) };
        let p = chance::smallest_of(2, joint.min(chance::smallest_of(self.dimensions(), worst.p)));
        let evidence = format!(
            "largest bias {} of {} standard deviations; all together chi-squared {} on {}",
            worst.parameter,
            significant(worst.value, 3),
            significant(square, 3),
            self.dimensions()
        );
        self.check(Property::Bias, p, evidence)
    }

    fn variance(&self) -> Option<Check> {
        let freedom = self.samples.len().checked_sub(1).filter(|&f| f > 0)?;
        let worst = self.worst(|i| {
            let mean = self.standardised(i).sum::<f64>() / self.n();
            let sum: f64 = self.standardised(i).map(|z| (z - mean) * (z - mean)).sum();
            (sum / freedom as f64, chance::both_sides(sum, freedom))
        })?;
        let evidence =
            format!("worst {}: variance {} of the bound's", worst.parameter, significant(worst.value, 4));
        Some(self.check(Property::Variance, chance::smallest_of(self.dimensions(), worst.p), evidence))
    }

    fn nees(&self) -> Check {
        let sum: f64 = self.samples.iter().map(|trial| trial.nees).sum();
        let p = chance::both_sides(sum, self.dimensions() * self.samples.len());
        let evidence = format!("mean {}, expected {}", significant(sum / self.n(), 4), self.dimensions());
        self.check(Property::Nees, p, evidence)
    }

    /// Residuals of all stated poses, and the error of each sample's first pose: other poses of the sample
    /// depend on it.
    fn poses(&self) -> Check {
        let stated: Vec<(f64, f64)> =
            self.samples.iter().filter_map(|t| Some((t.square?, *t.pose_nees.as_ref()?.first()?))).collect();
        if stated.is_empty() {
            return Check::new(Property::Poses, self.scenario.id, Basis::Told, 0, "no poses stated");
        }
        let count = stated.len();
        let variance = self.scenario.sigma_px * self.scenario.sigma_px;
        let residual: f64 = stated.iter().map(|(square, _)| square / variance).sum();
        let freedom = count * self.scenario.degrees_of_freedom();
        let error: f64 = stated.iter().map(|(_, nees)| nees).sum();
        let p = chance::both_sides(residual, freedom).min(chance::both_sides(error, 6 * count));
        let evidence = format!(
            "residuals {} of what noise leaves, first pose's mean squared error {} of the bound's",
            significant((residual / freedom as f64).sqrt(), 4),
            significant(error / (6 * count) as f64, 4)
        );
        self.check(Property::Poses, chance::smallest_of(2, p), evidence)
    }

    /// A stated variance is the bound's times an estimate of the noise, `chi-squared / d`; and errors in
    /// units of the stated covariance follow an F distribution, whose normal scores have a mean of zero.
    fn covariance(&self) -> Check {
        let stated: Vec<&[f64]> =
            self.samples.iter().filter_map(|t| t.deviations_over_bound.as_deref()).collect();
        if stated.is_empty() {
            let evidence = "no standard deviations stated";
            return Check::new(Property::Covariance, self.scenario.id, Basis::Told, 0, evidence);
        }
        let freedom = self.scenario.degrees_of_freedom();
        let all = freedom * stated.len();
        let worst = self.worst(|i| {
            let sum: f64 = stated.iter().map(|s| s[i] * s[i]).sum();
            (sum / stated.len() as f64, chance::both_sides(sum * freedom as f64, all))
        });
        let Some(worst) = worst else {
            return Check::new(Property::Covariance, self.scenario.id, Basis::Told, 0, "nothing is free");
        };
        let along = self.worst_combination();
        let mut p = chance::smallest_of(
            2 * self.dimensions(),
            along.as_ref().map_or(worst.p, |(p, _)| worst.p.min(*p)),
        );
        let mut evidence = format!(
            "worst {}: stated variance {} of the bound's",
            worst.parameter,
            significant(worst.value, 4)
        );
        evidence.push_str(self.known_variance_fault(worst.value, stated.len()).unwrap_or_default());
        evidence.extend(along.into_iter().map(|(_, told)| told));
        let scores: Vec<f64> = self
            .samples
            .iter()
            .filter_map(|t| {
                Some(chance::normal_score_of_f(
                    t.own_nees? / self.dimensions() as f64,
                    self.dimensions(),
                    freedom,
                ))
            })
            .collect();
        if !scores.is_empty() {
            let z = scores.iter().sum::<f64>() / (scores.len() as f64).sqrt();
            p = chance::smallest_of(2, p.min(chance::normal(z)));
            evidence.push_str(&format!(
                "; errors in its units: mean score {}",
                significant(z / (scores.len() as f64).sqrt(), 3)
            ));
        }
        self.check(Property::Covariance, p, evidence)
    }

    /// Whether every stated matrix can be a covariance.
    fn covariance_form(&self) -> Check {
        let given = self.samples.iter().filter(|t| t.principal_variances.is_some()).count();
        if given == 0 {
            let evidence = "no covariance stated";
            return Check::new(Property::CovarianceForm, self.scenario.id, Basis::Told, 0, evidence);
        }
        let faults: Vec<_> = self.samples.iter().filter_map(|t| t.covariance_fault).collect();
        let evidence = match faults.first() {
            None => format!("{given} matrices that can be covariances"),
            Some(first) => {
                format!("{} of {given} stated covariances are none, the first: {first}", faults.len())
            }
        };
        let basis = Basis::Certain(faults.is_empty());
        Check::new(Property::CovarianceForm, self.scenario.id, basis, given, evidence)
    }

    /// The uncorrelated combination of parameters along which the stated covariance is least like the bound:
    /// p-value and words. Its variance there follows the law of a single parameter's.
    fn worst_combination(&self) -> Option<(f64, String)> {
        let stated: Vec<&[f64]> =
            self.samples.iter().filter_map(|t| t.principal_variances.as_deref()).collect();
        let freedom = self.scenario.degrees_of_freedom();
        let ratio = |i: usize| stated.iter().map(|v| v[i]).sum::<f64>() / stated.len() as f64;
        let judged = |i: usize| {
            let p = chance::both_sides(ratio(i) * (freedom * stated.len()) as f64, freedom * stated.len());
            (p, i)
        };
        let (p, i) = (0..self.dimensions())
            .filter(|_| !stated.is_empty())
            .map(judged)
            .min_by(|a, b| a.0.total_cmp(&b.0).then(distance(ratio(b.1)).total_cmp(&distance(ratio(a.1)))))?;
        Some((p, format!("; along {} {}", self.scenario.principal.name(i), significant(ratio(i), 4))))
    }

    /// A factor that programs are known for, where the mean of `count` ratios tells it from chance.
    fn known_variance_fault(&self, ratio: f64, count: usize) -> Option<&'static str> {
        let freedom = self.scenario.degrees_of_freedom() as f64;
        let coordinates = 2.0 * self.scene_points();
        let spread = (2.0 / (freedom * count as f64)).sqrt();
        let near = |factor: f64| (ratio / factor - 1.0).abs() < 4.0 * spread;
        let known = [
            (freedom / coordinates, " (residual variance over 2N instead of 2N - p)"),
            (2.0 * freedom / coordinates, " (residual variance over N instead of 2N - p)"),
            (2.0, " (per-point instead of per-coordinate variance)"),
        ];
        if near(1.0) {
            return None;
        }
        known.into_iter().find(|(factor, _)| near(*factor)).map(|(_, name)| name)
    }

    fn scene_points(&self) -> f64 {
        self.scenario.setup.observations() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{answered, any_estimate, change, on_scene};
    use super::*;

    #[test]
    fn good_problems_left_unanswered_are_counted_against_one_in_a_thousand() {
        let (plan, mut seen) = answered(2);
        let check = on_scene(&plan, &seen, convergence);
        assert_eq!(check.evidence, "no good problem of 2 left unanswered");
        assert_eq!((check.basis, check.problems), (Basis::Chance(1.0), 2));
        change(&plan, &mut seen, Purpose::Sample, |seen| {
            *seen = Seen::Refused { reason: "no".into(), seconds: 0.0 };
        });
        let check = on_scene(&plan, &seen, convergence);
        assert_eq!(check.evidence, "2 of 2 good problems left unanswered, first: no");
        let Basis::Chance(p) = check.basis else { panic!("{check:?}") };
        assert!((p / 1e-6 - 1.0).abs() < 1e-9, "{p}");
    }

    #[test]
    fn a_variance_off_by_a_known_factor_is_named() {
        let (plan, _) = answered(0);
        // Four views of 63 marks: 504 coordinates, 474 degrees of freedom.
        let about = About { scenario: &plan.scenarios[0], samples: &[], habits: Habits::UNKNOWN };
        let named = |ratio: f64| about.known_variance_fault(ratio, 1000).unwrap_or("none");
        assert_eq!(named(1.0), "none");
        assert_eq!(named(1.5), "none");
        assert_eq!(named(474.0 / 504.0), " (residual variance over 2N instead of 2N - p)");
        assert_eq!(named(2.0 * 474.0 / 504.0), " (residual variance over N instead of 2N - p)");
        assert_eq!(named(2.0), " (per-point instead of per-coordinate variance)");
        // Four answers do not tell 6 % from chance.
        assert_eq!(about.known_variance_fault(474.0 / 504.0, 4), None);
    }

    /// A check of three samples of four-pose, six parameters each, changed first.
    fn of_three(how: impl Fn(usize, &mut Trial), judge: impl Fn(&About<'_>) -> Check) -> (f64, Check) {
        let (plan, any) = any_estimate();
        let mut trials = vec![any; 3];
        trials.iter_mut().enumerate().for_each(|(i, trial)| how(i, trial));
        let samples: Vec<&Trial> = trials.iter().collect();
        let check =
            judge(&About { scenario: &plan.scenarios[0], samples: &samples, habits: Habits::UNKNOWN });
        let Basis::Chance(p) = check.basis else { panic!("{check:?}") };
        (p, check)
    }

    fn near(found: f64, expected: f64) {
        assert!((found / expected - 1.0).abs() < 1e-6, "{found} for {expected}");
    }

    #[test]
    fn a_bias_is_judged_by_the_largest_mean_and_by_all_together() {
        // Together: 3 * 3^2 = 27 on six degrees, above which lies exp(-y) (1 + y + y^2 / 2) for y = 13.5.
        let together = |_: usize, trial: &mut Trial| {
            trial.whitened = vec![0.0, 3.0, 0.0, 0.0, 0.0, 0.0];
            trial.standardised = vec![0.0; 6];
        };
        let (p, _) = of_three(together, |about| about.bias());
        near(p, 2.0 * libm::exp(-13.5) * (1.0 + 13.5 + 13.5 * 13.5 / 2.0));
        // Alone: a mean of -2 is 3.46 standard errors of three, of six parameters and two tests.
        let alone = |_: usize, trial: &mut Trial| {
            trial.whitened = vec![0.0; 6];
            trial.standardised = vec![0.0, 0.0, -2.0, 0.0, 0.0, 0.0];
        };
        let (p, check) = of_three(alone, |about| about.bias());
        near(p, 12.0 * chance::normal(2.0 * 3.0f64.sqrt()));
        assert!(
            check.evidence.starts_with("largest bias cx of -2.00 standard deviations"),
            "{}",
            check.evidence
        );
    }

    #[test]
    fn a_variance_is_judged_about_the_mean_on_both_sides() {
        // 5 - a, 5 and 5 + a: 2 a^2 on two degrees of freedom, whose median is 2 ln 2.
        let even = std::f64::consts::LN_2.sqrt();
        let judged = |a: f64| {
            of_three(
                |i, trial| {
                    trial.standardised = vec![5.0 + (i as f64 - 1.0) * even; 6];
                    trial.standardised[1] = 5.0 + (i as f64 - 1.0) * a;
                },
                |about| about.variance().unwrap(),
            )
        };
        let (p, check) = judged(3.0);
        near(p, 12.0 * libm::exp(-9.0));
        assert_eq!(check.evidence, "worst fy: variance 9.000 of the bound's");
        let (p, _) = judged(0.01);
        near(p, 12.0 * (1.0 - libm::exp(-1e-4)));
    }

    #[test]
    fn squared_errors_are_judged_by_their_sum_over_all_samples() {
        let (p, check) = of_three(|i, trial| trial.nees = [2.0, 3.0, 40.0][i], |about| about.nees());
        near(p, chance::both_sides(45.0, 18));
        assert_eq!(check.evidence, "mean 15.00, expected 6");
    }

    #[test]
    fn a_silent_failure_is_the_largest_error_without_a_warning() {
        let worst = |warned: usize| {
            let change = |i: usize, trial: &mut Trial| {
                trial.nees = [1.0, 30.0, 60.0][i];
                (trial.own_nees, trial.warnings) = (None, usize::from(i == warned));
            };
            of_three(change, |about| about.no_silent_failure())
        };
        // Twice three chances; above x on six degrees lies exp(-y) (1 + y + y^2 / 2), y = x / 2.
        let above = |y: f64| libm::exp(-y) * (1.0 + y + y * y / 2.0);
        near(worst(0).0, 6.0 * above(30.0));
        near(worst(2).0, 6.0 * above(15.0));
        assert!(worst(2).1.grave && worst(2).1.evidence.starts_with("worst error 5.48 standard"));
        // Against what an answer states itself: 60 / 6 of F with six and 474.
        let own = |_: usize, trial: &mut Trial| {
            (trial.nees, trial.own_nees, trial.warnings) = (1.0, Some(60.0), 0);
        };
        near(of_three(own, |about| about.no_silent_failure()).0, 6.0 * chance::above_f(10.0, 6, 474));
    }

    #[test]
    fn poses_are_judged_by_residuals_and_by_the_first_of_every_sample() {
        let judged = |square: f64, nees: f64| {
            let change = move |_: usize, trial: &mut Trial| {
                (trial.square, trial.pose_nees) = (Some(square), Some(vec![nees, 1e9]));
            };
            of_three(change, |about| about.poses())
        };
        // Noise of 0.01 px leaves 1e-4 of every degree of freedom, of which three samples have 1422.
        let (p, check) = judged(1e-4 * 600.0, 6.0);
        near(p, 2.0 * chance::both_sides(1800.0, 1422));
        // sqrt(600 / 474)
        assert!(check.evidence.starts_with("residuals 1.125 of what noise leaves"), "{}", check.evidence);
        let (p, check) = judged(1e-4 * 474.0, 24.0);
        near(p, 2.0 * chance::both_sides(72.0, 18));
        assert!(check.evidence.ends_with("mean squared error 4.000 of the bound's"), "{}", check.evidence);
    }

    #[test]
    fn a_stated_covariance_is_judged_by_its_variances_and_by_errors_in_its_units() {
        let judged = |deviation: f64, along: Option<f64>, own_nees: Option<f64>| {
            let change = move |_: usize, trial: &mut Trial| {
                trial.deviations_over_bound = Some(vec![1.0, 1.0, 1.0, deviation, 1.0, 1.0]);
                trial.principal_variances = along.map(|along| vec![1.0, along, 1.0, 1.0, 1.0, 1.0]);
                trial.own_nees = own_nees;
            };
            of_three(change, |about| about.covariance())
        };
        // Three samples of 474 degrees of freedom; twelve variances are looked at.
        let (p, check) = judged(1.1, None, None);
        near(p, 12.0 * chance::both_sides(1.21 * 1422.0, 1422));
        assert_eq!(check.evidence, "worst cy: stated variance 1.210 of the bound's");
        let (p, check) = judged(1.0, Some(0.8), None);
        near(p, 12.0 * chance::both_sides(0.8 * 1422.0, 1422));
        assert!(check.evidence.ends_with(" 0.8000"), "{}", check.evidence);
        let (p, check) = judged(1.0, None, Some(24.0));
        let score = chance::normal_score_of_f(4.0, 6, 474);
        near(p, 2.0 * chance::normal(score * 3.0f64.sqrt()));
        let told = format!("; errors in its units: mean score {}", significant(score, 3));
        assert!(check.evidence.ends_with(&told), "{}", check.evidence);
    }

    #[test]
    fn a_ratio_is_as_far_from_one_as_its_inverse() {
        assert!((distance(4.0) - distance(0.25)).abs() < 1e-15 && distance(4.0) > distance(0.5));
        assert_eq!((distance(1.0), distance(0.0), distance(-1.0)), (0.0, f64::INFINITY, f64::INFINITY));
    }
}
