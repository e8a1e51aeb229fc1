//! Whose folder is this? One run's: begun once, used by one process at a time, continued only by the same
//! study and code.

use super::engine::Engine;
use super::folder_error::{FolderError, Located};
use super::inputs::Inputs;
use super::manifest::Manifest;
use super::run_error::RunError;
use super::shard::{Shard, ShardError};
use calibench::io::atomic::{remove_leftovers, write_atomically_to};
use calibench::io::files::{Disk, Files};
use calibench::io::hash::sha256_hex;
use calibench::io::input::{InputError, MOST_SPEC_BYTES, replaceable};
use calibench::io::read_regular_text;
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// The folder of one run: `spec.toml`, `manifest.json`, `trials.csv` and `checkpoint.json`, and the results
/// once it is complete.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    /// Held while the run lasts; the system lets go of it however the process ends. `None` where what is only
    /// read cannot be locked.
    _lock: Option<File>,
    pub(super) files: Arc<dyn Files>,
}

/// Files that hold trials of a run, or vouch for them.
const OF_A_RUN: [&str; 3] = ["checkpoint.json", "trials.csv", "trials.parquet"];

/// The files that the study names, where it names any.
pub(super) const INPUTS: &str = "inputs.json";

/// Times a lock is tried before the folder counts as in use.
const TRIES: usize = 20;
/// Pause between them: a second in all.
const PAUSE: Duration = Duration::from_millis(50);

/// Locks a file, by one of the ways to do it. A program that this one is starting at this moment holds all of
/// its open files, and the locks of those that were just closed, until it has begun.
fn patiently(lock: impl Fn() -> Result<(), fs::TryLockError>) -> Result<(), fs::TryLockError> {
    for _ in 1..TRIES {
        match lock() {
            Err(fs::TryLockError::WouldBlock) => std::thread::sleep(PAUSE),
            other => return other,
        }
    }
    lock()
}

/// Refuses a folder with links in it, which might lead to anybody's files.
fn refuse_links(path: &Path) -> Result<(), FolderError> {
    let located = |cause| Located { path: path.to_path_buf(), cause };
    for entry in fs::read_dir(path).map_err(located)? {
        let entry = entry.map_err(located)?;
        if entry.file_type().map_err(located)?.is_symlink() {
            return Err(FolderError::Link(entry.path()));
        }
    }
    Ok(())
}

fn refuse_missing(path: &Path) -> Result<(), FolderError> {
    match path.join("manifest.json").is_file() {
        true => Ok(()),
        false => Err(FolderError::Missing(path.to_path_buf())),
    }
}

/// The lock of a folder in which only a run's own regular files stand.
fn refuse_what_is_not_a_runs(path: &Path) -> Result<PathBuf, FolderError> {
    let lock = path.join(".lock");
    // What is opened without being read whole; other files are looked at when they are read.
    for opened in OF_A_RUN.map(|name| path.join(name)).iter().chain([&lock]) {
        replaceable(opened)?;
    }
    refuse_links(path)?;
    Ok(lock)
}

impl Folder {
    /// Begins a run.
    pub fn create(path: &Path, spec_text: &str, manifest: &Manifest) -> Result<Folder, FolderError> {
        Folder::create_on(Arc::new(Disk), path, spec_text, manifest)
    }

    /// Begins a run whose files are changed by the given operations.
    pub fn create_on(
        files: Arc<dyn Files>,
        path: &Path,
        spec_text: &str,
        manifest: &Manifest,
    ) -> Result<Folder, FolderError> {
        let folder = Folder::claim(files, path)?;
        folder.write("spec.toml", spec_text.as_bytes())?;
        if !manifest.contents.is_empty() {
            folder.write(INPUTS, manifest.contents.to_text().as_bytes())?;
        }
        // The manifest last: a folder without one holds no run.
        folder.write("manifest.json", manifest.to_text().as_bytes())?;
        Ok(folder)
    }

    /// A folder for a run, with nothing of one in it yet.
    pub(super) fn claim(files: Arc<dyn Files>, path: &Path) -> Result<Folder, FolderError> {
        let located = |cause| Located { path: path.to_path_buf(), cause };
        files.make_folder(path).map_err(located)?;
        let folder = Folder::lock(files, path)?;
        if folder.file("manifest.json").exists() {
            return Err(FolderError::Taken(path.to_path_buf()));
        }
        if let Some(found) = OF_A_RUN.into_iter().find(|name| folder.file(name).exists()) {
            return Err(FolderError::Leftover { path: path.to_path_buf(), found });
        }
        Ok(folder)
    }

