//! How much may come in? Regular files of a known length only: nothing blocks, and nothing grows without end.

use super::shown::ShownPath;
use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, Read};
use std::path::Path;

/// Pixels along a side of an image, as a file or a user states it: thirty times the widest sensor.
pub const MOST_SIDE_PX: usize = 1 << 20;
/// Bytes of a table or a result: a corner file of 100 000 views has 0.4 GB.
pub const MOST_TABLE_BYTES: u64 = 1 << 30;
/// Bytes of a study's file, a manifest or a checkpoint.
pub const MOST_SPEC_BYTES: u64 = 1 << 24;
/// Bytes of an image file: what a photograph of the largest size takes without compression, at 16 bits a
/// sample and four samples.
pub const MOST_IMAGE_BYTES: u64 = 1_600_000_000;

/// Why a file is not read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// The system does not give it.
    #[error("{path}: {cause}")]
    Open {
        /// The file.
        path: String,
        /// What the system said.
        cause: io::Error,
    },
    /// A pipe may block for ever, a device never end, and a folder has no bytes; nor is one a regular file
    /// that does not give at once what it holds.
    #[error("{path}: {kind}, not a regular file: copy what it gives into a file{hint}")]
    NotRegular {
        /// The path.
        path: String,
        /// What it is.
        kind: &'static str,
        /// Another way, where there is one.
        hint: &'static str,
    },
    /// Only a regular file is replaced.
    #[error("{path}: {kind}, where a file is to be written: name another place")]
    NotReplaceable {
        /// The path.
        path: String,
        /// What it is.
        kind: &'static str,
    },
    /// More memory than photographs may take.
    #[error("{path}: needs some {needed} bytes of memory, and the limit is {most}: see --memory")]
    NeedsMemory {
        /// The file.
        path: String,
        /// What it would take.
        needed: u64,
        /// What there is.
        most: u64,
    },
    /// Longer than anything that is meant to be read.
    #[error("{path}: at least {bytes} bytes, and the limit is {most}")]
    TooLong {
        /// The file.
        path: String,
        /// Its length, as far as it is known.
        bytes: u64,
        /// The most there may be.
        most: u64,
    },
}

/// What the system said of a file that it does not give; else the sentence.
impl From<InputError> for io::Error {
    fn from(error: InputError) -> io::Error {
        match error {
            InputError::Open { cause, .. } => cause,
            refused => io::Error::new(io::ErrorKind::InvalidInput, refused),
        }
    }
}

/// Refuses a path to write to where something is that is no regular file: opening a pipe blocks until
/// somebody opens its other end, for writing too.
///
/// # Errors
/// [`InputError::NotReplaceable`].
pub fn replaceable(path: &Path) -> Result<(), InputError> {
    let refused = |kind| Err(InputError::NotReplaceable { path: path.shown(), kind });
    irreplaceable(path).map_or(Ok(()), refused)
}

/// What is there, where no file may take its place: it would be gone for good. Where nothing is, or a link
/// that leads nowhere, one may.
pub(super) fn irreplaceable(path: &Path) -> Option<&'static str> {
    if is_of_the_system(path) {
        return Some("a name of the system");
    }
    std::fs::metadata(path).ok().as_ref().and_then(other_than_a_file)
}

/// Whether a name stands where the system has devices and processes: /dev/stdout may lead to a regular file,
/// and is no place for another. /dev/shm is a disk in memory.
fn is_of_the_system(path: &Path) -> bool {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf());
    let is_below = |folder: &str| absolute.starts_with(folder);
    cfg!(unix) && (is_below("/proc") || is_below("/dev") && !is_below("/dev/shm"))
}

fn regular(path: &Path, seen: &Metadata) -> Result<(), InputError> {
    let kind = other_than_a_file(seen);
    kind.map_or(Ok(()), |kind| Err(InputError::NotRegular { path: path.shown(), kind, hint: "" }))
}

/// What is there, where it is no regular file.
fn other_than_a_file(seen: &Metadata) -> Option<&'static str> {
    (!seen.is_file()).then_some(if seen.is_dir() { "a folder" } else { "a pipe or a device" })
}

/// Opens a regular file of at most `most` bytes, and tells its length. It is looked at before it is opened,
/// since opening a pipe blocks.
///
/// # Errors
/// See [`InputError`].
pub fn open_regular(path: &Path, most: u64) -> Result<(File, u64), InputError> {
    let name = || path.shown();
    let failed = |cause| InputError::Open { path: name(), cause };
    let seen = std::fs::metadata(path).map_err(failed)?;
    regular(path, &seen)?;
    if seen.len() > most {
        return Err(InputError::TooLong { path: name(), bytes: seen.len(), most });
    }
    Ok((open_without_waiting(path).map_err(|cause| unopened(path.shown(), cause))?, seen.len()))
}

/// Opens a file for reading that nobody has to wait for: not for the other end of a pipe that was put in the
/// place of a file, nor for the next line of one of those that Linux calls regular and that wait for it
/// (`/proc/kmsg`). Where there is nothing to read yet, reading fails ([`io::ErrorKind::WouldBlock`]).
///
/// # Errors
/// What the system says.
pub fn open_without_waiting(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK);
    options.open(path)
}

