//! Is there a corner where the lattice predicts one? The place at which the four quadrants differ most, if
//! they differ as squares.
//!
//! The lattice tells the directions and lengths of the squares' sides, so each quadrant's level is a mean of
//! four samples around the middle of its nearer half. Where a board ends, three quadrants have one level and
//! the fourth another: then the darkest of the bright ones is no brighter than the brightest of the dark
//! ones, and there is no corner.

use super::candidates::{Candidate, saddle_offset};
use super::level::Smoothed;
use super::look::Look;
use crate::geometry::Vec2;
use nalgebra::Matrix2;

/// Offsets that are tried along each step, in steps.
const OFFSETS: [f64; 5] = [-0.2, -0.1, 0.0, 0.1, 0.2];

/// Least difference between the darkest bright quadrant and the brightest dark one, as part of the mean
/// difference.
const LEAST_SEPARATION: f64 = 0.5;

/// Least difference in standard deviations of a quadrant's mean.
const LEAST_IN_NOISE: f64 = 6.0;

/// Least contrast as a fraction of the level's range: half of what a candidate needs.
const LEAST_IN_RANGE: f64 = 0.01;

/// Where the four quadrants are sampled: between +i and +j, then turning on.
struct Quadrants {
    /// From the corner, px.
    offsets: [[Vec2; 4]; 4],
    /// How far from the image's end the corner must be, px.
    margin: f64,
}

impl Quadrants {
    fn new(look: &Look, steps: &Matrix2<f64>) -> Quadrants {
        let farthest = look.samples[3].0.max(look.samples[3].1);
        let reach = farthest * (steps.column(0).abs() + steps.column(1).abs());
        let offsets = [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]
            .map(|(a, b)| look.samples.map(|(i, j)| steps * Vec2::new(a * i, b * j)));
        Quadrants { offsets, margin: reach.amax() + 1.0 }
    }

    /// Their levels, each the mean of four samples.
    fn levels(&self, level: &Smoothed, at: &Vec2) -> Option<[f64; 4]> {
        if !level.holds(at, self.margin) {
            return None;
        }
        let of = |[a, b, c, d]: &[Vec2; 4]| {
            let sample = |offset: &Vec2| level.nearest(&(at + offset));
            0.25 * (sample(a) + sample(b) + sample(c) + sample(d))
        };
        let [a, b, c, d] = &self.offsets;
        Some([of(a), of(b), of(c), of(d)])
    }
}

/// The corner near a place, if one is there. `dark_between`: the quadrant between both steps is dark.
pub fn probe(
    level: &Smoothed,
    look: &Look,
    at: &Vec2,
    steps: &Matrix2<f64>,
    dark_between: bool,
) -> Option<Candidate> {
    let sign = if dark_between { 1.0 } else { -1.0 };
    let quadrants = Quadrants::new(look, steps);
    let mut best: Option<(f64, Vec2, [f64; 4])> = None;
    for j in OFFSETS {
        for i in OFFSETS {
            let place = at + steps * Vec2::new(i, j);
            let Some(q) = quadrants.levels(level, &place) else { continue };
            let contrast = sign * 0.5 * ((q[1] + q[3]) - (q[0] + q[2]));
            if best.is_none_or(|(most, ..)| contrast > most) {
                best = Some((contrast, place, q));
            }
        }
    }
    let (contrast, place, q) = best?;
    let [dark, bright] =
        if dark_between { [[q[0], q[2]], [q[1], q[3]]] } else { [[q[1], q[3]], [q[0], q[2]]] };
    let separation = bright[0].min(bright[1]) - dark[0].max(dark[1]);
    let least = (LEAST_IN_NOISE * level.noise() / 2.0).max(LEAST_IN_RANGE * level.range());
    if separation < LEAST_SEPARATION * contrast || separation < least {
        return None;
    }
    let at = nearest_saddle(level, &place, steps);
    let axes = [steps.column(0).normalize(), steps.column(1).normalize()];
    // Turning from the first axis to the second it is dark.
    let axes = if dark_between { axes } else { [axes[1], -axes[0]] };
    Some(Candidate { at, axes, contrast })
}

/// The saddle point near a place, or the place where none is near.
fn nearest_saddle(level: &Smoothed, place: &Vec2, steps: &Matrix2<f64>) -> Vec2 {
    let pixel = Vec2::new(libm::round(place.x), libm::round(place.y));
    let offset = level
        .holds(&pixel, 2.0)
        .then(|| saddle_offset(level, (pixel.x as usize, pixel.y as usize)))
        .flatten();
    let Some(offset) = offset else { return *place };
    let moved = steps.try_inverse().map(|inverse| (inverse * (pixel + offset - place)).amax());
    if moved.is_some_and(|steps| steps < 0.15) { pixel + offset } else { *place }
}
