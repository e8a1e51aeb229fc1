//! Which value do a given share of many values stay below? Quantiles from counts, with bounded memory and a
//! bounded error.

use std::collections::BTreeMap;

/// Counts of values in buckets of geometric width (Masson, Rim & Lee 2019, "DDSketch"). A quantile is known
/// to a relative error of [`Sketch::RELATIVE_ERROR`]; counts are integers, so neither order nor grouping of
/// the values matters.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Sketch {
    /// Bucket, negative values below positive ones.
    counts: BTreeMap<i32, u64>,
    total: u64,
}

/// Sizes beyond `10^+-12` count as these: no error of a calibration means anything there.
const LARGEST: f64 = 1e12;

impl Sketch {
    /// Half a percent: below the sampling error of the quantiles of ten thousand values.
    pub const RELATIVE_ERROR: f64 = 0.005;

    /// Adds a value.
    pub fn add(&mut self, x: f64) {
        *self.counts.entry(bucket(x)).or_default() += 1;
        self.total += 1;
    }

    /// Adds all values of another sketch.
    pub fn merge(&mut self, other: &Sketch) {
        for (&bucket, &count) in &other.counts {
            *self.counts.entry(bucket).or_default() += count;
        }
        self.total += other.total;
    }

    /// The value of a rank, 1 the least; `None` beyond the number of values.
    pub fn of_rank(&self, rank: u64) -> Option<f64> {
        if rank == 0 || rank > self.total {
            return None;
        }
        let mut below = 0;
        self.counts.iter().find_map(|(&bucket, &count)| {
            below += count;
            (below >= rank).then(|| middle(bucket))
        })
    }

    /// Number of values.
    pub fn total(&self) -> u64 {
        self.total
    }
}

fn gamma() -> f64 {
    (1.0 + Sketch::RELATIVE_ERROR) / (1.0 - Sketch::RELATIVE_ERROR)
}

/// Bucket 0 holds zero and what is smaller than `1 / LARGEST`.
fn bucket(x: f64) -> i32 {
    let size = x.abs().min(LARGEST);
    if size * LARGEST < 1.0 {
        return 0;
    }
    let step = libm::ceil(libm::log(size * LARGEST) / libm::log(gamma())) as i32 + 1;
    if x < 0.0 { -step } else { step }
}

/// The value of a bucket that is nowhere farther than the relative error from its members.
fn middle(bucket: i32) -> f64 {
    if bucket == 0 {
        return 0.0;
    }
    let upper = libm::exp(f64::from(bucket.abs() - 1) * libm::log(gamma())) / LARGEST;
    let value = upper * (1.0 - Sketch::RELATIVE_ERROR);
    if bucket < 0 { -value } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rank_is_within_the_stated_error() {
        let values: Vec<f64> = (-500..=1500).map(|i| f64::from(i) * 1.7e-3).collect();
        let mut sketch = Sketch::default();
        values.iter().rev().for_each(|v| sketch.add(*v));
        for (i, value) in values.iter().enumerate() {
            let found = sketch.of_rank(i as u64 + 1).unwrap();
            // The logarithm may put a value at the edge of its bucket into the next: rounding on top of the
            // error.
            assert!(
                (found - value).abs() <= 1.000_001 * Sketch::RELATIVE_ERROR * value.abs(),
                "{value} {found}"
            );
        }
        assert_eq!(sketch.of_rank(0), None);
        assert_eq!(sketch.of_rank(values.len() as u64 + 1), None);
    }

    #[test]
    fn neither_order_nor_grouping_matters() {
        let mut whole = Sketch::default();
        let (mut a, mut b) = (Sketch::default(), Sketch::default());
        for i in 0..1000 {
            let x = libm::sin(f64::from(i)) * libm::exp(f64::from(i % 40) - 20.0);
            whole.add(x);
            if i % 3 == 0 { a.add(x) } else { b.add(x) }
        }
        b.merge(&a);
        assert_eq!(b, whole);
    }

    #[test]
    fn a_value_of_the_least_size_is_told_and_what_is_smaller_is_zero() {
        let only = |x: f64| {
            let mut sketch = Sketch::default();
            sketch.add(x);
            sketch.of_rank(1).unwrap()
        };
        assert!((only(1e-12) / 1e-12 - 1.0).abs() < 0.0051 && (only(-1e-12) / -1e-12 - 1.0).abs() < 0.0051);
        assert_eq!((only(0.99e-12), only(0.0)), (0.0, 0.0));
    }
}
