//! How far does a step bend? The second-order correction of a step: geodesic acceleration.
//!
//! Numerator and denominator of a rational lens nearly cancel, and a sensor's tilt, its axis and decentring
//! nearly do. The minimum then lies at the end of a long curved valley, along which straight steps creep by
//! hundreds. With the second derivative of the residuals along the step, `r''`, the path is followed to
//! second order: `x + d + a / 2` with `(H + damping D) a = -J^T r''` (Transtrum & Sethna 2012).

use super::super::Loss;
use super::super::minimise::Descent;
use super::super::system::Step;
use super::WIDTH;
use super::marks::{Mark, Marks};
use super::problem::{Known, Problem, State};
use crate::geometry::Vec2;

/// Part of the step at which the second derivative is taken, by central differences.
const PART: f64 = 0.1;

impl Problem<'_> {
    /// The acceleration `a` of a step; `None` where the lens loses a mark near the step.
    pub fn acceleration(&self, from: &State, damping: f64, step: &Step<WIDTH>) -> Option<Step<WIDTH>> {
        let mut ends = [from.clone(), from.clone()];
        for (end, part) in ends.iter_mut().zip([PART, -PART]) {
            self.step(from, &step.times(part), end);
        }
        let bent: Vec<Marks> = (0..self.views.len())
            .map(|view| {
                self.views[view].with_pixels(|mark| {
                    let [ahead, here, behind] =
                        [&ends[0], from, &ends[1]].map(|state| state.pixel(view, mark));
                    let (here, around) = (here?, ahead? + behind?);
                    // The residual against this pixel is r''.
                    Some(here - (around - 2.0 * here) / (PART * PART))
                })
            })
            .collect::<Option<_>>()?;
        let problem = Problem { views: &bent, loss: Loss::Squares, ..*self };
        let mut system = problem.system();
        problem.linearise_into(from, &mut system);
        if !system.cost.is_finite() {
            return None;
        }
        // What is known beforehand is linear in the unknowns: it has a weight and no second derivative.
        for Known { row, off, weight } in self.known(from) {
            if let Some(row) = row {
                system.gradient[row] -= weight.cost * off;
            }
        }
        let mut acceleration = Step::default();
        system.solve_into(damping, &mut acceleration)?;
        Some(acceleration)
    }
}

impl Marks {
    /// The same marks elsewhere in the image; `None` where one has no place.
    fn with_pixels(&self, pixel: impl Fn(&Mark) -> Option<Vec2>) -> Option<Marks> {
        let moved = |mark: &Mark| Some(Mark { pixel: pixel(mark)?, ..*mark });
        Some(Marks::of_list(self.list.iter().map(moved).collect::<Option<_>>()?))
    }
}
