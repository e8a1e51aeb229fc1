//! Which four samples make an output pixel, and in what mixture? A look-up table, computed once for images of
//! one size.

use super::Interpolated;
use super::eight_bit::Photograph;
use super::fraction::{COARSE, Place};
use super::source_row::{PIECE, SourceRows, Sources};
use super::window::{Limits, PIXELS, Window};
use crate::camera::Camera;
use crate::geometry::Vec2;
use crate::raster::Raster;
use std::sync::OnceLock;

/// Why an image cannot be rectified.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RectifyError {
    /// Bilinear interpolation needs two samples in each direction; the table counts samples in 32 bits.
    #[error("images of {width} x {height} pixels cannot be interpolated: need 2 x 2 to 4294967294 pixels")]
    Size {
        /// Width, px.
        width: usize,
        /// Height, px.
        height: usize,
    },
    /// The image has not the size that the table was made for.
    #[error(
        "the map is for images of {expected_width} x {expected_height} pixels, this one has {width} x {height}"
    )]
    OtherSize {
        /// Width of the map's images, px.
        expected_width: usize,
        /// Height of the map's images, px.
        expected_height: usize,
        /// Width of this one, px.
        width: usize,
        /// Height of this one, px.
        height: usize,
    },
}

/// A look-up table from output pixels to samples of the photograph.
///
/// An output pixel has data when its source lies within the centres of the photograph's outermost samples, so
/// that no sample is invented. Pixel (0, 0) is the centre of the top-left sample on both sides. Levels of 16
/// bits and intensities are mixed in `f32`, 8-bit levels in whole numbers, within 0.02 of a level before they
/// are rounded.
///
/// ```
/// use calibench::camera::{BrownConrady, Camera};
/// use calibench::raster::Raster;
/// use calibench::rectify::RectifyMap;
///
/// let ideal = Camera::pinhole(60.0, 60.0, 31.5, 23.5);
/// let lens = ideal.with_distortion(BrownConrady::radial(-0.1, 0.0));
/// let map = RectifyMap::between(&lens, (64, 48), &ideal, (64, 48))?;
/// // A sheet of one grey stays that grey wherever the photograph has data.
/// let grey = Raster::from_fn(64, 48, |_, _| 90u8);
/// assert_eq!(map.apply(&grey, 0)?.get(31, 23), 90);
/// # Ok::<(), calibench::rectify::RectifyError>(())
/// ```
#[derive(Debug, Clone)]
pub struct RectifyMap {
    input_size: (usize, usize),
    output_size: (usize, usize),
    entries: Vec<Entry>,
    /// The same for 8-bit levels, made when the first photograph of them comes.
    windows: OnceLock<Vec<Window>>,
}

/// Index of the upper left of four samples, and how far towards the right and lower ones.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Entry {
    upper_left: u32,
    right: f32,
    down: f32,
}

const NO_DATA: u32 = u32::MAX;

impl PartialEq for RectifyMap {
    fn eq(&self, other: &RectifyMap) -> bool {
        (self.input_size, self.output_size) == (other.input_size, other.output_size)
            && self.entries == other.entries
    }
}

/// That images of this size can be interpolated.
pub(super) fn check_size((width, height): (usize, usize)) -> Result<(), RectifyError> {
    let too_many = width.checked_mul(height).is_none_or(|samples| samples >= NO_DATA as usize);
    if width < 2 || height < 2 || too_many {
        return Err(RectifyError::Size { width, height });
    }
    Ok(())
}

impl RectifyMap {
    /// The table of any inverse map: `source` gives the photograph's pixel that an output pixel shows, or
    /// `None`. Sizes are width and height, px.
    ///
    /// # Errors
    /// Photographs of fewer than 2 x 2 pixels.
    pub fn new(
        input_size: (usize, usize),
        output_size: (usize, usize),
        source: impl Fn(&Vec2) -> Option<Vec2>,
    ) -> Result<RectifyMap, RectifyError> {
        check_size(input_size)?;
        let mut entries = Vec::with_capacity(output_size.0 * output_size.1);
        for y in 0..output_size.1 {
            for x in 0..output_size.0 {
                let position = source(&Vec2::new(x as f64, y as f64));
                entries.push(position.map_or(Entry::NONE, |p| Entry::at(&p, input_size)));
            }
        }
        Ok(RectifyMap { input_size, output_size, entries, windows: OnceLock::new() })
    }

