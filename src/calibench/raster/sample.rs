//! What can a sample of an image be? Any of the three types that images come in, read as a number.

/// A grey sample. Levels keep their own unit: 0 ... 255, 0 ... 65535, or intensity.
pub trait Level: Copy + PartialOrd {
    /// The level as a number, exactly.
    fn to_f64(self) -> f64;

    /// The level as a number of single precision, exactly.
    fn to_f32(self) -> f32;

    /// The least sample that is not below a level: `x < at_least(level)` holds for the samples with `x <
    /// level`.
    fn at_least(level: f64) -> Self;

    /// The sum of a run's levels, and the sum of levels times their places 0, 1, 2 ...: exact for whole
    /// levels, in `f64` and a fixed order for intensities.
    fn sums(run: &[Self]) -> (f64, f64);
}

/// Samples of a part whose sums fit 32 bits: 65535 * (0 + 1 + ... + 255) < 2^32.
const PART: usize = 256;

/// [`Level::sums`] of whole levels.
fn whole_sums<T: Copy + Into<u32>>(run: &[T]) -> (f64, f64) {
    let (mut total, mut weighted) = (0.0, 0.0);
    for (part, samples) in run.chunks(PART).enumerate() {
        let (mut sum, mut moment) = (0u32, 0u32);
        for (place, &sample) in (0u32..).zip(samples) {
            let level: u32 = sample.into();
            sum += level;
            moment += place * level;
        }
        total += f64::from(sum);
        weighted += f64::from(moment) + (part * PART) as f64 * f64::from(sum);
    }
    (total, weighted)
}

impl Level for u8 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    fn to_f32(self) -> f32 {
        f32::from(self)
    }

    fn at_least(level: f64) -> u8 {
        libm::ceil(level) as u8
    }

    fn sums(run: &[u8]) -> (f64, f64) {
        whole_sums(run)
    }
}

impl Level for u16 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    fn to_f32(self) -> f32 {
        f32::from(self)
    }

    fn at_least(level: f64) -> u16 {
        libm::ceil(level) as u16
    }

    fn sums(run: &[u16]) -> (f64, f64) {
        whole_sums(run)
    }
}

impl Level for f32 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    fn to_f32(self) -> f32 {
        self
    }

    fn at_least(level: f64) -> f32 {
        let rounded = level as f32;
        if f64::from(rounded) < level { rounded.next_up() } else { rounded }
    }

    fn sums(run: &[f32]) -> (f64, f64) {
        let (mut sum, mut weighted) = (0.0, 0.0);
        for (place, &sample) in (0u32..).zip(run) {
            sum += f64::from(sample);
            weighted += f64::from(place) * f64::from(sample);
        }
        (sum, weighted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_between_samples_is_rounded_up() {
        assert_eq!((u8::at_least(12.5), u8::at_least(12.0), u16::at_least(300.1)), (13, 12, 301));
        let level = 0.1f64;
        let least = f32::at_least(level);
        assert!(f64::from(least) >= level && f64::from(least.next_down()) < level);
    }

    #[test]
    fn sums_are_those_of_the_definition_and_do_not_overflow() {
        let long: Vec<u16> = (0..1000u32).map(|i| (65_535 - i * 7 % 11) as u16).collect();
        let exact = |run: &[u16]| {
            let of = |weight: fn(usize) -> u64| -> u64 {
                run.iter().enumerate().map(|(i, &level)| weight(i) * u64::from(level)).sum()
            };
            (of(|_| 1) as f64, of(|i| i as u64) as f64)
        };
        for run in [&long[..], &long[..256], &long[..257], &long[..1], &[]] {
            assert_eq!(u16::sums(run), exact(run));
            let intensities: Vec<f32> = run.iter().map(|&level| f32::from(level)).collect();
            assert_eq!(f32::sums(&intensities), exact(run));
        }
        let bytes: Vec<u8> = long.iter().map(|&level| (level % 256) as u8).collect();
        assert_eq!(u8::sums(&bytes), exact(&bytes.iter().map(|&level| u16::from(level)).collect::<Vec<_>>()));
    }
}
