//! What did an experiment find? Named numbers, tables, figures, claims, and the published values beside ours.

use super::band::Band;
use super::claim::Claim;
use super::figure::Figure;
use super::published::{self, Entry, Rule};
use super::reconcile::Reconciliation;
use super::record_error::RecordError;
use super::table::Table;
use calibench::io::hash::sha256_hex;
use std::collections::BTreeMap;
use std::panic::Location;

/// A named number, locked in golden/.
#[derive(Debug, Clone, PartialEq)]
pub struct Number {
    /// Name within the experiment, in kebab-case; the book and `published.toml` know it as
    /// `<experiment>.<id>`.
    pub id: String,
    /// The value.
    pub value: f64,
    /// Unit, empty for a pure number.
    pub unit: String,
    /// How far it may move before it counts as changed.
    pub band: Band,
    /// What it is.
    pub description: String,
}

/// A file or data set that went into an experiment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// What it is called in the record; no path.
    pub name: String,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
}

/// What a record holds under a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Entered {
    /// A number.
    Number,
    /// A claim.
    Claim,
    /// A table.
    Table,
    /// A figure.
    Figure,
}

/// The result of one run of one experiment, in the order in which it was recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    experiment: String,
    seed: u64,
    numbers: Vec<Number>,
    tables: Vec<Table>,
    figures: Vec<Figure>,
    claims: Vec<Claim>,
    reconciliations: Vec<Reconciliation>,
    inputs: Vec<Input>,
    notes: Vec<String>,
    /// What is wrong with a reconciliation, reported when the record is closed.
    mistakes: Vec<RecordError>,
    /// Where in the code each was entered. Neither written nor locked: lines move.
    places: BTreeMap<(Entered, String), &'static Location<'static>>,
}

impl Record {
    /// An empty record. Experiments get theirs from the context.
    pub fn new(experiment: impl Into<String>, seed: u64) -> Record {
        Record {
            experiment: experiment.into(),
            seed,
            numbers: Vec::new(),
            tables: Vec::new(),
            figures: Vec::new(),
            claims: Vec::new(),
            reconciliations: Vec::new(),
            inputs: Vec::new(),
            notes: Vec::new(),
            mistakes: Vec::new(),
            places: BTreeMap::new(),
        }
    }

    pub(super) fn add_number(&mut self, number: Number, place: &'static Location<'static>) {
        self.places.insert((Entered::Number, number.id.clone()), place);
        self.numbers.push(number);
    }

    /// Holds a number against the published value of the same name.
    pub(super) fn hold_against_printed(
        &mut self,
        id: &str,
        rule: Rule,
        judge: impl FnOnce(&Entry, f64) -> Reconciliation,
    ) {
        match self.published(id, rule) {
            Ok((entry, ours)) => self.reconciliations.push(judge(entry, ours)),
            Err(mistake) => self.mistakes.push(mistake),
        }
    }

    /// Adds a table, or rows with their columns.
    #[track_caller]
    pub fn table(&mut self, table: impl Into<Table>) {
        let table = table.into();
        self.places.insert((Entered::Table, table.name.clone()), Location::caller());
        self.tables.push(table);
    }

    /// Adds a figure.
    #[track_caller]
    pub fn figure(&mut self, figure: Figure) {
        self.places.insert((Entered::Figure, figure.name.clone()), Location::caller());
        self.figures.push(figure);
    }

    pub(super) fn add_claim(&mut self, claim: Claim, place: &'static Location<'static>) {
        self.places.insert((Entered::Claim, claim.id.clone()), place);
        self.claims.push(claim);
    }

    /// Names a file or data set that went into the experiment, by the hash of its bytes.
    pub fn input(&mut self, name: impl Into<String>, bytes: &[u8]) {
        self.inputs.push(Input { name: name.into(), sha256: sha256_hex(bytes) });
    }

    /// Adds a remark for the reader, such as that a stand-in was used.
    pub fn note(&mut self, note: impl Into<String>) {
        self.notes.push(note.into());
    }

    /// The value that the book prints for number `id`, to be drawn beside ours.
    pub fn printed(&self, id: &str) -> Result<f64, RecordError> {
        Ok(published::entry(&self.experiment, id)?.value())
    }

