//! What is locked of a record? One line for each number, claim, published value, table and figure.
//!
//! Fields are separated by ` | `. Numbers stand with as many digits as bring the same bits back. Left out,
//! because they do not belong to the result: time, host, paths, crate versions, and descriptions.

use crate::{Claim, Expectation, Number, Reconciliation, Record};
use calibench::io::hash::sha256_hex;
use calibench::io::significant;
use std::fmt::Write;

/// The snapshot of a record.
pub fn snapshot(record: &Record) -> String {
    let mut lines = vec![
        line(&["experiment", record.experiment()]),
        line(&["seed", &record.seed().to_string()]),
        line(&["bits", &bits_hash(record.numbers())]),
    ];
    lines.extend(record.inputs().iter().map(|i| line(&["input", &i.name, &i.sha256])));
    lines.extend(record.numbers().iter().map(number_line));
    lines.extend(record.claims().iter().map(claim_line));
    lines.extend(record.reconciliations().iter().map(published_line));
    for table in record.tables() {
        let rows = format!("{} rows", table.rows().len());
        let hash = file_hash(table.to_csv().as_bytes(), table.reproducible);
        lines.push(line(&["table", &table.name, &rows, &hash]));
    }
    for figure in record.figures() {
        let hash = file_hash(&figure.bytes, figure.reproducible);
        lines.push(line(&["figure", &figure.file_name(), &hash]));
    }
    lines.join("\n") + "\n"
}

/// The snapshot as a file that insta reads: a header, then the text.
pub fn file_text(record: &Record) -> String {
    format!("---\nsource: tests/golden.rs\n---\n{}", snapshot(record))
}

/// The text of a snapshot file without insta's header.
pub fn contents(file: &str) -> &str {
    let body = file.strip_prefix("---\n").and_then(|rest| rest.split_once("\n---\n"));
    body.map_or(file, |(_, body)| body)
}

/// A field keeps to its line and its column.
fn line(fields: &[&str]) -> String {
    let clean = |field: &&str| field.replace(['\n', '\r'], " ").replace('|', "/").trim().to_string();
    fields.iter().map(clean).collect::<Vec<_>>().join(" | ")
}

fn number_line(number: &Number) -> String {
    let Number { id, value, unit, band, .. } = number;
    line(&["number", id, &format!("{value:?}"), unit_text(unit), &band.width(), band.reason()])
}

/// The interval stands with six digits: enough to see a change of claim, and the comparison forgives the last
/// ones.
fn claim_line(claim: &Claim) -> String {
    let rate =
        claim.false_alarm_rate.map_or("nothing drawn".to_string(), |r| format!("false-alarm rate {r:?}"));
    let (low, high) = (significant(claim.interval.0, 6), significant(claim.interval.1, 6));
    line(&["claim", &claim.id, &low, &high, unit_text(&claim.unit), &rate, &claim.statement, &claim.reason])
}

fn published_line(reconciliation: &Reconciliation) -> String {
    let entry = &reconciliation.entry;
    let (low, high) = match &reconciliation.expectation {
        Expectation::Rounds => (entry.value() - entry.rounding(), entry.value() + entry.rounding()),
        Expectation::Distribution { interval, .. } => *interval,
        Expectation::Within { tolerance, .. } => (entry.value() - tolerance, entry.value() + tolerance),
    };
    let expectation = reconciliation.expectation_text();
    let (low, high) = (significant(low, 8), significant(high, 8));
    let (rule, kind) = (reconciliation.rule().name(), entry.kind.name());
    line(&[
        "published",
        entry.number(),
        &low,
        &high,
        unit_text(&entry.unit),
        &entry.printed,
        rule,
        kind,
        &expectation,
    ])
}

fn unit_text(unit: &str) -> &str {
    if unit.is_empty() { "1" } else { unit }
}

/// SHA-256 over `id` and bits of every number, in order.
fn bits_hash(numbers: &[Number]) -> String {
    let mut text = String::new();
    for number in numbers {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{} {:016x}", number.id, number.value.to_bits());
    }
    sha256_hex(text.as_bytes())
}

/// The first 16 digits of the hash, or a word where bits differ between machines.
fn file_hash(bytes: &[u8], reproducible: bool) -> String {
    if reproducible {
        format!("sha256 {}", &sha256_hex(bytes)[..16])
    } else {
        "this machine only".to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_header_of_a_snapshot_file_is_taken_off() {
        let mut record = Record::new("e", 3);
        record.claim_that("c", "with | bar\nand break").at_most(0.0, 1.0).because("definition");
        let text = snapshot(&record);
        assert_eq!(contents(&file_text(&record)), text);
        assert_eq!(contents(&text), text);
        assert!(text.contains("with / bar and break"));
    }
}
