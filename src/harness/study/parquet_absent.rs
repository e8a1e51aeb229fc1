//! What does a program without the feature `parquet` say of Parquet files? That it cannot read or write them, and what helps.

use super::engine::Engine;
use super::folder::FolderError;
use super::replay::Source;
use std::io::Write;
use std::path::Path;

pub(super) fn write(
    _: impl Write + Send,
    _: &Path,
    _: &Engine,
    _: &mut dyn Source,
) -> Result<(), FolderError> {
    Err(FolderError::NoParquet)
}

pub(super) fn open(_: &Path, _: &Engine) -> Result<Box<dyn Source>, FolderError> {
    Err(FolderError::NoParquet)
}
