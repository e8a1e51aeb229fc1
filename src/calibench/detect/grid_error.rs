//! Why is there no grid of marks in an image?

/// Why there is no complete, unambiguous grid in an image.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// Grids with fewer marks than this on a side cannot be told from chance by their regularity.
    #[error(
        "a dense grid needs at least {need} x {need} marks, asked for {columns} x {rows}, found {found}: use the detector \
         for sparse dots"
    )]
    TooFewForGrid {
        /// Asked marks along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
        /// Marks in the image.
        found: usize,
        /// Least marks on a side.
        need: usize,
    },
    /// A board needs two marks on each side.
    #[error("a grid needs at least 2 x 2 marks, asked for {columns} x {rows}")]
    TooSmall {
        /// Asked marks along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
    },
    /// Some marks are missing: outside the image, covered, in glare, too small or too blurred.
    #[error(
        "found {found} of the {expected} marks of a {columns} x {rows} grid ({seen} in the image): show the whole \
         board, or half of its marks with a part of each outer row and column"
    )]
    Partial {
        /// Asked marks along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
        /// Marks of the largest lattice.
        found: usize,
        /// Asked number of marks.
        expected: usize,
        /// Marks in the image.
        seen: usize,
    },
    /// A complete grid of another size.
    #[error(
        "a grid of {columns} x {rows} was asked, a complete {found_columns} x {found_rows} was seen: count the discs of a row, and the \
         rows; or a row of the board is covered or outside"
    )]
    WrongSize {
        /// Asked marks along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
        /// Larger side of the grid that is there.
        found_columns: usize,
        /// Its smaller side.
        found_rows: usize,
    },
    /// The grid, and more of it beyond a side.
    #[error(
        "found {columns} x {rows} discs, and beyond a side {found} of {of} places look like discs too: if the board is larger, count the \
         discs of a row, and the rows; if they are holes or print beside it, cover them"
    )]
    Larger {
        /// Asked marks along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
        /// Discs beyond one of the sides.
        found: usize,
        /// Places there.
        of: usize,
    },
    /// Enough marks, but they do not form a rectangle.
    #[error(
        "found a lattice of {found} marks that is not a {columns} x {rows} rectangle: other marks near the board, or \
         another board"
    )]
    NotRectangular {
        /// Asked marks along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
        /// Marks of the lattice.
        found: usize,
    },
    /// A complete grid whose rows are staggered: another kind of board, or one of another size.
    #[error(
        "a grid of {columns} x {rows} was asked, a complete {found_columns} x {found_rows} with staggered rows was seen: say \
         asymmetric:{found_columns}x{found_rows} or hexagonal:{found_columns}x{found_rows}; or a row of the board is covered or \
         outside"
    )]
    Staggered {
        /// Asked marks along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
        /// Marks along a row of the grid that is there.
        found_columns: usize,
        /// Its rows.
        found_rows: usize,
    },
    /// A complete grid of rows in line, where staggered ones were asked for.
    #[error(
        "{rows} staggered rows of {columns} were asked, a complete {found_columns} x {found_rows} with rows in line was seen: say \
         circles:{found_columns}x{found_rows}"
    )]
    InLine {
        /// Asked marks along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
        /// Larger side of the grid that is there.
        found_columns: usize,
        /// Its smaller side.
        found_rows: usize,
    },
    /// Staggered rows as a mirror shows them. After a quarter turn that is a board of another size.
    #[error(
        "{rows} staggered rows of {columns} were asked, their mirror image was seen, which is also a complete {found_columns} x \
         {found_rows}: the second row begins farther right than the first if the board is seen from its front"
    )]
    Mirrored {
        /// Asked marks along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
        /// Marks along a row of the grid that is there.
        found_columns: usize,
        /// Its rows.
        found_rows: usize,
    },
    /// Staggered rows that are too few to be told from chance, or from rows in line.
    #[error(
        "staggered rows need at least {need_columns} marks each, and {need_rows} of them, asked for {columns} x {rows}"
    )]
    TooFewStaggered {
        /// Asked marks along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
        /// Least marks along a row.
        need_columns: usize,
        /// Least rows.
        need_rows: usize,
    },
    /// A mark is out of line with its neighbours.
    #[error(
        "the mark in column {column}, row {row} is out of line by {deviation:.2} steps (at most {limit:.2}): not a plane grid"
    )]
    Irregular {
        /// Column of the mark, from 0.
        column: usize,
        /// Row of the mark, from 0.
        row: usize,
        /// Distance from the middle of its neighbours, in steps.
        deviation: f64,
        /// Largest distance accepted.
        limit: f64,
    },
}

impl GridError {
    /// Whether a complete board was seen that is another one than was asked for and has as many marks or
    /// more.
    pub fn is_other_board(&self) -> bool {
        match *self {
            GridError::WrongSize { columns, rows, found_columns, found_rows }
            | GridError::Staggered { columns, rows, found_columns, found_rows }
            | GridError::InLine { columns, rows, found_columns, found_rows }
            | GridError::Mirrored { columns, rows, found_columns, found_rows } => {
                found_columns.saturating_mul(found_rows) >= columns.saturating_mul(rows)
            }
            _ => false,
        }
    }
}
