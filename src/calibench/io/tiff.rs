//! Does a TIFF hold more images than the first? Told from its directories, before anything is decoded: a
//! decoder reads the first and says nothing of others.
//!
//! `II` or `MM` and 42, then the place of the first directory, four bytes; a directory is the number of its
//! entries, two bytes, twelve bytes for each, and the place of the next directory, 0 behind the last (TIFF
//! 6.0, 1992, section 2). With 43 these are eight, eight, twenty and eight bytes (BigTIFF).

use super::bytes::bytes;
use std::io::{Read, Result, Seek, SeekFrom};

/// Whether a second directory follows; not so of what is no TIFF, or was cut off.
pub(super) fn has_more(source: &mut (impl Read + Seek)) -> Result<bool> {
    source.rewind()?;
    let next = Header::read(source)?.map_or(Ok(None), |header| header.second(source))?;
    Ok(next.is_some_and(|place| place > 0))
}

struct Header {
    is_little_endian: bool,
    is_big: bool,
}

impl Header {
    fn read(source: &mut impl Read) -> Result<Option<Header>> {
        let Some(start) = bytes::<4>(source)? else { return Ok(None) };
        let header = match start {
            [b'I', b'I', version @ (42 | 43), 0] => Some((true, version)),
            [b'M', b'M', 0, version @ (42 | 43)] => Some((false, version)),
            _ => None,
        };
        Ok(header.map(|(is_little_endian, version)| Header { is_little_endian, is_big: version == 43 }))
    }

    /// The place of the second directory; `None` where the file ends before it is told.
    fn second(&self, source: &mut (impl Read + Seek)) -> Result<Option<u64>> {
        if self.is_big && bytes::<4>(source)?.is_none() {
            return Ok(None);
        }
        let Some(first) = self.place(source)? else { return Ok(None) };
        source.seek(SeekFrom::Start(first))?;
        let (entries, size) = if self.is_big { (self.place(source)?, 20) } else { (self.short(source)?, 12) };
        let length = entries.and_then(|entries| entries.checked_mul(size)?.try_into().ok());
        let Some(length) = length else { return Ok(None) };
        source.seek(SeekFrom::Current(length))?;
        self.place(source)
    }

    fn place(&self, source: &mut impl Read) -> Result<Option<u64>> {
        if self.is_big {
            let of = if self.is_little_endian { u64::from_le_bytes } else { u64::from_be_bytes };
            return Ok(bytes(source)?.map(of));
        }
        let of = if self.is_little_endian { u32::from_le_bytes } else { u32::from_be_bytes };
        Ok(bytes(source)?.map(of).map(u64::from))
    }

    fn short(&self, source: &mut impl Read) -> Result<Option<u64>> {
        let of = if self.is_little_endian { u16::from_le_bytes } else { u16::from_be_bytes };
        Ok(bytes(source)?.map(of).map(u64::from))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    /// A directory of one entry behind a header, and the place of the next.
    fn tiff(is_little_endian: bool, is_big: bool, next: u64) -> Vec<u8> {
        let number = |value: u64, length: usize| {
            let little = value.to_le_bytes()[..length].to_vec();
            if is_little_endian { little } else { little.into_iter().rev().collect() }
        };
        let mut file = if is_little_endian { b"II".to_vec() } else { b"MM".to_vec() };
        let (place, count, entry) = if is_big { (8, 8, 20) } else { (4, 2, 12) };
        file.extend(number(42 + u64::from(is_big), 2));
        if is_big {
            file.extend([number(8, 2), number(0, 2)].concat());
        }
        file.extend(number((file.len() + place + 3) as u64, place));
        file.extend([0; 3]);
        file.extend(number(1, count));
        file.extend(vec![7; entry]);
        file.extend(number(next, place));
        file
    }

    #[test]
    fn a_second_directory_is_told_in_every_kind_of_tiff_and_what_is_cut_off_has_none() {
        let more = |file: &[u8]| has_more(&mut Cursor::new(file)).unwrap();
        for (is_little_endian, is_big) in [(true, false), (false, false), (true, true), (false, true)] {
            assert!(!more(&tiff(is_little_endian, is_big, 0)));
            let file = tiff(is_little_endian, is_big, 77);
            assert!(more(&file));
            for length in 0..file.len() {
                assert!(!more(&file[..length]), "{length}");
            }
        }
        // Places beyond the end of the file, and beyond all files.
        let mut far = tiff(true, true, 77);
        far[8..16].fill(0xff);
        assert!(has_more(&mut Cursor::new(&far)).is_ok_and(|more| !more));
        assert!(!more(b"\x89PNG\r\n\x1a\n"));
    }
}