    /// The table that turns photographs of `camera` into images of `output`, usually one without distortion.
    ///
    /// # Errors
    /// Photographs of fewer than 2 x 2 pixels.
    pub fn between(
        camera: &Camera,
        input_size: (usize, usize),
        output: &Camera,
        output_size: (usize, usize),
    ) -> Result<RectifyMap, RectifyError> {
        check_size(input_size)?;
        let mut entries = Vec::with_capacity(output_size.0 * output_size.1);
        let mut rows = SourceRows::new(camera, output, output_size.0);
        let mut sources = Sources::new();
        for y in 0..output_size.1 {
            for first in (0..output_size.0).step_by(PIECE) {
                let count = PIECE.min(output_size.0 - first);
                rows.fill(y, first, count, &mut sources);
                entries.extend((0..count).map(|place| Entry::at(&sources.get(place), input_size)));
            }
        }
        Ok(RectifyMap { input_size, output_size, entries, windows: OnceLock::new() })
    }

    /// Width and height of the photographs, px.
    pub fn input_size(&self) -> (usize, usize) {
        self.input_size
    }

    /// Width and height of the rectified images, px.
    pub fn output_size(&self) -> (usize, usize) {
        self.output_size
    }

    /// Rectifies a photograph; pixels without data get the level `border`.
    ///
    /// # Errors
    /// An image of another size.
    pub fn apply<T: Interpolated>(
        &self,
        photograph: &Raster<T>,
        border: T,
    ) -> Result<Raster<T>, RectifyError> {
        let (width, height) = (photograph.width(), photograph.height());
        if (width, height) != self.input_size {
            let (expected_width, expected_height) = self.input_size;
            return Err(RectifyError::OtherSize { expected_width, expected_height, width, height });
        }
        let samples = photograph.samples();
        let bytes = T::as_bytes(samples).map(|samples| Photograph::new(samples, self.input_size));
        Ok(Raster::from_bands(self.output_size.0, self.output_size.1, border, 1, |y, levels| {
            if let (Some(photograph), Some(levels)) = (&bytes, T::as_bytes_mut(levels)) {
                return self.mix_bytes(photograph, y, levels);
            }
            for (level, entry) in levels.iter_mut().zip(self.row(y)) {
                if entry.upper_left != NO_DATA {
                    *level = entry.mix(samples, width);
                }
            }
        }))
    }

    /// A row of 8-bit levels.
    fn mix_bytes(&self, photograph: &Photograph, y: usize, levels: &mut [u8]) {
        let blocks = self.output_size.0.div_ceil(PIXELS);
        let windows = &self.windows.get_or_init(|| self.to_windows())[y * blocks..][..blocks];
        let entries = self.row(y);
        photograph.mix_windows(windows, levels, |block, levels| {
            for (level, entry) in levels.iter_mut().zip(&entries[block * PIXELS..]) {
                if let Some(place) = entry.place(self.input_size.0) {
                    *level = photograph.at(&place);
                }
            }
        });
    }

    /// Windows of blocks of eight pixels, row by row; the last of a row may be short and then has none.
    fn to_windows(&self) -> Vec<Window> {
        let limits = Limits::of(self.input_size);
        let block = |entries: &[Entry]| {
            let (mut u, mut v) = ([f64::NAN; PIXELS], [f64::NAN; PIXELS]);
            for (i, entry) in entries.iter().enumerate() {
                let source = entry.source(self.input_size.0).unwrap_or(Vec2::new(f64::NAN, f64::NAN));
                (u[i], v[i]) = (source.x * f64::from(COARSE), source.y * f64::from(COARSE));
            }
            Window::of(&u, &v, self.input_size.0, &limits).unwrap_or(Window::NONE)
        };
        (0..self.output_size.1).flat_map(|y| self.row(y).chunks(PIXELS).map(block)).collect()
    }