    /// The published value that number `id` reconciles, with the number's value.
    fn published(&self, id: &str, got: Rule) -> Result<(&'static Entry, f64), RecordError> {
        let ours = self.value(id).ok_or_else(|| RecordError::NoSuchNumber(id.to_string()))?;
        let entry = published::entry(&self.experiment, id)?;
        if entry.rule != Some(got) {
            return Err(RecordError::Rule { id: entry.id.clone(), expected: entry.rule, got });
        }
        Ok((entry, ours))
    }

    /// The value of a number.
    pub fn value(&self, id: &str) -> Option<f64> {
        self.numbers.iter().find(|n| n.id == id).map(|n| n.value)
    }

    /// Where in the code something was entered: its file, as the compiler names it, and line.
    pub fn place(&self, what: Entered, name: &str) -> Option<&'static Location<'static>> {
        self.places.get(&(what, name.to_string())).copied()
    }

    /// Name of the experiment.
    pub fn experiment(&self) -> &str {
        &self.experiment
    }

    /// Seed of the run.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// The numbers.
    pub fn numbers(&self) -> &[Number] {
        &self.numbers
    }

    /// The tables.
    pub fn tables(&self) -> &[Table] {
        &self.tables
    }

    /// The figures.
    pub fn figures(&self) -> &[Figure] {
        &self.figures
    }

    /// The claims.
    pub fn claims(&self) -> &[Claim] {
        &self.claims
    }

    /// The published values beside ours.
    pub fn reconciliations(&self) -> &[Reconciliation] {
        &self.reconciliations
    }

    /// What went in.
    pub fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    /// Remarks for the reader.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Whether the record is complete and free of contradictions.
    pub fn validate(&self) -> Result<(), RecordError> {
        if self.claims.is_empty() {
            return Err(RecordError::NoClaim(self.experiment.clone()));
        }
        if let Some(mistake) = self.mistakes.first() {
            return Err(mistake.clone());
        }
        self.unique("numbers", self.numbers.iter().map(|n| n.id.as_str()))?;
        self.unique("claims", self.claims.iter().map(|c| c.id.as_str()))?;
        self.unique("tables", self.tables.iter().map(|t| t.name.as_str()))?;
        self.unique("figures", self.figures.iter().map(|f| f.name.as_str()))?;
        self.unique("reconciliations", self.reconciliations.iter().map(|r| r.entry.number()))?;
        self.tables.iter().try_for_each(Table::validate)
    }

    fn unique<'a>(
        &self,
        what: &'static str,
        names: impl Iterator<Item = &'a str>,
    ) -> Result<(), RecordError> {
        let mut seen = std::collections::BTreeSet::new();
        for name in names {
            let plain = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-' || b == b'.';
            if name.is_empty() || !name.bytes().all(plain) {
                return Err(RecordError::Name(name.to_string()));
            }
            if !seen.insert(name) {
                let experiment = self.experiment.clone();
                return Err(RecordError::Duplicate { experiment, what, id: name.to_string() });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
impl Record {
    /// A record that lacks nothing: what tests begin with.
    pub(super) fn with_claim() -> Record {
        let mut record = Record::new("line-bending", 0);
        record.claim_that("c", "zero is small").at_most(0.0, 1.0).because("definition");
        record
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_entered_is_found_again_by_file_and_line() {
        let mut record = Record::with_claim();
        record.exact("px").number("n", 1.0, "");
        let line = line!() - 1;
        let place = record.place(Entered::Number, "n").unwrap();
        assert_eq!((place.file(), place.line()), (file!(), line));
        assert_ne!(record.place(Entered::Claim, "c").unwrap().line(), line);
        assert_eq!(record.place(Entered::Table, "n"), None);
    }

    #[test]
    fn a_record_needs_a_claim_and_names_of_its_own() {
        assert_eq!(Record::new("e", 0).validate(), Err(RecordError::NoClaim("e".into())));
        let mut record = Record::with_claim();
        assert_eq!(record.validate(), Ok(()));
        record.exact("px").number("n", 1.0, "").number("n", 2.0, "");
        assert!(matches!(record.validate(), Err(RecordError::Duplicate { what: "numbers", .. })));
        let mut record = Record::with_claim();
        record.exact("").number("Not | a name", 1.0, "");
        assert!(matches!(record.validate(), Err(RecordError::Name(_))));
    }
}
