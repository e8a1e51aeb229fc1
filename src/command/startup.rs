//! What must be known and set before anything is written? Whether there is a standard output, and that too
//! large a file is an error of the write and not the end of the program.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the program was started without a standard output.
static CLOSED: AtomicBool = AtomicBool::new(false);

// Before `main`: the run-time library puts /dev/null in the place of a standard output that is closed, and
// nobody can tell it from one that the user asked for. The function asks the system for one copy of a file
// descriptor, and nothing else of the run-time library.
#[cfg(unix)]
ctor::declarative::ctor! {
    #[ctor(unsafe)]
    fn look_at_standard_output() {
        use std::os::fd::AsFd;
        let copied = io::stdout().as_fd().try_clone_to_owned();
        let closed = copied.is_err_and(|error| error.raw_os_error() == Some(nix::errno::Errno::EBADF as i32));
        CLOSED.store(closed, Ordering::Relaxed);
    }
}

/// Fails where the program was started without a standard output.
pub(super) fn standard_output() -> io::Result<()> {
    if CLOSED.load(Ordering::Relaxed) {
        return Err(io::Error::other("it was closed when the program was started"));
    }
    Ok(())
}

/// Makes a write beyond the largest file that the shell allows (`ulimit -f`) fail like one on a full disk, so
/// that what was begun is removed. Otherwise the system ends the program by a signal. Threads that are
/// started later do as this one.
pub(super) fn take_large_files_for_errors() {
    #[cfg(unix)]
    {
        use nix::sys::signal::{SigSet, Signal};
        // It fails for numbers that are no signals.
        let _ = SigSet::from(Signal::SIGXFSZ).thread_block();
    }
}
