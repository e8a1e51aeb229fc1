//! What was measured of the gate? Its power, its false alarms and its measure of honesty, as three tables
//! that are committed.

use super::{Alarms, catch, catch_solver, false_alarms};
use crate::faults::{Class, planted};
use crate::judge::{EXPECTED_FALSE_ALARMS, at_least};
use crate::plan::PlanError;
use crate::{Builtin, textbook};
use calibench::io::input::MOST_SPEC_BYTES;
use calibench::io::{InputError, read_regular_text};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// A planted fault.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct FaultRow {
    /// Name.
    pub fault: String,
    /// Gross or subtle.
    pub class: Class,
    /// Samples a scenario after which it was caught; none if it was not.
    pub samples_a_scenario: Option<usize>,
    /// Problems asked until it was caught, or at all.
    pub problems: usize,
    /// The worst verdict.
    pub verdict: String,
    /// The property that failed, the gravest if several did.
    pub property: String,
    /// What is wrong.
    pub what: String,
}

/// False alarms at a stated rate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct AlarmRow {
    /// Chance, as stated, that a correct solver fails a run.
    pub stated_rate: f64,
    /// Runs of the correct solver that failed.
    pub alarms: usize,
    /// Runs.
    pub seeds: usize,
    /// Seed of the first.
    pub first_seed: u64,
    /// Samples a scenario in each.
    pub samples: usize,
}

impl AlarmRow {
    /// The largest number of alarms that chance exceeds with probability at most `tail`, if the stated rate
    /// is the true one.
    pub fn most(&self, tail: f64) -> usize {
        (0..self.seeds).find(|&n| at_least(n + 1, self.seeds, self.stated_rate) <= tail).unwrap_or(self.seeds)
    }
}

/// A doubtful scene and textbook least squares.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct MisledRow {
    /// The scene.
    pub scenario: String,
    /// Confidently wrong answers.
    pub misled: usize,
    /// Draws.
    pub draws: u64,
    /// The rate that stands in the suite.
    pub rate_in_suite: f64,
}

/// Everything measured.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Measured {
    /// Every planted fault.
    pub faults: Vec<FaultRow>,
    /// False alarms, by stated rate.
    pub alarms: Vec<AlarmRow>,
    /// The measure of honesty.
    pub misled: Vec<MisledRow>,
    /// Failures of the correct solver that no chance explains, over all its runs.
    pub certain: Vec<String>,
}

/// How much is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sizes {
    /// Seed of the planted faults' problems.
    pub seed: u64,
    /// Most samples a scenario for a fault.
    pub most: usize,
    /// Runs of the correct solver.
    pub clean_seeds: usize,
    /// Seed of the first of them.
    pub first_clean_seed: u64,
    /// Samples a scenario in each.
    pub clean_samples: usize,
    /// Draws for the measure of honesty.
    pub draws: u64,
}

/// Tables that cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeasuredError {
    /// A file that cannot be read.
    #[error(transparent)]
    File(#[from] InputError),
    /// A table.
    #[error("{name}: {cause}")]
    Table {
        /// Which.
        name: &'static str,
        /// What is wrong.
        cause: csv::Error,
    },
}

/// Names of the three tables.
const FILES: [&str; 3] = ["faults.csv", "false-alarms.csv", "textbook.csv"];
/// Stated rates at which false alarms are counted. At the gate's own, 200 runs show nothing but gross excess;
/// the others show that the p-values are right where there is something to count.
const RATES: [f64; 4] = [0.2, 0.05, 0.01, EXPECTED_FALSE_ALARMS];

impl Measured {
    /// Measures all three. The correct solver itself stands first among the faults' runs, under the name
    /// `none`: it must not be caught. `progress` hears the name of every step.
    ///
    /// # Errors
    /// A plan that cannot be made.
    pub fn take(sizes: Sizes, progress: &(dyn Fn(&str) + Sync)) -> Result<Measured, PlanError> {
        let mut faults = Vec::new();
        let none = catch_solver(&Builtin, sizes.seed, sizes.most)?;
        faults.push(FaultRow::new("none", Class::Subtle, "the correct solver: must not be caught", &none));
        progress("none");
        for fault in planted() {
            let caught = catch(fault, sizes.seed, sizes.most)?;
            faults.push(FaultRow::new(fault.id, fault.class, fault.about, &caught));
            progress(fault.id);
        }
        let quiet = |_| ();
        let clean = false_alarms(sizes.first_clean_seed, sizes.clean_seeds, sizes.clean_samples, &quiet)?;
        progress("clean seeds");
        let row = |m: &textbook::Misled| MisledRow {
            scenario: m.scenario.id.to_string(),
            misled: m.count,
            draws: m.draws,
            rate_in_suite: m.scenario.textbook_misled,
        };
        let misled = textbook::measure(sizes.draws)?.iter().map(row).collect();
        progress("textbook least squares");
        Ok(Measured { faults, alarms: alarm_rows(&clean, sizes), misled, certain: clean.certain })
    }

