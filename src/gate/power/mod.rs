//! How much does the gate see, and how often does it cry wolf? Planted faults and clean seeds.

mod measured;

pub use measured::{AlarmRow, FaultRow, Measured, MeasuredError, MisledRow, Sizes};

use super::faults::{Faulty, Planted};
use super::judge::{self, Basis, Check, Property, Terms, Verdict};
use super::plan::{Asked, Plan, PlanError};
use super::run::ask_where;
use super::solver::Solver;
use super::trial::Seen;
use super::{Builtin, run};
use rayon::prelude::*;

/// What became of a fault.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Catch {
    /// Samples a scenario after which a check failed; `None` if none did.
    pub samples: Option<usize>,
    /// Problems asked until then, or at all: scenarios and purposes in the order of the plan.
    pub problems: usize,
    /// The properties that failed then, the gravest first.
    pub by: Vec<Property>,
    /// The worst verdict.
    pub verdict: Verdict,
}

/// Asks a faulty solver for 1, 2, 4, ... samples a scenario until a check fails at the gate's own false-alarm
/// rate, up to `most`; then looks for the problem, in the order in which they were asked, with which it began
/// to fail.
///
/// # Errors
/// A plan that cannot be made.
pub fn catch(fault: Planted, seed: u64, most: usize) -> Result<Catch, PlanError> {
    catch_solver(&Faulty::new(fault), seed, most)
}

/// The same for any solver: the correct one must not be caught.
///
/// # Errors
/// A plan that cannot be made.
pub fn catch_solver(solver: &dyn Solver, seed: u64, most: usize) -> Result<Catch, PlanError> {
    let plan = Plan::of(seed, most, Asked::of(&solver.models()))?;
    let terms = Terms::default();
    let mut seen = vec![None; plan.cases.len()];
    let mut before = 0;
    let mut samples = 1;
    loop {
        ask_where(&plan, solver, &mut seen, |case| case.trial < samples as u64, &|_| ());
        let asked = seen.iter().flatten().count();
        let failed = failures(judge::judged(&plan, &seen, &terms));
        if failed.is_empty() && samples < most {
            before = asked;
            samples = (2 * samples).min(most);
            continue;
        }
        if failed.is_empty() {
            return Ok(Catch { samples: None, problems: asked, by: Vec::new(), verdict: Verdict::Held });
        }
        let order = order_of_asking(&plan, samples);
        let (problems, failed) = first_failing(before, asked, failed, |count| {
            failures(judge::judged(&plan, &only(&seen, &order[..count]), &terms))
        });
        let verdict = failed.iter().map(|c| c.verdict).max().unwrap_or(Verdict::Failed);
        let mut by: Vec<Property> = Vec::new();
        for check in &failed {
            if !by.contains(&check.property) {
                by.push(check.property);
            }
        }
        return Ok(Catch { samples: Some(samples), problems, by, verdict });
    }
}

/// Checks that fail, the gravest first.
fn failures(checks: Vec<Check>) -> Vec<Check> {
    let mut failed: Vec<Check> = checks.into_iter().filter(|c| c.verdict >= Verdict::Failed).collect();
    failed.sort_by_key(|c| (std::cmp::Reverse(c.verdict), c.property));
    failed
}

/// Indices of the cases in the order in which they were asked: by doubled rounds, each in the order of the
/// plan.
fn order_of_asking(plan: &Plan, samples: usize) -> Vec<usize> {
    let round = |i: &usize| plan.cases[*i].trial.checked_ilog2().map_or(0, |power| power + 1);
    let mut order: Vec<usize> =
        (0..plan.cases.len()).filter(|&i| plan.cases[i].trial < samples as u64).collect();
    order.sort_by_key(round);
    order
}

fn only(seen: &[Option<Seen>], kept: &[usize]) -> Vec<Option<Seen>> {
    let mut part = vec![None; seen.len()];
    for &i in kept {
        part[i].clone_from(&seen[i]);
    }
    part
}

/// Bisects between a number of problems that does not fail and one that does, with what failed there.
fn first_failing(
    mut holds: usize,
    mut fails: usize,
    mut failed: Vec<Check>,
    judge: impl Fn(usize) -> Vec<Check>,
) -> (usize, Vec<Check>) {
    while fails - holds > 1 {
        let middle = holds + (fails - holds) / 2;
        let there = judge(middle);
        if there.is_empty() {
            holds = middle;
        } else {
            (fails, failed) = (middle, there);
        }
    }
    (fails, failed)
}

