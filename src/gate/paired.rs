//! What did a change of the solver change? Two solvers on the same problems, compared answer by answer.
//!
//! The noise is common to both, so it cancels in the difference: a shift far too small for two separate
//! verdicts shows.

use super::judge::{Check, Property, Verdict};
use super::plan::{Plan, Purpose};
use super::suite::{Demand, Scenario};
use super::trial::{Seen, Trial};
use calibench::camera::Parameter;
use calibench::evaluate::distribution::normal_cdf;
use calibench::evaluate::interval::each_of;
use calibench::io::significant;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};

/// A mean difference or an excess of spread below this part of a standard deviation is no change that
/// matters, however certain.
const RELEVANT: f64 = 1e-3;

/// One scenario, compared.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Comparison {
    /// Scenario.
    pub scenario: &'static str,
    /// Problems that both answered.
    pub pairs: usize,
    /// Problems that only the new solver left unanswered.
    pub lost: usize,
    /// Problems that only the reference left unanswered.
    pub gained: usize,
    /// Answers whose bits differ.
    pub bits: usize,
    /// Largest difference of a parameter, in standard deviations of the bound.
    pub largest: f64,
    /// Parameter whose mean moved most certainly by an amount that matters, its mean difference in standard
    /// deviations, and the p-value.
    pub shift: Option<(String, f64, f64)>,
    /// Parameter whose spread changed most certainly by an amount that matters, the ratio of variances new /
    /// reference, and the p-value.
    pub spread: Option<(String, f64, f64)>,
    /// The same of the stated uncertainty: a parameter or an uncorrelated combination of some, the ratio of
    /// its stated variances.
    pub stated: Option<(String, f64, f64)>,
    /// Whether what differs here was tested: with fewer than 30 pairs it is not, unless it is too little to
    /// matter.
    pub is_tested: bool,
    /// Median time new / reference; NaN, and `null` in JSON, where one of the two is not known.
    pub time: f64,
}

/// What a comparison comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Conclusion {
    /// Of no problem are there two estimates.
    NotCompared,
    /// Something that matters moved, or is no longer stated.
    Changed,
    /// Answers differ by what would matter, where too few were asked to tell it from chance.
    TooFewPairs,
    /// Verdicts differ, none of them for the worse, and nothing moved.
    OtherVerdicts,
    /// Answers differ in nothing that matters.
    SameLaw,
    /// Not a bit differs.
    Same,
}

/// The comparison of two runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Paired {
    /// The new solver.
    pub solver: String,
    /// The reference.
    pub reference: String,
    /// Chance that two solvers of the same law are told apart by any test.
    pub false_alarm_rate: f64,
    /// Number of tests that share it.
    pub tests: usize,
    /// Samples that were asked and have an estimate.
    pub samples: usize,
    /// Scenario by scenario.
    pub comparisons: Vec<Comparison>,
    /// Problems of any kind, not the samples only, to which one said something else than the other: another
    /// number, a warning more, no answer.
    pub differing: usize,
    /// Checks whose verdict differs: property, scenario, reference's, new.
    pub verdicts: Vec<(Property, &'static str, Verdict, Verdict)>,
}

/// Compares what was seen of two solvers on the same plan, and their checks.
pub fn compare(
    plan: &Plan,
    (solver, new, new_checks): (&str, &[Option<Seen>], &[Check]),
    (reference, old, old_checks): (&str, &[Option<Seen>], &[Check]),
    false_alarm_rate: f64,
) -> Paired {
    let comparisons: Vec<Comparison> = plan
        .scenarios
        .iter()
        .enumerate()
        .map(|(index, scenario)| {
            let pairs = plan
                .cases
                .iter()
                .zip(new.iter().zip(old))
                .filter(|(case, _)| case.scenario == index && case.purpose == Purpose::Sample);
            of_scenario(scenario, pairs.filter_map(|(_, (n, o))| Some((n.as_ref()?, o.as_ref()?))).collect())
        })
        .collect();
    let parameters: usize = plan.scenarios.iter().map(|s| s.free.len()).sum();
    // Of poor or contaminated data both may refuse each.
    let has_estimate = |scenario: usize| plan.scenarios[scenario].demand != Demand::Honesty;
    let samples = plan.cases.iter().filter(|c| c.purpose == Purpose::Sample && has_estimate(c.scenario));
    let both = new.iter().zip(old).filter_map(|(n, o)| Some((n.as_ref()?, o.as_ref()?)));
    Paired {
        solver: solver.to_string(),
        reference: reference.to_string(),
        false_alarm_rate,
        tests: 4 * parameters,
        samples: samples.count(),
        comparisons,
        differing: both.filter(|(n, o)| !says_the_same(n, o)).count(),
        verdicts: verdicts(new_checks, old_checks),
    }
}

