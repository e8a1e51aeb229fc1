//! The whole measurement: all scenes of a family, or of every family, and what is committed of them.

use super::families::{FAMILIES, Family, SCENES};
use super::judged::{HEADER, Line, judged};
use super::{COMMAND, SEED};
use crate::global_minimum::judged::Class;
use calibench_harness::fingerprint::Fingerprint;
use calibench_harness::{ProgressDisplay, campaign};
use clap::Parser;
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Where the committed lines stand, from the root of the project.
pub const FOLDER: &str = "golden/lens-minimum";

/// Judges the scenes of the experiment lens-minimum, and writes a table a model to golden/lens-minimum/.
///
/// A table that the present code wrote is left as it is: an interrupted run goes on where it was.
#[derive(Debug, Parser)]
struct Arguments {
    /// A lens model; all without it
    model: Option<String>,
    /// Writes there instead
    #[arg(long, default_value = FOLDER)]
    out: PathBuf,
    /// Draws other scenes
    #[arg(long, default_value_t = SEED)]
    seed: u64,
    /// Makes every eighth row again instead, and notes in the tables that they are the same if they are: for
    /// a change of the code that should move nothing
    #[arg(long, conflicts_with = "seed")]
    confirm: bool,
}

/// The command.
pub fn main() -> ExitCode {
    campaign::exit_code(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let wanted = |family: &&Family| arguments.model.as_deref().is_none_or(|name| name == family.name());
    let families: Vec<&'static Family> = FAMILIES.iter().filter(wanted).collect();
    if families.is_empty() {
        let names: Vec<&str> = FAMILIES.iter().map(Family::name).collect();
        return Err(format!("no scenes of that model; there are: {}", names.join(", ")));
    }
    families.into_iter().try_for_each(|family| match arguments.confirm {
        true => confirm(family, &arguments.out),
        false => write(family, arguments.seed, &arguments.out),
    })
}

fn table_of(family: &Family, folder: &Path) -> PathBuf {
    folder.join(format!("{}.csv", family.name()))
}

fn confirm(family: &'static Family, folder: &Path) -> Result<(), String> {
    let present = Fingerprint::of_lens_minimum();
    let every = (0..SCENES).skip(present.pick(campaign::EVERY)).step_by(campaign::EVERY);
    let again: Vec<String> = lines(family, SEED, every.collect())?.iter().map(Line::text).collect();
    campaign::confirm(&table_of(family, folder), &present, &again)
}

fn write(family: &'static Family, seed: u64, folder: &Path) -> Result<(), String> {
    let path = table_of(family, folder);
    let (present, command) = (Fingerprint::of_lens_minimum(), format!("{COMMAND}; seed {seed}"));
    campaign::write_unless_current(&path, &present, &command, || measured(family, seed))
}

/// Draws and judges some scenes.
fn lines(family: &'static Family, seed: u64, scenes: Vec<u64>) -> Result<Vec<Line>, String> {
    let progress = ProgressDisplay::stderr().start(family.name(), scenes.len());
    let line = |index: u64| {
        let line = judged(family, seed, index);
        progress.step();
        line.ok_or_else(|| format!("{}: no scene {index} can be drawn", family.name()))
    };
    scenes.into_par_iter().map(line).collect()
}

#[allow(clippy::print_stdout, reason = "the command's answer")]
fn measured(family: &'static Family, seed: u64) -> Result<String, String> {
    let lines = lines(family, seed, (0..SCENES).collect())?;
    let of = |class: Class| format!("{class} {}", lines.iter().filter(|line| line.class == class).count());
    println!("{}: {}", family.name(), Class::ALL.map(of).join(", "));
    Ok(campaign::table(HEADER, lines.iter().map(Line::text)))
}
