//! Rectification of 8-bit levels with the widest registers that the machine has, and the same bits without
//! them.

use super::fraction::{Place, coarse};
use super::source_row::Sources;
use super::window::{Limits, PIXELS, Window, mix};

/// Registers that hold a window.
trait Registers {
    type Window: Copy;
    /// [`Window::of`].
    fn find(u: &[f64; PIXELS], v: &[f64; PIXELS], width: usize, limits: &Limits) -> Option<Self::Window>;
    /// A window that is not [`Window::NONE`].
    fn load(window: &Window) -> Self::Window;
    /// [`Window::mix`].
    fn mix(window: Self::Window, samples: &[u8], width: usize) -> [u8; PIXELS];
}

/// A photograph of 8-bit levels.
#[derive(Clone, Copy)]
pub struct Photograph<'a> {
    samples: &'a [u8],
    size: (usize, usize),
    limits: Limits,
}

impl<'a> Photograph<'a> {
    /// Of an image's samples and size.
    pub fn new(samples: &'a [u8], size: (usize, usize)) -> Photograph<'a> {
        Photograph { samples, size, limits: Limits::of(size) }
    }

    /// The level at a place.
    pub fn at(&self, place: &Place) -> u8 {
        let at = place.row as usize * self.size.0 + place.column as usize;
        mix(self.samples, self.size.0, at, coarse(place.right), coarse(place.down))
    }

    /// Levels of pixels one by one; pixels outside stay as they are.
    #[cold]
    fn mix_single(&self, sources: &Sources, first: usize, levels: &mut [u8]) {
        for (i, level) in levels.iter_mut().enumerate() {
            if let Some(place) = Place::of(&sources.get(first + i), self.size) {
                *level = self.at(&place);
            }
        }
    }

    /// Levels of a part of an output row from their windows; `single` gives the levels of a block without
    /// window, by number.
    pub fn mix_windows(&self, windows: &[Window], levels: &mut [u8], single: impl FnMut(usize, &mut [u8])) {
        #[cfg(all(target_arch = "x86_64", not(calibench_portable)))]
        if std::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { wide::mix_windows(self, windows, levels, single) };
        }
        mix_windows::<Portable>(self, windows, levels, single);
    }

    /// Levels of a part of an output row from their sources; pixels outside stay as they are.
    pub fn mix_sources(&self, sources: &Sources, levels: &mut [u8]) {
        #[cfg(all(target_arch = "x86_64", not(calibench_portable)))]
        if std::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { wide::mix_sources(self, sources, levels) };
        }
        mix_sources::<Portable>(self, sources, levels);
    }
}

#[inline(always)]
fn mix_windows<R: Registers>(
    photograph: &Photograph,
    windows: &[Window],
    levels: &mut [u8],
    mut single: impl FnMut(usize, &mut [u8]),
) {
    let (samples, width) = (photograph.samples, photograph.size.0);
    let (full, rest) = levels.as_chunks_mut::<PIXELS>();
    for (block, (window, levels)) in windows.iter().zip(&mut *full).enumerate() {
        if window.first != Window::NONE.first {
            *levels = R::mix(R::load(window), samples, width);
        } else {
            single(block, levels);
        }
    }
    if !rest.is_empty() {
        single(full.len(), rest);
    }
}

#[inline(always)]
fn mix_sources<R: Registers>(photograph: &Photograph, sources: &Sources, levels: &mut [u8]) {
    let Photograph { samples, size: (width, _), limits } = *photograph;
    let (us, vs) = (sources.u.as_chunks::<PIXELS>().0, sources.v.as_chunks::<PIXELS>().0);
    let (full, rest) = levels.as_chunks_mut::<PIXELS>();
    for (block, ((u, v), levels)) in us.iter().zip(vs).zip(&mut *full).enumerate() {
        match R::find(u, v, width, &limits) {
            Some(window) => *levels = R::mix(window, samples, width),
            None => photograph.mix_single(sources, block * PIXELS, levels),
        }
    }
    photograph.mix_single(sources, full.len() * PIXELS, rest);
}

/// Plain code, for any machine.
struct Portable;

impl Registers for Portable {
    type Window = Window;

