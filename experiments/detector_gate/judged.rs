//! What do the photographs of a scene say of a program? Shares and errors, each with its interval.

use super::row::Row;
use calibench::evaluate::Interval;
use calibench_detector_gate::{Marks, Outcome, Scene};
use calibench_harness::stats;
use statrs::distribution::{ContinuousCDF, StudentsT};
use statrs::function::beta::beta_reg;

/// A number with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// What was found.
    pub value: f64,
    /// Where the true one is.
    pub interval: Interval,
}

/// A scene as a program was shown it.
pub struct Judged<'a> {
    /// The scene.
    pub scene: Scene,
    outcomes: Vec<&'a Outcome>,
}

impl<'a> Judged<'a> {
    /// Of all rows of a program those of the scene.
    pub fn new(scene: Scene, rows: &'a [Row]) -> Judged<'a> {
        let is_here = |row: &&Row| row.kind == scene.kind && row.scene == scene.id;
        Judged { scene, outcomes: rows.iter().filter(is_here).map(|row| &row.outcome).collect() }
    }

    fn count(&self, condition: impl Fn(&Outcome) -> bool) -> usize {
        self.outcomes.iter().filter(|outcome| condition(outcome)).count()
    }

    /// Photographs shown.
    pub fn photos(&self) -> usize {
        self.outcomes.len()
    }

    /// Boards answered, whether there is one or not.
    pub fn boards(&self) -> usize {
        self.count(Outcome::is_board)
    }

    /// Answers that break the protocol.
    pub fn broken(&self) -> usize {
        self.count(|outcome| *outcome == Outcome::Broken)
    }

    /// Boards with a mark at another's place.
    pub fn wrong(&self) -> usize {
        self.count(|outcome| matches!(outcome, Outcome::Found(marks) if marks.confused > 0))
    }

    /// Boards that are numbered as in a mirror, each mark at its own place.
    pub fn mirrored(&self) -> usize {
        self.count(|outcome| outcome.right().is_some_and(|marks| marks.is_mirrored))
    }

    /// Marks of right boards that were not seen.
    pub fn missing(&self) -> usize {
        self.right().map(|marks| marks.missing).sum()
    }

    /// Boards that are there, each mark at its own place.
    fn right(&self) -> impl Iterator<Item = &'a Marks> {
        self.outcomes.iter().filter_map(|outcome| outcome.right())
    }

    /// Share of photographs in which a board is answered.
    pub fn share(&self, false_alarm: f64) -> Measured {
        let (boards, photos) = (self.boards(), self.photos());
        Measured {
            value: boards as f64 / photos as f64,
            interval: clopper_pearson(boards, photos, false_alarm),
        }
    }

    /// Root mean squared error of a coordinate of right boards, px.
    pub fn rms_px(&self, false_alarm: f64) -> Option<Measured> {
        let pairs: Vec<_> = self.right().map(|marks| (marks.squares_px2, 2.0 * marks.count as f64)).collect();
        root_of_ratio(&pairs, false_alarm)
    }

    /// The same over that of the bound.
    pub fn over_bound(&self, false_alarm: f64) -> Option<Measured> {
        root_of_ratio(&self.bounded(), false_alarm)
    }

    /// The median over the photographs of the same.
    pub fn over_bound_median(&self) -> Option<f64> {
        let each: Vec<f64> = self.bounded().iter().map(|(error, bound)| (error / bound).sqrt()).collect();
        (!each.is_empty()).then(|| stats::median(&each))
    }

    /// Sums of squared errors, and what they are at the bound.
    fn bounded(&self) -> Vec<(f64, f64)> {
        self.right().filter_map(|marks| Some((marks.squares_px2, marks.bound_px2?))).collect()
    }

    /// Largest distance of a mark of a right board from its place, px.
    pub fn worst_px(&self) -> Option<f64> {
        self.right().map(|marks| marks.worst_px).reduce(f64::max)
    }
}

