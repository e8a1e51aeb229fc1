//! What does a blurred pixel see of a region? The region's area weighted by a Gaussian convolved with the
//! pixel's square.
//!
//! The weight is separable, `k(x - i) k(y - j)` with `k = Gauss(sigma) * box(1)`. By Green's theorem its
//! integral over a region is the contour integral `oint P(x - i) k(y - j) dy` with `P` the antiderivative of
//! `k`:
//!
//! ```text
//! k(x) = Phi((x + 1/2) / sigma) - Phi((x - 1/2) / sigma)
//! P(x) = A(x + 1/2) - A(x - 1/2),     A(x) = x Phi(x / sigma) + sigma phi(x / sigma)
//! ```
//! so the continuous image is convolved exactly across the outline and by Gauss-Legendre quadrature along it.

use super::coverage::Coverage;
use super::outline::{Arc, Steps};
use crate::geometry::Vec2;

/// Where the Gaussian is cut, in standard deviations: the tail beyond holds 2e-9.
const REACH: f64 = 6.0;

/// Nodes and weights of three-point Gauss-Legendre quadrature on 0 ... 1.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// A Gaussian point spread function seen through a square pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Kernel {
    sigma_px: f64,
    reach_px: f64,
}

impl Kernel {
    /// The kernel of a blur of `sigma_px > 0`.
    pub fn new(sigma_px: f64) -> Kernel {
        Kernel { sigma_px, reach_px: REACH * sigma_px + 0.5 }
    }

    /// How far from an outline pixels are blurred, px.
    pub fn reach_px(&self) -> f64 {
        self.reach_px
    }

    /// Arcs short enough for the quadrature: over a chord of sigma/2 three Gauss points integrate the
    /// Gaussian to 1e-8, and slivers of 1e-5 px^2 leave the arc within 1e-8 px of its parabola.
    pub fn steps(&self) -> Steps {
        Steps { sliver: 1e-5, chord_px: 0.5 * self.sigma_px }
    }

    /// Adds an arc of an outline.
    pub fn add(&self, coverage: &mut Coverage, arc: &Arc) {
        let linear = arc.middle * 4.0 - arc.from * 3.0 - arc.to;
        let quadratic = (arc.from + arc.to - arc.middle * 2.0) * 2.0;
        for (t, weight) in GAUSS {
            let at = arc.from + (linear + quadratic * t) * t;
            let dy = (linear.y + 2.0 * quadratic.y * t) * weight;
            self.add_node(coverage, at, dy);
        }
    }

    /// Adds a step `dy` at a point: pixel `(i, j)` gains `(1 - P(x - i)) k(y - j) dy`, which is zero far left
    /// of the point and constant far right of it, so only the differences between columns are stored.
    fn add_node(&self, coverage: &mut Coverage, at: Vec2, dy: f64) {
        let first_row = libm::ceil(at.y - self.reach_px).max(0.0);
        let last_row = libm::floor(at.y + self.reach_px).min(coverage.height() as f64 - 1.0);
        if first_row > last_row || at.x - self.reach_px > coverage.width() as f64 {
            return;
        }
        let first_column = libm::ceil(at.x - self.reach_px) as i64;
        let last_column = libm::floor(at.x + self.reach_px) as i64 + 1;
        // Stack room for the usual blurs; wide ones fall back to the heap inside the vector.
        let mut row_weights = [0.0; ROOM];
        let rows = first_row as usize..last_row as usize + 1;
        let mut right_edge = self.cumulative(first_row - 0.5 - at.y);
        let mut wide_rows = Vec::new();
        let row_weights = room(&mut row_weights, &mut wide_rows, rows.len());
        for (weight, row) in row_weights.iter_mut().zip(rows.clone()) {
            let left_edge = right_edge;
            right_edge = self.cumulative(row as f64 + 0.5 - at.y);
            *weight = (right_edge - left_edge) * dy;
        }
        let mut previous = 0.0;
        let mut antiderivative = self.antiderivative(first_column as f64 - 0.5 - at.x);
        for column in first_column..=last_column {
            // 1 - P(x - i) = P(i - x), by the symmetry of k.
            let next_antiderivative = self.antiderivative(column as f64 + 0.5 - at.x);
            let covered = if column == last_column { 1.0 } else { next_antiderivative - antiderivative };
            antiderivative = next_antiderivative;
            for (weight, row) in row_weights.iter().zip(rows.clone()) {
                coverage.step(column, row, (covered - previous) * weight);
            }
            previous = covered;
        }
    }

