//! Which disc is which mark of the board? Grids of discs, dense or sparse, complete and ordered.

use super::blob::Blob;
use super::discs::{BlobOptions, blobs};
use super::lattice::largest;
use super::order::{GridError, ordered_rectangle};
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};

/// A complete grid of discs.
#[derive(Debug, Clone, PartialEq)]
pub struct DotGrid {
    columns: usize,
    rows: usize,
    blobs: Vec<Blob>,
}

impl DotGrid {
    /// Marks along a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The imaged discs, row by row.
    pub fn blobs(&self) -> &[Blob] {
        &self.blobs
    }

    /// Their centres, px, row by row.
    pub fn centres_px(&self) -> Vec<Vec2> {
        self.blobs.iter().map(|blob| blob.centre_px).collect()
    }
}

/// Fewest marks on a side of a dense grid: four in a row are the fewest whose steps can confirm each other.
const DENSE_SIDE: usize = 4;

/// Finds a grid of `columns x rows` dark discs, at least 4 on a side, all visible.
///
/// # Errors
/// See [`GridError`]; a grid is returned complete and ordered, or not at all.
///
/// ```
/// use calibench::detect::circle_grid;
/// use calibench::synth::Truth;
/// use calibench::synth::render::{Imaging, photograph};
///
/// let (camera, board) = (Truth::example_camera(), Truth::example_board());
/// let pose = Truth::example_poses()[0];
/// let photo = photograph(&camera, Truth::EXAMPLE_IMAGE, &board, &pose, &Imaging::default())?;
/// let grid = circle_grid(&photo.image, 9, 7)?;
/// assert_eq!(grid.centres_px().len(), 63);
/// // The target faces the camera, so its discs are seen as discs and their centres are where the lens puts them.
/// assert!((grid.centres_px()[31] - photo.centres_true[31]).norm() < 0.01);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn circle_grid<T: Level>(image: &Raster<T>, columns: usize, rows: usize) -> Result<DotGrid, GridError> {
    circle_grid_of(&blobs(image, &BlobOptions::default()), columns, rows)
}

/// Orders discs that are already found into a dense grid. See [`circle_grid`].
///
/// # Errors
/// See [`GridError`].
pub fn circle_grid_of(discs: &[Blob], columns: usize, rows: usize) -> Result<DotGrid, GridError> {
    let too_few = columns.min(rows) < DENSE_SIDE || discs.len() < DENSE_SIDE * DENSE_SIDE;
    if too_few {
        return Err(GridError::TooFewForGrid { columns, rows, found: discs.len(), need: DENSE_SIDE });
    }
    order(discs, columns, rows)
}

/// Finds a sparse board of `columns x rows` dark dots, such as the 3 x 3 of a nine-point calibration.
///
/// # Errors
/// See [`GridError`]; a grid is returned complete and ordered, or not at all.
pub fn sparse_dots<T: Level>(image: &Raster<T>, columns: usize, rows: usize) -> Result<DotGrid, GridError> {
    sparse_dots_of(&blobs(image, &BlobOptions::default()), columns, rows)
}

/// Orders dots that are already found. See [`sparse_dots`].
///
/// # Errors
/// See [`GridError`].
pub fn sparse_dots_of(discs: &[Blob], columns: usize, rows: usize) -> Result<DotGrid, GridError> {
    if columns.min(rows) < 2 {
        return Err(GridError::TooSmall { columns, rows });
    }
    order(discs, columns, rows)
}

fn order(discs: &[Blob], columns: usize, rows: usize) -> Result<DotGrid, GridError> {
    let centres: Vec<Vec2> = discs.iter().map(|disc| disc.centre_px).collect();
    let marks = ordered_rectangle(&largest(discs), &centres, columns, rows)?;
    Ok(DotGrid { columns, rows, blobs: marks.into_iter().map(|mark| discs[mark]).collect() })
}
