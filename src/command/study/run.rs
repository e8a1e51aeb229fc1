//! `calibench study run`, `resume` and `merge`: from a file to a folder of results.

use super::finished::{Finished, Ran};
use super::solver::ProgramArguments;
use super::{Failure, read_study};
use crate::format::Format;
use crate::shell_word::shell_word;
use crate::{Exit, warn};
use calibench::io::{ShownPath, keep_files, significant};
use calibench_harness::project::Project;
use calibench_harness::stopwatch::Stopwatch;
use calibench_harness::{Build, ProgressDisplay};
use calibench_study::{
    CellSummary, Engine, Folder, FolderError, Interruption, Manifest, Outcome, Shard, Summary, TrialFile,
    Worst, finish, merge,
};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The study, such as studies/pose-count.toml
    spec: PathBuf,
    /// Folder for the results [default: out/studies/NAME]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Part i of n, from 0: batches are dealt out in turn, whole cells where the study stops at a precision
    #[arg(long, value_name = "i/n", default_value_t = Shard::WHOLE)]
    shard: Shard,
    /// File of the trials: csv, or parquet where this program was built with that feature
    #[arg(long, value_name = "csv|parquet", default_value_t = TrialFile::Csv)]
    trials: TrialFile,
    #[command(flatten)]
    program: ProgramArguments,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

