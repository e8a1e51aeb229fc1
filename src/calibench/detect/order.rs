//! Which mark of a lattice is which mark of the board? A complete rectangle in a stated order, or a reason
//! why not.
//!
//! **Order.** Row by row, as [`Board::points`](crate::board::Board::points): along a row first. A symmetric
//! grid looks the same after half a turn (a square one after a quarter), so the image cannot tell which
//! corner is the board's first. The convention here: of all orders that see the board from its front (X to Y
//! turns the way u turns to v) and have the asked number of columns and rows, the one whose first mark has
//! the least `u + v`, the corner nearest to the image's top left. A calibration is indifferent to the choice:
//! it only turns the board's frame by half a turn about its normal.

use super::grid_error::GridError;
use super::lattice::{Lattice, Place};
use super::rectangle::Rectangle;
use super::staggered;
use crate::geometry::{Homography, Vec2};

/// Largest distance of a mark from the middle of its neighbours in a row or column, in steps: 45 deg of tilt
/// at close range gives 0.1, a lens that bends a line by a tenth of its length less; a mark skipped or taken
/// from a neighbouring lattice 0.5.
pub const LARGEST_DEVIATION: f64 = 0.3;

/// The marks of a lattice in the order of a `columns x rows` board. `centres[mark]` is a mark's place in the
/// image.
///
/// # Errors
/// See [`GridError`].
pub fn ordered_rectangle(
    lattice: &Lattice,
    centres: &[Vec2],
    columns: usize,
    rows: usize,
) -> Result<Vec<usize>, GridError> {
    let full = rectangle(lattice, centres.len(), columns, rows)
        .map_err(|error| staggered_instead(error, lattice, centres, columns, rows))?;
    let marks = full.first_nearest_top_left(centres, columns, rows);
    let ordered: Vec<Vec2> = marks.iter().map(|&mark| centres[mark]).collect();
    check_regular(&ordered, columns, rows)?;
    Ok(marks)
}

/// The error that says what was seen, where that is a complete grid of staggered rows.
fn staggered_instead(
    error: GridError,
    lattice: &Lattice,
    centres: &[Vec2],
    columns: usize,
    rows: usize,
) -> GridError {
    match staggered::complete_size(lattice, centres) {
        Some((found_columns, found_rows)) => {
            GridError::Staggered { columns, rows, found_columns, found_rows }
        }
        None => error,
    }
}

/// The larger and the smaller side of a lattice that is a complete rectangle.
pub fn complete_sides(lattice: &Lattice) -> Option<(usize, usize)> {
    let full = STRAIGHTENINGS.iter().find_map(|straightening| full_rectangle(lattice, straightening))?;
    Some((full.width.max(full.height), full.width.min(full.height)))
}

/// The marks of a lattice in the order of a `columns x rows` board of which marks are hidden; `None` where it
/// is not certain which.
pub fn ordered_part(
    lattice: &Lattice,
    centres: &[Vec2],
    columns: usize,
    rows: usize,
) -> Option<Vec<Option<usize>>> {
    let read = |straightening: &[i32; 4]| {
        let straight = straightened(lattice, straightening);
        SeenPart::of(Rectangle::in_part(&straight, columns, rows)?, &straight, centres)
    };
    let mut parts = STRAIGHTENINGS.iter().filter_map(read);
    // Read in two ways it is not certain.
    let only = parts.next().filter(|_| parts.next().is_none())?;
    Some(only.first_nearest_top_left(columns, rows))
}

/// Whether marks in the order of a board are enough of it ([`Rectangle::is_certain`]).
pub fn is_certain(places_px: &[Option<Vec2>], columns: usize, rows: usize) -> bool {
    let place = |index: usize| ((index % columns) as i32, (index / columns) as i32);
    let seen = (0..places_px.len()).filter(|&index| places_px[index].is_some());
    let lattice: Lattice = seen.map(|index| (place(index), index)).collect();
    Rectangle { low: (0, 0), width: columns, height: rows }.is_certain(&lattice)
}

/// A board in a lattice, some of its marks hidden.
struct SeenPart {
    rectangle: Rectangle,
    /// Row by row.
    marks: Vec<Option<usize>>,
    /// Where the rectangle's corners are, px, hidden or not: at (0, 0), (w, 0), (0, h) and (w, h).
    corners_px: [Vec2; 4],
}

