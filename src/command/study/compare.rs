//! `calibench study compare A B`: which run is closer to the truth? And `compare A --factor NAME`: which
//! level?

use super::Failure;
use super::finished::estimated_json;
use crate::Exit;
use crate::format::Format;
use crate::said::print_as;
use calibench::io::significant;
use calibench_study::compare::{CompareError, Comparison, Verdict, compare, compare_levels};
use comfy_table::{Table, presets};
use serde_json::{Value, json};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Folder of the first run
    first: PathBuf,
    /// Folder of the second run
    #[arg(required_unless_present = "factor")]
    second: Option<PathBuf>,
    /// Instead of a second run: each level of this factor with its first level, within one run
    #[arg(long, value_name = "NAME", conflicts_with = "second")]
    factor: Option<String>,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
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
    let (comparison, names) = match (&arguments.second, &arguments.factor) {
        (Some(second), _) => (compare(&arguments.first, second)?, ["first", "second"]),
        (None, factor) => {
            let factor = factor.as_deref().unwrap_or_default();
            (compare_levels(&arguments.first, factor)?, ["first level", "this"])
        }
    };
    print_as(arguments.format, || comparison_text(&comparison, names), || comparison_json(&comparison));
    Ok(Exit::Held)
}

fn comparison_json(comparison: &Comparison) -> Value {
    let effects = comparison.effects.iter().map(|e| {
        json!({
            "cell": e.cell,
            "quantity": e.quantity.name(),
            "pairs": e.pairs,
            "rms": e.rms,
            "ratio": estimated_json(&e.ratio),
            "better": match e.verdict {
                Verdict::FirstBetter => Some("first"),
                Verdict::SecondBetter => Some("second"),
                Verdict::Alike | Verdict::NotTold => None,
            },
        })
    });
    let only = comparison.only.iter().filter(|o| o.1 + o.2 > 0);
    json!({
        "effects": effects.collect::<Vec<_>>(),
        "converged_in_one_only": only.map(|(cell, a, b)| json!({ "cell": cell, "first": a, "second": b })).collect::<Vec<_>>(),
        "false_alarm_rate_each": comparison.each,
    })
}

fn comparison_text(comparison: &Comparison, [first, second]: [&str; 2]) -> String {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    let heads = [format!("RMS {first}"), format!("RMS {second}"), format!("{second} / {first}")];
    table.set_header(
        ["cell", "quantity", "pairs"]
            .map(String::from)
            .into_iter()
            .chain(heads)
            .chain(["verdict".to_string()]),
    );
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
                Verdict::SecondBetter => format!("{second} is better"),
                Verdict::FirstBetter => format!("{first} is better"),
                Verdict::Alike => "no difference that matters".to_string(),
                Verdict::NotTold => "no difference shown".to_string(),
            },
        ]);
    }
    let only: String = comparison
        .only
        .iter()
        .filter(|o| o.1 + o.2 > 0)
        .map(|(cell, a, b)| {
            format!("{cell}: {a} trials converged in the {first} only, {b} in {second} only\n")
        })
        .collect();
    format!(
        "{table}\n{only}Each interval has a false-alarm rate of {}, all together that of the run's own intervals.\n",
        significant(comparison.each, 2)
    )
}
