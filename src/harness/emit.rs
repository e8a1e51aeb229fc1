//! How does a record reach the disk? CSV, JSON and figures, each written beside its place and renamed into
//! it.

use super::provenance::Build;
use super::published::not_judged;
use super::reconcile::{Expectation, Reconciliation};
use super::record::Record;
use calibench::io::input::{MOST_TABLE_BYTES, read_regular};
use calibench::io::write_atomically;
use serde_json::{Value, json};
use std::io;
use std::path::Path;

/// Writes `<out>/<experiment>/*.csv` and `record.json`, and the figures to the folder `figures`. An
/// interrupted run leaves whole files only.
///
/// # Errors
/// What the file system says, with the path.
pub fn emit(record: &Record, out: &Path, figures: &Path, build: &Build) -> io::Result<()> {
    let folder = out.join(record.experiment());
    for table in record.tables() {
        write_atomically(&folder.join(format!("{}.csv", table.name)), table.to_csv().as_bytes())?;
    }
    for figure in record.figures() {
        let path = figures.join(figure.file_name());
        // A figure that is what it was keeps its time: the program carries the committed ones, and is not
        // built anew for them.
        if !read_regular(&path, MOST_TABLE_BYTES).is_ok_and(|old| old == figure.bytes) {
            write_atomically(&path, &figure.bytes)?;
        }
    }
    let text = format!("{:#}\n", record_json(record, build));
    write_atomically(&folder.join("record.json"), text.as_bytes())
}

/// The record as JSON. A number that is not finite stands as a word, since JSON has none for it.
pub fn record_json(record: &Record, build: &Build) -> Value {
    json!({
        "experiment": record.experiment(),
        "provenance": {
            "commit": build.commit.as_ref().map(|c| &c.hash),
            "dirty": build.commit.as_ref().map(|c| c.dirty),
            "seed": record.seed(),
            "crates": build.crates,
            "inputs": record.inputs().iter().map(|i| json!({"name": i.name, "sha256": i.sha256})).collect::<Vec<_>>(),
        },
        "numbers": record.numbers().iter().map(|n| json!({
            "id": n.id, "value": number(n.value), "unit": n.unit, "band": n.band.width(),
            "band_reason": n.band.reason(), "description": n.description,
        })).collect::<Vec<_>>(),
        "claims": record.claims().iter().map(|c| json!({
            "id": c.id, "statement": c.statement, "value": number(c.value), "unit": c.unit,
            "interval": [number(c.interval.0), number(c.interval.1)], "reason": c.reason,
            "false_alarm_rate": c.false_alarm_rate, "held": c.held, "counted": c.counted(), "failures": c.failures,
        })).collect::<Vec<_>>(),
        "published": record.reconciliations().iter().map(published).collect::<Vec<_>>(),
        "cannot_be_judged": not_judged(record.experiment()).map(|e| json!({
            "id": e.id, "section": e.section, "what": e.what, "unit": e.unit, "printed": e.printed, "because": e.because,
        })).collect::<Vec<_>>(),
        "tables": record.tables().iter().map(|t| json!({
            "file": format!("{}.csv", t.name), "caption": t.caption, "rows": t.rows().len(),
        })).collect::<Vec<_>>(),
        "figures": record.figures().iter().map(|f| json!({
            "file": f.file_name(), "caption": f.caption,
        })).collect::<Vec<_>>(),
        "notes": record.notes(),
    })
}

fn published(r: &Reconciliation) -> Value {
    let mut value = json!({
        "id": r.entry.id, "section": r.entry.section, "what": r.entry.what, "unit": r.entry.unit,
        "printed": r.entry.printed, "rule": r.rule().name(),
        "kind": r.entry.kind.name(), "because": r.entry.because, "ours": number(r.ours),
        "expectation": r.expectation_text(), "book_held": r.book_held, "ours_held": r.ours_held,
    });
    if let Expectation::Distribution { predicted, interval, .. } = &r.expectation {
        value["interval"] = json!([number(interval.0), number(interval.1)]);
        value["z_book"] = predicted.z(r.entry.value()).map_or(Value::Null, number);
        value["z_ours"] = predicted.z(r.ours).map_or(Value::Null, number);
    }
    value
}

fn number(value: f64) -> Value {
    serde_json::Number::from_f64(value).map_or_else(|| Value::String(value.to_string()), Value::Number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_that_is_not_finite_is_written_as_a_word() {
        let mut record = Record::new("e", 1);
        record.exact("px").number("n", f64::INFINITY, "");
        record.claim_that("c", "").at_most(0.0, 1.0).because("");
        let json = record_json(&record, &Build::default());
        assert_eq!(json["numbers"][0]["value"], "inf");
        assert_eq!(json["claims"][0]["interval"], json!(["-inf", 1.0]));
        assert_eq!(json["provenance"]["commit"], Value::Null);
    }

    #[test]
    fn a_file_that_cannot_be_written_is_named() {
        let error = write_atomically(Path::new("/dev/null/x.csv"), b"").unwrap_err();
        assert!(error.to_string().contains("/dev/null/x.csv"));
    }
}
