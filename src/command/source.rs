//! What is said of where input comes from? Its name, and a last line that has no end.

use calibench::io::ShownPath;
use calibench::io::table::unended_line;
use std::path::Path;

/// The name of a file without the folders that it lies in.
pub(super) fn last_part(file: &Path) -> String {
    file.file_name().map_or_else(|| file.shown(), |name| Path::new(name).shown())
}

/// What is to be said of a table whose last line has no end.
pub(super) fn unended(name: &str, bytes: &[u8]) -> Option<String> {
    let line = unended_line(bytes)?;
    Some(format!(
        "{name}:{line}: this last line has no end: if the file was cut off there, its last number is another's beginning"
    ))
}
