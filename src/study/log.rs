//! How does a run survive an interruption? Trials are appended, made durable, and only then counted in a
//! checkpoint.

use super::engine::{Engine, Interruption, Outcome, Pace};
use super::folder::Folder;
use super::folder_error::{FolderError, Located};
use super::manifest::Manifest;
use super::replay::{Lines, Replay, Source};
use super::run_error::RunError;
use super::tables;
use super::trial::Trial;
use super::trial_file::TrialFile;
use calibench::io::files::Files;
use calibench::io::hash::hexadecimal;
use calibench::io::input::open_without_waiting;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// What is known to be on the disk.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Checkpoint {
    /// [`Manifest::identity`] of the run whose trials it counts; empty in files of versions that did not
    /// write it.
    #[serde(default)]
    pub(super) run: String,
    pub(super) batches: u64,
    pub(super) bytes: u64,
    pub(super) sha256: String,
}

impl Checkpoint {
    pub(super) fn to_text(&self) -> String {
        serde_json::to_string(self).expect("a checkpoint holds nothing that JSON cannot")
    }
}

/// The end of `trials.csv`, with the running hash of what is before.
pub(super) struct Log {
    file: File,
    path: PathBuf,
    bytes: u64,
    hash: Sha256,
    /// Identity of the run.
    run: String,
}

impl Folder {
    /// Continues the trials where the checkpoint says, to the end or until asked to stop.
    pub fn run(
        &self,
        engine: &mut Engine,
        stop: &Interruption,
        report: impl FnMut(&Pace),
    ) -> Result<Outcome, RunError> {
        if !self.has_log()? {
            let mut replay = self.trials(engine)?;
            while replay.batch(engine)? {}
            return Ok(Outcome::Complete);
        }
        let mut log = self.replay(engine)?;
        let mut batches = engine.batches;
        let keep = |trials: &[Trial]| {
            batches += 1;
            self.append(&mut log, tables::rows(trials).as_bytes(), batches)?;
            Ok(())
        };
        engine.drive(stop, keep, report)
    }

    /// Puts the trials of a complete run into the file that its manifest names; SHA-256 of that.
    pub(super) fn put_trials(&self, engine: &Engine, manifest: &Manifest) -> Result<String, FolderError> {
        let path = self.file(manifest.trials.name());
        match manifest.trials {
            TrialFile::Csv => return Ok(self.checkpoint()?.sha256),
            // Complete before, so the log may be gone.
            TrialFile::Parquet if manifest.complete => {}
            TrialFile::Parquet => {
                let mut lines = self.lines(&self.checkpoint()?, engine)?.0;
                let located = |cause| Located { path: path.clone(), cause };
                let unfinished = self.file(".trials.parquet");
                let mut written =
                    Written { files: self.files.as_ref(), file: File::create(&unfinished).map_err(located)? };
                super::parquet::write(&mut written, &path, engine, manifest, lines.as_mut())?;
                self.files
                    .sync(&written.file)
                    .and_then(|()| self.files.rename(&unfinished, &path))
                    .map_err(located)?;
            }
        }
        Ok(hexadecimal(&hash_of(&path, u64::MAX)?.0))
    }

