//! Rectification of 8-bit levels with the widest registers that the machine has, and the same bits without them.

use super::fraction::{Place, coarse};
use super::source_row::Sources;
use super::window::{PIXELS, Window, mix};

/// Registers that hold a window.
trait Registers {
    type Window: Copy;
    /// [`Window::of`].
    fn find(u: &[f64; PIXELS], v: &[f64; PIXELS], size: (usize, usize)) -> Option<Self::Window>;
    /// A window that is not [`Window::NONE`].
    fn load(window: &Window) -> Self::Window;
    /// [`Window::mix`].
    fn mix(window: Self::Window, samples: &[u8], width: usize) -> [u8; PIXELS];
}

/// A photograph of 8-bit levels.
#[derive(Clone, Copy)]
pub struct Photograph<'a> {
    pub samples: &'a [u8],
    pub size: (usize, usize),
}

impl Photograph<'_> {
    /// The level at a place.
    pub fn at(&self, place: &Place) -> u8 {
        let at = place.row as usize * self.size.0 + place.column as usize;
        mix(self.samples, self.size.0, at, coarse(place.right), coarse(place.down))
    }

    /// Levels of a part of an output row from their windows; `single` gives the levels of a block without window, by number.
    pub fn mix_windows(&self, windows: &[Window], levels: &mut [u8], single: impl FnMut(usize, &mut [u8])) {
        #[cfg(target_arch = "x86_64")]
        if std::is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has AVX2.
            return unsafe { wide::mix_windows(self, windows, levels, single) };
        }
        mix_windows::<Portable>(self, windows, levels, single);
    }

    /// Levels of a part of an output row from their sources; pixels outside stay as they are.
    pub fn mix_sources(&self, sources: &Sources, levels: &mut [u8]) {
        #[cfg(target_arch = "x86_64")]
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
    for (block, (window, levels)) in windows.iter().zip(levels.chunks_mut(PIXELS)).enumerate() {
        if window.first != Window::NONE.first && levels.len() == PIXELS {
            levels.copy_from_slice(&R::mix(R::load(window), photograph.samples, photograph.size.0));
        } else {
            single(block, levels);
        }
    }
}

#[inline(always)]
fn mix_sources<R: Registers>(photograph: &Photograph, sources: &Sources, levels: &mut [u8]) {
    let (us, vs) = (sources.u.as_chunks::<PIXELS>().0, sources.v.as_chunks::<PIXELS>().0);
    for (block, ((u, v), levels)) in us.iter().zip(vs).zip(levels.chunks_mut(PIXELS)).enumerate() {
        if levels.len() == PIXELS
            && let Some(window) = R::find(u, v, photograph.size)
        {
            levels.copy_from_slice(&R::mix(window, photograph.samples, photograph.size.0));
            continue;
        }
        for (i, level) in levels.iter_mut().enumerate() {
            if let Some(place) = Place::of(&sources.get(block * PIXELS + i), photograph.size) {
                *level = photograph.at(&place);
            }
        }
    }
}

/// Plain code, for any machine.
struct Portable;

impl Registers for Portable {
    type Window = Window;