/// What the system said of a file, where it would have to be waited for in words of ours.
pub(super) fn unopened(path: String, cause: io::Error) -> InputError {
    match cause.kind() {
        io::ErrorKind::WouldBlock => {
            InputError::NotRegular { path, kind: "a file that has to be waited for", hint: "" }
        }
        _ => InputError::Open { path, cause },
    }
}

/// The bytes of a regular file.
///
/// # Errors
/// See [`InputError`]; a file that grows beyond the limit while it is read is too long as well.
pub fn read_regular(path: &Path, most: u64) -> Result<Vec<u8>, InputError> {
    let (file, length) = open_regular(path, most)?;
    read_at_most(file, &path.shown(), length as usize, most)
}

/// U+FEFF in UTF-8, which some programs put before a text.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

/// Length of the byte order mark that a text begins with, 0 without one.
pub(super) fn byte_order_mark_len(bytes: &[u8]) -> usize {
    if bytes.starts_with(BYTE_ORDER_MARK) { BYTE_ORDER_MARK.len() } else { 0 }
}

/// The text of a regular file, without a byte order mark.
///
/// # Errors
/// See [`InputError`]; text that is not UTF-8 counts as unreadable.
pub fn read_regular_text(path: &Path, most: u64) -> Result<String, InputError> {
    let mut bytes = read_regular(path, most)?;
    bytes.drain(..byte_order_mark_len(&bytes));
    String::from_utf8(bytes).map_err(|error| InputError::Open {
        path: path.shown(),
        cause: io::Error::new(io::ErrorKind::InvalidData, error.utf8_error()),
    })
}

/// A file that the user named, where `-` is standard input, and what it is called.
///
/// # Errors
/// See [`InputError`].
pub(super) fn open_named(path: &Path, most: u64) -> Result<(String, Box<dyn Read>), InputError> {
    if path.as_os_str() == "-" {
        return Ok(("standard input".to_string(), Box::new(io::stdin().lock())));
    }
    let opened = open_regular(path, most).map_err(|error| match error {
        InputError::NotRegular { path, kind, .. } => {
            InputError::NotRegular { path, kind, hint: ", or send it to standard input and name it -" }
        }
        error => error,
    });
    opened.map(|(file, _)| (path.shown(), Box::new(file) as Box<dyn Read>))
}

fn read_at_most(input: impl Read, name: &str, expected: usize, most: u64) -> Result<Vec<u8>, InputError> {
    let mut bytes = Vec::with_capacity(expected);
    let read = input.take(most + 1).read_to_end(&mut bytes);
    read.map_err(|cause| unopened(name.to_string(), cause))?;
    if bytes.len() as u64 > most {
        return Err(InputError::TooLong { path: name.to_string(), bytes: bytes.len() as u64, most });
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_system_said_is_told_once() {
        use std::error::Error;
        let error = read_regular(Path::new("no/such/file"), 10).unwrap_err();
        assert!(error.to_string().contains("no/such/file: "), "{error}");
        assert!(error.source().is_none(), "a report of the chain would print it again");
    }

    #[test]
    fn what_is_no_regular_file_or_too_long_is_refused_unread() {
        let folder = std::env::temp_dir();
        assert!(matches!(read_regular(&folder, 9), Err(InputError::NotRegular { kind: "a folder", .. })));
        let long = folder.join(format!("calibench-input-{}", std::process::id()));
        std::fs::write(&long, [7; 10]).unwrap();
        assert!(matches!(read_regular(&long, 9), Err(InputError::TooLong { bytes: 10, most: 9, .. })));
        assert_eq!(read_regular(&long, 10).unwrap(), [7; 10]);
        std::fs::remove_file(&long).unwrap();
        assert!(matches!(
            read_at_most(io::repeat(1), "x", 0, 99),
            Err(InputError::TooLong { bytes: 100, .. })
        ));
        #[cfg(unix)]
        assert!(matches!(read_regular(Path::new("/dev/zero"), 9), Err(InputError::NotRegular { .. })));
    }

    /// A pipe stands for whatever has to be waited for: it may take the place of a file after that was looked
    /// at.
    #[test]
    #[cfg(unix)]
    fn nothing_is_waited_for() {
        let pipe = std::env::temp_dir().join(format!("calibench-input-{}.pipe", std::process::id()));
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        // With another end that says nothing, as a file of the system does; without one there would be
        // nothing to wait for.
        let other_end = OpenOptions::new().read(true).write(true).open(&pipe).unwrap();
        let waiting = open_without_waiting(&pipe).unwrap();
        let refused = read_at_most(waiting, "x", 0, 9).unwrap_err().to_string();
        drop(other_end);
        assert!(open_without_waiting(&pipe).is_ok(), "opened without another end");
        std::fs::remove_file(&pipe).unwrap();
        assert!(refused.starts_with("x: a file that has to be waited for, not a regular file"), "{refused}");
    }

    /// Asked of names alone: whoever may do everything would lose the system's name to a file.
    #[test]
    #[cfg(unix)]
    fn no_name_of_the_system_is_a_place_for_a_file() {
        for name in ["/dev/stdout", "/dev/null", "/proc/self/fd/1", "/dev/new"] {
            let refused = replaceable(Path::new(name)).unwrap_err().to_string();
            assert!(refused.ends_with("where a file is to be written: name another place"), "{refused}");
        }
        for name in ["/dev/shm/new", "/device/new", "new"] {
            assert!(replaceable(Path::new(name)).is_ok(), "{name}");
        }
    }
}
