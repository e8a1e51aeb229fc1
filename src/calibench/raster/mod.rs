//! What is an image to this library? A rectangle of grey samples; files are the business of `io`.

mod sample;

pub use sample::Level;

/// A grey image, row by row. Level `(x, y)` is centred on pixel coordinate `(x, y)`.
///
/// `Raster<f32>` holds linear intensity with black 0 and white 1; `Raster<u8>` and `Raster<u16>` hold grey
/// levels.
#[derive(Debug, Clone, PartialEq)]
pub struct Raster<T> {
    width: usize,
    height: usize,
    samples: Vec<T>,
}

/// A rectangle that the samples do not fill.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("an image of {width} x {height} pixels needs {} samples, got {samples}", width * height)]
pub struct RasterError {
    /// Width, px.
    pub width: usize,
    /// Height, px.
    pub height: usize,
    /// Samples given.
    pub samples: usize,
}

impl<T: Copy> Raster<T> {
    /// An image of one level.
    pub fn filled(width: usize, height: usize, level: T) -> Raster<T> {
        Raster { width, height, samples: vec![level; width * height] }
    }

    /// An image of given samples, row by row.
    ///
    /// # Errors
    /// Another number of samples than `width x height`.
    pub fn from_samples(width: usize, height: usize, samples: Vec<T>) -> Result<Raster<T>, RasterError> {
        if samples.len() == width * height {
            Ok(Raster { width, height, samples })
        } else {
            Err(RasterError { width, height, samples: samples.len() })
        }
    }

    /// An image whose sample at `(x, y)` is `level(x, y)`.
    pub fn from_fn(width: usize, height: usize, mut level: impl FnMut(usize, usize) -> T) -> Raster<T> {
        let samples =
            (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| level(x, y)).collect();
        Raster { width, height, samples }
    }

    /// An image made a few rows at a time: `fill(y, rows)` changes at most `at_once` rows, from row `y` on,
    /// that are at `level` before.
    pub fn from_bands(
        width: usize,
        height: usize,
        level: T,
        at_once: usize,
        mut fill: impl FnMut(usize, &mut [T]),
    ) -> Raster<T> {
        // Not the whole image at once: rows that were just set are near when they are filled.
        let mut samples = Vec::with_capacity(width * height);
        for y in (0..height).step_by(at_once.max(1)) {
            samples.resize((y + at_once.max(1)).min(height) * width, level);
            fill(y, &mut samples[y * width..]);
        }
        Raster { width, height, samples }
    }

    /// Width, px.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, px.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The sample of column `x`, row `y`. Panics outside the image.
    pub fn get(&self, x: usize, y: usize) -> T {
        self.row(y)[x]
    }

    /// Changes one sample. Panics outside the image.
    pub fn set(&mut self, x: usize, y: usize, level: T) {
        self.row_mut(y)[x] = level;
    }

    /// One row.
    pub fn row(&self, y: usize) -> &[T] {
        &self.samples[y * self.width..][..self.width]
    }

    /// One row, to write.
    pub fn row_mut(&mut self, y: usize) -> &mut [T] {
        &mut self.samples[y * self.width..][..self.width]
    }

    /// All samples, row by row.
    pub fn samples(&self) -> &[T] {
        &self.samples
    }

    /// The image with every sample converted.
    pub fn map<U>(&self, convert: impl FnMut(&T) -> U) -> Raster<U> {
        Raster { width: self.width, height: self.height, samples: self.samples.iter().map(convert).collect() }
    }
}

impl Raster<f32> {
    /// Rounds intensities to 8-bit grey levels, clipping outside 0 ... 1.
    pub fn to_u8(&self) -> Raster<u8> {
        self.map(|x| (x.clamp(0.0, 1.0) * 255.0).round() as u8)
    }

    /// Rounds intensities to 16-bit grey levels, clipping outside 0 ... 1.
    pub fn to_u16(&self) -> Raster<u16> {
        self.map(|x| (x.clamp(0.0, 1.0) * 65535.0).round() as u16)
    }
}

impl Raster<u8> {
    /// Grey levels as intensity.
    pub fn to_f32(&self) -> Raster<f32> {
        self.map(|&x| f32::from(x) / 255.0)
    }
}

impl Raster<u16> {
    /// Grey levels as intensity.
    pub fn to_f32(&self) -> Raster<f32> {
        self.map(|&x| f32::from(x) / 65535.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_levels_survive_the_way_to_intensity_and_back() {
        let levels = Raster::from_fn(16, 16, |x, y| (16 * y + x) as u8);
        assert_eq!(levels.to_f32().to_u8(), levels);
        assert!(Raster::from_samples(2, 2, vec![0u8; 3]).is_err());
    }
}
