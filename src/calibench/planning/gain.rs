//! What is known of a camera once a view has been added?

use super::information::Estimated;
use nalgebra::{DMatrix, DVector};

/// What is known of a camera: the covariance of what was estimated of it, and its inverse.
#[derive(Debug, Clone, PartialEq)]
pub struct Knowledge {
    /// What was estimated.
    pub estimated: Estimated,
    covariance: DMatrix<f64>,
    /// Standard deviations: each parameter is counted in its own, since pixels and coefficients of a lens are
    /// of sizes that lie many powers of ten apart.
    unit: DVector<f64>,
    /// Inverse of the correlations.
    information: DMatrix<f64>,
}

/// Why nothing can be added to what is known.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GainError {
    /// The camera's parameters are all held.
    #[error("nothing of the camera was estimated: no view can tell more of it")]
    NothingFree,
    /// The covariance has another size than the estimated parameters.
    #[error("the covariance of {estimated} parameters has {rows} rows and {columns} columns")]
    Shape {
        /// Estimated parameters.
        estimated: usize,
        /// Rows.
        rows: usize,
        /// Columns.
        columns: usize,
    },
    /// The covariance is none.
    #[error(
        "the covariance of the camera is not positive definite: was a parameter not determined, or are there residuals of 0 only?"
    )]
    NotPositive,
}

impl Knowledge {
    /// Of a covariance of the estimated parameters, n x n.
    ///
    /// # Errors
    /// [`GainError`].
    pub fn of(estimated: Estimated, covariance: &DMatrix<f64>) -> Result<Knowledge, GainError> {
        let n = estimated.len();
        let (rows, columns) = covariance.shape();
        if n == 0 {
            return Err(GainError::NothingFree);
        }
        if (rows, columns) != (n, n) {
            return Err(GainError::Shape { estimated: n, rows, columns });
        }
        let unit = covariance.diagonal().map(f64::sqrt);
        if !unit.iter().all(|sd| sd.is_finite() && *sd > 0.0) {
            return Err(GainError::NotPositive);
        }
        let correlations = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] / (unit[i] * unit[j]));
        let information = correlations.cholesky().ok_or(GainError::NotPositive)?.inverse();
        Ok(Knowledge { estimated, covariance: covariance.clone(), unit, information })
    }

    /// The covariance so far.
    pub fn covariance(&self) -> &DMatrix<f64> {
        &self.covariance
    }

    /// The covariance `(P^-1 + S)^-1` with the information `S` of one more view; `None` if rounding leaves
    /// none.
    pub fn after(&self, information: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let n = self.unit.len();
        let pair = |i: usize, j: usize| self.unit[i] * self.unit[j];
        let sum = DMatrix::from_fn(n, n, |i, j| self.information[(i, j)] + pair(i, j) * information[(i, j)]);
        let inverse = sum.cholesky()?.inverse();
        Some(DMatrix::from_fn(n, n, |i, j| pair(i, j) * inverse[(i, j)]))
    }
}

/// What a view does for one wish.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Gain {
    /// Standard deviation so far.
    pub before: f64,
    /// With the view.
    pub after: f64,
}

impl Gain {
    /// The part of the standard deviation that remains.
    pub fn ratio(&self) -> f64 {
        self.after / self.before
    }
}