    /// Removes the log of a complete run whose trials stand elsewhere.
    pub(super) fn drop_log(&self, manifest: &Manifest) -> Result<(), FolderError> {
        if manifest.trials == TrialFile::Csv {
            return Ok(());
        }
        for path in [TrialFile::Csv.name(), "checkpoint.json"].map(|name| self.file(name)) {
            match self.files.remove(&path) {
                Err(cause) if cause.kind() != io::ErrorKind::NotFound => {
                    return Err(Located { path, cause }.into());
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Whether the run's trials stand in its log; of a complete run whose trials were put elsewhere the log
    /// is gone.
    fn has_log(&self) -> Result<bool, FolderError> {
        let manifest = self.manifest()?;
        Ok(!manifest.complete || manifest.trials == TrialFile::Csv)
    }

    /// The trials on the disk, from the first; their hash is compared before any is read.
    pub(super) fn trials(&self, engine: &Engine) -> Result<Replay, FolderError> {
        let manifest = self.manifest()?;
        if !(manifest.complete && manifest.trials == TrialFile::Parquet) {
            let checkpoint = self.checkpoint()?;
            let (source, _) = self.lines(&checkpoint, engine)?;
            return Ok(Replay::new(source, self.file(TrialFile::Csv.name())).counting(checkpoint.batches));
        }
        let path = self.file(TrialFile::Parquet.name());
        let expected = manifest.files.get(TrialFile::Parquet.name());
        let found = hexadecimal(&hash_of(&path, u64::MAX)?.0);
        if expected != Some(&found) {
            return Err(changed(&path));
        }
        Ok(Replay::new(super::parquet::open(&path, engine)?, path))
    }

    /// The log as far as the checkpoint counts it, and the running hash of that.
    fn lines(
        &self,
        checkpoint: &Checkpoint,
        engine: &Engine,
    ) -> Result<(Box<dyn Source>, Sha256), FolderError> {
        let path = self.file(TrialFile::Csv.name());
        let (hash, length) = hash_of(&path, checkpoint.bytes)?;
        if length < checkpoint.bytes {
            let what = format!("{length} bytes, but the checkpoint counts {}", checkpoint.bytes);
            return Err(self.damaged(TrialFile::Csv.name(), what));
        }
        if hexadecimal(&hash) != checkpoint.sha256 {
            return Err(changed(&path));
        }
        let file = open_without_waiting(&path).map_err(|cause| Located { path: path.clone(), cause })?;
        let header = tables::header(&engine.quantities);
        let lines = Lines::open(file, checkpoint.bytes, path, &header, engine.quantities.len())?;
        Ok((Box::new(lines), hash))
    }

    /// The checkpoint, which must be of the run that the manifest describes: trials of another study, part or
    /// code are not taken over.
    pub(super) fn checkpoint(&self) -> Result<Checkpoint, FolderError> {
        let checkpoint: Checkpoint = serde_json::from_str(&self.read("checkpoint.json")?)
            .map_err(|e| self.damaged("checkpoint.json", e.to_string()))?;
        let expected = self.manifest()?.identity();
        if checkpoint.run != expected {
            let path = self.file("checkpoint.json");
            return Err(FolderError::Foreign { path, found: checkpoint.run, expected });
        }
        Ok(checkpoint)
    }

    /// Takes in the trials that the checkpoint vouches for, and cuts off what was written after it.
    pub(super) fn replay(&self, engine: &mut Engine) -> Result<Log, FolderError> {
        let path = self.file(TrialFile::Csv.name());
        let located = |cause| Located { path: path.clone(), cause };
        let manifest = self.manifest()?;
        let is_counted = self.file("checkpoint.json").exists();
        // What is done is neither done again nor believed without what counts it.
        if manifest.complete && !is_counted {
            return Err(self.damaged("checkpoint.json", "it is missing, and the run was complete"));
        }
        if is_counted && !path.exists() {
            return Err(
                self.damaged(TrialFile::Csv.name(), "it is missing, and checkpoint.json counts its trials")
            );
        }
        let file = OpenOptions::new().append(true).create(true).open(&path).map_err(located)?;
        let run = manifest.identity();
        let mut log = Log { file, path: path.clone(), bytes: 0, hash: Sha256::new(), run };
        if !is_counted {
            self.files.cut(&log.file, 0).map_err(located)?;
            self.append(&mut log, tables::header(&engine.quantities).as_bytes(), 0)?;
            return Ok(log);
        }
        let checkpoint = self.checkpoint()?;
        let (source, hash) = self.lines(&checkpoint, engine)?;
        self.files.cut(&log.file, checkpoint.bytes).map_err(located)?;
        (log.bytes, log.hash) = (checkpoint.bytes, hash);
        let mut replay = Replay::new(source, path).counting(checkpoint.batches);
        while replay.batch(engine)? {}
        Ok(log)
    }

    /// Trials first, on the disk; then the checkpoint that counts them.
    fn append(&self, log: &mut Log, bytes: &[u8], batches: u64) -> Result<(), FolderError> {
        self.files
            .write(&mut log.file, bytes)
            .and_then(|()| self.files.sync(&log.file))
            .map_err(|cause| Located { path: log.path.clone(), cause })?;
        log.bytes += bytes.len() as u64;
        log.hash.update(bytes);
        let (run, sha256) = (log.run.clone(), hexadecimal(&log.hash));
        let checkpoint = Checkpoint { run, batches, bytes: log.bytes, sha256 };
        self.write("checkpoint.json", checkpoint.to_text().as_bytes())
    }
}

/// A file that is written through the folder's operations.
struct Written<'a> {
    files: &'a dyn Files,
    file: File,
}

impl Write for Written<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.files.write(&mut self.file, bytes).map(|()| bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

fn changed(path: &Path) -> FolderError {
    let what = "it is not what was written: its SHA-256 has changed".to_string();
    FolderError::Damaged { path: path.to_path_buf(), what }
}

/// Hash of the first `bytes` bytes of a file, and how many there were.
pub(super) fn hash_of(path: &Path, bytes: u64) -> Result<(Sha256, u64), FolderError> {
    let located = |cause: io::Error| Located { path: path.to_path_buf(), cause };
    let mut file = open_without_waiting(path).map_err(located)?.take(bytes);
    let (mut hash, mut length, mut buffer) = (Sha256::new(), 0, vec![0; 1 << 16]);
    loop {
        match file.read(&mut buffer) {
            Ok(0) => return Ok((hash, length)),
            Ok(count) => {
                hash.update(&buffer[..count]);
                length += count as u64;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(located(error).into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::STUDY;
    use crate::{Shard, Spec, finish};
    use calibench_harness::Build;

    #[test]
    fn a_file_is_hashed_as_far_as_is_asked() {
        let path = std::env::temp_dir().join(format!("calibench-hash-{}", std::process::id()));
        std::fs::write(&path, "abcdef").unwrap();
        let hashed =
            |bytes| hash_of(&path, bytes).map(|(hash, length)| (hexadecimal(&hash), length)).unwrap();
        // FIPS 180-4's example.
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(hashed(3), (abc.to_string(), 3));
        assert_eq!(hashed(u64::MAX).1, 6);
        std::fs::remove_file(path).unwrap();
    }

    /// A run to its end in a folder of its own, and a look at it; the folder is gone afterwards.
    fn ran(trials: TrialFile, look: impl FnOnce(&Folder, &Engine)) {
        let path = std::env::temp_dir().join(format!("calibench-log-{}-{trials}", std::process::id()));
        let spec = Spec::parse(STUDY).unwrap();
        let manifest = Manifest::new(&spec, Shard::WHOLE, &Build::default()).with_trials(trials);
        let folder = Folder::create(&path, STUDY, &manifest).unwrap();
        let mut engine = folder.engine(Shard::WHOLE).unwrap();
        let done = folder.run(&mut engine, &Interruption::default(), |_| ()).unwrap();
        assert_eq!(done, Outcome::Complete);
        finish(&folder, &engine).unwrap();
        look(&folder, &engine);
        drop(folder);
        std::fs::remove_dir_all(path).unwrap();
    }

    #[test]
    fn the_trials_of_a_complete_run_are_read_from_its_own_kind_of_file() {
        ran(TrialFile::Csv, |folder, engine| {
            let again = folder.replayed().unwrap();
            assert_eq!((again.trials(), &again.tallies), (6, &engine.tallies));
        });
    }

    #[cfg(feature = "parquet")]
    #[test]
    fn trials_that_were_put_elsewhere_have_no_log_and_may_be_finished_again() {
        ran(TrialFile::Parquet, |folder, engine| {
            for name in ["trials.csv", "checkpoint.json", ".trials.parquet"] {
                assert!(!folder.file(name).exists(), "{name}");
            }
            let once = folder.manifest().unwrap();
            finish(folder, engine).unwrap();
            assert_eq!(folder.manifest().unwrap(), once);
            assert_eq!(folder.replayed().unwrap().tallies, engine.tallies);
        });
    }
}
