//! When does a series of checks leave control? A threshold on each (Shewhart 1931) and one on their
//! exponentially weighted moving average (EWMA; Roberts 1959), both set to the same chance of a false alarm.

use statrs::distribution::{Continuous, ContinuousCDF, Normal};

/// A rule over checks in units of their standard deviation.
///
/// ```
/// use calibench::downstream::control::{Ewma, Rule, Shewhart};
///
/// // A check a day for a hundred days: both rules give a false alarm in one of a hundred such series.
/// let threshold = Shewhart::with_false_alarm(0.01, 100);
/// let average = Ewma::with_false_alarm(0.2, 0.01, 100);
/// // A drift of a twentieth of a standard deviation a day.
/// let drift: Vec<f64> = (0..100).map(|day| 0.05 * f64::from(day)).collect();
/// assert!(average.first_alarm(&drift) < threshold.first_alarm(&drift));
/// ```
pub trait Rule {
    /// The first check that gives an alarm.
    fn first_alarm(&self, checks: &[f64]) -> Option<usize>;
}

fn normal() -> Normal {
    Normal::standard()
}

/// Alarm when one check exceeds the limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shewhart {
    /// Largest size without alarm, in standard deviations of a check.
    pub limit: f64,
}

impl Shewhart {
    /// The limit with a given chance of any false alarm among `checks` independent ones:
    /// `1 - (1 - p)^checks = false_alarm`, `p` two-sided.
    pub fn with_false_alarm(false_alarm: f64, checks: usize) -> Shewhart {
        let p = -libm::expm1(libm::log1p(-false_alarm) / checks as f64);
        Shewhart { limit: -normal().inverse_cdf(0.5 * p) }
    }
}

impl Rule for Shewhart {
    fn first_alarm(&self, checks: &[f64]) -> Option<usize> {
        checks.iter().position(|x| x.abs() > self.limit)
    }
}

/// Alarm when `z <- (1 - w) z + w x` exceeds the limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ewma {
    /// Weight `w` of the newest check: 0.05 to 1, where the integral below is exact to a part in a thousand
    /// over thousands of checks.
    pub weight: f64,
    /// Largest size without alarm, in standard deviations of a check.
    pub limit: f64,
}

/// Nodes of Simpson's rule across the region without alarm. The kernel is a normal density of width `weight`
/// over a region of about `2 x 1.2`: a step of 0.012 against 0.2 leaves a relative error near
/// `(0.06)^4 / 180 = 7e-8` a check, 2e-5 a quarter.
const NODES: usize = 201;

impl Ewma {
    /// The limit with a given chance of a false alarm among `checks`, by bisection of [`Ewma::false_alarm`].
    pub fn with_false_alarm(weight: f64, false_alarm: f64, checks: usize) -> Ewma {
        let spread = (weight / (2.0 - weight)).sqrt();
        let (mut low, mut high) = (1.0 * spread, 7.0 * spread);
        // 40 halvings of a range of 2 leave 2e-12.
        for _ in 0..40 {
            let limit = 0.5 * (low + high);
            if (Ewma { weight, limit }).false_alarm(checks) > false_alarm {
                low = limit
            } else {
                high = limit
            }
        }
        Ewma { weight, limit: 0.5 * (low + high) }
    }

    /// Chance of an alarm among `checks` when nothing drifts. The chance `S_n(z)` to pass `n` more checks
    /// from `z` obeys `S_n(z) = integral S_{n-1}(y) phi((y - (1 - w) z) / w) / w dy` over the region without
    /// alarm (Crowder 1987), here by Simpson's rule on fixed nodes.
    pub fn false_alarm(&self, checks: usize) -> f64 {
        let step = 2.0 * self.limit / (NODES - 1) as f64;
        let at = |i: usize| step * i as f64 - self.limit;
        let simpson = |i: usize| match i {
            0 => 1.0,
            i if i == NODES - 1 => 1.0,
            i if i % 2 == 1 => 4.0,
            _ => 2.0,
        };
        let density = normal();
        let kernel: Vec<f64> = (0..NODES * NODES)
            .map(|cell| {
                let (z, y) = (at(cell / NODES), at(cell % NODES));
                let x = (y - (1.0 - self.weight) * z) / self.weight;
                simpson(cell % NODES) * step / 3.0 * density.pdf(x) / self.weight
            })
            .collect();
        let mut pass = vec![1.0; NODES];
        for _ in 0..checks {
            pass = kernel
                .chunks_exact(NODES)
                .map(|row| row.iter().zip(&pass).map(|(k, s)| k * s).sum())
                .collect();
        }
        // The middle node is z = 0, where the rule starts.
        1.0 - pass[NODES / 2]
    }

    /// The smoothed values of a series.
    pub fn smoothed(weight: f64, checks: &[f64]) -> impl Iterator<Item = f64> {
        checks.iter().scan(0.0, move |z, x| {
            *z = (1.0 - weight) * *z + weight * x;
            Some(*z)
        })
    }
}

impl Rule for Ewma {
    fn first_alarm(&self, checks: &[f64]) -> Option<usize> {
        Ewma::smoothed(self.weight, checks).position(|z| z.abs() > self.limit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moving_average_of_one_check_is_a_threshold() {
        let threshold = Shewhart::with_false_alarm(0.01, 273);
        let ewma = Ewma { weight: 1.0, limit: threshold.limit };
        assert!((ewma.false_alarm(273) - 0.01).abs() < 1e-6);
        assert!((Ewma::with_false_alarm(1.0, 0.01, 273).limit - threshold.limit).abs() < 1e-4);
    }

    #[test]
    fn false_alarms_are_those_of_the_published_average_run_lengths() {
        // Lucas & Saccucci 1990, table 3: an average of 500 checks to a false alarm. Runs are geometric but
        // for their first few checks.
        for (weight, limit) in [(0.25_f64, 2.998), (0.10, 2.814)] {
            let ewma = Ewma { weight, limit: limit * (weight / (2.0 - weight)).sqrt() };
            let expected = -libm::expm1(-1.0);
            assert!((ewma.false_alarm(500) - expected).abs() < 0.01, "{}", ewma.false_alarm(500));
        }
    }

    #[test]
    fn a_slow_drift_alarms_the_average_first_and_a_jump_the_threshold() {
        let (threshold, ewma) =
            (Shewhart::with_false_alarm(0.01, 273), Ewma::with_false_alarm(0.2, 0.01, 273));
        let drift: Vec<f64> = (0..273).map(|i| 0.02 * f64::from(i)).collect();
        assert!(
            ewma.first_alarm(&drift) < threshold.first_alarm(&drift) && ewma.first_alarm(&drift).is_some()
        );
        let jump = [0.0, 0.0, 4.5, 0.0];
        assert_eq!((threshold.first_alarm(&jump), ewma.first_alarm(&jump)), (Some(2), None));
    }
}