    /// Which output pixels have data.
    pub fn mask(&self) -> Raster<bool> {
        Raster::from_fn(self.output_size.0, self.output_size.1, |x, y| self.row(y)[x].upper_left != NO_DATA)
    }

    /// The photograph's pixel that an output pixel is sampled at, to the precision of the weights; `None`
    /// without data. Panics outside the output.
    pub fn source(&self, x: usize, y: usize) -> Option<Vec2> {
        self.row(y)[x].source(self.input_size.0)
    }

    fn row(&self, y: usize) -> &[Entry] {
        &self.entries[y * self.output_size.0..][..self.output_size.0]
    }
}

impl Entry {
    const NONE: Entry = Entry { upper_left: NO_DATA, right: 0.0, down: 0.0 };

    fn at(source: &Vec2, size: (usize, usize)) -> Entry {
        Place::of(source, size).map_or(Entry::NONE, |place| Entry {
            upper_left: place.row * size.0 as u32 + place.column,
            right: place.right,
            down: place.down,
        })
    }

    fn place(&self, width: usize) -> Option<Place> {
        let Entry { upper_left, right, down } = *self;
        let (row, column) = (upper_left / width as u32, upper_left % width as u32);
        (upper_left != NO_DATA).then_some(Place { column, row, right, down })
    }

    fn source(&self, width: usize) -> Option<Vec2> {
        self.place(width).map(|place| {
            let (u, v) = (f64::from(place.column), f64::from(place.row));
            Vec2::new(u + f64::from(place.right), v + f64::from(place.down))
        })
    }

