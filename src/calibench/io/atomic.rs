//! How is a file replaced so that nobody ever sees half of it? Written beside its place, then renamed.

use super::files::{Disk, Files};
use super::input::{irreplaceable, open_without_waiting};
use super::kept::refuse_kept;
use super::shown::ShownPath;
use std::ffi::{OsStr, OsString};
use std::fs::{self, DirEntry, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Writes a file whole or not at all: a reader, or a run after a crash, finds the old contents or the new.
///
/// The temporary file lies in the same folder, so that the rename stays on one file system. It is removed if
/// writing fails; what a write of the same file that was killed has left is removed first. Folders on the way
/// are created.
///
/// # Errors
/// Whatever the file system says, with the path.
///
/// ```
/// use calibench::io::write_atomically;
///
/// let file = std::env::temp_dir().join("calibench-example-folder").join("result.txt");
/// write_atomically(&file, b"first")?;
/// write_atomically(&file, b"second")?;
/// assert_eq!(std::fs::read(&file)?, b"second");
/// # Ok::<(), std::io::Error>(())
/// ```
pub fn write_atomically(path: &Path, contents: &[u8]) -> io::Result<()> {
    write_atomically_to(&Disk, path, contents)
}

/// As [`write_atomically`], through the given operations.
///
/// # Errors
/// As there.
pub fn write_atomically_to(files: &dyn Files, path: &Path, contents: &[u8]) -> io::Result<()> {
    Beside::write(files, path, contents)?.place()
}

/// Writes files that belong together. All are on the disk before the first of them is put in its place, so a
/// disk that is full changes none. A process that is killed in the moment in which they are put there, one
/// after the other, leaves the last ones old: where the last is new, all are.
///
/// # Errors
/// As [`write_atomically`].
pub fn write_together(contents: &[(PathBuf, Vec<u8>)]) -> io::Result<()> {
    write_together_to(&Disk, contents)
}

/// As [`write_together`], through the given operations.
///
/// # Errors
/// As there.
pub fn write_together_to(files: &dyn Files, contents: &[(PathBuf, Vec<u8>)]) -> io::Result<()> {
    let beside: Vec<Beside<'_>> =
        contents.iter().map(|(path, bytes)| Beside::write(files, path, bytes)).collect::<io::Result<_>>()?;
    beside.into_iter().try_for_each(Beside::place)
}

/// Refuses a place where a file could not be written, before the work whose result it is to take. The file's
/// folder is made, and a file beside its place, which is removed.
///
/// # Errors
/// As [`write_atomically`].
pub fn refuse_unwritable_place(path: &Path) -> io::Result<()> {
    Beside::begin(&Disk, path).map(drop)
}

/// A file that is written beside its place, at once or piece by piece. It is removed unless it is put there.
#[derive(Debug)]
pub struct Beside<'a> {
    files: &'a dyn Files,
    path: PathBuf,
    temporary: PathBuf,
    /// Open, and so locked, until the file has its name.
    file: File,
    placed: bool,
}

