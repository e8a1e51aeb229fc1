//! `calibench book`: the book alone, from the last run; what the last run lacks is run.

use super::format::Format;
use super::said::{print_as, written_by};
use super::terminal::warn_lines;
use super::{Exit, warn};
use calibench::io::ShownPath;
use calibench_book::{Evidence, Finding, Sources};
use calibench_harness::project::Project;
use calibench_harness::{Build, Context, Experiment, ProgressDisplay, Record, emit, verdict};
use rayon::prelude::*;
use serde_json::json;
use std::path::Path;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Opens it in the browser
    #[arg(long)]
    open: bool,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

pub(super) fn run(experiments: &[Experiment], arguments: &Arguments, build: &Build) -> Exit {
    let project = match Project::find() {
        Ok(project) => project,
        Err(error) => {
            warn(&error.to_string());
            return Exit::Usage;
        }
    };
    let (_, stale) = Evidence::of_last_run(&project, experiments);
    let missing: Vec<&Experiment> =
        experiments.iter().filter(|e| stale.iter().any(|id| id == e.id)).collect();
    let ran = missing.par_iter().map(|experiment| run_one(experiment, &project, build)).max();
    let (evidence, _) = Evidence::of_last_run(&project, experiments);
    let exit = write(&project, evidence, arguments.format).max(ran.unwrap_or(Exit::Held));
    if arguments.open {
        open(&calibench_book::index_of(&project.out().join("book")));
    }
    exit
}

/// Runs what the last run lacks.
fn run_one(experiment: &Experiment, project: &Project, build: &Build) -> Exit {
    let context = Context::of(experiment).with_progress(ProgressDisplay::stderr());
    let run = verdict::run(experiment, &context);
    let written = match &run.result {
        Ok(record) => emit(experiment, record, &project.out(), &project.figures(experiment.id), build)
            .map_err(|e| e.to_string()),
        Err(error) => Err(format!("FAILED {}: {error}", experiment.id)),
    };
    written.map_or_else(
        |message| {
            warn(&message);
            Exit::Incomplete
        },
        |()| Exit::Held,
    )
}

/// Builds the book of records in memory: the last step of `calibench` alone.
pub(super) fn build_of(
    project: &Project,
    experiments: &[Experiment],
    records: &[&Record],
    build: &Build,
) -> Exit {
    write(project, Evidence::of_records(project, experiments, records, build), Format::Text)
}

/// Writes out/book and tells what does not resolve.
fn write(project: &Project, evidence: Evidence, format: Format) -> Exit {
    let compiled = match Sources::load(project, evidence) {
        Ok(sources) => calibench_book::compile(&sources),
        Err(finding) => {
            warn_lines(&finding.to_string());
            return Exit::Incomplete;
        }
    };
    let folder = project.out().join("book");
    if let Err(error) = calibench_book::build(project, &compiled, &folder) {
        warn(&error.to_string());
        return Exit::Incomplete;
    }
    let index = calibench_book::index_of(&folder);
    let text = || format!("book: {}\n{}", index.shown(), findings_text(&compiled.findings));
    print_as(format, text, || {
        json!({
            "written_by": written_by(),
            "written": [index.display().to_string()],
            "findings": compiled.findings.iter().map(Finding::to_string).collect::<Vec<_>>(),
        })
    });
    if compiled.findings.is_empty() { Exit::Held } else { Exit::Deviates }
}

/// One line a finding.
pub(super) fn findings_text(findings: &[Finding]) -> String {
    findings.iter().map(|finding| format!("book: {finding}\n")).collect()
}

/// Hands the page to the desktop. Where there is none, the path that was printed has to do.
fn open(page: &Path) {
    let opener = if cfg!(target_os = "macos") {
        "open"
    } else if cfg!(target_os = "windows") {
        "explorer"
    } else {
        "xdg-open"
    };
    if let Err(error) = std::process::Command::new(opener).arg(page).spawn() {
        warn(&format!("cannot open {} with {opener}: {error}", page.shown()));
    }
}
