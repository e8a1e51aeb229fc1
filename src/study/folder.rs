//! Whose folder is this? One run's: begun once, used by one process at a time, continued only by the same study and code.

use super::manifest::{Difference, Manifest};
use super::shard::{Shard, ShardError};
use super::trial_file::NoParquet;
use calibench::io::write_atomically;
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

/// The folder of one run: `spec.toml`, `manifest.json`, `trials.csv` and `checkpoint.json`, and the results once it is complete.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// Held while the run lasts; the system lets go of it however the process ends.
    _lock: File,
}

/// A file and what the system said about it.
#[derive(Debug, thiserror::Error)]
#[error("{path}: {source}", path = path.display())]
pub struct Located {
    /// The file.
    pub path: PathBuf,
    /// What the system said.
    pub source: io::Error,
}

/// A folder that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// The file system.
    #[error(transparent)]
    File(#[from] Located),
    /// There is a run already.
    #[error("{path} holds a run already: `calibench study resume {path}` continues it, or choose another folder", path = .0.display())]
    Taken(PathBuf),
    /// There is none.
    #[error("{path} holds no run: `calibench study run` begins one", path = .0.display())]
    Missing(PathBuf),
    /// Another process is at it.
    #[error("{path} is in use by another run: wait for it, or choose another folder", path = .0.display())]
    InUse(PathBuf),
    /// A manifest or checkpoint that cannot be read.
    #[error("{path} is damaged: {what}; begin again in another folder", path = path.display())]
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
        differences.iter().map(|d| format!("  {d}")).collect::<Vec<_>>().join("\n"), path = path.display()
    )]
    Differs {
        /// The folder.
        path: PathBuf,
        /// In what.
        differences: Vec<Difference>,
    },
}

impl Folder {
    /// Begins a run.
    pub fn create(path: &Path, spec_text: &str, manifest: &Manifest) -> Result<Folder, FolderError> {
        let located = |source| Located { path: path.to_path_buf(), source };
        fs::create_dir_all(path).map_err(located)?;
        let folder = Folder::lock(path)?;
        if folder.file("manifest.json").exists() {
            return Err(FolderError::Taken(path.to_path_buf()));
        }
        folder.write("spec.toml", spec_text.as_bytes())?;
        // The manifest last: a folder without one holds no run.
        folder.write("manifest.json", manifest.to_text().as_bytes())?;
        Ok(folder)
    }

    /// Opens a run that was begun.
    pub fn open(path: &Path) -> Result<Folder, FolderError> {
        if !path.join("manifest.json").is_file() {
            return Err(FolderError::Missing(path.to_path_buf()));
        }
        Folder::lock(path)
    }

    fn lock(path: &Path) -> Result<Folder, FolderError> {
        let name = path.join(".lock");
        let located = |source| Located { path: name.clone(), source };
        let file = OpenOptions::new().create(true).append(true).open(&name).map_err(located)?;
        match file.try_lock() {
            Ok(()) => Ok(Folder { path: path.to_path_buf(), _lock: file }),
            Err(fs::TryLockError::WouldBlock) => Err(FolderError::InUse(path.to_path_buf())),
            Err(fs::TryLockError::Error(source)) => Err(located(source).into()),
        }
    }

    /// A file of the folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a file whole or not at all.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), FolderError> {
        let path = self.file(name);
        write_atomically(&path, bytes).map_err(|source| Located { path, source }.into())
    }

    /// Text of a file.
    pub fn read(&self, name: &str) -> Result<String, FolderError> {
        let path = self.file(name);
        fs::read_to_string(&path).map_err(|source| Located { path, source }.into())
    }

    /// The manifest.
    pub fn manifest(&self) -> Result<Manifest, FolderError> {
        serde_json::from_str(&self.read("manifest.json")?)
            .map_err(|e| self.damaged("manifest.json", e.to_string()))
    }

    /// Which part of its study the run does.
    pub fn shard(&self) -> Result<Shard, FolderError> {
        self.manifest()?.shard.parse().map_err(|e: ShardError| self.damaged("manifest.json", e.to_string()))
    }

    /// Refuses if what would be run now is not what was begun.
    pub fn check(&self, now: &Manifest) -> Result<Manifest, FolderError> {
        let then = self.manifest()?;
        let differences = then.differences(now);
        if differences.is_empty() {
            Ok(then)
        } else {
            Err(FolderError::Differs { path: self.path.clone(), differences })
        }
    }

    pub(super) fn damaged(&self, name: &str, what: impl Into<String>) -> FolderError {
        FolderError::Damaged { path: self.file(name), what: what.into() }
    }
}
