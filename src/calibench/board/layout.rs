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

/// How the marks of a board lie to each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Arrangement {
    /// On a square grid: neighbours in a row and in a column are the board's spacing apart.
    Square,
    /// Rows one spacing apart, the marks of a row two, every second row moved by one: what OpenCV calls an
    /// asymmetric grid. The nearest neighbours lie on the diagonals, `sqrt(2)` spacings away.
    Asymmetric,
    /// The marks of a row one spacing apart, every second row moved by half of it, rows `sqrt(3) / 2`
    /// spacings apart: each mark has six neighbours at one spacing.
    Hexagonal,
}

impl Arrangement {
    /// Distance of the marks of a row, and of the rows, in spacings.
    fn steps(self) -> Vec2 {
        match self {
            Arrangement::Square => Vec2::new(1.0, 1.0),
            Arrangement::Asymmetric => Vec2::new(2.0, 1.0),
            Arrangement::Hexagonal => Vec2::new(1.0, 0.5 * libm::sqrt(3.0)),
        }
    }

    /// Distance of nearest neighbours, in spacings.
    fn nearest(self) -> f64 {
        match self {
            Arrangement::Square | Arrangement::Hexagonal => 1.0,
            Arrangement::Asymmetric => core::f64::consts::SQRT_2,
        }
    }

    /// Whether every second row is moved by half the distance of its marks.
    pub fn is_staggered(self) -> bool {
        self != Arrangement::Square
    }
}

/// A planar board: `columns x rows` marks in rows, on a square grid if not said otherwise.
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
    arrangement: Arrangement,
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
        "spacing {spacing} and disc diameter {diameter} do not make a board: need 0 < diameter < distance of neighbours"
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

    /// A board of `columns x rows` marks on a square grid, `spacing` apart.
    ///
    /// # Errors
    /// See [`BoardError`]: too few marks or too many, and lengths that no such board has.
    pub fn new(columns: usize, rows: usize, spacing: f64, pattern: Pattern) -> Result<Board, BoardError> {
        Board::arranged(columns, rows, spacing, pattern, Arrangement::Square)
    }

    /// A board of `rows` rows of `columns` marks in some arrangement, which says what `spacing` is.
    ///
    /// ```
    /// use calibench::board::{Arrangement, Board, Pattern};
    ///
    /// let board = Board::arranged(4, 11, 20.0, Pattern::Circles { diameter: 15.0 }, Arrangement::Asymmetric)?;
    /// let points = board.points();
    /// // Neighbours in a row, and the first of the next row.
    /// assert_eq!((points[1] - points[0]).norm(), 40.0);
    /// assert_eq!((points[4] - points[0]).as_slice(), [20.0, 20.0]);
    /// # Ok::<(), calibench::board::BoardError>(())
    /// ```
    ///
    /// # Errors
    /// See [`BoardError`].
    pub fn arranged(
        columns: usize,
        rows: usize,
        spacing: f64,
        pattern: Pattern,
        arrangement: Arrangement,
    ) -> Result<Board, BoardError> {
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
            Pattern::Circles { .. } => diameter > 0.0 && diameter < arrangement.nearest() * spacing,
            Pattern::Chessboard => true,
        };
        if !(spacing > 0.0 && spacing.is_finite() && discs_fit) {
            return Err(BoardError::Geometry { spacing, diameter });
        }
        Ok(Board { columns, rows, spacing, pattern, arrangement })
    }

    /// A circle grid.
    ///
    /// # Errors
    /// See [`BoardError`]; discs that touch each other, too.
    pub fn circles(columns: usize, rows: usize, spacing: f64, diameter: f64) -> Result<Board, BoardError> {
        Board::new(columns, rows, spacing, Pattern::Circles { diameter })
    }

    /// A chessboard, counted by its inner corners.
    ///
    /// # Errors
    /// See [`BoardError`].
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

    /// How the marks lie to each other.
    pub fn arrangement(&self) -> Arrangement {
        self.arrangement
    }

    /// The marks, row by row, X growing along a row, Y from row to row; the origin is half-way between the
    /// outermost in X and in Y. Of staggered rows the first, third and so on begin farther to the left.
    pub fn points(&self) -> Vec<Vec2> {
        let step = self.arrangement.steps() * self.spacing;
        let staggered = if self.arrangement.is_staggered() { 0.5 } else { 0.0 };
        let coordinate = |place: f64, last: f64, step: f64| (place - 0.5 * last) * step;
        let at = |column: usize, row: usize| {
            let moved = if row % 2 == 1 { staggered } else { 0.0 };
            let last = (self.columns - 1) as f64 + staggered;
            let x = coordinate(column as f64 + moved, last, step.x);
            Vec2::new(x, coordinate(row as f64, (self.rows - 1) as f64, step.y))
        };
        (0..self.rows)
            .flat_map(|row| (0..self.columns).map(move |column| (column, row)))
            .map(|(column, row)| at(column, row))
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
    fn staggered_rows_lie_between_their_neighbours() {
        let discs = Pattern::Circles { diameter: 2.0 };
        let board = |arrangement| Board::arranged(4, 3, 10.0, discs, arrangement).unwrap().points();
        let distances = |points: &[Vec2], of: usize| {
            let mut all: Vec<f64> = points.iter().map(|point| (point - points[of]).norm()).collect();
            all.sort_by(f64::total_cmp);
            all[1..7].to_vec()
        };
        let hexagonal = board(Arrangement::Hexagonal);
        assert!(distances(&hexagonal, 5).iter().all(|d| (d - 10.0).abs() < 1e-12));
        let asymmetric = board(Arrangement::Asymmetric);
        assert!(distances(&asymmetric, 5)[..4].iter().all(|d| (d - 200_f64.sqrt()).abs() < 1e-12));
        for points in [hexagonal, asymmetric] {
            let xs = || points.iter().map(|p| p.x);
            assert_eq!(xs().fold(0.0, f64::max), -xs().fold(0.0, f64::min));
            assert!(points[4].x > points[0].x && points[8].x == points[0].x);
        }
        // Discs may be wider than the spacing where neighbours lie on the diagonals, but may not touch.
        let wide =
            |diameter, arrangement| Board::arranged(4, 3, 10.0, Pattern::Circles { diameter }, arrangement);
        assert!(wide(14.0, Arrangement::Asymmetric).is_ok());
        assert!(wide(14.2, Arrangement::Asymmetric).is_err());
        assert!(wide(14.0, Arrangement::Hexagonal).is_err());
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
