//! What do many values say together, and how much of that is chance?
//!
//! Sums run in the order of the values, so that the bits repeat. The intervals are those of
//! [`calibench::evaluate::interval`]; they stand here too, so that an experiment finds its statistics in one
//! place.

pub use calibench::evaluate::distribution::{normal_cdf, normal_quantile, normal_two_sided};
pub use calibench::evaluate::interval::{Interval, each_of};

/// Arithmetic mean; NaN of nothing.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Root of the mean square; NaN of nothing.
pub fn root_mean_square(values: impl IntoIterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for value in values {
        sum += value * value;
        count += 1;
    }
    (sum / count as f64).sqrt()
}

/// The value below which a share `p` lies: the smallest with at least that many at or below it. NaN of
/// nothing.
pub fn quantile(values: &[f64], p: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let index = ((p * sorted.len() as f64).ceil() as usize).clamp(1, sorted.len().max(1)) - 1;
    sorted.get(index).copied().unwrap_or(f64::NAN)
}

/// Half of the values lie at or below it; of an even number the lower of the two in the middle. NaN of
/// nothing.
pub fn median(values: &[f64]) -> f64 {
    quantile(values, 0.5)
}

/// The largest value; minus infinity of nothing. NaN does not count.
pub fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(f64::NEG_INFINITY, f64::max)
}

/// The smallest value; infinity of nothing. NaN does not count.
pub fn smallest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(f64::INFINITY, f64::min)
}

/// Slope of the regression line of `y` on `x`; NaN where all `x` are equal.
pub fn slope(x: &[f64], y: &[f64]) -> f64 {
    let (mean_x, mean_y) = (mean(x), mean(y));
    let xy: f64 = x.iter().zip(y).map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    xy / x.iter().map(|x| (x - mean_x) * (x - mean_x)).sum::<f64>()
}

/// Correlation of two quantities whose means are known to be zero; NaN of nothing.
pub fn correlation_about_zero(pairs: impl IntoIterator<Item = (f64, f64)>) -> f64 {
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (x, y) in pairs {
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    xy / (xx * yy).sqrt()
}

/// Share of the items that fulfil a condition; NaN of nothing.
pub fn share<T>(items: &[T], condition: impl Fn(&T) -> bool) -> f64 {
    items.iter().filter(|item| condition(item)).count() as f64 / items.len() as f64
}

/// Largest distance between the distribution of a sample and a predicted one (Kolmogorov 1933).
pub fn kolmogorov_distance(values: &[f64], predicted_cdf: impl Fn(f64) -> f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let step = |i: usize| i as f64 / sorted.len() as f64;
    let probabilities = sorted.iter().map(|&v| predicted_cdf(v)).enumerate();
    probabilities.fold(0.0f64, |most, (i, p)| most.max(p - step(i)).max(step(i + 1) - p))
}

/// The Kolmogorov distance that a sample of `count` values of the predicted distribution exceeds with
/// probability below `false_alarm`: `2 exp(-2 n d^2)` (Massart 1990).
pub fn kolmogorov_limit(count: usize, false_alarm: f64) -> f64 {
    (libm::log(2.0 / false_alarm) / (2.0 * count as f64)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_and_slopes_are_those_of_the_definition() {
        assert_eq!(mean(&[1.0, 2.0, 6.0]), 3.0);
        assert_eq!(root_mean_square([3.0, -4.0]), 12.5f64.sqrt());
        assert_eq!(slope(&[0.0, 1.0, 2.0], &[1.0, 3.0, 5.0]), 2.0);
        // 1 - 2 + 2 over the root of 9 x 6, by hand.
        let pairs = [(1.0, 1.0), (-2.0, 1.0), (2.0, 1.0), (0.0, 3f64.sqrt())];
        assert!((correlation_about_zero(pairs) - 1.0 / 54f64.sqrt()).abs() < 1e-15);
        assert!(mean(&[]).is_nan() && slope(&[1.0, 1.0], &[0.0, 1.0]).is_nan());
    }

    #[test]
    fn a_quantile_has_its_share_at_or_below_it() {
        let values = [5.0, 1.0, 4.0, 2.0, 3.0];
        assert_eq!([0.0, 0.2, 0.21, 0.5, 1.0].map(|p| quantile(&values, p)), [1.0, 1.0, 2.0, 3.0, 5.0]);
        assert!(median(&[]).is_nan());
        assert_eq!((largest(values), smallest(values), share(&values, |v| *v > 3.0)), (5.0, 1.0, 0.4));
    }

    #[test]
    fn the_kolmogorov_distance_is_seen_from_both_sides_of_a_step() {
        // One value at the middle of a uniform distribution: the step from 0 to 1 passes 1/2.
        assert_eq!(kolmogorov_distance(&[0.5], |v| v), 0.5);
        assert_eq!(kolmogorov_distance(&[0.25, 0.75], |v| v), 0.25);
        // Tables for large n: 1.63 / sqrt(n) at 1 %; Massart's bound is that up to a per cent.
        assert!((kolmogorov_limit(10_000, 0.01) - 0.0163).abs() < 1e-4);
    }
}
