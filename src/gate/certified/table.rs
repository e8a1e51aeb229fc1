//! How do solvers compare on the certified problems? A table of digits, written once by a command and quoted
//! by README and book.

use super::{Digits, Level, ReferenceProblem};
use calibench::camera::Parameter;
use serde::{Deserialize, Serialize};

/// A solver's digits on a problem.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
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
    fx: Option<f64>,
    fy: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    skew: Option<f64>,
    k1: Option<f64>,
    k2: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
    k3: Option<f64>,
    /// Least digits over the standard deviations.
    pub standard_deviations: Option<f64>,
    /// Digits of the RMSE.
    pub rmse: Option<f64>,
}

/// A table that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
pub struct TableError(#[from] csv::Error);

/// Rows of several solvers.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DigitsTable {
    /// Solver by solver, problem by problem.
    pub rows: Vec<Row>,
}

/// Tenths: more of a digit means nothing.
fn tenths(digits: f64) -> f64 {
    (10.0 * digits).round() / 10.0
}

impl Row {
    fn new(solver: &str, problem: &ReferenceProblem, measured: &Result<Digits, String>) -> Row {
        let of = |p: Parameter| {
            let digits = measured.as_ref().ok()?;
            digits.parameters.iter().find(|(q, _)| *q == p).map(|&(_, d)| tenths(d))
        };
        use Parameter::*;
        Row {
            solver: solver.to_string(),
            problem: problem.problem.id.clone(),
            level: problem.reference.level,
            outcome: measured.as_ref().err().map_or("answered", String::as_str).to_string(),
            least: measured.as_ref().ok().map(|d| tenths(d.least())),
            fx: of(Fx),
            fy: of(Fy),
            cx: of(Cx),
            cy: of(Cy),
            skew: of(Skew),
            k1: of(K1),
            k2: of(K2),
            p1: of(P1),
            p2: of(P2),
            k3: of(K3),
            standard_deviations: measured.as_ref().ok().and_then(|d| d.standard_deviations).map(tenths),
            rmse: measured.as_ref().ok().and_then(|d| d.rmse).map(tenths),
        }
    }

    /// Least digits, or the first word of why there are none.
    pub fn result(&self) -> String {
        match self.least {
            Some(least) => format!("{least:.1}"),
            None => self.outcome.split(':').next().unwrap_or_default().to_string(),
        }
    }

    fn parameters(&self) -> [Option<f64>; Parameter::COUNT] {
        [self.fx, self.fy, self.cx, self.cy, self.skew, self.k1, self.k2, self.p1, self.p2, self.k3]
    }
}

impl DigitsTable {
    /// Adds a solver's results.
    pub fn add(&mut self, solver: &str, problems: &[ReferenceProblem], measured: &[Result<Digits, String>]) {
        self.rows
            .extend(problems.iter().zip(measured).map(|(problem, digits)| Row::new(solver, problem, digits)));
    }

    /// As CSV, with a comment in the first line that says how it was made.
    pub fn to_csv(&self, provenance: &str) -> String {
        let mut writer = csv::Writer::from_writer(Vec::new());
        self.rows.iter().for_each(|row| writer.serialize(row).expect("a flat row is written to memory"));
        let bytes = writer.into_inner().expect("writing to memory cannot fail");
        format!("# {provenance}\n{}", String::from_utf8_lossy(&bytes))
    }

    /// Reads what [`DigitsTable::to_csv`] wrote.
    ///
    /// # Errors
    /// Text that is no such table.
    pub fn of_csv(text: &str) -> Result<DigitsTable, TableError> {
        let mut reader = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(text.as_bytes());
        Ok(DigitsTable { rows: reader.deserialize().collect::<Result<_, _>>()? })
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

    /// Every parameter, for people at a terminal.
    pub fn to_text(&self) -> String {
        let heads: String = Parameter::ALL.iter().map(|p| format!("{:>6}", p.name())).collect();
        let mut text = String::new();
        for solver in self.solvers() {
            text += &format!(
                "{solver}: digits that agree with the certified values\n{:<16} {:<8}{:>6} |{heads} |{:>6}{:>6}\n",
                "problem", "level", "least", "sd", "rmse"
            );
            for row in self.rows.iter().filter(|row| row.solver == solver) {
                let cell = |digits: Option<f64>| digits.map_or("     -".into(), |d| format!("{d:>6.1}"));
                let cells: String = row.parameters().into_iter().map(cell).collect();
                let end = format!("{}{}", cell(row.standard_deviations), cell(row.rmse));
                text += &match row.least {
                    Some(least) => {
                        format!("{:<16} {:<8}{least:>6.1} |{cells} |{end}\n", row.problem, row.level.name())
                    }
                    None => format!("{:<16} {:<8}       {}\n", row.problem, row.level.name(), row.outcome),
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
        let none = None;
        Row {
            solver: solver.into(),
            problem: "p".into(),
            level: Level::Average,
            outcome: least.map_or("refused: no skew, says it".into(), |_| "answered".into()),
            least,
            fx: least,
            fy: none,
            cx: none,
            cy: none,
            skew: none,
            k1: none,
            k2: none,
            p1: none,
            p2: none,
            k3: none,
            standard_deviations: none,
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
        assert!(DigitsTable::of_csv("x\n1\n").is_err());
    }
}
