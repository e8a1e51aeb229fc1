//! How large should the reprojection error be? Its distribution when the model is right and the noise is
//! Gaussian.

use super::Interval;
use super::distribution::ChiSquare;

/// The predicted distribution of the RMSE per point of a least-squares fit.
///
/// The sum of squares over `2 N` coordinates with `p` parameters fitted is `sigma^2` times a chi-squared
/// variable with `d = 2 N - p` degrees of freedom (to first order in the noise), so `RMSE = sigma sqrt(X /
/// N)`. The noise floor is `sqrt(2) sigma`; parameters absorb noise, so the expectation lies below it by the
/// factor `sqrt(d / 2N)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RmseDistribution {
    /// Standard deviation of a pixel coordinate, px.
    pub sigma_px: f64,
    /// Number of points `N`.
    pub points: usize,
    /// Number of fitted parameters `p`, intrinsics and poses.
    pub parameters: usize,
}

impl RmseDistribution {
    /// `d = 2 N - p`.
    pub fn degrees_of_freedom(&self) -> usize {
        (2 * self.points).saturating_sub(self.parameters)
    }

    /// `sqrt(2) sigma`: what perfect knowledge of the camera would leave.
    pub fn noise_floor_px(&self) -> f64 {
        std::f64::consts::SQRT_2 * self.sigma_px
    }

    fn scale(&self) -> f64 {
        self.sigma_px / (self.points as f64).sqrt()
    }

    /// Expected value, px.
    pub fn mean_px(&self) -> f64 {
        self.scale() * ChiSquare::new(self.degrees_of_freedom()).mean_of_root()
    }

    /// `sqrt(E[RMSE^2]) = sigma sqrt(d / N)`, px: the value usually quoted, above the mean by half a variance
    /// over it.
    pub fn root_mean_square_px(&self) -> f64 {
        self.scale() * (self.degrees_of_freedom() as f64).sqrt()
    }

    /// Standard deviation, px.
    pub fn standard_deviation_px(&self) -> f64 {
        let (rms, mean) = (self.root_mean_square_px(), self.mean_px());
        (rms * rms - mean * mean).max(0.0).sqrt()
    }

    /// `P(RMSE <= x)`.
    pub fn cdf(&self, rmse_px: f64) -> f64 {
        let ratio = rmse_px / self.scale();
        ChiSquare::new(self.degrees_of_freedom()).cdf(ratio * ratio)
    }

    /// The `x` with `P(RMSE <= x) = p`, px.
    pub fn quantile_px(&self, p: f64) -> f64 {
        self.scale() * ChiSquare::new(self.degrees_of_freedom()).quantile(p).sqrt()
    }

    /// The central interval that a right model leaves with probability `false_alarm`.
    pub fn interval_px(&self, false_alarm: f64) -> Interval {
        Interval { low: self.quantile_px(0.5 * false_alarm), high: self.quantile_px(1.0 - 0.5 * false_alarm) }
    }

    /// Chance of an RMSE at least as far from the middle as `rmse_px`, both sides counted.
    pub fn p_value(&self, rmse_px: f64) -> f64 {
        let below = self.cdf(rmse_px);
        (2.0 * below.min(1.0 - below)).min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_examples_prediction_is_met() {
        // Printed for this scene: E[RMSE] = 0.1371 +- 0.0045 for 252 points and 30 parameters; noise floor
        // 0.1414.
        let predicted = RmseDistribution { sigma_px: 0.1, points: 252, parameters: 30 };
        assert!((predicted.mean_px() - 0.1371).abs() < 5e-5);
        assert!((predicted.standard_deviation_px() - 0.0045).abs() < 5e-5);
        assert!((predicted.noise_floor_px() - 0.1414).abs() < 5e-5);
        assert!(predicted.interval_px(0.01).contains(0.1384));
        assert!((predicted.cdf(predicted.quantile_px(0.2)) - 0.2).abs() < 1e-8);
    }

    #[test]
    fn both_tails_count() {
        let distribution = RmseDistribution { sigma_px: 0.1, points: 20, parameters: 10 };
        for (quantile, both) in [(0.05, 0.1), (0.3, 0.6), (0.5, 1.0), (0.8, 0.4), (0.995, 0.01)] {
            let p = distribution.p_value(distribution.quantile_px(quantile));
            assert!((p - both).abs() < 1e-8, "{quantile}: {p} instead of {both}");
        }
    }
}
