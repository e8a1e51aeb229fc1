//! Where do the squares of a chessboard meet? Corners found in a pyramid of images, ordered by the squares'
//! colours, fitted to the pixels.
//!
//! 1. A level of the pyramid is searched for places where two edges cross ([`candidates`]).
//! 2. Lattices grow from corner to corner along the squares' edges ([`growth`]); where one is missing, it is
//!    looked for ([`probe`]).
//! 3. A lattice with exactly one full rectangle of the asked size, and no board beyond it, there or in a level that was searched
//!    before, is the board ([`board`]). A larger rectangle is another board.
//! 4. Its corners are fitted in the photograph ([`refine`]).
//!
//! The level of about a megapixel comes first, then finer ones (small squares), then coarser ones (noise and
//! blur). [`chessboard`] returns a board complete and in order, or not at all; [`seen_chessboard`] also one
//! of which corners are hidden, where it is certain which.

mod board;
pub(super) mod candidates;
pub(super) mod growth;
pub(super) mod level;
pub(super) mod look;
mod places;
mod probe;
pub(super) mod refine;

use super::beyond::goes_on;
use super::lattice::Lattice;
use super::order::is_certain;
use super::orientation::Orientation;
use super::rectangle::{LEAST_PART, Rectangle};
use super::seen::SeenBoard;
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};
use board::Found;
use candidates::Strength;
use level::{Pyramid, Smoothed, photo_from_level};
use look::Look;
use refine::Fitted;

/// A complete chessboard in a photograph.
#[derive(Debug, Clone, PartialEq)]
pub struct Chessboard {
    columns: usize,
    rows: usize,
    corners_px: Vec<Vec2>,
    orientation: Orientation,
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
        "chess:{columns}x{rows} was asked, a complete {found_columns} x {found_rows} was seen: count inner corners, where four \
         squares meet, not squares; or a row of the board is covered or outside"
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
         corners): show the whole board, or half of its corners with a part of each outer row and column"
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
    complete(&Pyramid::new(image), columns, rows).map(|(board, _)| board).map_err(|failure| failure.error)
}

/// Finds a chessboard of `columns x rows` inner corners of which some may be hidden, outside of the image, in
/// glare or too blurred.
///
/// It is certain which corners these are where the board's outer rows and columns are each seen in part
/// (three corners and a third of the side), and half of the corners in all; and corners whose squares do not
/// look like those of the others, because something covers them in part, are left out.
///
/// # Errors
/// See [`ChessboardError`]: no such board, or none that is certain.
///
/// ```
/// use calibench::board::Board;
/// use calibench::detect::{chessboard, seen_chessboard};
/// use calibench::geometry::Vec2;
/// use calibench::synth::Truth;
/// use calibench::synth::render::{Imaging, photograph};
///
/// let board = Board::chessboard(8, 6, 9.0)?;
/// let (camera, pose) = (Truth::example_camera(), Truth::example_poses()[1]);
/// let photo = photograph(&camera, Truth::EXAMPLE_IMAGE, &board, &pose, &Imaging::default())?;
/// // Something grey covers a corner and what is about it.
/// let (mut image, hidden) = (photo.image, photo.centres_true[20]);
/// for y in 0..480 {
///     for x in 0..640 {
///         if (Vec2::new(x as f64, y as f64) - hidden).amax() < 16.0 {
///             image.set(x, y, 0.5);
///         }
///     }
/// }
/// assert!(chessboard(&image, 8, 6).is_err());
/// let seen = seen_chessboard(&image, 8, 6)?;
/// assert!(seen.missing() > 0 && seen.places_px()[20].is_none());
/// // What is seen is known by its place on the board: a view of these points.
/// let places = seen.seen().map(|(mark, place)| (board.points()[mark], place));
/// let (points, pixels): (Vec<Vec2>, Vec<Vec2>) = places.unzip();
/// let view = calibench::board::View::new(points, pixels)?;
/// assert_eq!(view.len() + seen.missing(), 48);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn seen_chessboard<T: Level>(
    image: &Raster<T>,
    columns: usize,
    rows: usize,
) -> Result<SeenBoard, ChessboardError> {
    let pyramid = Pyramid::new(image);
    match complete(&pyramid, columns, rows) {
        Ok((board, fitted)) => certain(fitted.alike(image, columns), columns, rows, board.orientation)
            .ok_or(ChessboardError::Unclear { columns, rows }),
        Err(failure) => {
            let part = failure.part.and_then(|seen| in_part(&pyramid, &seen, columns, rows));
            let part = part.filter(|board| !goes_on(board.places_px(), columns, 1, &failure.corners_px));
            part.ok_or(failure.error)
        }
    }
}

fn complete<T: Level>(
    pyramid: &Pyramid<'_, T>,
    columns: usize,
    rows: usize,
) -> Result<(Chessboard, Fitted), Failure> {
    if columns.min(rows) < 2 {
        return Err(Failure::of(ChessboardError::TooSmall { columns, rows }));
    }
    let mut best = Failure::of(nothing(columns, rows, 0));
    for level in search_order(pyramid.photo(), pyramid.levels()) {
        match search(pyramid, level, columns, rows) {
            Ok(seen) => match finished(pyramid, &seen, columns, rows) {
                // A row near the image's end is lost where pixels are large.
                Some((_, fitted)) if goes_on(&fitted.corners, columns, 1, &best.corners_px) => {}
                Some(board) => return Ok(board),
                None => best = best.unclear(columns, rows, seen),
            },
            Err(failure) => best = best.or(failure),
        }
    }
    Err(best)
}