impl SeenPart {
    fn of(rectangle: Rectangle, lattice: &Lattice, centres: &[Vec2]) -> Option<SeenPart> {
        let marks: Vec<Option<usize>> =
            rectangle.places().map(|place| lattice.get(&place).copied()).collect();
        let (width, count) = (rectangle.width, marks.len());
        let on_board = |index: usize| Vec2::new((index % width) as f64, (index / width) as f64);
        let seen = || (0..count).filter_map(|index| Some((index, marks[index]?)));
        let from: Vec<Vec2> = seen().map(|(index, _)| on_board(index)).collect();
        let to: Vec<Vec2> = seen().map(|(_, mark)| centres[mark]).collect();
        let plane = Homography::fit(&from, &to).ok()?.homography;
        let place = |index: usize| match marks[index] {
            Some(mark) => Some(centres[mark]),
            None => plane.apply(&on_board(index)),
        };
        let [a, b, c, d] = [0, width - 1, count - width, count - 1].map(place);
        let corners_px = [a?, b?, c?, d?];
        Some(SeenPart { rectangle, marks, corners_px })
    }

    /// The marks in the order of the convention above.
    fn first_nearest_top_left(&self, columns: usize, rows: usize) -> Vec<Option<usize>> {
        let (width, height) = (self.rectangle.width, self.rectangle.height);
        let order = first_nearest_top_left(self.corners_px, (width, height), (columns, rows));
        order.of(columns, rows, width, height).map(|place| self.marks[place]).collect()
    }
}

/// A full rectangle of marks: `marks[j * width + i]`.
struct FullRectangle {
    width: usize,
    height: usize,
    marks: Vec<usize>,
}

/// Least side of a complete grid that is told to be another board than the one asked for.
pub const LEAST_NAMED_SIDE: usize = 3;

/// The steps that a seed may have taken for rows and columns, undone: none, or a diagonal for one of them.
const STRAIGHTENINGS: [[i32; 4]; 5] =
    [[1, 0, 0, 1], [1, 1, 0, 1], [1, -1, 0, 1], [1, 0, 1, 1], [1, 0, -1, 1]];

/// Reads the lattice as a full rectangle of the asked size, either way round.
fn rectangle(
    lattice: &Lattice,
    seen: usize,
    columns: usize,
    rows: usize,
) -> Result<FullRectangle, GridError> {
    let found = lattice.len();
    let full = STRAIGHTENINGS.iter().find_map(|straightening| full_rectangle(lattice, straightening));
    if let Some(full) = full {
        let sides = (full.width.max(full.height), full.width.min(full.height));
        if sides == (columns.max(rows), columns.min(rows)) {
            return Ok(full);
        }
        // Texture makes complete grids too, of two by some.
        if sides.1 >= LEAST_NAMED_SIDE || found > columns.saturating_mul(rows) {
            let (found_columns, found_rows) = sides;
            return Err(GridError::WrongSize { columns, rows, found_columns, found_rows });
        }
    }
    let expected = columns.saturating_mul(rows);
    let few_strays = found > expected && found - expected <= columns.min(rows) / 3;
    if few_strays && let Some(only) = only_rectangle(lattice, columns, rows) {
        return Ok(only);
    }
    Err(if found < expected {
        GridError::Partial { columns, rows, found, expected, seen }
    } else {
        GridError::NotRectangular { columns, rows, found }
    })
}

/// The one full rectangle of the asked size in a lattice with a few stray marks beside it (texture that
/// happens to lie where the next mark would). A larger board has at least a whole row more, which is more
/// strays than the caller lets pass.
fn only_rectangle(lattice: &Lattice, columns: usize, rows: usize) -> Option<FullRectangle> {
    let mut only = None;
    for straightening in STRAIGHTENINGS {
        let straight = straightened(lattice, &straightening);
        for (width, height) in [(columns, rows), (rows, columns)] {
            for &(i, j) in straight.keys() {
                let marks: Option<Vec<usize>> = (0..height as i32)
                    .flat_map(|dj| (0..width as i32).map(move |di| (i + di, j + dj)))
                    .map(|place| straight.get(&place).copied())
                    .collect();
                let Some(marks) = marks else { continue };
                if only.is_some() {
                    return None;
                }
                only = Some(FullRectangle { width, height, marks });
            }
            if columns == rows {
                break;
            }
        }
    }
    only
}

