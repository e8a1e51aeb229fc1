//! Is a sum of squares as large as what was stated lets expect? Chi-squared with the right expectation.

use crate::distribution::ChiSquare;

/// Rate at which a test that says "not so" is wrong.
pub const FALSE_ALARM: f64 = 0.01;

/// First two moments of a sum `sum lambda_j z_j^2` of standard normal `z_j`: `sum lambda`, and `sum
/// lambda^2`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moments {
    pub sum: f64,
    pub squares: f64,
}

/// A sum of squares against its expectation.
///
/// Under what is stated the sum is one of independent squares with weights between 0 and 1: marks that pixels
/// say little of keep to where they were measured. Its mean `E = sum lambda` and variance `2 sum lambda^2`
/// are known from the covariance, and a chi-squared variable with `E^2 / sum lambda^2` degrees of freedom,
/// scaled to the same mean, has both (Satterthwaite 1946). The test looks at both ends: sums may be too small
/// as well.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SumTest {
    /// The sum.
    pub sum: f64,
    /// Its expectation.
    pub expected: f64,
    /// Degrees of freedom of the scaled chi-squared variable.
    pub degrees_of_freedom: f64,
    /// Probability of a sum at least as far out at its end, times two.
    pub p_value: f64,
}

/// A sum whose expectation is smaller says nothing.
const LEAST_EXPECTED: f64 = 0.05;

impl SumTest {
    /// `None` where almost nothing is expected.
    pub(super) fn of(sum: f64, moments: Moments) -> Option<SumTest> {
        let Moments { sum: expected, squares } = moments;
        if expected.is_nan() || expected < LEAST_EXPECTED {
            return None;
        }
        let degrees_of_freedom = expected * expected / squares;
        let distribution = ChiSquare::with_freedom(degrees_of_freedom)?;
        let scaled = sum * expected / squares;
        let (below, above) = (distribution.cdf(scaled), distribution.survival(scaled));
        let p_value = (2.0 * below.min(above)).min(1.0);
        Some(SumTest { sum, expected, degrees_of_freedom, p_value })
    }

    /// Whether the sum is what one of a hundred would exceed at neither end: see [`FALSE_ALARM`].
    pub fn holds(&self) -> bool {
        self.p_value >= FALSE_ALARM
    }

    /// The standard deviations that the sum shows over those that were stated.
    pub fn factor(&self) -> f64 {
        (self.sum / self.expected).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_weights_make_a_chi_squared_test() {
        let all = Moments { sum: 6.0, squares: 6.0 };
        let test = SumTest::of(9.0, all).unwrap();
        // Abramowitz & Stegun 1964, table 26.7: 0.17358 is above 9.
        assert!((test.p_value - 2.0 * 0.173_578_1).abs() < 1e-6 && test.holds());
        assert!(!SumTest::of(30.0, all).unwrap().holds() && !SumTest::of(0.2, all).unwrap().holds());
        assert!((SumTest::of(24.0, all).unwrap().factor() - 2.0).abs() < 1e-15);
        assert!(SumTest::of(1.0, Moments { sum: 1e-3, squares: 1e-6 }).is_none());
    }
}
