//! What does a program without the feature `parquet` say of Parquet files? That it cannot read or write them,
//! and what helps.

use super::engine::Engine;
use super::folder_error::FolderError;
use super::manifest::Manifest;
use super::replay::Source;
use super::trial_file::NoParquet;
use std::io::Write;
use std::path::Path;

pub(super) fn write(
    _: impl Write + Send,
    _: &Path,
    _: &Engine,
    _: &Manifest,
    _: &mut dyn Source,
) -> Result<(), FolderError> {
    Err(NoParquet.into())
}

pub(super) fn open(_: &Path, _: &Engine) -> Result<Box<dyn Source>, FolderError> {
    Err(NoParquet.into())
}
