//! Which marks of a board are seen? All of them, or those that are not hidden, outside of the image or in
//! glare.

use super::Orientation;
use super::chessboard::Chessboard;
use super::grid::DotGrid;
use crate::geometry::Vec2;

/// The marks of a board that are seen, each known by its place on the board.
#[derive(Debug, Clone, PartialEq)]
pub struct SeenBoard {
    columns: usize,
    rows: usize,
    places_px: Vec<Option<Vec2>>,
    orientation: Orientation,
}

impl SeenBoard {
    pub(super) fn new(
        columns: usize,
        rows: usize,
        places_px: Vec<Option<Vec2>>,
        orientation: Orientation,
    ) -> SeenBoard {
        SeenBoard { columns, rows, places_px, orientation }
    }

    /// Marks along a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Where each mark is, px, row by row; `None` for those that are not seen.
    pub fn places_px(&self) -> &[Option<Vec2>] {
        &self.places_px
    }

    /// The marks that are seen: index on the board, and place, px.
    pub fn seen(&self) -> impl Iterator<Item = (usize, Vec2)> {
        self.places_px.iter().enumerate().filter_map(|(index, place)| Some((index, (*place)?)))
    }

    /// Number of marks that are not seen.
    pub fn missing(&self) -> usize {
        self.places_px.iter().filter(|place| place.is_none()).count()
    }

    /// Whether the first mark is a certain mark of the board.
    pub fn orientation(&self) -> Orientation {
        self.orientation
    }
}

impl From<Chessboard> for SeenBoard {
    fn from(board: Chessboard) -> SeenBoard {
        let places_px = board.corners_px().iter().copied().map(Some).collect();
        SeenBoard::new(board.columns(), board.rows(), places_px, board.orientation())
    }
}

impl From<DotGrid> for SeenBoard {
    fn from(grid: DotGrid) -> SeenBoard {
        let places_px = grid.blobs().iter().map(|blob| Some(blob.centre_px)).collect();
        SeenBoard::new(grid.columns(), grid.rows(), places_px, grid.orientation())
    }
}
