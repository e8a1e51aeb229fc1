//! Why can a folder not be used?

use super::manifest::Difference;
use super::trial_file::NoParquet;
use calibench::io::ShownPath;
use calibench::io::input::InputError;
use std::io;
use std::path::PathBuf;

/// A file and what the system said about it.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {cause}", path = path.shown())]
pub struct Located {
    /// The file.
    pub path: PathBuf,
    /// What the system said.
    pub cause: io::Error,
}

/// A folder that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The file system.
    #[error(transparent)]
    File(#[from] Located),
    /// A file that cannot be written or removed; the message names it.
    #[error("{0}")]
    Unwritten(io::Error),
    /// A file that cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// There is a run already.
    #[error("{path} holds a run already: `calibench study resume {path}` continues it, or choose another folder", path = .0.shown())]
    Taken(PathBuf),
    /// Trials without the manifest that says whose they are.
    #[error(
        "{path} holds {found} but no manifest.json, so nobody knows whose trials they are: choose another folder, or move them away",
        path = path.shown()
    )]
    Leftover {
        /// The folder.
        path: PathBuf,
        /// The file of a run that was found.
        found: &'static str,
    },
    /// The trials of another run.
    #[error(
        "{path} counts the trials of another study, part or version of the code (fingerprint {}, this run's is {}): they are not taken \
         over; move it and the trials away, or begin in another folder",
        short(found), short(expected), path = path.shown()
    )]
    Foreign {
        /// The checkpoint.
        path: PathBuf,
        /// Fingerprint that it carries, empty if none.
        found: String,
        /// Fingerprint of the run that the manifest describes.
        expected: String,
    },
    /// There is none.
    #[error("{path} holds no run: `calibench study run` begins one", path = .0.shown())]
    Missing(PathBuf),
    /// What stands in the folder is written elsewhere: a run changes its own files only.
    #[error("{path} is a link: a run writes to its own folder only; remove the link, or begin in another folder", path = .0.shown())]
    Link(PathBuf),
    /// Another process is at it.
    #[error("{path} is in use by another run: wait for it, or choose another folder", path = .0.shown())]
    InUse(PathBuf),
    /// A file stands where a run puts a folder.
    #[error("{path} is no folder, and a run has one of that name: choose another folder for the run", path = .0.shown())]
    NoFolder(PathBuf),
    /// A manifest or checkpoint that cannot be read.
    #[error("{path} is damaged: {what}; begin again in another folder", path = path.shown())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
    /// Built without the feature.
    #[error(transparent)]
    NoParquet(#[from] NoParquet),
    /// Trials of two kinds must not mix.
    #[error(
        "{path} was begun with another specification or other code and is not continued:\n{}\nRestore what differs, or begin again in another folder",
        differences.iter().map(|d| format!("  {d}")).collect::<Vec<_>>().join("\n"), path = path.shown()
    )]
    Differs {
        /// The folder.
        path: PathBuf,
        /// In what.
        differences: Vec<Difference>,
    },
}

/// The beginning of a fingerprint, enough to tell two apart.
fn short(fingerprint: &str) -> &str {
    if fingerprint.is_empty() { "none" } else { fingerprint.get(..12).unwrap_or(fingerprint) }
}
