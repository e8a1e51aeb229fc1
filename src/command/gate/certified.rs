//! `calibench gate certified`: the digits that a solver shares with the certified values of `reference/`.

use super::super::said::number_that;
use super::super::{Exit, print, warn};
use super::options::{Copies, refuse_unwritable};
use super::{Stop, incomplete, usage};
use calibench::io::ShownPath;
use calibench::io::input::MOST_SPEC_BYTES;
use calibench::io::{read_regular_text, write_atomically};
use calibench_gate::certified::{
    DigitsTable, Measured, NoDigits, ReferenceProblem, measure, measure_in_turn, read_with,
};
use calibench_gate::solver::Polished;
use calibench_gate::{Builtin, Solver};
use calibench_harness::Build;
use calibench_harness::project::Project;
use std::path::{Path, PathBuf};

/// Programs of the table besides this library's two, by the names that the table has. Where there are
/// several, each is asked the problems of lens models that those before it do not know.
const PEERS: [(&str, &[&str]); 3] = [
    ("OpenCV", &["python3 adapters/opencv_solver.py", "python3 adapters/opencv_lenses_solver.py"]),
    ("SciPy", &["python3 adapters/scipy_solver.py"]),
    ("minimal solver", &["python3 adapters/minimal_solver.py"]),
];

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Program whose digits are counted [default: this library's solver, polished to the last digits]
    #[arg(long, value_name = "COMMAND")]
    solver: Option<String>,
    #[command(flatten)]
    copies: Copies,
    /// The only certified problem to put
    #[arg(long, value_name = "NAME")]
    problem: Option<String>,
    /// Digits that every certified problem must reach
    #[arg(long, value_name = "N", value_parser = digits)]
    least_digits: Option<f64>,
    /// Counts the digits of this library's solver and of the programs in adapters/, and writes the table as
    /// CSV
    #[arg(long, value_name = "FILE", conflicts_with_all = ["solver", "problem", "least_digits"])]
    digits: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
pub(super) struct TableArguments {
    /// Table that `calibench gate certified --digits` wrote
    #[arg(value_name = "FILE")]
    table: PathBuf,
}

fn digits(text: &str) -> Result<f64, String> {
    number_that(text, |_| true, "a number of digits")
}

/// Counts the digits of one solver, or of all for the table.
pub(super) fn run(arguments: &Arguments, build: &Build) -> Result<Exit, Stop> {
    arguments.copies.check()?;
    match &arguments.digits {
        Some(path) => write_table(arguments, path, build),
        None => count(arguments),
    }
}

/// Prints the digits of one solver. Without a program that is this library's: polished, and as it is with the
/// lens models that cannot be polished.
fn count(arguments: &Arguments) -> Result<Exit, Stop> {
    let problems = chosen(arguments)?;
    let mut table = DigitsTable::default();
    let measured = match &arguments.solver {
        Some(command) => {
            let solver = arguments.copies.process(command)?;
            let measured = measure(&problems, solver.as_ref());
            table.add(&solver.name(), &problems, &measured);
            measured
        }
        None => {
            let known = Polished.models();
            let is_polished = |p: &ReferenceProblem| known.contains(&p.problem.lens_model());
            let (polished, others): (Vec<_>, Vec<_>) = problems.iter().cloned().partition(is_polished);
            let each: [(&dyn Solver, _); 2] = [(&Polished, polished), (&Builtin, others)];
            let mut all = Vec::new();
            for (solver, problems) in each {
                let measured = measure(&problems, solver);
                table.add(&solver.name(), &problems, &measured);
                all.extend(measured);
            }
            all
        }
    };
    print(&table.to_text());
    verdict(arguments, &table, &measured)
}

/// Every problem of a lens model that the solver knows must be answered, with so many digits.
fn verdict(arguments: &Arguments, table: &DigitsTable, measured: &[Measured]) -> Result<Exit, Stop> {
    let is_known = |found: &Measured| !matches!(found, Err(NoDigits::UnknownModel(_)));
    if !measured.iter().any(is_known) {
        warn("nothing was asked: the solver knows none of these lens models");
        return Ok(Exit::Deviates);
    }
    let least_digits = arguments.least_digits.unwrap_or(0.0);
    let is_short = |found: &Measured| match found {
        Ok(digits) => digits.least() < least_digits,
        Err(why) => !matches!(why, NoDigits::UnknownModel(_)),
    };
    let failed: Vec<String> = table
        .rows
        .iter()
        .zip(measured)
        .filter(|(_, found)| is_short(found))
        .map(|(row, _)| format!("{} ({})", row.problem, row.result()))
        .collect();
    if failed.is_empty() {
        return Ok(Exit::Held);
    }
    let wanted = match least_digits {
        digits if digits > 0.0 => format!("not answered, or fewer than {digits} digits"),
        _ => "not answered".to_string(),
    };
    warn(&format!("{wanted}: {}", failed.join(", ")));
    Ok(Exit::Deviates)
}

/// Writes the digits of this library's solver, polished and as it is, and of the adapters' programs.
fn write_table(arguments: &Arguments, path: &Path, build: &Build) -> Result<Exit, Stop> {
    let project = Project::find().map_err(usage)?;
    std::env::set_current_dir(project.root()).map_err(incomplete)?;
    refuse_unwritable(path)?;
    let problems = chosen(arguments)?;
    let mut table = DigitsTable::default();
    table.add("calibench, polished", &problems, &measure(&problems, &Polished));
    table.add("calibench", &problems, &measure(&problems, &Builtin));
    for (name, commands) in PEERS {
        let programs = commands
            .iter()
            .map(|command| arguments.copies.process(command))
            .collect::<Result<Vec<_>, _>>()?;
        let programs: Vec<&dyn Solver> = programs.iter().map(AsRef::as_ref).collect();
        let measured = measure_in_turn(&problems, &programs);
        if measured.iter().all(Result::is_err) {
            let why = measured.first().and_then(|m| m.as_ref().err()).map(ToString::to_string);
            let why = why.unwrap_or_default();
            return Err(incomplete(format!(
                "{name} answered nothing ({why}): adapters/requirements.txt names what it needs"
            )));
        }
        table.add(name, &problems, &measured);
    }
    let commit = build.commit.as_ref().map_or("unknown".to_string(), ToString::to_string);
    let provenance = format!(
        "calibench gate certified --digits FILE --timeout {}; commit {commit}",
        arguments.copies.timeout
    );
    write_atomically(path, table.to_csv(&provenance).as_bytes()).map_err(incomplete)?;
    print(&table.to_markdown());
    Ok(Exit::Held)
}

/// Prints a table that was written before.
pub(super) fn print_table(TableArguments { table: path }: &TableArguments) -> Result<Exit, Stop> {
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
