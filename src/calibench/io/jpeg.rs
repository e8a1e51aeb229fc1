//! How long is a JPEG, and how large its image? Told from its segments, before anything is decoded: decoders
//! read the whole file first, and paint what is missing of one that was cut off in grey and say nothing.
//!
//! A file is a row of segments, each `FF`, a kind, and mostly a length; after a scan's header (`FF DA`) its
//! data follow, in which a byte `FF` is always followed by `00` or the number of a restart. It ends with `FF
//! D9` (ITU-T T.81, 1992, annex B).

use image::metadata::Orientation;
use std::io::{BufRead, Result};

/// What the segments of a JPEG say.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Jpeg {
    /// Bytes up to its end, whatever follows it; all of the file where bytes are no segment, which is left to
    /// the decoder.
    pub length: u64,
    /// The header of the first frame.
    pub frame: Option<Frame>,
    /// How the image is to be turned to be shown.
    pub orientation: Orientation,
}

/// The header of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Frame {
    pub width: u16,
    pub height: u16,
    /// Samples of a pixel.
    pub components: u8,
}

/// Reads the segments up to the end; `None` where the file ends before.
pub(super) fn scanned(source: &mut impl BufRead) -> Result<Option<Jpeg>> {
    let mut bytes = Bytes { source, at: 0 };
    let mut jpeg = Jpeg { length: 0, frame: None, orientation: Orientation::NoTransforms };
    bytes.skip(2)?;
    let mut marker = bytes.marker()?;
    loop {
        let kind = match marker {
            Marker::Missing => return Ok(None),
            Marker::Kind(0xd9) => return Ok(Some(Jpeg { length: bytes.at, ..jpeg })),
            Marker::Kind(kind) => kind,
            Marker::None => break,
        };
        if !matches!(kind, 0x01 | 0xd0..=0xd8) {
            let Some(length) = bytes.next_u16()? else { return Ok(None) };
            // It counts itself.
            let Some(length) = length.checked_sub(2) else { break };
            let end = bytes.at + u64::from(length);
            if is_frame(kind) && length >= 6 {
                jpeg.frame = jpeg.frame.or(bytes.frame()?);
            }
            if kind == 0xe1 && jpeg.orientation == Orientation::NoTransforms {
                jpeg.orientation = bytes.orientation(length)?;
            }
            bytes.skip(end - bytes.at)?;
        }
        marker = if kind == 0xda { bytes.marker_after_scan()? } else { bytes.marker()? };
    }
    bytes.skip(u64::MAX)?;
    Ok(Some(Jpeg { length: bytes.at, ..jpeg }))
}

/// What stands where a segment should begin.
enum Marker {
    Kind(u8),
    /// Other bytes.
    None,
    /// The end of the file.
    Missing,
}

impl Frame {
    /// Width and height, px.
    pub fn size(&self) -> (usize, usize) {
        (usize::from(self.width), usize::from(self.height))
    }
}

/// Whether a segment is the header of a frame; among their numbers are those of tables and of a reserved one.
fn is_frame(kind: u8) -> bool {
    matches!(kind, 0xc0..=0xcf) && !matches!(kind, 0xc4 | 0xc8 | 0xcc)
}

/// Bytes one after the other, counted.
struct Bytes<'a, R> {
    source: &'a mut R,
    at: u64,
}