    /// `Phi(x / sigma)`.
    fn cumulative(&self, x: f64) -> f64 {
        0.5 * libm::erfc(-x / (self.sigma_px * std::f64::consts::SQRT_2))
    }

    /// `A(x) = x Phi(x / sigma) + sigma phi(x / sigma)`.
    fn antiderivative(&self, x: f64) -> f64 {
        const INV_SQRT_TAU: f64 = 0.398_942_280_401_432_7;
        let z = x / self.sigma_px;
        x * self.cumulative(x) + self.sigma_px * INV_SQRT_TAU * libm::exp(-0.5 * z * z)
    }
}

/// Rows that a blur of up to 2 px reaches.
const ROOM: usize = 26;

/// The first `length` entries of the stack array, or of the heap where it is too small.
fn room<'a>(stack: &'a mut [f64; ROOM], heap: &'a mut Vec<f64>, length: usize) -> &'a mut [f64] {
    if length <= ROOM {
        &mut stack[..length]
    } else {
        heap.resize(length, 0.0);
        heap
    }
}

#[cfg(test)]
mod tests {
    use super::super::outline::{Outline, trace};
    use super::super::window::Window;
    use super::*;
    use std::convert::Infallible;

    fn covered_by(outline: &Outline, kernel: &Kernel, steps: &Steps) -> Coverage {
        let mut coverage = Coverage::new(24, 24);
        for piece in &outline.pieces {
            let curve = |t: f64| Ok::<_, Infallible>(piece.at(t));
            trace(&curve, piece.start_parts(), steps, &Window::ALL, &mut |arc| {
                kernel.add(&mut coverage, arc)
            })
            .unwrap();
        }
        coverage.finish();
        coverage
    }

    #[test]
    fn a_blurred_rectangle_is_the_product_of_two_blurred_edges() {
        for sigma_px in [0.3, 0.7, 2.5] {
            let kernel = Kernel::new(sigma_px);
            let (low, high) = (Vec2::new(6.3, 7.1), Vec2::new(15.2, 13.9));
            let coverage = covered_by(&Outline::rectangle(low, high), &kernel, &kernel.steps());
            // Mean over the pixel of the blurred step, from the closed form of its antiderivative.
            let covered = |i: usize, low: f64, high: f64| {
                let mean = |edge: f64| {
                    kernel.antiderivative(i as f64 + 0.5 - edge)
                        - kernel.antiderivative(i as f64 - 0.5 - edge)
                };
                mean(low) - mean(high)
            };
            for row in 0..24 {
                for column in 0..24 {
                    let exact = covered(column, low.x, high.x) * covered(row, low.y, high.y);
                    let error = (coverage.at(column, row) - exact).abs();
                    assert!(error < 5e-8, "sigma {sigma_px}: {error:e}");
                }
            }
        }
    }

    #[test]
    fn the_quadrature_of_a_blurred_disc_has_converged() {
        let disc = Outline::disc(Vec2::new(11.3, 12.2), 6.0);
        for sigma_px in [0.3, 0.7, 2.5] {
            let kernel = Kernel::new(sigma_px);
            let usual = covered_by(&disc, &kernel, &kernel.steps());
            let fine = covered_by(&disc, &kernel, &Steps { sliver: 1e-8, chord_px: 0.05 * sigma_px });
            let cells = (0..24).flat_map(|row| (0..24).map(move |column| (column, row)));
            let largest = cells.map(|(c, r)| (usual.at(c, r) - fine.at(c, r)).abs()).fold(0.0, f64::max);
            assert!(largest < 5e-8, "sigma {sigma_px}: {largest:e}");
        }
    }
}
