//! Where do the squares of a chessboard meet? Corners labelled by the crate `calib-targets-chessboard`, refined and ordered
//! here.
//!
//! The crate finds X-corners (ChESS: Bennett & Lasenby 2014) and labels them on a grid, leaving out what it is not sure of.
//! Its places are single precision; each is refined in double precision ([`refine_corner`]). A board is returned complete
//! or not at all, in the order of [`GridError`]'s module: first corner nearest to the image's top left.

use super::corner::refine_corner;
use super::lattice::Lattice;
use super::order::{GridError, ordered_rectangle};
use crate::geometry::Vec2;
use crate::raster::Raster;
use calib_targets_chessboard::{
    ChessboardDetector, ChessboardParams, GrayImageView, default_chess_config, detect_corners,
};

/// Largest half-window of the refinement, px: beyond, lens distortion bends the edges more than noise moves them.
const LARGEST_HALF_WINDOW_PX: f64 = 5.0;

/// Part of the distance to the nearest corner that the half-window may take: its corners then stay clear of the next edges.
const WINDOW_FRACTION: f64 = 0.4;

/// The inner corners of a chessboard, `columns x rows`, row by row, px.
///
/// # Errors
/// See [`GridError`]; a grid is returned complete and ordered, or not at all.
pub fn chessboard_corners(image: &Raster<u8>, columns: usize, rows: usize) -> Result<Vec<Vec2>, GridError> {
    if columns.min(rows) < 2 {
        return Err(GridError::TooSmall { columns, rows });
    }
    let view = GrayImageView { width: image.width(), height: image.height(), data: image.samples() };
    let corners = detect_corners(&view, &default_chess_config());
    let nothing =
        GridError::Partial { columns, rows, found: 0, expected: columns * rows, seen: corners.len() };
    let params = ChessboardParams::default();
    let detector = ChessboardDetector::new(params).map_err(|_| nothing)?;
    let detection = detector.detect(&corners).ok_or(nothing)?;
    let centres: Vec<Vec2> =
        detection.corners.iter().map(|c| Vec2::new(c.position.x.into(), c.position.y.into())).collect();
    let lattice: Lattice =
        detection.corners.iter().enumerate().map(|(mark, c)| ((c.grid.u, c.grid.v), mark)).collect();
    let marks = ordered_rectangle(&lattice, &centres, columns, rows)?;
    let ordered: Vec<Vec2> = marks.into_iter().map(|mark| centres[mark]).collect();
    Ok((0..ordered.len()).map(|i| refined(image, &ordered, i, columns)).collect())
}

/// The refined place of a corner; where the refinement finds nothing better, the crate's.
fn refined(image: &Raster<u8>, corners: &[Vec2], index: usize, columns: usize) -> Vec2 {
    let (column, here) = (index % columns, corners[index]);
    let beside = [(column > 0).then(|| index - 1), (column + 1 < columns).then_some(index + 1)];
    let along = [index.checked_sub(columns), Some(index + columns).filter(|&next| next < corners.len())];
    let nearest = beside
        .into_iter()
        .chain(along)
        .flatten()
        .map(|other| (corners[other] - here).norm())
        .fold(f64::INFINITY, f64::min);
    let half_px = (WINDOW_FRACTION * nearest).clamp(2.0, LARGEST_HALF_WINDOW_PX) as usize;
    refine_corner(image, here, half_px).unwrap_or(here)
}