impl<R: BufRead> Bytes<'_, R> {
    fn next(&mut self) -> Result<Option<u8>> {
        let byte = self.source.fill_buf()?.first().copied();
        self.consume(usize::from(byte.is_some()));
        Ok(byte)
    }

    fn next_u16(&mut self) -> Result<Option<u16>> {
        let pair = (self.next()?, self.next()?);
        Ok(pair.0.zip(pair.1).map(|(high, low)| u16::from_be_bytes([high, low])))
    }

    /// So many, or what there is.
    fn skip(&mut self, count: u64) -> Result<()> {
        let end = self.at.saturating_add(count);
        while self.at < end {
            let left = usize::try_from(end - self.at).unwrap_or(usize::MAX);
            match self.source.fill_buf()?.len().min(left) {
                0 => break,
                some => self.consume(some),
            }
        }
        Ok(())
    }

    /// The header of a frame, behind its length.
    fn frame(&mut self) -> Result<Option<Frame>> {
        let _precision = self.next()?;
        let (height, width, components) = (self.next_u16()?, self.next_u16()?, self.next()?);
        let size = height.zip(width).zip(components);
        Ok(size.map(|((height, width), components)| Frame { width, height, components }))
    }

    /// What a segment with so many bytes behind its length asks for, if it is one of Exif data.
    fn orientation(&mut self, length: u16) -> Result<Orientation> {
        let mut data = Vec::with_capacity(usize::from(length));
        for _ in 0..length {
            data.extend(self.next()?);
        }
        let exif = data.strip_prefix(b"Exif\0\0");
        Ok(exif.and_then(Orientation::from_exif_chunk).unwrap_or(Orientation::NoTransforms))
    }

    fn marker(&mut self) -> Result<Marker> {
        match self.next()? {
            None => Ok(Marker::Missing),
            Some(0xff) => self.kind(),
            Some(_) => Ok(Marker::None),
        }
    }

    /// The kind of a marker behind its first FF: further ones are fill.
    fn kind(&mut self) -> Result<Marker> {
        loop {
            match self.next()? {
                None => return Ok(Marker::Missing),
                Some(0xff) => {}
                Some(kind) => return Ok(Marker::Kind(kind)),
            }
        }
    }

    /// The first marker behind the data of a scan.
    fn marker_after_scan(&mut self) -> Result<Marker> {
        loop {
            let buffer = self.source.fill_buf()?;
            if buffer.is_empty() {
                return Ok(Marker::Missing);
            }
            match buffer.iter().position(|byte| *byte == 0xff) {
                None => {
                    let all = buffer.len();
                    self.consume(all);
                }
                Some(place) => {
                    self.consume(place + 1);
                    match self.kind()? {
                        Marker::Kind(0x00 | 0xd0..=0xd7) => {}
                        other => return Ok(other),
                    }
                }
            }
        }
    }

    fn consume(&mut self, count: usize) {
        self.source.consume(count);
        self.at += count as u64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Orientation::NoTransforms;
    use std::io::BufReader;

    /// A frame of 2 x 3 px of one component, a header of four bytes, a scan with data in which `FF` occurs,
    /// and the end.
    const WHOLE: [u8; 33] = [
        0xff, 0xd8, 0xff, 0xff, 0xc0, 0, 11, 8, 0, 3, 0, 2, 1, 9, 9, 9, 0xff, 0xe0, 0, 4, 1, 2, 0xff, 0xda,
        0, 3, 7, 0x12, 0xff, 0x00, 0x34, 0xff, 0xd9,
    ];

    fn read(bytes: &[u8]) -> Option<Jpeg> {
        // However it is cut into pieces.
        let told: Vec<_> =
            (1..9).map(|piece| scanned(&mut BufReader::with_capacity(piece, bytes)).unwrap()).collect();
        assert!(told.iter().all(|one| *one == told[0]));
        told[0]
    }

    #[test]
    fn only_a_whole_file_has_an_end_whatever_follows_it() {
        let frame = Some(Frame { width: 2, height: 3, components: 1 });
        let jpeg = Jpeg { length: 33, frame, orientation: NoTransforms };
        assert_eq!(read(&WHOLE), Some(jpeg));
        assert_eq!(read(&[&WHOLE[..], &[0xff, 0xda, 0, 9]].concat()), Some(jpeg));
        for length in 2..WHOLE.len() {
            assert_eq!(read(&WHOLE[..length]), None, "{length}");
        }
    }

    #[test]
    fn of_bytes_that_are_no_segment_the_whole_file_is_the_length() {
        let other = [&WHOLE[..16], &[7; 100]].concat();
        assert_eq!(read(&other).unwrap().length, 116);
        let none = Jpeg { length: 7, frame: None, orientation: NoTransforms };
        assert_eq!(read(&[0xff, 0xd8, 0xff, 0xe0, 0, 1, 5]).unwrap(), none);
    }

    #[test]
    fn the_first_exif_data_say_how_the_image_is_to_be_turned() {
        // A TIFF directory of one entry: orientation, a short.
        let segment = |orientation: u8, name: &[u8; 6]| {
            let entry = [0x12, 1, 3, 0, 1, 0, 0, 0, orientation, 0, 0, 0];
            let data = [&name[..], b"II\x2a\0\x08\0\0\0\x01\0", &entry, &[0; 4]].concat();
            [&[0xff, 0xe1, 0, data.len() as u8 + 2][..], &data].concat()
        };
        let with = |segments: &[Vec<u8>]| [&WHOLE[..2], &segments.concat(), &WHOLE[2..]].concat();
        let turned = |segments: &[Vec<u8>]| read(&with(segments)).unwrap().orientation;
        let exif = |orientation| segment(orientation, b"Exif\0\0");
        assert_eq!(turned(&[exif(6)]), Orientation::Rotate90);
        assert_eq!(turned(&[segment(3, b"http:/"), exif(8), exif(6)]), Orientation::Rotate270);
        assert_eq!(turned(&[exif(1)]), NoTransforms);
        assert_eq!(turned(&[exif(77)]), NoTransforms);
        assert_eq!(turned(&[]), NoTransforms);
        assert_eq!(read(&with(&[exif(6)])).unwrap().length, 33 + exif(6).len() as u64);
    }
}
