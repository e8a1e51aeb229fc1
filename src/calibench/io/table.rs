//! What stands in a table of numbers? CSV with named columns; every complaint carries file, line and column.

use super::input::{InputError, MOST_SIDE_PX, byte_order_mark_len};
use super::lines::read_lines;
use super::shown::{excerpt, on_one_line};
use crate::board::ViewError;
use std::cell::Cell;
use std::io::{self, Read};

/// Why a table cannot be read. Lines count from 1; the header is line 1.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// The file cannot be opened, or is none to read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// More lines than a table may have.
    #[error("{file}:{line}: more than {most} lines: split the table")]
    TooMany {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// Most lines below the header.
        most: usize,
    },
    /// A line longer than any of a table.
    #[error("{file}:{line}: a line of more than {most} bytes: is it a table, with commas and line ends?")]
    LongLine {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// Most bytes of a line.
        most: usize,
    },
    /// A quotation mark joins lines to one field until the next mark.
    #[error(
        "{file}:{line}: more than {most} bytes without the end of a row: a quotation mark stands open; close it, or take it away"
    )]
    OpenQuote {
        /// The file.
        file: String,
        /// The line where the row begins.
        line: u64,
        /// Most bytes of a row.
        most: usize,
    },
    /// The table ends within a quotation mark, so that it may have gone on.
    #[error("{file}:{line}: a quotation mark stands open where the table ends: close it, or take it away")]
    UnclosedQuote {
        /// The file.
        file: String,
        /// The line where its row begins.
        line: u64,
    },
    /// Reading stopped in the middle, or a line is not UTF-8 text.
    #[error("{file}:{line}: {message}")]
    Unreadable {
        /// The file.
        file: String,
        /// The line, 0 if unknown.
        line: u64,
        /// What is wrong.
        message: String,
    },
    /// Nothing below the header, or not even one.
    #[error("{file}: no data: expected the header {expected} and at least one line below it")]
    Empty {
        /// The file.
        file: String,
        /// The header it should have.
        expected: String,
    },
    /// A column is missing from the header.
    #[error(
        "{file}:1: column '{column}' is missing: the header is '{header}', expected {expected} separated by commas"
    )]
    MissingColumn {
        /// The file.
        file: String,
        /// The column.
        column: &'static str,
        /// The header as found.
        header: String,
        /// The columns needed.
        expected: String,
    },
    /// A column stands twice in the header.
    #[error("{file}:1: column '{column}' stands more than once in the header")]
    RepeatedColumn {
        /// The file.
        file: String,
        /// The column.
        column: &'static str,
    },
    /// The marks of a view are all at one place of the target.
    #[error(
        "{file}: all {marks} marks of view '{view}' are at one place (X, Y) of the target: are the columns view and point swapped?"
    )]
    OnePlace {
        /// The file.
        file: String,
        /// The view.
        view: String,
        /// Its marks.
        marks: usize,
    },
    /// A line has more or fewer fields than the header.
    #[error("{file}:{line}: {got} fields where the header has {need}{}", if got > need { ": a comma is no decimal point here" } else { "" })]
    Ragged {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// Number of fields of the header.
        need: usize,
        /// Number of fields found.
        got: usize,
    },
    /// A field is not a number.
    #[error("{file}:{line}: column '{column}' (field {field}): '{text}' is not a number{}", if text.contains(',') { ": a comma is no decimal point here" } else { "" })]
    NotANumber {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// The column's name.
        column: &'static str,
        /// The column's position, from 1.
        field: usize,
        /// The field's text.
        text: String,
    },
    /// A field is NaN or infinite.
    #[error("{file}:{line}: column '{column}' (field {field}): '{text}' is not a finite number")]
    NotFinite {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// The column's name.
        column: &'static str,
        /// The column's position, from 1.
        field: usize,
        /// The field's text.
        text: String,
    },
    /// A number with which nothing can be computed, or a pixel of no image.
    #[error(
        "{file}:{line}: column '{column}' (field {field}): '{text}' is beyond {most:e}, the most there may be"
    )]
    TooLarge {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// The column's name.
        column: &'static str,
        /// The column's position, from 1.
        field: usize,
        /// The field's text.
        text: String,
        /// Largest absolute value.
        most: f64,
    },
    /// A name (of a view or a point) is empty.
    #[error("{file}:{line}: column '{column}' (field {field}) is empty")]
    NoName {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// The column's name.
        column: &'static str,
        /// The column's position, from 1.
        field: usize,
    },
    /// A name (of a view or a point) is longer than any.
    #[error(
        "{file}:{line}: column '{column}' is longer than {most} bytes: '{text}'; is it a table with commas and line ends?"
    )]
    LongName {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// The column's name.
        column: &'static str,
        /// The beginning of the name.
        text: String,
        /// Most bytes of a name.
        most: usize,
    },
    /// The same point stands twice in one view.
    #[error("{file}:{line}: point '{point}' {place} was given on line {first} already")]
    RepeatedPoint {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// The point's name.
        point: String,
        /// `of view '...'`, or `of the list`.
        place: String,
        /// The line of its first appearance.
        first: u64,
    },
    /// The points of a view do not make a view.
    #[error("{file}: view '{view}': {cause}")]
    View {
        /// The file.
        file: String,
        /// The view's name.
        view: String,
        /// What is wrong.
        cause: ViewError,
    },
}

