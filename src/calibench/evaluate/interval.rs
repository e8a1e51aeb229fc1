//! How much may a Monte Carlo number differ from what it estimates? Intervals at a stated false-alarm rate.

use super::distribution::{ChiSquare, normal_two_sided};

/// A closed interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// `centre +- half_width`.
    pub fn around(centre: f64, half_width: f64) -> Interval {
        Interval { low: centre - half_width, high: centre + half_width }
    }

    /// Whether `x` lies inside, ends included.
    pub fn contains(&self, x: f64) -> bool {
        self.low <= x && x <= self.high
    }

    /// Half of the width.
    pub fn half_width(&self) -> f64 {
        0.5 * (self.high - self.low)
    }

    /// The interval of the mean of `trials` independent values of standard deviation `sd` (central limit).
    pub fn of_mean(mean: f64, sd: f64, trials: usize, false_alarm: f64) -> Interval {
        Interval::around(mean, normal_two_sided(false_alarm) * sd / (trials as f64).sqrt())
    }

    /// Where the ratio (sample standard deviation) / (true one) of `trials` Gaussian values lies:
    /// `sqrt(chi2_{n-1} / (n - 1))`.
    pub fn of_deviation_ratio(trials: usize, false_alarm: f64) -> Interval {
        let freedom = trials.saturating_sub(1).max(1);
        let chi = ChiSquare::new(freedom);
        let root = |p: f64| (chi.quantile(p) / freedom as f64).sqrt();
        Interval { low: root(0.5 * false_alarm), high: root(1.0 - 0.5 * false_alarm) }
    }

    /// Where the mean of `trials` chi-squared values with `degrees_of_freedom` each lies.
    pub fn of_mean_chi_squared(degrees_of_freedom: usize, trials: usize, false_alarm: f64) -> Interval {
        let sum = ChiSquare::new(degrees_of_freedom * trials);
        let mean = |p: f64| sum.quantile(p) / trials as f64;
        Interval { low: mean(0.5 * false_alarm), high: mean(1.0 - 0.5 * false_alarm) }
    }

    /// The probability behind `successes` of `trials` (Wilson 1927).
    pub fn of_proportion(successes: usize, trials: usize, false_alarm: f64) -> Interval {
        let (n, z) = (trials as f64, normal_two_sided(false_alarm));
        let p = successes as f64 / n;
        let centre = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        Interval { low: (centre - half).max(0.0), high: (centre + half).min(1.0) }
    }

    /// The true correlation behind a sample correlation of `trials` pairs (Fisher 1921): `atanh r +- z /
    /// sqrt(n - 3)`; any, -1 to 1, where there are but three.
    pub fn of_correlation(sample: f64, trials: usize, false_alarm: f64) -> Interval {
        if trials <= 3 {
            return Interval { low: -1.0, high: 1.0 };
        }
        let half = normal_two_sided(false_alarm) / (trials as f64 - 3.0).sqrt();
        let centre = libm::atanh(sample);
        Interval { low: libm::tanh(centre - half), high: libm::tanh(centre + half) }
    }
}

/// The false-alarm rate of each of `count` claims that keeps the chance of any false alarm below `overall`
/// (Bonferroni).
pub fn each_of(count: usize, overall: f64) -> f64 {
    overall / count.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_intervals_are_met() {
        // Wilson's interval for 0 of 10 at 95 %: upper end z^2 / (n + z^2) = 0.2775.
        let none = Interval::of_proportion(0, 10, 0.05);
        assert!(none.low == 0.0 && (none.high - 0.2775).abs() < 1e-4);
        // 2000 trials: the ratio has standard deviation 1/sqrt(2 * 1999) = 0.0158.
        let ratio = Interval::of_deviation_ratio(2000, 0.05);
        assert!((ratio.half_width() - 1.96 * 0.0158).abs() < 2e-4);
        assert!(Interval::of_mean_chi_squared(6, 2000, 0.05).contains(6.0));
        assert!(Interval::of_correlation(0.9, 100, 0.05).contains(0.9));
        assert_eq!(Interval::of_correlation(0.9, 3, 0.05), Interval { low: -1.0, high: 1.0 });
        assert_eq!(each_of(20, 0.01), 0.0005);
        // z = 1.959964: 2 +- z 3 / sqrt(100).
        let mean = Interval::of_mean(2.0, 3.0, 100, 0.05);
        assert!((mean.low - 1.412_011).abs() < 1e-6 && (mean.high - 2.587_989).abs() < 1e-6);
        // Wilson's formula for 3 of 10: (0.3 + z^2 / 20 +- z sqrt(0.3 * 0.7 / 10 + z^2 / 400)) / (1 + z^2 /
        // 10).
        let some = Interval::of_proportion(3, 10, 0.05);
        assert!((some.low - 0.107_79).abs() < 1e-5 && (some.high - 0.603_22).abs() < 1e-5, "{some:?}");
    }
}
