//! How does a photograph keep its colours? As one raster a channel, with the depth of its file.

use super::image::{self, Decoded, ImageError, opened};
use super::shown::ShownPath;
use crate::raster::{Level, Raster};
use std::path::Path;

/// A photograph by its channels: grey, grey and alpha, red green blue, or red green blue and alpha. All have
/// the same size.
#[derive(Debug, Clone, PartialEq)]
pub enum Channels {
    /// 8 bits a sample.
    U8(Vec<Raster<u8>>),
    /// 16 bits a sample.
    U16(Vec<Raster<u16>>),
    /// Floating-point intensity.
    F32(Vec<Raster<f32>>),
}

/// Reads a photograph with all its channels.
///
/// # Errors
/// See [`ImageError`].
pub fn read_channels(path: &Path) -> Result<Channels, ImageError> {
    let name = path.shown();
    let image = image::decoded(opened(path)?, &name)?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let u8s = |samples: &[u8], count| Channels::U8(parted(samples, count, width, height));
    let u16s = |samples: &[u16], count| Channels::U16(parted(samples, count, width, height));
    Ok(match &image {
        Decoded::ImageLuma8(image) => u8s(image.as_raw(), 1),
        Decoded::ImageLumaA8(image) => u8s(image.as_raw(), 2),
        Decoded::ImageRgb8(image) => u8s(image.as_raw(), 3),
        Decoded::ImageRgba8(image) => u8s(image.as_raw(), 4),
        Decoded::ImageLuma16(image) => u16s(image.as_raw(), 1),
        Decoded::ImageLumaA16(image) => u16s(image.as_raw(), 2),
        Decoded::ImageRgb16(image) => u16s(image.as_raw(), 3),
        Decoded::ImageRgba16(image) => u16s(image.as_raw(), 4),
        Decoded::ImageRgba32F(image) => Channels::F32(parted(image.as_raw(), 4, width, height)),
        // Floating-point images (TIFF) and any depth added later.
        other => Channels::F32(parted(other.to_rgb32f().as_raw(), 3, width, height)),
    })
}

/// The samples of each channel, which stand side by side in the file.
fn parted<T: Copy>(samples: &[T], count: usize, width: usize, height: usize) -> Vec<Raster<T>> {
    let channel = |c: usize| samples.iter().skip(c).step_by(count).copied().collect();
    (0..count).map(|c| image::raster(width, height, channel(c))).collect()
}

impl Channels {
    /// Width and height, px.
    pub fn size(&self) -> (usize, usize) {
        match self {
            Channels::U8(channels) => size_of(channels),
            Channels::U16(channels) => size_of(channels),
            Channels::F32(channels) => size_of(channels),
        }
    }

    /// Writes the photograph as PNG, floating-point intensities with 16 bits.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_png(&self, path: &Path) -> Result<(), ImageError> {
        let (bytes, count, deep) = match self {
            Channels::U8(channels) => (joined(channels, |level| [level]), channels.len(), false),
            Channels::U16(channels) => (joined(channels, u16::to_ne_bytes), channels.len(), true),
            Channels::F32(channels) => {
                let levels: Vec<Raster<u16>> = channels.iter().map(Raster::to_u16).collect();
                (joined(&levels, u16::to_ne_bytes), channels.len(), true)
            }
        };
        let (width, height) = self.size();
        image::write(path, &image::encoded(&bytes, width, height, image::colour(count, deep))?)
    }
}

fn size_of<T: Copy>(channels: &[Raster<T>]) -> (usize, usize) {
    channels.first().map_or((0, 0), |channel| (channel.width(), channel.height()))
}

/// The samples of all channels side by side, as bytes.
fn joined<T: Level, const N: usize>(channels: &[Raster<T>], bytes_of: impl Fn(T) -> [u8; N]) -> Vec<u8> {
    let pixels = size_of(channels).0 * size_of(channels).1;
    let mut bytes = Vec::with_capacity(pixels * channels.len() * N);
    for pixel in 0..pixels {
        channels.iter().for_each(|channel| bytes.extend(bytes_of(channel.samples()[pixel])));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_kind_of_channels_and_depth_survives_the_way_through_a_file() {
        let folder = std::env::temp_dir().join(format!("calibench-channels-{}", std::process::id()));
        let path = folder.join("image.png");
        for count in 1..=4 {
            let level = |c: usize, x: usize, y: usize| 40 * c + 7 * x + 3 * y;
            let eight = Channels::U8(
                (0..count).map(|c| Raster::from_fn(5, 3, |x, y| level(c, x, y) as u8)).collect(),
            );
            let deep = |c| Raster::from_fn(5, 3, move |x: usize, y: usize| (level(c, x, y) * 251) as u16);
            for image in [eight, Channels::U16((0..count).map(deep).collect())] {
                image.write_png(&path).unwrap();
                assert_eq!(read_channels(&path).unwrap(), image, "{count} channels");
            }
        }
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn floating_point_levels_are_kept_by_channels_and_written_with_16_bits() {
        use ::image::{DynamicImage, ImageBuffer, ImageFormat, Rgb, Rgba};
        let folder = std::env::temp_dir().join(format!("calibench-float-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let levels = [0.0f32, 0.25, 0.5, 1.0];
        let colour =
            DynamicImage::from(ImageBuffer::from_fn(4, 2, |_, _| Rgb([levels[1], levels[2], levels[3]])));
        let clear = DynamicImage::from(ImageBuffer::from_fn(4, 2, |_, _| Rgba(levels)));
        for (image, expected) in [(colour, &levels[1..]), (clear, &levels[..])] {
            let (float, deep) = (folder.join("float.tiff"), folder.join("deep.png"));
            image.save_with_format(&float, ImageFormat::Tiff).unwrap();
            let read = read_channels(&float).unwrap();
            let rasters = expected.iter().map(|&level| Raster::from_fn(4, 2, |_, _| level)).collect();
            assert_eq!(read, Channels::F32(rasters));
            assert_eq!(read.size(), (4, 2));
            read.write_png(&deep).unwrap();
            let sixteen = |&level: &f32| Raster::from_fn(4, 2, |_, _| (65535.0 * level + 0.5) as u16);
            assert_eq!(read_channels(&deep).unwrap(), Channels::U16(expected.iter().map(sixteen).collect()));
        }
        std::fs::remove_dir_all(folder).unwrap();
    }
}