/// How the correct solver fares over many seeds.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Alarms {
    /// Seeds tried.
    pub seeds: usize,
    /// Smallest p-value of each run, times the number of its checks (Bonferroni; Holm rejects something
    /// exactly where this does).
    pub smallest: Vec<f64>,
    /// Failures that no chance explains, one line each.
    pub certain: Vec<String>,
}

impl Alarms {
    /// Runs that fail at the overall rate `rate`.
    pub fn at(&self, rate: f64) -> usize {
        self.smallest.iter().filter(|p| **p <= rate).count()
    }
}

/// Judges the correct solver on `seeds` seeds from `first` on, on the scenes with Brown-Conrady's lens: those
/// of the others take many times as long.
///
/// # Errors
/// A plan that cannot be made.
pub fn false_alarms(
    first: u64,
    seeds: usize,
    samples: usize,
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Alarms, PlanError> {
    let one = |seed: u64| -> Result<(f64, Vec<String>), PlanError> {
        let plan = Plan::new(seed, samples)?;
        let checks = judge::check(&plan, &run(&plan, &Builtin, &|_| ()), &Terms::default());
        let p_values: Vec<f64> = checks
            .iter()
            .filter_map(|c| match c.basis {
                Basis::Chance(p) => Some(p),
                _ => None,
            })
            .collect();
        let smallest = p_values.iter().fold(1.0f64, |a, b| a.min(*b)) * p_values.len() as f64;
        let certain = checks.iter().filter(|c| c.basis == Basis::Certain(false));
        let told = |c: &Check| format!("seed {seed}: {} / {}: {}", c.property.name(), c.scenario, c.evidence);
        let certain = certain.map(told).collect();
        progress(1);
        Ok((smallest, certain))
    };
    let results: Vec<(f64, Vec<String>)> =
        (0..seeds as u64).into_par_iter().map(|i| one(first + i)).collect::<Result<_, _>>()?;
    let (smallest, certain): (Vec<f64>, Vec<Vec<String>>) = results.into_iter().unzip();
    Ok(Alarms { seeds, smallest, certain: certain.concat() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_of_asking_begins_with_every_purpose_of_the_first_sample() {
        let plan = Plan::new(1, 4).unwrap();
        let order = order_of_asking(&plan, 4);
        assert_eq!(order.len(), plan.cases.len());
        let trials: Vec<u64> = order.iter().map(|&i| plan.cases[i].trial).collect();
        let last_of = |trial| trials.iter().rposition(|t| *t == trial).unwrap();
        let first_of = |trial| trials.iter().position(|t| *t == trial).unwrap();
        assert!(last_of(0) < first_of(1) && last_of(1) < first_of(2).min(first_of(3)));
        assert_eq!(order_of_asking(&plan, 2).len(), first_of(2).min(first_of(3)));
    }

    #[test]
    fn a_fault_that_shows_at_once_is_caught_by_the_first_problem() {
        let crashes = super::super::Process::new("exit 1", std::time::Duration::from_secs(20), 1);
        let caught = catch_solver(&crashes, 1, 1).unwrap();
        assert_eq!((caught.problems, caught.samples), (1, Some(1)));
        assert_eq!(caught.by, [Property::Protocol, Property::Exactness]);
    }

    #[test]
    fn the_correct_solver_is_judged_by_chance_and_held() {
        let asked = std::sync::atomic::AtomicUsize::new(0);
        let count = |more| {
            asked.fetch_add(more, std::sync::atomic::Ordering::Relaxed);
        };
        let alarms = false_alarms(1, 1, 1, &count).unwrap();
        assert_eq!((alarms.seeds, asked.into_inner(), alarms.certain.len()), (1, 1, 0));
        // Of hundreds of p-values the smallest is small, and not too small for so many.
        assert!(alarms.smallest[0] > 1e-3, "{:?}", alarms.smallest);
        assert_eq!((alarms.at(1e-3), alarms.at(f64::INFINITY)), (0, 1));
    }

    #[test]
    fn bisection_finds_the_number_of_problems_with_which_it_begins_to_fail() {
        let check = |problems: usize| Check::new(Property::Bias, "s", Basis::Certain(false), problems, "");
        for first in 4..=20 {
            let judge = |count: usize| if count < first { Vec::new() } else { vec![check(count)] };
            let (problems, failed) = first_failing(3, 20, judge(20), judge);
            assert_eq!((problems, failed.len(), failed[0].problems), (first, 1, first));
        }
    }

    #[test]
    fn who_is_caught_by_one_sample_is_asked_no_more() {
        let refuses = super::super::faults::planted().into_iter().find(|f| f.id == "refuses-everything");
        let caught = catch(refuses.unwrap(), 1, 2).unwrap();
        assert_eq!((caught.samples, caught.problems), (Some(1), 1));
    }
}
