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
    families.into_iter().try_for_each(|family| write(family, arguments.seed, &arguments.out))
}

fn write(family: &'static Family, seed: u64, folder: &Path) -> Result<(), String> {
    let path = folder.join(format!("{}.csv", family.name()));
    let head = Fingerprint::of_lens_minimum().head(&format!("{COMMAND}; seed {seed}"));
    campaign::write_unless_current(&path, &head, || measured(family, seed))
}

#[allow(clippy::print_stdout, reason = "the command's answer")]
fn measured(family: &'static Family, seed: u64) -> Result<String, String> {
    let progress = ProgressDisplay::stderr().start(family.name(), SCENES as usize);
    let line = |index: u64| {
        let line = judged(family, seed, index);
        progress.step();
        line.ok_or_else(|| format!("{}: no scene {index} can be drawn", family.name()))
    };
    let lines: Vec<Line> = (0..SCENES).into_par_iter().map(line).collect::<Result<_, _>>()?;
    let of = |class: Class| format!("{class} {}", lines.iter().filter(|line| line.class == class).count());
    println!("{}: {}", family.name(), Class::ALL.map(of).join(", "));
    Ok(campaign::table(HEADER, lines.iter().map(Line::text)))
}
