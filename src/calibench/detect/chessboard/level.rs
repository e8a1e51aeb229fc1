//! How does the board look at half the size, a quarter ...? A pyramid of images, and each smoothed for the
//! search.
//!
//! A pixel of a level is the mean of 2 x 2 pixels of the level below, which is what a sensor of larger pixels
//! would see: a level is an image in its own right, with half the blur and half the noise. Pixel `(x, y)` of
//! level `k` is centred on `(x + 1/2) 2^k - 1/2` of the photograph.

use crate::geometry::Vec2;
use crate::geometry::lanes::{Kernel, Lanes, dispatch};
use crate::raster::{Level, Raster};
use std::cell::OnceCell;

/// Least side of a level, px: a board of 3 x 3 squares of 8 px, with its surroundings.
const LEAST_SIDE: usize = 40;

/// Largest size at which a photograph is searched at twice its own, px.
const MOST_TWICE: usize = 4_000_000;

/// Side of a pixel of [`Pyramid::twice`], px of the photograph.
pub const TWICE_PX: f64 = 0.5;

/// The levels of a photograph. Level 0 is the photograph; the others are made when they are first asked for.
pub struct Pyramid<'a, T> {
    photo: &'a Raster<T>,
    reduced: Vec<OnceCell<Raster<f32>>>,
}

impl<'a, T: Level> Pyramid<'a, T> {
    pub fn new(photo: &'a Raster<T>) -> Pyramid<'a, T> {
        let mut reduced = Vec::new();
        let mut side = photo.width().min(photo.height()) / 2;
        while side >= LEAST_SIDE {
            reduced.push(OnceCell::new());
            side /= 2;
        }
        Pyramid { photo, reduced }
    }

    /// Level 0.
    pub fn photo(&self) -> &'a Raster<T> {
        self.photo
    }

    /// Number of levels, the photograph included.
    pub fn levels(&self) -> usize {
        self.reduced.len() + 1
    }

    /// A level above the photograph.
    pub fn reduced(&self, level: usize) -> Option<&Raster<f32>> {
        let cell = self.reduced.get(level.checked_sub(1)?)?;
        Some(cell.get_or_init(|| match self.reduced(level - 1) {
            Some(below) => half(below),
            None => half(self.photo),
        }))
    }

    /// The photograph at twice its size, smoothed for the search of small marks: marks of a few pixels are a
    /// few more apart there. `None` where it would have more than [`MOST_TWICE`] pixels.
    pub fn twice(&self) -> Option<Smoothed> {
        let pixels = self.photo.width().saturating_mul(self.photo.height()).saturating_mul(4);
        (pixels <= MOST_TWICE).then(|| Smoothed::of(&doubled(self.photo)))
    }

    /// A level smoothed for the search.
    pub fn smoothed(&self, level: usize) -> Smoothed {
        match self.reduced(level) {
            Some(raster) => Smoothed::of(raster),
            None => Smoothed::of(self.photo),
        }
    }
}

/// The place in the photograph of a place of a level.
pub fn photo_from_level(place: &Vec2, level: usize) -> Vec2 {
    photo_from_scale(place, scale(level))
}

/// The place in the photograph of a place of an image whose pixels are so large, px of the photograph.
pub fn photo_from_scale(place: &Vec2, scale: f64) -> Vec2 {
    place * scale + Vec2::repeat(0.5 * (scale - 1.0))
}

/// The place in a level of a place of the photograph.
pub fn level_from_photo(place: &Vec2, level: usize) -> Vec2 {
    let scale = scale(level);
    (place - Vec2::repeat(0.5 * (scale - 1.0))) / scale
}

/// Side of a level's pixel, px of the photograph.
pub fn scale(level: usize) -> f64 {
    (1u64 << level) as f64
}

fn half<T: Level>(image: &Raster<T>) -> Raster<f32> {
    let (width, height) = (image.width() / 2, image.height() / 2);
    let mut samples = Vec::with_capacity(width * height);
    for y in 0..height {
        let (upper, lower) = (image.row(2 * y), image.row(2 * y + 1));
        let pairs = upper.chunks_exact(2).zip(lower.chunks_exact(2));
        samples.extend(
            pairs.map(|(a, b)| 0.25 * ((a[0].to_f32() + a[1].to_f32()) + (b[0].to_f32() + b[1].to_f32()))),
        );
    }
    Raster::from_samples(width, height, samples).expect("a sample for every pixel was made")
}

