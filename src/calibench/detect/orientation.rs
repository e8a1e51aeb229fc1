//! Which mark of a board is its first?

/// How far the image tells which mark is the board's first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Orientation {
    /// The first mark is the physical one in every view. So it is on a chessboard where one of columns and
    /// rows is odd and the other even: before the first corner lies the dark square at the board's origin;
    /// and on a board of an odd number of staggered rows, of which the first and the last begin farther to
    /// the left.
    Fixed,
    /// Half a turn looks the same: the first mark is the one of two that lies nearer to the image's top left.
    HalfTurn,
    /// Every quarter turn looks the same (as many rows as columns, of discs or an even number of corners):
    /// the first of four.
    QuarterTurn,
}

impl Orientation {
    /// Its word in files: `fixed`, `half-turn` or `quarter-turn`.
    pub fn name(self) -> &'static str {
        match self {
            Orientation::Fixed => "fixed",
            Orientation::HalfTurn => "half-turn",
            Orientation::QuarterTurn => "quarter-turn",
        }
    }

    /// Of discs in staggered rows, all alike: half a turn exchanges the rows that begin farther to the left
    /// and those that begin farther to the right, so that it needs as many of both.
    pub(super) fn of_staggered(rows: usize) -> Orientation {
        if rows.is_multiple_of(2) { Orientation::HalfTurn } else { Orientation::Fixed }
    }

    /// Of a grid of discs, all alike.
    pub(super) fn of_discs(columns: usize, rows: usize) -> Orientation {
        if columns == rows { Orientation::QuarterTurn } else { Orientation::HalfTurn }
    }
}
