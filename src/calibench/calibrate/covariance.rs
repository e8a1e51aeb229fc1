//! How well are the unknowns known? Covariance blocks and what follows from them.

use crate::camera::{FreeParameters, Parameter};
use nalgebra::{DMatrix, MatrixXx6, SMatrix};

/// Covariance of the free intrinsics and of every pose.
///
/// To first order the estimate is Gaussian with covariance `sigma^2 (J^T J)^-1`; poses are marginal over the intrinsics and the
/// other way round. Pose entries: rotation vector of `R <- exp(delta) R` in rad, then translation in the target's unit.
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance {
    /// Which parameters the rows of `intrinsics` are, in order.
    pub free: FreeParameters,
    /// n x n.
    pub intrinsics: DMatrix<f64>,
    /// 6 x 6 a view.
    pub poses: Vec<SMatrix<f64, 6, 6>>,
    /// n x 6 a view: intrinsics with that view's pose.
    pub cross: Vec<MatrixXx6<f64>>,
}

impl Covariance {
    /// The covariance for noise of variance `factor` times that of this one.
    pub fn scaled(mut self, factor: f64) -> Covariance {
        self.intrinsics *= factor;
        self.poses.iter_mut().for_each(|block| *block *= factor);
        self.cross.iter_mut().for_each(|block| *block *= factor);
        self
    }

    /// Standard deviation of an intrinsic parameter; `None` if it was not estimated.
    pub fn standard_deviation(&self, parameter: Parameter) -> Option<f64> {
        let i = self.free.position(parameter)?;
        Some(self.intrinsics[(i, i)].sqrt())
    }

    /// Correlation coefficient of two intrinsic parameters; `None` if one was not estimated.
    pub fn correlation(&self, a: Parameter, b: Parameter) -> Option<f64> {
        let (i, j) = (self.free.position(a)?, self.free.position(b)?);
        let m = &self.intrinsics;
        Some(m[(i, j)] / (m[(i, i)] * m[(j, j)]).sqrt())
    }

    /// `e^T P^-1 e` for an error of the free intrinsics: chi-squared with as many degrees of freedom if the covariance is
    /// right (the normalised estimation error squared; Bar-Shalom, Li & Kirubarajan 2001). `None` if `P` is singular or the
    /// error has another length.
    pub fn normalised_error_squared(&self, error: &[f64]) -> Option<f64> {
        if error.len() != self.free.len() {
            return None;
        }
        let e = nalgebra::DVector::from_row_slice(error);
        Some(e.dot(&self.intrinsics.clone().cholesky()?.solve(&e)))
    }
}
