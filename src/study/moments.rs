//! What do many values say, in one pass and little memory? Sums of powers about their mean, and intervals
//! that do not assume a normal distribution.

use calibench::evaluate::distribution::{normal_two_sided, student_two_sided};

/// Sums of powers of values about their mean, brought up to date with every value.
///
/// Each value counts by its distance from the first one: values that are nearly equal keep the digits in
/// which they differ, whatever their size, and equal ones have a spread of exactly zero. A distance is
/// rounded to a part in 2^53 of itself, and no distance exceeds sqrt(2 (n - 1)) standard deviations of n
/// values, so that a first value that lies far off costs no digits of the spread either.
///
/// The update is that of Welford (Technometrics 4, 1962) with Pebay's third and fourth powers (Sandia report
/// SAND2008-6212, 2008, eq. 1.5 and 1.6, one value added). The order of the values decides the last bits.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Moments {
    count: u64,
    /// The first value, from which the others are measured.
    first: f64,
    /// Mean of the values less the first.
    mean: f64,
    /// Sums of the second, third and fourth powers of the distances from the mean.
    sums: [f64; 3],
}

/// An estimate with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimated {
    /// The estimate.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Estimated {
    /// Of values that are all equal, or all zero.
    const ZERO: Estimated = Estimated { value: 0.0, low: 0.0, high: 0.0 };

    /// Both ends multiplied; `factor` > 0.
    pub fn scaled(self, factor: f64) -> Estimated {
        Estimated { value: self.value * factor, low: self.low * factor, high: self.high * factor }
    }

    /// Whether `x` lies within, ends included.
    pub fn contains(&self, x: f64) -> bool {
        self.low <= x && x <= self.high
    }
}

impl Moments {
    /// Adds a value.
    pub fn add(&mut self, x: f64) {
        if self.count == 0 {
            self.first = x;
        }
        self.count += 1;
        let n = self.count as f64;
        let delta = (x - self.first) - self.mean;
        let step = delta / n;
        let square = delta * step * (n - 1.0);
        let [second, third, _] = self.sums;
        self.mean += step;
        self.sums[2] +=
            square * step * step * (n * n - 3.0 * n + 3.0) + 6.0 * step * step * second - 4.0 * step * third;
        self.sums[1] += square * step * (n - 2.0) - 3.0 * step * second;
        self.sums[0] += square;
    }

    /// Number of values.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Mean of a power of the distances from the mean; of the second to the fourth.
    fn central(&self, power: usize) -> f64 {
        self.sums[power - 2] / self.count as f64
    }

    /// Mean; NaN without values.
    pub fn mean(&self) -> f64 {
        if self.count == 0 { f64::NAN } else { self.first + self.mean }
    }

    /// Sample standard deviation, the root of the unbiased variance; NaN below two values.
    pub fn sd(&self) -> f64 {
        if self.count < 2 { f64::NAN } else { (self.sums[0] / (self.count as f64 - 1.0)).sqrt() }
    }

    /// Means of the squares and of the fourth powers of the values themselves.
    fn about_zero(&self) -> (f64, f64) {
        let m = self.mean();
        let square = self.central(2) + m * m;
        (square, self.central(4) + 4.0 * m * self.central(3) + 6.0 * m * m * self.central(2) + m * m * m * m)
    }

    /// The mean with its interval, by Student's t. `None` below four values.
    pub fn mean_interval(&self, false_alarm: f64) -> Option<Estimated> {
        let n = self.count as f64;
        (self.count >= FEWEST).then(|| {
            let half = student_two_sided(false_alarm, n - 1.0) * self.sd() / n.sqrt();
            Estimated { value: self.mean(), low: self.mean() - half, high: self.mean() + half }
        })
    }