    fn mix<T: Interpolated>(&self, samples: &[T], width: usize) -> T {
        T::mix(samples, width, self.upper_left as usize, self.right, self.down)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::BrownConrady;
    use crate::rectify::source_pixel;
    use proptest::prelude::*;

    const SIZE: (usize, usize) = (64, 48);

    fn camera(k1: f64, k2: f64, p1: f64, p2: f64) -> Camera {
        Camera::pinhole(60.0, 60.0, 32.6, 24.3).with_distortion(BrownConrady { k1, k2, p1, p2, k3: 0.0 })
    }

    fn noise(x: usize, y: usize) -> u16 {
        ((x * 7919 + y * 104_729 + x * y * 31) % 65_536) as u16
    }

    #[test]
    fn the_identity_changes_no_sample_of_any_type() {
        // Through a camera and back, so that the sources carry its rounding.
        let ideal = camera(0.0, 0.0, 0.0, 0.0);
        let map = RectifyMap::between(&ideal, SIZE, &ideal, SIZE).unwrap();
        assert!(map.mask().samples().iter().all(|&has_data| has_data));
        let wide = Raster::from_fn(SIZE.0, SIZE.1, noise);
        let narrow = wide.map(|&level| (level % 251) as u8);
        let real = wide.map(|&level| f32::from(level) / 3.0);
        assert_eq!(map.apply(&wide, 0).unwrap(), wide);
        assert_eq!(map.apply(&narrow, 0).unwrap(), narrow);
        assert_eq!(map.apply(&real, 0.0).unwrap(), real);
    }

    proptest! {
        #[test]
        fn a_linear_ramp_is_sampled_exactly_under_any_distortion(
            k1 in -0.3f64..0.3, k2 in -0.1f64..0.1, p1 in -0.01f64..0.01, p2 in -0.01f64..0.01,
            a in -2.0f64..2.0, b in -2.0f64..2.0,
        ) {
            let camera = camera(k1, k2, p1, p2);
            let output = camera.with_distortion(BrownConrady::default());
            let map = RectifyMap::between(&camera, SIZE, &output, SIZE).unwrap();
            let ramp = Raster::from_fn(SIZE.0, SIZE.1, |x, y| (200.0 + a * x as f64 + b * y as f64) as f32);
            let rectified = map.apply(&ramp, -1.0).unwrap();
            let mask = map.mask();
            for y in 0..SIZE.1 {
                for x in 0..SIZE.0 {
                    let source = source_pixel(&camera, &output, &Vec2::new(x as f64, y as f64));
                    let inside = source.filter(|s| s.x >= 0.0 && s.y >= 0.0 && s.x <= 63.0 && s.y <= 47.0);
                    prop_assert_eq!(mask.get(x, y), inside.is_some());
                    let Some(s) = inside else {
                        prop_assert_eq!(rectified.get(x, y), -1.0);
                        continue;
                    };
                    let expected = 200.0 + a * s.x + b * s.y;
                    // Levels below 430, four f32 roundings and those of the samples: 6 * 430 * 6e-8.
                    prop_assert!((f64::from(rectified.get(x, y)) - expected).abs() < 1.6e-4);
                    prop_assert!((map.source(x, y).unwrap() - s).norm() < 2e-7);
                }
            }
        }

        #[test]
        fn grey_levels_are_rounded_to_the_nearest(shift_x in 0.0f64..1.0, shift_y in 0.0f64..1.0) {
            let levels = Raster::from_fn(8, 6, |x, y| (noise(x, y) % 256) as u8);
            let map = RectifyMap::new((8, 6), (7, 5), |p| Some(p + Vec2::new(shift_x, shift_y))).unwrap();
            let rectified = map.apply(&levels, 0).unwrap();
            for y in 0..5 {
                for x in 0..7 {
                    let at = |dx: usize, dy: usize| f64::from(levels.get(x + dx, y + dy));
                    let upper = at(0, 0) * (1.0 - shift_x) + at(1, 0) * shift_x;
                    let lower = at(0, 1) * (1.0 - shift_x) + at(1, 1) * shift_x;
                    let exact = upper * (1.0 - shift_y) + lower * shift_y;
                    // Half a level; weights of 14 bits, 2 * 255 / 2^15; the middle rounding, 2^-8.
                    prop_assert!((f64::from(rectified.get(x, y)) - exact).abs() <= 0.5 + 0.0195);
                }
            }
        }
    }

    #[test]
    fn the_mask_ends_at_the_centres_of_the_outermost_samples() {
        let image = Raster::from_fn(4, 3, |x, y| (10 * y + x) as u8);
        let shifted =
            |by: f64| RectifyMap::new((4, 3), (4, 3), move |p| Some(p + Vec2::new(by, 0.0))).unwrap();
        let row = |by: f64| shifted(by).mask().row(1).to_vec();
        assert_eq!(row(0.0), [true, true, true, true]);
        assert_eq!(row(1.0), [true, true, true, false]);
        assert_eq!(row(0.25), [true, true, true, false]);
        assert_eq!(row(-0.25), [false, true, true, true]);
        assert_eq!(row(1e-12), [true, true, true, true]);
        assert_eq!(row(f64::NAN), [false; 4]);
        assert_eq!(shifted(1.0).apply(&image, 99).unwrap().row(2), [21, 22, 23, 99]);
        let elsewhere = RectifyMap::new((4, 3), (4, 3), |_| None).unwrap();
        assert_eq!(elsewhere.apply(&image, 7).unwrap(), Raster::filled(4, 3, 7));
    }

    #[test]
    fn sizes_that_do_not_fit_are_refused() {
        let map = RectifyMap::new((4, 3), (4, 3), |p| Some(*p)).unwrap();
        let error = map.apply(&Raster::filled(3, 4, 0u8), 0).unwrap_err();
        assert_eq!(
            error,
            RectifyError::OtherSize { expected_width: 4, expected_height: 3, width: 3, height: 4 }
        );
        assert_eq!(
            RectifyMap::new((1, 3), (4, 3), |p| Some(*p)).unwrap_err(),
            RectifyError::Size { width: 1, height: 3 }
        );
        assert!(RectifyMap::new((usize::MAX, 3), (4, 3), |p| Some(*p)).is_err());
    }
}
