//! `calibench check-reference HISTORY.csv`: is a station still as it was? One reference of known size,
//! measured again and again.

use super::format::Format;
use super::said::{MOST, number_that, positive, print_either, unless_unwritten, written_by};
use super::terminal::has_arrived;
use super::{Exit, warn};
use calibench::downstream::control::{Ewma, Rule, Shewhart};
use calibench::io::input::{MOST_TABLE_BYTES, read_regular};
use calibench::io::lock::{lock, lock_of};
use calibench::io::{
    Check, ShownPath, keep_files, parse_checks, significant, write_atomically, write_together,
};
use calibench_harness::{Figure, Look, Plot};
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// What the exit codes mean here.
const EXIT_CODES: &str =
    "Exit codes: 0 in control, 1 out of control, 2 wrong usage or input, 3 a file could not be written";

#[derive(Debug, Args)]
#[command(after_help = EXIT_CODES)]
pub(super) struct Arguments {
    /// History of the checks: when,value, the newest last; begin a new one after a calibration
    history: PathBuf,
    /// Size of the reference
    #[arg(long, value_name = "VALUE", value_parser = parse_finite, allow_hyphen_values = true)]
    reference: f64,
    /// Standard deviation of one check while nothing drifts
    #[arg(long, value_name = "SD", value_parser = positive)]
    sd: f64,
    /// A new check, which is added to the history first
    #[arg(long, value_name = "VALUE", value_parser = parse_finite, allow_hyphen_values = true)]
    add: Option<f64>,
    /// When it was made, in any words [default: its number]
    #[arg(long, value_name = "TEXT", requires = "add", value_parser = parse_when)]
    when: Option<String>,
    /// Wanted chance that either rule gives a false alarm within --checks
    #[arg(long, value_name = "RATE", value_parser = parse_rate, default_value_t = 0.01)]
    rate: f64,
    /// Checks from one calibration to the next: 273 are three a day for a quarter
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=5000), default_value_t = 273)]
    checks: u16,
    /// Weight of the newest check in the moving average, 0.05 to 1: small notices slow drift
    #[arg(long, value_name = "WEIGHT", value_parser = parse_weight, default_value_t = 0.2)]
    weight: f64,
    /// Folder for check.json and the plot trend.svg
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

fn parse_finite(text: &str) -> Result<f64, String> {
    number_that(text, |x| x.abs() <= MOST, "a number of at most 1e30")
}

fn parse_rate(text: &str) -> Result<f64, String> {
    number_that(text, |x| (1e-6..1.0).contains(&x), "a rate from 1e-6 to below 1, such as 0.01")
}

fn parse_weight(text: &str) -> Result<f64, String> {
    number_that(text, |x| (0.05..=1.0).contains(&x), "a weight from 0.05 to 1")
}

fn parse_when(text: &str) -> Result<String, String> {
    if text.trim().is_empty() || text.contains([',', '"', '\n', '\r']) {
        return Err("expected words without commas, quotes and line ends".into());
    }
    Ok(text.trim().to_string())
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    // A link leads to where the history is, which is added to.
    let history = arguments.history.canonicalize().unwrap_or_else(|_| arguments.history.clone());
    // Two that add at once would each read it without the other's check. What is no file is refused below.
    let adds = arguments.add.is_some() && (history.is_file() || !history.exists());
    let alone = adds.then(|| lock(&lock_of(&history))).transpose();
    let _alone = match alone {
        Ok(alone) => alone,
        Err(error) => {
            warn(&format!("{}: {error}", lock_of(&history).shown()));
            return Exit::Incomplete;
        }
    };
    let text = match with_new_check(arguments) {
        Ok(text) => text,
        Err(message) => {
            warn(&message);
            return Exit::Usage;
        }
    };
    let checks = match parse_checks(&arguments.history.display().to_string(), text.as_bytes()) {
        Ok(checks) => checks,
        Err(error) => {
            warn(&error.to_string());
            return Exit::Usage;
        }
    };
    if checks.len() > MOST_CHECKS {
        warn(&format!(
            "{}: {} checks, and the limit is {MOST_CHECKS}: calibrate, and begin a new history",
            arguments.history.shown(),
            checks.len()
        ));
        return Exit::Usage;
    }
    // A check that was made must not be lost: it is written before anything is said of it.
    if arguments.add.is_some()
        && let Err(error) = write_atomically(&history, text.as_bytes())
    {
        warn(&error.to_string());
        return Exit::Incomplete;
    }
    keep_files([arguments.history.as_path(), &history]);
    let judged = Judged::of(arguments, checks);
    let json = format!("{:#}\n", judged.json(arguments));
    let written = arguments
        .out
        .as_ref()
        .map_or(Ok(()), |folder| write_together(&files(arguments, folder, &json, &judged)));
    print_either(arguments.format, &judged.text(arguments), &json);
    let exit = if judged.first_alarm().is_some() { Exit::Deviates } else { Exit::Held };
    let exit = unless_unwritten(written, exit);
    // Who has not read that it is written adds it again.
    if arguments.add.is_some() && (exit == Exit::Incomplete || !has_arrived()) {
        warn(&format!(
            "the check is number {} of {} now: do not add it again",
            judged.checks.len(),
            arguments.history.shown()
        ));
    }
    exit
}

/// Checks of a history: one a minute for two months. Each is kept, drawn and told.
const MOST_CHECKS: usize = 100_000;

/// The columns of a history that this command begins.
const HEADER: &str = "when,value";

