//! What can be wrong with a record?

use super::published::{PublishedError, Rule};

/// A record that contradicts itself or `published.toml`: a mistake in the experiment's file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RecordError {
    /// The same name twice.
    #[error("experiment `{experiment}` has two {what} named `{id}`")]
    Duplicate {
        /// Experiment.
        experiment: String,
        /// `numbers`, `claims`, ...
        what: &'static str,
        /// The name.
        id: String,
    },
    /// A name that is not lower-case letters, digits, `-` and `.`.
    #[error(
        "`{0}` is no name for a number, claim, table or figure: use lower-case letters, digits, `-` and \
         `.`"
    )]
    Name(String),
    /// An experiment without a claim shows nothing.
    #[error("experiment `{0}` has no claim: say what theory or an oracle expects of at least one number")]
    NoClaim(String),
    /// The number to reconcile is not in the record.
    #[error("number `{0}` is not in the record yet: add it before it is reconciled")]
    NoSuchNumber(String),
    /// A number is reconciled by another rule than `published.toml` asks for.
    #[error(
        "published value `{id}` has the rule `{}`, but was reconciled as `{}`",
        expected.map_or("none", Rule::name),
        got.name()
    )]
    Rule {
        /// `<experiment>.<number>`.
        id: String,
        /// Rule in `published.toml`.
        expected: Option<Rule>,
        /// Rule of the call.
        got: Rule,
    },
    /// A row with another number of cells than columns.
    #[error("table `{table}`, row {row}: {need} columns, but {got} cells")]
    RaggedTable {
        /// Name of the table.
        table: String,
        /// Index of the row.
        row: usize,
        /// Number of columns.
        need: usize,
        /// Number of cells.
        got: usize,
    },
    /// `published.toml` itself is broken.
    #[error(transparent)]
    Published(#[from] PublishedError),
}
