//! How do solvers compare on the certified problems? A table of digits, written once by a command and quoted
//! by README and book.

use super::{Level, Measured, ReferenceProblem};
use calibench::camera::Parameter;

/// Parameters that a lens model may have.
const PARAMETERS: [Parameter; 21] = Parameter::OF_ALL_MODELS;

/// A solver's digits on a problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Name of the solver.
    pub solver: String,
    /// Name of the problem.
    pub problem: String,
    /// Its level.
    pub level: Level,
    /// `answered`, `refused`, or what else became of it.
    pub outcome: String,
    /// Least digits over the parameters.
    pub least: Option<f64>,
    /// Digits of every parameter, in the order of [`Parameter::OF_ALL_MODELS`]; `None` of those that were not
    /// free.
    parameters: [Option<f64>; PARAMETERS.len()],
    /// Least digits over the standard deviations.
    pub standard_deviations: Option<f64>,
    /// Digits of the RMSE.
    pub rmse: Option<f64>,
}

/// A table that cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// It is no CSV.
    #[error(transparent)]
    Csv(#[from] csv::Error),
    /// A field that is missing, or cannot be what it is.
    #[error("row {row}: `{text}` is no {column}")]
    Field {
        /// Which row, from 1.
        row: usize,
        /// What was looked for.
        column: String,
        /// What stands there.
        text: String,
    },
}

/// Rows of several solvers.
#[derive(Debug, Clone, PartialEq, Default)]
#[non_exhaustive]
pub struct DigitsTable {
    /// Solver by solver, problem by problem.
    pub rows: Vec<Row>,
}

/// Tenths: more of a digit means nothing.
fn tenths(digits: f64) -> f64 {
    (10.0 * digits).round() / 10.0
}

/// Names of the columns.
fn columns() -> impl Iterator<Item = &'static str> {
    let parameters = PARAMETERS.into_iter().map(Parameter::name);
    ["solver", "problem", "level", "outcome", "least"]
        .into_iter()
        .chain(parameters)
        .chain(["standard_deviations", "rmse"])
}

impl Row {
    fn new(solver: &str, problem: &ReferenceProblem, measured: &Measured) -> Row {
        let digits = measured.as_ref().ok();
        let of = |p: Parameter| digits?.parameters.iter().find(|(q, _)| *q == p).map(|&(_, d)| tenths(d));
        Row {
            solver: solver.to_string(),
            problem: problem.problem.id.clone(),
            level: problem.reference.level,
            outcome: measured.as_ref().err().map_or("answered".to_string(), ToString::to_string),
            least: digits.map(|d| tenths(d.least())),
            parameters: PARAMETERS.map(of),
            standard_deviations: digits.and_then(|d| d.standard_deviations).map(tenths),
            rmse: digits.and_then(|d| d.rmse).map(tenths),
        }
    }

    /// Least digits, or the first word of why there are none.
    pub fn result(&self) -> String {
        match self.least {
            Some(least) => format!("{least:.1}"),
            None => self.outcome.split(':').next().unwrap_or_default().to_string(),
        }
    }

    fn fields(&self) -> Vec<String> {
        let number = |digits: Option<f64>| digits.map_or(String::new(), |d| format!("{d:.1}"));
        let names = [&self.solver, &self.problem, self.level.name(), &self.outcome].map(String::from);
        let digits = std::iter::once(self.least).chain(self.parameters);
        let digits = digits.chain([self.standard_deviations, self.rmse]);
        names.into_iter().chain(digits.map(number)).collect()
    }

    /// Row `row` of a table whose `field` of a column is told.
    fn read(row: usize, field: impl Fn(&str) -> String) -> Result<Row, TableError> {
        let wrong = |column: &str| TableError::Field { row, column: column.into(), text: field(column) };
        let number = |column: &str| match field(column).as_str() {
            "" => Ok(None),
            text => text.parse().map(Some).map_err(|_| wrong(column)),
        };
        let mut parameters = [None; PARAMETERS.len()];
        for (place, parameter) in parameters.iter_mut().zip(PARAMETERS) {
            *place = number(parameter.name())?;
        }
        let level = Level::ALL.into_iter().find(|level| level.name() == field("level"));
        Ok(Row {
            solver: field("solver"),
            problem: field("problem"),
            level: level.ok_or_else(|| wrong("level"))?,
            outcome: field("outcome"),
            least: number("least")?,
            parameters,
            standard_deviations: number("standard_deviations")?,
            rmse: number("rmse")?,
        })
    }
}

impl DigitsTable {
    /// Adds a solver's results.
    pub fn add(&mut self, solver: &str, problems: &[ReferenceProblem], measured: &[Measured]) {
        self.rows
            .extend(problems.iter().zip(measured).map(|(problem, digits)| Row::new(solver, problem, digits)));
    }

    /// As CSV, with a comment in the first line that says how it was made.
    pub fn to_csv(&self, provenance: &str) -> String {
        let mut writer = csv::Writer::from_writer(Vec::new());
        let lines =
            std::iter::once(columns().map(String::from).collect()).chain(self.rows.iter().map(Row::fields));
        lines.for_each(|line| writer.write_record(line).expect("a row is written to memory"));
        let bytes = writer.into_inner().expect("writing to memory cannot fail");
        format!("# {provenance}\n{}", String::from_utf8_lossy(&bytes))
    }

