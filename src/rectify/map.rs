//! Which four samples make an output pixel, and in what mixture? A look-up table, computed once for images of one size.

use super::Sample;
use super::points::source_within;
use crate::camera::Camera;
use crate::geometry::Vec2;
use crate::raster::Raster;

/// Why an image cannot be rectified.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
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
/// An output pixel has data when its source lies within the centres of the photograph's outermost samples, so that no sample is
/// invented. Pixel (0, 0) is the centre of the top-left sample on both sides.
#[derive(Debug, Clone, PartialEq)]
pub struct RectifyMap {
    input_size: (usize, usize),
    output_size: (usize, usize),
    entries: Vec<Entry>,
}

/// Index of the upper left of four samples, and how far towards the right and lower ones.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Entry {
    upper_left: u32,
    right: f32,
    down: f32,
}

const NO_DATA: u32 = u32::MAX;
/// A source this close to a sample's centre is on it: maps that agree but for rounding (1e-12 px) take samples unchanged, and
/// a source on the image's edge is inside. It moves nothing visibly: `f32` weights are coarser.
const ON_A_SAMPLE_PX: f64 = 1e-9;

impl RectifyMap {
    /// The table of any inverse map: `source` gives the photograph's pixel that an output pixel shows, or `None`. Sizes are
    /// width and height, px.
    ///
    /// # Errors
    /// Photographs of fewer than 2 x 2 pixels.
    pub fn new(
        input_size: (usize, usize),
        output_size: (usize, usize),
        source: impl Fn(&Vec2) -> Option<Vec2>,
    ) -> Result<RectifyMap, RectifyError> {
        let (width, height) = input_size;
        let too_many = width.checked_mul(height).is_none_or(|samples| samples >= NO_DATA as usize);
        if width < 2 || height < 2 || too_many {
            return Err(RectifyError::Size { width, height });
        }
        let mut entries = Vec::with_capacity(output_size.0 * output_size.1);
        for y in 0..output_size.1 {
            for x in 0..output_size.0 {
                let position = source(&Vec2::new(x as f64, y as f64));
                entries.push(position.map_or(Entry::NONE, |p| Entry::at(&p, width, height)));
            }
        }
        Ok(RectifyMap { input_size, output_size, entries })
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
        let radius = camera.distortion.monotone_radius();
        RectifyMap::new(input_size, output_size, |pixel| source_within(camera, output, radius, pixel))
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
    pub fn apply<T: Sample>(&self, photograph: &Raster<T>, border: T) -> Result<Raster<T>, RectifyError> {
        let (width, height) = (photograph.width(), photograph.height());
        if (width, height) != self.input_size {
            let (expected_width, expected_height) = self.input_size;
            return Err(RectifyError::OtherSize { expected_width, expected_height, width, height });
        }
        let samples = photograph.samples();
        let mut output = Raster::filled(self.output_size.0, self.output_size.1, border);
        for y in 0..self.output_size.1 {
            for (level, entry) in output.row_mut(y).iter_mut().zip(self.row(y)) {
                if entry.upper_left != NO_DATA {
                    *level = entry.mix(samples, width);
                }
            }
        }
        Ok(output)
    }

    /// Which output pixels have data.
    pub fn mask(&self) -> Raster<bool> {
        Raster::from_fn(self.output_size.0, self.output_size.1, |x, y| self.row(y)[x].upper_left != NO_DATA)
    }

    /// The photograph's pixel that an output pixel is sampled at, to the precision of the weights; `None` without data. Panics
    /// outside the output.
    pub fn source(&self, x: usize, y: usize) -> Option<Vec2> {
        let entry = self.row(y)[x];
        (entry.upper_left != NO_DATA).then(|| {
            let index = entry.upper_left as usize;
            let (column, row) = (index % self.input_size.0, index / self.input_size.0);
            Vec2::new(column as f64 + f64::from(entry.right), row as f64 + f64::from(entry.down))
        })
    }

    fn row(&self, y: usize) -> &[Entry] {
        &self.entries[y * self.output_size.0..][..self.output_size.0]
    }
}

impl Entry {
    const NONE: Entry = Entry { upper_left: NO_DATA, right: 0.0, down: 0.0 };

    fn at(source: &Vec2, width: usize, height: usize) -> Entry {
        match (split(source.x, width), split(source.y, height)) {
            (Some((column, right)), Some((row, down))) => {
                Entry { upper_left: (row * width + column) as u32, right, down }
            }
            _ => Entry::NONE,
        }
    }

    /// Exact where a weight is 0 or 1, unlike `left + w (right - left)`.
    fn mix<T: Sample>(&self, samples: &[T], width: usize) -> T {
        let at = self.upper_left as usize;
        let between = |index: usize| {
            let (left, right) = (samples[index].to_f32(), samples[index + 1].to_f32());
            left * (1.0 - self.right) + right * self.right
        };
        let (upper, lower) = (between(at), between(at + width));
        T::from_f32(upper * (1.0 - self.down) + lower * self.down)
    }
}

/// The lower of two neighbouring samples about a position, and the weight of the upper one; the last pair serves the last sample
/// too. `None` outside of the samples' centres, or for NaN.
fn split(position: f64, count: usize) -> Option<(usize, f32)> {
    let nearest = position.round();
    let position = if (position - nearest).abs() <= ON_A_SAMPLE_PX { nearest } else { position };
    if !(position >= 0.0 && position <= (count - 1) as f64) {
        return None;
    }
    let lower = (position as usize).min(count - 2);
    Some((lower, (position - lower as f64) as f32))
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
                    // Half a level, and f32 rounding of levels below 256.
                    prop_assert!((f64::from(rectified.get(x, y)) - exact).abs() <= 0.5 + 1e-4);
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
