//! In which file do the trials of a complete run stand? As CSV, the log of the run itself, or as Parquet,
//! written from the log at the end.
//!
//! A run writes CSV whatever is chosen: lines can be appended, and a torn one cut off, while a Parquet file
//! is readable only once its footer stands at the end.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// The file of a complete run's trials. Both hold the same columns and rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TrialFile {
    /// `trials.csv`.
    #[default]
    Csv,
    /// `trials.parquet`; needs the feature `parquet`.
    Parquet,
}

/// No such kind of file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no file of trials: write csv or parquet")]
pub struct TrialFileError(String);

/// Built without the feature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("this calibench cannot read or write Parquet: build it with `--features parquet`, or use csv")]
pub struct NoParquet;

impl TrialFile {
    /// Name in the folder of a complete run.
    pub fn name(self) -> &'static str {
        match self {
            TrialFile::Csv => "trials.csv",
            TrialFile::Parquet => "trials.parquet",
        }
    }

    /// Refuses what this program was built without.
    ///
    /// # Errors
    /// [`NoParquet`].
    pub fn check(self) -> Result<(), NoParquet> {
        if self == TrialFile::Parquet && !cfg!(feature = "parquet") {
            return Err(NoParquet);
        }
        Ok(())
    }
}

impl fmt::Display for TrialFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            TrialFile::Csv => "csv",
            TrialFile::Parquet => "parquet",
        })
    }
}

impl FromStr for TrialFile {
    type Err = TrialFileError;

    fn from_str(text: &str) -> Result<TrialFile, TrialFileError> {
        [TrialFile::Csv, TrialFile::Parquet]
            .into_iter()
            .find(|file| file.to_string() == text)
            .ok_or_else(|| TrialFileError(text.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_is_always_there_and_parquet_where_it_was_built_in() {
        assert_eq!(TrialFile::Csv.check(), Ok(()));
        assert_eq!(TrialFile::Parquet.check().is_ok(), cfg!(feature = "parquet"));
        for file in [TrialFile::Csv, TrialFile::Parquet] {
            assert_eq!(file.to_string().parse(), Ok(file));
            assert_eq!(file.name(), format!("trials.{file}"));
        }
        assert!("xlsx".parse::<TrialFile>().is_err());
    }
}
