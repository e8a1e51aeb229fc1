//! Which number stands for a grey level while neighbours are mixed?

/// A grey level that can be interpolated. Levels of 16 bits and intensities are mixed in `f32`, whose 24 bits hold them exactly.
pub trait Sample: Copy {
    /// The level as a number.
    fn to_f32(self) -> f32;
    /// The nearest level.
    fn from_f32(level: f32) -> Self;
}

impl Sample for u8 {
    fn to_f32(self) -> f32 {
        f32::from(self)
    }
    fn from_f32(level: f32) -> u8 {
        // The cast cuts and clips.
        (level + 0.5) as u8
    }
}

impl Sample for u16 {
    fn to_f32(self) -> f32 {
        f32::from(self)
    }
    fn from_f32(level: f32) -> u16 {
        (level + 0.5) as u16
    }
}

impl Sample for f32 {
    fn to_f32(self) -> f32 {
        self
    }
    fn from_f32(level: f32) -> f32 {
        level
    }
}