    /// The standard deviation with its interval, for values that need not be normal (Bonett 2006); that of
    /// equal values is zero, and so are its ends. `None` below four values.
    pub fn sd_interval(&self, false_alarm: f64) -> Option<Estimated> {
        let n = self.count as f64;
        if self.count < FEWEST || self.sums[0] == 0.0 {
            return (self.count >= FEWEST).then_some(Estimated::ZERO);
        }
        let biased = self.central(2);
        let kurtosis = self.central(4) / (biased * biased);
        let relative = ((kurtosis - (n - 3.0) / n).max(0.0) / (n - 1.0)).sqrt();
        root_interval(self.sd(), n, relative, false_alarm)
    }

    /// The root mean square with its interval, by the same argument about `ln mean(x^2)`, whose variance is
    /// one freedom larger; of zeros it is zero. `None` below four values.
    pub fn rms_interval(&self, false_alarm: f64) -> Option<Estimated> {
        let n = self.count as f64;
        let (square, fourth) = self.about_zero();
        if self.count < FEWEST || square == 0.0 {
            return (self.count >= FEWEST).then_some(Estimated::ZERO);
        }
        let kurtosis = fourth / (square * square);
        let relative = ((kurtosis - (n - 2.0) / n).max(0.0) / (n - 1.0)).sqrt();
        root_interval(square.sqrt(), n, relative, false_alarm)
    }
}

/// The fewest values that an interval is drawn from: below, its estimate of the kurtosis means nothing.
const FEWEST: u64 = 4;

