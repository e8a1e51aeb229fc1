//! What do the residuals of a minimum say of the noise? One number under least squares, two under a robust loss.
//!
//! With the influence `psi = rho'(|r|^2) r` of a residual let `S` be the sum of its squares, `w` the mean of the weights `rho'`, `s` the
//! mean slope of the influence and `f` the degrees of freedom. The estimate's covariance is `S / (f s^2) (J^T J)^-1` (Huber 1981,
//! section 7.6, without its correction for few marks), the weighted normal matrix is about `w J^T J`, and half the cost's curvature
//! `s J^T J`. So a coordinate counts as if it had the variance `S / (f s^2)`, the covariance is `S w / (f s^2)` times the inverse of the
//! normal matrix, and one standard deviation costs `S / (f s)`. Under least squares `w = s = 1`, and all three are the variance of a
//! coordinate.

use super::loss::Loss;
use crate::geometry::Vec2;

/// The noise of a coordinate of weight 1, px^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Noise {
    /// Variance that a coordinate counts as if it had.
    pub coordinate: f64,
    /// Factor of the inverse of the normal matrix: the covariance.
    pub variance: f64,
    /// By how much the cost rises one standard deviation away from a minimum.
    pub rise: f64,
}

impl Noise {
    /// Under least squares.
    pub fn of_squares(variance: f64) -> Noise {
        Noise { coordinate: variance, variance, rise: variance }
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
        let (weight, slope) = (weights / count, slopes / count);
        let rise = square / freedom / slope;
        Noise { coordinate: rise / slope, variance: rise / slope * weight, rise }
    }

    /// At least this much of each.
    pub fn at_least(self, floor: f64) -> Noise {
        let Noise { coordinate, variance, rise } = self;
        Noise { coordinate: coordinate.max(floor), variance: variance.max(floor), rise: rise.max(floor) }
    }

    /// Standard deviation that a coordinate counts as if it had, px.
    pub fn px(self) -> f64 {
        self.coordinate.sqrt()
    }

    /// What deviations for unit noise, by the normal matrix, are multiplied with, px.
    pub fn scale(self) -> f64 {
        self.variance.sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distribution::normal_quantile;

    /// Where marks with a common place have it, and the cost there.
    fn place(marks: &[Vec2], loss: Loss) -> Vec2 {
        let mut place = Vec2::zeros();
        for _ in 0..200 {
            let weight = |mark: &&Vec2| loss.at((**mark - place).norm_squared()).1;
            let weights: f64 = marks.iter().map(|mark| weight(&mark)).sum();
            place = marks.iter().map(|mark| *mark * weight(&mark)).sum::<Vec2>() / weights;
        }
        place
    }

    #[test]
    fn one_standard_deviation_costs_what_is_said() {
        let even = |at: usize, step: f64| normal_quantile(((at as f64 + 0.5) * step).fract());
        let mark = |at: usize| {
            let noise = 0.1 * Vec2::new(even(at, 0.618_033_988_749_895), even(at, 0.414_213_562_373_095));
            if at.is_multiple_of(10) { noise + Vec2::new(3.0 * (at % 3) as f64 - 3.0, 2.0) } else { noise }
        };
        let marks: Vec<Vec2> = (0..4000).map(mark).collect();
        for loss in [Loss::Squares, Loss::Huber { delta_px: 0.1 }, Loss::Cauchy { scale_px: 0.2 }] {
            let least = place(&marks, loss);
            let residuals: Vec<Vec2> = marks.iter().map(|mark| least - mark).collect();
            let squares = || residuals.iter().map(Vec2::norm_squared);
            let freedom = 2.0 * marks.len() as f64 - 2.0;
            let noise = Noise::of_residuals(std::slice::from_ref(&residuals), squares().sum(), loss, freedom);
            // The normal matrix of a common place is the sum of the weights.
            let information: f64 = squares().map(|square| loss.at(square).1).sum();
            let cost = |at: Vec2| marks.iter().map(|mark| loss.at((at - mark).norm_squared()).0).sum::<f64>();
            let step = noise.scale() / information.sqrt();
            for direction in [Vec2::x(), Vec2::y()] {
                let both = [step, -step].map(|step| cost(least + step * direction) - cost(least));
                let rise = 0.5 * (both[0] + both[1]);
                assert!((rise / noise.rise - 1.0).abs() < 0.05, "{loss:?}: {rise} {noise:?}");
            }
        }
    }
}
