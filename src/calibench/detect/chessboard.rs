//! Where do the squares of a chessboard meet? Corners found in a pyramid of images, ordered by the squares'
//! colours, fitted to the pixels.
//!
//! 1. A level of the pyramid is searched for places where two edges cross ([`candidates`]).
//! 2. Lattices grow from corner to corner along the squares' edges ([`growth`]); where one is missing, it is
//!    looked for ([`probe`]).
//! 3. A lattice with exactly one full rectangle of the asked size, and no board beyond it, is the board
//!    ([`board`]). A larger rectangle is another board.
//! 4. Its corners are fitted in the photograph ([`refine`]).
//!
//! The level of about a megapixel comes first, then finer ones (small squares), then coarser ones (noise and
//! blur). A board is returned complete and in order, or not at all.

mod board;
mod candidates;
mod growth;
mod level;
mod places;
mod probe;
mod refine;
mod smoothness;

use super::lattice::Lattice;
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};
use board::{Found, Rectangle};
use candidates::Strength;
use level::{Pyramid, Smoothed};

/// A complete chessboard in a photograph.
#[derive(Debug, Clone, PartialEq)]
pub struct Chessboard {
    columns: usize,
    rows: usize,
    corners_px: Vec<Vec2>,
    orientation: Orientation,
}

/// How far the image tells which corner is the board's first.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Orientation {
    /// The first corner is the physical one in every view: before it lies the dark square at the board's
    /// origin. So it is where one of columns and rows is odd and the other even.
    Fixed,
    /// Half a turn looks the same: the first corner is the one of two that lies nearer to the image's top
    /// left.
    HalfTurn,
    /// Every quarter turn looks the same (as many rows as columns, an even number): the first of four.
    QuarterTurn,
}

impl Chessboard {
    /// Inner corners along a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Rows of inner corners.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// The inner corners, row by row, px.
    pub fn corners_px(&self) -> &[Vec2] {
        &self.corners_px
    }

    /// Whether the first corner is a certain corner of the board.
    pub fn orientation(&self) -> Orientation {
        self.orientation
    }
}

/// Why there is no complete chessboard of the asked size in an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ChessboardError {
    /// A board needs two inner corners on each side.
    #[error("a chessboard needs at least 2 x 2 inner corners, asked for {columns} x {rows}")]
    TooSmall {
        /// Asked corners along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
    },
    /// A complete board of another size.
    #[error(
        "found a board of {found_columns} x {found_rows} inner corners, asked for {columns} x {rows}: count the corners where four \
         squares meet, not the squares; or a row of the board is covered or outside"
    )]
    WrongSize {
        /// Asked corners along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
        /// Larger side of the board that is there.
        found_columns: usize,
        /// Its smaller side.
        found_rows: usize,
    },
    /// Some corners are missing: outside the image, covered, in glare, too small or too blurred.
    #[error(
        "found {found} of the {expected} inner corners of a {columns} x {rows} chessboard ({seen} places in the image look like \
         corners): the whole board must be visible"
    )]
    Partial {
        /// Asked corners along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
        /// Corners of the largest lattice.
        found: usize,
        /// Asked number of corners.
        expected: usize,
        /// Places that look like corners.
        seen: usize,
    },
    /// The board is there, but the edges at some corner are not clear enough for a place better than a pixel.
    #[error(
        "found a {columns} x {rows} chessboard whose edges are too blurred or noisy for exact corners: hold it still, or use more light"
    )]
    Unclear {
        /// Asked corners along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
    },
    /// Enough corners, but not exactly one rectangle of the asked size.
    #[error(
        "found a lattice of {found} corners that is not one {columns} x {rows} rectangle: another board, or a pattern beside it"
    )]
    NotRectangular {
        /// Asked corners along a row.
        columns: usize,
        /// Asked rows.
        rows: usize,
        /// Corners of the lattice.
        found: usize,
    },
}

/// Pixels of the level that is searched first, at most: boards of ten squares a side have squares of 40 px or
/// more there.
const FIRST_LEVEL_PIXELS: usize = 1_200_000;

