//! How do trials stand in a file? One line each, with all digits: the same bits come back.

use super::quantity::Quantity;
use super::trial::Trial;
use std::fmt::Write;

/// Names of the columns, units in brackets.
pub fn columns(quantities: &[Quantity]) -> Vec<String> {
    let column = |q: &Quantity| {
        let what = if q.is_error() { "_error" } else { "" };
        match q.unit() {
            "" => format!("{}{what}", q.name()),
            unit => format!("{}{what} [{unit}]", q.name()),
        }
    };
    let leading = ["cell", "trial", "outcome", "iterations"].map(String::from);
    leading.into_iter().chain(quantities.iter().map(column)).collect()
}

/// The first line of `trials.csv`.
pub(super) fn header(quantities: &[Quantity]) -> String {
    columns(quantities).join(",") + "\n"
}

/// One line a trial. A value that is not there is an empty field.
pub(super) fn rows(trials: &[Trial]) -> String {
    let mut text = String::new();
    for t in trials {
        let written = write!(text, "{},{},{},{}", t.cell, t.trial, t.outcome, t.iterations);
        written.expect("writing to memory cannot fail");
        for value in &t.values {
            let written = match value {
                Some(x) => write!(text, ",{x:?}"),
                None => write!(text, ","),
            };
            written.expect("writing to memory cannot fail");
        }
        text.push('\n');
    }
    text
}

/// A line of `trials.csv`; `None` if it is not one of a study with `quantities` quantities.
pub fn trial_of_line(line: &str, quantities: usize) -> Option<Trial> {
    let mut fields = line.split(',');
    let cell = fields.next()?.parse().ok()?;
    let trial = fields.next()?.parse().ok()?;
    let outcome = fields.next()?.to_string();
    let iterations = fields.next()?.parse().ok()?;
    let values = fields
        .map(|f| if f.is_empty() { Some(None) } else { f.parse().ok().map(Some) })
        .collect::<Option<Vec<Option<f64>>>>()?;
    (values.len() == quantities).then_some(Trial { cell, trial, outcome, iterations, values })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trial_is_read_back_bit_for_bit() {
        let trial = Trial {
            cell: 3,
            trial: 12_345_678_901,
            outcome: "converged".into(),
            iterations: 6,
            values: vec![Some(1.0 / 3.0), None, Some(-5e-324), Some(1e300), Some(-0.0)],
        };
        let text = rows(std::slice::from_ref(&trial));
        let back = trial_of_line(text.trim_end(), 5).unwrap();
        assert_eq!(back, trial);
        assert_eq!(back.values[4].map(f64::to_bits), Some((-0.0f64).to_bits()));
        assert_eq!(trial_of_line(text.trim_end(), 4), None);
        assert_eq!(trial_of_line("1,2,converged", 0), None);
    }
}