/// The interval of the root of a mean square: `ln(c s^2)` is nearly normal with the standard deviation `c r`,
/// `c = n / (n - z)`, and r the relative standard deviation of `s^2`: after Bonett (Computational Statistics
/// & Data Analysis 50, 2006), with the kurtosis about the mean in place of his trimmed one, which power sums
/// do not have. `None` where z exceeds n.
fn root_interval(value: f64, n: f64, relative: f64, false_alarm: f64) -> Option<Estimated> {
    let z = normal_two_sided(false_alarm);
    let c = n / (n - z);
    let factor = libm::exp(0.5 * z * c * relative);
    (c > 0.0).then(|| Estimated { value, low: value * c.sqrt() / factor, high: value * c.sqrt() * factor })
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::synth::{Stream, StreamKey};

    #[test]
    fn moments_are_those_of_the_definition() {
        let mut moments = Moments::default();
        [1.0, 2.0, 4.0, 5.0].iter().for_each(|x| moments.add(*x));
        assert_eq!(moments.mean(), 3.0);
        // (4 + 1 + 1 + 4) / 3
        assert!((moments.sd() - (10.0f64 / 3.0).sqrt()).abs() < 1e-15);
        // (16 + 1 + 1 + 16) / 4
        assert!((moments.central(4) - 8.5).abs() < 1e-13);
        // (1 + 16 + 256 + 625) / 4 and the root of (1 + 4 + 16 + 25) / 4.
        let (square, fourth) = moments.about_zero();
        assert!((square - 11.5).abs() < 1e-13 && (fourth - 224.5).abs() < 1e-12);
    }

    fn of(values: impl IntoIterator<Item = f64>) -> Moments {
        let mut moments = Moments::default();
        values.into_iter().for_each(|x| moments.add(x));
        moments
    }

    #[test]
    fn equal_values_have_no_spread_and_an_interval_that_holds_them() {
        // Their squares round: by sums of powers about zero 25 sevenths have a spread of 4.3e-9.
        for value in [1.0 / 7.0, 0.1, -600.3, 1e9 / 3.0, 1e-12 / 3.0, 0.0] {
            for count in [4, 25, 1000] {
                let moments = of(std::iter::repeat_n(value, count));
                assert_eq!((moments.mean(), moments.sd()), (value, 0.0), "{value}, {count} times");
                assert_eq!(moments.sd_interval(0.05), Some(Estimated::ZERO));
                assert_eq!(moments.mean_interval(0.05), Some(Estimated { value, low: value, high: value }));
                let rms = moments.rms_interval(0.05).unwrap();
                assert!(
                    (rms.value - value.abs()).abs() <= 2.0 * f64::EPSILON * value.abs()
                        && rms.contains(value.abs())
                );
            }
        }
    }

    #[test]
    fn values_that_differ_in_their_last_digits_keep_their_moments() {
        // 0, 1, ..., 9 in steps of 2^-30 about 2^20: all exact. The variance of the first n numbers is n (n +
        // 1) / 12, here 110 / 12; the fourth central moment of a uniform law on n points (n^2 - 1)(3 n^2 - 7)
        // / 240 = 99 * 293 / 240.
        let step = libm::exp2(-30.0);
        for repeats in [1, 100, 10_000] {
            let values = (0..repeats).flat_map(|_| (0..10).map(|i| libm::exp2(20.0) + step * f64::from(i)));
            let moments = of(values);
            let n = 10.0 * f64::from(repeats);
            let variance = 8.25 * n / (n - 1.0);
            assert!((moments.sd() / step / variance.sqrt() - 1.0).abs() < 1e-11, "{}", moments.sd() / step);
            assert!(
                (moments.central(4) / (step * step * step * step) / (99.0 * 293.0 / 240.0) - 1.0).abs()
                    < 1e-10
            );
            assert_eq!(moments.mean(), libm::exp2(20.0) + 4.5 * step);
        }
    }

    #[test]
    fn a_first_value_far_off_costs_no_digits_of_the_spread() {
        // Two values: n = 1 + 99, the mean of squares about the mean is D^2 99 / 100^2, but for the spread of
        // the others.
        let far = 1e8;
        let moments = of(std::iter::once(far).chain(std::iter::repeat_n(0.0, 99)));
        let variance = far * far * 99.0 / 100.0 / 99.0;
        assert!((moments.sd() / variance.sqrt() - 1.0).abs() < 1e-13);
        assert!((moments.mean() / (far / 100.0) - 1.0).abs() < 1e-13);
    }

    #[test]
    fn below_two_values_there_is_no_spread_and_without_values_no_mean() {
        assert!(of([]).mean().is_nan() && of([]).sd().is_nan());
        assert!(of([0.3]).mean() == 0.3 && of([0.3]).sd().is_nan());
    }

    /// Shares of samples whose intervals of mean, standard deviation and root mean square hold the true ones.
    fn covered(draws: usize, sd: f64, draw: impl Fn(&mut Stream) -> f64) -> [f64; 3] {
        const REPEATS: u64 = 4000;
        let mut covered = [0.0; 3];
        for trial in 0..REPEATS {
            let mut stream =
                Stream::open(StreamKey { seed: 1, scenario: "moments", trial, purpose: "coverage" });
            let mut moments = Moments::default();
            (0..draws).for_each(|_| moments.add(draw(&mut stream)));
            let intervals =
                [moments.mean_interval(0.05), moments.sd_interval(0.05), moments.rms_interval(0.05)];
            for ((share, interval), truth) in covered.iter_mut().zip(intervals).zip([0.0, sd, sd]) {
                *share += f64::from(u8::from(interval.unwrap().contains(truth))) / REPEATS as f64;
            }
        }
        covered
    }

    #[test]
    fn intervals_cover_as_often_as_they_say() {
        // Binomial sd sqrt(0.05 * 0.95 / 4000) = 0.0034; the approximations lose up to a hundredth at 20
        // values of a normal law, which an interval without the small-sample terms leaves one time in eight.
        // Five sd and that.
        for draws in [10, 20, 50, 300] {
            let shares = covered(draws, 1.0, Stream::normal);
            assert!(shares.iter().all(|share| (share - 0.95).abs() < 0.028), "{draws}: {shares:?}");
        }
        // Uniform values: kurtosis 1.8, for which an interval that assumes normal values would be too wide.
        let shares = covered(300, (1.0f64 / 12.0).sqrt(), |stream| stream.uniform() - 0.5);
        assert!(shares.iter().all(|share| (share - 0.95).abs() < 0.028), "{shares:?}");
    }

    #[test]
    fn the_interval_of_a_mean_is_as_wide_as_students_t_says() {
        // Tables of the 97.5 % point with three and nine degrees of freedom.
        for (count, t) in [(4, 3.182_446), (10, 2.262_157)] {
            let moments = of((0..count).map(f64::from));
            let interval = moments.mean_interval(0.05).unwrap();
            let half = t * moments.sd() / f64::from(count).sqrt();
            assert!((0.5 * (interval.high - interval.low) / half - 1.0).abs() < 1e-6, "{interval:?}");
        }
    }

    #[test]
    fn there_is_no_interval_below_four_values_nor_where_the_normal_quantile_exceeds_their_number() {
        let mut moments = Moments::default();
        [0.3, -0.5, 0.1].iter().for_each(|x| moments.add(*x));
        assert_eq!((moments.mean_interval(0.05), moments.sd_interval(0.05)), (None, None));
        moments.add(0.7);
        assert!(moments.sd_interval(0.05).is_some() && moments.sd_interval(1e-6).is_none());
    }

    #[test]
    fn moments_of_values_that_lean_to_one_side_are_those_of_the_definition() {
        // About their mean of 4: -3, -2, -1 and 6.
        let moments = of([1.0, 2.0, 3.0, 10.0]);
        assert!((moments.central(2) - 12.5).abs() < 1e-13);
        assert!((moments.central(3) - 45.0).abs() < 1e-12);
        assert!((moments.central(4) - 348.5).abs() < 1e-11);
        // 1 + 4 + 9 + 100 and 1 + 16 + 81 + 10 000, over four.
        let (square, fourth) = moments.about_zero();
        assert!((square - 28.5).abs() < 1e-13 && (fourth - 2524.5).abs() < 1e-10, "{square} {fourth}");
    }

    #[test]
    fn intervals_of_a_spread_are_bonetts_with_the_kurtosis_of_the_values() {
        let near = |found: Option<Estimated>, [value, low, high]: [f64; 3]| {
            let found = found.unwrap();
            let part = |x: f64, y: f64| (x / y - 1.0).abs() < 1e-9;
            assert!(
                part(found.value, value) && part(found.low, low) && part(found.high, high),
                "{found:?} for {value} {low} {high}"
            );
        };
        // Four ones and a six: kurtosis 52 / 4^2 = 3.25 about the mean, 260 / 8^2 = 4.0625 about zero. With z
        // = 1.959964, c = 5 / (5 - z) and r^2 = (kurtosis - 2 / 5) / 4 or (kurtosis - 3 / 5) / 4 the ends are
        // value sqrt(c) exp(-+ z c r / 2).
        let moments = of([1.0, 1.0, 1.0, 1.0, 6.0]);
        near(moments.sd_interval(0.05), [2.236_067_977_5, 0.735_645_466_993, 11.178_736_433_65]);
        near(moments.rms_interval(0.05), [2.828_427_124_746, 0.809_700_437_449_9, 16.250_131_833_989]);
        // Ten times +-1: both kurtoses are 1.
        let signs = of((0..20).map(|i| [1.0, -1.0][i % 2]));
        near(signs.sd_interval(0.05), [1.025_978_352_085, 0.980_867_595_256_6, 1.189_757_916_088_6]);
        near(signs.rms_interval(0.05), [1.0, 0.973_117_778_142_2, 1.139_271_382_856_9]);
    }

    #[test]
    fn an_interval_is_scaled_with_its_value() {
        let scaled = Estimated { value: 3.0, low: 2.0, high: 5.0 }.scaled(0.5);
        assert_eq!(scaled, Estimated { value: 1.5, low: 1.0, high: 2.5 });
    }

    #[test]
    fn two_values_spread_by_half_the_square_of_their_distance() {
        // (1.5^2 + 1.5^2) / 1
        assert!((of([1.0, 4.0]).sd() - 4.5f64.sqrt()).abs() < 1e-15);
    }
}