fn says_the_same(new: &Seen, old: &Seen) -> bool {
    match (new, old) {
        (Seen::Estimate(n), Seen::Estimate(o)) => (n.bits, n.warnings) == (o.bits, o.warnings),
        (Seen::Refused { .. }, Seen::Refused { .. })
        | (Seen::Unsupported(_), Seen::Unsupported(_))
        | (Seen::Broken(_), Seen::Broken(_)) => true,
        _ => false,
    }
}

/// Where the verdicts differ: property, scenario, reference's, new. A check that one run does not have, such
/// as that of the bias in a scene without estimates, was not judged there.
fn verdicts(new: &[Check], old: &[Check]) -> Vec<(Property, &'static str, Verdict, Verdict)> {
    let by_name = |checks: &[Check]| -> BTreeMap<(Property, &'static str), Verdict> {
        checks.iter().map(|check| ((check.property, check.scenario), check.verdict)).collect()
    };
    let (new_by_name, old_by_name) = (by_name(new), by_name(old));
    let names: BTreeSet<_> = new_by_name.keys().chain(old_by_name.keys()).copied().collect();
    let of = |checks: &BTreeMap<_, Verdict>, name| checks.get(&name).copied().unwrap_or(Verdict::NotJudged);
    let pairs =
        names.into_iter().map(|name| (name.0, name.1, of(&old_by_name, name), of(&new_by_name, name)));
    pairs.filter(|(_, _, old, new)| old != new).collect()
}

/// Pairs with which tests begin: fewer make the normal approximation of Student's distribution too bold at
/// small probabilities.
const FEWEST_PAIRS: usize = 30;

/// A paired test: what is told, and its normal score. Scores rank what is beyond doubt, where all p-values
/// are 0.
type Test = fn(&[(f64, f64)]) -> Option<(f64, f64)>;

/// What was tested, what is told of it, and its p-value: of those results whose values matter the most
/// certain, or of all where none matters.
fn most_certain(
    results: impl Iterator<Item = (String, f64, f64)>,
    matters: fn(f64) -> bool,
) -> Option<(String, f64, f64)> {
    let rank = |(_, value, z): &(String, f64, f64)| (matters(*value), z.abs(), value.abs());
    let best = results.max_by(|a, b| {
        let ((a, az, av), (b, bz, bv)) = (rank(a), rank(b));
        a.cmp(&b).then(az.total_cmp(&bz)).then(av.total_cmp(&bv))
    })?;
    Some((best.0, best.1, two_sided(best.2)))
}

/// A shift that matters.
fn is_relevant(shift: f64) -> bool {
    shift.abs() > RELEVANT
}

/// A ratio that matters.
fn is_other(ratio: f64) -> bool {
    is_relevant(ratio - 1.0)
}

