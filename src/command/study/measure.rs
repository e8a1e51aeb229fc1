//! `calibench study measure`: how fast are trials, and how much memory do they take?

use super::{Failure, read_study};
use crate::format::Format;
use crate::said::written_by;
use crate::{Exit, print};
use calibench::io::ShownPath;
use calibench_harness::resources::{peak_memory_mib, processor_seconds};
use calibench_harness::stopwatch::{Stopwatch, rate};
use calibench_study::{RunError, Spec, in_memory};
use serde_json::{Value, json};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The study
    spec: PathBuf,
    /// Trials a cell in the first of two runs; the second has four times as many
    #[arg(long, default_value_t = 2000, value_parser = crate::said::whole::<u64>)]
    trials: u64,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

/// One of both runs.
struct Measured {
    trials: u64,
    cells: usize,
    seconds: f64,
    threads: usize,
    per_second: f64,
    per_second_and_core: f64,
    /// Where the system tells it.
    peak_memory_mib: Option<f64>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Failure> {
    let (text, inputs) = read_study(&arguments.spec)?;
    let mut spec = Spec::parse_with(&text, &inputs)
        .map_err(|e| Failure::usage(format!("{}: {e}", arguments.spec.shown())))?;
    spec.trials.precision = None;
    let mut runs = Vec::new();
    for trials in [arguments.trials.max(2), arguments.trials.max(2).saturating_mul(4)] {
        spec.trials.per_cell = trials;
        let measured = measure(&spec, &text)?;
        if arguments.format == Format::Text {
            print(&measured.text());
        }
        runs.push(measured.json());
    }
    if arguments.format == Format::Json {
        print(&format!("{:#}\n", json!({ "written_by": written_by(), "study": spec.name, "runs": runs })));
    }
    Ok(Exit::Held)
}

fn measure(spec: &Spec, text: &str) -> Result<Measured, Failure> {
    let threads = rayon::current_num_threads();
    let (watch, processor) = (Stopwatch::start(), processor_seconds());
    let engine = in_memory(spec.clone(), text, |_| {}).map_err(RunError::from)?;
    let took = watch.elapsed();
    let per_second = rate(engine.trials(), took).ok_or_else(|| {
        Failure::usage(format!(
            "{} trials took no time by this clock: measure more, --trials",
            engine.trials()
        ))
    })?;
    let spent = processor.and_then(|before| Some(processor_seconds()? - before)).filter(|s| *s > 0.0);
    Ok(Measured {
        trials: engine.trials(),
        cells: engine.cells.len(),
        seconds: took.as_secs_f64(),
        threads,
        per_second,
        // Where others share the machine, processor time tells what a core can do.
        per_second_and_core: spent.map_or(per_second / threads as f64, |s| engine.trials() as f64 / s),
        peak_memory_mib: peak_memory_mib(),
    })
}

impl Measured {
    fn text(&self) -> String {
        let memory = self.peak_memory_mib.map_or_else(|| "unknown".to_string(), |m| format!("{m:.1} MiB"));
        format!(
            "{} trials in {} cells: {:.2} s on {} thread(s), {:.0} trials/s; {:.0} trials per second and core; \
             peak memory {memory}; a million trials would take {:.1} min\n",
            self.trials,
            self.cells,
            self.seconds,
            self.threads,
            self.per_second,
            self.per_second_and_core,
            1e6 / self.per_second / 60.0,
        )
    }

    fn json(&self) -> Value {
        json!({
            "trials": self.trials,
            "cells": self.cells,
            "seconds": self.seconds,
            "threads": self.threads,
            "trials_per_second": self.per_second,
            "trials_per_second_and_core": self.per_second_and_core,
            "peak_memory_mib": self.peak_memory_mib,
        })
    }
}
