//! `calibench gate --against`: two solvers on the same problems.

use super::{Arguments, Stop, incomplete, of_files, process, terms};
use crate::{Exit, print};
use calibench::io::write_atomically;
use calibench_gate::paired::{self, Paired};
use calibench_gate::{Builtin, Plan, Report, Solver, files};
use calibench_harness::ProgressDisplay;
use std::path::Path;

pub(super) fn run(
    arguments: &Arguments,
    solver: &dyn Solver,
    reference: &str,
    samples: usize,
) -> Result<Exit, Stop> {
    let (plan, other): (Plan, Box<dyn Solver>) = match reference {
        "builtin" => (Plan::new(arguments.seed, samples).map_err(incomplete)?, Box::new(Builtin)),
        folder if Path::new(folder).join("manifest.json").is_file() => {
            let (plan, answers) = files::recorded(Path::new(folder)).map_err(of_files)?;
            (plan, Box::new(answers))
        }
        command => (Plan::new(arguments.seed, samples).map_err(incomplete)?, process(arguments, command)?),
    };
    let ask = |solver: &dyn Solver| {
        let progress = ProgressDisplay::stderr().start("gate", plan.cases.len());
        let seen = calibench_gate::run(&plan, solver, &|done| progress.advance(done));
        let report = Report::new(&plan, "", &seen, &terms(arguments), 0.0);
        (seen, report.checks)
    };
    let (old, old_checks) = ask(other.as_ref());
    let (new, new_checks) = ask(solver);
    let paired: Paired = paired::compare(
        &plan,
        (&solver.name(), &new, &new_checks),
        (&other.name(), &old, &old_checks),
        arguments.false_alarms,
    );
    if let Some(path) = &arguments.json {
        let text = format!("{:#}\n", serde_json::to_value(&paired).unwrap_or_default());
        write_atomically(path, text.as_bytes()).map_err(incomplete)?;
    }
    print(&paired.to_text());
    Ok(if paired.held() { Exit::Held } else { Exit::Deviates })
}
