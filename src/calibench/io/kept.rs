//! Which files must a program not replace? Those that it was given to read: photographs, measured targets and
//! corner files may exist once only.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::RwLock;

static KEPT: RwLock<Vec<PathBuf>> = RwLock::new(Vec::new());

/// Names files that nothing of this process replaces from now on:
/// [`write_atomically`](super::write_atomically) and all that writes as it does refuse to. For programs,
/// which know what they were given to read; a file that is not there is not named.
pub fn keep_files<'a>(files: impl IntoIterator<Item = &'a Path>) {
    let places = files.into_iter().filter(|file| file.is_file()).flat_map(places);
    let mut kept = KEPT.write().unwrap_or_else(|poisoned| poisoned.into_inner());
    kept.extend(places);
}

/// Whether a file is one of those that [`keep_files`] named.
pub fn is_kept(file: &Path) -> bool {
    let kept = KEPT.read().unwrap_or_else(|poisoned| poisoned.into_inner());
    !kept.is_empty() && place(file).is_some_and(|place| kept.contains(&place))
}

/// An error where a file is kept.
pub(super) fn refuse_kept(file: &Path) -> io::Result<()> {
    if !is_kept(file) {
        return Ok(());
    }
    let said = "it is a file that this command was given to read, and would be replaced: name another folder or file";
    Err(io::Error::new(io::ErrorKind::InvalidInput, said))
}

/// A file's own place, and that of what it leads to where it is a link: without either it could not be read
/// again.
fn places(file: &Path) -> Vec<PathBuf> {
    place(file).into_iter().chain(file.canonicalize()).collect()
}

/// Where a name stands, with no link on the way to it; a link itself is not followed, since a file that is
/// put in its place leaves what it leads to alone. `None` where nothing stands.
fn place(file: &Path) -> Option<PathBuf> {
    let is_link = file.symlink_metadata().ok()?.file_type().is_symlink();
    if !is_link {
        return file.canonicalize().ok();
    }
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    Some(folder.canonicalize().ok()?.join(file.file_name()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::write_atomically;
    use std::fs;

    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("calibench-kept-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        folder
    }

    #[test]
    fn a_file_that_was_read_is_not_replaced_under_any_of_its_names() {
        let folder = folder("names");
        let at = |name: &str| folder.join(name);
        let (once, other, new) = (at("once.csv"), at("other.csv"), at("new.csv"));
        fs::write(&once, "once").unwrap();
        fs::write(&other, "other").unwrap();
        keep_files([once.as_path(), new.as_path()]);
        for name in [once.clone(), folder.join(".").join("once.csv")] {
            let refused = write_atomically(&name, b"else").unwrap_err().to_string();
            assert!(refused.contains("given to read"), "{refused}");
        }
        assert_eq!(fs::read(&once).unwrap(), b"once");
        // What was not there when files were named, and others, are written.
        write_atomically(&new, b"new").unwrap();
        write_atomically(&other, b"else").unwrap();
        fs::remove_dir_all(folder).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_link_that_was_read_keeps_itself_and_what_it_leads_to() {
        let folder = folder("links");
        let at = |name: &str| folder.join(name);
        fs::write(at("far"), "far").unwrap();
        for link in ["near", "beside"] {
            std::os::unix::fs::symlink(at("far"), at(link)).unwrap();
        }
        keep_files([at("near").as_path()]);
        assert!(write_atomically(&at("near"), b"else").is_err());
        assert!(write_atomically(&at("far"), b"else").is_err());
        // Another link gives way to a file, and leaves the first alone.
        write_atomically(&at("beside"), b"else").unwrap();
        assert_eq!(fs::read(at("near")).unwrap(), b"far");
        fs::remove_dir_all(folder).unwrap();
    }
}
