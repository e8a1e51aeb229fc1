//! `calibench study run`, `resume` and `merge`: from a file to a folder of results.

use super::{Failure, read};
use crate::{Exit, print, warn};
use calibench::io::ShownPath;
use calibench::io::significant;
use calibench_harness::project::Project;
use calibench_harness::stopwatch::{Stopwatch, rate};
use calibench_harness::{Build, ProgressDisplay};
use calibench_study::{
    CellSummary, Engine, Folder, FolderError, Interruption, Manifest, Outcome, RunError, Shard, Summary,
    TrialFile, Worst, finish, merge,
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
}

#[derive(Debug, clap::Args)]
pub(crate) struct ResumeArguments {
    /// Folder of the run
    run: PathBuf,
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
}

pub(super) fn run(arguments: &Arguments, build: &Build) -> Result<Exit, Failure> {
    arguments.trials.check().map_err(FolderError::from)?;
    let text = read(&arguments.spec)?;
    let engine = Engine::new(&text, arguments.shard)
        .map_err(|e| Failure::usage(format!("{}: {e}", arguments.spec.shown())))?;
    let out = arguments.out.clone().unwrap_or_else(|| default_folder(&engine));
    let manifest = Manifest::new(&engine.spec, arguments.shard, build);
    let manifest = manifest.with_trials(arguments.trials);
    let folder = Folder::create(&out, &text, &manifest)?;
    drive(&folder, engine)
}

pub(super) fn resume(arguments: &ResumeArguments, build: &Build) -> Result<Exit, Failure> {
    let folder = Folder::open(&arguments.run)?;
    folder.manifest()?.trials.check().map_err(FolderError::from)?;
    let shard = folder.shard()?;
    let engine = Engine::new(&folder.read("spec.toml")?, shard).map_err(RunError::from)?;
    folder.check(&Manifest::new(&engine.spec, shard, build))?;
    drive(&folder, engine)
}

pub(super) fn merge_parts(arguments: &MergeArguments, build: &Build) -> Result<Exit, Failure> {
    let (folder, engine) = merge(&arguments.parts, &arguments.out, arguments.trials, build)?;
    let summary = finish(&folder, &engine)?;
    print_summary(&folder, &engine, &summary);
    Ok(judged(&engine, &summary))
}

/// A study of which no trial converged has run to its end and measured nothing. One part may hold nothing but
/// cells of which that is expected.
fn judged(engine: &Engine, summary: &Summary) -> Exit {
    let converged = |cell: &CellSummary| cell.converged().is_some_and(|share| share.value > 0.0);
    if engine.trials() == 0 || summary.cells.iter().any(converged) {
        return Exit::Held;
    }
    let whole = engine.shard == Shard::WHOLE;
    warn(&format!(
        "NOTHING MEASURED: not one of the {} trials {} converged; outcomes.csv counts the reasons. More tilt or views, or fewer free \
         parameters, determine a camera",
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

/// Set by Ctrl-C and by a request to terminate; a second one ends the process at once, which loses a batch
/// and no more.
fn interruption() -> Arc<Interruption> {
    let stop = Arc::new(AtomicBool::new(false));
    let seen = stop.clone();
    let installed = ctrlc::set_handler(move || {
        if seen.swap(true, Ordering::Relaxed) {
            std::process::exit(Exit::Incomplete as i32);
        }
        warn("finishing the batch; once more stops at once");
    });
    if let Err(error) = installed {
        warn(&format!("Ctrl-C will lose the present batch: {error}"));
    }
    stop
}

fn drive(folder: &Folder, mut engine: Engine) -> Result<Exit, Failure> {
    let stop = interruption();
    let progress = ProgressDisplay::stderr().start(&engine.spec.name, engine.most_trials() as usize);
    let (watch, mut shown) = (Stopwatch::start(), None);
    let outcome = folder.run(&mut engine, &stop, |pace| {
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
        let path = folder.path().shown();
        warn(&format!(
            "interrupted after {} trials; continue with: calibench study resume {path}",
            engine.trials()
        ));
        return Ok(Exit::Incomplete);
    }
    let summary = finish(folder, &engine)?;
    print_summary(folder, &engine, &summary);
    if let Some(trials) = shown {
        let rate = rate(trials, took).map_or_else(String::new, |rate| format!(": {rate:.0} a second"));
        let (seconds, cores) = (took.as_secs_f64(), rayon::current_num_threads());
        print(&format!("{trials} trials in {seconds:.1} s{rate} on {cores} thread(s)\n"));
    }
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

/// A few lines for the terminal; everything stands in the report.
fn print_summary(folder: &Folder, engine: &Engine, summary: &Summary) {
    for cell in &summary.cells {
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
        print(&format!("{} ({} trials){spread}{failed}\n", cell.name, cell.trials));
    }
    if let Some(precision) = &engine.spec.trials.precision {
        for cell in engine.imprecise() {
            print(&format!(
                "{}: sd({}) is not known to {} % after {} trials\n",
                cell.name,
                precision.quantity,
                significant(100.0 * precision.relative_half_width, 3),
                engine.spec.trials.per_cell
            ));
        }
    }
    let report: &Path = &folder.file("report.html");
    print(&format!("{} trials; written: {}\n", engine.trials(), report.shown()));
}
