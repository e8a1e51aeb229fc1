//! How likely is an excess by chance? Tails, the same digits on every machine.

use statrs::function::beta::checked_beta_reg;

/// Digits kept: the last ones of the beta function are the platform's.
const DIGITS: f64 = 1e9;

/// `P(F > f)` of the ratio of two independent chi-squared variables, each over its degrees of freedom (Fisher
/// 1924): the regularised incomplete beta function `I_x(d2 / 2, d1 / 2)` at `x = d2 / (d2 + d1 f)`. To nine
/// digits; 0 below 1e-300.
pub(super) fn fisher_tail(f: f64, numerator_freedom: usize, denominator_freedom: usize) -> f64 {
    let (d1, d2) = (numerator_freedom as f64, denominator_freedom as f64);
    if f.is_nan() || f <= 0.0 {
        return 1.0;
    }
    let x = (d2 / (d2 + d1 * f)).clamp(0.0, 1.0);
    let tail = checked_beta_reg(0.5 * d2, 0.5 * d1, x).unwrap_or(0.0);
    significant(tail)
}

/// Rounded to nine significant digits, in binary scale: no logarithm is needed.
pub(super) fn significant(x: f64) -> f64 {
    if x <= 0.0 || !x.is_finite() {
        return 0.0;
    }
    let (mantissa, exponent) = libm::frexp(x);
    libm::ldexp(libm::round(mantissa * DIGITS) / DIGITS, exponent)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_are_those_of_closed_forms() {
        // With x = d2 / (d2 + d1 f): x^(d2/2) for d1 = 2, and x^(d2/2) (1 + (1 - x) d2 / 2) for d1 = 4.
        for (f, d2) in [(0.3, 20), (3.5, 20), (2.0, 400), (9.0, 401)] {
            let x = |d1: f64| f64::from(d2) / (f64::from(d2) + d1 * f);
            let half = 0.5 * f64::from(d2);
            let two = libm::pow(x(2.0), half);
            let four = libm::pow(x(4.0), half) * (1.0 + half * (1.0 - x(4.0)));
            assert!((fisher_tail(f, 2, d2 as usize) / two - 1.0).abs() < 1e-8);
            assert!((fisher_tail(f, 4, d2 as usize) / four - 1.0).abs() < 1e-8);
        }
        assert_eq!(fisher_tail(-1.0, 2, 20), 1.0);
        assert!(fisher_tail(100.0, 8, 400) < 1e-80);
    }
}
