//! Where on a board is which marker? OpenCV's ChArUco boards and Kalibr's grids of AprilTags.

use super::dictionary::Dictionary;
use crate::geometry::Vec2;

/// An upright rectangle: its corners of least and of greatest coordinates.
pub type Rectangle = [Vec2; 2];

/// A chessboard with markers in its white squares, as OpenCV's `CharucoBoard` has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Charuco {
    columns: usize,
    rows: usize,
    marker: f64,
    dictionary: Dictionary,
    legacy: bool,
}

/// A grid of AprilTags with small black squares between their corners, as Kalibr's `aprilgrid` has it: the
/// tags of the family 36h11, the first at the lower left, row by row upwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AprilGrid {
    columns: usize,
    rows: usize,
    spacing: f64,
}

/// Why a board with markers cannot exist.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LayoutError {
    /// Too few squares.
    #[error("a ChArUco board needs at least 3 x 3 squares, got {columns} x {rows}")]
    Squares {
        /// Squares along a row.
        columns: usize,
        /// Rows.
        rows: usize,
    },
    /// Too few tags.
    #[error("a grid needs at least two tags, got {columns} x {rows}")]
    Tags {
        /// Tags along a row.
        columns: usize,
        /// Rows.
        rows: usize,
    },
    /// Too few markers in the dictionary.
    #[error("the board has {need} markers, and {dictionary} has only {}", .dictionary.len())]
    Markers {
        /// Markers of the board.
        need: usize,
        /// The dictionary.
        dictionary: Dictionary,
    },
    /// A marker that does not fit its square.
    #[error(
        "the marker is {part} of the square: it must be smaller than the square, with white about it, and at least 0.3"
    )]
    Marker {
        /// Side of a marker, in squares.
        part: f64,
    },
    /// Tags that touch, or are far apart.
    #[error(
        "the tags' spacing {spacing} must be between 0.1 and 1: it is the width of the space between two tags divided by the side \
         of one"
    )]
    Spacing {
        /// What was given.
        spacing: f64,
    },
}

/// Least and greatest side of a marker, in squares: beyond, no white is left about it, or its cells are too
/// small.
const MARKERS: std::ops::RangeInclusive<f64> = 0.3..=0.95;

/// Least and greatest space between tags, in their sides.
const SPACINGS: std::ops::RangeInclusive<f64> = 0.1..=1.0;

impl Charuco {
    /// A board of `columns x rows` squares with markers of `marker` sides of a square. `legacy`: boards with
    /// an even number of rows begin with a white square, as OpenCV drew them before 4.6.
    ///
    /// # Errors
    /// See [`LayoutError`].
    pub fn new(
        columns: usize,
        rows: usize,
        marker: f64,
        dictionary: Dictionary,
        legacy: bool,
    ) -> Result<Charuco, LayoutError> {
        if columns.min(rows) < 3 {
            return Err(LayoutError::Squares { columns, rows });
        }
        if !MARKERS.contains(&marker) {
            return Err(LayoutError::Marker { part: marker });
        }
        let board = Charuco { columns, rows, marker, dictionary, legacy };
        // Every second square is white; an odd number of squares begins with a black one.
        let need = columns.saturating_mul(rows) / 2;
        if need > dictionary.len() {
            return Err(LayoutError::Markers { need, dictionary });
        }
        Ok(board)
    }

    /// Squares along a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Rows of squares.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Side of a marker, in squares.
    pub fn marker(&self) -> f64 {
        self.marker
    }

    /// Its markers.
    pub fn dictionary(&self) -> Dictionary {
        self.dictionary
    }

    /// Whether it begins with a white square if its rows are even.
    pub fn is_legacy(&self) -> bool {
        self.legacy
    }

    /// Whether the first square is dark.
    pub fn starts_dark(&self) -> bool {
        !(self.legacy && self.rows.is_multiple_of(2))
    }

    /// Whether a square is dark, by its column and row.
    fn is_dark(&self, column: usize, row: usize) -> bool {
        (column + row).is_multiple_of(2) == self.starts_dark()
    }

