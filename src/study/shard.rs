//! Which part of a study does this run do?

use std::fmt;
use std::str::FromStr;

/// Part `index` of `count`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Shard {
    /// From 0.
    pub index: u64,
    /// 1 or more.
    pub count: u64,
}

/// Not a part.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no shard: write i/n with 0 <= i < n <= 1000000, such as 0/4, 1/4, 2/4, 3/4")]
pub struct ShardError(String);

impl Shard {
    /// Everything.
    pub const WHOLE: Shard = Shard { index: 0, count: 1 };

    /// Parts of a study. More folders than this are a slip.
    pub const MOST: u64 = 1_000_000;

    /// The first of the deals that belongs to this part, from deal `deal` on; deals count batches, cell by
    /// cell within a round.
    pub(super) fn first_from(&self, deal: u64) -> u64 {
        deal + (self.index + self.count - deal % self.count) % self.count
    }

    /// How many of the deals below `deals` belong to this part.
    pub(super) fn held_below(&self, deals: u64) -> u64 {
        deals.saturating_sub(self.index).div_ceil(self.count)
    }

    /// Whether batch `batch` of `cell` belongs to this part.
    ///
    /// Batches are dealt out in turn, so that parts take about as long as each other. Where cells end at a
    /// precision, whole cells are dealt out: the stop rule of a cell must see all of its trials.
    pub(super) fn holds(&self, cell: usize, batch: u64, cells: usize, whole_cells: bool) -> bool {
        let deal = if whole_cells { cell as u64 } else { batch * cells as u64 + cell as u64 };
        deal % self.count == self.index
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Shard, ShardError> {
        let parsed = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parsed {
            Some((index, count)) if index < count && count <= Shard::MOST => Ok(Shard { index, count }),
            _ => Err(ShardError(text.to_string())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_batch_belongs_to_one_part() {
        for whole_cells in [false, true] {
            for (cell, batch) in (0..5).flat_map(|c| (0..7).map(move |b| (c, b))) {
                let holders = (0..3)
                    .filter(|&index| Shard { index, count: 3 }.holds(cell, batch, 5, whole_cells))
                    .count();
                assert_eq!(holders, 1);
            }
        }
    }

    #[test]
    fn what_belongs_to_a_part_is_counted_as_it_is_dealt_out() {
        for (index, count) in [(0, 1), (0, 3), (2, 3), (6, 7)] {
            let shard = Shard { index, count };
            let held: Vec<u64> = (0..40).filter(|&deal| shard.holds(0, deal, 1, false)).collect();
            for deal in 0..30 {
                assert_eq!(Some(shard.first_from(deal)), held.iter().copied().find(|&h| h >= deal));
                assert_eq!(shard.held_below(deal), held.iter().filter(|&&h| h < deal).count() as u64);
            }
        }
    }

    #[test]
    fn a_part_beyond_the_last_is_refused() {
        assert_eq!("2/3".parse(), Ok(Shard { index: 2, count: 3 }));
        for text in ["3/3", "0/0", "0/1000001", "-1/2", "1", "a/b"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