/// The lattice seen in other steps.
fn straightened(lattice: &Lattice, [a, b, c, d]: &[i32; 4]) -> Lattice {
    lattice.iter().map(|((i, j), &mark)| ((a * i + b * j, c * i + d * j), mark)).collect()
}

/// The lattice seen in other steps, if it fills its bounding rectangle there.
fn full_rectangle(lattice: &Lattice, [a, b, c, d]: &[i32; 4]) -> Option<FullRectangle> {
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
    Some(FullRectangle { width, height, marks })
}

impl FullRectangle {
    fn mark(&self, i: usize, j: usize) -> usize {
        self.marks[j * self.width + i]
    }

    /// The marks in the order of the convention above.
    fn first_nearest_top_left(&self, centres: &[Vec2], columns: usize, rows: usize) -> Vec<usize> {
        let (w, h) = (self.width - 1, self.height - 1);
        let corners_px = [(0, 0), (w, 0), (0, h), (w, h)].map(|(i, j)| centres[self.mark(i, j)]);
        let order = first_nearest_top_left(corners_px, (self.width, self.height), (columns, rows));
        order.of(columns, rows, self.width, self.height).map(|place| self.marks[place]).collect()
    }
}

/// Whether the axes of a rectangle are swapped, and which are reversed.
struct Order {
    swap: bool,
    flip_i: bool,
    flip_j: bool,
}

impl Order {
    /// The places of a `width x height` rectangle in the order of a board.
    fn of(self, columns: usize, rows: usize, width: usize, height: usize) -> impl Iterator<Item = usize> {
        let Order { swap, flip_i, flip_j } = self;
        (0..rows).flat_map(move |row| (0..columns).map(move |column| (column, row))).map(
            move |(column, row)| {
                let (i, j) = if swap { (row, column) } else { (column, row) };
                let i = if flip_i { width - 1 - i } else { i };
                (if flip_j { height - 1 - j } else { j }) * width + i
            },
        )
    }
}

/// The order of the convention above, of a rectangle with these corners: at (0, 0), (w, 0), (0, h) and (w,
/// h).
fn first_nearest_top_left(
    corners_px: [Vec2; 4],
    (width, height): (usize, usize),
    asked: (usize, usize),
) -> Order {
    let [start, right, below, across] = corners_px;
    // Does (i, j) turn the way (u, v) does? Summed over the whole outline, so no single cell decides.
    let is_right_handed = (across - start).perp(&(below - right)) > 0.0;
    // Orders: swap the axes or not, reverse either. Handedness flips with each swap and each reversal.
    let mut best: Option<(f64, Order)> = None;
    for swap in [false, true] {
        for (flip_i, flip_j) in [(false, false), (true, false), (false, true), (true, true)] {
            let size = if swap { (height, width) } else { (width, height) };
            let keeps_hand = is_right_handed ^ swap ^ flip_i ^ flip_j;
            if size != asked || !keeps_hand {
                continue;
            }
            let first = corners_px[usize::from(flip_i) + 2 * usize::from(flip_j)];
            let distance = first.x + first.y;
            if best.as_ref().is_none_or(|(least, _)| distance < *least) {
                best = Some((distance, Order { swap, flip_i, flip_j }));
            }
        }
    }
    best.map_or(Order { swap: false, flip_i: false, flip_j: false }, |(_, order)| order)
}

/// Every inner mark of a row or column lies near the middle of its neighbours.
fn check_regular(centres: &[Vec2], columns: usize, rows: usize) -> Result<(), GridError> {
    let centre = |column: usize, row: usize| centres[row * columns + column];
    let deviation = |behind: Vec2, here: Vec2, ahead: Vec2| {
        ((behind + ahead) * 0.5 - here).norm() / ((ahead - behind).norm() * 0.5)
    };
    for row in 0..rows {
        for column in 0..columns {
            let here = centre(column, row);
            let mut worst = 0.0f64;
            if column > 0 && column + 1 < columns {
                worst = worst.max(deviation(centre(column - 1, row), here, centre(column + 1, row)));
            }
            if row > 0 && row + 1 < rows {
                worst = worst.max(deviation(centre(column, row - 1), here, centre(column, row + 1)));
            }
            if worst > LARGEST_DEVIATION {
                return Err(GridError::Irregular { column, row, deviation: worst, limit: LARGEST_DEVIATION });
            }
        }
    }
    Ok(())
}