/// Finds a chessboard of `columns x rows` inner corners, all visible.
///
/// # Errors
/// See [`ChessboardError`]; a board is returned complete and ordered, or not at all.
///
/// ```
/// use calibench::board::Board;
/// use calibench::detect::chessboard;
/// use calibench::synth::Truth;
/// use calibench::synth::render::{Imaging, photograph};
///
/// let (camera, pose) = (Truth::example_camera(), Truth::example_poses()[1]);
/// let photo =
///     photograph(&camera, Truth::EXAMPLE_IMAGE, &Board::chessboard(8, 6, 8.0)?, &pose, &Imaging::default())?;
/// let found = chessboard(&photo.image, 8, 6)?;
/// assert_eq!(found.corners_px().len(), 48);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn chessboard<T: Level>(
    image: &Raster<T>,
    columns: usize,
    rows: usize,
) -> Result<Chessboard, ChessboardError> {
    if columns.min(rows) < 2 {
        return Err(ChessboardError::TooSmall { columns, rows });
    }
    let pyramid = Pyramid::new(image);
    let mut best = Failure { found: 0, error: nothing(columns, rows, 0) };
    for level in search_order(image, pyramid.levels()) {
        match search(&pyramid, level, columns, rows) {
            Ok(seen) => match finished(image, &pyramid, level, &seen, columns, rows) {
                Some(board) => return Ok(board),
                None => best = Failure::unclear(columns, rows),
            },
            Err(failure) if failure.found > best.found => best = failure,
            Err(_) => {}
        }
    }
    Err(best.error)
}

/// The level of about a megapixel, finer ones, coarser ones.
fn search_order<T: Level>(image: &Raster<T>, levels: usize) -> impl Iterator<Item = usize> {
    let pixels = image.width().saturating_mul(image.height());
    let first = (0..levels).find(|level| pixels >> (2 * level) <= FIRST_LEVEL_PIXELS).unwrap_or(levels - 1);
    (0..=first).rev().chain(first + 1..levels)
}

/// A level without the board.
struct Failure {
    /// Corners of its largest lattice.
    found: usize,
    error: ChessboardError,
}

impl Failure {
    /// The board was found, but its corners have no fit.
    fn unclear(columns: usize, rows: usize) -> Failure {
        Failure { found: columns * rows, error: ChessboardError::Unclear { columns, rows } }
    }
}

/// A board in a level.
struct Seen {
    rectangle: Rectangle,
    lattice: Lattice,
    places: Vec<Vec2>,
}

fn nothing(columns: usize, rows: usize, seen: usize) -> ChessboardError {
    ChessboardError::Partial { columns, rows, found: 0, expected: columns * rows, seen }
}

/// Strong corners first; where they do not make the board, all.
fn search<T: Level>(
    pyramid: &Pyramid<'_, T>,
    level: usize,
    columns: usize,
    rows: usize,
) -> Result<Seen, Failure> {
    let smoothed = pyramid.smoothed(level);
    search_among(&smoothed, Strength::Strong, columns, rows).or_else(|strong| {
        search_among(&smoothed, Strength::Any, columns, rows)
            .map_err(|any| if any.found > strong.found { any } else { strong })
    })
}

fn search_among(
    smoothed: &Smoothed,
    strength: Strength,
    columns: usize,
    rows: usize,
) -> Result<Seen, Failure> {
    let candidates = candidates::candidates(smoothed, strength);
    let seen = candidates.len();
    let grown = growth::lattices(smoothed, candidates, columns * rows);
    let places: Vec<Vec2> = grown.corners.iter().map(|corner| corner.at).collect();
    let mut failure: Option<Failure> = None;
    for lattice in grown.lattices {
        let found = lattice.len();
        let error = match board::find(&lattice, columns, rows) {
            Found::Board(rectangle) => return Ok(Seen { rectangle, lattice, places }),
            Found::Other { columns: found_columns, rows: found_rows } => {
                ChessboardError::WrongSize { columns, rows, found_columns, found_rows }
            }
            Found::Incomplete if found < columns * rows => {
                ChessboardError::Partial { columns, rows, found, expected: columns * rows, seen }
            }
            Found::Incomplete => ChessboardError::NotRectangular { columns, rows, found },
        };
        // The largest comes first.
        failure.get_or_insert(Failure { found, error });
    }
    Err(failure.unwrap_or(Failure { found: 0, error: nothing(columns, rows, seen) }))
}

fn finished<T: Level>(
    image: &Raster<T>,
    pyramid: &Pyramid<'_, T>,
    level: usize,
    seen: &Seen,
    columns: usize,
    rows: usize,
) -> Option<Chessboard> {
    let (marks, orientation, starts_dark) =
        board::ordered(&seen.lattice, &seen.rectangle, &seen.places, (columns, rows));
    let found: Vec<Vec2> = marks.into_iter().map(|mark| seen.places[mark]).collect();
    let corners_px = refine::refined(image, pyramid, level, &found, columns, starts_dark)?;
    Some(Chessboard { columns, rows, corners_px, orientation })
}