fn of_scenario(scenario: &Scenario, replies: Vec<(&Seen, &Seen)>) -> Comparison {
    let estimate = |seen: &Seen| matches!(seen, Seen::Estimate(_));
    let both: Vec<(&Trial, &Trial)> = replies
        .iter()
        .filter_map(|pair| match pair {
            (Seen::Estimate(n), Seen::Estimate(o)) => Some((n.as_ref(), o.as_ref())),
            _ => None,
        })
        .collect();
    let standardised = |i: usize| -> Vec<(f64, f64)> {
        both.iter().map(|(n, o)| (n.standardised[i], o.standardised[i])).collect()
    };
    let names: Vec<Parameter> = scenario.free.iter().collect();
    let estimates = |test: Test, matters: fn(f64) -> bool| {
        let each = names.iter().enumerate().filter_map(|(i, name)| {
            let (value, z) = test(&standardised(i))?;
            Some((name.name().to_string(), value, z))
        });
        most_certain(each, matters)
    };
    let lawful = scenario.demand == Demand::Law;
    let largest = (0..names.len()).flat_map(standardised).map(|(n, o)| (n - o).abs()).fold(0.0, f64::max);
    let matters = is_relevant(largest) || both.iter().any(|(n, o)| states_otherwise(n, o));
    Comparison {
        scenario: scenario.id,
        pairs: both.len(),
        lost: replies.iter().filter(|(n, o)| !estimate(n) && estimate(o)).count(),
        gained: replies.iter().filter(|(n, o)| estimate(n) && !estimate(o)).count(),
        bits: both.iter().filter(|(n, o)| n.bits != o.bits).count(),
        largest,
        is_tested: !lawful || both.len() >= FEWEST_PAIRS || !matters,
        shift: estimates(shift, is_relevant).filter(|_| lawful),
        spread: estimates(spread, is_other).filter(|_| lawful),
        stated: most_certain(stated(scenario, &both), is_other).filter(|_| lawful),
        time: median(both.iter().map(|(n, _)| n.seconds)) / median(both.iter().map(|(_, o)| o.seconds)),
    }
}

/// Whether two answers state variances that differ by what matters, or one of them states none.
fn states_otherwise(new: &Trial, old: &Trial) -> bool {
    let other = |new: &Option<Vec<f64>>, old: &Option<Vec<f64>>| match (new, old) {
        (Some(new), Some(old)) => new.iter().zip(old).any(|(n, o)| is_other(n / o)),
        (new, old) => new.is_some() != old.is_some(),
    };
    let squares = |trial: &Trial| {
        let deviations = trial.standard_deviations.as_ref()?;
        Some(deviations.iter().map(|sd| sd * sd).collect())
    };
    other(&squares(new), &squares(old)) || other(&new.principal_variances, &old.principal_variances)
}

/// Ratios of stated variances, parameter by parameter and along the uncorrelated combinations, each with its
/// score: the mean logarithm of the ratio is compared with its spread from problem to problem.
fn stated<'a>(
    scenario: &'a Scenario,
    both: &'a [(&Trial, &Trial)],
) -> impl Iterator<Item = (String, f64, f64)> + 'a {
    let variance = |trial: &Trial, i: usize| {
        let sd = trial.standard_deviations.as_ref()?.get(i)?;
        Some(sd * sd)
    };
    let along = |trial: &Trial, i: usize| trial.principal_variances.as_ref()?.get(i).copied();
    let compared = move |name: String, of: &dyn Fn(&Trial) -> Option<f64>| {
        let logarithms = both.iter().filter_map(|(n, o)| Some((libm::log(of(n)?), libm::log(of(o)?))));
        let (mean, z) = shift(&logarithms.collect::<Vec<_>>())?;
        Some((name, libm::exp(mean), z))
    };
    let parameters = scenario.free.iter().enumerate();
    let singly = parameters.filter_map(move |(i, p)| compared(p.name().to_string(), &|t| variance(t, i)));
    let combined = (0..scenario.free.len())
        .filter_map(move |i| compared(scenario.principal.name(i).to_string(), &|t| along(t, i)));
    singly.chain(combined)
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

fn two_sided(z: f64) -> f64 {
    (2.0 * normal_cdf(-z.abs())).min(1.0)
}

/// Mean difference and its score (paired z-test).
fn shift(pairs: &[(f64, f64)]) -> Option<(f64, f64)> {
    let n = pairs.len() as f64;
    let mean = pairs.iter().map(|(a, b)| a - b).sum::<f64>() / n;
    let square: f64 = pairs.iter().map(|(a, b)| (a - b - mean) * (a - b - mean)).sum();
    if pairs.len() < FEWEST_PAIRS || (square == 0.0 && mean == 0.0) {
        return None;
    }
    let error = (square / (n - 1.0) / n).sqrt();
    Some((mean, mean / error))
}