    #[inline(always)]
    fn find(u: &[f64; PIXELS], v: &[f64; PIXELS], width: usize, limits: &Limits) -> Option<Window> {
        Window::of(u, v, width, limits)
    }

    #[inline(always)]
    fn load(window: &Window) -> Window {
        *window
    }

    #[inline(always)]
    fn mix(window: Window, samples: &[u8], width: usize) -> [u8; PIXELS] {
        window.mix(samples, width)
    }
}

/// AVX2. [`wide::Wide`] is named in this module only, in functions compiled for AVX2, which run only where
/// AVX2 is: that is what makes every `unsafe` block below sound that is not about a pointer.
#[cfg(all(target_arch = "x86_64", not(calibench_portable)))]
mod wide {
    use super::super::fraction::{COARSE, COARSE_BITS, ROUNDING};
    use super::super::window::{COLUMNS, LOWER, Limits, MIDDLE_BITS, PIXELS, ROWS, TO_NEAREST, Window};
    use super::{Photograph, Registers, Sources};
    use std::arch::x86_64::*;

    struct Wide;

    #[derive(Clone, Copy)]
    struct WideWindow {
        first: usize,
        /// Eight bytes.
        places: __m128i,
        /// Eight of 32 bits.
        right: __m256i,
        down: __m256i,
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn mix_windows(
        photograph: &Photograph,
        windows: &[Window],
        levels: &mut [u8],
        single: impl FnMut(usize, &mut [u8]),
    ) {
        super::mix_windows::<Wide>(photograph, windows, levels, single);
    }

    #[target_feature(enable = "avx2")]
    pub(super) fn mix_sources(photograph: &Photograph, sources: &Sources, levels: &mut [u8]) {
        super::mix_sources::<Wide>(photograph, sources, levels);
    }

    /// `whole_position` of eight positions.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn whole_positions(positions: &[f64; PIXELS]) -> __m256i {
        let four = |values: &[f64]| {
            // SAFETY: the pointer is to four numbers.
            let position = unsafe { _mm256_loadu_pd(values[..4].as_ptr()) };
            _mm256_cvttpd_epi32(_mm256_add_pd(position, _mm256_set1_pd(ROUNDING)))
        };
        _mm256_set_m128i(four(&positions[4..]), four(&positions[..4]))
    }

