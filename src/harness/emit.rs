//! How does a record reach the disk? CSV, JSON and figures, each written beside its place and renamed into
//! it.

use super::data_package::{Resource, data_package};
use super::experiment::Experiment;
use super::provenance::Build;
use super::published::not_judged;
use super::reconcile::{Expectation, Reconciliation};
use super::record::{Input, Record};
use super::run_crate::{PartFile, RunCrate};
use calibench::io::input::{MOST_TABLE_BYTES, read_regular};
use calibench::io::write_atomically;
use serde_json::{Value, json};
use std::io;
use std::path::Path;

/// Writes `<out>/<experiment>/*.csv`, `record.json`, `datapackage.json` and `ro-crate-metadata.json`, and the
/// figures to the folder `figures`. An interrupted run leaves whole files only.
///
/// # Errors
/// What the file system says, with the path.
pub fn emit(
    experiment: &Experiment,
    record: &Record,
    out: &Path,
    figures: &Path,
    build: &Build,
) -> io::Result<()> {
    let folder = out.join(record.experiment());
    let mut written = Vec::new();
    let mut write = |name: &str, what: &str, bytes: &[u8]| {
        written.push(PartFile::new(name, what, bytes));
        write_atomically(&folder.join(name), bytes)
    };
    for table in record.tables() {
        write(&format!("{}.csv", table.name), &table.caption, table.to_csv().as_bytes())?;
    }
    let json = |value: Value| format!("{value:#}\n").into_bytes();
    write("record.json", RECORD, &json(record_json(record, build)))?;
    let resources: Vec<Resource> = record.tables().iter().map(Resource::of).collect();
    let package = data_package(record.experiment(), experiment.title, experiment.question, &resources);
    write("datapackage.json", "The columns of the tables: types, units, descriptions", &json(package))?;
    for figure in record.figures() {
        let path = figures.join(figure.file_name());
        // A figure that is what it was keeps its time: the program carries the committed ones, and is not
        // built anew for them.
        if !read_regular(&path, MOST_TABLE_BYTES).is_ok_and(|old| old == figure.bytes) {
            write_atomically(&path, &figure.bytes)?;
        }
    }
    written.extend(figures_below(&folder, figures, record));
    let text = run_crate(experiment, record, written, build).to_text();
    write_atomically(&folder.join("ro-crate-metadata.json"), text.as_bytes())
}

const RECORD: &str = "Every number with its band, every claim, and every published value beside ours";

/// The figures, where they stand in the folder; those of the locked run stand with the sources.
fn figures_below<'a>(
    folder: &Path,
    figures: &'a Path,
    record: &'a Record,
) -> impl Iterator<Item = PartFile> + 'a {
    let within = figures.strip_prefix(folder).ok().map(|path| path.to_string_lossy().replace('\\', "/"));
    within.into_iter().flat_map(|within| {
        record.figures().iter().map(move |figure| {
            PartFile::new(format!("{within}/{}", figure.file_name()), figure.caption.as_str(), &figure.bytes)
        })
    })
}

fn run_crate<'a>(
    experiment: &Experiment,
    record: &Record,
    results: Vec<PartFile>,
    build: &'a Build,
) -> RunCrate<'a> {
    let input = |input: &Input| PartFile {
        path: format!("#{}", input.name),
        what: "What went into the experiment, known by the hash of its bytes".to_string(),
        sha256: Some(input.sha256.clone()),
    };
    RunCrate {
        title: experiment.title,
        description: experiment.question,
        command: format!("calibench run {} --seed {}", record.experiment(), record.seed()),
        seed: record.seed(),
        inputs: record.inputs().iter().map(input).collect(),
        results,
        build,
    }
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
        // In the place of its folder lies a file.
        let folder = std::env::temp_dir().join(format!("calibench-emit-{}", std::process::id()));
        std::fs::write(&folder, "").unwrap();
        let error = write_atomically(&folder.join("x.csv"), b"").unwrap_err();
        assert!(error.to_string().contains(&folder.join("x.csv").display().to_string()), "{error}");
        std::fs::remove_file(&folder).unwrap();
    }
}