/// A column of numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column {
    name: &'static str,
    /// Largest absolute value.
    most: f64,
}

impl Column {
    /// Pixels: a mark may lie outside of its image, but not beyond every image.
    pub(super) const fn pixels(name: &'static str) -> Column {
        Column { name, most: MOST_SIDE_PX as f64 }
    }

    /// Lengths in whatever unit. The eighth power of the largest, as fits of homographies form it, is still a
    /// number.
    pub(super) const fn length(name: &'static str) -> Column {
        Column { name, most: 1e30 }
    }
}

/// Lines below the header: 150 000 views of 63 points. Each takes some 200 bytes until its view is made.
pub const MOST_ROWS: usize = 10_000_000;

/// Bytes of a line: some fifty thousand numbers of twenty digits.
pub(super) const MOST_LINE_BYTES: usize = 1 << 20;

/// Bytes of a name: as long as a path may be.
const MOST_NAME_BYTES: usize = 4096;

/// One line: where it stands, its names and its numbers.
pub(super) struct Row<const NAMES: usize, const NUMBERS: usize> {
    pub line: u64,
    pub names: [String; NAMES],
    pub numbers: [f64; NUMBERS],
}

/// Reads the named columns, in whatever order they stand; further columns are ignored, but for those that a
/// reader has refused ([`refuse_misspelt`]). A byte order mark,
/// line ends of either kind, blank lines and blanks around fields are harmless.
pub(super) fn read_table<const NAMES: usize, const NUMBERS: usize>(
    file: &str,
    input: impl Read,
    names: [&'static str; NAMES],
    numbers: [Column; NUMBERS],
) -> Result<Vec<Row<NAMES, NUMBERS>>, TableError> {
    let bytes = read_all(file, input)?;
    let mut lines = LineCounter { bytes: &bytes, counted_to: 0, line: 1 };
    let begins = Cell::new(0);
    let rows_of = Rows { bytes: &bytes, given: 0, begins: &begins };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(rows_of);
    let line = lines.line_of(reader.position());
    begins.set(lines.counted_to);
    let header = reader.headers().map_err(|error| unreadable(file, line, &error))?.clone();
    let expected =
        || names.into_iter().chain(numbers.map(|column| column.name)).collect::<Vec<_>>().join(",");
    if header.is_empty() {
        return Err(TableError::Empty { file: file.into(), expected: expected() });
    }
    let name_fields = find_columns(file, &header, names, &expected)?;
    let number_fields = find_columns(file, &header, numbers.map(|column| column.name), &expected)?;
    let mut rows = Vec::new();
    let mut last = (line, begins.get());
    let mut record = csv::StringRecord::new();
    loop {
        let line = lines.line_of(reader.position());
        begins.set(lines.counted_to);
        if !reader.read_record(&mut record).map_err(|error| unreadable(file, line, &error))? {
            break;
        }
        if record.len() != header.len() {
            return Err(TableError::Ragged {
                file: file.into(),
                line,
                need: header.len(),
                got: record.len(),
            });
        }
        if rows.len() == MOST_ROWS {
            return Err(TableError::TooMany { file: file.into(), line, most: MOST_ROWS });
        }
        let mut row = Row { line, names: names.map(|_| String::new()), numbers: [0.0; NUMBERS] };
        for (i, &field) in name_fields.iter().enumerate() {
            row.names[i] = name(file, line, names[i], field, &record[field])?;
        }
        for (i, &field) in number_fields.iter().enumerate() {
            row.numbers[i] = number(file, line, numbers[i], field, &record[field])?;
        }
        rows.push(row);
        last = (line, begins.get());
    }
    let (line, begin) = last;
    if is_quote_open(&bytes[begin..]) {
        return Err(TableError::UnclosedQuote { file: file.into(), line });
    }
    if rows.is_empty() {
        return Err(TableError::Empty { file: file.into(), expected: expected() });
    }
    Ok(rows)
}

/// A byte order mark in UTF-16, either byte first.
const OF_UTF_16: [&[u8]; 2] = [b"\xff\xfe", b"\xfe\xff"];

/// The whole input, without a byte order mark.
fn read_all(file: &str, input: impl Read) -> Result<Vec<u8>, TableError> {
    let mut bytes = read_lines(file, input)?;
    bytes.drain(..byte_order_mark_len(&bytes));
    if OF_UTF_16.iter().any(|mark| bytes.starts_with(mark)) {
        let message = "the text is UTF-16: save it as UTF-8".to_string();
        return Err(TableError::Unreadable { file: file.into(), line: 1, message });
    }
    Ok(bytes)
}

/// The bytes of a table for the parser, which keeps a row until its end: the row that it reads may be no
/// longer than a line.
struct Rows<'a> {
    bytes: &'a [u8],
    given: usize,
    /// Where the row begins that is being read.
    begins: &'a Cell<usize>,
}

