//! Which disc is which mark of the board? A complete grid in a stated order, or a reason why not.
//!
//! **Order.** Row by row, as [`Board::points`](crate::target::Board::points): along a row first. A symmetric grid looks the
//! same after half a turn (a square one after a quarter), so the image cannot tell which corner is the board's first. The
//! convention here: of all orders that see the board from its front (X to Y turns the way u turns to v) and have the asked
//! number of columns and rows, the one whose first mark has the least `u + v`, the corner nearest to the image's top left.
//! A calibration is indifferent to the choice: it only turns the board's frame by half a turn about its normal.

use super::blob::{Blob, BlobOptions, blobs};
use super::lattice::{Lattice, Place, largest};
use crate::geometry::Vec2;
use crate::raster::{Raster, Sample};

/// A complete grid of discs.
#[derive(Debug, Clone, PartialEq)]
pub struct DotGrid {
    columns: usize,
    rows: usize,
    blobs: Vec<Blob>,
}

/// Why there is no complete, unambiguous grid in an image.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum GridError {
    /// Grids with fewer marks than this on a side, or fewer in the image, cannot be told from chance by their regularity.
    #[error(
        "a dense grid needs at least {need} x {need} discs, asked for {columns} x {rows}, found {found}: use the detector \
         for sparse dots"
    )]
    TooFewForGrid {
        /// Asked marks along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
        /// Discs in the image.
        found: usize,
        /// Least marks on a side.
        need: usize,
    },
    /// A board needs two marks on each side.
    #[error("a grid needs at least 2 x 2 discs, asked for {columns} x {rows}")]
    TooSmall {
        /// Asked marks along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
    },
    /// Some marks are missing: outside the image, covered, in glare, too small or too blurred.
    #[error(
        "found {found} of the {expected} discs of a {columns} x {rows} grid ({discs} discs in the image): the whole board \
         must be visible"
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
        /// Discs in the image.
        discs: usize,
    },
    /// A complete grid of another size.
    #[error("found a {found_columns} x {found_rows} grid of discs, asked for {columns} x {rows}")]
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
    /// Enough marks, but they do not form a rectangle.
    #[error(
        "found a lattice of {found} discs that is not a {columns} x {rows} rectangle: other discs near the board, or \
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
    /// A mark is out of line with its neighbours.
    #[error(
        "the disc in column {column}, row {row} is out of line by {deviation:.2} steps (at most {limit:.2}): not a plane grid"
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

/// Largest distance of a mark from the middle of its neighbours in a row or column, in steps: 45 deg of tilt at close
/// range gives 0.1, a lens that bends a line by a tenth of its length less; a mark skipped or taken from a neighbouring
/// lattice 0.5.
const LARGEST_DEVIATION: f64 = 0.3;

