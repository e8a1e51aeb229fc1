//! How much does the gate see, and how often does it cry wolf? Planted faults and clean seeds.

use super::faults::{Faulty, Planted};
use super::judge::{self, Basis, Property, Verdict};
use super::plan::{Plan, PlanError};
use super::run::ask_where;
use super::solver::Solver;
use super::{Builtin, EXPECTED_FALSE_ALARMS, run};
use rayon::prelude::*;

/// What became of a fault.
#[derive(Debug, Clone, PartialEq)]
pub struct Catch {
    /// Samples a scenario after which a check failed; `None` if none did.
    pub samples: Option<usize>,
    /// Problems asked by then, all scenarios and purposes together.
    pub problems: usize,
    /// The properties that failed then, the gravest first.
    pub by: Vec<Property>,
    /// The worst verdict.
    pub verdict: Verdict,
}

/// Asks a faulty solver for 1, 2, 4, ... samples a scenario until a check fails at the gate's own false-alarm rate, up to `most`.
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
    let plan = Plan::new(seed, most)?;
    let mut seen = vec![None; plan.cases.len()];
    let mut samples = 1;
    loop {
        ask_where(&plan, solver, &mut seen, |case| case.trial < samples as u64, &|_| ());
        let checks = judge::decide(judge::check(&plan, &seen), EXPECTED_FALSE_ALARMS, &[]);
        let verdict = checks.iter().map(|c| c.verdict).max().unwrap_or(Verdict::NotJudged);
        let caught = verdict >= Verdict::Failed;
        if caught || samples >= most {
            let mut failed: Vec<_> = checks.iter().filter(|c| c.verdict >= Verdict::Failed).collect();
            failed.sort_by_key(|c| (std::cmp::Reverse(c.verdict), c.property));
            let mut by: Vec<Property> = Vec::new();
            for check in failed {
                if !by.contains(&check.property) {
                    by.push(check.property);
                }
            }
            let problems = seen.iter().flatten().count();
            return Ok(Catch { samples: caught.then_some(samples), problems, by, verdict });
        }
        samples = (2 * samples).min(most);
    }
}

/// How the correct solver fares over many seeds.
#[derive(Debug, Clone, PartialEq)]
pub struct Alarms {
    /// Seeds tried.
    pub seeds: usize,
    /// Smallest p-value of each run, times the number of its checks (Bonferroni; Holm rejects something exactly where this does).
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

/// Judges the correct solver on `seeds` seeds from `first` on.
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
        let checks = judge::check(&plan, &run(&plan, &Builtin, &|_| ()));
        let p_values: Vec<f64> = checks
            .iter()
            .filter_map(|c| match c.basis {
                Basis::Chance(p) => Some(p),
                _ => None,
            })
            .collect();
        let smallest = p_values.iter().fold(1.0f64, |a, b| a.min(*b)) * p_values.len() as f64;
        let certain = checks.iter().filter(|c| c.basis == Basis::Certain(false));
        let told =
            |c: &judge::Check| format!("seed {seed}: {} / {}: {}", c.property.name(), c.scenario, c.evidence);
        let certain = certain.map(told).collect();
        progress(1);
        Ok((smallest, certain))
    };
    let results: Vec<(f64, Vec<String>)> =
        (0..seeds as u64).into_par_iter().map(|i| one(first + i)).collect::<Result<_, _>>()?;
    let (smallest, certain): (Vec<f64>, Vec<Vec<String>>) = results.into_iter().unzip();
    Ok(Alarms { seeds, smallest, certain: certain.concat() })
}
