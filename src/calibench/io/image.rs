//! How does a photograph become a raster? PNG, JPEG, BMP, PGM/PPM and TIFF; grey or colour, 8 or 16 bit.
//!
//! The format is told by the content, not by the name. Colour becomes grey by Rec. 601 luma, `(299 R + 587 G
//! + 114 B) / 1000` rounded, the weights of the field's other tools; an alpha channel is ignored.

use super::input::{InputError, MOST_IMAGE_BYTES, open_regular};
use super::jpeg::{self, Jpeg};
use super::shown::ShownPath;
use crate::raster::Raster;
pub(super) use image::DynamicImage as Decoded;
use image::codecs::png::PngDecoder;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use std::fs::File;
use std::io::{BufReader, Cursor, Read, Seek};
use std::path::Path;

/// A grey image with the depth of its file.
#[derive(Debug, Clone, PartialEq)]
pub enum Grey {
    /// 8 bits a sample.
    U8(Raster<u8>),
    /// 16 bits a sample.
    U16(Raster<u16>),
    /// Floating-point intensity.
    F32(Raster<f32>),
}

/// Why a file is not an image that can be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The file cannot be opened or read.
    #[error("{path}: {cause}")]
    Io {
        /// The file.
        path: String,
        /// What the system said.
        cause: std::io::Error,
    },
    /// The file is none to read.
    #[error(transparent)]
    Input(InputError),
    /// The file cannot be written.
    #[error("{0}")]
    Write(std::io::Error),
    /// The file has no bytes.
    #[error("{path}: the file is empty (0 bytes)")]
    Empty {
        /// The file.
        path: String,
    },
    /// The content is of no known format.
    #[error("{path}: not an image in PNG, JPEG, BMP, PGM/PPM or TIFF format ({reason})")]
    UnknownFormat {
        /// The file.
        path: String,
        /// What the reader said.
        reason: String,
    },
    /// The image is larger than this program handles.
    #[error("{path}: {width} x {height} px exceed the limit of {limit_px} px an image")]
    TooLarge {
        /// The file.
        path: String,
        /// Width, px.
        width: u32,
        /// Height, px.
        height: u32,
        /// Largest number of pixels.
        limit_px: u64,
    },
    /// The content is damaged or cut off.
    #[error("{path}: broken image: {reason}")]
    Broken {
        /// The file.
        path: String,
        /// What the reader said.
        reason: String,
    },
}

/// Largest number of pixels: 200 megapixels, above the largest sensors and below what exhausts a small
/// machine.
pub const LIMIT_PX: u64 = 200_000_000;

/// What a decoder may hold beside the samples: rows, texts, and of a PNG a colour profile, which some
/// kilobytes may unpack to gigabytes and which is dropped, unused as it is, where it is longer.
pub(super) const MOST_NOTES_BYTES: u64 = 8 << 20;

impl Grey {
    /// Width, px.
    pub fn width(&self) -> usize {
        self.size().0
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.size().1
    }

    /// Width and height, px.
    pub fn size(&self) -> (usize, usize) {
        match self {
            Grey::U8(image) => (image.width(), image.height()),
            Grey::U16(image) => (image.width(), image.height()),
            Grey::F32(image) => (image.width(), image.height()),
        }
    }

    /// The image as intensity, black 0 and white 1.
    pub fn to_f32(&self) -> Raster<f32> {
        match self {
            Grey::U8(image) => image.to_f32(),
            Grey::U16(image) => image.to_f32(),
            Grey::F32(image) => image.clone(),
        }
    }

    /// The image in 8 bits, for display and for detectors that want no more.
    pub fn to_u8(&self) -> Raster<u8> {
        match self {
            Grey::U8(image) => image.clone(),
            // 65535 = 255 x 257.
            Grey::U16(image) => image.map(|&level| ((u32::from(level) + 128) / 257) as u8),
            Grey::F32(image) => image.to_u8(),
        }
    }
}

