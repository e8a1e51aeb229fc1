//! How are results told? On standard output, messages on standard error; a reader that has gone away is no error.

use super::Exit;
use std::io::Write;

/// Writes to standard output. Whoever closed the pipe has read enough.
pub fn print(text: &str) {
    let mut out = std::io::stdout().lock();
    // A closed pipe is the reader's choice, and there is nobody left to tell of any other failure.
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

/// Writes a line to standard error.
pub fn warn(text: &str) {
    // As above.
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Help and version end well, a wrong argument does not; clap knows which stream each belongs to.
pub(super) fn usage(error: &clap::Error) -> Exit {
    let _ = error.print();
    if error.use_stderr() { Exit::Usage } else { Exit::Held }
}
