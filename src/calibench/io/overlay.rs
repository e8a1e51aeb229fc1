//! Did the detector find what a person sees? The photograph, enlarged, with the marks and their order drawn
//! in.

use super::image::{ImageError, encoded, write};
use crate::geometry::Vec2;
use crate::raster::Raster;
use std::path::Path;

/// Red, green, blue.
pub type Colour = [u8; 3];

/// A colour picture over a grey image, each pixel shown as `scale x scale`. Drawing takes image pixels, so
/// sub-pixel places are seen.
///
/// ```
/// use calibench::geometry::Vec2;
/// use calibench::io::Overlay;
/// use calibench::raster::Raster;
///
/// let mut picture = Overlay::new(&Raster::filled(64, 48, 200u8), 2);
/// picture.cross(Vec2::new(20.5, 30.25), 3.0, [255, 60, 60]);
/// assert_eq!(picture.size(), (128, 96));
/// picture.write_png(&std::env::temp_dir().join("calibench-example-overlay.png"))?;
/// # Ok::<(), calibench::io::ImageError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Overlay {
    width: usize,
    height: usize,
    scale: usize,
    rgb: Vec<u8>,
}

/// Colours of successive rows, distinct in greyscale order too.
const ROW_COLOURS: [Colour; 6] =
    [[255, 60, 60], [255, 170, 0], [220, 220, 0], [60, 220, 60], [0, 200, 255], [220, 90, 255]];

impl Overlay {
    /// The enlarged image; `scale` of at least 1.
    pub fn new(image: &Raster<u8>, scale: usize) -> Overlay {
        let scale = scale.max(1);
        let (width, height) = (image.width() * scale, image.height() * scale);
        let mut rgb = Vec::with_capacity(3 * width * height);
        for y in 0..height {
            rgb.extend((0..width).flat_map(|x| [image.get(x / scale, y / scale); 3]));
        }
        Overlay { width, height, scale, rgb }
    }

    /// Width and height, px of the overlay.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// Draws a straight line.
    pub fn line(&mut self, from: Vec2, to: Vec2, colour: Colour) {
        let (from, to) = (self.place(from), self.place(to));
        let longest = (to - from).amax();
        // Lines far outside are cut by the picture's border, but not walked pixel by pixel to infinity.
        if !longest.is_finite() || longest > 1e5 {
            return;
        }
        let steps = libm::ceil(longest).max(1.0) as usize;
        for i in 0..=steps {
            let p = from + (to - from) * (i as f64 / steps as f64);
            self.dot(p, colour);
        }
    }

    /// Draws a cross of the given half-length, px of the image.
    pub fn cross(&mut self, at: Vec2, half_px: f64, colour: Colour) {
        for arm in [Vec2::new(half_px, 0.0), Vec2::new(0.0, half_px)] {
            self.line(at - arm, at + arm, colour);
        }
    }

    /// Draws a circle.
    pub fn circle(&mut self, centre: Vec2, radius_px: f64, colour: Colour) {
        let corner = |i: u32| {
            let (sine, cosine) = libm::sincos(std::f64::consts::TAU * f64::from(i) / 48.0);
            centre + Vec2::new(cosine, sine) * radius_px
        };
        for i in 0..48 {
            self.line(corner(i), corner(i + 1), colour);
        }
    }

    /// Draws a detected grid: a cross on every mark, a line along each row in the row's colour, a circle
    /// around the first mark. `marks` are in rows of `columns`.
    pub fn grid(&mut self, marks: &[Vec2], columns: usize) {
        let marks: Vec<Option<Vec2>> = marks.iter().copied().map(Some).collect();
        self.seen_grid(&marks, columns);
    }

    /// The same of a grid of which some marks were not seen.
    pub fn seen_grid(&mut self, marks: &[Option<Vec2>], columns: usize) {
        let colour = |mark: usize| ROW_COLOURS[mark / columns.max(1) % ROW_COLOURS.len()];
        for (row, marks) in marks.chunks(columns.max(1)).enumerate() {
            for pair in marks.windows(2) {
                if let [Some(from), Some(to)] = *pair {
                    self.line(from, to, colour(row * columns));
                }
            }
        }
        for (i, mark) in marks.iter().enumerate() {
            if let Some(mark) = *mark {
                self.cross(mark, 2.5, colour(i));
            }
        }
        if let Some(Some(first)) = marks.first() {
            self.circle(*first, 6.0, ROW_COLOURS[0]);
        }
    }

    /// Place in the overlay of a place in the image: both count from the centre of their first pixel.
    fn place(&self, p: Vec2) -> Vec2 {
        let scale = self.scale as f64;
        (p + Vec2::new(0.5, 0.5)) * scale - Vec2::new(0.5, 0.5)
    }

    fn dot(&mut self, p: Vec2, colour: Colour) {
        let (x, y) = (libm::round(p.x), libm::round(p.y));
        if x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64 {
            let first = 3 * (y as usize * self.width + x as usize);
            self.rgb[first..first + 3].copy_from_slice(&colour);
        }
    }

    /// The picture as PNG.
    ///
    /// # Errors
    /// Only a picture without pixels cannot be encoded.
    pub fn png(&self) -> Result<Vec<u8>, ImageError> {
        encoded(&self.rgb, self.width, self.height, image::ExtendedColorType::Rgb8)
    }

    /// Writes the picture as PNG.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_png(&self, path: &Path) -> Result<(), ImageError> {
        write(path, &self.png()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cross_lies_where_the_enlarged_pixel_is() {
        let mut overlay = Overlay::new(&Raster::filled(10, 8, 100), 4);
        overlay.cross(Vec2::new(3.0, 2.0), 0.0, [255, 0, 0]);
        overlay.line(Vec2::new(-50.0, 1.0), Vec2::new(f64::NAN, 1.0), [255, 0, 0]);
        overlay.line(Vec2::new(-50.0, 100.0), Vec2::new(60.0, 100.0), [255, 0, 0]);
        let red: Vec<usize> = (0..40 * 32).filter(|&i| overlay.rgb[3 * i] == 255).collect();
        // Pixel 3 covers 12 ... 15, its centre 13.5 rounds to 14; row 2 likewise to 10.
        assert_eq!(red, [10 * 40 + 14]);
        assert_eq!(&overlay.png().unwrap()[1..4], b"PNG");
    }
}
