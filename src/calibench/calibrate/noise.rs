//! What do the residuals of a minimum say of the noise? One number under least squares, two under a robust loss.
//!
//! With the influence `psi = rho'(|r|^2) r` of a residual let `S` be the sum of its squares, `w` the mean of the weights `rho'`, `s` the
//! mean slope of the influence and `f` the degrees of freedom. The estimate's covariance is `S / (f s^2) (J^T J)^-1` (Huber 1981,
//! section 7.6, without its correction for few marks), the weighted normal matrix is about `w J^T J`, and half the cost's curvature
//! `s J^T J`. So the covariance is `S w / (f s^2)` times the inverse of the normal matrix, and one standard deviation costs `S / (f s)`.
//! Under least squares `w = s = 1`, and both are the variance of a coordinate.

use super::loss::Loss;
use crate::geometry::Vec2;

/// The noise of a coordinate of weight 1, px^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noise {
    /// Factor of the inverse of the normal matrix: the covariance.
    pub variance: f64,
    /// By how much the cost rises one standard deviation away from a minimum.
    pub rise: f64,
}

impl Noise {
    /// Under least squares.
    pub fn of_squares(variance: f64) -> Noise {
        Noise { variance, rise: variance }
    }

    /// From weighted residuals; `square` is the sum of their squares.
    pub fn of_residuals(residuals: &[Vec<Vec2>], square: f64, loss: Loss, freedom: f64) -> Noise {
        if loss == Loss::Squares {
            return Noise::of_squares(square / freedom);
        }
        let (mut square, mut weights, mut slopes, mut count) = (0.0, 0.0, 0.0, 0.0);
        for r in residuals.iter().flatten() {
            let s = r.norm_squared();
            let weight = loss.at(s).1;
            square += weight * weight * s;
            weights += weight;
            slopes += loss.slope(s);
            count += 1.0;
        }
        let influence = square / freedom;
        Noise { variance: influence * weights * count / (slopes * slopes), rise: influence * count / slopes }
    }

    /// At least this much of both.
    pub fn at_least(self, floor: f64) -> Noise {
        Noise { variance: self.variance.max(floor), rise: self.rise.max(floor) }
    }

    /// What deviations for unit noise, by the normal matrix, are multiplied with, px: the standard deviation of a coordinate under least
    /// squares, and some 15 % less than what it counts for with Cauchy's loss at twice the noise.
    pub fn px(self) -> f64 {
        self.variance.sqrt()
    }
}
