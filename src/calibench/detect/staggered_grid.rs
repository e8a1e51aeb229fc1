//! Where are the discs of a board whose rows are staggered? All of them in order, or those that are seen.

use super::beyond::goes_on;
use super::blob::Blob;
use super::discs::{BlobOptions, blobs};
use super::grid::{DotGrid, alike_on_board};
use super::grid_error::GridError;
use super::lattice::{Lattice, largest};
use super::misplaced::take_out_misplaced;
use super::orientation::Orientation;
use super::seen::SeenBoard;
use super::smoothness::out_of_line;
use super::staggered::{
    LEAST_COLUMNS, LEAST_ROWS, along_diagonals, from_diagonals, ordered_staggered, ordered_staggered_part,
    places_on_board,
};
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};

/// Finds `rows` staggered rows of `columns` dark discs, all visible: what OpenCV calls an asymmetric grid of
/// `columns x rows`, and hexagonal ones, which a single photograph does not tell apart from it. At least 3
/// columns and 4 rows.
///
/// # Errors
/// See [`GridError`]; a grid is returned complete and ordered, or not at all.
///
/// ```
/// use calibench::board::{Arrangement, Board, Pattern};
/// use calibench::detect::{Orientation, disc_biases, staggered_grid};
/// use calibench::synth::Truth;
/// use calibench::synth::render::{Imaging, photograph};
///
/// let board = Board::arranged(4, 11, 8.0, Pattern::Circles { diameter: 6.0 }, Arrangement::Asymmetric)?;
/// let (camera, pose) = (Truth::example_camera(), Truth::example_poses()[0]);
/// let photo = photograph(&camera, Truth::EXAMPLE_IMAGE, &board, &pose, &Imaging::default())?;
/// let grid = staggered_grid(&photo.image, 4, 11)?;
/// // The middle of a disc's image is beside the image of its middle.
/// let bias = disc_biases(&camera, &pose, &board)?[0];
/// assert!((grid.centres_px()[0] - photo.centres_true[0] - bias).norm() < 0.01);
/// // Eleven rows look different after half a turn.
/// assert_eq!(grid.orientation(), Orientation::Fixed);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn staggered_grid<T: Level>(
    image: &Raster<T>,
    columns: usize,
    rows: usize,
) -> Result<DotGrid, GridError> {
    staggered_grid_of(&blobs(image, &BlobOptions::default()), columns, rows)
}

/// Orders discs that are already found. See [`staggered_grid`].
///
/// # Errors
/// See [`GridError`].
pub fn staggered_grid_of(discs: &[Blob], columns: usize, rows: usize) -> Result<DotGrid, GridError> {
    if columns < LEAST_COLUMNS || rows < LEAST_ROWS {
        let (need_columns, need_rows) = (LEAST_COLUMNS, LEAST_ROWS);
        return Err(GridError::TooFewStaggered { columns, rows, need_columns, need_rows });
    }
    let centres: Vec<Vec2> = discs.iter().map(|disc| disc.centre_px).collect();
    let marks = ordered_staggered(&largest(discs), &centres, columns, rows)?;
    let blobs = marks.into_iter().map(|mark| discs[mark]).collect();
    Ok(DotGrid::new(columns, rows, Orientation::of_staggered(rows), blobs))
}

/// Orders discs that are already found into staggered rows of which some discs may be hidden, outside of the
/// image or in glare, where it is certain which: half of them are seen, nothing lies beside them, and
/// wherever else the board might lie, three of them and a third of the shorter side would be none of it. What
/// [`seen_circle_grid_of`](super::seen_circle_grid_of) leaves out is left out here.
///
/// # Errors
/// See [`GridError`]: no such grid, or none that is certain.
pub fn seen_staggered_grid_of(discs: &[Blob], columns: usize, rows: usize) -> Result<SeenBoard, GridError> {
    staggered_grid_of(discs, columns, rows).map(SeenBoard::from).or_else(|error| {
        let may_be_part = !matches!(error, GridError::TooFewStaggered { .. } | GridError::Mirrored { .. });
        may_be_part.then(|| in_part(discs, columns, rows)).flatten().ok_or(error)
    })
}

fn in_part(discs: &[Blob], columns: usize, rows: usize) -> Option<SeenBoard> {
    let alike = alike_on_board(discs)?;
    let centres: Vec<Vec2> = alike.iter().map(|disc| disc.centre_px).collect();
    let lattice = largest(&alike);
    let marks = ordered_staggered_part(&lattice, &centres, columns, rows)?;
    let places_px: Vec<Option<Vec2>> = marks.iter().map(|mark| Some(centres[(*mark)?])).collect();
    let (mut grid, width) = along_diagonals(&places_px, columns);
    out_of_line(&mut grid, width);
    let mut in_line = from_diagonals(&grid, places_px.len(), columns);
    take_out_misplaced(&mut in_line, &places_on_board(columns, rows));
    let kept = |mark: usize| {
        marks.iter().position(|other| *other == Some(mark)).is_some_and(|k| in_line[k].is_some())
    };
    let lattice: Lattice = lattice.into_iter().filter(|(_, mark)| kept(*mark)).collect();
    ordered_staggered_part(&lattice, &centres, columns, rows)?;
    // What was left out may be its next row.
    let all: Vec<Vec2> = discs.iter().map(|disc| disc.centre_px).collect();
    if goes_on(&in_line, columns, 2, &all) {
        return None;
    }
    Some(SeenBoard::new(columns, rows, in_line, Orientation::of_staggered(rows)))
}
