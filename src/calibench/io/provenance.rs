//! From which sources does a result come? Their commit, and whether they differ from it.

use std::fmt;

/// The state of the sources that a program was built from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Commit {
    /// Full hash.
    pub hash: String,
    /// Whether a source differed from that commit or was unknown to it.
    pub dirty: bool,
}

impl fmt::Display for Commit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.hash, if self.dirty { " with changes" } else { "" })
    }
}
