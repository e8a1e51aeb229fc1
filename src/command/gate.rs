//! `calibench gate`: is a solver to be trusted, ours or anyone's? One verb a file.

mod certified;
mod compare;
mod detector;
mod export;
mod hand_eye;
mod judge;
mod options;
mod power;
mod solver;
mod verdict;

use super::{Exit, print, warn};
use calibench::io::write_atomically;
use calibench_gate::faults::planted;
use calibench_gate::files::FilesError;
use calibench_gate::{PlanError, protocol};
use calibench_harness::Build;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(super) struct Arguments {
    #[command(flatten)]
    solver: solver::Arguments,
    #[command(subcommand)]
    verb: Option<Verb>,
}

#[derive(Debug, clap::Subcommand)]
enum Verb {
    /// Writes the problems to a folder, truth kept apart, for programs that cannot be driven by a pipe
    Export(export::Arguments),
    /// Judges the answers in a folder that `export` or `--record` wrote
    Judge(judge::Arguments),
    /// Judges what finds where a camera sits on a robot
    HandEye(hand_eye::Arguments),
    /// Judges what finds the marks of calibration boards in photographs
    Detector(detector::Arguments),
    /// Counts the digits that a solver shares with the certified values of reference/
    Certified(certified::Arguments),
    /// Prints a table of digits as Markdown
    DigitsTable(certified::TableArguments),
    /// Names the faults that can be planted
    Faults,
    /// Measures the gate itself: every planted fault, false alarms over 200 clean seeds, how often textbook
    /// least squares is misled
    Power(power::Arguments),
    /// Prints the tables of `power` as Markdown
    PowerTable(power::TableArguments),
    /// Writes the JSON schemas of the protocol to a folder
    Schema(SchemaArguments),
}

#[derive(Debug, clap::Args)]
struct SchemaArguments {
    /// Folder to write
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

pub(super) fn run(arguments: &Arguments, build: &Build) -> Exit {
    calibench_gate::program::adopt_orphans();
    let exit = dispatch(arguments, build).unwrap_or_else(|(exit, message)| {
        warn(&message);
        exit
    });
    calibench_gate::program::end_all();
    exit
}

fn dispatch(arguments: &Arguments, build: &Build) -> Result<Exit, Stop> {
    match &arguments.verb {
        None => solver::run(&arguments.solver, build),
        Some(Verb::Export(arguments)) => export::run(arguments),
        Some(Verb::Judge(arguments)) => judge::run(arguments, build),
        Some(Verb::HandEye(arguments)) => hand_eye::run(arguments),
        Some(Verb::Detector(arguments)) => detector::run(arguments),
        Some(Verb::Certified(arguments)) => certified::run(arguments, build),
        Some(Verb::DigitsTable(arguments)) => certified::print_table(arguments),
        Some(Verb::Faults) => {
            planted().iter().for_each(|fault| print(&format!("{:<26} {}\n", fault.id, fault.about)));
            Ok(Exit::Held)
        }
        Some(Verb::Power(arguments)) => power::measure(arguments, build),
        Some(Verb::PowerTable(arguments)) => power::print_table(arguments),
        Some(Verb::Schema(SchemaArguments { folder })) => write_schemas(folder),
    }
}

fn write_schemas(folder: &Path) -> Result<Exit, Stop> {
    for (name, text) in protocol::schemas() {
        write_atomically(&folder.join(name), text.as_bytes()).map_err(incomplete)?;
    }
    Ok(Exit::Held)
}

/// A way to end before there is a verdict.
type Stop = (Exit, String);

fn usage(message: impl ToString) -> Stop {
    (Exit::Usage, message.to_string())
}

fn incomplete(message: impl ToString) -> Stop {
    (Exit::Incomplete, message.to_string())
}

fn of_files(error: FilesError) -> Stop {
    match error {
        FilesError::Plan(PlanError::TooManySamples { .. } | PlanError::UnknownScene { .. }) => usage(error),
        FilesError::Write(_) | FilesError::Plan(_) => incomplete(error),
        _ => usage(error),
    }
}
