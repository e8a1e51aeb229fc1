//! How are eight neighbouring pixels of 8 bits mixed at once? From a window of three rows of sixteen samples,
//! in whole numbers.
//!
//! A lens moves neighbours nearly alike: the sources of eight output pixels in a row lie, as a rule, within
//! fifteen columns and two rows. Such a window is loaded as three registers and its samples are shuffled into
//! place. Whatever the registers, the arithmetic is that of [`mix`], so the bits are the same; pixels that
//! lie otherwise are mixed one by one.

use super::fraction::{COARSE, COARSE_BITS, whole_position};

/// Output pixels of a window.
pub const PIXELS: usize = 8;

/// Samples of one of its rows.
pub const COLUMNS: usize = 16;

/// Its rows.
pub const ROWS: usize = 3;

/// Eight output pixels and where their samples are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// Index of the window's upper left sample.
    pub first: u32,
    /// Column of a pixel's upper left sample in the window, and [`LOWER`] more if it lies in the second row.
    pub places: [u8; PIXELS],
    /// Weights of the right samples.
    pub right: [u16; PIXELS],
    /// Weights of the lower samples.
    pub down: [u16; PIXELS],
}

/// Marks a place in the second row of a window.
pub const LOWER: u8 = 0x80;

impl Window {
    /// No window: the pixels are to be mixed one by one.
    pub const NONE: Window =
        Window { first: u32::MAX, places: [0; PIXELS], right: [0; PIXELS], down: [0; PIXELS] };

    /// The window of eight sources, given in coarse fractions of a pixel; `None` where they do not lie in
    /// one, or not all inside the image of this width and these limits.
    pub fn of(u: &[f64; PIXELS], v: &[f64; PIXELS], width: usize, limits: &Limits) -> Option<Window> {
        let (u, v) = (u.map(whole_position), v.map(whole_position));
        let (column, row) = limits.corner(u[0], [v[0], v[PIXELS - 1]])?;
        let mut window = Window { first: (row as usize * width + column as usize) as u32, ..Window::NONE };
        for i in 0..PIXELS {
            let (x, y) = ((u[i] >> COARSE_BITS) - column, (v[i] >> COARSE_BITS) - row);
            // A pixel on the very first column or row may be outside by less than a fraction: not to be
            // decided here.
            let is_inside =
                u[i] > 0 && v[i] > 0 && (0..COLUMNS as i32 - 1).contains(&x) && (y == 0 || y == 1);
            if !is_inside {
                return None;
            }
            window.places[i] = x as u8 | if y == 1 { LOWER } else { 0 };
            window.right[i] = (u[i] & (i32::from(COARSE) - 1)) as u16;
            window.down[i] = (v[i] & (i32::from(COARSE) - 1)) as u16;
        }
        Some(window)
    }

    /// The eight levels.
    pub fn mix(&self, samples: &[u8], width: usize) -> [u8; PIXELS] {
        std::array::from_fn(|i| {
            let lower = if self.places[i] & LOWER != 0 { width } else { 0 };
            let at = self.first as usize + usize::from(self.places[i] & !LOWER) + lower;
            mix(samples, width, at, self.right[i], self.down[i])
        })
    }
}

/// How far right and down a window may begin in an image.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    column: i32,
    row: i32,
}

impl Limits {
    /// Negative, so that nothing is a window, for images smaller than one.
    pub fn of((width, height): (usize, usize)) -> Limits {
        let last = |size: usize, part: usize| i32::try_from(size).unwrap_or(i32::MAX) - part as i32;
        Limits { column: last(width, COLUMNS), row: last(height, ROWS) }
    }

    /// Column and row of a window's upper left sample, from the sources of its first and last pixel in coarse
    /// fractions: so far left and up that it lies in the image. The first pixel is taken for the leftmost: a
    /// mirrored image has no windows. `None` if they are not to be had, or in the first column or row: a
    /// pixel there may be outside by less than a fraction, which is not to be decided here.
    #[inline(always)]
    pub fn corner(&self, u: i32, v: [i32; 2]) -> Option<(i32, i32)> {
        let column = (u >> COARSE_BITS).min(self.column);
        let row = (v[0].min(v[1]) >> COARSE_BITS).min(self.row);
        // Either sign: a single test.
        (((column - 1) | (row - 1)) >= 0).then_some((column, row))
    }
}

/// Bits of a level between its two mixings: it then fits 15 bits. Cut to these it is too small by 2^-8 in the
/// mean, and by no more off that.
pub const MIDDLE_BITS: u32 = 7;

/// What rounds a mixture to the nearest level: a half, and the mean of what was cut off.
pub const TO_NEAREST: u32 = (1 << (COARSE_BITS + MIDDLE_BITS - 1)) + (1 << (COARSE_BITS - 1));

/// The mixture of four samples, the upper left at index `at`, in whole numbers: within half a level, and 0.02
/// for weights of 14 bits, of the exact one. Weights are at most [`COARSE`].
#[inline(always)]
pub fn mix(samples: &[u8], width: usize, at: usize, right: u16, down: u16) -> u8 {
    let between = |index: usize| {
        let (left, other) = (u32::from(samples[index]), u32::from(samples[index + 1]));
        (left * u32::from(COARSE - right) + other * u32::from(right)) >> (COARSE_BITS - MIDDLE_BITS)
    };
    let (upper, lower) = (between(at), between(at + width));
    let mixed = upper * u32::from(COARSE - down) + lower * u32::from(down);
    ((mixed + TO_NEAREST) >> (COARSE_BITS + MIDDLE_BITS)) as u8
}
