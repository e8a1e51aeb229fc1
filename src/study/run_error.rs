//! Why can a run not go on?

use super::folder_error::FolderError;
use super::spec_error::SpecError;

/// A run that cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The study's file.
    #[error(transparent)]
    Spec(#[from] SpecError),
    /// The folder of results.
    #[error(transparent)]
    Folder(#[from] FolderError),
}
