//! A solver's report, taken and told: of one that is asked now, or of answers in a folder.

use super::super::format::Format;
use super::super::said::unless_unwritten;
use super::super::terminal::warn_lines;
use super::super::{Exit, print, warn};
use super::options::{Judgement, Reports};
use super::{Stop, of_files};
use calibench::io::{ShownPath, keep_files, write_atomically};
use calibench_gate::files::{self, Recorded};
use calibench_gate::{Plan, Report, Solver};
use calibench_harness::{Build, ProgressDisplay};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Asks every problem of the plan, showing progress.
pub(super) fn asked(
    judgement: &Judgement,
    plan: &Plan,
    solver: &dyn Solver,
    build: &Build,
) -> Result<Report, Stop> {
    // A mistake in a file is told before anything is asked.
    let terms = judgement.terms()?;
    let progress = ProgressDisplay::stderr().start("gate", plan.cases.len());
    let started = Instant::now();
    let seen = calibench_gate::run(plan, solver, &|done| progress.advance(done));
    let seconds = started.elapsed().as_secs_f64();
    let report = Report::new(plan, &solver.name(), &seen, &terms, seconds);
    Ok(report.with_program_ends(solver.finish()).with_commit(build.commit.as_ref()))
}

/// A report in one form, and where it goes if it is wanted.
type Output<'a> = (&'a Option<PathBuf>, fn(&Report) -> String);

/// Tells what a report says, in all forms that are asked for: where one cannot be written, the others are.
pub(super) fn told(reports: &Reports, report: &Report) -> Exit {
    match reports.told.format {
        Format::Text => print(&report.to_text(columns())),
        Format::Json => print(&report.to_json()),
    }
    if !report.held() {
        warn_lines(&report.details());
    }
    let outputs: [Output<'_>; 3] = [
        (&reports.told.json, Report::to_json),
        (&reports.junit, Report::to_junit),
        (&reports.html, Report::to_html),
    ];
    let exit = if report.held() { Exit::Held } else { Exit::Deviates };
    outputs.into_iter().fold(exit, |exit, (path, text)| match path {
        Some(path) => unless_unwritten(write_atomically(path, text(report).as_bytes()), exit),
        None => exit,
    })
}

/// Problems and answers of a folder, with a word on what in it answers none of them.
pub(super) fn recorded(folder: &Path) -> Result<(Plan, Recorded), Stop> {
    let (plan, answers) = files::recorded(folder).map_err(of_files)?;
    if let Some(stray) = answers.stray() {
        warn(&format!("not all lines are answers to the problems of {}: {stray}", folder.shown()));
    }
    Ok((plan, answers))
}

/// Keeps the answers of a folder, which are judged, from being replaced by a report on them.
pub(super) fn keep_recorded(folder: &Path) {
    for folder in [folder.to_path_buf(), folder.join("answers")] {
        let files: Vec<PathBuf> =
            std::fs::read_dir(folder).into_iter().flatten().flatten().map(|f| f.path()).collect();
        keep_files(files.iter().map(PathBuf::as_path));
    }
}

/// Characters in a line: what the shell says, else what most terminals have; a file gets the whole.
fn columns() -> usize {
    let asked = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    let most =
        if std::io::stdout().is_terminal() { TERMINAL_COLUMNS } else { calibench_gate::report::COLUMNS };
    asked.unwrap_or(most)
}

/// Characters in a line of a terminal that does not say.
const TERMINAL_COLUMNS: usize = 100;
