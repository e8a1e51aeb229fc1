//! How large is a photograph, and what memory will it take? Known from the beginning of its file, before it
//! is decoded.

use super::image::{
    ImageError, MOST_NOTES_BYTES, broken, decoder, opened, refuse_size, scanned_jpeg, unread,
};
use super::jpeg::Jpeg;
use super::shown::ShownPath;
use super::{png, pnm, tiff};
use image::ImageDecoder;
use image::metadata::Orientation;
use std::io::{Cursor, Seek};
use std::path::Path;

const TURNED: &str = "asks to be shown turned or mirrored (Exif): it is read as it is stored, and so are its pixel coordinates";
const MORE: &str = "holds more than one image: the first is read";

/// The size of an image, known before it is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// Width and height, px.
    pub size: (usize, usize),
    /// Pixels.
    pub pixels: u64,
    /// Bytes of all samples of the file, once they are decoded.
    pub bytes: u64,
    /// Bytes that are held beside the samples while it is decoded: a JPEG's file, here and in its decoder, or
    /// what the decoder of another format may hold of colour profiles, texts and rows.
    pub held_bytes: u64,
    /// Whether the file asks for the image to be turned or mirrored where it is shown (Exif's orientation).
    /// It is read as it is stored.
    pub is_turned: bool,
    /// Whether a TIFF, an animated PNG, a PGM or PPM holds more images than the first, which is read.
    pub has_more: bool,
}

impl Extent {
    fn of(decoder: &mut dyn ImageDecoder, has_more: bool) -> Extent {
        let (width, height) = decoder.dimensions();
        // What cannot be read of it is no reason to refuse the image.
        let is_turned = decoder.orientation().is_ok_and(is_turned);
        Extent {
            size: (width as usize, height as usize),
            pixels: u64::from(width) * u64::from(height),
            bytes: decoder.total_bytes(),
            held_bytes: MOST_NOTES_BYTES,
            is_turned,
            has_more,
        }
    }

    /// That of the first photograph that a source holds.
    fn read(mut source: impl std::io::BufRead + Seek, name: &str) -> Result<Extent, ImageError> {
        let Some(Jpeg { length, frame, orientation }) = scanned_jpeg(&mut source, name)? else {
            let has_more = holds_more(&mut source).map_err(|cause| unread(cause, name))?;
            source.rewind().map_err(|cause| unread(cause, name))?;
            return Ok(Extent::of(&mut *decoder(source, name)?, has_more));
        };
        let frame = frame.ok_or_else(|| broken("the JPEG has no frame".into(), name))?;
        let (width, height) = frame.size();
        refuse_size(width as u32, height as u32, name)?;
        let pixels = width as u64 * height as u64;
        let bytes = pixels.saturating_mul(u64::from(frame.components));
        Ok(Extent {
            size: (width, height),
            pixels,
            bytes,
            held_bytes: length.saturating_mul(2),
            is_turned: is_turned(orientation),
            has_more: false,
        })
    }

    /// What of the file is left out where it is read, in words.
    pub fn left_out(&self) -> impl Iterator<Item = &'static str> {
        let told = [(self.is_turned, TURNED), (self.has_more, MORE)];
        told.into_iter().filter_map(|(is_left_out, what)| is_left_out.then_some(what))
    }

    /// Memory that reading the photograph as grey, finding its marks and drawing them in takes at most: the
    /// samples, the grey levels, for each pixel eight bytes of detection or four of the overlay and its file,
    /// and what is held beside.
    pub fn memory_to_detect(&self) -> u64 {
        self.held_bytes
            .saturating_add(self.bytes.saturating_mul(2))
            .saturating_add(self.pixels.saturating_mul(12))
    }

    /// Memory that correcting the photograph takes: its samples as they were decoded, by channels, corrected,
    /// and as they are written, for each pixel the look-up table and its making, and what is held beside.
    pub fn memory_to_correct(&self) -> u64 {
        self.held_bytes
            .saturating_add(self.bytes.saturating_mul(4))
            .saturating_add(self.pixels.saturating_mul(32))
    }
}

/// The size of a photograph, from the beginning of its file.
///
/// # Errors
/// See [`ImageError`].
pub fn image_extent(path: &Path) -> Result<Extent, ImageError> {
    Extent::read(opened(path)?, &path.shown())
}

/// As [`image_extent`], from the bytes of a file; `name` stands in errors.
///
/// # Errors
/// See [`ImageError`].
pub fn parse_extent(bytes: &[u8], name: &str) -> Result<Extent, ImageError> {
    Extent::read(Cursor::new(bytes), name)
}

/// Whether a file that is no JPEG holds more images than its first.
fn holds_more(source: &mut (impl std::io::Read + Seek)) -> std::io::Result<bool> {
    Ok(tiff::has_more(source)? || png::has_more(source)? || pnm::has_more(source)?)
}

fn is_turned(orientation: Orientation) -> bool {
    orientation != Orientation::NoTransforms
}
