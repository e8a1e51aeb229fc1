//! How are many values shown? Counted in bins of equal width, as a density.

/// Bars `(left, right, height)` of `bins` bins between `low` and `high`, for [`super::Plot::histogram`]. The
/// height is the share of all values over the bin's width, so that a predicted density lies on the bars;
/// values outside are in no bar but count as values.
pub fn density(values: &[f64], (low, high): (f64, f64), bins: usize) -> Vec<(f64, f64, f64)> {
    let width = (high - low) / bins as f64;
    let mut counts = vec![0usize; bins];
    for value in values.iter().filter(|v| low <= **v && **v < high) {
        let bin = ((value - low) / width) as usize;
        // The quotient of a value just below `high` may round up to the number of bins.
        counts[bin.min(bins - 1)] += 1;
    }
    let height = |count: usize| count as f64 / (values.len() as f64 * width);
    let edge = |bin: usize| low + width * bin as f64;
    counts.iter().enumerate().map(|(bin, &count)| (edge(bin), edge(bin + 1), height(count))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bars_hold_the_share_of_their_values() {
        let bars = density(&[0.0, 0.1, 0.5, 0.99, 2.0], (0.0, 1.0), 2);
        assert_eq!(bars, [(0.0, 0.5, 0.8), (0.5, 1.0, 0.8)]);
        assert!(density(&[], (0.0, 1.0), 0).is_empty());
    }
}
