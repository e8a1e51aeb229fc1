//! What if sixteen digits are not enough? Numbers of some 31 digits: a sum of two doubles that do not
//! overlap.
//!
//! Sums and products as Dekker (1971), "A floating-point technique for extending the available precision";
//! sum of two such numbers, quotient and root as Hida, Li & Bailey (2001), "Algorithms for quad-double
//! precision floating point arithmetic", whose relative errors are a few times 2^-104. Only IEEE operations
//! of doubles, none fused: the same bits on every machine.
//!
//! Domain: magnitudes from 1e-140 to 1e140, within which no partial product over- or underflows.

use super::lanes::Arithmetic;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// `high + low`, with `|low|` at most half the last digit of `high`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct DoubleDouble {
    high: f64,
    low: f64,
}

/// `a + b` and what rounding left of it.
fn exact_sum(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    let of_b = sum - a;
    (sum, (a - (sum - of_b)) + (b - of_b))
}

/// The same for `|a| >= |b|`.
fn exact_sum_ordered(a: f64, b: f64) -> (f64, f64) {
    let sum = a + b;
    (sum, b - (sum - a))
}

/// Upper and lower half of the digits.
fn halves(a: f64) -> (f64, f64) {
    // 2^27 + 1
    let scaled = 134_217_729.0 * a;
    let high = scaled - (scaled - a);
    (high, a - high)
}

/// `a b` and what rounding left of it.
fn exact_product(a: f64, b: f64) -> (f64, f64) {
    let product = a * b;
    let ((a1, a2), (b1, b2)) = (halves(a), halves(b));
    (product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2)
}

fn normalised((high, low): (f64, f64)) -> DoubleDouble {
    let (high, low) = exact_sum_ordered(high, low);
    DoubleDouble { high, low }
}

impl DoubleDouble {
    /// 0.
    pub const ZERO: DoubleDouble = DoubleDouble { high: 0.0, low: 0.0 };
    /// 1.
    pub const ONE: DoubleDouble = DoubleDouble { high: 1.0, low: 0.0 };

    /// The nearest double.
    pub fn to_f64(self) -> f64 {
        self.high
    }

    /// Whether it is greater than 0; NaN is not.
    pub fn is_positive(self) -> bool {
        self.high > 0.0
    }

    /// The square root; NaN below 0.
    pub fn sqrt(self) -> DoubleDouble {
        if self.high == 0.0 {
            return self;
        }
        // One Newton step from the root of the upper part doubles its digits.
        let root = DoubleDouble::from(self.high.sqrt());
        root + (self - root * root) / (root + root)
    }
}

impl From<f64> for DoubleDouble {
    fn from(high: f64) -> DoubleDouble {
        DoubleDouble { high, low: 0.0 }
    }
}

impl Add for DoubleDouble {
    type Output = DoubleDouble;
    fn add(self, other: DoubleDouble) -> DoubleDouble {
        let (high, high_rest) = exact_sum(self.high, other.high);
        let (low, low_rest) = exact_sum(self.low, other.low);
        let (high, rest) = exact_sum_ordered(high, high_rest + low);
        normalised((high, rest + low_rest))
    }
}

impl Neg for DoubleDouble {
    type Output = DoubleDouble;
    fn neg(self) -> DoubleDouble {
        DoubleDouble { high: -self.high, low: -self.low }
    }
}

impl Sub for DoubleDouble {
    type Output = DoubleDouble;
    fn sub(self, other: DoubleDouble) -> DoubleDouble {
        self + -other
    }
}

impl Mul for DoubleDouble {
    type Output = DoubleDouble;
    fn mul(self, other: DoubleDouble) -> DoubleDouble {
        let (product, rest) = exact_product(self.high, other.high);
        normalised((product, rest + (self.high * other.low + self.low * other.high)))
    }
}

impl Div for DoubleDouble {
    type Output = DoubleDouble;
    fn div(self, other: DoubleDouble) -> DoubleDouble {
        // Long division, a double at a time.
        let first = self.high / other.high;
        let rest = self - other * first.into();
        let second = rest.high / other.high;
        let rest = rest - other * second.into();
        let third = rest.high / other.high;
        normalised(exact_sum_ordered(first, second)) + third.into()
    }
}

impl AddAssign for DoubleDouble {
    fn add_assign(&mut self, other: DoubleDouble) {
        *self = *self + other;
    }
}

impl SubAssign for DoubleDouble {
    fn sub_assign(&mut self, other: DoubleDouble) {
        *self = *self - other;
    }
}

impl std::iter::Sum for DoubleDouble {
    fn sum<I: Iterator<Item = DoubleDouble>>(numbers: I) -> DoubleDouble {
        numbers.fold(DoubleDouble::default(), Add::add)
    }
}

impl Arithmetic for DoubleDouble {
    fn splat(value: f64) -> DoubleDouble {
        value.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A number with digits in both parts.
    fn number() -> impl Strategy<Value = DoubleDouble> {
        (-1e6..1e6f64, -1.0..1.0f64).prop_map(|(high, low)| normalised((high, low * 1e-17 * high)))
    }

    /// Some operations of a few times 2^-104.
    const ROUNDING: f64 = 1e-30;

    fn close(a: DoubleDouble, b: DoubleDouble, scale: f64) -> bool {
        (a - b).to_f64().abs() <= ROUNDING * scale
    }

    #[test]
    fn a_third_and_the_root_of_two_have_31_digits() {
        // 1/3 = high + low with high the double below it by 2^-54 / 3.
        let third = DoubleDouble::from(1.0) / DoubleDouble::from(3.0);
        assert_eq!((third.high, third.low), (1.0 / 3.0, 1.850371707708594e-17));
        // sqrt 2 = 1.41421356237309504880168872420969807856967...: the second part is what its double lacks.
        let root = DoubleDouble::from(2.0).sqrt();
        assert_eq!(root.high, std::f64::consts::SQRT_2);
        // 31 digits of the root.
        assert!((root.low - -9.667_293_313_452_913e-17).abs() < 1.4e-31);
    }

    proptest! {
        #[test]
        fn operations_undo_each_other(a in number(), b in number()) {
            prop_assume!(b.high.abs() > 1e-3);
            let (size_a, size_b) = (a.high.abs(), b.high.abs());
            prop_assert!(close(a + b - b, a, size_a + size_b));
            prop_assert!(close(a * b / b, a, size_a));
            let root = (b * b).sqrt();
            let size = if b.is_positive() { b } else { -b };
            prop_assert!(close(root, size, size_b));
        }

        #[test]
        fn products_distribute(a in number(), b in number(), c in number()) {
            let scale = a.high.abs() * (b.high.abs() + c.high.abs());
            prop_assert!(close(a * (b + c), a * b + a * c, scale));
        }

        #[test]
        fn a_product_of_doubles_is_exact(a in -1e6..1e6f64, b in -1e6..1e6f64) {
            let product = DoubleDouble::from(a) * DoubleDouble::from(b);
            prop_assert_eq!(product.high, a * b);
            // In whole numbers: the mantissas' product, 106 bits.
            let whole = |x: f64| (libm::frexp(x).0 * 9_007_199_254_740_992.0) as i128;
            let exponents = libm::frexp(a).1 + libm::frexp(b).1 - 106;
            let scale = |x: f64| libm::ldexp(x, -exponents) as i128;
            prop_assert_eq!(whole(a) * whole(b), scale(product.high) + scale(product.low));
        }
    }
}
