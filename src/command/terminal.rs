//! How are results told? On standard output, messages on standard error; a reader that has gone away is no
//! error, a disk that is full is.

use super::Exit;
use super::startup::standard_output;
use calibench::io::shown::{on_one_line, shown};
use std::io::{self, Write};
use std::sync::OnceLock;

/// Why standard output could not be written, once it could not. Verbs go on, since their files count for
/// themselves; [`ended`] tells.
static LOST: OnceLock<String> = OnceLock::new();

/// Writes to standard output. Whoever closed the pipe has read enough; any other failure makes the run
/// incomplete, see `ended`.
pub fn print(text: &str) {
    let mut out = io::stdout().lock();
    let written = standard_output().and_then(|()| out.write_all(shown(text).as_bytes()));
    note(written.and_then(|()| out.flush()));
}

/// Writes a line to standard error. A line break in it came from a name or a field, and stands as its number.
pub fn warn(text: &str) {
    warn_lines(&on_one_line(text));
}

/// Writes a message of several lines to standard error.
pub(super) fn warn_lines(text: &str) {
    // There is nobody left to tell of a failure.
    let _ = writeln!(io::stderr().lock(), "{}", shown(text));
}

/// Help and version end well, a wrong argument does not; clap knows which stream each belongs to. What is
/// wrong is told without colours: a name or a line of a file that stands in it could bring its own.
pub(super) fn usage(error: &clap::Error) -> Exit {
    if error.use_stderr() {
        warn_lines(error.render().to_string().trim_end());
        return Exit::Usage;
    }
    note(standard_output().and_then(|()| error.print()));
    Exit::Held
}

/// Whether all that was printed so far has reached standard output, or a reader that had read enough.
pub(super) fn has_arrived() -> bool {
    LOST.get().is_none()
}

/// The exit of a run, which is incomplete if what it printed did not arrive.
pub(super) fn ended(exit: Exit) -> Exit {
    let Some(why) = LOST.get() else { return exit };
    warn(&format!("standard output could not be written, so what was printed is not complete: {why}"));
    exit.max(Exit::Incomplete)
}

/// Keeps the first failure that is not the reader's choice.
fn note(written: io::Result<()>) {
    if let Err(error) = written
        && error.kind() != io::ErrorKind::BrokenPipe
    {
        LOST.get_or_init(|| error.to_string());
    }
}
