//! How does a table of a run look in the text? The columns and rows that the placeholder names, as HTML.

use super::format::{significant, typeset};
use super::text::inline;
use std::fmt::Write;
use std::ops::RangeInclusive;

/// Digits of a number, if the placeholder names no other.
const DIGITS: usize = 4;

/// What a placeholder asks for besides columns: `digits=4`, `rows=1-5`.
struct Options {
    digits: usize,
    /// From 1.
    rows: RangeInclusive<usize>,
}

impl Options {
    fn read(words: &[&str]) -> Result<Options, String> {
        let mut options = Options { digits: DIGITS, rows: 1..=usize::MAX };
        for word in words {
            options
                .take(word)
                .ok_or_else(|| format!("`{word}` is no option of a table: digits=4, rows=1-5"))?;
        }
        Ok(options)
    }

    fn take(&mut self, word: &str) -> Option<()> {
        match word.split_once('=')? {
            ("digits", value) => self.digits = value.parse().ok()?,
            ("rows", value) => {
                let (first, last) = value.split_once('-')?;
                self.rows = first.parse().ok()?..=last.parse().ok()?;
            }
            _ => return None,
        }
        Some(())
    }
}

/// Head and body of a table. `columns` names those to show, `*` all; `path` is what the reader knows it by.
pub(super) fn csv_table(csv: &str, columns: &str, options: &[&str], path: &str) -> Result<String, String> {
    let Options { digits, rows } = Options::read(options)?;
    let failed = |error: csv::Error| format!("{path}: {error}");
    let mut reader = csv::Reader::from_reader(csv.as_bytes());
    let header: Vec<String> = reader.headers().map_err(failed)?.iter().map(str::to_string).collect();
    let wanted = places(columns, &header, path)?;
    let head: String =
        wanted.iter().map(|&i| format!("<th>{}</th>", inline(&header[i].replace('_', " ")))).collect();
    let mut body = String::new();
    for (row, record) in (1..).zip(reader.records()) {
        let record = record.map_err(failed)?;
        if rows.contains(&row) {
            let cells = wanted.iter().map(|&i| cell(record.get(i).unwrap_or_default(), digits));
            let cells: String = cells.collect();
            let _ = write!(body, "<tr title=\"row {row} of {path}\">{cells}</tr>");
        }
    }
    Ok(format!("<thead><tr>{head}</tr></thead><tbody>{body}</tbody>"))
}

/// Where the columns of a placeholder, `k1,max` or `*`, stand in the file; their units are not named.
fn places(columns: &str, header: &[String], path: &str) -> Result<Vec<usize>, String> {
    if columns == "*" {
        return Ok((0..header.len()).collect());
    }
    let known: Vec<&str> = header.iter().map(|name| name.split(" [").next().unwrap_or_default()).collect();
    let place = |name: &str| {
        let at = known.iter().position(|k| *k == name);
        at.ok_or_else(|| format!("{path} has no column `{name}`; it has: {}", known.join(", ")))
    };
    columns.split(',').map(place).collect()
}

fn cell(text: &str, digits: usize) -> String {
    match text.parse::<f64>() {
        Ok(value) if text.contains(['.', 'e']) => {
            format!("<td class=\"value\">{}</td>", significant(value, digits))
        }
        Ok(_) => format!("<td class=\"value\">{}</td>", typeset(text)),
        Err(_) => format!("<td>{}</td>", inline(text)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CSV: &str = "k1,max [px],how\n-0.18,4.6777,barrel\n0.18,6.5,pincushion\n";

    #[test]
    fn the_columns_and_rows_that_are_named_are_shown() {
        let table = csv_table(CSV, "how,max", &["digits=2", "rows=2-2"], "t.csv").unwrap();
        assert_eq!(
            table,
            "<thead><tr><th>how</th><th>max &#91;px&#93;</th></tr></thead><tbody><tr title=\"row 2 of t.csv\">\
             <td>pincushion</td><td class=\"value\">6.5</td></tr></tbody>"
        );
    }

    #[test]
    fn what_is_not_there_is_named() {
        let refused =
            |columns: &str, options: &[&str]| csv_table(CSV, columns, options, "t.csv").unwrap_err();
        assert!(refused("k2", &[]).contains("no column `k2`; it has: k1, max, how"));
        assert!(refused("*", &["rows=2"]).contains("`rows=2` is no option"));
    }
}
