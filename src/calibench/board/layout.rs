//! Where are the marks of a board? Points of the plane Z = 0, row by row.

use crate::geometry::Vec2;

/// What the marks of a board look like.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Pattern {
    /// Dark discs of this diameter, in the board's unit.
    Circles {
        /// Diameter of a disc.
        diameter: f64,
    },
    /// Inner corners of a chessboard; the square's side is the board's spacing.
    Chessboard,
}

/// A planar board: `columns x rows` marks on a square grid.
///
/// ```
/// use calibench::board::Board;
///
/// let board = Board::chessboard(9, 6, 25.0)?;
/// assert_eq!(board.points().len(), 54);
/// // Neighbours in a row are one square apart.
/// assert_eq!((board.points()[1] - board.points()[0]).norm(), 25.0);
/// assert!(Board::chessboard(1, 6, 25.0).is_err());
/// # Ok::<(), calibench::board::BoardError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    columns: usize,
    rows: usize,
    spacing: f64,
    pattern: Pattern,
}

/// Why a board cannot exist.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BoardError {
    /// Fewer than two marks in a direction do not fix a plane coordinate system.
    #[error("a board needs at least 2 x 2 marks, got {columns} x {rows}")]
    TooSmall {
        /// Marks along X.
        columns: usize,
        /// Marks along Y.
        rows: usize,
    },
    /// More marks than a board of this library may have.
    #[error("a board of {columns} x {rows} marks has more than the {most} that a board may have")]
    TooLarge {
        /// Marks along X.
        columns: usize,
        /// Marks along Y.
        rows: usize,
        /// Most marks.
        most: usize,
    },
    /// The spacing or the diameter is not a positive number, or the discs would touch.
    #[error(
        "spacing {spacing} and disc diameter {diameter} do not make a board: need 0 < diameter < spacing"
    )]
    Geometry {
        /// Distance of neighbouring marks.
        spacing: f64,
        /// Diameter of a disc, 0 for a chessboard.
        diameter: f64,
    },
}

impl Board {
    /// Most marks of a board: a thousand by a thousand, far above what a photograph can show apart. Their
    /// places take 16 MB.
    pub const MOST_MARKS: usize = 1_000_000;

    /// A board of `columns x rows` marks, `spacing` apart.
    pub fn new(columns: usize, rows: usize, spacing: f64, pattern: Pattern) -> Result<Board, BoardError> {
        if columns < 2 || rows < 2 {
            return Err(BoardError::TooSmall { columns, rows });
        }
        if columns.checked_mul(rows).is_none_or(|marks| marks > Board::MOST_MARKS) {
            return Err(BoardError::TooLarge { columns, rows, most: Board::MOST_MARKS });
        }
        let diameter = match pattern {
            Pattern::Circles { diameter } => diameter,
            Pattern::Chessboard => 0.0,
        };
        let discs_fit = match pattern {
            Pattern::Circles { .. } => diameter > 0.0 && diameter < spacing,
            Pattern::Chessboard => true,
        };
        if !(spacing > 0.0 && spacing.is_finite() && discs_fit) {
            return Err(BoardError::Geometry { spacing, diameter });
        }
        Ok(Board { columns, rows, spacing, pattern })
    }

    /// A circle grid.
    pub fn circles(columns: usize, rows: usize, spacing: f64, diameter: f64) -> Result<Board, BoardError> {
        Board::new(columns, rows, spacing, Pattern::Circles { diameter })
    }

    /// A chessboard, counted by its inner corners.
    pub fn chessboard(columns: usize, rows: usize, square: f64) -> Result<Board, BoardError> {
        Board::new(columns, rows, square, Pattern::Chessboard)
    }

    /// Marks along X.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Marks along Y.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Distance of neighbouring marks.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// What the marks look like.
    pub fn pattern(&self) -> Pattern {
        self.pattern
    }

    /// The marks, row by row, X growing along a row, Y from row to row; the grid's centre is the origin.
    pub fn points(&self) -> Vec<Vec2> {
        let coordinate =
            |index: usize, count: usize| (index as f64 - 0.5 * (count - 1) as f64) * self.spacing;
        (0..self.rows)
            .flat_map(|row| (0..self.columns).map(move |column| (column, row)))
            .map(|(column, row)| Vec2::new(coordinate(column, self.columns), coordinate(row, self.rows)))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_is_centred_and_counted_row_by_row() {
        let points = Board::circles(9, 7, 10.0, 3.0).unwrap().points();
        assert_eq!(points.len(), 63);
        assert_eq!(points[0], Vec2::new(-40.0, -30.0));
        assert_eq!(points[8], Vec2::new(40.0, -30.0));
        assert_eq!(points.iter().sum::<Vec2>(), Vec2::zeros());
    }

    #[test]
    fn impossible_boards_are_refused() {
        assert!(matches!(Board::chessboard(1, 7, 10.0), Err(BoardError::TooSmall { .. })));
        for (columns, rows) in [(99_999_999_999, 9), (usize::MAX, usize::MAX), (1001, 1000)] {
            assert!(matches!(Board::chessboard(columns, rows, 1.0), Err(BoardError::TooLarge { .. })));
        }
        assert!(matches!(Board::chessboard(3, 7, f64::NAN), Err(BoardError::Geometry { .. })));
        assert!(matches!(Board::circles(3, 7, 10.0, 10.0), Err(BoardError::Geometry { .. })));
    }
}