    /// The white squares, column and row, in the order of their markers' numbers.
    pub fn markers(&self) -> Vec<(usize, usize)> {
        let columns = self.columns;
        let squares = (0..self.rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        squares.filter(|&(column, row)| !self.is_dark(column, row)).collect()
    }

    /// What is black on the board, in squares from the top left corner of the first, y down. No two overlap.
    pub fn dark(&self) -> Vec<Rectangle> {
        let corner = |(column, row): (usize, usize)| Vec2::new(column as f64, row as f64);
        let squares = (0..self.rows).flat_map(|row| (0..self.columns).map(move |column| (column, row)));
        let dark = squares.filter(|&(column, row)| self.is_dark(column, row));
        let mut all: Vec<Rectangle> =
            dark.map(|square| [corner(square), corner(square) + Vec2::repeat(1.0)]).collect();
        for (id, square) in self.markers().into_iter().enumerate() {
            let low = corner(square) + Vec2::repeat(0.5 * (1.0 - self.marker));
            let side = self.dictionary.side();
            let is_white = |row, column| self.dictionary.is_white(id, row, column) == Some(true);
            all.extend(dark_cells(low, self.marker, side, 1, is_white));
        }
        all
    }
}

impl AprilGrid {
    /// A grid of `columns x rows` tags, `spacing` sides of a tag apart.
    ///
    /// # Errors
    /// See [`LayoutError`].
    pub fn new(columns: usize, rows: usize, spacing: f64) -> Result<AprilGrid, LayoutError> {
        let tags = columns.saturating_mul(rows);
        if tags < 2 {
            return Err(LayoutError::Tags { columns, rows });
        }
        if !SPACINGS.contains(&spacing) {
            return Err(LayoutError::Spacing { spacing });
        }
        let dictionary = Dictionary::april_36h11();
        if tags > dictionary.len() {
            return Err(LayoutError::Markers { need: tags, dictionary });
        }
        Ok(AprilGrid { columns, rows, spacing })
    }

    /// Tags along a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Rows of tags.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Space between two tags, in sides of a tag.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// The corners of the tags in Kalibr's order, in sides of a tag: row by row of corners, twice as many
    /// along each side as tags, x to the right and y upwards from the lower left corner of the first tag.
    pub fn points(&self) -> Vec<Vec2> {
        let at = |k: usize| (k / 2) as f64 * (1.0 + self.spacing) + (k % 2) as f64;
        let columns = 2 * self.columns;
        (0..2 * self.rows)
            .flat_map(|row| (0..columns).map(move |column| Vec2::new(at(column), at(row))))
            .collect()
    }

    /// What is black on the board, in sides of a tag from the lower left corner of the first, y upwards, as
    /// Kalibr draws it: borders of two cells. No two overlap.
    pub fn dark(&self) -> Vec<Rectangle> {
        let pitch = 1.0 + self.spacing;
        let mut all = Vec::new();
        for row in 0..self.rows {
            for column in 0..self.columns {
                let id = row * self.columns + column;
                let low = Vec2::new(column as f64, row as f64) * pitch;
                let side = Dictionary::april_36h11().side();
                // From below upwards.
                let is_white = |row: usize, column: usize| self.is_white(id, side - 1 - row, column);
                all.extend(dark_cells(low, 1.0, side, KALIBRS_BORDER, is_white));
            }
        }
        for row in 0..=self.rows {
            for column in 0..=self.columns {
                let high = Vec2::new(column as f64, row as f64) * pitch;
                all.push([high - Vec2::repeat(self.spacing), high]);
            }
        }
        all
    }

