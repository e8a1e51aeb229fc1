//! What can a user ask for? The command line: one verb a file, and the exit codes that all share.

mod bless;
mod board;
mod book;
mod calibrate;
mod check;
mod check_reference;
mod claims;
mod completions;
mod convert;
mod diff;
mod doctor;
mod examples;
mod exit;
mod exit_codes;
mod explain;
mod format;
mod gate;
mod given;
mod hand_eye;
mod list;
mod manual;
mod measure;
mod new;
mod next_pose;
mod ninepoint;
mod noise;
mod program;
mod register;
mod report;
mod reproduce;
mod run;
mod said;
mod shell_word;
mod source;
mod startup;
mod study;
mod terminal;
mod tsai;
mod undistort;
mod validate;

pub use exit::Exit;
pub use terminal::{print, warn};

use calibench_harness::project::Files;
use calibench_harness::{Build, Experiment};
use clap::{FromArgMatches, Parser, Subcommand};
use std::process::ExitCode;

/// A test bench for camera calibration: every number is reconciled with truth, with theory, with the
/// published values, and with the last run.
///
/// Without a verb, every experiment runs: out/ receives its tables and record, figures/ its figures, out/book
/// the book, and one table says what holds.
#[derive(Debug, Parser)]
#[command(name = "calibench", version, max_term_width = 100, after_help = Exit::HELP)]
struct Arguments {
    #[command(subcommand)]
    verb: Option<Verb>,
    /// Threads to use; no result depends on it [default: all cores]
    #[arg(long, global = true, value_name = "N", value_parser = said::whole::<usize>)]
    threads: Option<usize>,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Names the experiments and the questions they answer
    List(list::Arguments),
    /// Explains a number, claim, published value, figure or table: value, origin, what it is worth
    Explain(explain::Arguments),
    /// Runs one experiment
    Run(run::Arguments),
    /// Runs everything and compares, writing nothing: golden values, claims, published values, committed
    /// figures, the book
    Check(check::Arguments),
    /// Accepts the present result of an experiment as its golden snapshot, and its figures with it
    Bless(bless::Arguments),
    /// Runs every experiment in a process of its own, and says which command shows which claim in how many
    /// seconds and megabytes
    Claims(claims::Arguments),
    /// Builds the book into out/book
    Book(book::Arguments),
    /// Writes a file to start from, which runs as it is
    New(new::Arguments),
    /// Draws a board to print, true to scale, with rulers to check the printer
    Board(board::Arguments),
    /// Calibrates a camera from a corner file or from photographs, or a plane from a file of point pairs
    Calibrate(calibrate::Arguments),
    /// Finds the dots of a nine-point board in a photograph, and maps its pixels to the unit grid
    Ninepoint(ninepoint::Arguments),
    /// Measures the noise of extraction from repeated photographs of a still board, and whether it was still
    Noise(noise::Arguments),
    /// Removes a calibrated lens's distortion from photographs
    Undistort(undistort::Arguments),
    /// Converts cameras, corners and boards between the files of OpenCV, ROS, Kalibr, mrcal, COLMAP, MATLAB,
    /// HALCON and this program
    Convert(Box<convert::Arguments>),
    /// Calibrates a camera from one view of a tilted plane or of a target in three dimensions, by Tsai's two
    /// stages
    Tsai(tsai::Arguments),
    /// Judges a calibration by views that it has not seen, by its own in parts, or by repetitions
    Validate(validate::Arguments),
    /// Compares two cameras over the frame, and tests whether both may be one
    Diff(diff::Arguments),
    /// Measures lengths on a plane, with their uncertainty split by cause
    Measure(Box<measure::Arguments>),
    /// Finds how to hold the board for the next photograph, so that what is wanted is known best
    NextPose(Box<next_pose::Arguments>),
    /// Registers a found part on a taught one: the map between their marks, and how well any point is known
    Register(register::Arguments),
    /// Calibrates a camera against a robot, on its gripper or beside it
    HandEye(hand_eye::Arguments),
    /// Watches a station by one reference measured again and again: control limits, history, exit code
    CheckReference(check_reference::Arguments),
    /// Monte Carlo studies from a file: resumable, sharded, with intervals
    Study(study::Arguments),
    /// Judges a solver, this library's or any program, on problems with known answers
    Gate(Box<gate::Arguments>),
    /// Looks whether this program, its golden values and its data are what they should be
    Doctor(doctor::Arguments),
    /// Says what the exit codes mean, of every verb
    ExitCodes(exit_codes::Arguments),
    /// Prints what a shell needs to complete verbs and options
    Completions(completions::Arguments),
    /// Writes the pages of the manual
    Manual(manual::Arguments),
}