/// Reads a photograph.
///
/// # Errors
/// See [`ImageError`]; a damaged file is an error, never a panic, and a forged size allocates nothing.
///
/// ```
/// use calibench::io::{read_image, write_png};
/// use calibench::raster::Raster;
///
/// let file = std::env::temp_dir().join("calibench-example-image.png");
/// write_png(&file, &Raster::from_fn(64, 48, |x, _| x as u8))?;
/// // Detectors take any kind of level; `to_f32` is linear intensity, black 0 and white 1.
/// let image = read_image(&file)?.to_f32();
/// assert_eq!((image.width(), image.height(), image.get(51, 0)), (64, 48, 0.2));
/// # Ok::<(), calibench::io::ImageError>(())
/// ```
pub fn read_image(path: &Path) -> Result<Grey, ImageError> {
    Ok(grey(decoded(opened(path)?, &path.shown())?))
}

/// The file of a photograph, which holds at least a byte.
pub(super) fn opened(path: &Path) -> Result<BufReader<File>, ImageError> {
    let (file, length) = open_regular(path, MOST_IMAGE_BYTES).map_err(|error| match error {
        InputError::Open { path, cause } => ImageError::Io { path, cause },
        error => ImageError::Input(error),
    })?;
    if length == 0 {
        return Err(ImageError::Empty { path: path.shown() });
    }
    Ok(BufReader::new(file))
}

/// Reads a photograph from the bytes of a file; `name` stands in errors.
///
/// # Errors
/// See [`ImageError`].
pub fn parse_image(bytes: &[u8], name: &str) -> Result<Grey, ImageError> {
    if bytes.is_empty() {
        return Err(ImageError::Empty { path: name.to_string() });
    }
    Ok(grey(decoded(Cursor::new(bytes), name)?))
}

pub(super) fn decoded(mut source: impl std::io::BufRead + Seek, name: &str) -> Result<Decoded, ImageError> {
    let Some(jpeg) = scanned_jpeg(&mut source, name)? else {
        return decoded_by(decoder(source, name)?, name);
    };
    // The decoder of a JPEG reads to the end of the file, whatever follows the image.
    let mut bytes = Vec::new();
    source.take(jpeg.length).read_to_end(&mut bytes).map_err(|cause| unread(cause, name))?;
    let decoder = decoder(Cursor::new(bytes), name)?;
    let (width, height) = decoder.dimensions();
    if jpeg.frame.is_some_and(|frame| frame.size() != (width as usize, height as usize)) {
        return Err(broken("the JPEG has frames of several sizes".into(), name));
    }
    decoded_by(decoder, name)
}

fn decoded_by(decoder: Box<dyn ImageDecoder + '_>, name: &str) -> Result<Decoded, ImageError> {
    DynamicImage::from_decoder(decoder).map_err(|error| of_decoder(error, name))
}

pub(super) fn unread(cause: std::io::Error, name: &str) -> ImageError {
    ImageError::Io { path: name.to_string(), cause }
}

pub(super) fn broken(reason: String, name: &str) -> ImageError {
    ImageError::Broken { path: name.to_string(), reason }
}

/// What the segments of a JPEG say; `None` of another format. The source is at its beginning again.
///
/// # Errors
/// A JPEG that was cut off.
pub(super) fn scanned_jpeg(
    source: &mut (impl std::io::BufRead + Seek),
    name: &str,
) -> Result<Option<Jpeg>, ImageError> {
    if !source.fill_buf().map_err(|cause| unread(cause, name))?.starts_with(&[0xff, 0xd8]) {
        return Ok(None);
    }
    let jpeg = jpeg::scanned(source).map_err(|cause| unread(cause, name))?;
    source.rewind().map_err(|cause| unread(cause, name))?;
    jpeg.map(Some).ok_or_else(|| broken("the JPEG was cut off: its end is missing".into(), name))
}

fn of_decoder(error: image::ImageError, name: &str) -> ImageError {
    let (path, reason) = (name.to_string(), error.to_string());
    match error {
        image::ImageError::Unsupported(_) => ImageError::UnknownFormat { path, reason },
        _ => ImageError::Broken { path, reason },
    }
}