    /// Reads what [`DigitsTable::to_csv`] wrote; a table without some of the parameters is one in which they
    /// were not free.
    ///
    /// # Errors
    /// Text that is no such table.
    pub fn of_csv(text: &str) -> Result<DigitsTable, TableError> {
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
        let names = reader.headers()?.clone();
        let row = |(i, record): (usize, Result<csv::StringRecord, csv::Error>)| {
            let record = record?;
            let place = |column: &str| names.iter().position(|name| name == column);
            Row::read(i + 1, |column| {
                place(column).and_then(|at| record.get(at)).unwrap_or_default().to_string()
            })
        };
        Ok(DigitsTable { rows: reader.records().enumerate().map(row).collect::<Result<_, _>>()? })
    }

    /// Names of the solvers, in order.
    pub fn solvers(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.rows.iter().map(|row| row.solver.as_str()).collect();
        names.dedup();
        names
    }

    /// The row of a solver and a problem.
    pub fn row(&self, solver: &str, problem: &str) -> Option<&Row> {
        self.rows.iter().find(|row| row.solver == solver && row.problem == problem)
    }

    /// Least digits, a row a problem and a column a solver, in Markdown.
    pub fn to_markdown(&self) -> String {
        let solvers = self.solvers();
        let mut text = format!("| problem | level | {} |\n", solvers.join(" | "));
        text += &format!("|---|---|{}\n", "---|".repeat(solvers.len()));
        let first = solvers.first().copied().unwrap_or_default();
        for row in self.rows.iter().filter(|row| row.solver == first) {
            let cell = |solver: &&str| self.row(solver, &row.problem).map_or("-".into(), Row::result);
            let cells: Vec<String> = solvers.iter().map(cell).collect();
            text += &format!("| `{}` | {} | {} |\n", row.problem, row.level.name(), cells.join(" | "));
        }
        text
    }

    /// Every parameter that a problem frees, for people at a terminal.
    pub fn to_text(&self) -> String {
        let width = self.rows.iter().map(|row| row.problem.len()).max().unwrap_or_default();
        let is_shown = |place: &usize| self.rows.iter().any(|row| row.parameters[*place].is_some());
        let shown: Vec<usize> = (0..PARAMETERS.len()).filter(is_shown).collect();
        let heads: String = shown.iter().map(|&at| format!("{:>6}", PARAMETERS[at].name())).collect();
        let mut text = String::new();
        for solver in self.solvers() {
            text += &format!(
                "{solver}: digits that agree with the certified values\n{:<width$} {:<8}{:>6} |{heads} |{:>6}{:>6}\n",
                "problem", "level", "least", "sd", "rmse"
            );
            for row in self.rows.iter().filter(|row| row.solver == solver) {
                let cell = |digits: Option<f64>| digits.map_or("     -".into(), |d| format!("{d:>6.1}"));
                let cells: String = shown.iter().map(|&at| cell(row.parameters[at])).collect();
                let end = format!("{}{}", cell(row.standard_deviations), cell(row.rmse));
                let start = format!("{:<width$} {:<8}", row.problem, row.level.name());
                text += &match row.least {
                    Some(least) => format!("{start}{least:>6.1} |{cells} |{end}\n"),
                    None => format!("{start}       {}\n", row.outcome),
                };
            }
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(solver: &str, least: Option<f64>) -> Row {
        let mut parameters = [None; PARAMETERS.len()];
        (parameters[0], parameters[20]) = (least, least);
        Row {
            solver: solver.into(),
            problem: "p".into(),
            level: Level::Average,
            outcome: least.map_or("refused: no skew, says it".into(), |_| "answered".into()),
            least,
            parameters,
            standard_deviations: None,
            rmse: least,
        }
    }

    #[test]
    fn a_table_is_read_as_it_was_written() {
        let table = DigitsTable { rows: vec![row("one", Some(11.5)), row("two", None)] };
        let again = DigitsTable::of_csv(&table.to_csv("made by hand")).unwrap();
        assert_eq!(again, table);
        assert_eq!(
            again.to_markdown(),
            "| problem | level | one | two |\n|---|---|---|---|\n| `p` | average | 11.5 | refused |\n"
        );
        assert!(again.to_text().contains("refused: no skew, says it"));
        let head = again.to_text().lines().nth(1).map(str::to_string).unwrap_or_default();
        assert!(head.contains("fx") && head.contains("alpha") && !head.contains("cx"), "{head}");
        let wrong = DigitsTable::of_csv("x\n1\n").unwrap_err().to_string();
        assert_eq!(wrong, "row 1: `` is no level");
        let wrong = DigitsTable::of_csv("level,least\nlower,many\n").unwrap_err().to_string();
        assert_eq!(wrong, "row 1: `many` is no least");
    }

    #[test]
    fn digits_are_rounded_to_tenths() {
        assert_eq!([11.24, 11.26, 0.04, 15.0].map(tenths), [11.2, 11.3, 0.0, 15.0]);
    }

    #[test]
    fn a_table_has_a_row_for_every_problem_and_a_dash_for_what_was_not_asked() {
        let of =
            |solver: &str, problem: &str, least| Row { problem: problem.into(), ..row(solver, Some(least)) };
        let table = DigitsTable { rows: vec![of("one", "p", 9.0), of("one", "q", 8.0), of("two", "p", 7.0)] };
        let markdown = table.to_markdown();
        let rows: Vec<&str> = markdown.lines().skip(2).collect();
        assert_eq!(rows, ["| `p` | average | 9.0 | 7.0 |", "| `q` | average | 8.0 | - |"]);
    }
}
