//! How likely is the evidence if the solver is right? p-values that are right for any number of problems.

use calibench::evaluate::distribution::{ChiSquare, normal_cdf, wilson_hilferty};
use statrs::distribution::{Binomial, ContinuousCDF, DiscreteCDF, FisherSnedecor, Normal};

/// Above this many degrees of freedom the cube root of a chi-squared variable is normal to 1e-5 in
/// probability, and the series of the incomplete gamma function would take thousands of terms.
const WILSON_HILFERTY: usize = 20_000;

/// Chance that a normal variable is at least `|z|` from zero.
pub fn normal(z: f64) -> f64 {
    if z.is_nan() { 0.0 } else { (2.0 * normal_cdf(-z.abs())).min(1.0) }
}

/// Chance that a sum of squares of `freedom` standard normal variables exceeds `x`.
pub fn above(x: f64, freedom: usize) -> f64 {
    if !x.is_finite() {
        return 0.0;
    }
    if freedom > WILSON_HILFERTY {
        normal_cdf(-wilson_hilferty(x, freedom as f64))
    } else {
        ChiSquare::new(freedom).survival(x)
    }
}

/// Chance that it lies at least as far from its middle, both sides counted.
pub fn both_sides(x: f64, freedom: usize) -> f64 {
    if !x.is_finite() {
        return 0.0;
    }
    if freedom > WILSON_HILFERTY {
        return normal(wilson_hilferty(x, freedom as f64));
    }
    let chi = ChiSquare::new(freedom);
    (2.0 * chi.cdf(x).min(chi.survival(x))).min(1.0)
}

/// The normal score of an F-distributed value; within +-8.
pub fn normal_score_of_f(x: f64, above: usize, below: usize) -> f64 {
    const LARGEST: f64 = 8.0;
    let Ok(f) = FisherSnedecor::new(above as f64, below as f64) else { return 0.0 };
    if !x.is_finite() {
        return LARGEST;
    }
    let x = x.max(0.0);
    let (low, high) = (f.cdf(x), f.sf(x));
    let standard = Normal::standard();
    // The smaller tail keeps its digits.
    let score = if low < high { standard.inverse_cdf(low) } else { -standard.inverse_cdf(high) };
    if score.is_nan() { LARGEST } else { score.clamp(-LARGEST, LARGEST) }
}

/// Chance that an F-distributed value exceeds `x`.
pub fn above_f(x: f64, above: usize, below: usize) -> f64 {
    match FisherSnedecor::new(above as f64, below as f64) {
        Ok(f) if x.is_finite() => f.sf(x.max(0.0)),
        _ => 0.0,
    }
}

/// Chance of at least `count` among `trials` where each happens with `rate`.
pub fn at_least(count: usize, trials: usize, rate: f64) -> f64 {
    if count == 0 {
        return 1.0;
    }
    Binomial::new(rate, trials as u64).map_or(1.0, |b| b.sf(count as u64 - 1))
}

/// The chance that the smallest of `count` p-values is this small (Bonferroni).
pub fn smallest_of(count: usize, p: f64) -> f64 {
    (count as f64 * p).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_agree_where_the_two_ways_meet() {
        let n = WILSON_HILFERTY;
        for z in [-4.0, -1.0, 2.0, 4.5] {
            let x = n as f64 + z * (2.0 * n as f64).sqrt();
            let (exact, approximate) = (both_sides(x, n), normal(wilson_hilferty(x, n as f64)));
            assert!((exact / approximate - 1.0).abs() < 1e-2, "{z}: {exact} {approximate}");
        }
    }

    #[test]
    fn the_score_of_the_median_is_zero_and_rises() {
        assert!(normal_score_of_f(1.0, 40, 40).abs() < 1e-9);
        assert!(normal_score_of_f(30.0, 6, 474) > normal_score_of_f(2.0, 6, 474));
        assert_eq!(normal_score_of_f(f64::INFINITY, 6, 474), 8.0);
    }

    #[test]
    fn a_binomial_tail_counts_from_the_number_itself() {
        assert!((at_least(1, 2, 0.5) - 0.75).abs() < 1e-12);
        assert_eq!(at_least(0, 10, 0.1), 1.0);
    }

    fn near(found: f64, expected: f64) {
        assert!((found / expected - 1.0).abs() < 1e-6, "{found} for {expected}");
    }

    #[test]
    fn tails_of_two_degrees_of_freedom_are_exponentials() {
        for x in [0.1, 1.0, 2.0, 9.0, 40.0] {
            let above_x = libm::exp(-0.5 * x);
            near(above(x, 2), above_x);
            near(both_sides(x, 2), 2.0 * above_x.min(1.0 - above_x));
            // Of F with two and two 1 / (1 + x) lies above.
            near(above_f(x, 2, 2), 1.0 / (1.0 + x));
        }
        assert_eq!((above(f64::INFINITY, 2), both_sides(f64::NAN, 2)), (0.0, 0.0));
        assert_eq!((above_f(f64::INFINITY, 2, 2), above_f(-1.0, 2, 2)), (0.0, 1.0));
    }

    #[test]
    fn normal_tails_count_both_sides_and_scores_are_their_inverse() {
        near(normal(1.959_963_985), 0.05);
        near(normal(-2.575_829_304), 0.01);
        assert_eq!((normal(0.0), normal(f64::NAN)), (1.0, 0.0));
        // Below 19 and 1 / 19 lie 0.95 and 0.05 of F with two and two.
        near(normal_score_of_f(19.0, 2, 2), 1.644_853_627);
        near(normal_score_of_f(1.0 / 19.0, 2, 2), -1.644_853_627);
    }

    #[test]
    fn the_smallest_of_several_is_as_likely_as_their_number_makes_it() {
        assert!((smallest_of(3, 0.1) - 0.3).abs() < 1e-15 && smallest_of(1, 0.1) == 0.1);
        assert_eq!((smallest_of(20, 0.1), smallest_of(0, 0.5)), (1.0, 0.0));
    }

    #[test]
    fn many_degrees_of_freedom_have_normal_tails() {
        // Mean n and variance 2 n, skewed by a hundredth at two standard deviations.
        let n = 2 * WILSON_HILFERTY;
        let x = n as f64 + 2.0 * (2.0 * n as f64).sqrt();
        assert!((above(x, n) / 0.022_750 - 1.0).abs() < 0.03, "{}", above(x, n));
        assert!((both_sides(x, n) / 0.045_500 - 1.0).abs() < 0.03, "{}", both_sides(x, n));
    }
}