/// The `calibench` command over a table of experiments; `build` is what stands as their origin in what they
/// write, `carried` what is read outside the source tree.
pub fn main(experiments: &[Experiment], build: &Build, carried: Files) -> ExitCode {
    startup::take_large_files_for_errors();
    calibench_harness::project::carry(carried);
    let parsed = examples::command().try_get_matches().inspect(given::keep);
    let arguments = match parsed.and_then(|matches| Arguments::from_arg_matches(&matches)) {
        Ok(arguments) => arguments,
        Err(error) => return terminal::ended(terminal::usage(&error)).into(),
    };
    // A study that runs finishes its batch first, and has a handler of its own.
    if !matches!(&arguments.verb, Some(Verb::Study(study)) if study.finishes_its_batch()) {
        end_well_on_interrupt();
    }
    if let Err(exit) = set_threads(arguments.threads) {
        return exit.into();
    }
    let exit = match arguments.verb {
        None => reproduce::run(experiments, build),
        Some(Verb::List(arguments)) => list::run(experiments, &arguments),
        Some(Verb::Explain(arguments)) => explain::run(experiments, &arguments),
        Some(Verb::Run(arguments)) => run::run(experiments, &arguments, build),
        Some(Verb::Check(arguments)) => check::run(experiments, &arguments),
        Some(Verb::Bless(arguments)) => bless::run(experiments, &arguments, build),
        Some(Verb::Claims(arguments)) => claims::run(experiments, &arguments, build),
        Some(Verb::Book(arguments)) => book::run(experiments, &arguments, build),
        Some(Verb::New(arguments)) => new::run(&arguments),
        Some(Verb::Board(arguments)) => board::run(&arguments),
        Some(Verb::Calibrate(arguments)) => calibrate::run(&arguments),
        Some(Verb::Ninepoint(arguments)) => ninepoint::run(&arguments),
        Some(Verb::Noise(arguments)) => noise::run(&arguments),
        Some(Verb::Undistort(arguments)) => undistort::run(&arguments),
        Some(Verb::Convert(arguments)) => convert::run(&arguments),
        Some(Verb::Tsai(arguments)) => tsai::run(&arguments),
        Some(Verb::Validate(arguments)) => validate::run(&arguments),
        Some(Verb::Diff(arguments)) => diff::run(&arguments),
        Some(Verb::Measure(arguments)) => measure::run(&arguments),
        Some(Verb::NextPose(arguments)) => next_pose::run(&arguments),
        Some(Verb::Register(arguments)) => register::run(&arguments),
        Some(Verb::HandEye(arguments)) => hand_eye::run(&arguments),
        Some(Verb::CheckReference(arguments)) => check_reference::run(&arguments),
        Some(Verb::Study(arguments)) => study::run(&arguments, build),
        Some(Verb::Gate(arguments)) => gate::run(&arguments, build),
        Some(Verb::Doctor(arguments)) => doctor::run(experiments, &arguments, build),
        Some(Verb::ExitCodes(arguments)) => exit_codes::run(&arguments),
        Some(Verb::Completions(arguments)) => completions::run(&arguments),
        Some(Verb::Manual(arguments)) => manual::run(&arguments),
    };
    terminal::ended(exit).into()
}

/// The command of an experiment's own binary: one run, as `calibench run ID` does it.
pub fn main_for(experiment: &Experiment, build: &Build) -> ExitCode {
    startup::take_large_files_for_errors();
    end_well_on_interrupt();
    terminal::ended(run::main_for(experiment, build)).into()
}

/// Ctrl-C ends the program with a code of its own. Files are renamed into place whole, so what is finished
/// stays.
fn end_well_on_interrupt() {
    let handler = || {
        warn("interrupted: what was finished and written is kept, the rest is missing");
        calibench_gate::program::end_for_good();
        std::process::exit(Exit::Incomplete as i32);
    };
    // A handler that was set before stays in charge.
    let _ = ctrlc::set_handler(handler);
}

/// Threads, and programs that are judged at the same time. More would only wait for each other, and each
/// takes memory of its own.
pub const MOST_THREADS: usize = 1024;

/// Sets the size of the thread pool.
fn set_threads(threads: Option<usize>) -> Result<(), Exit> {
    // The pool asks this variable itself, without a limit.
    let asked = std::env::var("RAYON_NUM_THREADS").ok().and_then(|text| text.parse().ok());
    if let Some(threads) = threads.or(asked).filter(|threads| *threads > MOST_THREADS) {
        warn(&format!(
            "{threads} threads, and the limit is {MOST_THREADS}: results do not depend on their number"
        ));
        return Err(Exit::Usage);
    }
    let Some(threads) = threads else { return Ok(()) };
    if threads == 0 {
        warn("--threads 0: at least one thread is needed");
        return Err(Exit::Usage);
    }
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().map_err(|error| {
        warn(&format!("--threads {threads}: {error}"));
        Exit::Usage
    })
}

/// The experiment of a name, or a message that lists the names.
fn find<'a>(experiments: &'a [Experiment], id: &str) -> Result<&'a Experiment, Exit> {
    experiments.iter().find(|e| e.id == id).ok_or_else(|| {
        let known: Vec<&str> = experiments.iter().map(|e| e.id).collect();
        warn(&format!("no experiment `{id}`; there are: {}", known.join(", ")));
        Exit::Usage
    })
}
