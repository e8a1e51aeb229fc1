//! `calibench gate power`: the gate's own power and false alarms, as committed tables.

use super::options::{Amount, refuse_unwritable};
use super::{Stop, incomplete, usage};
use crate::{Exit, print, warn};
use calibench::io::write_atomically;
use calibench_gate::faults::planted;
use calibench_gate::power::{Measured, Sizes};
use calibench_gate::{QUICK, THOROUGH, plan, textbook};
use calibench_harness::fingerprint::Fingerprint;
use calibench_harness::{Build, ProgressDisplay};
use std::path::PathBuf;
use std::time::Instant;

/// Runs of the correct solver, each a quick one.
const CLEAN_SEEDS: usize = 200;
/// Seed of the first, unless --seed is more than 1: no other run of the project draws these.
const FIRST_CLEAN_SEED: u64 = 20_001;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Folder to write: three tables
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    #[command(flatten)]
    amount: Amount,
}

#[derive(Debug, clap::Args)]
pub(super) struct TableArguments {
    /// Folder that `calibench gate power` wrote
    #[arg(value_name = "DIR")]
    folder: PathBuf,
}

/// Measures and writes the tables; a fault that is missed, or a correct solver that is failed for certain,
/// deviates.
pub(super) fn measure(Arguments { folder, amount }: &Arguments, build: &Build) -> Result<Exit, Stop> {
    let started = Instant::now();
    refuse_unwritable(&folder.join("faults.csv"))?;
    let samples = amount.samples([QUICK, THOROUGH], plan::MOST_SAMPLES)?;
    let seed = amount.seed;
    let sizes = Sizes {
        seed,
        most: samples,
        clean_seeds: CLEAN_SEEDS,
        first_clean_seed: FIRST_CLEAN_SEED.wrapping_add(1000u64.wrapping_mul(seed.saturating_sub(1))),
        clean_samples: QUICK,
        draws: textbook::DRAWS,
    };
    // The correct solver, the clean seeds and the textbook are a step each.
    let progress = ProgressDisplay::stderr().start("power", planted().len() + 3);
    let step = |done: &str| {
        progress.step();
        progress.note(done);
    };
    let measured = Measured::take(sizes, &step).map_err(incomplete)?;
    drop(progress);
    let commit = build.commit.as_ref().map_or("unknown".to_string(), ToString::to_string);
    let command = format!("calibench gate power DIR --samples {samples} --seed {seed}; commit {commit}");
    let head = Fingerprint::of_gate_power().head(&command);
    for (name, text) in measured.to_csv(&head) {
        write_atomically(&folder.join(name), text.as_bytes()).map_err(incomplete)?;
    }
    print(&measured.to_markdown());
    let wrong = measured.wrong();
    for line in &measured.certain {
        warn(&format!("certain failure of the correct solver: {line}"));
    }
    let seconds = started.elapsed().as_secs_f64();
    warn(&format!(
        "{seconds:.0} s; not as it should be: {}",
        if wrong.is_empty() { "nothing".into() } else { wrong.join(", ") }
    ));
    Ok(if wrong.is_empty() && measured.certain.is_empty() { Exit::Held } else { Exit::Deviates })
}

/// Prints tables that were written before.
pub(super) fn print_table(TableArguments { folder }: &TableArguments) -> Result<Exit, Stop> {
    print(&Measured::read(folder).map_err(usage)?.to_markdown());
    Ok(Exit::Held)
}
