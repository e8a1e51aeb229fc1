//! What can a sample of an image be? Any of the three types that images come in, read as a number.

/// A grey sample. Levels keep their own unit: 0 ... 255, 0 ... 65535, or intensity.
pub trait Sample: Copy + PartialOrd {
    /// The level as a number, exactly.
    fn to_f64(self) -> f64;

    /// The least sample that is not below a level: `x < at_least(level)` holds for the samples with `x < level`.
    fn at_least(level: f64) -> Self;
}

impl Sample for u8 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    fn at_least(level: f64) -> u8 {
        libm::ceil(level) as u8
    }
}

impl Sample for u16 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    fn at_least(level: f64) -> u16 {
        libm::ceil(level) as u16
    }
}

impl Sample for f32 {
    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    fn at_least(level: f64) -> f32 {
        let rounded = level as f32;
        if f64::from(rounded) < level { rounded.next_up() } else { rounded }
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
}
