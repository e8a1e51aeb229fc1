//! `calibench gate --certified`: the digits that a solver shares with the certified values of `reference/`.

use super::super::{Exit, print, warn};
use super::{Arguments, Stop, incomplete, process, usage};
use calibench::io::ShownPath;
use calibench::io::input::MOST_SPEC_BYTES;
use calibench::io::{read_regular_text, write_atomically};
use calibench_gate::certified::{DigitsTable, ReferenceProblem, measure, read_with};
use calibench_gate::solver::Polished;
use calibench_gate::{Builtin, Solver};
use calibench_harness::Build;
use calibench_harness::project::Project;
use std::path::Path;

/// Programs of the table besides this library's two, by the names that the table has.
const PEERS: [(&str, &str); 3] = [
    ("OpenCV", "python3 adapters/opencv_solver.py"),
    ("SciPy", "python3 adapters/scipy_solver.py"),
    ("minimal solver", "python3 adapters/minimal_solver.py"),
];

/// Prints the digits of one solver; without a program that is this library's, polished.
pub(super) fn run(arguments: &Arguments) -> Result<Exit, Stop> {
    let problems = chosen(arguments)?;
    let solver: Box<dyn Solver> = match &arguments.solver {
        Some(command) => process(arguments, command)?,
        None => Box::new(Polished),
    };
    let mut table = DigitsTable::default();
    table.add(&solver.name(), &problems, &measure(&problems, solver.as_ref()));
    print(&table.to_text());
    let short = |least: Option<f64>| least.is_none_or(|digits| digits < arguments.least_digits);
    let failed: Vec<String> = table
        .rows
        .iter()
        .filter(|row| short(row.least))
        .map(|row| format!("{} ({})", row.problem, row.result()))
        .collect();
    if failed.is_empty() {
        return Ok(Exit::Held);
    }
    let wanted = match arguments.least_digits {
        digits if digits > 0.0 => format!("not answered, or fewer than {digits} digits"),
        _ => "not answered".to_string(),
    };
    warn(&format!("{wanted}: {}", failed.join(", ")));
    Ok(Exit::Deviates)
}

/// Writes the digits of this library's solver, polished and as it is, and of the adapters' programs.
pub(super) fn write_table(arguments: &Arguments, path: &Path, build: &Build) -> Result<Exit, Stop> {
    let project = Project::find().map_err(usage)?;
    std::env::set_current_dir(project.root()).map_err(incomplete)?;
    let problems = chosen(arguments)?;
    let mut table = DigitsTable::default();
    table.add("calibench, polished", &problems, &measure(&problems, &Polished));
    table.add("calibench", &problems, &measure(&problems, &Builtin));
    for (name, command) in PEERS {
        let measured = measure(&problems, process(arguments, command)?.as_ref());
        if measured.iter().all(Result::is_err) {
            let why = measured.first().and_then(|m| m.as_ref().err()).cloned().unwrap_or_default();
            return Err(incomplete(format!(
                "{name} answered nothing ({why}): adapters/requirements.txt names what it needs"
            )));
        }
        table.add(name, &problems, &measured);
    }
    let commit = build.commit.as_ref().map_or("unknown".to_string(), ToString::to_string);
    let provenance =
        format!("calibench gate --certified --digits FILE --timeout {}; commit {commit}", arguments.timeout);
    write_atomically(path, table.to_csv(&provenance).as_bytes()).map_err(incomplete)?;
    print(&table.to_markdown());
    Ok(Exit::Held)
}

/// Prints a table that was written before.
pub(super) fn print_table(path: &Path) -> Result<Exit, Stop> {
    let text = read_regular_text(path, MOST_SPEC_BYTES).map_err(usage)?;
    let table = DigitsTable::of_csv(&text)
        .map_err(|e| usage(format!("{} is no table of digits: {e}", path.shown())))?;
    print(&table.to_markdown());
    Ok(Exit::Held)
}

/// All problems, or the one that was named.
fn chosen(arguments: &Arguments) -> Result<Vec<ReferenceProblem>, Stop> {
    let project = Project::find().map_err(usage)?;
    let mut problems = read_with(|name| project.read_text(&format!("reference/{name}"))).map_err(usage)?;
    if let Some(name) = &arguments.problem {
        let names: Vec<String> = problems.iter().map(|p| p.problem.id.clone()).collect();
        problems.retain(|p| p.problem.id == *name);
        if problems.is_empty() {
            return Err(usage(format!("no certified problem `{name}`; there are: {}", names.join(", "))));
        }
    }
    Ok(problems)
}
