//! Is it a table at all? The bytes of one, read until a line is longer than any of a table: a file without
//! line ends is refused before it fills the memory.

use super::input::{InputError, MOST_TABLE_BYTES, open_named, open_regular, unopened};
use super::shown::ShownPath;
use super::table::{MOST_LINE_BYTES, TableError};
use std::io::Read;
use std::path::Path;

/// Bytes that are read at a time.
const PART_BYTES: u64 = 1 << 16;

/// All bytes of a table that the user named, where `-` is standard input.
///
/// # Errors
/// [`TableError::LongLine`] from the first line that is too long; [`InputError`] as [`TableError::Input`].
pub fn read_named_table(path: &Path) -> Result<Vec<u8>, TableError> {
    let (name, input) = open_named(path, MOST_TABLE_BYTES)?;
    read_lines(&name, input)
}

/// Name and bytes of a file for one of the readers.
pub(super) fn open(path: &Path) -> Result<(String, Vec<u8>), TableError> {
    let name = path.shown();
    let (file, _) = open_regular(path, MOST_TABLE_BYTES)?;
    let bytes = read_lines(&name, file)?;
    Ok((name, bytes))
}

/// The whole input.
///
/// # Errors
/// As [`read_named_table`].
pub(super) fn read_lines(file: &str, mut input: impl Read) -> Result<Vec<u8>, TableError> {
    let (mut bytes, mut start) = (Vec::new(), 0);
    loop {
        let looked_at = bytes.len();
        let read = input.by_ref().take(PART_BYTES).read_to_end(&mut bytes);
        if read.map_err(|cause| unopened(file.to_string(), cause))? == 0 {
            return Ok(bytes);
        }
        if bytes.len() as u64 > MOST_TABLE_BYTES {
            let bytes = bytes.len() as u64;
            return Err(InputError::TooLong { path: file.to_string(), bytes, most: MOST_TABLE_BYTES }.into());
        }
        for end in (looked_at..bytes.len()).filter(|&i| matches!(bytes[i], b'\n' | b'\r')) {
            refuse_long(file, &bytes, start, end)?;
            start = end + 1;
        }
        refuse_long(file, &bytes, start, bytes.len())?;
    }
}

/// Refuses the line from `start` to `end` if it is too long.
fn refuse_long(file: &str, bytes: &[u8], start: usize, end: usize) -> Result<(), TableError> {
    if end - start <= MOST_LINE_BYTES {
        return Ok(());
    }
    let line = 1 + bytes[..start].iter().filter(|byte| **byte == b'\n').count() as u64;
    Err(TableError::LongLine { file: file.into(), line, most: MOST_LINE_BYTES })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    /// Counts what is taken of bytes without end.
    struct Endless<'a>(&'a Cell<usize>);

    impl Read for Endless<'_> {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            buffer.fill(b'1');
            self.0.set(self.0.get() + buffer.len());
            Ok(buffer.len())
        }
    }

    #[test]
    fn a_line_without_end_is_refused_before_it_is_all_read() {
        let taken = Cell::new(0);
        let first = b"view,point\r\n1,2\n".as_slice();
        let refused = read_lines("a.csv", first.chain(Endless(&taken))).unwrap_err();
        assert!(matches!(refused, TableError::LongLine { line: 3, .. }), "{refused}");
        assert!(taken.get() <= MOST_LINE_BYTES + 2 * PART_BYTES as usize, "{}", taken.get());
    }

    #[test]
    fn lines_up_to_the_limit_are_read_whole() {
        let line = |length: usize| [vec![b'1'; length], b"\n".to_vec()].concat();
        let most = [line(MOST_LINE_BYTES), line(MOST_LINE_BYTES)].concat();
        assert_eq!(read_lines("a.csv", most.as_slice()).unwrap(), most);
        for last in [line(MOST_LINE_BYTES + 1), vec![b'1'; MOST_LINE_BYTES + 1]] {
            let refused = read_lines("a.csv", [line(3), last].concat().as_slice()).unwrap_err();
            assert!(matches!(refused, TableError::LongLine { line: 2, .. }), "{refused}");
        }
    }
}
