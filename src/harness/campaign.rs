//! How does a measurement that takes minutes end, and go on where it was?

use calibench::io::write_atomically;
use std::path::Path;
use std::process::ExitCode;

/// The exit code of a command; what went wrong goes to standard error.
pub fn exit_code(outcome: Result<(), String>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

/// Writes `head` and what `measured` gives below it, unless the table begins with `head` already: then the present code wrote it.
///
/// # Errors
/// What could not be measured or written, in words.
pub fn write_unless_current(
    path: &Path,
    head: &str,
    measured: impl FnOnce() -> Result<String, String>,
) -> Result<(), String> {
    let before = std::fs::read_to_string(path).unwrap_or_default();
    if before.lines().next() == Some(head) {
        return Ok(());
    }
    let text = format!("{head}\n{}", measured()?);
    write_atomically(path, text.as_bytes()).map_err(|error| error.to_string())
}
