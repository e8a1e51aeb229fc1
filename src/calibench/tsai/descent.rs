//! Where is a sum of squares least? Levenberg-Marquardt on dense normal equations of a few unknowns.

use crate::geometry::Vec2;
use nalgebra::{DMatrix, DVector};

/// `J^T J`, `J^T r` and `r^T r`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Normal {
    pub square: DMatrix<f64>,
    pub product: DVector<f64>,
    pub cost: f64,
}

impl Normal {
    pub fn zeros(unknowns: usize) -> Normal {
        Normal { square: DMatrix::zeros(unknowns, unknowns), product: DVector::zeros(unknowns), cost: 0.0 }
    }

    /// Adds a point: residual and its 2 x n derivatives.
    pub fn add(&mut self, residual: &Vec2, jacobian: &DMatrix<f64>) {
        self.square += jacobian.transpose() * jacobian;
        self.product += jacobian.transpose() * residual;
        self.cost += residual.norm_squared();
    }

    /// The step that lowers the cost, the diagonal raised by the part `damping`.
    fn step(&self, damping: f64) -> Option<DVector<f64>> {
        let mut square = self.square.clone();
        (0..square.nrows()).for_each(|i| square[(i, i)] *= 1.0 + damping);
        // Unknowns differ in size by orders of magnitude: pixels, coefficients, 1 / px^2.
        let size = self.square.diagonal().map(|d| if d > 0.0 { 1.0 / d.sqrt() } else { 1.0 });
        let scaled =
            DMatrix::from_fn(square.nrows(), square.ncols(), |i, j| size[i] * square[(i, j)] * size[j]);
        let solved = scaled.cholesky()?.solve(&self.product.component_mul(&size));
        Some(-solved.component_mul(&size))
    }
}

const FIRST_DAMPING: f64 = 1e-4;
const LEAST_DAMPING: f64 = 1e-12;
/// Damping beyond which no step is left to try.
const MOST_DAMPING: f64 = 1e12;
/// Good data take five to ten.
const MOST_STEPS: usize = 200;
/// A step that promises to lower the cost by less than this part of it has arrived: a millionth of a standard
/// deviation.
const SETTLED: f64 = 1e-14;

/// The minimum that the start leads to; `None` where the start has no cost, or the steps do not end.
pub(super) fn descend<S>(
    start: S,
    normal: impl Fn(&S) -> Option<Normal>,
    stepped: impl Fn(&S, &DVector<f64>) -> S,
) -> Option<S> {
    let (mut state, mut damping) = (start, FIRST_DAMPING);
    let mut here = normal(&state)?;
    for _ in 0..MOST_STEPS {
        let step = here.step(damping);
        let next = step.as_ref().map(|step| stepped(&state, step));
        if step.is_some_and(|step| -step.dot(&here.product) <= SETTLED * here.cost) {
            return Some(state);
        }
        let lower =
            next.and_then(|next| Some((normal(&next)?, next))).filter(|(ahead, _)| ahead.cost < here.cost);
        match lower {
            Some((ahead, next)) => {
                (here, state) = (ahead, next);
                damping = (0.1 * damping).max(LEAST_DAMPING);
            }
            // Where rounding is all that is left, no step lowers the cost.
            None if damping > MOST_DAMPING => return Some(state),
            None => damping *= 10.0,
        }
    }
    None
}
