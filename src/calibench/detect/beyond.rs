//! Does a board go on beyond what was taken for its last row or column? Marks where the next ones would lie tell, wherever they were
//! found: at another size of the image, or left out because light or an edge spoiled them.

use super::neighbours::Neighbours;
use super::rectangle::MOST_STRAYS;
use crate::geometry::Vec2;

/// How far a mark may lie from where the last step puts the next one, in steps: perspective changes a step by less, and the next mark
/// is a whole one away.
const MOST_OFF: f64 = 0.3;

/// Whether more marks lie beyond a side of a board than chance puts there. `places_px`: the board's marks, row by row, `None` for those
/// that are not seen; `period`: after so many rows marks stand above each other again, 1 or, where rows are staggered, 2; `marks_px`: all that
/// were seen.
pub fn goes_on(places_px: &[Option<Vec2>], columns: usize, period: usize, marks_px: &[Vec2]) -> bool {
    let rows = places_px.len() / columns;
    let marks = Neighbours::new(marks_px);
    let is_beyond = |outer: (usize, usize), inner: (usize, usize)| {
        let at = |(column, row): (usize, usize)| places_px[row * columns + column];
        let (Some(outer), Some(inner)) = (at(outer), at(inner)) else { return false };
        let step = outer - inner;
        marks.within(&(outer + step), MOST_OFF / period as f64 * step.norm()).next().is_some()
    };
    let side =
        |of: usize, outer: &dyn Fn(usize) -> (usize, usize), inner: &dyn Fn(usize) -> (usize, usize)| {
            let beyond = (0..of).filter(|&k| is_beyond(outer(k), inner(k))).count();
            beyond as f64 > MOST_STRAYS * of as f64
        };
    side(rows, &|row| (0, row), &|row| (1, row))
        || side(rows, &|row| (columns - 1, row), &|row| (columns - 2, row))
        || side(columns, &|column| (column, period - 1), &|column| (column, 2 * period - 1))
        || side(columns, &|column| (column, rows - period), &|column| (column, rows - 2 * period))
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
