//! Between which samples does a position lie, and how far? Whole samples and fixed-point fractions, the same
//! for a table and without one.
//!
//! Fractions are cut to 24 bits, which `f32` holds exactly. 8-bit levels are mixed with these rounded to 14
//! bits: that moves a level by at most 255 / 2^15 in each direction.

use crate::geometry::Vec2;

/// A source this close to a sample's centre is on it: maps that agree but for rounding (1e-12 px) take
/// samples unchanged, and a source on the image's edge is inside. It moves nothing visibly: fractions are
/// coarser.
pub const ON_A_SAMPLE_PX: f64 = 1e-9;

/// One, in fine fractions.
const FINE: f64 = 16_777_216.0;

/// Bits of a coarse fraction.
pub const COARSE_BITS: u32 = 14;

/// One, in coarse fractions.
pub const COARSE: u16 = 1 << COARSE_BITS;

/// The upper left of four samples, and how far towards the right and lower ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    pub column: u32,
    pub row: u32,
    pub right: f32,
    pub down: f32,
}

impl Place {
    /// The place of a position in an image of this size; `None` outside of its samples' centres, or for NaN.
    pub fn of(position: &Vec2, (width, height): (usize, usize)) -> Option<Place> {
        let (column, right) = split(position.x, width)?;
        let (row, down) = split(position.y, height)?;
        Some(Place { column, row, right, down })
    }
}

/// The lower of two neighbouring samples about a position, and the weight of the upper one; the last pair
/// serves the last sample too.
fn split(position: f64, count: usize) -> Option<(u32, f32)> {
    // Exact but for the rounding of `rounding`, which both kinds of fraction share.
    let nudged = (rounding(position * f64::from(COARSE)) - 0.5) / f64::from(COARSE);
    let last = (count - 1) as f64;
    if !(nudged >= 0.0 && position - last <= ON_A_SAMPLE_PX) {
        return None;
    }
    let lower = (nudged as u32).min(count as u32 - 2);
    let fine = ((nudged - f64::from(lower)) * FINE) as u32;
    Some((lower, (fine as f32 / FINE as f32).min(1.0)))
}

/// A fine fraction, rounded to a coarse one.
pub fn coarse(fraction: f32) -> u16 {
    (fraction * f32::from(COARSE) + 0.5) as u16
}

/// What is added to a position in coarse fractions before it is cut to a whole number of them.
pub const ROUNDING: f64 = ON_A_SAMPLE_PX * COARSE as f64 + 0.5;

#[inline(always)]
fn rounding(fractions: f64) -> f64 {
    fractions + ROUNDING
}

/// A position in coarse fractions of a pixel as a whole number of them, as [`Place::of`] and [`coarse`] find
/// it; negative for a negative one, NaN, or one beyond 2^17 px.
#[inline(always)]
pub fn whole_position(fractions: f64) -> i32 {
    let rounded = rounding(fractions);
    // What the processor's conversion gives where the number does not fit.
    if rounded.abs() < 2_147_483_648.0 { rounded as i32 } else { i32::MIN }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn both_ways_to_a_coarse_fraction_agree(position in 0.0f64..4000.0, near in 0usize..5) {
            // Arbitrary, and about the middle between two coarse fractions.
            let tick = 1.0 / f64::from(COARSE);
            let position = if near > 0 {
                ((position / tick) as u32 as f64 + 0.5) * tick + [0.0, 1e-12, -1e-9, 5e-9][near - 1]
            } else { position };
            let (lower, fraction) = split(position, 5000).unwrap();
            prop_assert_eq!(whole_position(position * f64::from(COARSE)), lower as i32 * i32::from(COARSE) + i32::from(coarse(fraction)));
            prop_assert!((f64::from(lower) + f64::from(fraction) - position).abs() <= 1.0 / FINE);
        }
    }

    #[test]
    fn a_position_on_a_sample_but_for_rounding_is_on_it() {
        for off in [0.0, 1e-12, -1e-12, 0.99e-9, -0.99e-9] {
            assert_eq!(split(7.0 + off, 10), Some((7, 0.0)));
            assert_eq!(split(0.0 + off, 10), Some((0, 0.0)));
            assert_eq!(split(9.0 + off, 10), Some((8, 1.0)));
            assert_eq!(whole_position((7.0 + off) * f64::from(COARSE)), 7 << COARSE_BITS);
        }
        assert_eq!((split(-1.01e-9, 10), split(9.0 + 1.01e-9, 10), split(f64::NAN, 10)), (None, None, None));
        assert!(
            [-0.6, f64::NAN, 3e5, -3e5, f64::INFINITY]
                .into_iter()
                .all(|x| whole_position(x * f64::from(COARSE)) < 0)
        );
    }
}
