//! `calibench bless ID`: the present result becomes the golden snapshot. Claims are not touched: one that
//! fails stays failed.

use super::format::Format;
use super::said::written_by;
use super::{Exit, find, print, warn};
use calibench::io::write_atomically;
use calibench_harness::project::Project;
use calibench_harness::verdict::{self, Verdict};
use calibench_harness::{Build, Context, Experiment, ProgressDisplay, emit, golden};
use serde_json::{Value, json};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Name of the experiment
    #[arg(required_unless_present = "all", conflicts_with = "all")]
    id: Option<String>,
    /// Blesses every experiment
    #[arg(long)]
    all: bool,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
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
    let mut blessed = Vec::new();
    let mut bless_one = |experiment: &Experiment| {
        let done = bless(experiment, &project, build)?;
        match arguments.format {
            Format::Text => print(&done.text()),
            Format::Json => blessed.push(done.json()),
        }
        Ok(if done.verdict.held() { Exit::Held } else { Exit::Deviates })
    };
    let exits: Vec<Result<Exit, Exit>> = chosen.iter().map(&mut bless_one).collect();
    if arguments.format == Format::Json {
        print(&format!("{:#}\n", json!({ "written_by": written_by(), "blessed": blessed })));
    }
    exits.into_iter().map(|exit| exit.unwrap_or_else(|failed| failed)).max().unwrap_or(Exit::Held)
}

/// An experiment whose present result is golden now.
struct Blessed {
    id: &'static str,
    /// The snapshot.
    path: PathBuf,
    is_changed: bool,
    /// Numbers that moved, beyond their bands or within.
    changes: Vec<String>,
    /// What claims and published values say.
    verdict: Verdict,
}

impl Blessed {
    fn text(&self) -> String {
        let headline =
            if self.is_changed { "blessed; say in the commit what moved and why" } else { "unchanged" };
        let changes: String = self.changes.iter().map(|change| format!("  {change}\n")).collect();
        let details = super::report::details(std::slice::from_ref(&self.verdict));
        format!("{}: {headline}\n{changes}{details}", self.id)
    }

    fn json(&self) -> Value {
        json!({
            "experiment": self.id,
            "written": [self.path.display().to_string()],
            "changed": self.is_changed,
            "changes": self.changes,
            "held": self.verdict.held(),
        })
    }
}

fn bless(experiment: &Experiment, project: &Project, build: &Build) -> Result<Blessed, Exit> {
    let id = experiment.id;
    let context = Context::of(experiment).with_progress(ProgressDisplay::stderr());
    let run = verdict::run(experiment, &context);
    let record = match &run.result {
        Ok(record) => record,
        Err(error) => {
            warn(&format!("{id}: {error}; nothing was blessed"));
            return Err(Exit::of_failure(error));
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
        return Err(Exit::Incomplete);
    }
    let changes = comparison.deviations.iter().chain(&comparison.drift);
    Ok(Blessed {
        id,
        path,
        is_changed: before != after,
        changes: changes.map(|change| change.to_string()).collect(),
        verdict: Verdict::of(record, Some(&after), true),
    })
}
