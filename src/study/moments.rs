//! What do many values say, in one pass and little memory? Power sums, and intervals that do not assume a
//! normal distribution.

use calibench::evaluate::distribution::normal_two_sided;

/// Sums of powers about 0; meant for errors, whose mean is small against their spread, or for values of one
/// order of size.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Moments {
    count: u64,
    sums: [f64; 4],
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
        self.count += 1;
        let square = x * x;
        for (sum, term) in self.sums.iter_mut().zip([x, square, square * x, square * square]) {
            *sum += term;
        }
    }

    /// Number of values.
    pub fn count(&self) -> u64 {
        self.count
    }

    fn raw(&self, power: usize) -> f64 {
        self.sums[power - 1] / self.count as f64
    }

    /// Mean.
    pub fn mean(&self) -> f64 {
        self.raw(1)
    }

    /// Unbiased variance.
    fn variance(&self) -> f64 {
        let n = self.count as f64;
        ((self.raw(2) - self.raw(1) * self.raw(1)) * n / (n - 1.0)).max(0.0)
    }

    /// Sample standard deviation; NaN below two values.
    pub fn sd(&self) -> f64 {
        self.variance().sqrt()
    }

    fn fourth_central(&self) -> f64 {
        let m = self.mean();
        self.raw(4) - 4.0 * m * self.raw(3) + 6.0 * m * m * self.raw(2) - 3.0 * m * m * m * m
    }

    /// The mean with its interval, by Student's t. `None` below four values.
    pub fn mean_interval(&self, false_alarm: f64) -> Option<Estimated> {
        let n = self.count as f64;
        (self.count >= FEWEST).then(|| {
            let half = student_two_sided(false_alarm, n - 1.0) * self.sd() / n.sqrt();
            Estimated { value: self.mean(), low: self.mean() - half, high: self.mean() + half }
        })
    }

    /// The standard deviation with its interval, for values that need not be normal (Bonett 2006). `None` below four values.
    pub fn sd_interval(&self, false_alarm: f64) -> Option<Estimated> {
        let (n, variance) = (self.count as f64, self.variance());
        if self.count < FEWEST || variance == 0.0 {
            return None;
        }
        let biased = variance * (n - 1.0) / n;
        let kurtosis = self.fourth_central() / (biased * biased);
        let relative = ((kurtosis - (n - 3.0) / n).max(0.0) / (n - 1.0)).sqrt();
        root_interval(self.sd(), n, relative, false_alarm)
    }

    /// The root mean square with its interval, by the same argument about `ln mean(x^2)`, whose variance is one freedom larger.
    pub fn rms_interval(&self, false_alarm: f64) -> Option<Estimated> {
        let n = self.count as f64;
        let square = if self.count == 0 { 0.0 } else { self.raw(2) };
        if self.count < FEWEST || square == 0.0 {
            return None;
        }
        let kurtosis = self.raw(4) / (square * square);
        let relative = ((kurtosis - (n - 2.0) / n).max(0.0) / (n - 1.0)).sqrt();
        root_interval(square.sqrt(), n, relative, false_alarm)
    }
}

/// The fewest values that an interval is drawn from: below, its estimate of the kurtosis means nothing.
const FEWEST: u64 = 4;

/// The interval of the root of a mean square: `ln(c s^2)` is nearly normal with the standard deviation `c r`, `c = n / (n - z)`, and r the
/// relative standard deviation of `s^2`: after Bonett (Computational Statistics & Data Analysis 50, 2006), with the kurtosis about the mean in
/// place of his trimmed one, which power sums do not have. `None` where z exceeds n.
fn root_interval(value: f64, n: f64, relative: f64, false_alarm: f64) -> Option<Estimated> {
    let z = normal_two_sided(false_alarm);
    let c = n / (n - z);
    let factor = libm::exp(0.5 * z * c * relative);
    (c > 0.0).then(|| Estimated { value, low: value * c.sqrt() / factor, high: value * c.sqrt() * factor })
}

/// The half-width of a two-sided interval that Student's t leaves with probability `false_alarm`, by its expansion about the normal one
/// (Abramowitz & Stegun 1964, 26.7.5): at 0.05 and three degrees of freedom within a hundredth, beyond ten within 1e-4.
fn student_two_sided(false_alarm: f64, freedom: f64) -> f64 {
    let z = normal_two_sided(false_alarm);
    let s = z * z;
    let terms = [
        (s + 1.0) / 4.0,
        ((5.0 * s + 16.0) * s + 3.0) / 96.0,
        (((3.0 * s + 19.0) * s + 17.0) * s - 15.0) / 384.0,
    ];
    z * (1.0 + (terms[0] + (terms[1] + terms[2] / freedom) / freedom) / freedom)
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
        assert!((moments.fourth_central() - 8.5).abs() < 1e-13);
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
        // Binomial sd sqrt(0.05 * 0.95 / 4000) = 0.0034; the approximations lose up to a hundredth at 20 values of a normal law, which an
        // interval without the small-sample terms leaves one time in eight. Five sd and that.
        for draws in [10, 20, 50, 300] {
            let shares = covered(draws, 1.0, Stream::normal);
            assert!(shares.iter().all(|share| (share - 0.95).abs() < 0.028), "{draws}: {shares:?}");
        }
        // Uniform values: kurtosis 1.8, for which an interval that assumes normal values would be too wide.
        let shares = covered(300, (1.0f64 / 12.0).sqrt(), |stream| stream.uniform() - 0.5);
        assert!(shares.iter().all(|share| (share - 0.95).abs() < 0.028), "{shares:?}");
    }

    #[test]
    fn the_expansion_is_students_t() {
        // Tables of the 97.5 % and 99.5 % points.
        for (false_alarm, freedom, table, within) in [
            (0.05, 3.0, 3.1824, 0.03),
            (0.05, 9.0, 2.2622, 1e-3),
            (0.05, 30.0, 2.0423, 1e-4),
            (0.01, 10.0, 3.1693, 5e-3),
        ] {
            let t = student_two_sided(false_alarm, freedom);
            assert!((t - table).abs() < within, "{t} for {table}");
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
}
