//! A disk that fails when it is told to: what the tests of faults write through.

use calibench::io::files::{Disk, Files};
use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

/// How an operation fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// As if the process were killed: a write is torn, and nothing is done after it.
    Killed,
    /// The disk is full: writes are torn from here on, all else works.
    Full,
}

/// A disk on which the operation of a given number fails.
#[derive(Debug)]
pub struct Failing {
    left: AtomicI64,
    fault: Fault,
}

impl Failing {
    /// Operations are counted from 0.
    pub fn at(operation: i64, fault: Fault) -> Arc<Failing> {
        Arc::new(Failing { left: AtomicI64::new(operation), fault })
    }

    /// Whether the operations that still work are used up.
    fn fails(&self) -> bool {
        self.left.fetch_sub(1, Ordering::SeqCst) <= 0
    }

    /// Whether that operation was reached.
    pub fn has_failed(&self) -> bool {
        self.left.load(Ordering::SeqCst) < 0
    }

    /// An operation that needs no room.
    fn do_unless_killed(&self, work: impl FnOnce() -> io::Result<()>) -> io::Result<()> {
        if self.fails() && self.fault == Fault::Killed {
            return Err(io::Error::other("killed"));
        }
        work()
    }
}

impl Files for Failing {
    fn make_folder(&self, path: &Path) -> io::Result<()> {
        self.do_unless_killed(|| Disk.make_folder(path))
    }

    fn write(&self, file: &mut File, bytes: &[u8]) -> io::Result<()> {
        let was_killed = self.has_failed() && self.fault == Fault::Killed;
        if !self.fails() {
            return Disk.write(file, bytes);
        }
        if !was_killed {
            Disk.write(file, &bytes[..bytes.len() / 2])?;
        }
        Err(io::Error::from(io::ErrorKind::StorageFull))
    }

    fn sync(&self, file: &File) -> io::Result<()> {
        self.do_unless_killed(|| Disk.sync(file))
    }

    fn cut(&self, file: &File, length: u64) -> io::Result<()> {
        self.do_unless_killed(|| Disk.cut(file, length))
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.do_unless_killed(|| Disk.rename(from, to))
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        self.do_unless_killed(|| Disk.remove(path))
    }
}