#[derive(Debug, clap::Args)]
pub(crate) struct ResumeArguments {
    /// Folder of the run
    run: PathBuf,
    /// The program must be the one that began the run
    #[command(flatten)]
    program: ProgramArguments,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

#[derive(Debug, clap::Args)]
pub(crate) struct MergeArguments {
    /// Folders of all shards
    #[arg(required = true)]
    parts: Vec<PathBuf>,
    /// Folder for the whole
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// File of the trials, csv or parquet [default: as in the first shard]
    #[arg(long, value_name = "csv|parquet")]
    trials: Option<TrialFile>,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

pub(super) fn run(arguments: &Arguments, build: &Build) -> Result<Exit, Failure> {
    let stop = interruption();
    arguments.trials.check().map_err(FolderError::from)?;
    let (text, inputs) = read_study(&arguments.spec)?;
    let engine = Engine::with_inputs(&text, &inputs, arguments.shard)
        .map_err(|e| Failure::usage(format!("{}: {e}", arguments.spec.shown())))?;
    warn_of_the_frame(&engine);
    warn_of_the_time(&engine);
    let out = arguments.out.clone().unwrap_or_else(|| default_folder(&engine));
    let manifest = Manifest::new(&engine.spec, arguments.shard, build);
    let manifest = manifest.with_trials(arguments.trials).with_solver(arguments.program.solver.clone());
    let engine = arguments.program.applied(engine)?;
    keep_inputs(&inputs.places(&arguments.spec), &out)?;
    let folder = Folder::create(&out, &text, &manifest)?;
    drive(&folder, engine, &stop, arguments.format)
}

/// Refuses a folder for the results in which something lies that the study reads: a result might have its
/// name, which would show when the trials are done, or when a run that was interrupted is resumed and no
/// longer knows of it.
fn keep_inputs(inputs: &[PathBuf], out: &Path) -> Result<(), Failure> {
    keep_files(inputs.iter().map(PathBuf::as_path));
    let Ok(out) = out.canonicalize() else { return Ok(()) };
    let folder = |place: &Path| place.parent()?.canonicalize().ok();
    let is_within = |input: &&PathBuf| {
        let leads_to = input.canonicalize().ok().and_then(|place| folder(&place));
        [folder(input), leads_to].contains(&Some(out.clone()))
    };
    match inputs.iter().find(is_within) {
        Some(input) => Err(Failure::usage(format!(
            "{}: the study reads it, and in the folder of its results it might be replaced: choose another folder with --out",
            input.shown()
        ))),
        None => Ok(()),
    }
}

pub(super) fn resume(arguments: &ResumeArguments, build: &Build) -> Result<Exit, Failure> {
    let stop = interruption();
    let folder = Folder::open(&arguments.run)?;
    folder.manifest()?.trials.check().map_err(FolderError::from)?;
    let shard = folder.shard()?;
    let engine = folder.engine(shard)?;
    // A command in a folder may be a stranger's: it is compared with the user's, and never run by itself.
    let manifest = Manifest::new(&engine.spec, shard, build).with_solver(arguments.program.solver.clone());
    folder.check(&manifest)?;
    drive(&folder, arguments.program.applied(engine)?, &stop, arguments.format)
}

pub(super) fn merge_parts(arguments: &MergeArguments, build: &Build) -> Result<Exit, Failure> {
    let (folder, engine) = merge(&arguments.parts, &arguments.out, arguments.trials, build)?;
    let summary = finish(&folder, &engine)?;
    let finished = Finished { folder: &folder, engine: &engine, summary: &summary, ran: None };
    finished.say(arguments.format)?;
    Ok(judged(&engine, &summary))
}

/// Displacements are measured where there is something to see.
fn warn_of_the_frame(engine: &Engine) {
    if let Some((cell, share)) = engine.frame_in_part() {
        let of_cell = if cell.name == "-" { String::new() } else { format!(" of cell {}", cell.name) };
        warn(&format!(
            "warning: the lens{of_cell} shows {:.0} % of the frame: what is measured of the frame is of that part",
            100.0 * share
        ));
    }
}

/// Trials a second of one core with four views of 63 marks, about; and the days from which a study is told to
/// be long.
const TRIALS_A_SECOND: f64 = 15_000.0;
const LONG_DAYS: f64 = 1.0;

/// A slip in a number of trials shows before the days are spent.
fn warn_of_the_time(engine: &Engine) {
    let trials = engine.most_trials();
    let days = trials as f64 / TRIALS_A_SECOND / 86_400.0;
    if days > LONG_DAYS {
        warn(&format!(
            "warning: {trials} trials take one core {} days at {TRIALS_A_SECOND} a second, which four views of 63 marks allow; a run of fewer tells \
             how fast these are",
            significant(days, 2)
        ));
    }
}

/// A study of which no trial converged has run to its end and measured nothing. One part may hold nothing but
/// cells of which that is expected.
fn judged(engine: &Engine, summary: &Summary) -> Exit {
    let converged = |cell: &CellSummary| cell.converged().is_some_and(|share| share.value > 0.0);
    if engine.trials() == 0 || summary.cells.iter().any(converged) {
        return Exit::Held;
    }
    let whole = engine.shard == Shard::WHOLE;
    let advice = match engine.is_calibrated_here() {
        true => "More tilt or views, or fewer free parameters, determine a camera",
        false => {
            "The first reason of each outcome stands above: look at the program's command, and at what it says"
        }
    };
    warn(&format!(
        "NOTHING MEASURED: not one of the {} trials {} converged; outcomes.csv counts the reasons. {advice}",
        engine.trials(),
        if whole { "of this study" } else { "of this part" },
    ));
    if whole { Exit::Deviates } else { Exit::Held }
}

/// Beside the other results of the source tree, or in the current folder.
fn default_folder(engine: &Engine) -> PathBuf {
    let out = Project::find().map_or_else(|_| PathBuf::from("out"), |project| project.out());
    let part = match engine.shard {
        Shard::WHOLE => String::new(),
        Shard { index, count } => format!("-{index}-of-{count}"),
    };
    out.join("studies").join(format!("{}{part}", engine.spec.name))
}

/// Ctrl-C, or a request to terminate.
#[derive(Default)]
struct Interrupted {
    /// Set by the first: the batch is the last.
    stop: Interruption,
    /// Whether trials are being made; before that there is no batch to finish.
    makes_trials: AtomicBool,
}

/// Asks for a run to be ended well: by the first interruption after a batch, and at once by a second one,
/// which loses a batch and no more, or before the trials, as while a solver starts.
fn interruption() -> Arc<Interrupted> {
    let interrupted = Arc::new(Interrupted::default());
    let seen = interrupted.clone();
    let installed = ctrlc::set_handler(move || {
        if !seen.makes_trials.load(Ordering::Relaxed) {
            warn("interrupted before the first batch");
        } else if !seen.stop.swap(true, Ordering::Relaxed) {
            warn("finishing the batch; once more stops at once");
            return;
        }
        calibench_gate::program::end_for_good();
        std::process::exit(Exit::Incomplete as i32);
    });
    if let Err(error) = installed {
        warn(&format!("Ctrl-C will lose the present batch: {error}"));
    }
    interrupted
}

fn drive(
    folder: &Folder,
    mut engine: Engine,
    interrupted: &Interrupted,
    format: Format,
) -> Result<Exit, Failure> {
    interrupted.makes_trials.store(true, Ordering::Relaxed);
    let progress = ProgressDisplay::stderr().start(&engine.spec.name, engine.most_trials() as usize);
    let (watch, mut shown) = (Stopwatch::start(), None);
    let outcome = folder.run(&mut engine, &interrupted.stop, |pace| {
        if shown.is_none() {
            progress.already(pace.before as usize);
        }
        progress.expect(pace.expected as usize);
        progress.note(&pace.worst.as_ref().map_or_else(String::new, worst));
        progress.advance((pace.trials - shown.unwrap_or(0)) as usize);
        shown = Some(pace.trials);
    })?;
    drop(progress);
    let took = watch.elapsed();
    if outcome == Outcome::Interrupted {
        let again = if engine.is_calibrated_here() { "" } else { " --solver 'THE SAME COMMAND'" };
        warn(&format!(
            "interrupted after {} trials; continue with: calibench study resume {}{again}",
            engine.trials(),
            shell_word(&folder.path().to_string_lossy())
        ));
        return Ok(Exit::Incomplete);
    }
    let summary = finish(folder, &engine)?;
    let ran = shown.map(|trials| Ran { trials, took });
    Finished { folder, engine: &engine, summary: &summary, ran }.say(format)?;
    Ok(judged(&engine, &summary))
}

/// `worst: sd(fx) +-8.2 % at tilt = 40`.
fn worst(worst: &Worst) -> String {
    match worst.relative_half_width {
        Some(width) => {
            let percent = significant(100.0 * width, 2);
            format!("worst: sd({}) \u{b1}{percent} % at {}", worst.quantity, worst.cell)
        }
        None => format!("worst: too few trials converge at {}", worst.cell),
    }
}
