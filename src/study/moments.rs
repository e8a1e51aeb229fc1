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

    /// The mean with its interval (central limit theorem). `None` below two values.
    pub fn mean_interval(&self, false_alarm: f64) -> Option<Estimated> {
        let n = self.count as f64;
        (self.count >= 2).then(|| {
            let half = normal_two_sided(false_alarm) * self.sd() / n.sqrt();
            Estimated { value: self.mean(), low: self.mean() - half, high: self.mean() + half }
        })
    }

    /// The standard deviation with its interval: `ln s^2` is nearly normal with variance
    /// `(kappa - (n - 3)/(n - 1)) / n`, kappa the kurtosis; for normal values `2 / (n - 1)` (Bonett 2006,
    /// without his small-sample constants).
    pub fn sd_interval(&self, false_alarm: f64) -> Option<Estimated> {
        let (n, variance) = (self.count as f64, self.variance());
        if self.count < 4 || variance == 0.0 {
            return None;
        }
        let kurtosis = self.fourth_central() / (variance * variance);
        let relative = ((kurtosis - (n - 3.0) / (n - 1.0)).max(0.0) / n).sqrt();
        Some(log_interval(self.sd(), 0.5 * relative, false_alarm))
    }

    /// The root mean square with its interval, by the same argument about `ln mean(x^2)`.
    pub fn rms_interval(&self, false_alarm: f64) -> Option<Estimated> {
        let square = if self.count == 0 { 0.0 } else { self.raw(2) };
        if self.count < 4 || square == 0.0 {
            return None;
        }
        let relative = ((self.raw(4) / (square * square) - 1.0).max(0.0) / self.count as f64).sqrt();
        Some(log_interval(square.sqrt(), 0.5 * relative, false_alarm))
    }
}

fn log_interval(value: f64, relative_sd: f64, false_alarm: f64) -> Estimated {
    let factor = libm::exp(normal_two_sided(false_alarm) * relative_sd);
    Estimated { value, low: value / factor, high: value * factor }
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

    #[test]
    fn intervals_cover_as_often_as_they_say() {
        // Uniform values: sd 1/sqrt(12), mean 0, kurtosis 1.8, for which an interval that assumes normal
        // values would be too wide.
        let (repeats, draws, truth) = (2000, 300, (1.0f64 / 12.0).sqrt());
        let mut covered = [0usize; 3];
        for trial in 0..repeats {
            let key = StreamKey { seed: 1, scenario: "moments", trial, purpose: "coverage" };
            let mut stream = Stream::open(key);
            let mut moments = Moments::default();
            (0..draws).for_each(|_| moments.add(stream.uniform() - 0.5));
            covered[0] += usize::from(moments.mean_interval(0.05).unwrap().contains(0.0));
            covered[1] += usize::from(moments.sd_interval(0.05).unwrap().contains(truth));
            covered[2] += usize::from(moments.rms_interval(0.05).unwrap().contains(truth));
        }
        // Binomial sd sqrt(0.05 * 0.95 / 2000) = 0.0049; the approximations lose up to half a percent at 300
        // draws. Five sd and that: a false alarm in 1e6.
        for count in covered {
            let share = count as f64 / repeats as f64;
            assert!((share - 0.95).abs() < 0.03, "{covered:?}");
        }
    }
}
