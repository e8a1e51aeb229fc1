//! `calibench bless ID`: the present result becomes the golden snapshot. Claims are not touched: one that
//! fails stays failed.

use super::{Exit, find, print, warn};
use calibench::io::write_atomically;
use calibench_harness::project::Project;
use calibench_harness::{Build, Context, Experiment, ProgressDisplay, emit, golden, verdict};

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Name of the experiment
    #[arg(required_unless_present = "all", conflicts_with = "all")]
    id: Option<String>,
    /// Blesses every experiment
    #[arg(long)]
    all: bool,
}

pub(super) fn run(experiments: &[Experiment], arguments: &Arguments, build: &Build) -> Exit {
    let chosen = match &arguments.id {
        None => experiments.to_vec(),
        Some(id) => match find(experiments, id) {
            Ok(experiment) => vec![*experiment],
            Err(exit) => return exit,
        },
    };
    let project = match Project::here() {
        Ok(project) => project,
        Err(error) => {
            warn(&error.to_string());
            return Exit::Usage;
        }
    };
    chosen.iter().map(|experiment| bless(experiment, &project, build)).max().unwrap_or(Exit::Held)
}

fn bless(experiment: &Experiment, project: &Project, build: &Build) -> Exit {
    let id = experiment.id;
    let context = Context::of(experiment).with_progress(ProgressDisplay::stderr());
    let run = verdict::run(experiment, &context);
    let record = match &run.result {
        Ok(record) => record,
        Err(error) => {
            warn(&format!("{id}: {error}; nothing was blessed"));
            return Exit::of_failure(error);
        }
    };
    let path = project.snapshot(id);
    let before = project.snapshot_text(id).unwrap_or_default();
    let after = golden::file_text(record);
    let comparison = golden::compare(golden::contents(&before), golden::contents(&after));
    let written = emit(experiment, record, &project.out(), &project.figures(id), build)
        .and_then(|()| write_atomically(&path, after.as_bytes()));
    if let Err(error) = written {
        warn(&error.to_string());
        return Exit::Incomplete;
    }
    let changes = comparison.deviations.iter().chain(&comparison.drift);
    let changes: String = changes.map(|change| format!("  {change}\n")).collect();
    let headline =
        if before == after { "unchanged" } else { "blessed; say in the commit what moved and why" };
    print(&format!("{id}: {headline}\n{changes}"));
    let verdict = verdict::Verdict::of(record, Some(&after), true);
    print(&super::report::details(std::slice::from_ref(&verdict)));
    if verdict.held() { Exit::Held } else { Exit::Deviates }
}
