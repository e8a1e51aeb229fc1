//! Which parameters put the predicted pixels nearest to the observed ones? Levenberg-Marquardt on twelve
//! parameters.

use super::super::Termination;
use super::SinglePlaneError;
use super::model::{Frames, PARAMETERS, ParameterVector, PointJacobian, predict, predict_with_jacobian};
use crate::board::View;
use crate::geometry::lanes::{Kernel, LANES, Lanes, dispatch};
use nalgebra::SMatrix;

pub(super) struct Outcome {
    pub parameters: ParameterVector,
    /// `(J^T J)^-1` of the active parameters for residuals in px, zero for the held ones.
    pub unit_covariance: SMatrix<f64, PARAMETERS, PARAMETERS>,
    pub termination: Termination,
    pub iterations: usize,
}

/// From the homography alone it takes 5 to 10 steps; 200 leave room for damping through any valley.
const MAX_STEPS: usize = 200;
/// Smallest relative pivot of a well-posed system: the 9 x 7 grid has 1e-3, rounding gives 1e-16.
const SMALLEST_PIVOT: f64 = 1e-12;
/// Damping beyond which a step is shorter than rounding.
const LARGEST_DAMPING: f64 = 1e16;

struct Normal {
    matrix: SMatrix<f64, PARAMETERS, PARAMETERS>,
    gradient: ParameterVector,
    cost: f64,
}

/// Minimises over the first `active` parameters, by Levenberg-Marquardt with Marquardt's scaling (Marquardt
/// 1963) and Nielsen's damping rule (Nielsen 1999).
pub(super) fn refine(
    frames: &Frames,
    view: &View,
    start: ParameterVector,
    active: usize,
) -> Result<Outcome, SinglePlaneError> {
    let mut at = start;
    let mut normal = normal_equations(frames, view, &at, active);
    let (mut damping, mut growth) = (1e-4, 2.0);
    let mut iterations = 0;
    let termination = loop {
        if let Some(newton) = solve(&normal, 0.0) {
            let promised = -normal.gradient.dot(&newton);
            if promised <= rounding(view, normal.cost) {
                // Too short for the cost to judge, but the gradient, small itself, is known better: the last
                // digits.
                at += newton;
                normal = normal_equations(frames, view, &at, active);
                break Termination::Converged;
            }
        }
        if iterations == MAX_STEPS {
            break Termination::IterationLimit;
        }
        iterations += 1;
        let step = solve(&normal, damping).map(|step| (step, at + step));
        let better = step.filter(|(_, next)| cost(frames, view, next) < normal.cost);
        if let Some((step, next)) = better {
            let next_normal = normal_equations(frames, view, &next, active);
            let promised = promised_gain(&normal, &step, damping);
            let ratio = (normal.cost - next_normal.cost) / promised;
            let odd = 2.0 * ratio - 1.0;
            damping *= (1.0 - odd * odd * odd).max(1.0 / 3.0);
            growth = 2.0;
            (at, normal) = (next, next_normal);
        } else {
            damping *= growth;
            growth *= 2.0;
            if damping > LARGEST_DAMPING {
                break Termination::Stalled;
            }
        }
    };
    let pivot = smallest_pivot(&normal);
    let inverse = (pivot >= SMALLEST_PIVOT).then(|| normal.matrix.cholesky()).flatten();
    let Some(inverse) = inverse.map(|c| c.inverse()) else {
        return Err(SinglePlaneError::NotIdentifiable { points: view.len(), pivot });
    };
    let is_active = |i: usize, j: usize| i < active && j < active;
    // Residuals are in units of the gauge length; so is the standard deviation that the caller gives in px.
    let unit = frames.focal_px * frames.focal_px;
    let unit_covariance = SMatrix::from_fn(|i, j| if is_active(i, j) { inverse[(i, j)] / unit } else { 0.0 });
    Ok(Outcome { parameters: at, unit_covariance, termination, iterations })
}

/// The sum of squares `|r|^2` is not known better than `2 |r| |d| + |d|^2`, where `d` is the rounding of the
/// residuals: a few roundings of numbers of order one in each coordinate.
fn rounding(view: &View, cost: f64) -> f64 {
    let coordinate = 4.0 * f64::EPSILON;
    let all = (2.0 * view.len() as f64).sqrt() * coordinate;
    all * (2.0 * cost.sqrt() + all)
}

/// Sum of squares; infinite where a point falls behind the horizon.
fn cost(frames: &Frames, view: &View, at: &ParameterVector) -> f64 {
    let sum: f64 =
        view.pairs().map(|(p, m)| (predict(frames, at, p) - frames.pixel_offset(m)).norm_squared()).sum();
    if sum.is_nan() { f64::INFINITY } else { sum }
}

fn normal_equations(frames: &Frames, view: &View, at: &ParameterVector, active: usize) -> Normal {
    dispatch(Sum { frames, view, at, active })
}

/// Vectors of lanes in a row of the normal matrix.
const VECTORS: usize = PARAMETERS / LANES;
const _: () = assert!(PARAMETERS.is_multiple_of(LANES));

/// `sum J^T J`, `sum J^T r` and `sum |r|^2`, point by point: an entry is the same sum in the same order on
/// any registers.
struct Sum<'a> {
    frames: &'a Frames,
    view: &'a View,
    at: &'a ParameterVector,
    active: usize,
}