/// Weights of the four samples about a place a quarter of a pixel behind the second: the cubic through them
/// that keeps edges sharp (Keys 1981, a = -1/2).
const QUARTER: [f32; 4] = [-0.070_312_5, 0.867_187_5, 0.226_562_5, -0.023_437_5];

/// The image at twice its size; pixel `(x, y)` is centred on `(x / 2 - 1/4, y / 2 - 1/4)`.
fn doubled<T: Level>(image: &Raster<T>) -> Raster<f32> {
    let (width, height) = (image.width(), image.height());
    // Sample k of the result lies a quarter before or behind sample k / 2.
    let about = |k: usize, count: usize| {
        let (middle, way) = ((k / 2) as isize, if k.is_multiple_of(2) { -1 } else { 1 });
        [-1, 0, 1, 2].map(|d| (middle + way * d).clamp(0, count as isize - 1) as usize)
    };
    let mut samples = Vec::with_capacity(4 * width * height);
    let mut across = Vec::with_capacity(width);
    for y in 0..2 * height {
        let rows = about(y, height).map(|row| image.row(row));
        across.clear();
        across.extend((0..width).map(|x| mixed(rows.map(|row| row[x].to_f32()))));
        samples.extend((0..2 * width).map(|x| mixed(about(x, width).map(|column| across[column]))));
    }
    Raster::from_samples(2 * width, 2 * height, samples).expect("a sample for every pixel was made")
}

fn mixed(samples: [f32; 4]) -> f32 {
    let [a, b, c, d] = [0, 1, 2, 3].map(|k| QUARTER[k] * samples[k]);
    (a + b) + (c + d)
}

/// An image convolved with the binomial `(1 4 6 4 1) / 16` along both axes: variance 1 px^2 each.
pub struct Smoothed {
    image: Raster<f32>,
    /// Standard deviation of a sample's noise before smoothing.
    noise: f64,
    /// Difference of the greatest and the least smoothed sample.
    range: f64,
}

/// Part of a white noise's standard deviation that the smoothing leaves: `70 / 256`.
const NOISE_LEFT: f64 = 70.0 / 256.0;

impl Smoothed {
    fn of<T: Level>(image: &Raster<T>) -> Smoothed {
        let (width, height) = (image.width(), image.height());
        let mut across = vec![0.0f32; width * height];
        let mut row: Vec<f32> = Vec::with_capacity(width + 4);
        for (y, out) in across.chunks_exact_mut(width.max(1)).enumerate() {
            row.clear();
            let samples = image.row(y);
            let (first, last) = (samples[0].to_f32(), samples[width - 1].to_f32());
            row.extend([first; 2]);
            row.extend(samples.iter().map(|sample| sample.to_f32()));
            row.extend([last; 2]);
            dispatch(Binomial { rows: [0, 1, 2, 3, 4].map(|k| &row[k..k + width]), out });
        }
        let line = |y: isize| {
            let y = y.clamp(0, height as isize - 1) as usize;
            &across[y * width..][..width]
        };
        let mut samples = vec![0.0f32; width * height];
        for (y, out) in samples.chunks_exact_mut(width.max(1)).enumerate() {
            dispatch(Binomial { rows: [-2, -1, 0, 1, 2].map(|k| line(y as isize + k)), out });
        }
        let range = dispatch(Range(&samples));
        let image_smoothed =
            Raster::from_samples(width, height, samples).expect("a sample for every pixel was made");
        Smoothed {
            image: image_smoothed,
            noise: noise(image),
            range: if range.is_finite() { range } else { 0.0 },
        }
    }

    pub fn image(&self) -> &Raster<f32> {
        &self.image
    }

    /// Standard deviation of a smoothed sample's noise.
    pub fn noise(&self) -> f64 {
        NOISE_LEFT * self.noise
    }

    /// Difference of the greatest and the least sample.
    pub fn range(&self) -> f64 {
        self.range
    }

    /// Whether a place is at least `margin` px inside.
    pub fn holds(&self, place: &Vec2, margin: f64) -> bool {
        let fits = |at: f64, size: usize| at >= margin && at + margin + 1.0 < size as f64;
        fits(place.x, self.image.width()) && fits(place.y, self.image.height())
    }

    /// The level of the pixel at a place that [`holds`](Smoothed::holds) found inside.
    pub fn nearest(&self, place: &Vec2) -> f64 {
        f64::from(self.image.get((place.x + 0.5) as usize, (place.y + 0.5) as usize))
    }