/// Ratio of variances and the score of their equality: sum and difference of two variables of equal variance
/// are uncorrelated (Pitman 1939; Morgan 1939), their correlation tested by Fisher's transformation (1921).
fn spread(pairs: &[(f64, f64)]) -> Option<(f64, f64)> {
    let n = pairs.len() as f64;
    if pairs.len() < FEWEST_PAIRS {
        return None;
    }
    let mean = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / n;
    let (a, b) = (mean(|p| p.0), mean(|p| p.1));
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (x, y) in pairs {
        aa += (x - a) * (x - a);
        bb += (y - b) * (y - b);
        ab += (x - a) * (y - b);
    }
    let (sums, differences) = (aa + bb + 2.0 * ab, aa + bb - 2.0 * ab);
    if !(sums > 0.0 && differences > 0.0) {
        return None;
    }
    let correlation = ((aa - bb) / (sums * differences).sqrt()).clamp(-1.0, 1.0);
    let z = libm::atanh(correlation) * (n - 3.0).sqrt();
    Some((aa / bb, z))
}

/// Whether a verdict is worse than the one before; what is no longer stated is.
fn worse(old: Verdict, new: Verdict) -> bool {
    match (old, new) {
        (_, Verdict::NotJudged) => true,
        (Verdict::NotJudged, new) => new >= Verdict::Failed,
        (old, new) => new > old,
    }
}

impl Paired {
    fn certain(&self, p: f64) -> bool {
        p <= each_of(self.tests, self.false_alarm_rate)
    }

    /// Whether a scenario's estimates moved by an amount that matters and that chance does not explain.
    pub fn moved(&self, c: &Comparison) -> bool {
        let moved = |test: &Option<(String, f64, f64)>, matters: fn(f64) -> bool| {
            test.as_ref().is_some_and(|(_, value, p)| matters(*value) && self.certain(*p))
        };
        moved(&c.shift, is_relevant) || moved(&c.spread, is_other) || moved(&c.stated, is_other) || c.lost > 0
    }

    /// Whether there was something to compare: of samples that were asked both must have estimated one.
    pub fn is_compared(&self) -> bool {
        self.samples == 0 || self.comparisons.iter().any(|c| c.pairs > 0)
    }

    /// What the comparison comes to.
    pub fn conclusion(&self) -> Conclusion {
        let is_worse = self.verdicts.iter().any(|(_, _, old, new)| worse(*old, *new));
        match self.differing {
            _ if !self.is_compared() => Conclusion::NotCompared,
            _ if is_worse || self.comparisons.iter().any(|c| self.moved(c)) => Conclusion::Changed,
            _ if self.comparisons.iter().any(|c| !c.is_tested) => Conclusion::TooFewPairs,
            _ if !self.verdicts.is_empty() => Conclusion::OtherVerdicts,
            0 => Conclusion::Same,
            _ => Conclusion::SameLaw,
        }
    }

    /// Whether two solvers were compared and nothing that matters changed for the worse: what is no longer
    /// stated counts as changed, and what was not tested is not known to be the same.
    pub fn held(&self) -> bool {
        use Conclusion::{OtherVerdicts, Same, SameLaw};
        matches!(self.conclusion(), OtherVerdicts | SameLaw | Same)
    }

    /// The report as JSON, with the conclusion.
    pub fn to_json(&self) -> String {
        let mut value = serde_json::to_value(self).unwrap_or_default();
        value["conclusion"] = serde_json::to_value(self.conclusion()).unwrap_or_default();
        value["held"] = self.held().into();
        format!("{value:#}\n")
    }

