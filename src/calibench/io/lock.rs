//! One process at a time: a file that is held while another is read, changed and written anew.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

/// Waits until no other process holds the file, and holds it until what is returned is dropped; the system
/// lets go of it however the process ends. The file is made, with its folder, if it is not there, and stays.
///
/// # Errors
/// What the system says.
pub fn lock(path: &Path) -> io::Result<File> {
    path.parent().map_or(Ok(()), fs::create_dir_all)?;
    let file = OpenOptions::new().create(true).append(true).open(path)?;
    file.lock()?;
    Ok(file)
}

/// `.NAME.lock` beside a file: what is [`lock`]ed for it, since the file itself is replaced by each write.
pub fn lock_of(path: &Path) -> PathBuf {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    path.with_file_name(format!(".{name}.lock"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_held_is_not_held_by_another_until_it_is_let_go() {
        let path = lock_of(&std::env::temp_dir().join(format!("calibench-lock-{}.csv", std::process::id())));
        let held = lock(&path).unwrap();
        let other = File::open(&path).unwrap();
        assert!(other.try_lock().is_err());
        drop(held);
        assert!(other.try_lock().is_ok());
        fs::remove_file(path).unwrap();
    }
}
