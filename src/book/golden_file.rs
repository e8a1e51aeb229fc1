//! What does a golden snapshot say? Its lines read back for the reader of the book.

use calibench_harness::golden;

/// A locked number.
#[derive(Debug, Clone, PartialEq)]
pub struct GoldenNumber {
    /// Name within the experiment.
    pub id: String,
    /// The locked value.
    pub value: f64,
    /// Unit, empty for a pure number.
    pub unit: String,
    /// Width of the band, as text.
    pub band: String,
    /// Why the band is as wide.
    pub reason: String,
}

/// A published value as the snapshot locks it.
#[derive(Debug, Clone, PartialEq)]
pub struct GoldenPublished {
    /// Name of the number within the experiment.
    pub id: String,
    /// Where ours must lie.
    pub interval: (f64, f64),
    /// The digits of the chapter.
    pub printed: String,
    /// `exact`, `sampled` or `within`.
    pub rule: String,
    /// What the verdict is worth, in words.
    pub kind: String,
    /// What both are held against, in words.
    pub expectation: String,
}

/// A figure as the snapshot locks it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GoldenFigure {
    /// File name.
    pub file: String,
    /// Its hash, or that its bits differ between machines.
    pub hash: String,
    /// Line of the snapshot file that locks it, from 1.
    pub line: usize,
}

/// A snapshot, read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GoldenFile {
    /// Seed of the locked run.
    pub seed: u64,
    /// Locked numbers in their order.
    pub numbers: Vec<GoldenNumber>,
    /// Published values.
    pub published: Vec<GoldenPublished>,
    /// Names of the claims.
    pub claims: Vec<String>,
    /// Name and hash of every table.
    pub tables: Vec<(String, String)>,
    /// Every figure.
    pub figures: Vec<GoldenFigure>,
}

impl GoldenFile {
    /// Reads a snapshot as [`golden::snapshot`] writes it; lines of another form are left out.
    pub fn read(file: &str) -> GoldenFile {
        let mut read = GoldenFile::default();
        let contents = golden::contents(file);
        let header = file.lines().count() - contents.lines().count();
        for (i, line) in contents.lines().enumerate() {
            let fields: Vec<&str> = line.split(" | ").map(str::trim).collect();
            read.take(&fields, header + i + 1);
        }
        read
    }

    fn take(&mut self, fields: &[&str], line: usize) {
        let unit = |text: &str| if text == "1" { String::new() } else { text.to_string() };
        match fields {
            ["seed", seed] => self.seed = seed.parse().unwrap_or(0),
            ["number", id, value, in_unit, band, reason] => {
                if let Ok(value) = value.parse() {
                    self.numbers.push(GoldenNumber {
                        id: id.to_string(),
                        value,
                        unit: unit(in_unit),
                        band: band.to_string(),
                        reason: reason.to_string(),
                    });
                }
            }
            ["published", id, low, high, _, printed, rule, kind, expectation @ ..] => {
                if let (Ok(low), Ok(high)) = (low.parse(), high.parse()) {
                    self.published.push(GoldenPublished {
                        id: id.to_string(),
                        interval: (low, high),
                        printed: printed.to_string(),
                        rule: rule.to_string(),
                        kind: kind.to_string(),
                        expectation: expectation.join(" "),
                    });
                }
            }
            ["claim", id, ..] => self.claims.push(id.to_string()),
            ["table", name, _, hash] => self.tables.push((name.to_string(), hash.to_string())),
            ["figure", file, hash] => {
                self.figures.push(GoldenFigure { file: file.to_string(), hash: hash.to_string(), line });
            }
            _ => {}
        }
    }

    /// A number with its place, from 1.
    pub fn number(&self, id: &str) -> Option<(usize, &GoldenNumber)> {
        self.numbers.iter().enumerate().find(|(_, n)| n.id == id).map(|(i, n)| (i + 1, n))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench_harness::{Band, Record};

    #[test]
    fn what_a_record_locks_is_read_back() {
        let mut record = Record::new("line-bending", 5);
        record
            .group("px", Band::absolute(1e-9, "rounding"))
            .number("max-deviation", 4.677_75, "")
            .rounds_to_printed();
        record.claim_that("c", "s").at_most(0.0, 1.0).because("r");
        let read = GoldenFile::read(&golden::file_text(&record));
        assert_eq!(read.seed, 5);
        let (row, number) = read.number("max-deviation").unwrap();
        assert_eq!((row, number.value, number.unit.as_str()), (1, 4.677_75, "px"));
        assert_eq!((number.band.as_str(), number.reason.as_str()), ("absolute 1e-9", "rounding"));
        assert_eq!(read.published[0].printed, "4.678");
        assert_eq!(read.claims, ["c"]);
    }
}