/// The history's text, with the new check.
fn with_new_check(arguments: &Arguments) -> Result<String, String> {
    let path = &arguments.history;
    let exists = path.try_exists().map_err(|error| format!("{}: {error}", path.shown()))?;
    let mut text = if arguments.add.is_some() && !exists {
        format!("{HEADER}\n")
    } else {
        let bytes = read_regular(path, MOST_TABLE_BYTES).map_err(|error| error.to_string())?;
        String::from_utf8(bytes).map_err(|_| format!("{}: it is not UTF-8 text", path.display()))?
    };
    let Some(value) = arguments.add else { return Ok(text) };
    let header = text.lines().next().unwrap_or_default().trim_start_matches('\u{feff}').trim();
    if header != HEADER {
        return Err(format!(
            "{}:1: a check can be added below the header {HEADER} only, and it is {header}",
            path.display()
        ));
    }
    if !text.ends_with('\n') {
        text.push('\n');
    }
    let number = text.lines().skip(1).filter(|line| !line.trim().is_empty()).count() + 1;
    let when = arguments.when.clone().unwrap_or_else(|| number.to_string());
    // Writing to a string cannot fail, here and below.
    let _ = writeln!(text, "{when},{value}");
    Ok(text)
}

/// All or none, `check.json` last.
fn files(arguments: &Arguments, folder: &Path, json: &str, judged: &Judged) -> [(PathBuf, Vec<u8>); 2] {
    let trend = judged.trend(arguments);
    let trend = (folder.join(trend.file_name()), trend.bytes);
    [trend, (folder.join("check.json"), json.as_bytes().to_vec())]
}

/// The checks under both rules.
struct Judged {
    checks: Vec<Check>,
    /// In standard deviations from the reference.
    deviations: Vec<f64>,
    /// Their moving average.
    averages: Vec<f64>,
    threshold: Shewhart,
    average: Ewma,
}

impl Judged {
    fn of(arguments: &Arguments, checks: Vec<Check>) -> Judged {
        let deviations: Vec<f64> =
            checks.iter().map(|check| (check.value - arguments.reference) / arguments.sd).collect();
        // Either rule may give the false alarm: half the chance each keeps their sum below what is wanted.
        let (rate, count) = (0.5 * arguments.rate, usize::from(arguments.checks));
        Judged {
            averages: Ewma::smoothed(arguments.weight, &deviations).collect(),
            threshold: Shewhart::with_false_alarm(rate, count),
            average: Ewma::with_false_alarm(arguments.weight, rate, count),
            deviations,
            checks,
        }
    }

    /// The first check at which a rule gives an alarm, and which.
    fn first_alarm(&self) -> Option<(usize, &'static str)> {
        let threshold = self.threshold.first_alarm(&self.deviations).map(|i| (i, "threshold"));
        let average = self.average.first_alarm(&self.deviations).map(|i| (i, "moving average"));
        [threshold, average].into_iter().flatten().min_by_key(|(i, _)| *i)
    }

    fn text(&self, arguments: &Arguments) -> String {
        let size = |sds: f64| significant(sds * arguments.sd, 3);
        let (last, number) = (self.checks.len() - 1, self.checks.len());
        let mut text = format!(
            "check {} ({number} in all): {} from the reference, moving average {}\nlimits: {} for a check, {} for the average; at most {} % false alarms in {} \
             checks\n",
            self.checks[last].when,
            size(self.deviations[last]),
            size(self.averages[last]),
            size(self.threshold.limit),
            size(self.average.limit),
            significant(100.0 * arguments.rate, 2),
            arguments.checks,
        );
        if number > usize::from(arguments.checks) {
            let _ = writeln!(text, "the history is longer than that: false alarms are likelier");
        }
        let _ = match self.first_alarm() {
            None => writeln!(text, "in control"),
            Some((i, rule)) => writeln!(
                text,
                "OUT OF CONTROL since check {}, by the {rule}: look at station and reference, calibrate, and begin a new history",
                self.checks[i].when
            ),
        };
        text
    }

    fn json(&self, arguments: &Arguments) -> Value {
        let checks = self.checks.iter().zip(&self.averages).map(|(check, average)| {
            json!({"when": check.when, "value": check.value, "average": arguments.reference + arguments.sd * average})
        });
        let alarm = self.first_alarm();
        json!({
            "written_by": written_by(),
            "reference": arguments.reference,
            "sd": arguments.sd,
            "rate": arguments.rate,
            "horizon": arguments.checks,
            "weight": arguments.weight,
            "limit": self.threshold.limit * arguments.sd,
            "average_limit": self.average.limit * arguments.sd,
            "in_control": alarm.is_none(),
            "first_alarm": alarm.map(|(i, rule)| json!({"when": self.checks[i].when, "check": i + 1, "rule": rule})),
            "checks": checks.collect::<Vec<_>>(),
        })
    }

    fn trend(&self, arguments: &Arguments) -> Figure {
        let at = |values: &[f64]| -> Vec<(f64, f64)> {
            values.iter().zip(1..).map(|(z, number)| (f64::from(number), z * arguments.sd)).collect()
        };
        let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let (threshold, average) = (self.threshold.limit * arguments.sd, self.average.limit * arguments.sd);
        let plot = Plot::new(
            format!("Is the station as it was? {}", name(&arguments.history)),
            "check",
            "from the reference",
        )
        .points("checks", at(&self.deviations))
        .line("moving average", at(&self.averages))
        .hline_as("limits of a check", threshold, Look::ink())
        .hline_as("", -threshold, Look::ink())
        .hline("limits of the average", average)
        .hline("", -average);
        let caption =
            "Checks of one reference, less its size, and their moving average, with the limits of both.";
        Figure::plot("trend", &plot, caption)
    }
}