impl Read for Rows<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.given > self.begins.get() + MOST_LINE_BYTES {
            return Err(io::ErrorKind::InvalidData.into());
        }
        let count = (&self.bytes[self.given..]).read(buffer)?;
        self.given += count;
        Ok(count)
    }
}

/// Whether a row ends within a field that a quotation mark began. A mark within a field that none began is a
/// character of it, and two within one that a mark began are one of it.
fn is_quote_open(row: &[u8]) -> bool {
    let (mut is_open, mut may_open) = (false, true);
    for byte in row {
        match byte {
            b'"' if is_open => (is_open, may_open) = (false, true),
            b'"' => is_open = may_open,
            _ => may_open = matches!(byte, b',' | b'\n' | b'\r'),
        }
    }
    is_open
}

/// Counts lines up to a record's first byte. The csv reader's own count stops before the blank lines, and
/// before the line feed of a carriage return, that it skips to reach the record.
struct LineCounter<'a> {
    bytes: &'a [u8],
    counted_to: usize,
    line: u64,
}

impl LineCounter<'_> {
    /// The line of a record that starts at `position` or after the line ends that follow it.
    fn line_of(&mut self, position: &csv::Position) -> u64 {
        let start = position.byte() as usize;
        while self.counted_to < self.bytes.len() {
            let byte = self.bytes[self.counted_to];
            if self.counted_to >= start && byte != b'\n' && byte != b'\r' {
                break;
            }
            self.line += u64::from(byte == b'\n');
            self.counted_to += 1;
        }
        self.line
    }
}

