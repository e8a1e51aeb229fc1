//! What does an explanation draw on? The project, the experiments, and what the book is made from.

use super::super::Exit;
use calibench_book::Sources;
use calibench_harness::project::Project;
use calibench_harness::{Context, Experiment, Record, golden};

/// What an explanation draws on.
pub(super) struct Known<'a> {
    pub project: Project,
    pub experiments: &'a [Experiment],
    pub sources: Sources,
}

impl Known<'_> {
    /// The value of a number that golden/ locks.
    pub fn locked_value(&self, experiment: &str, own: &str) -> Option<f64> {
        let snapshot = self.project.snapshot_text(experiment)?;
        let line = format!("number | {own} | ");
        let value = golden::contents(&snapshot).lines().find_map(|text| text.strip_prefix(&line))?;
        value.split(" | ").next()?.parse().ok()
    }
}

/// The record of the locked run.
pub(super) fn record_of(experiment: &Experiment) -> Result<Record, (Exit, String)> {
    let record = experiment.execute(&Context::of(experiment));
    record.map_err(|error| (Exit::of_failure(&error), format!("{}: {error}", experiment.id)))
}