    #[inline(always)]
    fn find(u: &[f64; PIXELS], v: &[f64; PIXELS], size: (usize, usize)) -> Option<Window> {
        Window::of(u, v, size)
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

/// AVX2. [`wide::Wide`] is named in this module only, in functions compiled for AVX2, which run only where AVX2 is: that is what makes every
/// `unsafe` block below sound that is not about a pointer.
#[cfg(target_arch = "x86_64")]
mod wide {
    use super::super::fraction::{COARSE, COARSE_BITS, ON_A_SAMPLE_PX};
    use super::super::window::{COLUMNS, LOWER, MIDDLE_BITS, PIXELS, Window, corner};
    use super::{Photograph, Registers, Sources};
    use std::arch::x86_64::*;

    struct Wide;

    #[derive(Clone, Copy)]
    struct WideWindow {
        first: usize,
        /// Eight bytes.
        places: __m128i,
        /// Eight of 16 bits.
        right: __m128i,
        down: __m128i,
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

    /// `coarse_position` of eight positions.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn coarse_positions(positions: &[f64; PIXELS]) -> __m256i {
        let four = |values: &[f64]| {
            // SAFETY: the pointer is to four numbers.
            let position = unsafe { _mm256_loadu_pd(values[..4].as_ptr()) };
            let nudged = _mm256_add_pd(position, _mm256_set1_pd(ON_A_SAMPLE_PX));
            let fractions = _mm256_mul_pd(nudged, _mm256_set1_pd(f64::from(COARSE)));
            _mm256_cvttpd_epi32(_mm256_add_pd(fractions, _mm256_set1_pd(0.5)))
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
    fn find(u: &[f64; PIXELS], v: &[f64; PIXELS], size: (usize, usize)) -> Option<WideWindow> {
        let (u, v) = (coarse_positions(u), coarse_positions(v));
        let ends = |of: __m256i| [_mm256_extract_epi32::<0>(of), _mm256_extract_epi32::<7>(of)];
        let (column, row) = corner(ends(u), ends(v), size)?;
        let whole = |of: __m256i| _mm256_srai_epi32::<{ COARSE_BITS as i32 }>(of);
        let x = _mm256_sub_epi32(whole(u), _mm256_set1_epi32(column));
        let y = _mm256_sub_epi32(whole(v), _mm256_set1_epi32(row));
        // As numbers without sign, negative ones are too large.
        let is_at_most =
            |of: __m256i, most: i32| _mm256_cmpeq_epi32(of, _mm256_min_epu32(of, _mm256_set1_epi32(most)));
        let is_positive = |of: __m256i| _mm256_cmpgt_epi32(of, _mm256_setzero_si256());
        let in_window = _mm256_and_si256(is_at_most(x, COLUMNS as i32 - 2), is_at_most(y, 1));
        let in_image = _mm256_and_si256(is_positive(u), is_positive(v));
        if _mm256_movemask_epi8(_mm256_and_si256(in_window, in_image)) != -1 {
            return None;
        }
        let fraction = |of: __m256i| narrowed(_mm256_and_si256(of, _mm256_set1_epi32(i32::from(COARSE) - 1)));
        let places = narrowed(_mm256_or_si256(x, _mm256_slli_epi32::<{ LOWER.trailing_zeros() as i32 }>(y)));
        Some(WideWindow {
            first: row as usize * size.0 + column as usize,
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
                right: _mm_loadu_si128(window.right.as_ptr().cast()),
                down: _mm_loadu_si128(window.down.as_ptr().cast()),
            }
        }
    }

    /// Sixteen samples from an index on.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn samples_at(samples: &[u8], first: usize) -> __m128i {
        let row = &samples[first..first + COLUMNS];
        // SAFETY: the pointer is to sixteen bytes.
        unsafe { _mm_loadu_si128(row.as_ptr().cast()) }
    }

    /// Pairs of weights `(1 - w, w)`.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn pairs(weights: __m128i) -> __m256i {
        let weights = _mm256_cvtepu16_epi32(weights);
        let others = _mm256_sub_epi32(_mm256_set1_epi32(i32::from(COARSE)), weights);
        _mm256_or_si256(others, _mm256_slli_epi32::<16>(weights))
    }

    /// Numbers divided by a power of two and rounded, halves upwards.
    #[target_feature(enable = "avx2")]
    #[inline]
    fn rounded<const BITS: i32>(numbers: __m256i) -> __m256i {
        _mm256_srli_epi32::<BITS>(_mm256_add_epi32(numbers, _mm256_set1_epi32(1 << (BITS - 1))))
    }

    const TO_MIDDLE: i32 = (COARSE_BITS - MIDDLE_BITS) as i32;
    const TO_LEVEL: i32 = (COARSE_BITS + MIDDLE_BITS) as i32;

    #[target_feature(enable = "avx2")]
    #[inline]
    fn mix(window: WideWindow, samples: &[u8], width: usize) -> [u8; PIXELS] {
        let [top, middle, bottom] = [0, 1, 2].map(|row| samples_at(samples, window.first + row * width));
        // Every place twice: for the left sample, and one more for the right one.
        let places = _mm_unpacklo_epi8(window.places, window.places);
        let columns =
            _mm_add_epi8(_mm_andnot_si128(_mm_set1_epi8(LOWER as i8), places), _mm_set1_epi16(0x0100));
        let [top, middle, bottom] = [top, middle, bottom].map(|row| _mm_shuffle_epi8(row, columns));
        let upper = _mm256_cvtepu8_epi16(_mm_blendv_epi8(top, middle, places));
        let lower = _mm256_cvtepu8_epi16(_mm_blendv_epi8(middle, bottom, places));
        let right = pairs(window.right);
        let upper = rounded::<TO_MIDDLE>(_mm256_madd_epi16(upper, right));
        let lower = rounded::<TO_MIDDLE>(_mm256_madd_epi16(lower, right));
        let both = _mm256_or_si256(upper, _mm256_slli_epi32::<16>(lower));
        let levels = narrowed(rounded::<TO_LEVEL>(_mm256_madd_epi16(both, pairs(window.down))));
        _mm_cvtsi128_si64(_mm_packus_epi16(levels, levels)).to_le_bytes()
    }

    impl Registers for Wide {
        type Window = WideWindow;

        #[inline(always)]
        fn find(u: &[f64; PIXELS], v: &[f64; PIXELS], size: (usize, usize)) -> Option<WideWindow> {
            // SAFETY: see the module.
            unsafe { find(u, v, size) }
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