impl<'a> Beside<'a> {
    /// A file without contents.
    ///
    /// # Errors
    /// As [`write_atomically`]; of every function here.
    pub fn begin(files: &'a dyn Files, path: &Path) -> io::Result<Beside<'a>> {
        let folder = folder_of(path);
        refuse_what_is_no_file(path).and_then(|()| refuse_kept(path)).map_err(with_path(path))?;
        if folder.is_file() {
            let message =
                format!("cannot write {}: {} is a file, name a folder", path.shown(), folder.shown());
            return Err(io::Error::new(io::ErrorKind::NotADirectory, message));
        }
        files.make_folder(folder).map_err(with_path(path))?;
        // What cannot be removed is in nobody's way.
        let _ = remove_leftovers_of(files, folder, path.file_name());
        let (file, temporary) = open_beside(path).map_err(with_path(path))?;
        Ok(Beside { files, path: path.to_path_buf(), temporary, file, placed: false })
    }

    /// A file with all of its contents, on the disk.
    ///
    /// # Errors
    /// What the system says, with the file.
    pub fn write(files: &'a dyn Files, path: &Path, contents: &[u8]) -> io::Result<Beside<'a>> {
        let mut beside = Beside::begin(files, path)?;
        beside.append(contents)?;
        beside.sync()?;
        Ok(beside)
    }

    /// Adds to the contents.
    ///
    /// # Errors
    /// What the system says, with the file.
    pub fn append(&mut self, contents: &[u8]) -> io::Result<()> {
        self.files.write(&mut self.file, contents).map_err(with_path(&self.path))
    }

    /// Waits until the contents are on the disk, as they must be before the rename: else a power cut may
    /// leave the new name without them.
    ///
    /// # Errors
    /// What the system says, with the file.
    pub fn sync(&self) -> io::Result<()> {
        self.files.sync(&self.file).map_err(with_path(&self.path))
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// What the system says, with the file.
    pub fn place(mut self) -> io::Result<()> {
        self.files.rename(&self.temporary, &self.path).map_err(with_path(&self.path))?;
        self.placed = true;
        Ok(())
    }
}

impl Drop for Beside<'_> {
    fn drop(&mut self) {
        if !self.placed {
            // The error that led here is the one to report.
            let _ = self.files.remove(&self.temporary);
        }
    }
}

/// A link to a file is replaced, and its target left alone.
fn refuse_what_is_no_file(path: &Path) -> io::Result<()> {
    let refused = |kind| {
        let what = format!("{kind} is there, and no file: name another");
        Err(io::Error::new(io::ErrorKind::InvalidInput, what))
    };
    irreplaceable(path).map_or(Ok(()), refused)
}

/// The error with the file that could not be written.
fn with_path(path: &Path) -> impl Fn(io::Error) -> io::Error {
    move |error| io::Error::new(error.kind(), format!("cannot write {}: {error}", path.shown()))
}

/// The folder in which a file stands.
fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A new temporary file beside `path`. It is locked as long as it is open: one that nobody locks was left by
/// a process that was killed.
fn open_beside(path: &Path) -> io::Result<(File, PathBuf)> {
    loop {
        let temporary = temporary_beside(path)?;
        match OpenOptions::new().write(true).create_new(true).open(&temporary) {
            // A process of this number in another container, or one that was killed.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
            Ok(file) => {
                // Where the file system knows no locks, nobody can tell what was left, and nothing is
                // removed.
                let _ = file.lock();
                // Another process may have removed it before it was locked.
                if temporary.exists() {
                    return Ok((file, temporary));
                }
            }
        }
    }
}

/// `.name.process.count.tmp` in the folder of `path`: unique among processes and threads.
fn temporary_beside(path: &Path) -> io::Result<PathBuf> {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let name =
        path.file_name().ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "is not a file name"))?;
    let mut hidden = OsString::from(".");
    hidden.push(name);
    hidden.push(format!(".{}.{}.tmp", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed)));
    Ok(path.with_file_name(hidden))
}

/// Removes what writes of processes that were killed have left in a folder, whichever file they wrote.
///
/// # Errors
/// Whatever the file system says, with the path. A folder that is not there holds nothing.
pub fn remove_leftovers(folder: &Path) -> io::Result<()> {
    remove_leftovers_of(&Disk, folder, None)
}

/// The same for the writes of one file, or of any.
fn remove_leftovers_of(files: &dyn Files, folder: &Path, name: Option<&OsStr>) -> io::Result<()> {
    let with_path = |path: &Path, e: io::Error| {
        io::Error::new(e.kind(), format!("cannot remove what a killed run left, {}: {e}", path.shown()))
    };
    let entries = match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        entries => entries.map_err(|error| with_path(folder, error))?,
    };
    let name = name.map(OsStr::to_string_lossy);
    for entry in entries.flatten() {
        let temporary = entry.file_name();
        let temporary = temporary.to_string_lossy();
        let Some(target) = target_of(&temporary) else { continue };
        if name.as_ref().is_none_or(|name| *name == target) {
            remove_abandoned(files, &entry).map_err(|error| with_path(&entry.path(), error))?;
        }
    }
    Ok(())
}

/// The name of the file for which one of [`temporary_beside`] stands.
fn target_of(temporary: &str) -> Option<&str> {
    let number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    let mut parts = temporary.strip_suffix(".tmp")?.rsplitn(3, '.');
    let numbered = number(parts.next()?) && number(parts.next()?);
    parts.next()?.strip_prefix('.').filter(|name| numbered && !name.is_empty())
}

