//! Did anything but noise change? Four questions, each an F test against the scatter within the frames.
//!
//! Of white noise the squares in any `k` directions are `sigma^2` times chi-squared of `k` degrees of
//! freedom, so that their ratio to the squares in other directions is Fisher's. Directions are the eight
//! fields of a motion in space, and in time one sequence that is asked for, such as the frames' numbers:
//! `|sum_t x_t e_t|^2 / sum x_t^2` is what follows `x`. Noise that neighbouring marks have in common looks
//! like motion, and is told as such.

use super::frames::Deviations;
use super::motion::Motion;
use crate::distribution::fisher_tail;
use crate::geometry::Vec2;

/// A ratio of mean squares that is 1 on average where there is nothing but noise.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Test {
    /// The ratio.
    pub ratio: f64,
    /// Degrees of freedom above and below.
    pub degrees_of_freedom: [usize; 2],
    /// Chance of so large a ratio, or a larger one, by noise alone.
    pub p_value: f64,
}

/// Whether the frames are of a still board in steady light.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Stillness {
    /// Do the marks move together from frame to frame?
    pub motion: Test,
    /// Do they move together, steadily with time? `None` of two frames.
    pub drift: Option<Test>,
    /// Do they move against each other, steadily with time?
    pub bending: Option<Test>,
    /// Do they move against each other with the light? `None` where it is not known or never changes.
    pub light: Option<Test>,
    /// Mean shift of the marks from the first frame to the last by the straight line in time that fits best,
    /// px.
    pub drift_px: Vec2,
    /// Rate of false alarms of each test.
    pub false_alarm: f64,
}

impl Stillness {
    /// Whether no test finds anything.
    pub fn holds(&self) -> bool {
        let later = [self.drift, self.bending, self.light];
        std::iter::once(self.motion).chain(later.into_iter().flatten()).all(|test| self.passes(&test))
    }

    /// Whether a test finds nothing.
    pub fn passes(&self, test: &Test) -> bool {
        test.p_value >= self.false_alarm
    }

    pub(super) fn of(
        moved: &Deviations,
        rest: &Deviations,
        motion: &Motion,
        light: Option<&[f64]>,
        false_alarm: f64,
    ) -> Stillness {
        let (frames, fields) = (moved.freedom(), motion.dimensions());
        let left = 2 * rest.marks() - fields;
        let noise = rest.square() / (frames * left) as f64;
        let middle = 0.5 * frames as f64;
        let time: Vec<f64> = (0..=frames).map(|t| t as f64 - middle).collect();
        let slope = follows(moved, &time);
        let shift: Vec2 = slope.iter().sum::<Vec2>() / slope.len() as f64;
        let several = frames > 1;
        Stillness {
            motion: Test::of(moved.square(), fields * frames, noise, left * frames),
            drift: several.then(|| Test::of(explained(moved, &time), fields, noise, left * frames)),
            bending: several.then(|| against_the_rest(rest, &time, left)),
            light: light.filter(|_| several).map(|light| against_the_rest(rest, light, left)),
            drift_px: shift * frames as f64,
            false_alarm,
        }
    }
}

impl Test {
    /// Squares in some directions against the noise of others.
    fn of(square: f64, directions: usize, noise: f64, freedom: usize) -> Test {
        let ratio = square / (directions as f64 * noise);
        Test {
            ratio,
            degrees_of_freedom: [directions, freedom],
            p_value: fisher_tail(ratio, directions, freedom),
        }
    }
}

/// What of deviations follows a sequence, against what does not.
fn against_the_rest(rest: &Deviations, sequence: &[f64], left: usize) -> Test {
    let explained = explained(rest, sequence);
    let others = left * (rest.freedom() - 1);
    Test::of(explained, left, (rest.square() - explained) / others as f64, others)
}

/// `sum_t x_t e_t / sum_t x_t^2`, mark by mark.
fn follows(deviations: &Deviations, x: &[f64]) -> Vec<Vec2> {
    let size: f64 = x.iter().map(|x| x * x).sum();
    let of =
        |mark: usize| deviations.frames.iter().zip(x).map(|(frame, x)| frame[mark] * *x).sum::<Vec2>() / size;
    (0..deviations.marks()).map(of).collect()
}

/// Sum of the squares that follow a sequence.
fn explained(deviations: &Deviations, x: &[f64]) -> f64 {
    let size: f64 = x.iter().map(|x| x * x).sum();
    follows(deviations, x).iter().map(Vec2::norm_squared).sum::<f64>() * size
}
