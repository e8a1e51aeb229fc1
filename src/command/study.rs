//! `calibench study`: Monte Carlo studies from a file, one verb a file.

mod compare;
mod measure;
mod plan;
mod run;

use super::{Exit, warn};
use calibench::io::input::{InputError, MOST_SPEC_BYTES};
use calibench::io::read_regular_text;
use calibench_harness::Build;
use calibench_study::{FolderError, MergeError, RunError};
use std::io::ErrorKind;
use std::path::Path;

#[derive(Debug, clap::Subcommand)]
pub(super) enum Verb {
    /// Runs a study, or one shard of it
    Run(run::Arguments),
    /// Continues a run that was interrupted; refuses if specification or code have changed
    Resume(run::ResumeArguments),
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

pub(super) fn run(arguments: &Arguments, build: &Build) -> Exit {
    let ended = match &arguments.verb {
        Verb::Run(arguments) => run::run(arguments, build),
        Verb::Resume(arguments) => run::resume(arguments, build),
        Verb::Merge(arguments) => run::merge_parts(arguments, build),
        Verb::Compare(arguments) => compare::run(arguments),
        Verb::Plan(arguments) => plan::run(arguments),
        Verb::Measure(arguments) => measure::run(arguments),
    };
    ended.unwrap_or_else(|failure| {
        warn(&failure.message);
        failure.exit
    })
}

/// Why a verb ended early.
#[derive(Debug)]
struct Failure {
    exit: Exit,
    message: String,
}

impl Failure {
    fn usage(message: impl Into<String>) -> Failure {
        Failure { exit: Exit::Usage, message: message.into() }
    }
}

/// What the user gave is the user's to mend, also a folder from which a file was taken; a disk that fails leaves
/// the run incomplete.
fn exit_of_folder(error: &FolderError) -> Exit {
    match error {
        FolderError::Input(InputError::Open { cause, .. }) if cause.kind() == ErrorKind::NotFound => {
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
        Failure { exit: exit_of_folder(&error), message: error.to_string() }
    }
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Failure {
        let exit = match &error {
            RunError::Spec(_) => Exit::Usage,
            RunError::Folder(error) => exit_of_folder(error),
        };
        Failure { exit, message: error.to_string() }
    }
}

impl From<MergeError> for Failure {
    fn from(error: MergeError) -> Failure {
        match error {
            MergeError::Run(error) => error.into(),
            MergeError::Incomplete { .. } => Failure { exit: Exit::Incomplete, message: error.to_string() },
            other => Failure::usage(other.to_string()),
        }
    }
}

/// A file that the user named.
fn read(path: &Path) -> Result<String, Failure> {
    read_regular_text(path, MOST_SPEC_BYTES).map_err(|error| Failure::usage(error.to_string()))
}
