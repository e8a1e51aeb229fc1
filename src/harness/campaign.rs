//! What do commands that measure for minutes share: how they end, go on where they were, and name what they
//! asked?

use super::fingerprint::Fingerprint;
use calibench::io::input::MOST_TABLE_BYTES;
use calibench::io::{ShownPath, read_regular_text, write_atomically};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
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

/// The one of these programs, or whatever else is measured, that has this name.
///
/// # Errors
/// There is none: the names that there are, in words.
pub fn named<'a, T>(all: &'a [T], name_of: impl Fn(&T) -> &str, name: &str) -> Result<&'a T, String> {
    let names = || all.iter().map(&name_of).collect::<Vec<_>>().join(", ");
    let found = all.iter().find(|one| name_of(one) == name);
    found.ok_or_else(|| format!("no program {name}; there are: {}", names()))
}

/// A table as it is committed below its head: the names of the columns, and a line a row.
pub fn table(header: &str, rows: impl IntoIterator<Item = String>) -> String {
    std::iter::once(header.to_string()).chain(rows).map(|line| line + "\n").collect()
}

/// Writes what was measured to `out`, without that to `NAME.csv` in the folder where it is committed.
///
/// # Errors
/// What could not be written, in words.
pub fn write(out: Option<&Path>, folder: &str, name: &str, text: &str) -> Result<(), String> {
    let path = out.map_or_else(|| Path::new(folder).join(format!("{name}.csv")), PathBuf::from);
    write_atomically(&path, text.as_bytes()).map_err(|error| error.to_string())
}

/// Writes what `measured` gives below a head that names `command` and the present code, unless the present
/// code wrote or confirmed the table already.
///
/// # Errors
/// What could not be measured or written, in words.
pub fn write_unless_current(
    path: &Path,
    present: &Fingerprint,
    command: &str,
    measured: impl FnOnce() -> Result<String, String>,
) -> Result<(), String> {
    let before = read_regular_text(path, MOST_TABLE_BYTES).unwrap_or_default();
    if present.vouches_for(&before, command) {
        return Ok(());
    }
    let text = format!("{}\n{}", present.head(command), measured()?);
    write_atomically(path, text.as_bytes()).map_err(|error| error.to_string())
}

/// A confirmation makes every so manieth row again.
pub const EVERY: usize = 8;

/// Notes in the head of a table, committed as `path`, that the present code has made a part of its rows again
/// and that they are the same, bit for bit. For changes of the code that should move nothing: which rows are
/// made again depends on the code.
///
/// # Errors
/// Rows that cannot be made again or are others, a table that cannot be read or written, in words.
pub fn confirm(path: &Path, present: &Fingerprint, again: &[String]) -> Result<(), String> {
    let text = read_regular_text(path, MOST_TABLE_BYTES).map_err(|error| error.to_string())?;
    let (head, table) = text.split_once('\n').unwrap_or((&text, ""));
    let rows: BTreeSet<&str> = table.lines().skip(1).collect();
    let others: Vec<&String> = again.iter().filter(|row| !rows.contains(row.as_str())).collect();
    if let Some(first) = others.first() {
        let (count, all) = (others.len(), again.len());
        return Err(format!(
            "{}: {count} of {all} rows made again are others; measure them all anew. The first is now {first}",
            path.shown()
        ));
    }
    if again.is_empty() {
        return Err(format!("{}: no row was made again", path.shown()));
    }
    let head = present.head_again(head, again.len(), rows.len());
    write_atomically(path, format!("{head}\n{table}").as_bytes()).map_err(|error| error.to_string())
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_made_again_vouch_for_a_table_and_others_do_not() {
        let path = std::env::temp_dir().join(format!("calibench-confirm-{}.csv", std::process::id()));
        let read = || std::fs::read_to_string(&path).expect("written");
        let present = Fingerprint::of_lens_minimum();
        let before = "# x; fingerprint 01\na,b\n1,2\n3,4\n5,6\n";
        std::fs::write(&path, before).expect("a file");
        for none in [vec!["3,5".to_string()], vec!["1,2".to_string(), "a,b".to_string()], Vec::new()] {
            assert!(confirm(&path, &present, &none).is_err(), "{none:?}");
            assert_eq!(read(), before);
        }
        confirm(&path, &present, &["5,6".to_string()]).expect("the same");
        let (head, rows) = before.split_once('\n').expect("two lines");
        assert_eq!(read(), format!("{}\n{rows}", present.head_again(head, 1, 3)));
        assert!(present.case("x.csv", &read(), "x").1);
        std::fs::remove_file(&path).expect("it is there");
    }

    #[test]
    fn a_table_has_a_line_a_row_and_a_name_that_is_not_there_names_the_others() {
        assert_eq!(table("a,b", ["1,2".to_string(), "3,4".to_string()]), "a,b\n1,2\n3,4\n");
        let all = ["one".to_string(), "two".to_string()];
        assert_eq!(named(&all, String::as_str, "two"), Ok(&all[1]));
        assert_eq!(
            named(&all, String::as_str, "six"),
            Err("no program six; there are: one, two".to_string())
        );
    }
}
