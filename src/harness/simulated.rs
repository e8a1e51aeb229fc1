//! How far may a draw lie from those of a simulation? An interval that assumes nothing but that all come
//! alike.

use super::Predicted;

impl Predicted {
    /// The interval from the `beyond`-th smallest to the `beyond`-th largest of `draws`.
    ///
    /// One more independent draw is equally likely to take each of the `n + 1` places among the `n` draws,
    /// whatever their distribution, so it lies outside with probability exactly `2 beyond / (n + 1)` (Wilks
    /// 1941). Fewer than `2 beyond` draws, or a draw that is NaN, give NaN ends, in which nothing lies.
    pub fn from_draws(draws: &[f64], beyond: usize, what: &str) -> Predicted {
        let n = draws.len();
        let false_alarm_rate = 2.0 * beyond as f64 / (n + 1) as f64;
        let source = format!("{what}, {n} draws");
        let usable = beyond > 0 && 2 * beyond <= n && draws.iter().all(|d| !d.is_nan());
        let (low, high) = if usable {
            let mut sorted = draws.to_vec();
            sorted.sort_by(f64::total_cmp);
            (sorted[beyond - 1], sorted[n - beyond])
        } else {
            (f64::NAN, f64::NAN)
        };
        Predicted::Simulated { low, high, false_alarm_rate, source }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::synth::{Stream, StreamKey};

    #[test]
    fn the_interval_is_left_as_often_as_stated() {
        // Each of 4000 rounds draws 19 numbers and one more, which leaves the range of the 19 with
        // probability 2/20.
        let key = StreamKey { seed: 1, scenario: "from-draws", trial: 0, purpose: "noise" };
        let mut stream = Stream::open(key);
        let rounds = 4000;
        let outside = (0..rounds)
            .filter(|_| {
                let draws: Vec<f64> = (0..19).map(|_| stream.normal()).collect();
                let (low, high) = Predicted::from_draws(&draws, 1, "normal").interval(0.1);
                !(low..=high).contains(&stream.normal())
            })
            .count();
        // 400 +- 5 sqrt(4000 x 0.1 x 0.9) = 95: missed by a right program with probability 6e-7.
        assert!((305..=495).contains(&outside), "{outside}");
    }

    #[test]
    fn ranks_are_counted_from_both_ends() {
        let draws: Vec<f64> = (1..=9).rev().map(f64::from).collect();
        let predicted = Predicted::from_draws(&draws, 2, "ramp");
        assert_eq!((predicted.interval(0.5), predicted.effective_rate(0.5)), ((2.0, 8.0), 0.4));
        let (low, high) = Predicted::from_draws(&draws, 5, "ramp").interval(0.5);
        assert!(low.is_nan() && high.is_nan());
    }
}
