//! What does a finished study say on standard output? A few lines for people, one object for programs;
//! everything stands in the report and the tables.

use super::Failure;
use crate::format::Format;
use crate::said::{print_as, written_by};
use calibench::io::{ShownPath, significant};
use calibench_harness::stopwatch::rate;
use calibench_study::{CellSummary, Engine, Estimated, Folder, Statistic, Summary};
use serde_json::{Value, json};
use std::path::Path;
use std::time::Duration;

/// What this call did of the study.
pub(super) struct Ran {
    pub trials: u64,
    pub took: Duration,
}

/// A study or a part of it, all of whose trials are done and whose files are written.
pub(super) struct Finished<'a> {
    pub folder: &'a Folder,
    pub engine: &'a Engine,
    pub summary: &'a Summary,
    /// `None` where trials came from elsewhere.
    pub ran: Option<Ran>,
}

impl Finished<'_> {
    /// Prints it.
    pub fn say(&self, format: Format) -> Result<(), Failure> {
        let manifest = self.folder.manifest()?;
        let files: Vec<&String> = manifest.files.keys().collect();
        print_as(format, || self.text(), || self.json(&files));
        Ok(())
    }

    fn text(&self) -> String {
        let mut text: String = self.summary.cells.iter().map(cell_text).collect();
        if let Some(precision) = &self.engine.spec.trials.precision {
            for cell in self.engine.imprecise() {
                text += &format!(
                    "{}: sd({}) is not known to {} % after {} trials\n",
                    cell.name,
                    precision.quantity,
                    significant(100.0 * precision.relative_half_width, 3),
                    self.engine.spec.trials.per_cell
                );
            }
        }
        let report: &Path = &self.folder.file("report.html");
        text += &format!("{} trials; written: {}\n", self.engine.trials(), report.shown());
        text + &self.ran.as_ref().map_or_else(String::new, ran_text)
    }

    fn json(&self, files: &[&String]) -> Value {
        json!({
            "written_by": written_by(),
            "study": self.engine.spec.name,
            "shard": self.engine.shard.to_string(),
            "folder": self.folder.path().display().to_string(),
            "written": files,
            "trials": self.engine.trials(),
            "confidence": self.summary.confidence,
            "cells": self.summary.cells.iter().map(cell_json).collect::<Vec<_>>(),
            "imprecise": self.engine.imprecise().iter().map(|cell| &cell.name).collect::<Vec<_>>(),
            "ran": self.ran.as_ref().map(|ran| json!({
                "trials": ran.trials,
                "seconds": ran.took.as_secs_f64(),
                "threads": rayon::current_num_threads(),
            })),
        })
    }
}

fn cell_text(cell: &CellSummary) -> String {
    let failed: Vec<String> =
        cell.outcomes.iter().filter(|o| o.0 != "converged").map(|o| format!("{} {}", o.1, o.0)).collect();
    let failed = if failed.is_empty() { String::new() } else { format!("; {}", failed.join(", ")) };
    let ratio = cell
        .statistics
        .iter()
        .filter(|s| s.quantity.is_error())
        .find_map(|s| Some((s.quantity, s.sd?, s.ratio?)));
    let spread = ratio.map_or_else(String::new, |(quantity, sd, ratio)| {
        format!(
            ": sd({}) = {} {} [{}, {}], {} of the bound",
            quantity.name(),
            significant(sd.value, 4),
            quantity.unit(),
            significant(sd.low, 4),
            significant(sd.high, 4),
            significant(ratio.value, 4)
        )
    });
    format!("{} ({} trials){spread}{failed}\n", cell.name, cell.trials)
}

fn cell_json(cell: &CellSummary) -> Value {
    let outcomes = cell.outcomes.iter().map(
        |(name, trials, share)| json!({ "outcome": name, "trials": trials, "share": estimated_json(share) }),
    );
    json!({
        "cell": cell.name,
        "trials": cell.trials,
        "outcomes": outcomes.collect::<Vec<_>>(),
        "quantities": cell.statistics.iter().map(statistic_json).collect::<Vec<_>>(),
    })
}

fn statistic_json(statistic: &Statistic) -> Value {
    let of = |estimated: &Option<Estimated>| estimated.as_ref().map(estimated_json);
    json!({
        "quantity": statistic.quantity.name(),
        "unit": statistic.quantity.unit(),
        "count": statistic.count,
        "mean": of(&statistic.mean),
        "sd": of(&statistic.sd),
        "rms": of(&statistic.rms),
        "predicted_sd": statistic.predicted.map(|expected| expected.sd),
        "ratio": of(&statistic.ratio),
    })
}

/// An estimate with its interval.
pub(super) fn estimated_json(estimated: &Estimated) -> Value {
    json!({ "value": estimated.value, "low": estimated.low, "high": estimated.high })
}

fn ran_text(ran: &Ran) -> String {
    let rate = rate(ran.trials, ran.took).map_or_else(String::new, |rate| format!(": {rate:.0} a second"));
    let (seconds, threads) = (ran.took.as_secs_f64(), rayon::current_num_threads());
    format!("{} trials in {seconds:.1} s{rate} on {threads} thread(s)\n", ran.trials)
}