    /// Opens a run that was begun.
    pub fn open(path: &Path) -> Result<Folder, FolderError> {
        Folder::open_on(Arc::new(Disk), path)
    }

    /// Opens a run whose files are changed by the given operations.
    pub fn open_on(files: Arc<dyn Files>, path: &Path) -> Result<Folder, FolderError> {
        refuse_missing(path)?;
        Folder::lock(files, path)
    }

    /// Opens a run to read it, beside others that do. A folder that this user may not write to is read
    /// without a lock where it has none.
    ///
    /// # Errors
    /// A folder that holds no run, or one at which a run is.
    pub fn open_to_read(path: &Path) -> Result<Folder, FolderError> {
        refuse_missing(path)?;
        let name = refuse_what_is_not_a_runs(path)?;
        let folder = |lock| Folder { path: path.to_path_buf(), _lock: lock, files: Arc::new(Disk) };
        let Ok(file) = File::open(&name) else {
            let made = OpenOptions::new().create(true).append(true).open(&name);
            return Ok(folder(made.ok().filter(|file| file.try_lock_shared().is_ok())));
        };
        match patiently(|| file.try_lock_shared()) {
            Ok(()) => Ok(folder(Some(file))),
            Err(fs::TryLockError::WouldBlock) => Err(FolderError::InUse(path.to_path_buf())),
            Err(fs::TryLockError::Error(cause)) => Err(Located { path: name, cause }.into()),
        }
    }

    fn lock(files: Arc<dyn Files>, path: &Path) -> Result<Folder, FolderError> {
        let name = refuse_what_is_not_a_runs(path)?;
        let located = |cause| Located { path: name.clone(), cause };
        let file = OpenOptions::new().create(true).append(true).open(&name).map_err(located)?;
        match patiently(|| file.try_lock()) {
            Ok(()) => Folder { path: path.to_path_buf(), _lock: Some(file), files }.cleaned(),
            Err(fs::TryLockError::WouldBlock) => Err(FolderError::InUse(path.to_path_buf())),
            Err(fs::TryLockError::Error(cause)) => Err(located(cause).into()),
        }
    }

    /// Without what a run that was killed left half written: the lock says that nobody is writing.
    fn cleaned(self) -> Result<Folder, FolderError> {
        let figures = self.file("figures");
        if figures.exists() && !figures.is_dir() {
            return Err(FolderError::NoFolder(figures));
        }
        for folder in [self.path.clone(), self.file("figures")] {
            remove_leftovers(&folder).map_err(FolderError::Unwritten)?;
        }
        Ok(self)
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
        write_atomically_to(self.files.as_ref(), &self.file(name), bytes).map_err(FolderError::Unwritten)
    }

    /// Text of a file.
    pub fn read(&self, name: &str) -> Result<String, FolderError> {
        read_regular_text(&self.file(name), MOST_SPEC_BYTES).map_err(|error| match error {
            InputError::Open { cause, .. } if cause.kind() == io::ErrorKind::InvalidData => {
                self.damaged(name, cause.to_string())
            }
            error => error.into(),
        })
    }

    /// The manifest.
    pub fn manifest(&self) -> Result<Manifest, FolderError> {
        serde_json::from_str(&self.read("manifest.json")?)
            .map_err(|e| self.damaged("manifest.json", e.to_string()))
    }

    /// Refuses a file that is not the one that a complete run left.
    pub fn refuse_altered(&self, name: &str) -> Result<(), FolderError> {
        match self.manifest()?.files.get(name) {
            Some(hash) if *hash != sha256_hex(self.read(name)?.as_bytes()) => {
                Err(self.damaged(name, "it is not the file that the manifest names by its SHA-256"))
            }
            _ => Ok(()),
        }
    }

