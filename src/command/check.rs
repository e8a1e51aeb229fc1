//! `calibench check`: does everything still hold? Runs all and compares, but writes nothing.

use super::report::{details, reconciliation_table};
use super::reproduce::{exit_of, judge_all};
use super::terminal::warn_lines;
use super::{Exit, find, print, warn};
use calibench_book::Finding;
use calibench_harness::project::Project;
use calibench_harness::published::Kind;
use calibench_harness::verdict::{self, Golden, Run, Verdict};
use calibench_harness::{Context, Experiment, ProgressDisplay, Record, published};
use rayon::prelude::*;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs;

/// How the outcome is printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// A table for people
    Text,
    /// One JSON object
    Json,
}

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Names of experiments; without any, everything is checked, the book with it
    ids: Vec<String>,
    /// How the outcome is printed
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
    /// Fails also where a number moved by a bit within its band
    #[arg(long)]
    bits: bool,
}

pub(super) fn run(experiments: &[Experiment], arguments: &Arguments) -> Exit {
    let project = match Project::find() {
        Ok(project) => project,
        Err(error) => {
            warn(&error.to_string());
            return Exit::Usage;
        }
    };
    let chosen = arguments.ids.iter().map(|id| find(experiments, id).copied());
    let chosen: Vec<Experiment> = match chosen.collect::<Result<Vec<_>, Exit>>() {
        Ok(chosen) if chosen.is_empty() => experiments.to_vec(),
        Ok(chosen) => chosen,
        Err(exit) => return exit,
    };
    let display = ProgressDisplay::stderr();
    let runs: Vec<Run> =
        chosen.par_iter().map(|e| verdict::run(e, &Context::of(e).with_progress(display.clone()))).collect();
    let mut verdicts = judge_all(&runs, &project);
    for (run, verdict) in runs.iter().zip(&mut verdicts) {
        if let (Ok(record), Some(verdict)) = (&run.result, verdict.as_mut()) {
            verdict.deviations.extend(stale_figures(record, &project));
            verdict.deviations.extend(unreconciled(record));
            if arguments.bits {
                verdict.deviations.append(&mut verdict.drift);
            }
        }
    }
    let records: Vec<&Record> = runs.iter().filter_map(|run| run.result.as_ref().ok()).collect();
    // The book quotes every experiment: some of them cannot vouch for it.
    let findings = if arguments.ids.is_empty() {
        calibench_book::check(&project, experiments, &records)
    } else {
        Vec::new()
    };
    print_outcome(&runs, &verdicts, &findings, arguments.format)
}

fn print_outcome(runs: &[Run], verdicts: &[Option<Verdict>], findings: &[Finding], format: Format) -> Exit {
    let failed = |run: &Run| run.result.as_ref().err().map(|e| format!("FAILED {}: {e}", run.experiment.id));
    let failures: Vec<String> = runs.iter().filter_map(failed).collect();
    let judged: Vec<Verdict> = verdicts.iter().flatten().cloned().collect();
    let book = if findings.is_empty() { Exit::Held } else { Exit::Deviates };
    let exit = exit_of(&judged, !failures.is_empty()).max(book);
    match format {
        Format::Text => {
            print(&reconciliation_table(runs, verdicts));
            print(&details(&judged));
            print(&super::book::findings_text(findings));
        }
        Format::Json => {
            let experiments: Vec<Value> = judged.iter().map(verdict_json).collect();
            let book: Vec<String> = findings.iter().map(ToString::to_string).collect();
            let report = json!({
                "outcome": exit.name(), "experiments": experiments, "failures": failures, "book": book,
            });
            print(&format!("{report:#}\n"));
        }
    }
    failures.iter().for_each(|failure| warn_lines(failure));
    exit
}

/// A verdict with its counts.
pub(super) fn verdict_json(verdict: &Verdict) -> Value {
    let golden = match verdict.golden {
        Golden::Compared(t) => json!({"held": t.held, "total": t.total}),
        Golden::Skipped(reason) => json!({"skipped": reason}),
        Golden::Missing => json!("missing"),
    };
    let by_kind: serde_json::Map<String, Value> = Kind::ALL
        .into_iter()
        .map(|kind| {
            let counts = verdict.published.of(kind);
            (kind.name().to_string(), json!({"held": counts.held, "total": counts.total}))
        })
        .collect();
    json!({
        "experiment": verdict.experiment,
        "held": verdict.held(),
        "golden": golden,
        "claims": {"held": verdict.claims.held, "total": verdict.claims.total},
        "published": by_kind,
        "deviations": verdict.deviations,
        "drift": verdict.drift,
    })
}

/// Committed figures that are not what the experiment draws now: changed, missing, or drawn by nobody.
fn stale_figures(record: &Record, project: &Project) -> Vec<String> {
    let id = record.experiment();
    let mut stale = Vec::new();
    let mut drawn = BTreeSet::new();
    for figure in record.figures() {
        let name = figure.file_name();
        let committed = project.read(&format!("figures/{id}/{name}"));
        match committed {
            Ok(bytes) if !figure.reproducible || bytes == figure.bytes => {}
            Ok(_) => {
                stale.push(format!("figure figures/{id}/{name} is out of date: run `calibench run {id}`"))
            }
            Err(_) => stale.push(format!("figure figures/{id}/{name} is missing: run `calibench run {id}`")),
        }
        drawn.insert(name);
    }
    if !project.is_source_tree() {
        return stale;
    }
    let names = fs::read_dir(project.figures(id)).into_iter().flatten().flatten();
    let mut strays: Vec<String> = names.map(|f| f.file_name().to_string_lossy().into_owned()).collect();
    strays.retain(|name| !drawn.contains(name));
    strays.sort();
    stale.extend(
        strays.iter().map(|name| format!("figure figures/{id}/{name} is drawn by no run: delete it")),
    );
    stale
}

/// Published values of this experiment that its record does not reconcile.
fn unreconciled(record: &Record) -> Vec<String> {
    let entries = match published::chapter() {
        Ok(entries) => entries,
        Err(error) => return vec![error.to_string()],
    };
    entries
        .iter()
        .filter(|e| e.experiment() == record.experiment() && e.kind != Kind::CannotBeJudged)
        .filter(|e| record.reconciliations().iter().all(|r| r.entry.id != e.id))
        .map(|e| format!("published {} ({}) is not reconciled", e.id, e.what))
        .collect()
}