    /// The level at a place that [`holds`](Smoothed::holds) found inside, bilinear.
    pub fn at(&self, place: &Vec2) -> f64 {
        let (x, y) = (place.x as usize, place.y as usize);
        let (a, b) = (place.x - x as f64, place.y - y as f64);
        let (upper, lower) = (&self.image.row(y)[x..x + 2], &self.image.row(y + 1)[x..x + 2]);
        let mix = |row: &[f32]| f64::from(row[0]) + (f64::from(row[1]) - f64::from(row[0])) * a;
        mix(upper) + (mix(lower) - mix(upper)) * b
    }
}

/// The binomial mean of five rows, written over a sixth. A kernel, so that it is compiled for wide registers
/// too.
struct Binomial<'a> {
    rows: [&'a [f32]; 5],
    out: &'a mut [f32],
}

impl Kernel for Binomial<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Binomial { rows, out } = self;
        let [a, b, c, d, e] = rows.map(|row| &row[..out.len()]);
        for x in 0..out.len() {
            out[x] = ((a[x] + e[x]) + 4.0 * (b[x] + d[x]) + 6.0 * c[x]) * 0.0625;
        }
    }
}

/// Samples that are compared at once; the greatest and the least do not depend on the order.
const AT_ONCE: usize = 16;

/// The greatest sample minus the least.
struct Range<'a>(&'a [f32]);

impl Kernel for Range<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<L: Lanes>(self) -> f64 {
        let (mut low, mut high) = ([f32::INFINITY; AT_ONCE], [f32::NEG_INFINITY; AT_ONCE]);
        let (whole, left) = self.0.as_chunks::<AT_ONCE>();
        for part in whole {
            for k in 0..AT_ONCE {
                low[k] = lesser(low[k], part[k]);
                high[k] = greater(high[k], part[k]);
            }
        }
        let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
        low.iter().chain(left).for_each(|sample| least = lesser(least, *sample));
        high.iter().chain(left).for_each(|sample| most = greater(most, *sample));
        f64::from(most) - f64::from(least)
    }
}

#[inline(always)]
fn lesser(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

/// Samples that the noise is estimated from, about.
const NOISE_SAMPLES: usize = 4000;

/// Standard deviation of white noise: second differences along rows have a variance of `6 sigma^2`, and most
/// of an image has no edge; the lower quartile of `|N|` is 0.3186 standard deviations.
fn noise<T: Level>(image: &Raster<T>) -> f64 {
    let (width, height) = (image.width(), image.height());
    if width < 3 {
        return 0.0;
    }
    let step = (width * height).div_ceil(NOISE_SAMPLES).max(1);
    // Rows and columns in the same proportion; an odd stride along a row, so that no regular pattern is met
    // in step.
    let stride = (step as f64).sqrt() as usize | 1;
    let mut differences: Vec<f64> = Vec::with_capacity(2 * NOISE_SAMPLES);
    for y in (0..height).step_by(stride) {
        let row = image.row(y);
        for x in (1..width - 1).step_by(stride) {
            let second = row[x - 1].to_f64() - 2.0 * row[x].to_f64() + row[x + 1].to_f64();
            differences.push(second.abs());
        }
    }
    let quarter = differences.len() / 4;
    let (_, quartile, _) = differences.select_nth_unstable_by(quarter, f64::total_cmp);
    *quartile / (0.3186 * 6.0f64.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_twice_the_size_a_plane_and_a_parabola_are_where_they_were() {
        let of = |x: f64, y: f64| 0.3 + 0.01 * x - 0.02 * y + 0.001 * x * x;
        let image = Raster::from_fn(40, 50, |x, y| of(x as f64, y as f64) as f32);
        let twice = doubled(&image);
        assert_eq!((twice.width(), twice.height()), (80, 100));
        for (x, y) in [(8, 9), (21, 30), (40, 71)] {
            let place = photo_from_scale(&Vec2::new(x as f64, y as f64), TWICE_PX);
            assert!((f64::from(twice.get(x, y)) - of(place.x, place.y)).abs() < 1e-5);
        }
    }

    #[test]
    fn large_photographs_are_not_doubled() {
        let of = |width, height| Raster::from_fn(width, height, |_, _| 0.5f32);
        assert!(Pyramid::new(&of(1000, 1000)).twice().is_some());
        assert!(Pyramid::new(&of(1001, 1000)).twice().is_none());
    }
}
