//! How are lines read that nobody vouches for? One at a time, and of one that is longer than any answer its
//! beginning.

use super::program::MOST_LINE_BYTES;
use std::io::{self, BufRead, BufReader, Read};

/// A line of a file, without its end.
pub(super) enum Line<'a> {
    /// All of it.
    Whole(&'a str),
    /// The beginning of one that is longer than [`MOST_LINE_BYTES`].
    TooLong(&'a str),
}

/// Gives every line that is not empty with its number, from 1; what is not UTF-8 is replaced.
///
/// # Errors
/// What cannot be read.
pub(super) fn for_each(file: impl Read, mut take: impl FnMut(usize, Line<'_>)) -> io::Result<()> {
    let mut reader = BufReader::new(file);
    let mut bytes = Vec::new();
    for number in 1.. {
        bytes.clear();
        if reader.by_ref().take(MOST_LINE_BYTES as u64 + 1).read_until(b'\n', &mut bytes)? == 0 {
            break;
        }
        let text = String::from_utf8_lossy(&bytes);
        // A byte order mark belongs to no text.
        let line = if number == 1 { text.trim_start_matches('\u{feff}') } else { &text }.trim();
        if bytes.last() != Some(&b'\n') && bytes.len() > MOST_LINE_BYTES {
            reader.skip_until(b'\n')?;
            take(number, Line::TooLong(line));
        } else if !line.is_empty() {
            take(number, Line::Whole(line));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_that_is_too_long_costs_itself_alone() {
        let long = "x".repeat(MOST_LINE_BYTES + 1);
        let text = format!("\u{feff}one\n\n{long}{long}\n  four\r\n{}\nsix", &long[1..]);
        let mut found = Vec::new();
        for_each(text.as_bytes(), |number, line| {
            found.push(match line {
                Line::Whole(line) => (number, line.len(), true),
                Line::TooLong(line) => (number, line.len(), false),
            });
        })
        .unwrap();
        let most = MOST_LINE_BYTES;
        assert_eq!(found, [(1, 3, true), (3, most + 1, false), (4, 4, true), (5, most, true), (6, 3, true)]);
    }

    #[test]
    fn a_last_line_without_an_end_may_be_as_long_as_any() {
        let most = "x".repeat(MOST_LINE_BYTES);
        let mut is_whole = Vec::new();
        for_each(most.as_bytes(), |_, line| is_whole.push(matches!(line, Line::Whole(_)))).unwrap();
        assert_eq!(is_whole, [true]);
    }
}
