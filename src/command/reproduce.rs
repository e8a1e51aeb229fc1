//! `calibench` alone: everything is run, written, and reconciled in one table.

use super::report::{details, reconciliation_table};
use super::terminal::warn_lines;
use super::{Exit, print, warn};
use calibench_harness::project::Project;
use calibench_harness::verdict::{self, Run, Verdict};
use calibench_harness::{Build, Context, Experiment, ProgressDisplay, Record, emit};
use rayon::prelude::*;
use std::io;

pub(super) fn run(experiments: &[Experiment], build: &Build) -> Exit {
    let project = match Project::find() {
        Ok(project) => project,
        Err(error) => {
            warn(&error.to_string());
            return Exit::Usage;
        }
    };
    let display = ProgressDisplay::stderr();
    let finished: Vec<(Run, io::Result<()>)> = experiments
        .par_iter()
        .map(|experiment| {
            let run = verdict::run(experiment, &Context::of(experiment).with_progress(display.clone()));
            let written = write(&run, &project, build);
            (run, written)
        })
        .collect();
    let (runs, written): (Vec<Run>, Vec<_>) = finished.into_iter().unzip();
    let verdicts = judge_all(&runs, &project);
    print(&reconciliation_table(&runs, &verdicts));
    let failures = failures(&runs, written);
    let judged: Vec<Verdict> = verdicts.into_iter().flatten().collect();
    print(&details(&judged));
    failures.iter().for_each(|failure| warn_lines(failure));
    let records: Vec<&Record> = runs.iter().filter_map(|run| run.result.as_ref().ok()).collect();
    let book = super::book::build_of(&project, experiments, &records, build);
    exit_of(&judged, !failures.is_empty()).max(book)
}

/// Each experiment is written as soon as it is finished: an interruption keeps what is done.
fn write(run: &Run, project: &Project, build: &Build) -> io::Result<()> {
    match &run.result {
        Ok(record) => {
            emit(&run.experiment, record, &project.out(), &project.figures(run.experiment.id), build)
        }
        Err(_) => Ok(()),
    }
}

/// The verdict of every run that has a record.
pub(super) fn judge_all(runs: &[Run], project: &Project) -> Vec<Option<Verdict>> {
    let judge = |run: &Run| {
        let record = run.result.as_ref().ok()?;
        let snapshot = project.snapshot_text(run.experiment.id);
        Some(Verdict::of(record, snapshot.as_deref(), run.locked))
    };
    runs.iter().map(judge).collect()
}

/// What has no record, and what could not be written.
fn failures(runs: &[Run], written: Vec<io::Result<()>>) -> Vec<String> {
    let no_record = runs.iter().filter_map(|run| {
        let error = run.result.as_ref().err()?;
        Some(format!("FAILED {}: {error}", run.experiment.id))
    });
    no_record.chain(written.into_iter().filter_map(Result::err).map(|e| e.to_string())).collect()
}

/// Incomplete before deviating: what is missing cannot have been judged.
pub(super) fn exit_of(verdicts: &[Verdict], incomplete: bool) -> Exit {
    if incomplete {
        Exit::Incomplete
    } else if verdicts.iter().all(Verdict::held) {
        Exit::Held
    } else {
        Exit::Deviates
    }
}