    /// The files that the study named when the run was begun.
    fn inputs(&self) -> Result<Inputs, FolderError> {
        let hashes = self.manifest()?.inputs;
        if hashes.is_empty() {
            return Ok(Inputs::default());
        }
        let inputs = Inputs::parse(&self.read(INPUTS)?);
        match inputs.filter(|inputs| inputs.hashes() == hashes) {
            Some(inputs) => Ok(inputs),
            None => {
                Err(self.damaged(INPUTS, "its files are not those that the manifest names by their SHA-256"))
            }
        }
    }

    /// The study of the run at its beginning.
    ///
    /// # Errors
    /// A file that cannot be read, or a study that cannot be run as written.
    pub fn engine(&self, shard: Shard) -> Result<Engine, RunError> {
        let engine = Engine::with_inputs(&self.read("spec.toml")?, &self.inputs()?, shard);
        Ok(engine.map_err(|error| self.damaged("spec.toml", error.to_string()))?)
    }

    /// The study of the run with all trials that stand in the folder.
    ///
    /// # Errors
    /// As [`Folder::engine`]; trials that are not those of the run.
    pub fn replayed(&self) -> Result<Engine, RunError> {
        let mut engine = self.engine(self.shard()?)?;
        let mut trials = self.trials(&engine)?;
        while trials.batch(&mut engine)? {}
        Ok(engine)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Spec;
    use crate::example::STUDY;
    use calibench_harness::Build;

    #[test]
    fn trials_of_another_run_are_refused_with_the_beginnings_of_both_fingerprints() {
        let foreign = |found: &str| {
            let (found, expected) = (found.to_string(), "0123456789abcdef".repeat(4));
            FolderError::Foreign { path: "checkpoint.json".into(), found, expected }.to_string()
        };
        let said = foreign(&"fedcba9876543210".repeat(4));
        assert!(said.contains("(fingerprint fedcba987654, this run's is 0123456789ab)"), "{said}");
        assert!(foreign("").contains("(fingerprint none, this"), "{}", foreign(""));
    }

    #[test]
    fn a_result_that_was_altered_is_refused_and_one_that_nothing_vouches_for_is_not() {
        let path = std::env::temp_dir().join(format!("calibench-altered-{}", std::process::id()));
        let mut manifest = Manifest::new(&Spec::parse(STUDY).unwrap(), Shard::WHOLE, &Build::default());
        manifest.files.insert("marks.csv".into(), sha256_hex(b"X,Y\n"));
        let folder = Folder::create(&path, STUDY, &manifest).unwrap();
        let checked = |text: &str| {
            folder.write("marks.csv", text.as_bytes()).unwrap();
            folder.refuse_altered("marks.csv")
        };
        let (same, altered) = (checked("X,Y\n"), checked("X,Y\n0,0\n"));
        let unnamed = folder.refuse_altered("poses.csv");
        std::fs::remove_dir_all(path).unwrap();
        assert!(same.is_ok() && unnamed.is_ok());
        assert!(matches!(altered, Err(FolderError::Damaged { path, .. }) if path.ends_with("marks.csv")));
    }

    #[test]
    fn a_run_keeps_the_files_that_its_study_names() {
        let path = std::env::temp_dir().join(format!("calibench-inputs-{}", std::process::id()));
        let text = STUDY.replace("{ columns = 3, rows = 3, spacing_mm = 10.0 }", "{ file = \"marks.csv\" }");
        let inputs = Inputs::parse(r#"{ "marks.csv": "X,Y\n0,0\n12.5,0\n0,9\n12.5,9.25\n3,4\n" }"#).unwrap();
        let spec = Spec::parse_with(&text, &inputs).unwrap();
        let folder =
            Folder::create(&path, &text, &Manifest::new(&spec, Shard::WHOLE, &Build::default())).unwrap();
        let kept = folder.engine(Shard::WHOLE).map(|engine| engine.cells[0].points.clone());
        // Other marks than those that the run was begun with.
        let other = folder.read(INPUTS).unwrap().replace("12.5", "12.4");
        folder.write(INPUTS, other.as_bytes()).unwrap();
        let foreign = folder.engine(Shard::WHOLE);
        std::fs::remove_dir_all(path).unwrap();
        assert_eq!(kept.unwrap(), Engine::with_inputs(&text, &inputs, Shard::WHOLE).unwrap().cells[0].points);
        assert!(matches!(foreign, Err(RunError::Folder(FolderError::Damaged { .. }))), "{foreign:?}");
    }
}
