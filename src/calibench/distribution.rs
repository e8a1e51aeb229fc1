//! How likely is a value by chance? The normal and chi-squared distributions, the same digits on every
//! machine.
//!
//! The distributions are those of `statrs`, whose logarithms and exponentials may be the platform's; their
//! last digits differ between machines. Every result is therefore rounded to ten significant digits, far more
//! than a probability needs.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, Normal, StudentsT};

/// Digits of a result that do not depend on the platform's mathematics.
const DIGITS: i32 = 10;

/// Rounds to `digits` significant digits.
pub fn round_significant(x: f64, digits: i32) -> f64 {
    if x == 0.0 || !x.is_finite() {
        return x;
    }
    let exponent = libm::floor(libm::log10(x.abs())) as i32;
    let power = digits - 1 - exponent;
    // Powers of ten are exact up to 1e22; dividing by one keeps small numbers exact to a rounding.
    if power.abs() > 300 {
        return x;
    }
    let scale = libm::exp10(f64::from(power.abs())).round();
    if power >= 0 { (x * scale).round() / scale } else { (x / scale).round() * scale }
}

fn stable(x: f64) -> f64 {
    round_significant(x, DIGITS)
}

fn standard_normal() -> Normal {
    Normal::new(0.0, 1.0).expect("the standard normal distribution exists")
}

/// `P(Z <= z)` of a standard normal variable.
pub fn normal_cdf(z: f64) -> f64 {
    stable(standard_normal().cdf(z))
}

/// The `z` with `P(Z <= z) = p`: infinite at 0 and 1, NaN where `p` is no probability.
pub fn normal_quantile(p: f64) -> f64 {
    if (0.0..=1.0).contains(&p) { stable(standard_normal().inverse_cdf(p)) } else { f64::NAN }
}

/// The half-width `z` of a two-sided interval that a standard normal variable leaves with probability
/// `false_alarm`.
pub fn normal_two_sided(false_alarm: f64) -> f64 {
    // By symmetry; the lower tail keeps its digits where 1 - p would not.
    -normal_quantile(0.5 * false_alarm)
}

/// Degrees of freedom from which Student's quantile is that of an expansion, whose error is there below 1e-14
/// of it down to one in a thousand, and some 1e-10 at one in 1e15. The inverse of the incomplete beta
/// function ends short of the quantile by 4e-6 of it at a hundred thousand, by 7 % at ten million, and not at
/// all at some more.
const MANY: f64 = 1000.0;

/// The tail keeps its digits where the inverse of the incomplete beta function, of what is as rare, may not:
/// with one degree of freedom it ends far from the quantile from 1e-7 on.
const RARE: f64 = 1e-6;

/// The half-width `t` of a two-sided interval that a variable of Student's distribution leaves with
/// probability `false_alarm` (Student 1908); that of the normal distribution if `degrees_of_freedom` is
/// infinite. It is infinite where none are left, and else NaN where `false_alarm` is no probability or
/// `degrees_of_freedom` no number.
///
/// ```
/// use calibench::distribution::student_two_sided;
///
/// assert!((student_two_sided(0.05, 10.0) - 2.228).abs() < 5e-4);
/// ```
pub fn student_two_sided(false_alarm: f64, degrees_of_freedom: f64) -> f64 {
    if degrees_of_freedom.is_nan() || !(0.0..=1.0).contains(&false_alarm) {
        return f64::NAN;
    }
    if degrees_of_freedom <= 0.0 || false_alarm == 0.0 {
        return f64::INFINITY;
    }
    if degrees_of_freedom >= MANY {
        return stable(student_expanded(normal_two_sided(false_alarm), degrees_of_freedom));
    }
    let student = StudentsT::new(0.0, 1.0, degrees_of_freedom).expect("degrees of freedom are positive");
    if false_alarm > RARE {
        return stable(-student.inverse_cdf(0.5 * false_alarm));
    }
    stable(bisected(1.0, |t| 2.0 * student.cdf(-t) > false_alarm))
}

/// The quantile of Student's distribution at the probability of the normal quantile `z`, by the inverse
/// powers of its degrees of freedom (Abramowitz & Stegun 1964, 26.7.5).
fn student_expanded(z: f64, freedom: f64) -> f64 {
    let s = z * z;
    let terms = [
        (s + 1.0) * z / 4.0,
        ((5.0 * s + 16.0) * s + 3.0) * z / 96.0,
        (((3.0 * s + 19.0) * s + 17.0) * s - 15.0) * z / 384.0,
        ((((79.0 * s + 776.0) * s + 1482.0) * s - 1920.0) * s - 945.0) * z / 92160.0,
    ];
    z + terms.iter().rev().fold(0.0, |sum, term| (sum + term) / freedom)
}

