//! How did a reference measure each time? Histories: `when,value`, one line a check, the newest last.

use super::table::{Column, Row, TableError, read_table};

/// One check.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// When it was made, in words of the file's own.
    pub when: String,
    /// What was measured.
    pub value: f64,
}

/// Reads a history from bytes; `file` names it in errors.
///
/// # Errors
/// See [`TableError`].
///
/// ```
/// let checks = calibench::io::parse_checks("history.csv", b"when,value\nmonday,25.001\n")?;
/// assert_eq!(checks[0].value, 25.001);
/// # Ok::<(), calibench::io::TableError>(())
/// ```
pub fn parse_checks(file: &str, bytes: &[u8]) -> Result<Vec<Check>, TableError> {
    let check = |Row { names: [when], numbers: [value], .. }: Row<1, 1>| Check { when, value };
    Ok(read_table(file, bytes, ["when"], [Column::length("value")])?.into_iter().map(check).collect())
}
