//! `calibench study measure`: how fast are trials, and how much memory do they take?

use super::{Failure, read};
use crate::harness::cli::{Exit, print};
use crate::harness::study::{RunError, Spec, in_memory};
use std::path::PathBuf;
use std::time::Instant;

#[derive(Debug, clap::Args)]
pub(in crate::harness::cli) struct Arguments {
    /// The study
    spec: PathBuf,
    /// Trials a cell in the first of two runs; the second has four times as many
    #[arg(long, default_value_t = 2000)]
    trials: u64,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Failure> {
    let text = read(&arguments.spec)?;
    let mut spec =
        Spec::parse(&text).map_err(|e| Failure::usage(format!("{}: {e}", arguments.spec.display())))?;
    spec.trials.precision = None;
    let threads = rayon::current_num_threads();
    for trials in [arguments.trials.max(2), 4 * arguments.trials.max(2)] {
        spec.trials.per_cell = trials;
        let (started, processor) = (Instant::now(), processor_seconds());
        let engine = in_memory(spec.clone(), &text, |_| {}).map_err(RunError::from)?;
        let seconds = started.elapsed().as_secs_f64();
        let rate = engine.trials() as f64 / seconds;
        let memory = peak_memory_mib().map_or_else(|| "unknown".to_string(), |m| format!("{m:.1} MiB"));
        let spent = processor.and_then(|before| Some(processor_seconds()? - before)).filter(|s| *s > 0.0);
        // Where others share the machine, processor time tells what a core can do.
        let per_core = spent.map_or_else(|| rate / threads as f64, |s| engine.trials() as f64 / s);
        print(&format!(
            "{} trials in {} cells: {seconds:.2} s on {threads} thread(s), {rate:.0} trials/s; {per_core:.0} trials per second and core; \
             peak memory {memory}; a million trials would take {:.1} min\n",
            engine.trials(),
            engine.cells.len(),
            1e6 / rate / 60.0,
        ));
    }
    Ok(Exit::Held)
}

/// The largest resident set so far, as Linux tells it.
fn peak_memory_mib() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: f64 = line.trim().trim_end_matches("kB").trim().parse().ok()?;
    Some(kib / 1024.0)
}

/// Processor time of all threads so far, s, as Linux tells it: user and system time, in hundredths of a second whatever the kernel's clock.
fn processor_seconds() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name, in parentheses, may hold spaces; after it, user time is field 12 and system time field 13.
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(11);
    let (user, system): (f64, f64) = (fields.next()?.parse().ok()?, fields.next()?.parse().ok()?);
    Some((user + system) / 100.0)
}