/// A decoder of an image whose size is within the limit.
pub(super) fn decoder<'a>(
    source: impl std::io::BufRead + Seek + 'a,
    name: &str,
) -> Result<Box<dyn ImageDecoder + 'a>, ImageError> {
    let path = || name.to_string();
    let reader = ImageReader::new(source)
        .with_guessed_format()
        .map_err(|cause| ImageError::Io { path: path(), cause })?;
    if reader.format().is_none() {
        return Err(ImageError::UnknownFormat { path: path(), reason: "unknown first bytes".into() });
    }
    let of_decoder = |error| of_decoder(error, name);
    let decoder: Box<dyn ImageDecoder + 'a> = match reader.format() {
        Some(ImageFormat::Png) => {
            let mut limits = Limits::no_limits();
            limits.max_alloc = Some(MOST_NOTES_BYTES);
            Box::new(PngDecoder::with_limits(reader.into_inner(), limits).map_err(of_decoder)?)
        }
        _ => Box::new(reader.into_decoder().map_err(of_decoder)?),
    };
    let (width, height) = decoder.dimensions();
    refuse_size(width, height, name)?;
    Ok(decoder)
}

pub(super) fn refuse_size(width: u32, height: u32, name: &str) -> Result<(), ImageError> {
    if u64::from(width) * u64::from(height) > LIMIT_PX {
        return Err(ImageError::TooLarge { path: name.to_string(), width, height, limit_px: LIMIT_PX });
    }
    if width == 0 || height == 0 {
        return Err(broken(format!("{width} x {height} px hold no image"), name));
    }
    Ok(())
}

/// Grey levels of a decoded image.
fn grey(image: DynamicImage) -> Grey {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let of_u8 = |samples| Grey::U8(raster(width, height, samples));
    let of_u16 = |samples| Grey::U16(raster(width, height, samples));
    match image {
        DynamicImage::ImageLuma8(image) => of_u8(image.into_raw()),
        DynamicImage::ImageLumaA8(image) => of_u8(image.pixels().map(|p| p.0[0]).collect()),
        DynamicImage::ImageRgb8(image) => {
            of_u8(image.pixels().map(|p| luma([p.0[0], p.0[1], p.0[2]])).collect())
        }
        DynamicImage::ImageRgba8(image) => {
            of_u8(image.pixels().map(|p| luma([p.0[0], p.0[1], p.0[2]])).collect())
        }
        DynamicImage::ImageLuma16(image) => of_u16(image.into_raw()),
        DynamicImage::ImageLumaA16(image) => of_u16(image.pixels().map(|p| p.0[0]).collect()),
        DynamicImage::ImageRgb16(image) => {
            of_u16(image.pixels().map(|p| luma_16([p.0[0], p.0[1], p.0[2]])).collect())
        }
        DynamicImage::ImageRgba16(image) => {
            of_u16(image.pixels().map(|p| luma_16([p.0[0], p.0[1], p.0[2]])).collect())
        }
        // Floating-point images (TIFF) and any depth added later.
        other => {
            let weights = [0.299f32, 0.587, 0.114];
            let luma = |p: &image::Rgb<f32>| weights[0] * p.0[0] + weights[1] * p.0[1] + weights[2] * p.0[2];
            Grey::F32(raster(width, height, other.to_rgb32f().pixels().map(luma).collect()))
        }
    }
}

pub(super) fn raster<T: Copy>(width: usize, height: usize, samples: Vec<T>) -> Raster<T> {
    Raster::from_samples(width, height, samples).expect("a decoded image has a sample for every pixel")
}

fn luma(rgb: [u8; 3]) -> u8 {
    luma_16(rgb.map(u16::from)) as u8
}

fn luma_16(rgb: [u16; 3]) -> u16 {
    let [r, g, b] = rgb.map(u32::from);
    ((299 * r + 587 * g + 114 * b + 500) / 1000) as u16
}

/// The PNG of an 8-bit image.
///
/// # Errors
/// Only an image without pixels, or of 2^32 or more on a side, cannot be written.
pub fn png(image: &Raster<u8>) -> Result<Vec<u8>, ImageError> {
    encoded(image.samples(), image.width(), image.height(), image::ExtendedColorType::L8)
}

