//! How is a plan asked? In batches, so that memory does not grow with the number of problems.

use super::plan::{Case, Plan};
use super::protocol::Problem;
use super::solver::{Reply, Solver};
use super::trial::{Seen, reduce};
use rayon::prelude::*;

/// Problems that are held in memory at a time: about 20 kB each.
const BATCH: usize = 1024;

/// Asks the solver every case of the plan. `progress` hears how many more are done. `None` stands for a case
/// that was left out.
///
/// ```
/// use calibench_gate::{Builtin, Plan, Report, Terms, run};
///
/// // Seed, and samples of every scenario: two for a first look, a quick run takes 128.
/// let plan = Plan::new(1, 2)?;
/// let seen = run(&plan, &Builtin, &|_| ());
/// let report = Report::new(&plan, "calibench", &seen, &Terms::default(), 0.0);
/// assert!(report.held(), "{}", report.conclusion());
/// # Ok::<(), calibench_gate::PlanError>(())
/// ```
pub fn run(plan: &Plan, solver: &dyn Solver, progress: &(dyn Fn(usize) + Sync)) -> Vec<Option<Seen>> {
    let mut seen = vec![None; plan.cases.len()];
    ask_where(plan, solver, &mut seen, |_| true, progress);
    seen
}

/// Asks those cases that `wanted` names and that have no reply yet.
pub fn ask_where(
    plan: &Plan,
    solver: &dyn Solver,
    seen: &mut [Option<Seen>],
    wanted: impl Fn(&Case) -> bool,
    progress: &(dyn Fn(usize) + Sync),
) {
    let missing: Vec<usize> =
        (0..plan.cases.len()).filter(|&i| seen[i].is_none() && wanted(&plan.cases[i])).collect();
    for batch in missing.chunks(BATCH) {
        let problems: Vec<Problem> = batch.par_iter().map(|&i| plan.problem(&plan.cases[i])).collect();
        let replies = solver.ask_all(&problems);
        for (&i, measured) in batch.iter().zip(reduce_all(plan, batch, &problems, replies)) {
            seen[i] = Some(measured);
        }
        progress(batch.len());
    }
}

fn reduce_all(plan: &Plan, batch: &[usize], problems: &[Problem], replies: Vec<Reply>) -> Vec<Seen> {
    replies
        .into_par_iter()
        .zip(batch.par_iter().zip(problems))
        .map(|(reply, (&i, problem))| reduce(plan, &plan.cases[i], problem, reply))
        .collect()
}
