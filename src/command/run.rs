//! `calibench run ID`, and the own binary of every experiment: one run, its files, its verdict.

use super::check::verdict_json;
use super::format::Format;
use super::report::{details, summary};
use super::terminal::{self, warn_lines};
use super::{Exit, find, print, warn};
use calibench::io::ShownPath;
use calibench_harness::project::Project;
use calibench_harness::resources::{peak_memory_mib, processor_seconds};
use calibench_harness::verdict::{self, Run, Verdict};
use calibench_harness::{Build, Context, Experiment, ProgressDisplay, Record, emit, record_json};
use clap::{Args, CommandFactory, FromArgMatches, Parser};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// What a run can be told.
#[derive(Debug, Args)]
struct Options {
    /// Seed of the random streams; golden values hold for the default seed only [default: the experiment's
    /// own]
    #[arg(long, value_name = "N", value_parser = super::said::whole::<u64>)]
    seed: Option<u64>,
    /// Folder for tables, record and figures [default: out/, with the figures of the locked run in figures/]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Image in place of the experiment's own, for experiments that take one
    #[arg(long, value_name = "FILE")]
    image: Option<PathBuf>,
    /// The record as text for people, or with verdict and cost as JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Name of the experiment, as `calibench list` gives it
    id: String,
    #[command(flatten)]
    options: Options,
}

/// Arguments of an experiment's own binary.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 100, after_help = Exit::HELP)]
struct OwnArguments {
    #[command(flatten)]
    options: Options,
}

pub(super) fn run(experiments: &[Experiment], arguments: &Arguments, build: &Build) -> Exit {
    match find(experiments, &arguments.id) {
        Ok(experiment) => run_one(experiment, &arguments.options, build),
        Err(exit) => exit,
    }
}

pub(super) fn main_for(experiment: &Experiment, build: &Build) -> Exit {
    let about = format!("{}\n\n{}", experiment.title, experiment.question);
    let command = OwnArguments::command().name(experiment.id).about(about);
    let parsed = command.try_get_matches().and_then(|matches| OwnArguments::from_arg_matches(&matches));
    match parsed {
        Ok(arguments) => run_one(experiment, &arguments.options, build),
        Err(error) => terminal::usage(&error),
    }
}

fn run_one(experiment: &Experiment, options: &Options, build: &Build) -> Exit {
    if options.image.is_some() && !experiment.takes_image {
        warn(&format!("experiment `{}` takes no image", experiment.id));
        return Exit::Usage;
    }
    let context = Context::of(experiment)
        .with_seed(options.seed.unwrap_or(experiment.seed))
        .with_image(options.image.clone())
        .with_progress(ProgressDisplay::stderr());
    let project = Project::find().ok();
    let run = verdict::run(experiment, &context);
    let record = match &run.result {
        Ok(record) => record,
        Err(error) => {
            warn_lines(&format!("{}: {error}", experiment.id));
            return Exit::of_failure(error);
        }
    };
    let (out, figures) = places(&run, options.out.as_deref(), project.as_ref());
    if let Err(error) = emit(experiment, record, &out, &figures, build) {
        warn(&error.to_string());
        return Exit::Incomplete;
    }
    let snapshot = project.as_ref().and_then(|p| p.snapshot_text(experiment.id));
    let verdict = Verdict::of(record, snapshot.as_deref(), run.locked && project.is_some());
    match options.format {
        Format::Text => {
            print(&summary(record));
            let written = out.join(experiment.id);
            print(&format!("\nwritten: {} and {}\n", written.shown(), figures.shown()));
            print(&details(std::slice::from_ref(&verdict)));
        }
        Format::Json => print(&format!("{:#}\n", as_json(record, &verdict, &run, build))),
    }
    if verdict.held() { Exit::Held } else { Exit::Deviates }
}

/// The record, the verdict, and what the run took of this process.
fn as_json(record: &Record, verdict: &Verdict, run: &Run, build: &Build) -> Value {
    json!({
        "record": record_json(record, build),
        "verdict": verdict_json(verdict),
        "cost": {
            "seconds": run.took.as_secs_f64(),
            "processor_seconds": processor_seconds(),
            "peak_memory_mib": peak_memory_mib(),
        },
    })
}

/// Where tables and figures go. Committed figures are drawn by the locked run only.
fn places(run: &Run, out: Option<&Path>, project: Option<&Project>) -> (PathBuf, PathBuf) {
    let id = run.experiment.id;
    match (out, project) {
        (None, Some(project)) if run.locked => (project.out(), project.figures(id)),
        (None, Some(project)) => (project.out(), project.out().join(id).join("figures")),
        (None, None) => (PathBuf::from("out"), Path::new("out").join(id).join("figures")),
        (Some(out), _) => (out.to_path_buf(), out.join(id).join("figures")),
    }
}
