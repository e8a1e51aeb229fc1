//! How large is the noise of a pixel coordinate? Given, or what the residuals show beside measured marks.

use super::MeasuredError;
use super::descent::{Minimum, descend};
use super::equations::Inverse;
use super::problem::{Problem, State};
use super::{Noise, tests_of_sums::Moments};
use crate::calibrate::Termination;
use crate::geometry::Vec2;

/// Nobody's marks are better than this, px: exact data would otherwise leave what is known beforehand no
/// weight at all.
const LEAST_PX: f64 = 1e-4;
/// The variance is settled when it changes by less than this part, `sigma` by half of it.
const SETTLED: f64 = 2e-6;
/// Refinements until it is.
const MOST_REFITS: usize = 60;

/// What the pixels leave over.
pub(super) struct Left {
    /// Predicted - observed, px.
    pub residuals: Vec<Vec<Vec2>>,
    /// `sum w^2 |r|^2`, px^2.
    pub square: f64,
    /// Degrees of freedom of that sum, and the sum of the squares of its weights: see [`Moments`].
    pub moments: Moments,
}

impl Left {
    /// Of a minimum, with the inverse of its equations.
    pub fn of(problem: &Problem<'_>, minimum: &Minimum, inverse: &Inverse) -> Option<Left> {
        let views = 0..problem.data.views.len();
        let residuals: Vec<Vec<Vec2>> =
            views.map(|view| problem.residuals(&minimum.state, view)).collect::<Option<_>>()?;
        let weighted = residuals.iter().flatten().zip(problem.data.views.iter().flatten());
        let square = weighted.map(|(r, seen)| (seen.weight * r).norm_squared()).sum();
        let coordinates = 2.0 * problem.data.observations() as f64 - minimum.equations.unknowns() as f64;
        let known = Known::of(problem, &minimum.state, inverse);
        // Of K = I - J Q J^T: tr K = 2 N - p + tr(Q P), tr K^2 = 2 N - p + tr(Q P Q P).
        let moments =
            Moments { sum: coordinates + known.trace, squares: coordinates + known.trace_of_square };
        Some(Left { residuals, square, moments })
    }

    /// Variance of a coordinate of weight 1, px^2.
    pub fn variance(&self) -> f64 {
        self.square / self.moments.sum
    }
}

/// `tr(Q P)` and `tr(Q P Q P)` over what is known beforehand.
pub(super) struct Known {
    pub trace: f64,
    pub trace_of_square: f64,
}

impl Known {
    pub fn of(problem: &Problem<'_>, state: &State, inverse: &Inverse) -> Known {
        Known::among(problem, state, inverse, |_| true)
    }

    /// Over those rows that are wanted.
    pub fn among(
        problem: &Problem<'_>,
        state: &State,
        inverse: &Inverse,
        wanted: impl Fn(usize) -> bool,
    ) -> Known {
        let rows: Vec<(usize, f64)> = problem
            .known(state)
            .filter(|(row, ..)| wanted(*row))
            .map(|(row, _, sd)| (row, problem.variance / (sd * sd)))
            .collect();
        let q = &inverse.shared;
        // A measurement settles one number at most, whatever the inverse of singular equations says.
        let trace: f64 = rows.iter().map(|&(i, weight)| (q[(i, i)] * weight).min(1.0)).sum();
        let row = |&(i, a): &(usize, f64)| -> f64 {
            rows.iter().map(|&(j, b)| q[(i, j)] * q[(i, j)] * a * b).sum()
        };
        Known { trace, trace_of_square: rows.iter().map(row).sum::<f64>().min(trace) }
    }
}

/// The minimum at which the noise that weighs what is known beforehand is the one that is given or that the
/// residuals show.
pub(super) fn settled<'a>(
    problem: Problem<'a>,
    noise: Noise,
    start: State,
) -> Result<(Problem<'a>, Minimum), MeasuredError> {
    let mut problem = problem;
    if let Noise::Known { sigma_px } = noise {
        problem.variance = sigma_px * sigma_px;
    }
    let mut minimum = descend(&problem, start).ok_or(MeasuredError::NoStart)?;
    let mut iterations = minimum.iterations;
    if noise == Noise::Estimated {
        for _ in 0..MOST_REFITS {
            let variance = estimated(&problem, &minimum)?;
            let is_settled = (variance - problem.variance).abs() <= SETTLED * variance;
            problem.variance = variance;
            let nothing_known = problem.known(&minimum.state).next().is_none();
            if is_settled || nothing_known || minimum.termination != Termination::Converged {
                break;
            }
            minimum = descend(&problem, minimum.state).ok_or(MeasuredError::NoStart)?;
            iterations += minimum.iterations;
        }
    }
    minimum.iterations = iterations;
    Ok((problem, minimum))
}

/// The variance that a minimum's residuals show, px^2.
fn estimated(problem: &Problem<'_>, minimum: &Minimum) -> Result<f64, MeasuredError> {
    let Some(inverse) = minimum.equations.inverse() else {
        // Singular equations are refused by name later; the noise then is of no account.
        return Ok(problem.variance);
    };
    let left = Left::of(problem, minimum, &inverse).ok_or(MeasuredError::NoStart)?;
    if left.moments.sum < LEAST_FREEDOM {
        let coordinates = 2 * problem.data.observations();
        return Err(MeasuredError::NoFreedom { coordinates, freedom: left.moments.sum });
    }
    Ok(left.variance().max(LEAST_PX * LEAST_PX))
}

/// With less than one degree of freedom a noise is whatever it happens to be.
const LEAST_FREEDOM: f64 = 1.0;