    /// The three tables as CSV, with their names; `head` is the first line of each.
    pub fn to_csv(&self, head: &str) -> [(&'static str, String); 3] {
        let tables = [csv_of(&self.faults), csv_of(&self.alarms), csv_of(&self.misled)];
        let mut files = FILES.into_iter().zip(tables).map(|(name, t)| (name, format!("{head}\n{t}")));
        std::array::from_fn(|_| files.next().expect("three tables have three names"))
    }

    /// Reads the three tables in a folder.
    ///
    /// # Errors
    /// A file that is missing or no such table.
    pub fn read(folder: &Path) -> Result<Measured, MeasuredError> {
        let text = |name: &str| read_regular_text(&folder.join(name), MOST_SPEC_BYTES);
        let [faults, alarms, misled] = FILES.map(text);
        Measured::of_csv([&faults?, &alarms?, &misled?])
    }

    /// Reads the three tables, given in the order of [`Measured::to_csv`].
    ///
    /// # Errors
    /// A table that is no such table.
    pub fn of_csv(tables: [&str; 3]) -> Result<Measured, MeasuredError> {
        let [faults, alarms, misled] = tables;
        Ok(Measured {
            faults: rows_of(FILES[0], faults)?,
            alarms: rows_of(FILES[1], alarms)?,
            misled: rows_of(FILES[2], misled)?,
            certain: Vec::new(),
        })
    }

    /// Faults that were not caught, and the correct solver if it was.
    pub fn wrong(&self) -> Vec<&str> {
        let is_wrong = |row: &&FaultRow| row.samples_a_scenario.is_some() == (row.fault == "none");
        self.faults.iter().filter(is_wrong).map(|row| row.fault.as_str()).collect()
    }

    /// The table of faults and a line about false alarms, in Markdown, as they stand in the README.
    pub fn to_markdown(&self) -> String {
        let mut text = String::from(
            "| planted fault | problems until caught | by | what is wrong |\n|---|---|---|---|\n",
        );
        for row in &self.faults {
            let after = match row.samples_a_scenario {
                None => format!("not in {}", row.problems),
                Some(_) => row.problems.to_string(),
            };
            let (property, what) = (&row.property, &row.what);
            text.push_str(&format!("| `{}` | {after} | {property} | {what} |\n", row.fault));
        }
        let of = |row: &AlarmRow| format!("{} at {}", row.alarms, row.stated_rate);
        if let Some(first) = self.alarms.first() {
            let counts: Vec<String> = self.alarms.iter().map(of).collect();
            text.push_str(&format!(
                "\nFalse alarms in {} quick runs of the correct solver, at stated rates: {}.\n",
                first.seeds,
                counts.join(", ")
            ));
        }
        text
    }
}

impl FaultRow {
    fn new(fault: &str, class: Class, what: &str, caught: &super::Catch) -> FaultRow {
        FaultRow {
            fault: fault.to_string(),
            class,
            samples_a_scenario: caught.samples,
            problems: caught.problems,
            verdict: caught.verdict.word().to_string(),
            property: caught.by.first().map_or("-", |p| p.name()).to_string(),
            what: what.to_string(),
        }
    }
}

fn alarm_rows(clean: &Alarms, sizes: Sizes) -> Vec<AlarmRow> {
    let row = |stated_rate| AlarmRow {
        stated_rate,
        alarms: clean.at(stated_rate),
        seeds: clean.seeds,
        first_seed: sizes.first_clean_seed,
        samples: sizes.clean_samples,
    };
    RATES.into_iter().map(row).collect()
}

fn csv_of<Row: Serialize>(rows: &[Row]) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    rows.iter().for_each(|row| writer.serialize(row).expect("a flat row is written to memory"));
    let bytes = writer.into_inner().expect("writing to memory cannot fail");
    String::from_utf8_lossy(&bytes).into_owned()
}

fn rows_of<Row: DeserializeOwned>(name: &'static str, text: &str) -> Result<Vec<Row>, MeasuredError> {
    let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
    reader.deserialize().collect::<Result<_, _>>().map_err(|cause| MeasuredError::Table { name, cause })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_read_as_they_were_written() {
        let row = |fault: &str, samples| FaultRow {
            fault: fault.into(),
            class: Class::Gross,
            samples_a_scenario: samples,
            problems: 7,
            verdict: "FAILED".into(),
            property: "bias".into(),
            what: "a, b".into(),
        };
        let measured = Measured {
            faults: vec![row("none", None), row("one", Some(1)), row("missed", None)],
            alarms: vec![AlarmRow { stated_rate: 0.05, alarms: 4, seeds: 200, first_seed: 9, samples: 128 }],
            misled: vec![MisledRow { scenario: "s".into(), misled: 2, draws: 100, rate_in_suite: 0.02 }],
            certain: Vec::new(),
        };
        let files = measured.to_csv("# made by hand");
        let again = Measured::of_csv([&files[0].1, &files[1].1, &files[2].1]).unwrap();
        assert_eq!(again, measured);
        assert_eq!(again.wrong(), ["missed"]);
        assert!(again.to_markdown().contains("| `one` | 7 | bias | a, b |"));
        assert!(Measured::of_csv(["x\n1\n", "", ""]).is_err());
    }
}