/// Removes a temporary file unless somebody is still writing to it.
fn remove_abandoned(files: &dyn Files, entry: &DirEntry) -> io::Result<()> {
    // Only a regular file is opened: a pipe would wait for its other end.
    if !entry.file_type()?.is_file() {
        return Ok(());
    }
    // It may just have got its name; or it is another user's.
    let Ok(file) = open_without_waiting(&entry.path()) else { return Ok(()) };
    if file.try_lock().is_err() {
        return Ok(());
    }
    match files.remove(&entry.path()) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> PathBuf {
        std::env::temp_dir().join(format!("calibench-atomic-{}-{name}", std::process::id()))
    }

    #[test]
    fn a_file_is_replaced_and_nothing_is_left_beside_it() {
        let folder = folder("replace");
        let path = folder.join("deep/result.json");
        write_atomically(&path, b"old").unwrap();
        write_atomically(&path, b"new").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
        fs::remove_dir_all(folder).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn no_file_takes_the_place_of_what_is_none_and_a_links_target_is_left_alone() {
        let folder = folder("no-file");
        fs::create_dir_all(folder.join("folder")).unwrap();
        let refused = write_atomically(&folder.join("folder"), b"new").unwrap_err();
        assert!(refused.to_string().contains("no file: name another"), "{refused}");
        for name in ["/dev/null", "/dev/stdout", "/dev/calibench-new"] {
            let refused = write_atomically(Path::new(name), b"new").unwrap_err();
            assert!(refused.to_string().contains("a name of the system is there"), "{refused}");
        }
        fs::write(folder.join("target"), b"old").unwrap();
        std::os::unix::fs::symlink("target", folder.join("link")).unwrap();
        write_atomically(&folder.join("link"), b"new").unwrap();
        assert_eq!(fs::read(folder.join("target")).unwrap(), b"old");
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn what_killed_writes_left_is_removed_and_nothing_else() {
        let folder = folder("leftovers");
        let temporary = temporary_beside(&folder.join("result.v2.json")).unwrap();
        fs::create_dir_all(folder.join(".a.1.2.tmp")).unwrap();
        for name in ["result.json", ".lock", ".mine.tmp", "a.1.2.tmp", ".1.2.tmp"] {
            fs::write(folder.join(name), "").unwrap();
        }
        fs::write(temporary, "half").unwrap();
        remove_leftovers(&folder).unwrap();
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 6);
        remove_leftovers(&folder.join("not-there")).unwrap();
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_write_removes_what_a_killed_write_of_the_same_file_left() {
        let folder = folder("same-file");
        let path = folder.join("result.json");
        fs::create_dir_all(&folder).unwrap();
        let left = |name: &str| {
            let left = folder.join(name);
            fs::write(&left, "half").unwrap();
            left
        };
        let (of_this, of_another) = (left(".result.json.42.7.tmp"), left(".report.html.42.8.tmp"));
        write_atomically(&path, b"whole").unwrap();
        assert!(!of_this.exists() && of_another.exists());
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_file_that_is_being_written_is_not_removed_by_another_write_of_it() {
        let folder = folder("rivals");
        let path = folder.join("result.json");
        fs::create_dir_all(&folder).unwrap();
        let (file, slow) = open_beside(&path).unwrap();
        write_atomically(&path, b"quick").unwrap();
        remove_leftovers(&folder).unwrap();
        assert!(slow.exists());
        drop(file);
        remove_leftovers(&folder).unwrap();
        assert!(!slow.exists());
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn many_writes_of_one_file_at_once_all_succeed_and_leave_one_of_them_whole() {
        let folder = folder("many");
        let path = folder.join("result.json");
        std::thread::scope(|scope| {
            for writer in 0..8u8 {
                let path = &path;
                scope.spawn(move || (0..50).for_each(|_| write_atomically(path, &[writer; 1000]).unwrap()));
            }
        });
        let bytes = fs::read(&path).unwrap();
        assert!(bytes.len() == 1000 && bytes.iter().all(|byte| *byte == bytes[0]));
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_failure_names_the_path_and_leaves_nothing() {
        let folder = folder("fail");
        // A folder stands where the file should go: the rename fails.
        let path = folder.join("taken");
        fs::create_dir_all(path.join("inside")).unwrap();
        let error = write_atomically(&path, b"x").unwrap_err();
        assert!(error.to_string().contains("taken"), "{error}");
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 1);
        assert!(write_atomically(Path::new("/"), b"x").is_err());
        fs::remove_dir_all(folder).unwrap();
    }
}
