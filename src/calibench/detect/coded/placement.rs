//! Where on the board does a lattice of corners lie? Every marker that is read has one answer; the board is
//! where several agree.

use super::dictionary::turned;
use crate::detect::lattice::Place;
use std::collections::BTreeMap;

/// A turn and a shift that take places of a lattice to places of the board.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Placement {
    turns: u8,
    /// Twice the shift, so that middles of squares are whole.
    twice: (i32, i32),
}

impl Placement {
    /// Where the lattice's square of lowest corner `seen`, turned so, is the board's square `square` (column,
    /// row).
    pub fn of_square(seen: Place, square: Place, turns: u8) -> Placement {
        let (x, y) = turned((2 * seen.0 + 1, 2 * seen.1 + 1), turns);
        Placement { turns, twice: (2 * square.0 + 1 - x, 2 * square.1 + 1 - y) }
    }

    /// The board's place of a place of the lattice: column and row of squares before it.
    pub fn on_board(&self, place: Place) -> Place {
        let (x, y) = turned((2 * place.0, 2 * place.1), self.turns);
        ((x + self.twice.0) / 2, (y + self.twice.1) / 2)
    }
}

/// What markers say of where the board is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Vote {
    /// Where most put it.
    pub placement: Placement,
    /// Markers that do.
    pub agree: usize,
    /// Markers that put it elsewhere.
    pub against: usize,
}

/// Fewest markers that must agree.
const FEWEST: usize = 2;

/// Markers that agree for each that does not. One that is read wrongly is rare; where the board is another
/// than was said, each row of markers has its own opinion, or (of OpenCV's two patterns) one of nine stands
/// elsewhere.
const FOR_EACH_AGAINST: usize = 10;

impl Vote {
    /// The vote of markers' opinions; a marker that the board does not have puts it nowhere. `None` without
    /// any.
    pub fn of(opinions: &[Option<Placement>]) -> Option<Vote> {
        let mut counts: BTreeMap<Placement, usize> = BTreeMap::new();
        for &opinion in opinions.iter().flatten() {
            *counts.entry(opinion).or_default() += 1;
        }
        // Of equal ones the first: neither is accepted then.
        let (&placement, &agree) = counts.iter().rev().max_by_key(|(_, count)| **count)?;
        Some(Vote { placement, agree, against: opinions.len() - agree })
    }

    /// Whether it is certain.
    pub fn is_certain(&self) -> bool {
        self.agree >= FEWEST && self.agree >= FOR_EACH_AGAINST * self.against
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_placement_takes_the_corners_of_a_square_to_those_of_the_boards() {
        for turns in 0..4 {
            let placement = Placement::of_square((3, -2), (5, 1), turns);
            let mut corners = [(3, -2), (4, -2), (3, -1), (4, -1)].map(|place| placement.on_board(place));
            corners.sort_unstable();
            assert_eq!(corners, [(5, 1), (5, 2), (6, 1), (6, 2)]);
            // No mirror: from the first axis to the second it turns as before.
            let [o, i, j] = [(0, 0), (1, 0), (0, 1)].map(|place| placement.on_board(place));
            let (i, j) = ((i.0 - o.0, i.1 - o.1), (j.0 - o.0, j.1 - o.1));
            assert_eq!(i.0 * j.1 - i.1 * j.0, 1);
        }
    }

    #[test]
    fn one_marker_is_no_vote_and_one_of_eleven_may_be_wrong() {
        let right = Some(Placement::of_square((0, 0), (1, 0), 0));
        let wrong = Some(Placement::of_square((0, 0), (1, 2), 0));
        let certain =
            |opinions: &[Option<Placement>]| Vote::of(opinions).is_some_and(|vote| vote.is_certain());
        assert!(!certain(&[]) && !certain(&[right]) && certain(&[right, right]));
        assert!(!certain(&[right, right, wrong]) && !certain(&[right, wrong]));
        assert!(!certain(&[None, right, right]));
        let with_wrong = |count: usize| [vec![right; count], vec![wrong]].concat();
        assert!(certain(&with_wrong(10)) && !certain(&with_wrong(9)));
    }
}
