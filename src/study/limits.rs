//! How large may a study be? Counted from its file before any work, so that what cannot end is refused and
//! not begun.

use super::spec_error::SpecError;

/// Cells of a grid. Each keeps its scene and its sums; figures compare every cell with every other.
pub const MOST_CELLS: u64 = 10_000;
/// Trials of a study. At the rate of one core, some 20 000 a second, this is 1600 years: what is counted
/// beyond is a slip.
pub const MOST_TRIALS: u64 = 1_000_000_000_000_000;
/// Trials of a batch, which are in memory together: some 500 bytes each, as numbers and as lines.
pub const MOST_BATCH: u64 = 1_000_000;
/// Points that one trial shows, views times marks: some 130 bytes each in every thread.
pub const MOST_POINTS: u64 = 1_000_000;
/// Points of the scenes that are placed before the first trial, over all cells; where every trial draws poses
/// of its own, those of the draws that the prediction takes its mean over. Placing one takes about a
/// microsecond.
pub const MOST_PLACED: u64 = 100_000_000;
/// Pixels along a side of an image.
pub const MOST_SIDE: usize = calibench::io::MOST_SIDE_PX;

/// Refuses a grid with too many cells, or cells with too many trials. `levels` are the numbers of levels of
/// the factors.
pub(super) fn check_trials(
    levels: impl Iterator<Item = usize>,
    per_cell: u64,
    batch: u64,
) -> Result<(), SpecError> {
    let cells = levels.fold(1u128, |product, levels| product.saturating_mul(levels as u128));
    refuse_above(cells, MOST_CELLS, "cells", "give the factors fewer levels, or split the study")?;
    let all = cells * u128::from(per_cell);
    refuse_above(all, MOST_TRIALS, "trials in all cells", "lower trials.per_cell")?;
    refuse_above(u128::from(batch.min(per_cell)), MOST_BATCH, "trials a batch", "lower trials.batch")
}

/// Counts the points of cells as they come.
#[derive(Debug, Default)]
pub(super) struct Points {
    placed: u128,
}

impl Points {
    /// Refuses a cell whose trials show too many points, or one that brings all cells above what may be
    /// placed. `draws` is the number of scenes drawn for it before the first trial.
    pub(super) fn add(&mut self, marks: usize, views: usize, draws: u64) -> Result<(), SpecError> {
        let points = marks as u128 * views as u128;
        let advice = "give it fewer views or marks";
        refuse_above(points, MOST_POINTS, "points a trial (views times marks)", advice)?;
        self.placed += points * u128::from(draws);
        let what = "points placed before the first trial, over all cells";
        refuse_above(self.placed, MOST_PLACED, what, "give it fewer cells, views or marks")
    }
}

fn refuse_above(needed: u128, limit: u64, what: &'static str, advice: &'static str) -> Result<(), SpecError> {
    if needed <= u128::from(limit) { Ok(()) } else { Err(SpecError::TooMuch { needed, limit, what, advice }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn needed(result: Result<(), SpecError>) -> Option<u128> {
        match result {
            Ok(()) => None,
            Err(SpecError::TooMuch { needed, .. }) => Some(needed),
            Err(other) => panic!("{other}"),
        }
    }

    #[test]
    fn a_study_has_ten_thousand_cells_a_million_of_a_batch_and_a_quadrillion_trials_and_no_more() {
        let of =
            |levels: &[usize], per_cell, batch| needed(check_trials(levels.iter().copied(), per_cell, batch));
        assert_eq!(of(&[100, 100], 100_000_000_000, 1), None);
        assert_eq!(of(&[100, 101], 2, 1), Some(10_100));
        assert_eq!(of(&[100, 100], 100_000_000_001, 1), Some(1_000_000_000_010_000));
        assert_eq!(of(&[2], 2_000_000, 1_000_000), None);
        assert_eq!(of(&[2], 2_000_000, 1_000_001), Some(1_000_001));
        // A batch is no larger than its cell.
        assert_eq!(of(&[], 1_000_000, u64::MAX), None);
    }

    #[test]
    fn points_are_counted_a_trial_and_over_all_cells_with_their_draws() {
        assert_eq!(needed(Points::default().add(1000, 1000, 1)), None);
        assert_eq!(needed(Points::default().add(1000, 1001, 1)), Some(1_001_000));
        let mut points = Points::default();
        // Fifty cells of 10 000 points drawn two hundred times are a hundred million.
        assert!((0..50).all(|_| points.add(100, 100, 200).is_ok()));
        assert_eq!(needed(points.add(1, 1, 1)), Some(100_000_001));
    }
}
