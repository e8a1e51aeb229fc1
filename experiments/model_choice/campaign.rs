//! The whole measurement: all trials of a truth, or of every truth, and what is committed of them.

use super::layout::LAYOUTS;
use super::row::{HEADER, Row};
use super::trial::Photographs;
use super::truths::{TRUTHS, Truth};
use super::{COMMAND, SEED};
use calibench_harness::fingerprint::Fingerprint;
use calibench_harness::{ProgressDisplay, campaign};
use clap::Parser;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Where the committed lines stand, from the root of the project.
pub const FOLDER: &str = "golden/model-choice";

/// Fits every candidate to the trials of the experiment model-choice, and writes a table a truth to
/// golden/model-choice/.
///
/// A table that the present code wrote is left as it is: an interrupted run goes on where it was.
#[derive(Debug, Parser)]
struct Arguments {
    /// A truth; all without it
    truth: Option<String>,
    /// Writes there instead
    #[arg(long, default_value = FOLDER)]
    out: PathBuf,
}

/// The command.
pub fn main() -> ExitCode {
    campaign::exit_code(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let wanted = |truth: &&Truth| arguments.truth.as_deref().is_none_or(|name| name == truth.name);
    let truths: Vec<&Truth> = TRUTHS.iter().filter(wanted).collect();
    if truths.is_empty() {
        let names: Vec<&str> = TRUTHS.iter().map(|truth| truth.name).collect();
        return Err(format!("no truth of that name; there are: {}", names.join(", ")));
    }
    truths.into_iter().try_for_each(|truth| write(truth, &arguments.out))
}

fn write(truth: &Truth, folder: &Path) -> Result<(), String> {
    let path = folder.join(format!("{}.csv", truth.name));
    let head = Fingerprint::of_model_choice().head(&format!("{COMMAND}; seed {SEED}"));
    let table = || Ok(campaign::table(HEADER, measured(truth)?.iter().map(Row::text)));
    campaign::write_unless_current(&path, &head, table)
}

/// All trials of a truth, the longest first so that no processor is left with one of them at the end; rows in
/// order.
fn measured(truth: &Truth) -> Result<Vec<Row>, String> {
    let jobs =
        LAYOUTS.iter().rev().flat_map(|layout| (0..layout.trials(truth)).map(move |trial| (*layout, trial)));
    let jobs: Vec<_> = jobs.collect();
    let progress = ProgressDisplay::stderr().start(truth.name, jobs.len());
    let trial = |&(layout, trial): &(super::layout::Layout, u64)| {
        let photographs = Photographs::new(truth, layout, SEED, trial);
        let rows = photographs.map(|photographs| photographs.rows());
        progress.step();
        rows.ok_or_else(|| format!("{}: the board of {} marks does not fit", truth.name, layout.marks()))
    };
    let rows: Result<Vec<Vec<Row>>, String> = jobs.par_iter().with_max_len(1).map(trial).collect();
    let mut rows: Vec<Row> = rows?.into_iter().flatten().collect();
    rows.sort_by_key(|row| (row.marks, row.trial, row.candidate));
    Ok(rows)
}
