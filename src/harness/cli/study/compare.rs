//! `calibench study compare A B`: which run is closer to the truth?

use super::Failure;
use crate::harness::cli::{Exit, print};
use crate::harness::significant;
use crate::harness::study::compare::{CompareError, Comparison, Verdict, compare};
use comfy_table::{Table, presets};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(in crate::harness::cli) struct Arguments {
    /// Folder of the first run
    first: PathBuf,
    /// Folder of the second run
    second: PathBuf,
}

impl From<CompareError> for Failure {
    fn from(error: CompareError) -> Failure {
        match error {
            CompareError::Run(error) => error.into(),
            other => Failure::usage(other.to_string()),
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Failure> {
    let comparison = compare(&arguments.first, &arguments.second)?;
    print(&told(&comparison));
    Ok(Exit::Held)
}

fn told(comparison: &Comparison) -> String {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(["cell", "quantity", "pairs", "RMS first", "RMS second", "second / first", "verdict"]);
    for e in &comparison.effects {
        let digits = |x: f64| significant(x, 4);
        table.add_row([
            e.cell.clone(),
            e.quantity.name().to_string(),
            e.pairs.to_string(),
            digits(e.rms[0]),
            digits(e.rms[1]),
            format!("{} [{}, {}]", digits(e.ratio.value), digits(e.ratio.low), digits(e.ratio.high)),
            match e.verdict {
                Verdict::SecondBetter => "second is better",
                Verdict::FirstBetter => "first is better",
                Verdict::NotTold => "no difference shown",
            }
            .to_string(),
        ]);
    }
    let only: String = comparison
        .only
        .iter()
        .filter(|o| o.1 + o.2 > 0)
        .map(|(cell, first, second)| {
            format!("{cell}: {first} trials converged in the first run only, {second} in the second only\n")
        })
        .collect();
    format!(
        "{table}\n{only}Each interval has a false-alarm rate of {}, all together that of the first run's intervals.\n",
        significant(comparison.each, 2)
    )
}