    fn conclusion_in_words(&self) -> String {
        let n = self.differing;
        match self.conclusion() {
            Conclusion::NotCompared => "NOT COMPARED: of no problem are there two estimates".to_string(),
            Conclusion::Changed => format!("CHANGED: {n} answers differ"),
            Conclusion::TooFewPairs => {
                let untested = self.comparisons.iter().filter(|c| !c.is_tested).count();
                format!(
                    "TOO FEW PAIRS: {n} answers differ, in {untested} scenes by what would matter, and tests begin with {FEWEST_PAIRS} \
                     pairs a scene: ask with --samples {FEWEST_PAIRS} or more"
                )
            }
            Conclusion::OtherVerdicts => {
                format!(
                    "OTHER VERDICTS, none for the worse: {n} answers differ, and nothing is known to have moved"
                )
            }
            Conclusion::SameLaw => format!("SAME LAW: {n} answers differ, in nothing that matters"),
            Conclusion::Same => "SAME: not a bit differs".to_string(),
        }
    }

    /// One line a scenario, then what follows.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "gate: {} against {}, same problems\n\n{:<18} {:>6} {:>6} {:>10}  {:<24} {:<24} {:<24} {:>6}\n",
            self.solver,
            self.reference,
            "scenario",
            "pairs",
            "bits",
            "largest/sd",
            "mean shift/sd",
            "variance ratio",
            "stated variance ratio",
            "time"
        );
        let told = |test: &Option<(String, f64, f64)>| match test {
            Some((name, value, p)) => format!("{name} {} p={}", significant(*value, 4), significant(*p, 1)),
            None => "-".to_string(),
        };
        for c in &self.comparisons {
            text.push_str(&format!(
                "{:<18} {:>6} {:>6} {:>10}  {:<24} {:<24} {:<24} {:>6}{}\n",
                c.scenario,
                c.pairs,
                c.bits,
                significant(c.largest, 2),
                told(&c.shift),
                told(&c.spread),
                told(&c.stated),
                if c.time.is_finite() { significant(c.time, 2) } else { "-".to_string() },
                if self.moved(c) { "  MOVED" } else { "" }
            ));
            if c.lost + c.gained > 0 {
                text.push_str(&format!("{:<18} {} answers lost, {} gained\n", "", c.lost, c.gained));
            }
        }
        let mut changes: BTreeMap<(Property, Verdict, Verdict), Vec<&str>> = BTreeMap::new();
        for (property, scenario, old, new) in &self.verdicts {
            changes.entry((*property, *old, *new)).or_default().push(scenario);
        }
        for ((property, old, new), scenarios) in changes {
            let (first, count) = (scenarios[0], scenarios.len());
            let others = if count > 1 { format!(" and {} more", count - 1) } else { String::new() };
            text.push_str(&format!(
                "{}: {} -> {} ({first}{others})\n",
                property.name(),
                old.word(),
                new.word()
            ));
        }
        let conclusion = self.conclusion_in_words();
        let time = median(self.comparisons.iter().map(|c| c.time).filter(|time| time.is_finite()));
        let time = match time.is_finite() {
            true => format!("median time {} of the reference's", significant(time, 3)),
            false => "times are not known of answers in files".to_string(),
        };
        text.push_str(&format!(
            "\n{conclusion}; {time}\nby chance two solvers of one law are told apart in one run of {} \
             ({} tests, Bonferroni)\n",
            significant(1.0 / self.false_alarm_rate, 3),
            self.tests
        ));
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::synth::{Stream, StreamKey};

    fn pairs(change: impl Fn(f64, f64) -> f64) -> Vec<(f64, f64)> {
        let mut stream = Stream::open(StreamKey { seed: 1, scenario: "paired", trial: 0, purpose: "noise" });
        (0..400).map(|_| (stream.normal(), stream.normal())).map(|(x, y)| (change(x, y), x)).collect()
    }

    #[test]
    fn a_shift_far_below_the_noise_is_seen_and_chance_is_not() {
        // Difference 0.01 + 0.02 y: its mean is 10 standard errors from zero.
        let (mean, z) = shift(&pairs(|x, y| x + 0.01 + 0.02 * y)).unwrap();
        assert!((mean - 0.01).abs() < 0.005 && two_sided(z) < 1e-9, "{mean} {z}");
        let (_, z) = shift(&pairs(|x, y| x + 0.02 * y)).unwrap();
        assert!(two_sided(z) > 1e-4, "{z}");
        assert_eq!(shift(&pairs(|x, _| x)), None);
    }

    #[test]
    fn of_results_beyond_doubt_the_one_that_matters_is_told() {
        let results = |list: &[(&str, f64, f64)]| {
            let list: Vec<_> = list.iter().map(|(name, value, z)| (name.to_string(), *value, *z)).collect();
            most_certain(list.into_iter(), is_relevant).unwrap().0
        };
        assert_eq!(results(&[("fx", 1e-5, 90.0), ("k1", 0.2, 60.0)]), "k1");
        assert_eq!(results(&[("fx", 0.1, 50.0), ("k1", 0.2, 60.0)]), "k1");
        assert_eq!(results(&[("fx", 1e-5, 90.0), ("k1", 1e-4, 60.0)]), "fx");
    }

    #[test]
    fn two_per_cent_more_spread_are_seen_on_common_noise() {
        let (ratio, z) = spread(&pairs(|x, y| 1.01 * x + 0.01 * y)).unwrap();
        assert!((ratio - 1.02).abs() < 0.01 && two_sided(z) < 1e-9, "{ratio} {z}");
        let (_, z) = spread(&pairs(|x, y| (x + 0.1 * y) / 1.01f64.sqrt())).unwrap();
        assert!(two_sided(z) > 1e-4, "{z}");
    }

    #[test]
    fn the_median_is_the_middle_one() {
        assert_eq!(median([5.0, 1.0, 9.0, 3.0, 7.0].into_iter()), 5.0);
        assert_eq!(median([4.0, 1.0, 3.0, 2.0].into_iter()), 3.0);
        assert!(median(std::iter::empty()).is_nan());
    }

    #[test]
    fn thirty_pairs_tell_something_and_fewer_nothing() {
        let all = pairs(|x, y| x + 0.1 * y);
        assert!(shift(&all[..30]).is_some() && spread(&all[..30]).is_some());
        assert!(shift(&all[..29]).is_none() && spread(&all[..29]).is_none());
    }

    #[test]
    fn a_mean_difference_is_scored_by_its_standard_error() {
        // Differences 3 and -1 in turn: mean 1, sum of squares about it 160, variance 160 / 39.
        let pairs: Vec<(f64, f64)> =
            (0..40).map(|i| (f64::from(i) + [3.0, -1.0][i as usize % 2], f64::from(i))).collect();
        let (mean, z) = shift(&pairs).unwrap();
        assert!((mean - 1.0).abs() < 1e-12 && (z - 39.0f64.sqrt() / 2.0).abs() < 1e-12, "{mean} {z}");
        assert!((two_sided(1.959_964) - 0.05).abs() < 1e-7 && two_sided(0.0) == 1.0);
    }

    #[test]
    fn a_ratio_of_variances_is_scored_by_the_correlation_of_sum_and_difference() {
        // About their means of 5 and -3: +-2 and +-1, three times of one sign for once of the other. In eight
        // of them aa = 32, bb = 8, ab = 8: the correlation is 24 / sqrt(56 * 24), of 40 pairs.
        let signs = [(2.0, 1.0), (2.0, 1.0), (2.0, 1.0), (2.0, -1.0)];
        let both = signs.into_iter().flat_map(|(x, y)| [(5.0 + x, -3.0 + y), (5.0 - x, -3.0 - y)]);
        let (ratio, z) = spread(&both.collect::<Vec<_>>().repeat(5)).unwrap();
        let expected = libm::atanh(24.0 / 1344.0f64.sqrt()) * 37.0f64.sqrt();
        assert!((ratio - 4.0).abs() < 1e-12 && (z - expected).abs() < 1e-9, "{ratio} {z} {expected}");
    }

    fn unmoved() -> Comparison {
        Comparison {
            scenario: "s",
            pairs: 40,
            lost: 0,
            gained: 0,
            bits: 5,
            largest: 0.0,
            shift: None,
            spread: None,
            stated: None,
            is_tested: true,
            time: 1.0,
        }
    }

    /// Ten tests at a rate of 0.001: each at 0.0001.
    fn compared(comparison: Comparison) -> Paired {
        Paired {
            solver: "new".into(),
            reference: "old".into(),
            false_alarm_rate: 1e-3,
            tests: 10,
            samples: 40,
            comparisons: vec![comparison],
            differing: 5,
            verdicts: Vec::new(),
        }
    }

    #[test]
    fn what_is_relevant_and_certain_has_moved_whichever_test_shows_it() {
        let test = |value: f64, p: f64| Some(("fx".to_string(), value, p));
        let conclusion = |comparison: Comparison| compared(comparison).conclusion();
        let (certain, doubtful) = (0.9e-4, 1.1e-4);
        assert_eq!(conclusion(Comparison { shift: test(-0.002, certain), ..unmoved() }), Conclusion::Changed);
        assert_eq!(conclusion(Comparison { spread: test(1.002, certain), ..unmoved() }), Conclusion::Changed);
        assert_eq!(conclusion(Comparison { stated: test(0.998, certain), ..unmoved() }), Conclusion::Changed);
        assert_eq!(conclusion(Comparison { lost: 1, ..unmoved() }), Conclusion::Changed);
        for nothing in [
            Comparison { shift: test(0.002, doubtful), ..unmoved() },
            Comparison { shift: test(0.0009, 0.0), ..unmoved() },
            Comparison { spread: test(1.0009, 0.0), ..unmoved() },
            Comparison { stated: test(1.002, doubtful), ..unmoved() },
            Comparison { gained: 1, ..unmoved() },
            unmoved(),
        ] {
            assert_eq!(conclusion(nothing.clone()), Conclusion::SameLaw, "{nothing:?}");
        }
    }

    #[test]
    fn a_comparison_holds_where_nothing_is_worse_and_all_that_differs_was_tested() {
        let verdicts =
            |old, new| Paired { verdicts: vec![(Property::Bias, "s", old, new)], ..compared(unmoved()) };
        use Verdict::{Accepted, Failed, Grave, Held, NotJudged};
        for (old, new, conclusion) in [
            (Held, Failed, Conclusion::Changed),
            (Failed, Grave, Conclusion::Changed),
            (Held, NotJudged, Conclusion::Changed),
            (NotJudged, Failed, Conclusion::Changed),
            (NotJudged, Accepted, Conclusion::OtherVerdicts),
            (NotJudged, Held, Conclusion::OtherVerdicts),
            (Grave, Failed, Conclusion::OtherVerdicts),
            (Failed, Held, Conclusion::OtherVerdicts),
        ] {
            let found = verdicts(old, new);
            assert_eq!(found.conclusion(), conclusion, "{old:?} {new:?}");
            assert_eq!(found.held(), conclusion == Conclusion::OtherVerdicts);
        }
        let untested = compared(Comparison { is_tested: false, ..unmoved() });
        assert!(untested.conclusion() == Conclusion::TooFewPairs && !untested.held());
        let same = Paired { differing: 0, ..compared(unmoved()) };
        assert!(same.conclusion() == Conclusion::Same && same.held());
        let none = compared(Comparison { pairs: 0, ..unmoved() });
        assert!(none.conclusion() == Conclusion::NotCompared && !none.held());
        let unasked = Paired { samples: 0, ..none };
        assert!(unasked.is_compared() && unasked.conclusion() == Conclusion::SameLaw);
    }

    #[test]
    fn answers_are_compared_problem_by_problem() {
        let asked = crate::plan::Asked { scenes: vec!["four-pose".into()], ..Default::default() };
        let plan = Plan::of(1, 3, asked).unwrap();
        let old = crate::run(&plan, &crate::Builtin, &|_| ());
        let mut new = old.clone();
        let samples: Vec<usize> =
            (0..new.len()).filter(|&i| plan.cases[i].purpose == Purpose::Sample).collect();
        let scene = |new: &[Option<Seen>], old: &[Option<Seen>]| {
            let mut found = compare(&plan, ("new", new, &[]), ("old", old, &[]), 1e-3);
            (found.differing, found.comparisons.remove(0))
        };
        let (differing, same) = scene(&new, &old);
        assert_eq!((differing, same.pairs, same.bits, same.largest, same.is_tested), (0, 3, 0, 0.0, true));
        new[samples[0]] = Some(Seen::Refused { reason: "no".into(), seconds: 0.0 });
        let Some(Seen::Estimate(trial)) = &mut new[samples[1]] else { panic!("it is answered") };
        trial.standardised[2] -= 0.25;
        trial.bits ^= 1;
        let (differing, found) = scene(&new, &old);
        assert_eq!((differing, found.pairs, found.bits, found.lost, found.gained), (2, 2, 1, 1, 0));
        assert!((found.largest - 0.25).abs() < 1e-12 && !found.is_tested && found.shift.is_none());
        let (_, turned) = scene(&old, &new);
        assert_eq!((turned.lost, turned.gained), (0, 1));
    }

    #[test]
    fn stated_variances_differ_where_a_ratio_matters_or_one_side_states_none() {
        let asked = crate::plan::Asked { scenes: vec!["four-pose".into()], ..Default::default() };
        let plan = Plan::of(1, 1, asked).unwrap();
        let seen = crate::run(&plan, &crate::Builtin, &|_| ());
        let first = seen.iter().flatten().find_map(|seen| match seen {
            Seen::Estimate(trial) => Some((**trial).clone()),
            _ => None,
        });
        let stating = |sd: Option<f64>, principal: Option<f64>| Trial {
            standard_deviations: sd.map(|sd| vec![0.5, sd]),
            principal_variances: principal.map(|variance| vec![variance]),
            ..first.clone().unwrap()
        };
        let otherwise = |new: &Trial| states_otherwise(new, &stating(Some(2.0), Some(1.0)));
        assert!(!otherwise(&stating(Some(2.0), Some(1.0))));
        // A variance is the square: 0.04 % of the deviation are 0.08 %, 0.06 % are 0.12 %.
        assert!(!otherwise(&stating(Some(2.0 * 1.0004), Some(1.0))));
        assert!(otherwise(&stating(Some(2.0 * 1.0006), Some(1.0))));
        assert!(otherwise(&stating(Some(2.0), Some(0.99))));
        assert!(otherwise(&stating(None, Some(1.0))) && otherwise(&stating(Some(2.0), None)));
    }

    #[test]
    fn what_differs_in_nothing_has_no_ratio_of_variances() {
        assert_eq!(spread(&pairs(|x, _| x)), None);
        assert_eq!(spread(&pairs(|x, _| -x)), None);
    }

    #[test]
    fn times_are_compared_by_their_medians_and_honest_scenes_need_no_estimate() {
        let scenes = ["four-pose", "metres", "outliers"].map(String::from).to_vec();
        let plan = Plan::of(1, 3, crate::plan::Asked { scenes, ..Default::default() }).unwrap();
        let mut seen = crate::run(&plan, &crate::Builtin, &|_| ());
        let mut taking = |seconds: f64| {
            for seen in seen.iter_mut().flatten() {
                let Seen::Estimate(trial) = seen else { panic!("it is answered") };
                trial.seconds = seconds;
            }
            seen.clone()
        };
        let (old, new) = (taking(2.0), taking(3.0));
        let found = compare(&plan, ("new", &new, &[]), ("old", &old, &[]), 1e-3);
        // Three each of two; of contaminated data both may refuse each.
        assert_eq!((found.samples, found.comparisons.len()), (6, 3));
        assert!(found.comparisons.iter().all(|scene| scene.pairs == 3 && scene.time == 1.5));
    }

    #[test]
    fn the_text_tells_what_moved_and_what_was_lost() {
        let lost = compared(Comparison { lost: 2, ..unmoved() }).to_text();
        assert!(lost.contains("MOVED") && lost.contains("2 answers lost, 0 gained"), "{lost}");
        assert!(lost.contains("CHANGED: 5 answers differ"), "{lost}");
        let same = compared(unmoved()).to_text();
        assert!(!same.contains("MOVED") && !same.contains("lost"), "{same}");
        assert!(same.contains("SAME LAW: 5 answers differ"), "{same}");
    }
}