/// `P(F <= f)` of the ratio of two independent chi-squared variables, each over its degrees of freedom: a
/// squared Mahalanobis distance over its dimension follows it if the covariance was scaled by an estimated
/// variance (Fisher 1924). NaN if a number of degrees of freedom is 0.
pub fn fisher_cdf(f: f64, numerator_freedom: usize, denominator_freedom: usize) -> f64 {
    FisherSnedecor::new(numerator_freedom as f64, denominator_freedom as f64)
        .map_or(f64::NAN, |d| stable(d.cdf(f.max(0.0))))
}

/// `P(F > f)` of the same ratio: what is small keeps its digits.
pub fn fisher_tail(f: f64, numerator_freedom: usize, denominator_freedom: usize) -> f64 {
    FisherSnedecor::new(numerator_freedom as f64, denominator_freedom as f64)
        .map_or(f64::NAN, |d| stable(d.sf(f.max(0.0))))
}

/// The positive number up to which `below` holds, by bisection from 0 and from `high`, doubled until it does
/// not hold there.
fn bisected(mut high: f64, below: impl Fn(f64) -> bool) -> f64 {
    let mut low = 0.0;
    while below(high) {
        high *= 2.0;
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if below(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// The standard normal equivalent of a chi-squared value: the cube root of chi-squared over its degrees of
/// freedom is nearly normal (Wilson & Hilferty 1931).
pub fn wilson_hilferty(chi_squared: f64, degrees_of_freedom: f64) -> f64 {
    let spread = 2.0 / (9.0 * degrees_of_freedom);
    (libm::cbrt(chi_squared / degrees_of_freedom) - (1.0 - spread)) / spread.sqrt()
}

/// A chi-squared distribution.
///
/// ```
/// use calibench::distribution::ChiSquare;
///
/// let of_six = ChiSquare::new(6);
/// // What one of a hundred sums of six squared standard normal numbers exceeds.
/// let limit = of_six.quantile(0.99);
/// assert!((limit - 16.812).abs() < 1e-3 && (of_six.survival(limit) - 0.01).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChiSquare {
    degrees_of_freedom: f64,
}

impl ChiSquare {
    /// `degrees_of_freedom` > 0; 0 is treated as the least positive number, so that every sum exceeds it.
    pub fn new(degrees_of_freedom: usize) -> ChiSquare {
        ChiSquare { degrees_of_freedom: (degrees_of_freedom as f64).max(f64::MIN_POSITIVE) }
    }

    /// Any number of degrees of freedom, whole or not; `None` unless it is positive and finite.
    pub fn with_freedom(degrees_of_freedom: f64) -> Option<ChiSquare> {
        (degrees_of_freedom > 0.0 && degrees_of_freedom.is_finite())
            .then_some(ChiSquare { degrees_of_freedom })
    }

    fn distribution(self) -> ChiSquared {
        ChiSquared::new(self.degrees_of_freedom).expect("degrees of freedom are positive")
    }

    /// `P(X <= x)`.
    pub fn cdf(self, x: f64) -> f64 {
        stable(self.distribution().cdf(x.max(0.0)))
    }

    /// `P(X > x)`: the p-value of an observed sum.
    pub fn survival(self, x: f64) -> f64 {
        stable(self.distribution().sf(x.max(0.0)))
    }

    /// The `x` with `P(X <= x) = p`, to ten digits: 0 and infinite at the ends, NaN where `p` is no
    /// probability.
    ///
    /// Bisection of the distribution function between bounds from the normal approximation (Wilson & Hilferty
    /// 1931).
    pub fn quantile(self, p: f64) -> f64 {
        if !(p > 0.0 && p < 1.0) {
            return if p == 0.0 {
                0.0
            } else if p == 1.0 {
                f64::INFINITY
            } else {
                f64::NAN
            };
        }
        let d = self.degrees_of_freedom;
        let c = 2.0 / (9.0 * d);
        let root = 1.0 - c + normal_quantile(p) * c.sqrt();
        let guess = (d * root * root * root).max(1e-3);
        let distribution = self.distribution();
        // The tail in which p is small keeps its digits.
        let below = |x: f64| if p < 0.5 { distribution.cdf(x) < p } else { distribution.sf(x) > 1.0 - p };
        stable(bisected(2.0 * guess + 10.0, below))
    }

    /// Mean of the square root of the variable: `sqrt(2) Gamma((d + 1) / 2) / Gamma(d / 2)`.
    pub fn mean_of_root(self) -> f64 {
        let d = self.degrees_of_freedom;
        std::f64::consts::SQRT_2 * libm::exp(libm::lgamma(0.5 * (d + 1.0)) - libm::lgamma(0.5 * d))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_those_of_closed_forms() {
        // With two degrees of freedom the tail is exp(-x / 2).
        for tail in [0.3, 1e-3, 1e-6] {
            let exact = -2.0 * libm::log(tail);
            assert!((ChiSquare::new(2).quantile(1.0 - tail) / exact - 1.0).abs() < 1e-8, "{tail}");
        }
    }

    #[test]
    fn students_quantiles_of_what_is_rare_are_those_of_closed_forms() {
        for rare in [1e-3, 1e-5, 1e-6, 1e-7, 1e-10, 1e-14, 1e-16, 1e-30, 1e-100] {
            let of_one = 1.0 / libm::tan(0.5 * std::f64::consts::PI * rare);
            assert!((student_two_sided(rare, 1.0) / of_one - 1.0).abs() < 1e-8, "{rare}");
        }
        for rare in [1e-3_f64, 1e-7, 1e-14, 1e-16, 1e-30, 1e-100] {
            let of_two = (2.0 / (rare * (2.0 - rare)) - 2.0).sqrt();
            assert!((student_two_sided(rare, 2.0) / of_two - 1.0).abs() < 1e-8, "{rare}");
        }
        for freedom in [5.0, 5000.0, f64::INFINITY] {
            assert_eq!(student_two_sided(0.0, freedom), f64::INFINITY);
        }
        assert_eq!(student_two_sided(0.05, 0.0), f64::INFINITY);
    }

    #[test]
    fn what_is_no_probability_has_no_quantile() {
        for p in [f64::NAN, -0.1, 1.1] {
            let quantiles = [
                normal_quantile(p),
                ChiSquare::new(3).quantile(p),
                student_two_sided(p, 5.0),
                student_two_sided(p, 5000.0),
            ];
            assert!(quantiles.iter().all(|quantile| quantile.is_nan()), "{p}: {quantiles:?}");
        }
        assert!(student_two_sided(0.05, f64::NAN).is_nan());
        assert_eq!([0.0, 1.0].map(normal_quantile), [f64::NEG_INFINITY, f64::INFINITY]);
        assert_eq!([0.0, 1.0].map(|p| ChiSquare::new(3).quantile(p)), [0.0, f64::INFINITY]);
    }

    #[test]
    fn tabulated_values_are_met() {
        // Abramowitz & Stegun 1964, tables 26.1 and 26.8.
        assert!((normal_two_sided(0.05) - 1.959_963_985).abs() < 1e-8);
        assert!((ChiSquare::new(6).quantile(0.95) - 12.591_587).abs() < 1e-5);
        assert!((ChiSquare::new(6).survival(9.0) - 0.173_578_1).abs() < 1e-6);
        assert!((ChiSquare::new(1).quantile(0.99) - 6.634_897).abs() < 1e-5);
        assert!((ChiSquare::new(474).quantile(0.5) - 473.333).abs() < 1e-2);
        // Table 26.9: F of 6 and 30 degrees of freedom exceeds 2.42 with probability 5 %, to its three
        // digits.
        assert!((fisher_cdf(2.4205, 6, 30) - 0.95).abs() < 1e-4);
        assert!(fisher_cdf(1.0, 0, 5).is_nan());
    }

    #[test]
    fn quantile_and_distribution_function_are_inverse() {
        for d in [1, 2, 6, 63, 474, 5000] {
            for p in [1e-6, 0.01, 0.5, 0.99, 0.999_999] {
                let x = ChiSquare::new(d).quantile(p);
                assert!((ChiSquare::new(d).cdf(x) - p).abs() < 1e-8, "d {d} p {p}");
            }
        }
    }

    #[test]
    fn rounding_keeps_the_leading_digits() {
        assert_eq!(round_significant(123.456_789, 4), 123.5);
        assert_eq!(round_significant(-0.001_234_56, 3), -0.001_23);
        assert_eq!(round_significant(9.999_6e20, 4), 1e21);
        assert_eq!(round_significant(0.0, 4), 0.0);
    }

    #[test]
    fn the_mean_of_a_chi_variable_is_the_known_one() {
        // One degree of freedom: half-normal, sqrt(2 / pi). Large d: sqrt(d - 1/2) to 1 / (16 d^1.5).
        assert!((ChiSquare::new(1).mean_of_root() - (2.0 / std::f64::consts::PI).sqrt()).abs() < 1e-14);
        assert!((ChiSquare::new(474).mean_of_root() - 473.5f64.sqrt()).abs() < 1e-4);
    }
}
