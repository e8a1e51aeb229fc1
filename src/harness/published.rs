//! What does the book print? Every number of the chapter, with its unit, its printed digits and its kind.

use serde::Deserialize;
use std::sync::OnceLock;

/// How our value is held against the printed one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Rule {
    /// Ours must round to the printed digits.
    Exact,
    /// One draw from a distribution: the book's value and ours must both lie inside the predicted
    /// distribution.
    Sampled,
    /// Ours must come within a tolerance whose origin the record states.
    Within,
}

impl Rule {
    /// The word used in files.
    pub fn name(self) -> &'static str {
        match self {
            Rule::Exact => "exact",
            Rule::Sampled => "sampled",
            Rule::Within => "within",
        }
    }
}

/// What the verdict on a published number is worth: could it have come out otherwise, and on whose data does
/// it rest?
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Ours is computed from the model, without use of the printed value.
    Independent,
    /// Follows by arithmetic from other numbers of the list: true if they are, and counted once with them.
    Derived,
    /// Ours comes from data made by us in the place of the chapter's, with the printed value's help.
    StandIn,
    /// The printed value was put in, or something was chosen so that it comes out: it cannot fail.
    Input,
    /// Nothing that is available says whether it is right.
    CannotBeJudged,
}

impl Kind {
    /// Every kind, the one that is worth most first.
    pub const ALL: [Kind; 5] =
        [Kind::Independent, Kind::Derived, Kind::StandIn, Kind::Input, Kind::CannotBeJudged];

    /// The word for people.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Independent => "independent",
            Kind::Derived => "derived",
            Kind::StandIn => "stand-in",
            Kind::Input => "input",
            Kind::CannotBeJudged => "cannot be judged",
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
    /// How it is reconciled; `None` where nothing judges it.
    #[serde(default)]
    pub rule: Option<Rule>,
    /// What the verdict is worth.
    pub kind: Kind,
    /// Why it is of that kind: from what it is derived, what stands in, what was chosen by it, or what is
    /// missing. Empty only for an independent number.
    #[serde(default)]
    pub because: String,
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
    /// An entry whose parts do not go together.
    #[error("golden/published.toml: `{id}` {problem}")]
    Entry {
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
        let problem = |problem| Err(PublishedError::Entry { id: entry.id.clone(), problem });
        if entry.experiment().is_empty() || entry.number().is_empty() {
            return problem("is not <experiment>.<number>");
        }
        if file.value[..i].iter().any(|other| other.id == entry.id) {
            return problem("stands twice");
        }
        if entry.rule.is_none() != (entry.kind == Kind::CannotBeJudged) {
            return problem("needs a rule, unless it cannot be judged: then it has none");
        }
        if entry.because.is_empty() && entry.kind != Kind::Independent {
            return problem("does not say why it is not independent (`because`)");
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
    let text = include_str!(concat!(env!("OUT_DIR"), "/published.toml"));
    let entries = ENTRIES.get_or_init(|| parse(text));
    entries.as_deref().map_err(Clone::clone)
}

/// The chapter's value with the id `experiment.number`.
pub fn entry(experiment: &str, number: &str) -> Result<&'static Entry, PublishedError> {
    let id = format!("{experiment}.{number}");
    chapter()?.iter().find(|entry| entry.id == id).ok_or(PublishedError::Unknown(id))
}

/// The values of an experiment that nothing judges. None where `published.toml` is broken, which every
/// reconciliation tells.
pub fn not_judged(experiment: &str) -> impl Iterator<Item = &'static Entry> {
    let entries = chapter().unwrap_or_default().iter();
    entries.filter(move |e| e.kind == Kind::CannotBeJudged && e.experiment() == experiment)
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
            rule: Some(Rule::Exact),
            kind: Kind::Independent,
            because: String::new(),
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
                "[[value]]\nid='{id}'\nsection='5.1'\nunit='px'\nprinted='{printed}'\nrule='exact'\n\
                 kind='independent'\nwhat=''\n"
            )
        };
        assert!(matches!(parse(&one("e.n", "NaN")), Err(PublishedError::NotANumber { .. })));
        assert!(matches!(parse(&one("en", "1.0")), Err(PublishedError::Entry { .. })));
        let twice = one("e.n", "1.0") + &one("e.n", "1.0");
        assert!(matches!(parse(&twice), Err(PublishedError::Entry { problem: "stands twice", .. })));
        let with = |from: &str, to: &str| parse(&one("e.n", "1.0").replace(from, to));
        let refused = |parsed: Result<Vec<Entry>, PublishedError>, why: &str| matches!(parsed, Err(PublishedError::Entry { problem, .. }) if problem.contains(why));
        assert!(refused(with("independent", "input"), "because"));
        assert!(refused(with("rule='exact'\n", ""), "needs a rule"));
        assert!(refused(with("independent'", "cannot-be-judged'\nbecause='no data'"), "it has none"));
    }

    #[test]
    fn the_chapters_numbers_are_well_formed() {
        assert!(!chapter().unwrap().is_empty());
    }
}
