//! Why is a file of another program not read, or not written?

use super::super::input::InputError;
use super::super::result_camera::ResultError;
use super::super::table::TableError;
use crate::camera::Model;

/// Why a file is not converted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FormatError {
    /// The file cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A result of a calibration cannot be used.
    #[error(transparent)]
    Result(#[from] ResultError),
    /// A table of corners cannot be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The text is not of its form.
    #[error("{file}:{line}:{column}: {message}")]
    Syntax {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// What is wrong.
        message: String,
    },
    /// Something that must be there is not.
    #[error("{file}:{line}: {what} is missing")]
    Missing {
        /// The file.
        file: String,
        /// Line of what should contain it.
        line: usize,
        /// What is missing.
        what: String,
    },
    /// A value is not what its name asks for.
    #[error("{file}:{line}:{column}: {what}: {message}")]
    Value {
        /// The file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// Name of the value.
        what: String,
        /// What is wrong.
        message: String,
    },
    /// A lens that this library does not have.
    #[error("{file}: {model} is none of the lenses here ({}): {help}", lens_names())]
    Lens {
        /// The file.
        file: String,
        /// The lens model, by the name that the file gives.
        model: String,
        /// What can be done.
        help: &'static str,
    },
    /// A file of several cameras, and none was named.
    #[error("{file}: {} cameras: name one of {} with --camera", names.len(), names.join(", "))]
    Several {
        /// The file.
        file: String,
        /// Their names.
        names: Vec<String>,
    },
    /// No camera of the name.
    #[error("{file}: no camera `{name}`; there are: {}", names.join(", "))]
    NoSuchCamera {
        /// The file.
        file: String,
        /// The name asked for.
        name: String,
        /// The names there are.
        names: Vec<String>,
    },
    /// No camera has these numbers.
    #[error("{file}: {reason}")]
    NoCamera {
        /// The file.
        file: String,
        /// Which, and what would do.
        reason: String,
    },
    /// Neither contents nor ending tell the format.
    #[error("{file}: its format is not known: name it with {option}, one of {}", names.join(", "))]
    Unknown {
        /// The file.
        file: String,
        /// The option that names it.
        option: &'static str,
        /// Formats it may be.
        names: Vec<&'static str>,
    },
    /// The format has no place for something without which this would be another camera.
    #[error("{format} cannot hold {what}: {help}")]
    CannotHold {
        /// The format.
        format: &'static str,
        /// What it cannot hold.
        what: String,
        /// What can be done.
        help: String,
    },
}

/// The names of the lenses that this library has.
fn lens_names() -> String {
    Model::ALL.map(Model::name).join(", ")
}
