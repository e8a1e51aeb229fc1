//! From which distribution should a sampled number come? What theory predicts before anything is drawn.

use calibench::evaluate::distribution::{ChiSquare, normal_quantile, wilson_hilferty};
use calibench::io::significant;
use std::fmt;

/// A predicted distribution of one number.
#[derive(Debug, Clone, PartialEq)]
pub enum Predicted {
    /// Normal.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation, > 0.
        sd: f64,
    },
    /// Chi-squared, such as a Mahalanobis distance squared.
    ChiSquared {
        /// Degrees of freedom, > 0.
        dof: f64,
    },
    /// `scale sqrt(chi2 with dof degrees of freedom)`, such as an RMSE: per point over N points with noise
    /// sigma, `scale = sigma / sqrt(N)` and `dof = 2 N - p`.
    Chi {
        /// Factor on the root.
        scale: f64,
        /// Degrees of freedom, > 0.
        dof: f64,
    },
    /// An interval found by simulation, at one rate only.
    Simulated {
        /// Lower quantile.
        low: f64,
        /// Upper quantile.
        high: f64,
        /// Chance that a correct draw lies outside.
        false_alarm_rate: f64,
        /// What was simulated, with the number of trials.
        source: String,
    },
}

impl Predicted {
    /// The central interval that a correct draw misses with probability `false_alarm_rate`, half on each
    /// side. A simulated interval has a rate of its own, see [`Predicted::effective_rate`]. Parameters
    /// outside their domain give NaN ends, in which nothing lies.
    pub fn interval(&self, false_alarm_rate: f64) -> (f64, f64) {
        if let Predicted::Simulated { low, high, .. } = self {
            return (*low, *high);
        }
        let tail = 0.5 * false_alarm_rate;
        (self.quantile(tail), self.quantile(1.0 - tail))
    }

    /// The false-alarm rate that [`Predicted::interval`] has when asked for `false_alarm_rate`.
    pub fn effective_rate(&self, false_alarm_rate: f64) -> f64 {
        match self {
            Predicted::Simulated { false_alarm_rate: own, .. } => *own,
            _ => false_alarm_rate,
        }
    }

    /// The value below which a draw lies with probability `p`.
    fn quantile(&self, p: f64) -> f64 {
        let chi_squared = |dof: f64| ChiSquare::with_freedom(dof).map_or(f64::NAN, |d| d.quantile(p));
        match self {
            Predicted::Normal { mean, sd } if *sd > 0.0 => mean + sd * normal_quantile(p),
            Predicted::Normal { .. } => f64::NAN,
            Predicted::ChiSquared { dof } => chi_squared(*dof),
            Predicted::Chi { scale, dof } => scale * chi_squared(*dof).sqrt(),
            Predicted::Simulated { .. } => f64::NAN,
        }
    }

    /// Distance of `value` from the centre in standard deviations, where that is defined by the model itself.
    pub fn z(&self, value: f64) -> Option<f64> {
        match self {
            Predicted::Normal { mean, sd } => Some((value - mean) / sd),
            Predicted::ChiSquared { dof } => Some(wilson_hilferty(value, *dof)),
            Predicted::Chi { scale, dof } => {
                let root = value / scale;
                Some(wilson_hilferty(root * root, *dof))
            }
            Predicted::Simulated { .. } => None,
        }
    }
}

impl fmt::Display for Predicted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Predicted::Normal { mean, sd } => write!(f, "normal, mean {mean:.6}, sd {}", significant(*sd, 4)),
            Predicted::ChiSquared { dof } => write!(f, "chi-squared, {dof} degrees of freedom"),
            Predicted::Chi { scale, dof } => {
                write!(f, "{} x chi, {dof} degrees of freedom", significant(*scale, 4))
            }
            Predicted::Simulated { source, .. } => write!(f, "simulated: {source}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_have_the_tabulated_quantiles() {
        let close = |(a, b): (f64, f64), (c, d): (f64, f64)| (a - c).abs() < 1e-3 && (b - d).abs() < 1e-3;
        // Tables of the normal and chi-squared distributions (Abramowitz & Stegun 1964, 26.1 and 26.8).
        assert!(close(
            Predicted::Normal { mean: 1.0, sd: 2.0 }.interval(0.05),
            (1.0 - 3.91993, 1.0 + 3.91993)
        ));
        assert!(close(Predicted::ChiSquared { dof: 6.0 }.interval(0.05), (1.237, 14.449)));
        let chi = Predicted::Chi { scale: 2.0, dof: 6.0 }.interval(0.05);
        assert!(close(chi, (2.0 * 1.237_344f64.sqrt(), 2.0 * 14.449_375f64.sqrt())));
    }

    #[test]
    fn impossible_parameters_contain_nothing() {
        let (low, high) = Predicted::Normal { mean: 0.0, sd: -1.0 }.interval(0.05);
        assert!(!(low..=high).contains(&0.0));
        let (low, high) = Predicted::ChiSquared { dof: 0.0 }.interval(0.05);
        assert!(!(low..=high).contains(&0.0));
    }

    #[test]
    fn z_of_a_chi_squared_value_is_nearly_normal() {
        // 95 % point of chi-squared with 10 degrees of freedom: 18.307; of the normal distribution: 1.645.
        let z = Predicted::ChiSquared { dof: 10.0 }.z(18.307).unwrap();
        assert!((z - 1.645).abs() < 0.01, "{z}");
        assert_eq!(Predicted::Normal { mean: 1.0, sd: 2.0 }.z(4.0), Some(1.5));
    }
}