    /// The halves of eight numbers of 32 bits, as numbers of 16 bits.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn narrowed(numbers: __m256i) -> __m128i {
        _mm_packus_epi32(_mm256_castsi256_si128(numbers), _mm256_extracti128_si256::<1>(numbers))
    }

    #[target_feature(enable = "avx2")]
    #[inline]
    fn find(u: &[f64; PIXELS], v: &[f64; PIXELS], width: usize, limits: &Limits) -> Option<WideWindow> {
        let (u, v) = (whole_positions(u), whole_positions(v));
        let (column, row) = limits.corner(
            _mm256_extract_epi32::<0>(u),
            [_mm256_extract_epi32::<0>(v), _mm256_extract_epi32::<7>(v)],
        )?;
        let whole = |of: __m256i| _mm256_srai_epi32::<{ COARSE_BITS as i32 }>(of);
        let x = _mm256_sub_epi32(whole(u), _mm256_set1_epi32(column));
        let y = _mm256_sub_epi32(whole(v), _mm256_set1_epi32(row));
        // Bits that a place in the window does not have: none in columns 0 to 14, where column + 1 has none
        // either, and rows 0 and 1.
        let next = _mm256_add_epi32(x, _mm256_set1_epi32(1));
        let bits = _mm256_or_si256(_mm256_or_si256(x, next), _mm256_slli_epi32::<3>(y));
        if _mm256_testz_si256(bits, _mm256_set1_epi32(!(COLUMNS as i32 - 1))) == 0 {
            return None;
        }
        let fraction = |of: __m256i| _mm256_and_si256(of, _mm256_set1_epi32(i32::from(COARSE) - 1));
        let places = narrowed(_mm256_or_si256(x, _mm256_slli_epi32::<{ LOWER.trailing_zeros() as i32 }>(y)));
        Some(WideWindow {
            first: row as usize * width + column as usize,
            places: _mm_packus_epi16(places, places),
            right: fraction(u),
            down: fraction(v),
        })
    }

    #[target_feature(enable = "avx2")]
    #[inline]
    fn load(window: &Window) -> WideWindow {
        // SAFETY: the pointers are to 8, 16 and 16 bytes.
        unsafe {
            WideWindow {
                first: window.first as usize,
                places: _mm_loadl_epi64(window.places.as_ptr().cast()),
                right: _mm256_cvtepu16_epi32(_mm_loadu_si128(window.right.as_ptr().cast())),
                down: _mm256_cvtepu16_epi32(_mm_loadu_si128(window.down.as_ptr().cast())),
            }
        }
    }

    /// Pairs of weights `(1 - w, w)`.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn pairs(weights: __m256i) -> __m256i {
        let others = _mm256_sub_epi32(_mm256_set1_epi32(i32::from(COARSE)), weights);
        _mm256_or_si256(others, _mm256_slli_epi32::<16>(weights))
    }

    #[target_feature(enable = "avx2")]
    #[inline]
    fn mix(window: WideWindow, samples: &[u8], width: usize) -> [u8; PIXELS] {
        let part = samples[window.first..][..(ROWS - 1) * width + COLUMNS].as_ptr();
        // SAFETY: the part holds three rows, of sixteen bytes at least.
        let (top, middle, bottom) = unsafe {
            (
                _mm_loadu_si128(part.cast()),
                _mm_loadu_si128(part.add(width).cast()),
                _mm_loadu_si128(part.add(2 * width).cast()),
            )
        };
        // Every place twice: for the left sample, and one more for the right one. A set highest bit makes
        // zero of a shuffled byte, so that each comes from one of two rows.
        let twice = _mm_unpacklo_epi8(window.places, window.places);
        let first = _mm_add_epi8(twice, _mm_set1_epi16(0x0100));
        let second = _mm_xor_si128(first, _mm_set1_epi8(LOWER as i8));
        let of_two = |one: __m128i, other: __m128i| {
            let both = _mm_or_si128(_mm_shuffle_epi8(one, first), _mm_shuffle_epi8(other, second));
            _mm256_cvtepu8_epi16(both)
        };
        let (upper, lower) = (of_two(top, middle), of_two(middle, bottom));
        let right = pairs(window.right);
        // Each cut to its middle bits, the lower one in the upper halves.
        let upper =
            _mm256_srli_epi32::<{ (COARSE_BITS - MIDDLE_BITS) as i32 }>(_mm256_madd_epi16(upper, right));
        let lower =
            _mm256_slli_epi32::<{ (16 + MIDDLE_BITS - COARSE_BITS) as i32 }>(_mm256_madd_epi16(lower, right));
        let both = _mm256_blend_epi16::<0b1010_1010>(upper, lower);
        let mixed = _mm256_add_epi32(
            _mm256_madd_epi16(both, pairs(window.down)),
            _mm256_set1_epi32(TO_NEAREST as i32),
        );
        let levels = narrowed(_mm256_srli_epi32::<{ (COARSE_BITS + MIDDLE_BITS) as i32 }>(mixed));
        _mm_cvtsi128_si64(_mm_packus_epi16(levels, levels)).to_le_bytes()
    }

    impl Registers for Wide {
        type Window = WideWindow;

        #[inline(always)]
        fn find(u: &[f64; PIXELS], v: &[f64; PIXELS], width: usize, limits: &Limits) -> Option<WideWindow> {
            // SAFETY: see the module.
            unsafe { find(u, v, width, limits) }
        }

        #[inline(always)]
        fn load(window: &Window) -> WideWindow {
            // SAFETY: see the module.
            unsafe { load(window) }
        }

        #[inline(always)]
        fn mix(window: WideWindow, samples: &[u8], width: usize) -> [u8; PIXELS] {
            // SAFETY: see the module.
            unsafe { mix(window, samples, width) }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec2;

    const SIZE: (usize, usize) = (97, 61);

    /// Every `STEP`th case is tried. Miri, which takes minutes for each hundred, gets few of every kind.
    const STEP: usize = if cfg!(miri) { 11 } else { 1 };
    /// Pixels of a row, with a part of a block at the end.
    const COUNT: usize = if cfg!(miri) { 43 } else { 251 };

    fn samples() -> Vec<u8> {
        (0..SIZE.0 * SIZE.1).map(|i| ((i * 7919 + i * i % 251 * 31) % 256) as u8).collect()
    }

    /// Sources that a lens may give: along a row, drifting down and stretched, some outside, some at the very
    /// edge.
    fn row(stretch: f64, slope: f64, start: Vec2) -> Sources {
        let mut sources = Sources::new();
        for i in 0..COUNT.next_multiple_of(PIXELS) {
            let t = i as f64;
            sources.set(i, Some(start + Vec2::new(stretch * t, slope * t + 1e-4 * t * t)));
        }
        sources
    }

    /// Stretch, slope and start of the rows that are tried.
    fn cases() -> impl Iterator<Item = (f64, f64, Vec2)> {
        const STARTS: [(f64, f64); 7] = [
            (-3.3, 0.0),
            (0.0, 0.0),
            (0.25, 1.0),
            (5.1, 57.9),
            (12.7, 30.5),
            (95.0, 58.999),
            (f64::NAN, 3.0),
        ];
        let stretches = [-1.1, 0.3, 0.97, 1.0, 1.06, 1.9, 2.5].into_iter();
        let all = stretches.flat_map(|stretch| {
            [-0.3, -0.02, 0.0, 0.11]
                .into_iter()
                .flat_map(move |slope| STARTS.map(|(u, v)| (stretch, slope, Vec2::new(u, v))))
        });
        all.step_by(STEP)
    }

    #[test]
    fn wide_registers_give_the_bits_of_single_pixels() {
        let samples = samples();
        let photograph = Photograph::new(&samples, SIZE);
        let (mut in_windows, mut blocks) = (0, 0);
        for (stretch, slope, start) in cases() {
            let sources = row(stretch, slope, start);
            let (mut expected, mut portable, mut wide) = (vec![9; COUNT], vec![9; COUNT], vec![9; COUNT]);
            for (i, level) in expected.iter_mut().enumerate() {
                if let Some(place) = Place::of(&sources.get(i), SIZE) {
                    *level = photograph.at(&place);
                }
            }
            mix_sources::<Portable>(&photograph, &sources, &mut portable);
            photograph.mix_sources(&sources, &mut wide);
            assert_eq!(portable, expected, "{stretch} {slope} {start:?}");
            assert_eq!(wide, expected, "{stretch} {slope} {start:?}");

            let us = sources.u.as_chunks::<PIXELS>().0.iter();
            let windows: Vec<Window> = us
                .zip(sources.v.as_chunks::<PIXELS>().0)
                .take(COUNT.div_ceil(PIXELS))
                .map(|(u, v)| Window::of(u, v, SIZE.0, &Limits::of(SIZE)).unwrap_or(Window::NONE))
                .collect();
            in_windows += windows.iter().filter(|window| **window != Window::NONE).count();
            blocks += windows.len();
            let single = |block: usize, levels: &mut [u8]| {
                let first = block * PIXELS;
                levels.copy_from_slice(&expected[first..first + levels.len()]);
            };
            for levels in [&mut portable, &mut wide] {
                levels.fill(9);
            }
            mix_windows::<Portable>(&photograph, &windows, &mut portable, single);
            photograph.mix_windows(&windows, &mut wide, single);
            assert_eq!(portable, expected);
            assert_eq!(wide, expected);
        }
        // Both ways were taken, by a twelfth of all blocks at least.
        assert!(12 * in_windows.min(blocks - in_windows) > blocks, "{in_windows} of {blocks}");
    }

    #[test]
    fn images_smaller_than_a_window_are_mixed_pixel_by_pixel() {
        let samples = [10, 20, 30, 40];
        let photograph = Photograph::new(&samples, (2, 2));
        let mut levels = [0; 8];
        photograph.mix_sources(&row(0.125, 0.0, Vec2::new(0.0, 0.5)), &mut levels);
        // Half-way down: 20 to 30.
        assert_eq!(levels, [20, 21, 23, 24, 25, 26, 28, 29]);
    }
}
