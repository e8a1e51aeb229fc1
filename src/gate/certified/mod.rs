//! What is the right answer, to twenty digits? The problems of `reference/`, each with data, start values and
//! certified results.
//!
//! The values were certified by an independent program in numbers of 40 and of 60 digits;
//! `reference/README.md` says how. A file is a [`Problem`] with more fields, so that whoever reads problems
//! reads it too.

mod digits;
mod table;

pub use digits::{
    DIGITS_OF_DOUBLES, Digits, Measured, NoDigits, log_relative_error, measure, measure_in_turn,
};
pub use table::{DigitsTable, Row, TableError};

use super::protocol::{AnswerPose, Problem};
use calibench::io::input::MOST_SPEC_BYTES;
use calibench::io::{read_regular_text, sha256_hex};
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// How hard a problem is, as NIST's StRD divides its regression problems.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Level {
    /// Every calibrator should solve it.
    Lower,
    /// A wide or a long lens, few views, tangential distortion, ragged data.
    Average,
    /// Ill-conditioned, strongly curved, or of a model that does not fit.
    Higher,
}

impl Level {
    /// From easy to hard.
    pub const ALL: [Level; 3] = [Level::Lower, Level::Average, Level::Higher];

    /// `lower`, `average` or `higher`.
    pub const fn name(self) -> &'static str {
        match self {
            Level::Lower => "lower",
            Level::Average => "average",
            Level::Higher => "higher",
        }
    }
}

/// A problem of `reference/`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ReferenceProblem {
    /// As it is put to a solver.
    pub problem: Problem,
    /// The rest of its file.
    pub reference: Reference,
}

/// What a file of `reference/` says besides the problem.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[non_exhaustive]
pub struct Reference {
    /// Version of the data in which the file came; it stays as it is in all that follow.
    pub version: u32,
    /// Level of difficulty.
    pub level: Level,
    /// What is particular to it.
    pub about: String,
    /// Standard deviation of the noise that was drawn, px.
    pub noise_px: f64,
    /// `far`: what needs no calibration; `near`: the truth, its parameters to three digits.
    pub starts: BTreeMap<String, Start>,
    /// What is certified.
    pub certified: Certified,
}

/// A start for programs that want one.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[non_exhaustive]
pub struct Start {
    /// Of the free parameters.
    pub parameters: BTreeMap<String, f64>,
    /// One a view.
    pub poses: Vec<StartPose>,
}

/// A pose: `X_camera = exp([w]x) X_target + t`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[non_exhaustive]
pub struct StartPose {
    /// w, rad.
    pub rotation_vector: [f64; 3],
    /// t, in the target's unit.
    pub translation: [f64; 3],
}

/// The certified results, as the doubles nearest to the twenty digits of the file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[non_exhaustive]
pub struct Certified {
    /// Version of the certificate.
    pub version: u32,
    /// Free parameters at the least sum of squares.
    pub parameters: BTreeMap<String, f64>,
    /// First-order standard deviations, `sigma^2 (J^T J)^-1`.
    pub standard_deviations: BTreeMap<String, f64>,
    /// `sqrt(sum |r|^2 / N)`, px.
    pub rmse: f64,
    /// `sqrt(sum |r|^2 / (2 N - p))`, px.
    pub sigma: f64,
    /// `sum |r|^2`, px^2.
    pub sum_of_squares: f64,
    /// `2 N - p`.
    pub degrees_of_freedom: usize,
    /// One a view.
    pub poses: Vec<AnswerPose>,
}

/// Why the reference problems cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReferenceError {
    /// A file.
    #[error("cannot read {path}: {cause}", path = path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// What the system said.
        cause: std::io::Error,
    },
    /// A file that is no reference problem.
    #[error("{path} is no certified problem: {cause}", path = path.display())]
    Content {
        /// Which.
        path: PathBuf,
        /// What is wrong.
        cause: serde_json::Error,
    },
    /// A file that is not what was certified.
    #[error("{name} is not the file whose SHA-256 stands in SHA256SUMS ({stated}): it has {found}")]
    Changed {
        /// Which.
        name: String,
        /// In the list; empty if it is not there.
        stated: String,
        /// Of the file.
        found: String,
    },
}

/// The problems in a folder, by level and name. Every file must be the one in `SHA256SUMS`.
///
/// # Errors
/// A file that is missing, was changed, or is no certified problem.
pub fn read(folder: &Path) -> Result<Vec<ReferenceProblem>, ReferenceError> {
    read_with(|name| Ok(read_regular_text(&folder.join(name), MOST_SPEC_BYTES)?))
}

/// The same of files that `text_of` finds by their names.
///
/// # Errors
/// As [`read`].
pub fn read_with(
    text_of: impl Fn(&str) -> std::io::Result<String>,
) -> Result<Vec<ReferenceProblem>, ReferenceError> {
    let text = |name: &str| text_of(name).map_err(|cause| ReferenceError::File { path: name.into(), cause });
    let sums = text("SHA256SUMS")?;
    let listed: Vec<(&str, &str)> = sums.lines().filter_map(|line| line.split_once("  ")).collect();
    let mut problems = Vec::new();
    for (stated, name) in listed {
        let content = text(name)?;
        let found = sha256_hex(content.as_bytes());
        if found != stated {
            return Err(ReferenceError::Changed { name: name.into(), stated: stated.into(), found });
        }
        if name.ends_with(".json") {
            let wrong = |cause| ReferenceError::Content { path: name.into(), cause };
            problems.push(ReferenceProblem {
                problem: serde_json::from_str(&content).map_err(wrong)?,
                reference: serde_json::from_str(&content).map_err(wrong)?,
            });
        }
    }
    problems.sort_by(|a, b| (a.reference.level, &a.problem.id).cmp(&(b.reference.level, &b.problem.id)));
    Ok(problems)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_not_the_one_in_the_list_of_sums_is_refused() {
        // SHA-256 of "abc", the standard's first example.
        let sums = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  notes.txt\n";
        let found = |notes: &str| {
            read_with(|name| Ok(if name == "SHA256SUMS" { sums.into() } else { notes.to_string() }))
        };
        assert!(found("abc").unwrap().is_empty());
        assert!(matches!(found("abd"), Err(ReferenceError::Changed { name, .. }) if name == "notes.txt"));
    }
}
