//! What does the book print? Every number of the chapter, with its unit, its printed digits and its kind.

use serde::Deserialize;
use std::sync::OnceLock;

/// How a published number is reconciled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Follows from the model alone: ours must round to the printed digits.
    Exact,
    /// One draw from a distribution: the book's value and ours must both lie inside the predicted distribution.
    Sampled,
    /// Depends on data that is not available: something stands in for it, and the difference is stated.
    Reference,
}

impl Kind {
    /// The word used in files.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Exact => "exact",
            Kind::Sampled => "sampled",
            Kind::Reference => "reference",
        }
    }
}

/// One published number.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// `<experiment>.<number>`: the number of our record that reconciles it.
    pub id: String,
    /// Section of the chapter.
    pub section: String,
    /// Unit, empty for a pure number.
    pub unit: String,
    /// The digits as printed.
    pub printed: String,
    /// How it is reconciled.
    pub kind: Kind,
    /// What the number is.
    pub what: String,
}

/// Why `published.toml` cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PublishedError {
    /// Not TOML of the expected form; the message has line and column.
    #[error("golden/published.toml: {0}")]
    Syntax(String),
    /// The printed digits are no decimal number.
    #[error("golden/published.toml: `{id}` prints `{printed}`, which is not a decimal number")]
    NotANumber {
        /// Id of the entry.
        id: String,
        /// What stands there.
        printed: String,
    },
    /// No entry of that id.
    #[error("golden/published.toml has no value `{0}`")]
    Unknown(String),
    /// An id that is not `<experiment>.<number>`, or stands twice.
    #[error("golden/published.toml: id `{id}` {problem}")]
    Id {
        /// Id of the entry.
        id: String,
        /// What is wrong with it.
        problem: &'static str,
    },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    value: Vec<Entry>,
}

impl Entry {
    /// The experiment that reconciles it.
    pub fn experiment(&self) -> &str {
        self.id.split_once('.').map_or("", |(experiment, _)| experiment)
    }

    /// The name of the number within that experiment.
    pub fn number(&self) -> &str {
        self.id.split_once('.').map_or("", |(_, number)| number)
    }

    /// Digits printed after the decimal point.
    pub fn decimals(&self) -> usize {
        self.printed.split_once('.').map_or(0, |(_, fraction)| fraction.len())
    }

    /// The printed value.
    pub fn value(&self) -> f64 {
        self.printed.parse().unwrap_or(f64::NAN)
    }

    /// Half a unit of the last printed digit: how far the value before rounding may lie from the printed one.
    pub fn rounding(&self) -> f64 {
        let unit: f64 = format!("1e-{}", self.decimals()).parse().unwrap_or(f64::NAN);
        0.5 * unit
    }

    /// Whether `ours`, rounded to the printed number of decimals, shows the printed digits.
    pub fn rounds_from(&self, ours: f64) -> bool {
        let rounded = format!("{ours:.*}", self.decimals());
        without_sign_of_zero(&rounded) == without_sign_of_zero(self.printed.trim_start_matches('+'))
    }
}

/// `-0.000` and `0.000` are the same number.
fn without_sign_of_zero(digits: &str) -> &str {
    let positive = digits.trim_start_matches('-');
    if positive.bytes().all(|b| b == b'0' || b == b'.') { positive } else { digits }
}

/// Reads and checks the text of `published.toml`.
pub fn parse(text: &str) -> Result<Vec<Entry>, PublishedError> {
    let file: File = toml::from_str(text).map_err(|e| PublishedError::Syntax(e.to_string()))?;
    for (i, entry) in file.value.iter().enumerate() {
        let problem = |problem| Err(PublishedError::Id { id: entry.id.clone(), problem });
        if entry.experiment().is_empty() || entry.number().is_empty() {
            return problem("is not <experiment>.<number>");
        }
        if file.value[..i].iter().any(|other| other.id == entry.id) {
            return problem("stands twice");
        }
        let plain = |c: char| c.is_ascii_digit() || matches!(c, '.' | '-' | '+');
        if !entry.printed.chars().all(plain) || !entry.value().is_finite() {
            return Err(PublishedError::NotANumber { id: entry.id.clone(), printed: entry.printed.clone() });
        }
    }
    Ok(file.value)
}

/// The published numbers of the chapter.
pub fn chapter() -> Result<&'static [Entry], PublishedError> {
    static ENTRIES: OnceLock<Result<Vec<Entry>, PublishedError>> = OnceLock::new();
    let entries = ENTRIES.get_or_init(|| parse(include_str!("../../golden/published.toml")));
    entries.as_deref().map_err(Clone::clone)
}

/// The chapter's value with the id `experiment.number`.
pub fn entry(experiment: &str, number: &str) -> Result<&'static Entry, PublishedError> {
    let id = format!("{experiment}.{number}");
    chapter()?.iter().find(|entry| entry.id == id).ok_or(PublishedError::Unknown(id))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(printed: &str) -> Entry {
        Entry {
            id: "e.n".into(),
            section: "5.1".into(),
            unit: "px".into(),
            printed: printed.into(),
            kind: Kind::Exact,
            what: "test".into(),
        }
    }

    #[test]
    fn rounding_to_the_printed_digits_is_exact() {
        assert!(entry("4.678").rounds_from(4.677_75));
        assert!(!entry("4.678").rounds_from(4.677_4));
        assert!(entry("0.000000").rounds_from(-4e-7));
        assert!(entry("+0.2207").rounds_from(0.220_68));
        assert!(!entry("0.2207").rounds_from(-0.220_68));
        assert!(entry("600").rounds_from(599.6));
        assert!((entry("4.678").rounding() - 0.0005).abs() < 1e-18);
    }

    #[test]
    fn broken_files_are_refused_with_the_place() {
        assert!(matches!(parse("[[value]]\nid = 3"), Err(PublishedError::Syntax(m)) if m.contains("line 2")));
        let one = |id: &str, printed: &str| {
            format!(
                "[[value]]\nid='{id}'\nsection='5.1'\nunit='px'\nprinted='{printed}'\nkind='exact'\nwhat=''\n"
            )
        };
        assert!(matches!(parse(&one("e.n", "NaN")), Err(PublishedError::NotANumber { .. })));
        assert!(matches!(parse(&one("en", "1.0")), Err(PublishedError::Id { .. })));
        let twice = one("e.n", "1.0") + &one("e.n", "1.0");
        assert!(matches!(parse(&twice), Err(PublishedError::Id { problem: "stands twice", .. })));
    }

    #[test]
    fn the_chapters_numbers_are_well_formed() {
        assert!(!chapter().unwrap().is_empty());
    }
}
