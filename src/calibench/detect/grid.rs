//! Which disc is which mark of the board? Grids of discs in line, dense or sparse, complete and ordered.

use super::beyond::goes_on;
use super::blob::Blob;
use super::discs::{BlobOptions, blobs};
use super::grid_error::GridError;
use super::lattice::largest;
use super::misplaced::take_out_misplaced;
use super::order::{is_certain, ordered_part, ordered_rectangle};
use super::orientation::Orientation;
use super::seen::SeenBoard;
use super::smoothness::out_of_line;
use crate::geometry::{Vec2, Vec3};
use crate::raster::{Level, Raster};
use nalgebra::Matrix3;

/// A complete grid of discs.
#[derive(Debug, Clone, PartialEq)]
pub struct DotGrid {
    columns: usize,
    rows: usize,
    orientation: Orientation,
    blobs: Vec<Blob>,
}

impl DotGrid {
    pub(super) fn new(columns: usize, rows: usize, orientation: Orientation, blobs: Vec<Blob>) -> DotGrid {
        DotGrid { columns, rows, orientation, blobs }
    }

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

    /// How far the image tells which disc is the board's first: discs look alike, so that half a turn cannot
    /// be seen where it maps the board on itself.
    pub fn orientation(&self) -> Orientation {
        self.orientation
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
    let seen = discs.len();
    if columns.min(rows) < DENSE_SIDE {
        return Err(GridError::TooFewForGrid { columns, rows, found: seen, need: DENSE_SIDE });
    }
    if seen < DENSE_SIDE * DENSE_SIDE {
        let (found, expected) = (largest(discs).len(), columns.saturating_mul(rows));
        return Err(GridError::Partial { columns, rows, found, expected, seen });
    }
    order(discs, columns, rows)
}

/// Largest misfit of a disc of a board of which discs are hidden, against the middle one of all, and what is
/// allowed beside it. Noise, blur and size enter all alike; the edge of what covers a disc in part does not.
const LARGEST_MISFIT: f64 = 1.5;
const MISFIT_ALLOWED: f64 = 0.01;

/// Orders discs that are already found into a dense grid of which some may be hidden, outside of the image or
/// in glare.
///
/// It is certain which these are where the outer rows and columns are each seen in part (three discs and a
/// third of the side), and half of the discs in all. Discs whose outline is no ellipse as the others' are,
/// because something covers them in part, are left out, and so are those out of line with their neighbours.
///
/// # Errors
/// See [`GridError`]: no such grid, or none that is certain.
pub fn seen_circle_grid_of(discs: &[Blob], columns: usize, rows: usize) -> Result<SeenBoard, GridError> {
    circle_grid_of(discs, columns, rows).map(SeenBoard::from).or_else(|error| {
        let may_be_part = matches!(
            error,
            GridError::Partial { .. }
                | GridError::NotRectangular { .. }
                | GridError::Irregular { .. }
                | GridError::Staggered { .. }
        );
        let part = may_be_part.then(|| grid_in_part(discs, columns, rows)).flatten();
        part.ok_or(error)
    })
}

fn grid_in_part(discs: &[Blob], columns: usize, rows: usize) -> Option<SeenBoard> {
    let alike = alike_on_board(discs)?;
    let centres: Vec<Vec2> = alike.iter().map(|disc| disc.centre_px).collect();
    let marks = ordered_part(&largest(&alike), &centres, columns, rows)?;
    let mut places_px: Vec<Option<Vec2>> = marks.into_iter().map(|mark| Some(centres[mark?])).collect();
    out_of_line(&mut places_px, columns);
    let place = |index: usize| Vec2::new((index % columns) as f64, (index / columns) as f64);
    take_out_misplaced(&mut places_px, &(0..columns * rows).map(place).collect::<Vec<Vec2>>());
    // What was left out may be its next row.
    let all: Vec<Vec2> = discs.iter().map(|disc| disc.centre_px).collect();
    (is_certain(&places_px, columns, rows) && !goes_on(&places_px, columns, 1, &all))
        .then(|| SeenBoard::new(columns, rows, places_px, Orientation::of_discs(columns, rows)))
}

/// The discs of the largest lattice whose outlines and contrasts are as the others': nothing covers them in
/// part.
pub(super) fn alike_on_board(discs: &[Blob]) -> Option<Vec<Blob>> {
    let mut misfits: Vec<f64> = discs.iter().map(|disc| disc.misfit).collect();
    misfits.sort_by(f64::total_cmp);
    let middle = *misfits.get(misfits.len() / 2)?;
    let is_alike = |disc: &&Blob| disc.misfit <= LARGEST_MISFIT * middle + MISFIT_ALLOWED;
    let alike: Vec<Blob> = discs.iter().filter(is_alike).copied().collect();
    let on_board: Vec<Blob> = largest(&alike).values().map(|&mark| alike[mark]).collect();
    Some(evenly_lit(on_board))
}

/// Largest difference of a disc's contrast from the plane through those of the others, as part of their
/// middle, round by round: light that falls off over the board is a plane within this, and glare is not.
const LARGEST_CONTRASTS: [f64; 5] = [0.3, 0.15, 0.08, 0.05, 0.05];

/// The discs whose contrast is that of light which is even or falls off.
fn evenly_lit(discs: Vec<Blob>) -> Vec<Blob> {
    let mut contrasts: Vec<f64> = discs.iter().map(|disc| disc.contrast).collect();
    contrasts.sort_by(f64::total_cmp);
    let Some(&middle) = contrasts.get(contrasts.len() / 2) else { return discs };
    let row = |disc: &Blob| Vec3::new(1.0, 1e-3 * disc.centre_px.x, 1e-3 * disc.centre_px.y);
    let mut plane = Vec3::new(1.0, 0.0, 0.0);
    let mut left = discs.clone();
    for largest in LARGEST_CONTRASTS {
        let is_even = |disc: &&Blob| (disc.contrast / middle - plane.dot(&row(disc))).abs() <= largest;
        left = discs.iter().filter(is_even).copied().collect();
        let (mut normal, mut right) = (Matrix3::zeros(), Vec3::zeros());
        for disc in &left {
            normal += row(disc) * row(disc).transpose();
            right += row(disc) * (disc.contrast / middle);
        }
        let Some(inverse) = normal.try_inverse() else { return left };
        plane = inverse * right;
    }
    left
}

/// Finds a sparse board of `columns x rows` dark dots, such as the 3 x 3 of a nine-point calibration.
///
/// # Errors
/// See [`GridError`]; a grid is returned complete and ordered, or not at all.
///
/// ```
/// use calibench::detect::sparse_dots;
/// use calibench::synth::render::nine_dot_stand_in;
///
/// let photo = nine_dot_stand_in();
/// let dots = sparse_dots(&photo.image, 3, 3)?;
/// let worst = dots.centres_px().into_iter().zip(&photo.centres_true).map(|(found, truth)| (found - truth).norm());
/// assert!(worst.fold(0.0, f64::max) < 0.01);
/// # Ok::<(), calibench::detect::GridError>(())
/// ```
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
    let blobs = marks.into_iter().map(|mark| discs[mark]).collect();
    Ok(DotGrid::new(columns, rows, Orientation::of_discs(columns, rows), blobs))
}