/// The level of about a megapixel, finer ones, coarser ones.
pub(super) fn search_order<T: Level>(image: &Raster<T>, levels: usize) -> impl Iterator<Item = usize> {
    let pixels = image.width().saturating_mul(image.height());
    let first = (0..levels).find(|level| pixels >> (2 * level) <= FIRST_LEVEL_PIXELS).unwrap_or(levels - 1);
    (0..=first).rev().chain(first + 1..levels)
}

/// Levels without the board.
struct Failure {
    /// Corners of their largest lattice.
    found: usize,
    error: ChessboardError,
    /// The board with corners missing.
    part: Option<Box<Seen>>,
    /// Corners of every lattice that is large enough to be part of the board or more, px of the photograph.
    corners_px: Vec<Vec2>,
}

impl Failure {
    /// Without a corner.
    fn of(error: ChessboardError) -> Failure {
        Failure { found: 0, error, part: None, corners_px: Vec::new() }
    }

    /// The board was found, but its corners have no fit.
    fn unclear(self, columns: usize, rows: usize, seen: Seen) -> Failure {
        let error = ChessboardError::Unclear { columns, rows };
        Failure { found: columns * rows, error, part: more(self.part, Some(Box::new(seen))), ..self }
    }

    /// The failure with more corners, and the part with more.
    fn or(self, other: Failure) -> Failure {
        let (found, error) =
            if other.found > self.found { (other.found, other.error) } else { (self.found, self.error) };
        let mut corners_px = self.corners_px;
        corners_px.extend(other.corners_px);
        Failure { found, error, part: more(self.part, other.part), corners_px }
    }
}

/// The part with more corners, the first of equal ones.
fn more(a: Option<Box<Seen>>, b: Option<Box<Seen>>) -> Option<Box<Seen>> {
    let count = |part: &Option<Box<Seen>>| part.as_ref().map_or(0, |seen| seen.lattice.len());
    if count(&b) > count(&a) { b } else { a }
}

/// A board in a level.
struct Seen {
    level: usize,
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
    let among = |strength| search_among(&smoothed, level, strength, columns, rows);
    among(Strength::Strong).or_else(|strong| among(Strength::Any).map_err(|any| strong.or(any)))
}

fn search_among(
    smoothed: &Smoothed,
    level: usize,
    strength: Strength,
    columns: usize,
    rows: usize,
) -> Result<Seen, Failure> {
    let candidates = candidates::candidates(smoothed, strength);
    let seen = candidates.len();
    let grown = growth::lattices(smoothed, &Look::PLAIN, candidates, columns * rows);
    let places: Vec<Vec2> = grown.corners.iter().map(|corner| corner.at).collect();
    let mut failure: Option<Failure> = None;
    for lattice in grown.lattices {
        let found = lattice.len();
        let error = match board::find(&lattice, columns, rows) {
            Found::Board(rectangle) => return Ok(Seen { level, rectangle, lattice, places }),
            Found::Other { columns: found_columns, rows: found_rows } => {
                ChessboardError::WrongSize { columns, rows, found_columns, found_rows }
            }
            Found::Incomplete if found < columns * rows => {
                ChessboardError::Partial { columns, rows, found, expected: columns * rows, seen }
            }
            Found::Incomplete => ChessboardError::NotRectangular { columns, rows, found },
        };
        // The largest comes first.
        let failure = failure.get_or_insert(Failure { found, ..Failure::of(error) });
        if found as f64 >= LEAST_PART * (columns * rows) as f64 {
            let in_photo = |mark: &usize| photo_from_level(&places[*mark], level);
            failure.corners_px.extend(lattice.values().map(in_photo));
        }
        if failure.part.is_none()
            && let Some(rectangle) = Rectangle::in_part(&lattice, columns, rows)
        {
            failure.part = Some(Box::new(Seen { level, rectangle, lattice, places: places.clone() }));
        }
    }
    Err(failure.unwrap_or(Failure::of(nothing(columns, rows, seen))))
}

fn finished<T: Level>(
    pyramid: &Pyramid<'_, T>,
    seen: &Seen,
    columns: usize,
    rows: usize,
) -> Option<(Chessboard, Fitted)> {
    let (fitted, orientation) = seen.fitted(pyramid, columns, rows);
    let corners_px = fitted.corners.iter().copied().collect::<Option<Vec<Vec2>>>()?;
    Some((Chessboard { columns, rows, corners_px, orientation }, fitted))
}

/// The board with the corners that are seen, if after their fit it is still certain which they are.
fn in_part<T: Level>(
    pyramid: &Pyramid<'_, T>,
    seen: &Seen,
    columns: usize,
    rows: usize,
) -> Option<SeenBoard> {
    let (fitted, orientation) = seen.fitted(pyramid, columns, rows);
    certain(fitted.alike(pyramid.photo(), columns), columns, rows, orientation)
}

/// A board of these corners, if it is certain which they are.
fn certain(
    corners: Vec<Option<Vec2>>,
    columns: usize,
    rows: usize,
    orientation: Orientation,
) -> Option<SeenBoard> {
    is_certain(&corners, columns, rows).then(|| SeenBoard::new(columns, rows, corners, orientation))
}

impl Seen {
    /// Its corners in the board's order, fitted in the photograph.
    fn fitted<T: Level>(
        &self,
        pyramid: &Pyramid<'_, T>,
        columns: usize,
        rows: usize,
    ) -> (Fitted, Orientation) {
        let ordered = board::ordered(&self.lattice, &self.rectangle, &self.places, (columns, rows));
        let found: Vec<Option<Vec2>> =
            ordered.marks.iter().map(|mark| mark.map(|mark| self.places[mark])).collect();
        let fitted = refine::refined(pyramid, self.level, &found, columns, ordered.starts_dark, &Look::PLAIN);
        (fitted, ordered.orientation)
    }
}
