//! Does a PGM or PPM hold more images than the first? Told from its header, before anything is decoded: a
//! decoder reads the first image and says nothing of others.
//!
//! `P4`, `P5` or `P6` (bits, grey, colour), the width, the height and, but for bits, the largest sample, in
//! decimal digits between white space and notes from `#` to the end of their line; one white space, and the
//! samples, of two bytes where the largest is above 255. Another image may follow at once (Netpbm's pages
//! `pbm`, `pgm`, `ppm`). Files of digits (`P1` to `P3`) hold one by definition; those of `P7` are not looked at.

use super::bytes::bytes;
use std::io::{Read, Result, Seek, SeekFrom};

/// Bytes of a header: more are notes without end.
const MOST_HEADER_BYTES: usize = 1 << 16;

/// Whether another image follows the first; not so of what is no such file, or was cut off.
pub(super) fn has_more(source: &mut (impl Read + Seek)) -> Result<bool> {
    source.rewind()?;
    let Some([b'P', kind @ b'4'..=b'6']) = bytes::<2>(source)? else { return Ok(false) };
    let Some(behind) = end_of_samples(&mut Header::of(&mut *source), kind) else { return Ok(false) };
    source.seek(SeekFrom::Start(behind))?;
    Ok(matches!(bytes::<2>(source)?, Some([b'P', b'1'..=b'7'])))
}

/// Where the samples of the first image end.
fn end_of_samples(header: &mut Header<impl Read>, kind: u8) -> Option<u64> {
    let (width, height) = (header.number()?, header.number()?);
    let row = match kind {
        b'4' => width.div_ceil(8),
        _ => {
            let channels = if kind == b'6' { 3 } else { 1 };
            let largest = header.number()?;
            width.checked_mul(channels * if largest > 255 { 2 } else { 1 })?
        }
    };
    let end = row.checked_mul(height)?.checked_add(header.read as u64)?;
    // Beyond it no file can be sought.
    (end <= i64::MAX as u64).then_some(end)
}

/// A header behind its first two bytes.
struct Header<R> {
    source: R,
    /// Bytes of the file that were read.
    read: usize,
}

impl<R: Read> Header<R> {
    fn of(source: R) -> Header<R> {
        Header { source, read: 2 }
    }

    fn next(&mut self) -> Option<u8> {
        let [byte] = bytes(&mut self.source).ok()??;
        self.read += 1;
        (self.read <= MOST_HEADER_BYTES).then_some(byte)
    }

    /// The next number, and one byte behind it.
    fn number(&mut self) -> Option<u64> {
        let mut value: Option<u64> = None;
        loop {
            match self.next()? {
                digit @ b'0'..=b'9' => {
                    value = Some(value.unwrap_or(0).checked_mul(10)?.checked_add(u64::from(digit - b'0'))?);
                }
                b'#' => while self.next()? != b'\n' {},
                space if space.is_ascii_whitespace() && value.is_some() => return value,
                space if space.is_ascii_whitespace() => {}
                _ => return None,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn another_image_is_told_wherever_the_first_ends() {
        let more = |file: &[u8]| has_more(&mut Cursor::new(file)).unwrap();
        let images: [(&[u8], usize); 5] = [
            (b"P5 3 2 255\n", 6),
            (b"P5\n# a note\n3 2\n# another\n65535 ", 12),
            (b"P6\r\n3\t2 255\n", 18),
            (b"P4 9 2\n", 4),
            (b"P5 3 2 1\n", 6),
        ];
        for (header, samples) in images {
            let image = [header, &vec![b'P'; samples]].concat();
            let twice = image.repeat(2);
            assert!(!more(&image) && more(&twice), "{}", header.escape_ascii());
            // One that was cut off, and bytes behind it that are no image.
            assert!(!more(&twice[..image.len() + 1]) && !more(&[&image[..], b"\n\0"].concat()));
        }
    }

    #[test]
    fn what_is_no_such_file_holds_nothing() {
        let huge = format!("P5 {} {} 65535\n", u64::MAX, u64::MAX);
        let far = format!("P5 {} {} 255\n", 1_u64 << 40, 1_u64 << 23);
        for file in [
            "",
            "P5",
            "P5 3",
            "P5 3 2 255",
            "P2 1 1 255\n9 P2 1 1 255\n9",
            "P5 x 2 255\nP5",
            "P5 # ",
            &huge,
            &far,
        ] {
            assert!(!has_more(&mut Cursor::new(file)).unwrap(), "{file}");
        }
    }
}
