//! `calibench study`: Monte Carlo studies from a file, one verb a file.

mod cell;
mod commands;
mod compare;
mod figure;
mod finished;
mod measure;
mod plan;
mod run;
mod solver;

use super::Exit;
use super::terminal::warn_lines;
use calibench::io::input::{InputError, MOST_SPEC_BYTES};
use calibench::io::shown::on_one_line;
use calibench::io::{ShownPath, read_regular_text};
use calibench_harness::Build;
use calibench_study::{Folder, FolderError, Inputs, Located, MergeError, RunError};
use std::io::ErrorKind;
use std::path::Path;

#[derive(Debug, clap::Subcommand)]
pub(super) enum Verb {
    /// Runs a study, or one shard of it
    Run(run::Arguments),
    /// Continues a run that was interrupted; refuses if specification or code have changed
    Resume(run::ResumeArguments),
    /// Prints one command a shard, for GNU parallel, HyperQueue or whatever runs lines
    Commands(commands::Arguments),
    /// Prints one cell of a run as a study of its own, with the marks and poses that the run used: its trials
    /// are those of the cell, bit for bit
    Cell(cell::Arguments),
    /// Prints one panel of a run's figures as SVG, or the names of all panels
    Figure(figure::Arguments),
    /// Joins the shards of a study into what an undivided run gives, bit for bit
    Merge(run::MergeArguments),
    /// Compares two runs trial by trial: effect with interval, and a verdict only where the interval clears
    /// "no difference"
    Compare(compare::Arguments),
    /// Says how many views of which tilt and coverage reach a wanted standard deviation, and confirms it by
    /// trials
    Plan(plan::Arguments),
    /// Measures trials per second and core, and peak memory
    Measure(measure::Arguments),
}

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(subcommand)]
    verb: Verb,
}

impl Arguments {
    /// Whether the verb runs trials into a folder, and on an interrupt ends after the batch.
    pub(super) fn finishes_its_batch(&self) -> bool {
        matches!(self.verb, Verb::Run(_) | Verb::Resume(_))
    }
}

pub(super) fn run(arguments: &Arguments, build: &Build) -> Exit {
    let ended = match &arguments.verb {
        Verb::Run(arguments) => run::run(arguments, build),
        Verb::Resume(arguments) => run::resume(arguments, build),
        Verb::Commands(arguments) => commands::run(arguments),
        Verb::Cell(arguments) => cell::run(arguments),
        Verb::Figure(arguments) => figure::run(arguments),
        Verb::Merge(arguments) => run::merge_parts(arguments, build),
        Verb::Compare(arguments) => compare::run(arguments),
        Verb::Plan(arguments) => plan::run(arguments),
        Verb::Measure(arguments) => measure::run(arguments),
    };
    ended.unwrap_or_else(|failure| {
        warn_lines(&failure.message);
        failure.exit
    })
}

/// Why a verb ended early.
#[derive(Debug)]
struct Failure {
    exit: Exit,
    /// One line; several where it lists in what two runs differ.
    message: String,
}

impl Failure {
    fn usage(message: impl Into<String>) -> Failure {
        Failure { exit: Exit::Usage, message: on_one_line(&message.into()).into_owned() }
    }
}

/// What the user gave is the user's to mend, also a folder from which a file was taken; a disk that fails
/// leaves the run incomplete.
fn exit_of_folder(error: &FolderError) -> Exit {
    match error {
        FolderError::Input(InputError::Open { cause, .. }) | FolderError::File(Located { cause, .. })
            if cause.kind() == ErrorKind::NotFound =>
        {
            Exit::Usage
        }
        FolderError::File(_) | FolderError::Unwritten(_) | FolderError::Input(InputError::Open { .. }) => {
            Exit::Incomplete
        }
        _ => Exit::Usage,
    }
}

impl From<FolderError> for Failure {
    fn from(error: FolderError) -> Failure {
        let message = error.to_string();
        let message = match error {
            FolderError::Differs { .. } => message,
            _ => on_one_line(&message).into_owned(),
        };
        Failure { exit: exit_of_folder(&error), message }
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Failure {
        match error {
            RunError::Spec(error) => Failure::usage(error.to_string()),
            RunError::Folder(error) => error.into(),
        }
    }
}

impl From<MergeError> for Failure {
    fn from(error: MergeError) -> Failure {
        match error {
            MergeError::Run(error) => error.into(),
            MergeError::Incomplete { .. } => Failure { exit: Exit::Incomplete, message: error.to_string() },
            MergeError::Differs { .. } => Failure { exit: Exit::Usage, message: error.to_string() },
            other => Failure::usage(other.to_string()),
        }
    }
}

/// A study that the user named: its text, and the files that it names.
fn read_study(path: &Path) -> Result<(String, Inputs), Failure> {
    let text = read(path)?;
    let inputs =
        Inputs::beside(path, &text).map_err(|error| Failure::usage(format!("{}: {error}", path.shown())))?;
    Ok((text, inputs))
}

/// The folder of a run that is complete.
fn complete(path: &Path) -> Result<Folder, Failure> {
    let folder = Folder::open_to_read(path)?;
    if folder.manifest()?.complete {
        return Ok(folder);
    }
    let path = path.shown();
    let message = format!("{path} is not complete: `calibench study resume {path}` first");
    Err(Failure { exit: Exit::Incomplete, message })
}

/// A file that the user named.
fn read(path: &Path) -> Result<String, Failure> {
    read_regular_text(path, MOST_SPEC_BYTES).map_err(|error| Failure::usage(error.to_string()))
}