/// The root of a ratio of sums. Marks of a photograph err together, so that its interval is that of
/// independent photographs: by the linearised logarithm of the ratio (Cochran 1977, 6.4, has the ratio's) and
/// Student's t. `None` of fewer than two.
fn root_of_ratio(pairs: &[(f64, f64)], false_alarm: f64) -> Option<Measured> {
    if pairs.len() < 2 {
        return None;
    }
    let n = pairs.len() as f64;
    let (sum, base) = pairs.iter().fold((0.0, 0.0), |(a, b), pair| (a + pair.0, b + pair.1));
    let ratio = sum / base;
    let square: f64 = pairs.iter().map(|(a, b)| (a - ratio * b) * (a - ratio * b)).sum();
    let sd = (n / (n - 1.0) * square).sqrt() / base;
    let t = StudentsT::new(0.0, 1.0, n - 1.0).ok()?.inverse_cdf(1.0 - 0.5 * false_alarm);
    let factor = libm::exp(0.5 * t * sd / ratio);
    let interval = Interval { low: ratio.sqrt() / factor, high: ratio.sqrt() * factor };
    Some(Measured { value: ratio.sqrt(), interval })
}

/// The probability behind `part` of `all` (Clopper & Pearson 1934): beyond its ends as few, or as many, would
/// be seen in half of `false_alarm` at most.
pub fn clopper_pearson(part: usize, all: usize, false_alarm: f64) -> Interval {
    let (k, n) = (part as f64, all as f64);
    // P(X >= k) at probability p is the incomplete beta function I_p(k, n - k + 1).
    let end = |k: f64, tail: f64| {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if beta_reg(k, n - k + 1.0, middle) < tail { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    };
    Interval {
        low: if part == 0 { 0.0 } else { end(k, 0.5 * false_alarm) },
        high: if part == all { 1.0 } else { end(k + 1.0, 1.0 - 0.5 * false_alarm) },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench_detector_gate::scenes;

    fn row(outcome: Outcome) -> Row {
        let scene = scenes()[0];
        Row { kind: scene.kind, scene: scene.id.to_string(), trial: 0, outcome }
    }

    fn marks(squares_px2: f64, confused: usize) -> Outcome {
        Outcome::Found(Marks {
            is_mirrored: confused == 0 && squares_px2 > 5.0,
            confused,
            missing: 0,
            count: 2,
            squares_px2,
            worst_px: squares_px2.sqrt(),
            bound_px2: Some(1.0),
        })
    }

    #[test]
    fn errors_are_of_boards_whose_marks_are_at_their_places() {
        let rows =
            [marks(4.0, 0), marks(12.0, 0), marks(1e6, 3), Outcome::NotFound, Outcome::Broken].map(row);
        let judged = Judged::new(scenes()[0], &rows);
        assert_eq!((judged.photos(), judged.boards(), judged.wrong(), judged.mirrored()), (5, 3, 1, 1));
        assert_eq!(judged.broken(), 1);
        assert_eq!(judged.rms_px(0.05).unwrap().value, 2f64.sqrt());
        assert_eq!(judged.over_bound(0.05).unwrap().value, 8f64.sqrt());
        assert_eq!(judged.over_bound_median(), Some(2.0));
        assert_eq!(judged.worst_px(), Some(12f64.sqrt()));
        assert!(Judged::new(scenes()[1], &rows).rms_px(0.05).is_none());
    }

    #[test]
    fn photographs_count_and_not_their_marks() {
        // Squares of 4 and 12 over 1 and 1: a mean of 8 with a standard error of 4, and t of one degree at 50
        // % is 1.
        let found = root_of_ratio(&[(4.0, 1.0), (12.0, 1.0)], 0.5).unwrap();
        let factor = libm::exp(0.25);
        assert!((found.interval.low - 8f64.sqrt() / factor).abs() < 1e-9);
        assert!((found.interval.high - 8f64.sqrt() * factor).abs() < 1e-9);
    }

    #[test]
    fn intervals_of_shares_are_clopper_and_pearsons() {
        // Their tables: 0 of 10 below 0.3085, 2 of 10 in 0.0252 to 0.5561, at 95 %.
        let (none, two, all) =
            (clopper_pearson(0, 10, 0.05), clopper_pearson(2, 10, 0.05), clopper_pearson(10, 10, 0.05));
        assert!(none.low == 0.0 && (none.high - 0.3085).abs() < 1e-4, "{none:?}");
        assert!((two.low - 0.0252).abs() < 1e-4 && (two.high - 0.5561).abs() < 1e-4, "{two:?}");
        assert!(all.high == 1.0 && (all.low - (1.0 - none.high)).abs() < 1e-12, "{all:?}");
    }
}