fn find_columns<const N: usize>(
    file: &str,
    header: &csv::StringRecord,
    columns: [&'static str; N],
    expected: &impl Fn() -> String,
) -> Result<[usize; N], TableError> {
    let mut fields = [0; N];
    for (place, column) in fields.iter_mut().zip(columns) {
        let mut found = header.iter().enumerate().filter(|(_, text)| *text == column).map(|(i, _)| i);
        *place = found.next().ok_or_else(|| TableError::MissingColumn {
            file: file.into(),
            column,
            header: excerpt(&header.iter().collect::<Vec<_>>().join(",")),
            expected: expected(),
        })?;
        if found.next().is_some() {
            return Err(TableError::RepeatedColumn { file: file.into(), column });
        }
    }
    Ok(fields)
}

fn name(file: &str, line: u64, column: &'static str, field: usize, text: &str) -> Result<String, TableError> {
    if text.is_empty() {
        return Err(TableError::NoName { file: file.into(), line, column, field: field + 1 });
    }
    if text.len() > MOST_NAME_BYTES {
        let text = excerpt(text);
        return Err(TableError::LongName { file: file.into(), line, column, text, most: MOST_NAME_BYTES });
    }
    Ok(on_one_line(text).into_owned())
}

fn number(file: &str, line: u64, column: Column, field: usize, text: &str) -> Result<f64, TableError> {
    let Column { name: column, most } = column;
    // Texts are made for what is wrong alone: a table has millions of numbers.
    let said = || (file.to_string(), field + 1, excerpt(text));
    match text.parse::<f64>() {
        Ok(value) if value.abs() <= most => Ok(value),
        Ok(value) if value.is_finite() => {
            let (file, field, text) = said();
            Err(TableError::TooLarge { file, line, column, field, text, most })
        }
        Ok(_) => {
            let (file, field, text) = said();
            Err(TableError::NotFinite { file, line, column, field, text })
        }
        Err(_) => {
            let (file, field, text) = said();
            Err(TableError::NotANumber { file, line, column, field, text })
        }
    }
}

/// What the parser says of the row that begins in a line; no row ended where [`Rows`] gave no more.
fn unreadable(file: &str, line: u64, error: &csv::Error) -> TableError {
    let file = file.to_string();
    let message = match error.kind() {
        csv::ErrorKind::Io(_) => return TableError::OpenQuote { file, line, most: MOST_LINE_BYTES },
        csv::ErrorKind::Utf8 { err, .. } => format!("field {} is not UTF-8 text", err.field() + 1),
        _ => error.to_string(),
    };
    TableError::Unreadable { file, line, message }
}

/// The number of the last line, if it has no end. Many programs write files so; a file that was cut off
/// inside its last number looks the same, and its last number may be any.
///
/// ```
/// use calibench::io::table::unended_line;
///
/// assert_eq!(unended_line(b"px,py\n1,2.5\n"), None);
/// assert_eq!(unended_line(b"px,py\n1,2"), Some(2));
/// ```
pub fn unended_line(bytes: &[u8]) -> Option<u64> {
    let ended = bytes.last().is_none_or(|byte| matches!(byte, b'\n' | b'\r'));
    (!ended).then(|| 1 + bytes.iter().filter(|byte| **byte == b'\n').count() as u64)
}

/// Refuses a header with a column that is not read and looks like one that would be: left unread, it would
/// change the result without a word. `read` are all that the table may have.
pub(super) fn refuse_misspelt(file: &str, header: &[String], read: &[&str]) -> Result<(), TableError> {
    let unread = header.iter().filter(|column| !read.contains(&column.as_str()));
    let mut meant = unread.flat_map(|column| read.iter().map(move |name| (column, name)));
    match meant.find(|(column, name)| is_nearly(column, name)) {
        Some((column, name)) => Err(TableError::Unreadable {
            file: file.into(),
            line: 1,
            message: format!("no column '{column}' is read, and it looks like '{name}': rename or remove it"),
        }),
        None => Ok(()),
    }
}

/// Whether a name has the letters of another, in any case and order, with one more at the most; a letter
/// less where there are many.
fn is_nearly(name: &str, other: &str) -> bool {
    let letters = |text: &str| {
        let mut letters: Vec<char> =
            text.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect();
        letters.sort_unstable();
        letters
    };
    let (name, other) = (letters(name), letters(other));
    // Of two sorted lists, whether the longer is the shorter and one more.
    let one_more = |longer: &[char], shorter: &[char]| {
        longer.len() == shorter.len() + 1 && {
            let same = longer.iter().zip(shorter).take_while(|(a, b)| a == b).count();
            longer[same + 1..] == shorter[same..]
        }
    };
    name == other
        || (other.len() > 1 && one_more(&name, &other))
        || (other.len() >= MANY_LETTERS && one_more(&other, &name))
}

/// Letters of a name of which one may be missing.
const MANY_LETTERS: usize = 5;

/// The names of the columns; none where the first line cannot be read, of which the reader of the table says
/// why.
pub fn columns(bytes: &[u8]) -> Vec<String> {
    let bytes = &bytes[byte_order_mark_len(bytes)..];
    let bytes = &bytes[..bytes.len().min(MOST_LINE_BYTES)];
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(bytes);
    reader.headers().map(|header| header.iter().map(String::from).collect()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_that_looks_like_one_that_is_read_is_refused() {
        let read = ["view", "point", "u", "v", "weight", "sigma_px"];
        let refused = |column: &str| refuse_misspelt("c.csv", &["view".into(), column.into()], &read);
        for (column, meant) in [
            ("wieght", "weight"),
            ("Weight", "weight"),
            ("weights", "weight"),
            ("wight", "weight"),
            ("sigmapx", "sigma_px"),
            ("View", "view"),
        ] {
            let message = refused(column).unwrap_err().to_string();
            let expected = format!(
                "c.csv:1: no column '{column}' is read, and it looks like '{meant}': rename or remove it"
            );
            assert_eq!(message, expected);
        }
        for column in ["weight", "height", "id", "file", "x", "t", "uv", "U_mm"] {
            assert!(refused(column).is_ok(), "{column}");
        }
        assert!(
            is_nearly("sdd", "sd")
                && is_nearly("sD", "sd")
                && !is_nearly("id", "sd")
                && !is_nearly("s", "sd")
        );
    }
}