/// Finds a grid of `columns x rows` dark discs, at least 4 on a side, all visible.
///
/// # Errors
/// See [`GridError`]; a grid is returned complete and ordered, or not at all.
pub fn circle_grid<T: Sample>(image: &Raster<T>, columns: usize, rows: usize) -> Result<DotGrid, GridError> {
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
pub fn sparse_dots<T: Sample>(image: &Raster<T>, columns: usize, rows: usize) -> Result<DotGrid, GridError> {
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
    let lattice = largest(discs);
    let rectangle = rectangle(&lattice, discs.len(), columns, rows)?;
    let ordered = rectangle.first_nearest_top_left(discs, columns, rows);
    let grid = DotGrid { columns, rows, blobs: ordered };
    check_regular(&grid)?;
    Ok(grid)
}

/// A full rectangle of marks: `marks[j * width + i]`.
struct Rectangle {
    width: usize,
    height: usize,
    marks: Vec<usize>,
}

/// The steps that a seed may have taken for rows and columns, undone: none, or a diagonal for one of them.
const STRAIGHTENINGS: [[i32; 4]; 5] =
    [[1, 0, 0, 1], [1, 1, 0, 1], [1, -1, 0, 1], [1, 0, 1, 1], [1, 0, -1, 1]];

/// Reads the lattice as a full rectangle of the asked size, either way round.
fn rectangle(lattice: &Lattice, discs: usize, columns: usize, rows: usize) -> Result<Rectangle, GridError> {
    let found = lattice.len();
    let full = STRAIGHTENINGS.iter().find_map(|straightening| full_rectangle(lattice, straightening));
    if let Some(full) = full {
        let sides = (full.width.max(full.height), full.width.min(full.height));
        if sides == (columns.max(rows), columns.min(rows)) {
            return Ok(full);
        }
        // A complete grid of another size, unless it is one whose outer row or column is missing.
        if found > columns * rows || sides.0 > columns.max(rows) || sides.1 > columns.min(rows) {
            let (found_columns, found_rows) = sides;
            return Err(GridError::WrongSize { columns, rows, found_columns, found_rows });
        }
    }
    let expected = columns * rows;
    Err(if found < expected {
        GridError::Partial { columns, rows, found, expected, discs }
    } else {
        GridError::NotRectangular { columns, rows, found }
    })
}

/// The lattice seen in other steps, if it fills its bounding rectangle there.
fn full_rectangle(lattice: &Lattice, [a, b, c, d]: &[i32; 4]) -> Option<Rectangle> {
    let straight = |(i, j): &Place| (a * i + b * j, c * i + d * j);
    let places = || lattice.keys().map(straight);
    let (low_i, high_i) = (places().map(|p| p.0).min()?, places().map(|p| p.0).max()?);
    let (low_j, high_j) = (places().map(|p| p.1).min()?, places().map(|p| p.1).max()?);
    let (width, height) = ((high_i - low_i + 1) as usize, (high_j - low_j + 1) as usize);
    if width * height != lattice.len() {
        return None;
    }
    let mut marks = vec![usize::MAX; lattice.len()];
    for (place, &mark) in lattice {
        let (i, j) = straight(place);
        marks[(j - low_j) as usize * width + (i - low_i) as usize] = mark;
    }
    Some(Rectangle { width, height, marks })
}

impl Rectangle {
    fn mark(&self, i: usize, j: usize) -> usize {
        self.marks[j * self.width + i]
    }

    /// The marks in the order of the convention above.
    fn first_nearest_top_left(&self, discs: &[Blob], columns: usize, rows: usize) -> Vec<Blob> {
        let centre = |i: usize, j: usize| discs[self.mark(i, j)].centre_px;
        // Does (i, j) turn the way (u, v) does? Summed over the whole outline, so no single cell decides.
        let (w, h) = (self.width - 1, self.height - 1);
        let diagonals = ((centre(w, h) - centre(0, 0)), (centre(0, h) - centre(w, 0)));
        let is_right_handed = diagonals.0.perp(&diagonals.1) > 0.0;
        // Orders: swap the axes or not, reverse either. Handedness flips with each swap and each reversal.
        let mut best: Option<(f64, [bool; 3])> = None;
        for swap in [false, true] {
            for (flip_i, flip_j) in [(false, false), (true, false), (false, true), (true, true)] {
                let size = if swap { (self.height, self.width) } else { (self.width, self.height) };
                let keeps_hand = is_right_handed ^ swap ^ flip_i ^ flip_j;
                if size != (columns, rows) || !keeps_hand {
                    continue;
                }
                let first = centre(if flip_i { w } else { 0 }, if flip_j { h } else { 0 });
                let distance = first.x + first.y;
                if best.is_none_or(|(least, _)| distance < least) {
                    best = Some((distance, [swap, flip_i, flip_j]));
                }
            }
        }
        let [swap, flip_i, flip_j] = best.map_or([false; 3], |(_, order)| order);
        (0..rows)
            .flat_map(|row| (0..columns).map(move |column| (column, row)))
            .map(|(column, row)| {
                let (i, j) = if swap { (row, column) } else { (column, row) };
                discs[self.mark(if flip_i { w - i } else { i }, if flip_j { h - j } else { j })]
            })
            .collect()
    }
}

/// Every inner mark of a row or column lies near the middle of its neighbours.
fn check_regular(grid: &DotGrid) -> Result<(), GridError> {
    let centre = |column: usize, row: usize| grid.blobs[row * grid.columns + column].centre_px;
    let deviation = |behind: Vec2, here: Vec2, ahead: Vec2| {
        ((behind + ahead) * 0.5 - here).norm() / ((ahead - behind).norm() * 0.5)
    };
    for row in 0..grid.rows {
        for column in 0..grid.columns {
            let here = centre(column, row);
            let mut worst = 0.0f64;
            if column > 0 && column + 1 < grid.columns {
                worst = worst.max(deviation(centre(column - 1, row), here, centre(column + 1, row)));
            }
            if row > 0 && row + 1 < grid.rows {
                worst = worst.max(deviation(centre(column, row - 1), here, centre(column, row + 1)));
            }
            if worst > LARGEST_DEVIATION {
                return Err(GridError::Irregular { column, row, deviation: worst, limit: LARGEST_DEVIATION });
            }
        }
    }
    Ok(())
}
