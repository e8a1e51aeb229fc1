//! Which number stands for a grey level while neighbours are mixed?

/// A grey level that can be interpolated. Levels of 16 bits and intensities are mixed in `f32`, whose 24 bits
/// hold them exactly.
pub trait Interpolated: Copy {
    /// The level as a number.
    fn to_f32(self) -> f32;
    /// The nearest level.
    fn from_f32(level: f32) -> Self;

    /// The samples as 8-bit levels, if they are: these have an arithmetic of their own.
    fn as_bytes(samples: &[Self]) -> Option<&[u8]> {
        let _ = samples;
        None
    }

    /// [`Interpolated::as_bytes`], to write.
    fn as_bytes_mut(samples: &mut [Self]) -> Option<&mut [u8]> {
        let _ = samples;
        None
    }

    /// The bilinear mixture of four samples, the upper left at index `at` of rows `width` long. Exact where a
    /// weight is 0 or 1, unlike `left + w (right - left)`. Panics outside the samples.
    fn mix(samples: &[Self], width: usize, at: usize, right: f32, down: f32) -> Self {
        let between = |index: usize| {
            let (left, other) = (samples[index].to_f32(), samples[index + 1].to_f32());
            left * (1.0 - right) + other * right
        };
        let (upper, lower) = (between(at), between(at + width));
        Self::from_f32(upper * (1.0 - down) + lower * down)
    }
}

impl Interpolated for u8 {
    fn to_f32(self) -> f32 {
        f32::from(self)
    }
    fn from_f32(level: f32) -> u8 {
        // The cast cuts and clips.
        (level + 0.5) as u8
    }
    fn as_bytes(samples: &[u8]) -> Option<&[u8]> {
        Some(samples)
    }
    fn as_bytes_mut(samples: &mut [u8]) -> Option<&mut [u8]> {
        Some(samples)
    }
}

impl Interpolated for u16 {
    fn to_f32(self) -> f32 {
        f32::from(self)
    }
    fn from_f32(level: f32) -> u16 {
        (level + 0.5) as u16
    }
}

impl Interpolated for f32 {
    fn to_f32(self) -> f32 {
        self
    }
    fn from_f32(level: f32) -> f32 {
        level
    }
}
