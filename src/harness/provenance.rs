//! Which program computed a record? Its commit and its numeric crates, fixed when it was built.
//!
//! Only what belongs to the result is locked in golden/ (seed and inputs); commit and versions stand in out/.

use calibench::io::Commit;
use std::collections::BTreeMap;

/// What a program was built from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Build {
    /// The commit; `None` if it was built outside of a repository of its own.
    pub commit: Option<Commit>,
    /// The day of the commit, `2026-01-31`; `None` where no commit is known.
    pub date: Option<String>,
    /// Versions of the crates whose arithmetic stands in the path of a number; none if they are not known for
    /// certain.
    pub crates: BTreeMap<String, String>,
}

impl Build {
    /// What a build script found: hash or nothing, `true` or `false`, and `name version` of crates, separated
    /// by commas.
    pub fn read(hash: &str, changed: &str, crates: &str) -> Build {
        let commit = (!hash.is_empty()).then(|| Commit { hash: hash.to_string(), dirty: changed == "true" });
        let named = crates.split(',').filter_map(|text| text.split_once(' '));
        Build {
            commit,
            date: None,
            crates: named.map(|(name, version)| (name.to_string(), version.to_string())).collect(),
        }
    }
}

impl Build {
    /// With the day of its commit, as a build script found it; empty if there is none.
    pub fn dated(self, day: &str) -> Build {
        Build { date: (!day.is_empty()).then(|| day.to_string()), ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_build_script_writes_is_read_back() {
        let build = Build::read("0123abcd", "true", "libm 0.2.16,nalgebra 0.35.0");
        assert_eq!(build.commit.unwrap().to_string(), "0123abcd with changes");
        assert_eq!(build.crates["nalgebra"], "0.35.0");
        assert_eq!(Build::read("", "false", ""), Build::default());
    }
}
