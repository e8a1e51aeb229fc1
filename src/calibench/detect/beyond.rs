//! Does a board go on beyond what was taken for its last row or column? Marks where the next ones would lie
//! tell, wherever they were found: at another size of the image, or left out because light or an edge spoiled
//! them.

use super::neighbours::Neighbours;
use super::rectangle::MOST_STRAYS;
use crate::geometry::Vec2;

/// How far a mark may lie from where the last step puts the next one, in steps: perspective changes a step by
/// less, and the next mark is a whole one away.
const MOST_OFF: f64 = 0.3;

/// Whether more marks lie beyond a side of a board than chance puts there. `places_px`: the board's marks,
/// row by row, `None` for those that are not seen; `period`: after so many rows marks stand above each other
/// again, 1 or, where rows are staggered, 2; `marks_px`: all that were seen.
pub fn goes_on(places_px: &[Option<Vec2>], columns: usize, period: usize, marks_px: &[Vec2]) -> bool {
    let marks = Neighbours::new(marks_px);
    let reach = MOST_OFF / period as f64;
    sides(places_px, columns, period).any(|side| {
        let is_mark = |next: &Next| marks.within(&next.place, reach * next.outwards.norm()).next().is_some();
        side.more_than_chance(is_mark).is_some()
    })
}

/// Where the mark beyond an outer one would lie, or an outer one lies, with the steps to its neighbours.
#[derive(Debug, Clone, Copy)]
pub(super) struct Next {
    pub place: Vec2,
    pub outwards: Vec2,
    /// Along the side.
    pub along: Vec2,
}

/// The outer marks of a side that are seen, and how many there are.
pub(super) struct Side {
    of: usize,
    pub outer: Vec<Next>,
}

impl Side {
    /// How many marks stand beyond, of how many places, where these are more than chance puts there.
    pub fn more_than_chance(&self, is_there: impl Fn(&Next) -> bool) -> Option<(usize, usize)> {
        let beyond = |outer: &&Next| is_there(&Next { place: outer.place + outer.outwards, ..**outer });
        let found = self.outer.iter().filter(beyond).count();
        (found as f64 > MOST_STRAYS * self.of as f64).then_some((found, self.of))
    }
}

/// The four sides of a board; see [`goes_on`].
pub(super) fn sides(places_px: &[Option<Vec2>], columns: usize, period: usize) -> impl Iterator<Item = Side> {
    let rows = places_px.len() / columns;
    let at = move |(column, row): (usize, usize)| places_px[row * columns + column];
    let side = move |of: usize, pair: &dyn Fn(usize) -> [(usize, usize); 2], stride: usize| {
        let next = |k: usize| {
            let [outer, inner] = pair(k).map(at);
            let place = outer?;
            let towards = |other: usize| Some(at(pair(other)[0])? - place);
            let behind = k.checked_sub(stride).and_then(towards).map(|step| -step);
            let along = Some(k + stride).filter(|&k| k < of).and_then(towards).or(behind)?;
            Some(Next { place, outwards: place - inner?, along })
        };
        Side { of, outer: (0..of).filter_map(next).collect() }
    };
    [
        side(rows, &|row| [(0, row), (1, row)], period),
        side(rows, &|row| [(columns - 1, row), (columns - 2, row)], period),
        side(columns, &|column| [(column, period - 1), (column, 2 * period - 1)], 1),
        side(columns, &|column| [(column, rows - period), (column, rows - 2 * period)], 1),
    ]
    .into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid in perspective.
    fn places(columns: usize, rows: usize) -> Vec<Vec2> {
        let place = |column: usize, row: usize| {
            let (x, y) = (column as f64, row as f64);
            Vec2::new(60.0 + 30.0 * x + 2.0 * y, 50.0 + 28.0 * y) / (1.0 + 0.02 * x + 0.01 * y)
        };
        (0..rows).flat_map(|row| (0..columns).map(move |column| place(column, row))).collect()
    }

    fn board() -> Vec<Option<Vec2>> {
        places(9, 6).into_iter().map(Some).collect()
    }

    #[test]
    fn a_row_or_a_column_more_is_seen() {
        for (columns, rows) in [(10, 6), (9, 7)] {
            assert!(goes_on(&board(), 9, 1, &places(columns, rows)), "{columns} x {rows}");
        }
        // And half of one.
        assert!(goes_on(&board(), 9, 1, &places(9, 7)[..54 + 4]));
        let shifted: Vec<Option<Vec2>> = (places(10, 7).into_iter().enumerate())
            .filter(|(index, _)| index % 10 > 0 && *index >= 10)
            .map(|(_, place)| Some(place))
            .collect();
        assert!(goes_on(&shifted, 9, 1, &places(10, 7)[..10]));
    }

    #[test]
    fn its_own_marks_and_a_few_strays_are_no_more_of_it() {
        assert!(!goes_on(&board(), 9, 1, &places(9, 6)));
        assert!(!goes_on(&board(), 9, 1, &places(9, 7)[..54 + 3]));
        assert!(!goes_on(&board(), 9, 1, &[]));
        let hidden: Vec<Option<Vec2>> =
            board().into_iter().enumerate().map(|(k, p)| p.filter(|_| k < 45)).collect();
        assert!(!goes_on(&hidden, 9, 1, &places(9, 7)));
    }

    #[test]
    fn staggered_rows_go_on_after_two() {
        let place = |index: usize| {
            let (column, row) = ((index % 4) as f64, (index / 4) as f64);
            Vec2::new(60.0 + 40.0 * column + 20.0 * (row % 2.0), 50.0 + 20.0 * row)
                / (1.0 + 0.02 * column + 0.01 * row)
        };
        let of =
            |rows: std::ops::Range<usize>| rows.flat_map(|row| (0..4).map(move |c| 4 * row + c)).map(place);
        let board: Vec<Option<Vec2>> = of(1..12).map(Some).collect();
        let beside = |rows: std::ops::Range<usize>| goes_on(&board, 4, 2, &of(rows).collect::<Vec<Vec2>>());
        assert_eq!((beside(1..12), beside(0..12), beside(1..13), beside(12..13)), (false, true, true, true));
    }
}
