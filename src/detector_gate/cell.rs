//! Which pixels tell of a mark? Those that are nearer to it than to the next ones, along the board's rows and
//! columns.

use calibench::geometry::Vec2;
use calibench::photos::BoardSpec;

/// The part of an image about a mark.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// What leads to a next mark of the row, and to one of the next row or the one before, px.
    pub to_next: [Vec2; 2],
    /// How far it reaches the other way, in parts of these: half as a rule.
    pub back: f64,
}

impl Cell {
    /// The cell of the mark of a number. A tag's corner has half of the tag on one side, and half of the gap
    /// on the other.
    pub fn of(board: &BoardSpec, places_px: &[Vec2], mark: usize) -> Cell {
        let (columns, rows) = (board.board().columns(), board.board().rows());
        let (column, row) = (mark % columns, mark / columns);
        let april = board.april_grid();
        let next = |at: usize, count: usize| match april {
            Some(_) => at ^ 1,
            None if at + 1 < count => at + 1,
            None => at - 1,
        };
        let to = |column: usize, row: usize| places_px[row * columns + column] - places_px[mark];
        let to_next = [to(next(column, columns), row), to(column, next(row, rows))];
        Cell { to_next, back: april.map_or(0.5, |(grid, _)| 0.5 * grid.spacing()) }
    }

    /// Distance of the nearest mark, px.
    pub fn spacing_px(&self) -> f64 {
        let [across, down] = self.to_next;
        2.0 * self.back * across.norm().min(down.norm())
    }

    /// Whether a place belongs to it: `part` is what leads there from the mark, in parts of
    /// [`Cell::to_next`].
    pub(super) fn holds(&self, part: &Vec2) -> bool {
        part.max() <= 0.5 && part.min() >= -self.back
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a board that is seen from the front, a px a unit: areas of the cells tile the plane.
    fn area(words: &str, mark: usize) -> f64 {
        let board: BoardSpec = words.parse().unwrap();
        let cell = Cell::of(&board, &board.points(), mark);
        let [a, b] = cell.to_next;
        let side = 0.5 + cell.back;
        side * side * (a.x * b.y - a.y * b.x).abs()
    }

    #[test]
    fn cells_share_the_plane_among_the_marks() {
        for mark in [0, 5, 11] {
            assert_eq!(area("chess:4x3:10", mark), 100.0);
            // Rows 10 apart, marks of a row 20.
            assert_eq!(area("asymmetric:4x3:10:7", mark), 200.0);
            assert!((area("hexagonal:4x3:10:5", mark) - 100.0 * 0.75f64.sqrt()).abs() < 1e-9);
            assert_eq!(area("charuco:5x4:10:7:DICT_4X4_50", mark), 100.0);
        }
        // A quarter of a tag with its part of the gaps.
        for mark in [0, 5, 31] {
            assert!((area("aprilgrid:4x3:10:0.3", mark) - 100.0 * 0.65 * 0.65).abs() < 1e-9);
        }
    }

    #[test]
    fn the_nearest_mark_is_a_spacing_or_a_gap_away() {
        for (words, wanted) in [
            ("chess:4x3:10", 10.0),
            ("asymmetric:4x3:10:7", 200f64.sqrt()),
            ("hexagonal:4x3:10:5", 10.0),
            ("aprilgrid:4x3:10:0.3", 3.0),
        ] {
            let board: BoardSpec = words.parse().unwrap();
            for mark in 0..board.points().len() {
                let spacing = Cell::of(&board, &board.points(), mark).spacing_px();
                assert!((spacing - wanted).abs() < 1e-9, "{words}, {mark}: {spacing}");
            }
        }
    }
}