impl Kernel for Sum<'_> {
    type Output = Normal;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Normal {
        let Sum { frames, view, at, active } = self;
        // Blocks on and right of the diagonal.
        let mut rows = [[L::zero(); VECTORS]; PARAMETERS];
        let mut gradient = [L::zero(); VECTORS];
        let mut cost = 0.0;
        for (point, pixel) in view.pairs() {
            let Some((predicted, jacobian)) = predict_with_jacobian(frames, at, point) else {
                cost = f64::INFINITY;
                break;
            };
            let residual = predicted - frames.pixel_offset(pixel);
            let (u, v) = (vectors::<L>(&jacobian, 0), vectors::<L>(&jacobian, 1));
            for i in 0..PARAMETERS {
                let (ui, vi) = (L::splat(jacobian[(0, i)]), L::splat(jacobian[(1, i)]));
                for k in i / LANES..VECTORS {
                    rows[i][k] = rows[i][k] + (ui * u[k] + vi * v[k]);
                }
            }
            let (ru, rv) = (L::splat(residual.x), L::splat(residual.y));
            for k in 0..VECTORS {
                gradient[k] = gradient[k] + (u[k] * ru + v[k] * rv);
            }
            cost += residual.norm_squared();
        }
        let is_active = |i: usize| i < active;
        let rows = rows.map(|row| row.map(L::store));
        let gradient = gradient.map(L::store);
        let entry = |i: usize, j: usize| match (is_active(i) && is_active(j), i == j) {
            (true, _) => rows[i.min(j)][i.max(j) / LANES][i.max(j) % LANES],
            (false, on_diagonal) => f64::from(on_diagonal),
        };
        Normal {
            matrix: SMatrix::from_fn(entry),
            gradient: SMatrix::from_fn(
                |i, _| {
                    if is_active(i) { gradient[i / LANES][i % LANES] } else { 0.0 }
                },
            ),
            cost,
        }
    }
}

/// A row of the Jacobian.
#[inline(always)]
fn vectors<L: Lanes>(jacobian: &PointJacobian, row: usize) -> [L; VECTORS] {
    std::array::from_fn(|k| L::load(&std::array::from_fn(|lane| jacobian[(row, k * LANES + lane)])))
}

/// The step of `(J^T J + damping diag(J^T J)) step = -J^T r`.
fn solve(normal: &Normal, damping: f64) -> Option<ParameterVector> {
    let mut damped = normal.matrix;
    for i in 0..PARAMETERS {
        damped[(i, i)] *= 1.0 + damping;
    }
    damped.cholesky().map(|c| -c.solve(&normal.gradient))
}

/// What the linearised residuals gain by a damped step: `step^T (damping D step - J^T r)`.
fn promised_gain(normal: &Normal, step: &ParameterVector, damping: f64) -> f64 {
    (0..PARAMETERS).map(|i| step[i] * (damping * normal.matrix[(i, i)] * step[i] - normal.gradient[i])).sum()
}

/// Smallest squared pivot of the Cholesky factor relative to its diagonal entry.
fn smallest_pivot(normal: &Normal) -> f64 {
    normal.matrix.cholesky().map_or(0.0, |c| {
        let ratio = |i: usize| c.l_dirty()[(i, i)] * c.l_dirty()[(i, i)] / normal.matrix[(i, i)];
        (0..PARAMETERS).map(ratio).fold(1.0, f64::min)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec2;
    use crate::geometry::lanes::run_portable;

    #[test]
    fn the_sums_are_those_of_the_definition_to_the_bit_on_any_registers() {
        let points: Vec<Vec2> =
            (0..35).map(|i| Vec2::new(f64::from(i % 7) - 3.0, f64::from(i / 7) - 2.0) * 12.0).collect();
        let pixels = points.iter().map(|p| Vec2::new(320.0, 240.0) + p * 5.0 + p.yx() * 0.3).collect();
        let view = View::new(points, pixels).unwrap();
        let frames = Frames::of(&view, 600.0, Vec2::new(310.0, 250.0));
        let at = ParameterVector::from_column_slice(&[
            0.3, 0.01, 0.02, -0.02, 0.28, -0.01, 0.05, -0.04, -0.2, 0.1, 0.01, -0.02,
        ]);
        for active in [PARAMETERS - 2, PARAMETERS] {
            let mut matrix = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
            let mut gradient = ParameterVector::zeros();
            for (point, pixel) in view.pairs() {
                let (predicted, jacobian) = predict_with_jacobian(&frames, &at, point).unwrap();
                matrix += jacobian.transpose() * jacobian;
                gradient += jacobian.transpose() * (predicted - frames.pixel_offset(pixel));
            }
            let sum = || Sum { frames: &frames, view: &view, at: &at, active };
            for normal in [dispatch(sum()), run_portable(sum())] {
                for i in 0..PARAMETERS {
                    for j in 0..PARAMETERS {
                        let held = if i == j { 1.0 } else { 0.0 };
                        let expected = if i.max(j) < active { matrix[(i, j)] } else { held };
                        assert_eq!(normal.matrix[(i, j)].to_bits(), expected.to_bits(), "({i}, {j})");
                    }
                    let expected = if i < active { gradient[i] } else { 0.0 };
                    assert_eq!(normal.gradient[i].to_bits(), expected.to_bits());
                }
            }
        }
    }
}
