//! How is a sum of squares distributed whose terms are not equally uncertain, over a variance that is
//! estimated?
//!
//! ```text
//! F = (sum_k lambda_k X_k) / (Y / nu),   X_k chi-squared with h_k degrees of freedom, Y with nu, all independent
//! P(F > x) = P(sum_k lambda_k X_k - (x / nu) Y > 0)
//! ```
//! The right side is the tail of a quadratic form in normal variables, which its characteristic function
//! gives by one integral (Imhof 1961), summed as by Davies (1980).

/// Terms of the sum that are left out are smaller than this together.
const LEFT_OUT: f64 = 1e-10;
/// The sum repeats the form's distribution at distances of this many standard deviations: beyond, even a
/// single chi-squared variable has a probability of 1e-18.
const PERIOD_SD: f64 = 60.0;
/// Terms at most; forms with four degrees of freedom and more need fewer.
const MOST_TERMS: usize = 1_000_000;
/// Halvings of an interval: its ends then agree to ten digits, which is what the tail is known to.
const HALVINGS: usize = 34;

/// Probabilities are known to a tenth of this.
const LEAST_TAIL: f64 = 1e-8;

/// The distribution of `F`.
#[derive(Debug, Clone, PartialEq)]
pub struct Ratio {
    /// `lambda_k` and `h_k`.
    terms: Vec<(f64, f64)>,
    /// `nu`; `None` where the variance is known.
    noise_freedom: Option<usize>,
}

impl Ratio {
    /// Of terms `(lambda, degrees of freedom)`, positive both, over a variance with so many degrees of
    /// freedom, or over a known one.
    pub fn new(terms: Vec<(f64, f64)>, noise_freedom: Option<usize>) -> Ratio {
        Ratio { terms, noise_freedom }
    }

    /// `sum lambda_k h_k`: what the numerator is on average, and F but for its denominator.
    pub fn mean_of_numerator(&self) -> f64 {
        self.terms.iter().map(|(lambda, freedom)| lambda * freedom).sum()
    }

    /// `P(F > x)`, to about 1e-9. Domain: `x` finite.
    ///
    /// ```
    /// use calibench::distribution::fisher_tail;
    /// use calibench::validate::Ratio;
    ///
    /// // Terms of one size are Fisher's F, times its degrees of freedom.
    /// let equal = Ratio::new(vec![(1.0, 4.0), (1.0, 2.0)], Some(30));
    /// assert!((equal.tail(6.0 * 2.5) - fisher_tail(2.5, 6, 30)).abs() < 1e-9);
    /// ```
    pub fn tail(&self, x: f64) -> f64 {
        // The form `sum lambda X - c`, or `sum lambda X - (x / nu) Y`, against 0.
        let (mut form, shift) = (self.terms.clone(), if self.noise_freedom.is_none() { x } else { 0.0 });
        if let Some(freedom) = self.noise_freedom {
            form.push((-x / freedom.max(1) as f64, freedom.max(1) as f64));
        }
        let mean: f64 = form.iter().map(|(lambda, freedom)| lambda * freedom).sum::<f64>() - shift;
        let sd = form.iter().map(|(lambda, freedom)| 2.0 * lambda * lambda * freedom).sum::<f64>().sqrt();
        let period = mean.abs() + PERIOD_SD * sd;
        let step = 2.0 * std::f64::consts::PI / period;
        let mut sum = 0.0;
        for k in 0..MOST_TERMS {
            let u = (k as f64 + 0.5) * step;
            let (mut angle, mut log_size) = (-u * shift, 0.0);
            for (lambda, freedom) in &form {
                let twice = 2.0 * lambda * u;
                angle += 0.5 * freedom * libm::atan(twice);
                log_size -= 0.25 * freedom * libm::log1p(twice * twice);
            }
            let size = libm::exp(log_size);
            sum += size * libm::sin(angle) / (std::f64::consts::PI * (k as f64 + 0.5));
            // What follows is smaller together: sizes fall, and are divided by their number.
            if size < LEFT_OUT {
                break;
            }
        }
        (0.5 + sum).clamp(0.0, 1.0)
    }

    /// The `x` with `P(F > x) = tail`. Domain: `1e-8 <= tail <= 1 - 1e-8`, which is what the tail is known
    /// to; what lies beyond is taken for the nearest of it, and NaN for the least.
    pub fn quantile(&self, tail: f64) -> f64 {
        let tail = if tail.is_nan() { LEAST_TAIL } else { tail.clamp(LEAST_TAIL, 1.0 - LEAST_TAIL) };
        let mut high = self.mean_of_numerator().max(f64::MIN_POSITIVE);
        while self.tail(high) > tail && high < f64::MAX / 4.0 {
            high *= 2.0;
        }
        let mut low = 0.0;
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.tail(middle) > tail {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::distribution::{ChiSquare, fisher_tail};

    #[test]
    fn quantiles_of_what_is_no_probability_are_those_of_the_nearest() {
        let ratio = Ratio::new(vec![(1.0, 4.0), (2.0, 3.0)], Some(30));
        let (least, most) = (ratio.quantile(1e-8), ratio.quantile(1.0 - 1e-8));
        assert!((ratio.tail(least) / 1e-8 - 1.0).abs() < 0.2 && most > 0.0 && most < 0.1, "{least} {most}");
        for beyond in [1e-12, 0.0, -1.0, f64::NAN, f64::NEG_INFINITY] {
            assert_eq!(ratio.quantile(beyond), least, "{beyond}");
        }
        assert_eq!(ratio.quantile(f64::INFINITY), most);
    }

    #[test]
    fn equal_terms_are_chi_squared_and_fisher() {
        for x in [0.5, 3.0, 8.0, 25.0] {
            let known = Ratio::new(vec![(2.0, 3.0), (2.0, 1.0)], None);
            assert!((known.tail(2.0 * x) - ChiSquare::new(4).survival(x)).abs() < 1e-8, "{x}");
            let estimated = Ratio::new(vec![(1.0, 5.0)], Some(9));
            assert!((estimated.tail(x) - fisher_tail(x / 5.0, 5, 9)).abs() < 1e-9, "{x}");
        }
    }

    #[test]
    fn unequal_terms_are_those_of_imhofs_table() {
        // Imhof 1961, table 1: Q = 0.6 chi2_1 + 0.3 chi2_1 + 0.1 chi2_1, and the same with twice the degrees.
        let form = |h: f64| Ratio::new(vec![(0.6, h), (0.3, h), (0.1, h)], None);
        for (freedom, x, tail) in [(2.0, 0.2, 0.9936), (2.0, 2.0, 0.3998), (2.0, 6.0, 0.0161)] {
            assert!((form(freedom).tail(x) - tail).abs() < 6e-5, "{freedom} {x}: {}", form(freedom).tail(x));
        }
    }

    #[test]
    fn a_quantile_has_its_tail() {
        let ratio = Ratio::new(vec![(7.0, 2.0), (1.0, 100.0)], Some(400));
        for tail in [0.995, 0.3, 0.005] {
            assert!((ratio.tail(ratio.quantile(tail)) - tail).abs() < 1e-9, "{tail}");
        }
    }
}
