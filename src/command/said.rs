//! What a verb found or wrote, as text and as JSON: printed in one form, written in the other. And how
//! numbers of options are read.

use super::format::Format;
use super::{Exit, print, warn};
use calibench::io::corners::WEIGHTS;
use calibench::io::write_atomically;
use serde_json::{Value, json};
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// What was found, in both forms.
pub(super) struct Said {
    pub text: String,
    pub json: Value,
}

/// Prints what was found in the form that was asked for, and puts its JSON into the folder.
pub(super) fn say(said: Result<Said, String>, out: Option<&Path>, file_name: &str, format: Format) -> Exit {
    let said = match said {
        Ok(said) => said,
        Err(message) => {
            warn(&message);
            return Exit::Usage;
        }
    };
    let json = format!("{:#}\n", said.json);
    let written = out.map_or(Ok(()), |folder| write_atomically(&folder.join(file_name), json.as_bytes()));
    print_either(format, &said.text, &json);
    unless_unwritten(written, Exit::Held)
}

/// Prints one of both forms.
pub(super) fn print_either(format: Format, text: &str, json: &str) {
    print(match format {
        Format::Text => text,
        Format::Json => json,
    });
}

/// The exit of a verb that has printed what it found, whether or not its files could be written: what was
/// computed is not lost with them.
pub(super) fn unless_unwritten(written: io::Result<()>, exit: Exit) -> Exit {
    match written {
        Ok(()) => exit,
        Err(error) => {
            warn(&format!("{error}: what was found is on standard output only"));
            Exit::Incomplete
        }
    }
}

/// The program, as it stands in what it writes.
pub(super) fn written_by() -> String {
    format!("calibench {}", env!("CARGO_PKG_VERSION"))
}

/// Refuses `-` as the name of a file that is written: a file of that name would be, which nobody means.
pub(super) fn refuse_standard_output(file: &Path) -> Result<(), String> {
    match file.as_os_str() == "-" {
        true => Err("- is no file to write, and what is said of it goes to standard output: name a file, or ./- for one of that name".into()),
        false => Ok(()),
    }
}

/// Prints one of both forms, JSON as one object on lines of its own.
pub(super) fn print_as(format: Format, text: impl FnOnce() -> String, json: impl FnOnce() -> Value) {
    match format {
        Format::Text => print(&text()),
        Format::Json => print(&format!("{:#}\n", json())),
    }
}

/// Tells which files a verb has written: `text` to people, their paths to programs.
pub(super) fn say_written(files: &[PathBuf], format: Format, text: impl FnOnce() -> String) {
    let paths = || files.iter().map(|path| path.display().to_string()).collect::<Vec<_>>();
    print_as(format, text, || json!({ "written_by": written_by(), "written": paths() }));
}

/// A finite number for which something holds.
pub(super) fn number_that(
    text: &str,
    holds: impl Fn(f64) -> bool,
    wanted: &'static str,
) -> Result<f64, String> {
    let number = text.trim().parse().ok().filter(|x: &f64| x.is_finite() && holds(*x));
    number.ok_or_else(|| format!("expected {wanted}"))
}

/// Most that a number may be with which something is computed, as in a table: its square is a number too.
pub(super) const MOST: f64 = 1e30;

pub(super) fn positive(text: &str) -> Result<f64, String> {
    number_that(text, |x| x > 0.0 && x <= MOST, "a number above 0, of at most 1e30")
}

/// The standard deviation of a pixel coordinate, as a table may have it.
pub(super) fn noise_px(text: &str) -> Result<f64, String> {
    number_that(text, |x| WEIGHTS.contains(&x), "a number of pixels from 1e-9 to 1e9")
}

/// fy over fx of a sensor: pixels are a hundred times as wide as high at the most, or as high as wide.
pub(super) fn ratio(text: &str) -> Result<f64, String> {
    number_that(text, |x| (0.01..=100.0).contains(&x), "a ratio from 0.01 to 100")
}

/// A whole number: the standard library's errors speak of digits and strings.
pub(super) fn whole<T: FromStr>(text: &str) -> Result<T, String> {
    text.trim().parse().map_err(|_| "expected a whole number of 0 or more, below 2^64".into())
}
