//! The whole measurement: all trials of a truth, or of every truth, and what is committed of them.

use super::layout::{LAYOUTS, Layout};
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
    /// Makes every eighth trial again instead, and notes in the tables that its rows are the same if they
    /// are: for a change of the code that should move nothing
    #[arg(long)]
    confirm: bool,
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
    truths.into_iter().try_for_each(|truth| match arguments.confirm {
        true => confirm(truth, &arguments.out),
        false => write(truth, &arguments.out),
    })
}

fn table_of(truth: &Truth, folder: &Path) -> PathBuf {
    folder.join(format!("{}.csv", truth.name))
}

fn confirm(truth: &Truth, folder: &Path) -> Result<(), String> {
    let present = Fingerprint::of_model_choice();
    let every = jobs(truth).into_iter().skip(present.pick(campaign::EVERY)).step_by(campaign::EVERY);
    let again: Vec<String> = measured(truth, every.collect())?.iter().map(Row::text).collect();
    campaign::confirm(&table_of(truth, folder), &present, &again)
}

fn write(truth: &Truth, folder: &Path) -> Result<(), String> {
    let path = table_of(truth, folder);
    let (present, command) = (Fingerprint::of_model_choice(), format!("{COMMAND}; seed {SEED}"));
    let table = || Ok(campaign::table(HEADER, measured(truth, jobs(truth))?.iter().map(Row::text)));
    campaign::write_unless_current(&path, &present, &command, table)
}

/// All trials of a truth, the longest first so that no processor is left with one of them at the end.
fn jobs(truth: &Truth) -> Vec<(Layout, u64)> {
    let of = |layout: &'static Layout| (0..layout.trials(truth)).map(move |trial| (*layout, trial));
    LAYOUTS.iter().rev().flat_map(of).collect()
}

/// Some trials of a truth; rows in order.
fn measured(truth: &Truth, jobs: Vec<(Layout, u64)>) -> Result<Vec<Row>, String> {
    let progress = ProgressDisplay::stderr().start(truth.name, jobs.len());
    let trial = |&(layout, trial): &(Layout, u64)| {
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
