//! How do public calibrators do before the judge that this library's own solver faces?
//!
//! Expected: a program that minimises the same sum of squares and reaches its minimum is trusted, whoever
//! wrote it; what fails is a start that ends in another minimum, a covariance that is not stated or not so,
//! points in single precision.
//!
//! What it cannot show: how good a program is at what it was made for. The programs are not run here:
//! `python3 adapters/scoreboard.py --write` measured them, and what it wrote is read.

use calibench_harness::{Context, Experiment, ExperimentError, Record, Table};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "scoreboard",
    title: "Public calibrators before one judge",
    question: "Calibrators that anybody can install answer the gate, the certified problems and the scenes of `global-minimum` through one pipe. \
               Which are trusted, and how many of the determined scenes end at the right minimum? Expected: who reaches the minimum is trusted; \
               a local search from one start does not always reach it.",
    seed: 1,
    takes_image: false,
    run,
};

/// What the script wrote.
const ROWS: &str = include_str!("../golden/scoreboard.csv");

/// This library's row.
const OURS: &str = "calibench";

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    record.input("golden/scoreboard.csv", ROWS.as_bytes());
    let rows = rows()
        .map_err(ExperimentError::at("golden/scoreboard.csv, which adapters/scoreboard.py --write makes"))?;
    let mut numbers = record.exact("");
    numbers.count("calibrators", rows.len(), "calibrators that were run");
    numbers.count(
        "trusted",
        rows.iter().filter(|row| row.is_trusted()).count(),
        "of them trusted by the gate",
    );
    for (name, (right, asked)) in rows.iter().filter_map(|row| Some((row.get(NAME), row.minimum()?))) {
        let what = format!("share of the determined scenes where {name} ends at the right minimum");
        numbers.number(format!("right-{name}"), right / asked, what);
    }
    let ours = rows.iter().filter(|row| row.get(NAME) == OURS);
    let is_right = |row: &Row| row.is_trusted() && row.minimum().is_some_and(|(right, asked)| right == asked);
    record
        .claim_that(
            "own-solver-is-right",
            "through the pipe of all others this library's solver is trusted and ends at the right minimum of every determined scene",
        )
        .every("rows", ours.map(|row| (row.get(NAME), is_right(row))))
        .because("the data determine the camera, so that whoever searches enough finds it");
    record.table(table(&rows));
    record.table(fairness(&rows));
    Ok(record)
}

const NAME: usize = 0;
const VERDICT: usize = 2;
const MINIMUM: usize = 6;
const LICENCE: usize = 10;
const FAIRNESS: usize = 11;

/// A calibrator, its fields as the script writes them.
struct Row(csv::StringRecord);

impl Row {
    fn get(&self, field: usize) -> &str {
        &self.0[field]
    }

    fn is_trusted(&self) -> bool {
        self.get(VERDICT) == "trusted"
    }

    /// Scenes that ended at the right minimum, and those that were asked; `None` where none was.
    fn minimum(&self) -> Option<(f64, f64)> {
        let (right, asked) = self.get(MINIMUM).split_once(" of ")?;
        Some((right.parse().ok()?, asked.parse().ok()?))
    }
}

fn rows() -> Result<Vec<Row>, csv::Error> {
    csv::Reader::from_reader(ROWS.as_bytes()).into_records().map(|record| Ok(Row(record?))).collect()
}

/// What was found.
fn table(rows: &[Row]) -> Table {
    let columns = [
        ("calibrator", ""),
        ("version", ""),
        ("verdict", ""),
        ("scenes_not_supported", ""),
        ("digits", ""),
        ("problems_answered", ""),
        ("right_minimum", ""),
        ("time_of_a_problem", "ms"),
        ("timed_on", ""),
        ("our_time_on_it", "ms"),
    ];
    let mut table = Table::new("calibrators", "public calibrators, as they were measured", &columns);
    rows.iter().for_each(|row| table.push(row.0.iter().take(columns.len())));
    table
}

/// What is fair to say of each.
fn fairness(rows: &[Row]) -> Table {
    let columns = [("calibrator", ""), ("licence", ""), ("fairness", "")];
    let mut table = Table::new("fairness", "how each was asked, and what it is made for", &columns);
    rows.iter().for_each(|row| table.push([NAME, LICENCE, FAIRNESS].map(|field| row.get(field))));
    table
}
