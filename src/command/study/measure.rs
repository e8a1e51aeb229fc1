//! `calibench study measure`: how fast are trials, and how much memory do they take?

use super::{Failure, read};
use crate::{Exit, print};
use calibench::io::ShownPath;
use calibench_harness::resources::{peak_memory_mib, processor_seconds};
use calibench_harness::stopwatch::{Stopwatch, rate};
use calibench_study::{RunError, Spec, in_memory};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The study
    spec: PathBuf,
    /// Trials a cell in the first of two runs; the second has four times as many
    #[arg(long, default_value_t = 2000)]
    trials: u64,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Failure> {
    let text = read(&arguments.spec)?;
    let mut spec =
        Spec::parse(&text).map_err(|e| Failure::usage(format!("{}: {e}", arguments.spec.shown())))?;
    spec.trials.precision = None;
    let threads = rayon::current_num_threads();
    for trials in [arguments.trials.max(2), arguments.trials.max(2).saturating_mul(4)] {
        spec.trials.per_cell = trials;
        let (watch, processor) = (Stopwatch::start(), processor_seconds());
        let engine = in_memory(spec.clone(), &text, |_| {}).map_err(RunError::from)?;
        let took = watch.elapsed();
        let rate = rate(engine.trials(), took).ok_or_else(|| {
            Failure::usage(format!(
                "{} trials took no time by this clock: measure more, --trials",
                engine.trials()
            ))
        })?;
        let seconds = took.as_secs_f64();
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