    /// Whether a cell of a tag is white as it stands on the board, by row from above and column: OpenCV's
    /// table has the tags turned by half.
    fn is_white(&self, id: usize, row: usize, column: usize) -> bool {
        let dictionary = Dictionary::april_36h11();
        let last = dictionary.side() - 1;
        dictionary.is_white(id, last - row, last - column) == Some(true)
    }
}

/// Cells of the border of Kalibr's tags. (AprilTag's own have one.)
const KALIBRS_BORDER: usize = 2;

/// The dark cells of a marker, those beside each other in a row as one; `is_white` by row and column of the
/// inner cells, in the order of the coordinates.
fn dark_cells(
    low: Vec2,
    size: f64,
    side: usize,
    border: usize,
    is_white: impl Fn(usize, usize) -> bool,
) -> Vec<Rectangle> {
    let count = side + 2 * border;
    // The same number for the end of a cell and the begin of the next.
    let at = |column: usize, row: usize| {
        low + Vec2::new(size * column as f64 / count as f64, size * row as f64 / count as f64)
    };
    let inner = border..border + side;
    let is_dark = |row: usize, column: usize| {
        !(inner.contains(&row) && inner.contains(&column) && is_white(row - border, column - border))
    };
    let mut runs = Vec::new();
    for row in 0..count {
        let mut begin = None;
        for column in 0..=count {
            let dark = column < count && is_dark(row, column);
            match (begin, dark) {
                (None, true) => begin = Some(column),
                (Some(from), false) => {
                    runs.push([at(from, row), at(column, row + 1)]);
                    begin = None;
                }
                _ => {}
            }
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dictionary(name: &str) -> Dictionary {
        name.parse().unwrap()
    }

    #[test]
    fn markers_stand_in_the_white_squares_row_by_row() {
        let board = Charuco::new(7, 5, 0.7, dictionary("DICT_4X4_50"), false).unwrap();
        assert_eq!(board.markers().len(), 17);
        assert_eq!(board.markers()[..4], [(1, 0), (3, 0), (5, 0), (0, 1)]);
        let even = |legacy| Charuco::new(5, 4, 0.7, dictionary("DICT_4X4_50"), legacy).unwrap().markers();
        assert_eq!((even(false)[0], even(true)[0]), ((1, 0), (0, 0)));
        let odd = |legacy| Charuco::new(4, 5, 0.7, dictionary("DICT_4X4_50"), legacy).unwrap().markers();
        assert_eq!(odd(false), odd(true));
    }

    #[test]
    fn tags_lie_as_kalibr_has_them() {
        let grid = AprilGrid::new(6, 6, 0.3).unwrap();
        let points = grid.points();
        assert_eq!(points.len(), 144);
        assert_eq!(points[..3], [Vec2::new(0.0, 0.0), Vec2::new(1.0, 0.0), Vec2::new(1.3, 0.0)]);
        assert_eq!((points[12].y, points[24].y), (1.0, 1.3));
        // The first tag's number in AprilTag's own list is d5d628584: its cells from the top left.
        let cells = (0..36).fold(0u64, |cells, k| cells << 1 | u64::from(grid.is_white(0, k / 6, k % 6)));
        assert_eq!(cells, 0xd_5d62_8584);
    }

    #[test]
    fn the_black_of_a_board_is_as_large_as_its_cells() {
        let area = |all: Vec<Rectangle>| all.iter().map(|[low, high]| (high - low).product()).sum::<f64>();
        let board = Charuco::new(3, 3, 0.6, dictionary("DICT_4X4_50"), false).unwrap();
        let white: u32 = board.dictionary().cells()[..4].iter().map(|cells| cells.count_ones()).sum();
        let expected = 5.0 + 4.0 * 0.36 - f64::from(white) * 0.01;
        assert!((area(board.dark()) - expected).abs() < 1e-12);
        let grid = AprilGrid::new(2, 1, 0.3).unwrap();
        let white: u32 = Dictionary::april_36h11().cells()[..2].iter().map(|cells| cells.count_ones()).sum();
        assert!((area(grid.dark()) - (2.0 + 6.0 * 0.09 - f64::from(white) * 0.01)).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_board_is_refused() {
        let of = |columns, rows, marker, name| Charuco::new(columns, rows, marker, dictionary(name), false);
        assert!(matches!(of(2, 5, 0.7, "4X4_50"), Err(LayoutError::Squares { .. })));
        assert!(matches!(of(7, 5, 1.0, "4X4_50"), Err(LayoutError::Marker { .. })));
        assert!(matches!(of(12, 9, 0.7, "4X4_50"), Err(LayoutError::Markers { need: 54, .. })));
        assert!(matches!(AprilGrid::new(1, 1, 0.3), Err(LayoutError::Tags { .. })));
        assert!(matches!(AprilGrid::new(6, 6, 30.0), Err(LayoutError::Spacing { .. })));
        assert!(matches!(AprilGrid::new(30, 20, 0.3), Err(LayoutError::Markers { .. })));
    }
}
