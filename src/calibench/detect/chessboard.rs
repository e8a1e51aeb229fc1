//! Where do the squares of a chessboard meet? Corners labelled by the crate `calib-targets-chessboard`, refined and ordered
//! here.
//!
//! The crate finds X-corners (ChESS: Bennett & Lasenby 2014) and labels them on a grid, leaving out what it is not sure of.
//! Its places are single precision; each is refined in double precision ([`refine_corner`]). A board is returned complete
//! or not at all, in the order of [`GridError`]'s module: first corner nearest to the image's top left.

use super::corner::refine_corner;
use super::lattice::{Lattice, Place};
use super::neighbours::Neighbours;
use super::order::{GridError, ordered_rectangle};
use crate::geometry::Vec2;
use crate::raster::Raster;
use calib_targets_chessboard::{
    ChessboardDetector, ChessboardParams, GrayImageView, default_chess_config, detect_corners,
};

/// Largest half-window of the refinement, px: beyond, bent edges and bent boards cost more than further pixels bring. Measured
/// on OpenCV's 13 sample photographs: calibration leaves 0.164, 0.160, 0.175 and 0.220 px RMS with 5, 7, 9 and 12 px.
const LARGEST_HALF_WINDOW_PX: f64 = 7.0;

/// Part of the distance to the nearest corner that the half-window may take: its corners then stay clear of the next edges.
const WINDOW_FRACTION: f64 = 0.4;

/// How far a corner may lie from where its cell's other corners put it, as a fraction of the cell's side: perspective and
/// distortion change a cell by less from one to the next.
const HOLE_FRACTION: f64 = 0.2;

/// Rounds of filling: a hole, and the corner behind it that it had cut off.
const HOLE_ROUNDS: usize = 2;

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
        corners.iter().map(|c| Vec2::new(c.position.x.into(), c.position.y.into())).collect();
    let labelled: Lattice = detection.corners.iter().map(|c| ((c.grid.u, c.grid.v), c.input_index)).collect();
    let mut lattice = without_strays(labelled);
    for _ in 0..HOLE_ROUNDS {
        lattice = with_holes_filled(lattice, &centres);
    }
    let marks = ordered_rectangle(&lattice, &centres, columns, rows)?;
    let ordered: Vec<Vec2> = marks.into_iter().map(|mark| centres[mark]).collect();
    Ok((0..ordered.len()).map(|i| refined(image, &ordered, i, columns)).collect())
}

/// The four cells around a corner.
const QUADRANTS: [Place; 4] = [(1, 1), (-1, 1), (1, -1), (-1, -1)];

/// The other three corners of a cell: beside, above or below, and across.
fn cell(lattice: &Lattice, (i, j): Place, (di, dj): Place) -> Option<[usize; 3]> {
    let at = |place: Place| lattice.get(&place).copied();
    Some([at((i + di, j))?, at((i, j + dj))?, at((i + di, j + dj))?])
}

/// Corners that belong to no whole cell hang on to the board by chance.
fn without_strays(mut lattice: Lattice) -> Lattice {
    let whole = lattice.clone();
    lattice.retain(|&place, _| QUADRANTS.iter().any(|&quadrant| cell(&whole, place, quadrant).is_some()));
    lattice
}

/// Corners that were seen but not labelled, where three corners of a cell tell the place of the fourth.
fn with_holes_filled(lattice: Lattice, centres: &[Vec2]) -> Lattice {
    let neighbours = Neighbours::new(centres);
    let mut taken: Vec<bool> = vec![false; centres.len()];
    lattice.values().for_each(|&mark| taken[mark] = true);
    let mut filled = lattice.clone();
    for &(i, j) in lattice.keys() {
        for (di, dj) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let hole = (i + di, j + dj);
            if filled.contains_key(&hole) {
                continue;
            }
            let around = QUADRANTS.iter().filter_map(|&quadrant| cell(&lattice, hole, quadrant));
            let seen = around
                .filter_map(|[beside, along, across]| {
                    let [beside, along, across] = [beside, along, across].map(|mark| centres[mark]);
                    let step = (beside - across).norm().min((along - across).norm());
                    neighbours.nearest(&(beside + along - across), HOLE_FRACTION * step)
                })
                .find(|&mark| !taken[mark]);
            if let Some(mark) = seen {
                taken[mark] = true;
                filled.insert(hole, mark);
            }
        }
    }
    filled
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