/// Writes an 8-bit image as PNG.
///
/// # Errors
/// The file cannot be written.
pub fn write_png(path: &Path, image: &Raster<u8>) -> Result<(), ImageError> {
    write(path, &png(image)?)
}

/// Writes a 16-bit image as PNG.
///
/// # Errors
/// The file cannot be written.
pub fn write_png_16(path: &Path, image: &Raster<u16>) -> Result<(), ImageError> {
    let bytes: Vec<u8> = image.samples().iter().flat_map(|level| level.to_ne_bytes()).collect();
    write(path, &encoded(&bytes, image.width(), image.height(), image::ExtendedColorType::L16)?)
}

/// The colour type of so many channels, with 16 bits a sample or 8.
pub(super) fn colour(channels: usize, deep: bool) -> image::ExtendedColorType {
    use image::ExtendedColorType::{L8, L16, La8, La16, Rgb8, Rgb16, Rgba8, Rgba16};
    let [eight, sixteen] = match channels {
        1 => [L8, L16],
        2 => [La8, La16],
        3 => [Rgb8, Rgb16],
        _ => [Rgba8, Rgba16],
    };
    if deep { sixteen } else { eight }
}

/// Encodes samples as PNG.
pub(super) fn encoded(
    bytes: &[u8],
    width: usize,
    height: usize,
    colour: image::ExtendedColorType,
) -> Result<Vec<u8>, ImageError> {
    let broken = |reason: String| ImageError::Broken { path: "PNG".into(), reason };
    let side = |length: usize| u32::try_from(length).map_err(|error| broken(error.to_string()));
    let mut file = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut file);
    image::ImageEncoder::write_image(encoder, bytes, side(width)?, side(height)?, colour)
        .map_err(|error| broken(error.to_string()))?;
    Ok(file)
}

pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    super::write_atomically(path, bytes).map_err(ImageError::Write)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file_of(image: DynamicImage, format: image::ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.write_to(&mut bytes, format).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn every_lossless_format_and_depth_gives_its_levels() {
        use image::ImageFormat::{Bmp, Png, Pnm, Tiff};
        let grey = image::GrayImage::from_fn(5, 3, |x, y| image::Luma([(50 * y + 7 * x) as u8]));
        let expected = Raster::from_fn(5, 3, |x, y| (50 * y + 7 * x) as u8);
        for format in [Png, Bmp, Pnm, Tiff] {
            let read = parse_image(&file_of(grey.clone().into(), format), "grey").unwrap();
            assert_eq!(read, Grey::U8(expected.clone()), "{format:?}");
            let colour = DynamicImage::from(grey.clone()).to_rgb8();
            let read = parse_image(&file_of(colour.into(), format), "colour").unwrap();
            assert_eq!(read, Grey::U8(expected.clone()), "{format:?}");
        }
        let deep = image::ImageBuffer::from_fn(5, 3, |x, y| image::Luma([(9000 * y + 700 * x) as u16]));
        for format in [Png, Pnm, Tiff] {
            let read = parse_image(&file_of(deep.clone().into(), format), "deep").unwrap();
            assert_eq!(
                read,
                Grey::U16(Raster::from_fn(5, 3, |x, y| (9000 * y + 700 * x) as u16)),
                "{format:?}"
            );
        }
    }

    #[test]
    fn an_alpha_channel_is_ignored_and_colours_are_weighed_at_any_depth() {
        use image::{ImageBuffer, LumaA, Rgb, Rgba};
        // Rec. 601: (299 * 40 + 587 * 90 + 114 * 200) / 1000 = 87.59, and of 257 times that 22510.63.
        let (eight, sixteen) = ([40u8, 90, 200], [40u16 * 257, 90 * 257, 200 * 257]);
        let levels = |read: Grey| match read {
            Grey::U8(read) => read.samples().iter().map(|&level| u32::from(level)).collect::<Vec<_>>(),
            Grey::U16(read) => read.samples().iter().map(|&level| u32::from(level)).collect(),
            Grey::F32(_) => panic!("a PNG has no floating-point levels"),
        };
        let with = |alpha: u8| [eight[0], eight[1], eight[2], alpha];
        let deep_with = |alpha: u16| [sixteen[0], sixteen[1], sixteen[2], alpha];
        let cases: [(DynamicImage, u32, bool); 6] = [
            (ImageBuffer::from_fn(2, 1, |x, _| LumaA([70u8, 255 * x as u8])).into(), 70, false),
            (ImageBuffer::from_fn(2, 1, |x, _| Rgba(with(255 * x as u8))).into(), 88, false),
            (ImageBuffer::from_fn(2, 1, |_, _| Rgb(eight)).into(), 88, false),
            (ImageBuffer::from_fn(2, 1, |x, _| LumaA([7000u16, 65535 * x as u16])).into(), 7000, true),
            (ImageBuffer::from_fn(2, 1, |x, _| Rgba(deep_with(65535 * x as u16))).into(), 22511, true),
            (ImageBuffer::from_fn(2, 1, |_, _| Rgb(sixteen)).into(), 22511, true),
        ];
        for (image, expected, deep) in cases {
            let kind = image.color();
            let read = parse_image(&file_of(image, image::ImageFormat::Png), "png").unwrap();
            assert_eq!(matches!(read, Grey::U16(_)), deep, "{kind:?}");
            assert_eq!(levels(read), [expected; 2], "{kind:?}");
        }
    }

    #[test]
    fn floating_point_levels_stay_what_they_are() {
        use image::{ImageBuffer, Rgb, Rgba};
        let colour = [0.25f32, 0.5, 1.75];
        let grey = 0.299 * colour[0] + 0.587 * colour[1] + 0.114 * colour[2];
        let cases: [DynamicImage; 2] = [
            ImageBuffer::from_fn(3, 2, |_, _| Rgb(colour)).into(),
            ImageBuffer::from_fn(3, 2, |_, _| Rgba([colour[0], colour[1], colour[2], 0.0])).into(),
        ];
        for image in cases {
            let kind = image.color();
            let read = parse_image(&file_of(image, image::ImageFormat::Tiff), "tiff").unwrap();
            assert_eq!(read, Grey::F32(Raster::from_fn(3, 2, |_, _| grey)), "{kind:?}");
            // White is 1: brighter is white in 8 bits.
            assert_eq!(read.to_u8().samples()[0], (255.0 * grey + 0.5) as u8, "{kind:?}");
            assert_eq!(read.to_f32(), Raster::from_fn(3, 2, |_, _| grey), "{kind:?}");
        }
    }

    #[test]
    fn a_jpeg_keeps_smooth_levels() {
        let smooth = image::GrayImage::from_fn(64, 48, |x, y| image::Luma([(60 + x + 2 * y) as u8]));
        let read = parse_image(&file_of(smooth.into(), image::ImageFormat::Jpeg), "smooth").unwrap();
        let Grey::U8(read) = read else { panic!("a JPEG has 8 bits") };
        // Quality 75 quantises the lowest frequencies in steps of at most 16 / 8 levels.
        assert!((0..48).all(|y| (0..64).all(|x| read.get(x, y).abs_diff((60 + x + 2 * y) as u8) <= 4)));
    }

    #[test]
    fn bad_files_are_refused_with_a_reason() {
        assert!(matches!(parse_image(&[], "x"), Err(ImageError::Empty { .. })));
        assert!(matches!(parse_image(b"u,v\n1,2\n", "x"), Err(ImageError::UnknownFormat { .. })));
        assert!(matches!(read_image(Path::new("no/such/file.png")), Err(ImageError::Io { .. })));
        let whole = file_of(image::GrayImage::new(300, 200).into(), image::ImageFormat::Png);
        for length in [9, 20, 40, whole.len() / 2] {
            let error = parse_image(&whole[..length], "cut.png").unwrap_err();
            assert!(matches!(error, ImageError::Broken { .. }), "{length}: {error}");
        }
    }

    #[test]
    fn a_jpeg_that_was_cut_off_is_refused_wherever() {
        let image = image::RgbImage::from_fn(200, 100, |x, y| {
            image::Rgb([(x + y) as u8, (3 * x) as u8, (5 * y) as u8])
        });
        let whole = file_of(image.into(), image::ImageFormat::Jpeg);
        assert!(parse_image(&[&whole[..], b"whatever follows"].concat(), "whole.jpg").is_ok());
        for part in [10, 50, 90, 99] {
            let error = parse_image(&whole[..whole.len() * part / 100], "cut.jpg").unwrap_err();
            assert!(matches!(error, ImageError::Broken { .. }), "{part} %: {error}");
        }
        assert!(parse_image(&whole[..whole.len() - 2], "cut.jpg").is_err());
    }

    #[test]
    fn a_forged_size_is_refused_before_memory_is_taken() {
        let error = parse_image(b"P5\n4000000000 4000000000\n255\n", "forged.pgm").unwrap_err();
        assert!(matches!(error, ImageError::TooLarge { .. } | ImageError::Broken { .. }), "{error}");
        let error = parse_image(b"P5\n40000 40000\n255\nabc", "forged.pgm").unwrap_err();
        assert!(matches!(error, ImageError::TooLarge { width: 40_000, .. }), "{error}");
    }

    /// A PNG with a chunk behind its header.
    fn with_note(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
        let whole = file_of(image::GrayImage::new(30, 20).into(), image::ImageFormat::Png);
        let (header, rest) = whole.split_at(33);
        let length = u32::try_from(data.len()).unwrap().to_be_bytes();
        [header, &length, kind, data, &crc(kind, data).to_be_bytes(), rest].concat()
    }

    /// CRC-32 of a chunk (PNG, third edition, annex D).
    fn crc(kind: &[u8], data: &[u8]) -> u32 {
        let step = |crc: u32| if crc & 1 == 1 { 0xedb8_8320 ^ (crc >> 1) } else { crc >> 1 };
        let add = |crc: u32, byte: &u8| (0..8).fold(crc ^ u32::from(*byte), |crc, _| step(crc));
        !kind.iter().chain(data).fold(!0, add)
    }

    /// Zeros as zlib writes them, in blocks that are stored and not packed: the limit is one of the
    /// decoder's, whatever the file's length.
    fn stored(length: usize) -> Vec<u8> {
        let mut packed = vec![0x78, 0x01];
        for start in (0..length).step_by(65_535) {
            let size = (length - start).min(65_535) as u16;
            packed.push(u8::from(start + usize::from(size) == length));
            packed.extend(size.to_le_bytes());
            packed.extend((!size).to_le_bytes());
            packed.resize(packed.len() + usize::from(size), 0);
        }
        // Adler-32 of zeros: `a` stays 1, and `b` counts them.
        packed.extend((((length % 65_521) as u32) << 16 | 1).to_be_bytes());
        packed
    }

    #[test]
    fn notes_of_a_png_are_held_within_a_limit_and_are_no_part_of_the_image() {
        let profile = |length| [&b"of a camera\0\0"[..], &stored(length)].concat();
        for (kind, data) in
            [(b"iCCP", profile(3_000)), (b"tEXt", b"Title\0board".to_vec()), (b"eXIf", vec![0; 9])]
        {
            let read = parse_image(&with_note(kind, &data), "noted.png").unwrap();
            assert_eq!(read.size(), (30, 20), "{kind:?}");
        }
        for kind in [b"iCCP", b"tEXt", b"eXIf"] {
            let error = parse_image(&with_note(kind, &profile(2 * MOST_NOTES_BYTES as usize)), "large.png")
                .unwrap_err();
            assert!(error.to_string().to_lowercase().contains("limit"), "{error}");
        }
    }

    #[test]
    fn what_is_written_is_read_again() {
        let folder = std::env::temp_dir().join(format!("calibench-image-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let deep = Raster::from_fn(7, 4, |x, y| (5000 * x + 300 * y) as u16);
        write_png_16(&folder.join("deep.png"), &deep).unwrap();
        assert_eq!(read_image(&folder.join("deep.png")).unwrap(), Grey::U16(deep.clone()));
        let eight = Grey::U16(deep).to_u8();
        write_png(&folder.join("eight.png"), &eight).unwrap();
        assert_eq!(read_image(&folder.join("eight.png")).unwrap(), Grey::U8(eight));
        std::fs::remove_dir_all(&folder).unwrap();
    }
}
