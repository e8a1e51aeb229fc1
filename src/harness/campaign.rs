//! What do commands that measure for minutes share: how they end, go on where they were, and name what they asked?

use calibench::io::input::MOST_TABLE_BYTES;
use calibench::io::{read_regular_text, write_atomically};
use std::path::Path;
use std::process::{Command, ExitCode};

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
    let before = read_regular_text(path, MOST_TABLE_BYTES).unwrap_or_default();
    if before.lines().next() == Some(head) {
        return Ok(());
    }
    let text = format!("{head}\n{}", measured()?);
    write_atomically(path, text.as_bytes()).map_err(|error| error.to_string())
}

/// The versions of modules of a Python, as `NAME VERSION, NAME VERSION`.
///
/// # Errors
/// A Python that does not start, or lacks one of them, in words.
pub fn python_versions(python: &str, modules: &[&str]) -> Result<String, String> {
    let names = modules.join(", ");
    let told = modules
        .iter()
        .map(|module| format!("'{module} ' + {module}.__version__"))
        .collect::<Vec<_>>()
        .join(", ");
    let asks = format!("import {names}\nprint(', '.join([{told}]))");
    let done = Command::new(python).args(["-c", &asks]).output().map_err(|e| format!("{python}: {e}"))?;
    if !done.status.success() {
        let lines = String::from_utf8_lossy(&done.stderr).into_owned();
        return Err(format!(
            "{python} lacks {names}: {}; name a Python that has them with --python",
            lines.lines().last().unwrap_or_default()
        ));
    }
    Ok(String::from_utf8_lossy(&done.stdout).trim().to_string())
}
