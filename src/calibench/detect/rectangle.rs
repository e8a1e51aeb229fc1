//! Is a board of a known size in a lattice? A rectangle of places, full or in part.

use super::lattice::{Lattice, Place};

/// A rectangle of places of a lattice.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Rectangle {
    /// The place of least i and j.
    pub low: Place,
    /// Places along i.
    pub width: usize,
    /// Places along j.
    pub height: usize,
}

/// Marks beside a rectangle that may be chance, as part of the side: texture that looks like one more mark.
pub const MOST_STRAYS: f64 = 0.34;

/// Fewest marks of an outer row or column that show where a board of which marks are hidden ends, on sides
/// that have as many.
const FEWEST_ON_A_SIDE: usize = 3;

/// Least part of a board's marks that must be seen.
pub const LEAST_PART: f64 = 0.5;

impl Rectangle {
    pub fn is_full(&self, lattice: &Lattice) -> bool {
        self.places().all(|place| lattice.contains_key(&place))
    }

    /// Row by row.
    pub fn places(self) -> impl Iterator<Item = Place> {
        let (width, height) = (self.width as i32, self.height as i32);
        (0..height).flat_map(move |j| (0..width).map(move |i| (self.low.0 + i, self.low.1 + j)))
    }

    /// Whether the board goes on beyond a side.
    pub fn goes_on(&self, lattice: &Lattice) -> bool {
        let (w, h) = (self.width as i32, self.height as i32);
        self.sides(lattice, [-1, h], [-1, w]).any(|(count, of)| count as f64 > MOST_STRAYS * of as f64)
    }

    /// Whether all four outer rows and columns are there: without one of them the board may lie a step
    /// further.
    fn ends_are_seen(&self, lattice: &Lattice) -> bool {
        let (w, h) = (self.width as i32, self.height as i32);
        self.sides(lattice, [0, h - 1], [0, w - 1])
            .all(|(count, of)| count >= FEWEST_ON_A_SIDE.min(of) && count as f64 > MOST_STRAYS * of as f64)
    }

    /// Marks in two rows and two columns, counted from the lowest place, with the places of each.
    fn sides(
        &self,
        lattice: &Lattice,
        rows: [i32; 2],
        columns: [i32; 2],
    ) -> impl Iterator<Item = (usize, usize)> {
        let (w, h) = (self.width as i32, self.height as i32);
        let has = |i: i32, j: i32| lattice.contains_key(&(self.low.0 + i, self.low.1 + j));
        let in_row = |j: i32| (0..w).filter(|&i| has(i, j)).count();
        let in_column = |i: i32| (0..h).filter(|&j| has(i, j)).count();
        [
            (in_row(rows[0]), self.width),
            (in_row(rows[1]), self.width),
            (in_column(columns[0]), self.height),
            (in_column(columns[1]), self.height),
        ]
        .into_iter()
    }

    /// Whether a board of this size is certain to lie here, though marks are missing: its ends are seen and
    /// half of its marks, and nothing lies beside it.
    pub fn is_certain(&self, lattice: &Lattice) -> bool {
        let inside = self.places().filter(|place| lattice.contains_key(place)).count();
        inside == lattice.len()
            && inside as f64 >= LEAST_PART * (self.width * self.height) as f64
            && self.ends_are_seen(lattice)
    }

    /// The one place where a board of `columns x rows`, either way round, is certain to lie in a lattice in
    /// which marks are missing; `None` where there is none or a choice.
    pub fn in_part(lattice: &Lattice, columns: usize, rows: usize) -> Option<Rectangle> {
        let places = columns.saturating_mul(rows);
        if lattice.len() > places || (lattice.len() as f64) < LEAST_PART * places as f64 {
            return None;
        }
        let extent =
            |of: fn(&Place) -> i32| Some((lattice.keys().map(of).min()?, lattice.keys().map(of).max()?));
        let (along_i, along_j) = (extent(|place| place.0)?, extent(|place| place.1)?);
        let starts =
            |(low, high): (i32, i32), count: usize| low..=high + 1 - count.min(i32::MAX as usize) as i32;
        let mut only = None;
        for (width, height) in [(columns, rows), (rows, columns)] {
            for i in starts(along_i, width) {
                for j in starts(along_j, height) {
                    let here = Rectangle { low: (i, j), width, height };
                    if only == Some(here) || !here.is_certain(lattice) {
                        continue;
                    }
                    if only.replace(here).is_some() {
                        return None;
                    }
                }
            }
        }
        only
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(width: i32, height: i32) -> Lattice {
        (0..height).flat_map(|j| (0..width).map(move |i| ((i, j), (j * width + i) as usize))).collect()
    }

    fn without(places: impl IntoIterator<Item = Place>) -> Lattice {
        let mut part = lattice(9, 6);
        places.into_iter().for_each(|place| {
            part.remove(&place);
        });
        part
    }

    #[test]
    fn a_board_with_a_hole_is_where_its_ends_are() {
        let board = Rectangle { low: (0, 0), width: 9, height: 6 };
        let hole = without([(0, 0), (4, 3), (5, 3), (8, 5)]);
        assert_eq!(Rectangle::in_part(&hole, 9, 6), Some(board));
        assert_eq!(Rectangle::in_part(&hole, 6, 9), Some(board));
        // Half of a side and a corner cut off.
        assert_eq!(Rectangle::in_part(&without((5..9).flat_map(|i| [(i, 0), (i, 1)])), 9, 6), Some(board));
        for (columns, rows) in [(8, 6), (9, 5), (10, 6), (9, 7), (8, 5)] {
            assert_eq!(Rectangle::in_part(&hole, columns, rows), None, "{columns} x {rows}");
        }
        // One more beside it may be of a larger board.
        let mut more = hole.clone();
        more.insert((9, 2), 54);
        assert_eq!(Rectangle::in_part(&more, 9, 6), None);
        assert_eq!(Rectangle::in_part(&lattice(6, 6), 6, 6).map(|r| r.low), Some((0, 0)));
    }

    #[test]
    fn a_board_without_an_end_may_lie_a_step_further_and_is_refused() {
        // A whole column hidden, all but two marks of one, and more than half of the board.
        assert_eq!(Rectangle::in_part(&without((0..6).map(|j| (8, j))), 9, 6), None);
        assert_eq!(Rectangle::in_part(&without((0..4).map(|j| (8, j))), 9, 6), None);
        let frame = (1..8).flat_map(|i| (1..5).map(move |j| (i, j)));
        assert_eq!(Rectangle::in_part(&without(frame), 9, 6), None);
    }
}
