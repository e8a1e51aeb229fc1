//! Which mark of a board is its first?

/// How far the image tells which mark is the board's first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Orientation {
    /// The first mark is the physical one in every view. So it is on a chessboard where one of columns and rows is
    /// odd and the other even: before the first corner lies the dark square at the board's origin.
    Fixed,
    /// Half a turn looks the same: the first mark is the one of two that lies nearer to the image's top left.
    HalfTurn,
    /// Every quarter turn looks the same (as many rows as columns, of discs or an even number of corners): the
    /// first of four.
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

    /// Of a grid of discs, all alike.
    pub(super) fn of_discs(columns: usize, rows: usize) -> Orientation {
        if columns == rows { Orientation::QuarterTurn } else { Orientation::HalfTurn }
    }
}
