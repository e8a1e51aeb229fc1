//! What do the experiments say? For each: the golden snapshot, and the record with its tables from this run
//! or the last.

use super::golden_file::GoldenFile;
use calibench::io::hash::sha256_hex;
use calibench::io::input::MOST_TABLE_BYTES;
use calibench::io::read_regular_text;
use calibench_harness::project::Project;
use calibench_harness::{Build, Experiment, Record, record_json};
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;

/// The evidence of all experiments, by name.
#[derive(Debug, Clone, Default)]
pub struct Evidence {
    /// By name of the experiment.
    pub experiments: BTreeMap<String, ExperimentEvidence>,
}

/// The evidence of one experiment.
#[derive(Debug, Clone, Default)]
pub struct ExperimentEvidence {
    /// Headline.
    pub title: String,
    /// The question it answers.
    pub question: String,
    pub(super) golden: Option<GoldenFile>,
    pub(super) record: Option<RecordFile>,
    /// `record.json` as it was written.
    pub(super) record_text: String,
    /// CSV text by table name.
    pub(super) tables: BTreeMap<String, String>,
}

/// `record.json`, as far as the book shows it.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct RecordFile {
    pub provenance: RecordProvenance,
    pub numbers: Vec<RecordNumber>,
    pub claims: Vec<RecordClaim>,
    pub published: Vec<RecordPublished>,
    pub tables: Vec<RecordItem>,
    pub figures: Vec<RecordItem>,
    pub notes: Vec<String>,
}

/// What computed the record: commit and changes are unknown to a program built outside of its repository.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct RecordProvenance {
    pub commit: Option<String>,
    pub dirty: Option<bool>,
    pub crates: BTreeMap<String, String>,
    pub inputs: Vec<RecordInput>,
}

/// A file that was read.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct RecordInput {
    pub name: String,
    pub sha256: String,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct RecordNumber {
    pub id: String,
    pub value: Value,
    pub description: String,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct RecordClaim {
    pub id: String,
    pub statement: String,
    pub value: Value,
    pub unit: String,
    pub interval: (Value, Value),
    pub reason: String,
    pub false_alarm_rate: Option<f64>,
    pub held: bool,
    /// `56 of 56 cells`, for a claim about many.
    #[serde(default)]
    pub counted: Option<String>,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct RecordPublished {
    pub id: String,
    pub kind: String,
    pub book_held: bool,
    pub ours_held: bool,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct RecordItem {
    pub file: String,
    pub caption: String,
}

/// A number as `record.json` writes it: those that are not finite are words.
pub(super) fn number(value: &Value) -> f64 {
    value.as_f64().or_else(|| value.as_str()?.parse().ok()).unwrap_or(f64::NAN)
}

impl Evidence {
    /// The evidence of records in memory that a program of this build has made; nothing is read but golden/.
    pub fn of_records(
        project: &Project,
        experiments: &[Experiment],
        records: &[&Record],
        build: &Build,
    ) -> Evidence {
        let mut evidence = Evidence::named(project, experiments);
        for record in records {
            let json = record_json(record, build);
            let Some(entry) = evidence.experiments.get_mut(record.experiment()) else { continue };
            entry.record_text = format!("{json:#}\n");
            entry.record = serde_json::from_value(json).ok();
            entry.tables = record.tables().iter().map(|t| (t.name.clone(), t.to_csv())).collect();
        }
        evidence
    }

    /// The evidence of the last run, from out/; an experiment whose files are missing, or are not those of
    /// the locked run, is named in the second part.
    pub fn of_last_run(project: &Project, experiments: &[Experiment]) -> (Evidence, Vec<String>) {
        let mut evidence = Evidence::named(project, experiments);
        let mut stale = Vec::new();
        for (id, entry) in &mut evidence.experiments {
            if entry.golden.is_some() && !entry.read_last_run(project, id) {
                stale.push(id.clone());
            }
        }
        (evidence, stale)
    }

    fn named(project: &Project, experiments: &[Experiment]) -> Evidence {
        let entry = |e: &Experiment| {
            let golden = project.snapshot_text(e.id).map(|text| GoldenFile::read(&text));
            let evidence = ExperimentEvidence {
                title: e.title.to_string(),
                question: e.question.to_string(),
                golden,
                ..ExperimentEvidence::default()
            };
            (e.id.to_string(), evidence)
        };
        Evidence { experiments: experiments.iter().map(entry).collect() }
    }
}

impl ExperimentEvidence {
    /// Reads out/<id>/, and says whether it is the locked run's.
    fn read_last_run(&mut self, project: &Project, id: &str) -> bool {
        let folder = project.out().join(id);
        let text = read_regular_text(&folder.join("record.json"), MOST_TABLE_BYTES).unwrap_or_default();
        let Ok(record) = serde_json::from_str::<RecordFile>(&text) else { return false };
        for item in &record.tables {
            let Ok(csv) = read_regular_text(&folder.join(&item.file), MOST_TABLE_BYTES) else { return false };
            self.tables.insert(item.file.trim_end_matches(".csv").to_string(), csv);
        }
        let fresh = self.golden.as_ref().is_some_and(|golden| self.is_locked_run(golden, &record));
        self.record = Some(record);
        self.record_text = text;
        fresh
    }

    /// Same numbers, same tables. A table whose bytes no machine promises is taken as it is.
    fn is_locked_run(&self, golden: &GoldenFile, record: &RecordFile) -> bool {
        let numbers = golden.numbers.len() == record.numbers.len()
            && golden.numbers.iter().zip(&record.numbers).all(|(locked, ours)| {
                locked.id == ours.id && locked.value.to_bits() == number(&ours.value).to_bits()
            });
        let tables = golden.tables.len() == self.tables.len()
            && golden.tables.iter().all(|(name, hash)| {
                let digits = hash.strip_prefix("sha256 ");
                let csv = self.tables.get(name).map(|csv| sha256_hex(csv.as_bytes()));
                digits.is_none_or(|digits| csv.is_some_and(|ours| ours.starts_with(digits)))
            });
        numbers && tables && golden.claims.len() == record.claims.len()
    }

    /// The caption of a figure or table by its file name.
    pub(super) fn caption(&self, file: &str) -> Option<&str> {
        let record = self.record.as_ref()?;
        let all = record.figures.iter().chain(&record.tables);
        all.filter(|item| item.file == file).map(|item| item.caption.as_str()).next()
    }

    /// What a number is, in words.
    pub(super) fn description(&self, id: &str) -> Option<&str> {
        let numbers = &self.record.as_ref()?.numbers;
        numbers.iter().find(|n| n.id == id).map(|n| n.description.as_str())
    }

    /// The published value that reconciles a number, as this run or the last judged it.
    pub(super) fn published(&self, id: &str) -> Option<&RecordPublished> {
        let published = &self.record.as_ref()?.published;
        published.iter().find(|p| p.id.split_once('.').is_some_and(|(_, number)| number == id))
    }
}
