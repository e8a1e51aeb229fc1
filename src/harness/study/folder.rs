//! How does a run survive an interruption? Trials are appended, made durable, and only then counted in a checkpoint.

use super::engine::{Engine, Interruption, Outcome, Pace, RunError};
use super::manifest::{Difference, Manifest};
use super::tables;
use super::trial::Trial;
use crate::io::write_atomically;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufRead, BufReader, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The folder of one run: `spec.toml`, `manifest.json`, `trials.csv`, `checkpoint.json`, and the results once it is complete.
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

/// What is known to be on the disk.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Checkpoint {
    batches: u64,
    bytes: u64,
    sha256: String,
}

/// The end of `trials.csv`, with the running hash of what is before.
pub(super) struct Log {
    file: File,
    path: PathBuf,
    bytes: u64,
    hash: Sha256,
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

    /// SHA-256 of `trials.csv`, as the checkpoint vouches for it.
    pub(super) fn trials_sha256(&self) -> Result<String, FolderError> {
        let text = self.read("checkpoint.json")?;
        let checkpoint: Checkpoint =
            serde_json::from_str(&text).map_err(|e| self.damaged("checkpoint.json", e.to_string()))?;
        Ok(checkpoint.sha256)
    }

    fn damaged(&self, name: &str, what: impl Into<String>) -> FolderError {
        FolderError::Damaged { path: self.file(name), what: what.into() }
    }

    /// Continues the trials where the checkpoint says, to the end or until asked to stop.
    pub fn run(
        &self,
        engine: &mut Engine,
        stop: &Interruption,
        tell: impl FnMut(&Pace),
    ) -> Result<Outcome, RunError> {
        let mut log = self.replay(engine)?;
        let mut batches = engine.batches;
        let keep = |trials: &[Trial]| {
            batches += 1;
            self.append(&mut log, tables::rows(trials).as_bytes(), batches)?;
            Ok(())
        };
        engine.drive(stop, keep, tell)
    }

    /// Takes in the trials that the checkpoint vouches for, and cuts off what was written after it.
    pub(super) fn replay(&self, engine: &mut Engine) -> Result<Log, FolderError> {
        let header = tables::header(&engine.quantities);
        let path = self.file("trials.csv");
        let located = |source| Located { path: path.clone(), source };
        let file = OpenOptions::new().read(true).append(true).create(true).open(&path).map_err(located)?;
        let mut log = Log { file, path: path.clone(), bytes: 0, hash: Sha256::new() };
        if !self.file("checkpoint.json").exists() {
            log.file.set_len(0).map_err(located)?;
            self.append(&mut log, header.as_bytes(), 0)?;
            return Ok(log);
        }
        let checkpoint: Checkpoint = serde_json::from_str(&self.read("checkpoint.json")?)
            .map_err(|e| self.damaged("checkpoint.json", e.to_string()))?;
        let length = log.file.metadata().map_err(located)?.len();
        if length < checkpoint.bytes {
            let what = format!("{length} bytes, but the checkpoint counts {}", checkpoint.bytes);
            return Err(self.damaged("trials.csv", what));
        }
        log.file.set_len(checkpoint.bytes).map_err(located)?;
        log.file.seek(SeekFrom::Start(0)).map_err(located)?;
        let mut reader = Replay::new(BufReader::new(&log.file), path.clone());
        reader.expect_header(&header)?;
        while reader.batch(engine)? {}
        (log.bytes, log.hash) = (reader.bytes, reader.hash);
        let found = hexadecimal(&log.hash);
        if found != checkpoint.sha256 || engine.batches != checkpoint.batches {
            return Err(self.damaged("trials.csv", "it is not what was written: its SHA-256 has changed"));
        }
        Ok(log)
    }

    /// Trials first, on the disk; then the checkpoint that counts them.
    fn append(&self, log: &mut Log, bytes: &[u8], batches: u64) -> Result<(), FolderError> {
        self.append_only(log, bytes)?;
        self.checkpoint(log, batches)
    }

    /// Trials that no checkpoint counts yet.
    pub(super) fn append_only(&self, log: &mut Log, bytes: &[u8]) -> Result<(), FolderError> {
        log.file.write_all(bytes).map_err(|source| Located { path: log.path.clone(), source })?;
        log.bytes += bytes.len() as u64;
        log.hash.update(bytes);
        Ok(())
    }

    pub(super) fn checkpoint(&self, log: &mut Log, batches: u64) -> Result<(), FolderError> {
        log.file.sync_data().map_err(|source| Located { path: log.path.clone(), source })?;
        let checkpoint = Checkpoint { batches, bytes: log.bytes, sha256: hexadecimal(&log.hash) };
        let text = serde_json::to_string(&checkpoint).expect("a checkpoint holds nothing that JSON cannot");
        self.write("checkpoint.json", text.as_bytes())
    }
}

fn hexadecimal(hash: &Sha256) -> String {
    hash.clone().finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Reads `trials.csv` batch by batch.
pub(super) struct Replay<R> {
    reader: R,
    path: PathBuf,
    line: String,
    number: usize,
    bytes: u64,
    hash: Sha256,
}

impl<R: BufRead> Replay<R> {
    pub(super) fn new(reader: R, path: PathBuf) -> Replay<R> {
        Replay { reader, path, line: String::new(), number: 0, bytes: 0, hash: Sha256::new() }
    }

    /// The next line, without its end; `None` after the last.
    fn next_line(&mut self) -> Result<Option<&str>, FolderError> {
        self.line.clear();
        let read = self.reader.read_line(&mut self.line);
        let count = read.map_err(|source| Located { path: self.path.clone(), source })?;
        self.number += 1;
        self.bytes += count as u64;
        self.hash.update(self.line.as_bytes());
        Ok((count > 0).then(|| self.line.trim_end()))
    }

    pub(super) fn expect_header(&mut self, header: &str) -> Result<(), FolderError> {
        let held = self.next_line()? == Some(header.trim_end());
        if held { Ok(()) } else { Err(self.damaged("its first line is not that of this study")) }
    }

    /// Reads the batch that the engine expects next; whether there was one.
    pub(super) fn batch(&mut self, engine: &mut Engine) -> Result<bool, FolderError> {
        let Some(trials) = self.trials(engine)? else { return Ok(false) };
        let unit = engine.next().expect("trials were read for the batch that comes next");
        engine.absorb(unit, &trials);
        Ok(true)
    }

    /// The trials of the batch that the engine expects next; `None` at the end of the file.
    pub(super) fn trials(&mut self, engine: &Engine) -> Result<Option<Vec<Trial>>, FolderError> {
        let Some((cell, batch)) = engine.next() else {
            return match self.next_line()? {
                None => Ok(None),
                Some(_) => Err(self.damaged("more trials than the study has")),
            };
        };
        let mut trials = Vec::new();
        for index in engine.trials_of(batch) {
            let quantities = engine.quantities.len();
            let trial = match self.next_line()? {
                None if trials.is_empty() => return Ok(None),
                None => return Err(self.damaged("it ends within a batch")),
                Some(line) => tables::parse_row(line, quantities),
            };
            match trial {
                Some(trial) if trial.cell == cell && trial.trial == index => trials.push(trial),
                _ => return Err(self.damaged(&format!("not trial {index} of cell {cell}"))),
            }
        }
        Ok(Some(trials))
    }

    fn damaged(&self, what: &str) -> FolderError {
        FolderError::Damaged { path: self.path.clone(), what: format!("line {}: {what}", self.number) }
    }
}
