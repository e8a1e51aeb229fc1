//! Which disc is which of a board whose rows are staggered? All of them, or those that are seen where that is
//! certain.
//!
//! **Places.** Marks lie at whole places `(x, y)` with `x + y` even: row `y`, and in it every second x. A board of
//! `columns x rows` fills a rectangle of `2 columns x rows` places whose lowest is one of them, so that the
//! second row begins farther along than the first. That holds for asymmetric and hexagonal boards alike: they
//! differ by a stretch of y, which perspective can undo, so that a single photograph does not tell them
//! apart.
//!
//! **Order.** Row by row, as [`Board::points`](crate::board::Board::points), seen from the front (X to Y turns the way u
//! turns to v). Half a turn maps the rectangle's even places onto its even ones where the number of rows is
//! even, and onto its odd ones otherwise: an odd number of rows has one order only. Of two, the one whose
//! first mark has the least `u + v`. A quarter turn maps even places onto odd ones or onto those of a
//! rectangle that is no board.

use super::grid_error::GridError;
use super::lattice::{Lattice, Place};
use super::order::{LARGEST_DEVIATION, LEAST_NAMED_SIDE, complete_sides};
use crate::geometry::{Homography, Vec2};
use nalgebra::Matrix2;

/// Fewest marks along a row, and fewest rows. Boards with fewer may have more orders than half a turn
/// explains (2 x 2), and lines too short to confirm each other.
pub const LEAST_COLUMNS: usize = 3;
/// See above.
pub const LEAST_ROWS: usize = 4;

/// Steps of a seed are a short basis of the lattice; so are rows and diagonals, and foreshortening by three
/// changes coefficients by no more than this.
const LARGEST_COEFFICIENT: i32 = 3;

/// Marks that another reading of the same lattice must leave out, else they do not tell which is right: this
/// many, and this part of the shorter side. What else is in a photograph may look like one or two marks.
const LEAST_TELLING: usize = 3;
const LEAST_TELLING_PART: f64 = 0.34;

/// Least part of a board's marks that must be seen.
const LEAST_PART: f64 = 0.5;

/// Neighbours on both sides of a mark: along the row, and along the two diagonals.
const LINES: [Place; 3] = [(2, 0), (1, 1), (1, -1)];

/// How the places of a lattice are those of a board: `x = row_x . (i, j)`, `y = row_y . (i, j)`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Axes {
    row_x: Place,
    row_y: Place,
}

impl Axes {
    /// All that keep the hand of the lattice, 1, or change it, -1.
    fn all(hand: i32) -> impl Iterator<Item = Axes> {
        let coefficients = || -LARGEST_COEFFICIENT..=LARGEST_COEFFICIENT;
        let pairs = move || coefficients().flat_map(move |a| coefficients().map(move |b| (a, b)));
        pairs()
            .flat_map(move |along| pairs().map(move |across| (along, across)))
            .filter(move |((a, b), (c, d))| a * d - b * c == hand)
            // So many marks along a row, and so many rows: a row moves by half of a mark's distance.
            .map(|((a, b), (c, d))| Axes { row_x: (2 * a + c, 2 * b + d), row_y: (c, d) })
    }

    fn place(&self, (i, j): &Place) -> Place {
        (self.row_x.0 * i + self.row_x.1 * j, self.row_y.0 * i + self.row_y.1 * j)
    }

    fn half_turned(&self) -> Axes {
        let turned = |(a, b): Place| (-a, -b);
        Axes { row_x: turned(self.row_x), row_y: turned(self.row_y) }
    }
}

/// Whether a lattice turns the way the image does: 1, or -1 where it is mirrored.
fn hand(lattice: &Lattice, centres: &[Vec2]) -> i32 {
    let count = lattice.len().max(1) as f64;
    let at = |(i, j): &Place| Vec2::new(f64::from(*i), f64::from(*j));
    let mean_place = lattice.keys().map(at).sum::<Vec2>() / count;
    let mean_px = lattice.values().map(|&mark| centres[mark]).sum::<Vec2>() / count;
    // The best linear map from place to pixel is this times a matrix of positive determinant.
    let moment: Matrix2<f64> = lattice
        .iter()
        .map(|(place, &mark)| (centres[mark] - mean_px) * (at(place) - mean_place).transpose())
        .sum();
    if moment.determinant() < 0.0 { -1 } else { 1 }
}

/// A board somewhere in a lattice.
#[derive(Debug, Clone, Copy)]
struct Reading {
    axes: Axes,
    /// Place of the first mark.
    low: Place,
    /// Marks of the lattice that are none of the board.
    left_out: usize,
}

/// All readings that leave out fewer marks than so many.
fn readings(lattice: &Lattice, hand: i32, columns: usize, rows: usize, fewer_than: usize) -> Vec<Reading> {
    let (width, height) = (2 * columns as i32, rows as i32);
    let mut found = Vec::new();
    for axes in Axes::all(hand) {
        let places: Vec<Place> = lattice.keys().map(|place| axes.place(place)).collect();
        let along = starts(places.iter().map(|place| place.0), width, fewer_than);
        if along.is_empty() {
            continue;
        }
        let across = starts(places.iter().map(|place| place.1), height, fewer_than);
        for low in along.iter().flat_map(|&x| across.iter().map(move |&y| (x, y))) {
            if (low.0 + low.1) % 2 != 0 {
                continue;
            }
            let is_inside =
                |(x, y): &&Place| (low.0..low.0 + width).contains(x) && (low.1..low.1 + height).contains(y);
            let left_out = places.len() - places.iter().filter(is_inside).count();
            if left_out < fewer_than {
                found.push(Reading { axes, low, left_out });
            }
        }
    }
    found
}

/// Where a stretch of so many places may begin if it leaves out fewer than so many.
fn starts(places: impl Iterator<Item = i32>, length: i32, fewer_than: usize) -> Vec<i32> {
    let mut sorted: Vec<i32> = places.collect();
    sorted.sort_unstable();
    let (Some(&least), Some(&most)) = (sorted.first(), sorted.last()) else { return Vec::new() };
    let below = |end: i32| sorted.partition_point(|&place| place < end);
    (least - length + 1..=most)
        .filter(|&start| sorted.len() - (below(start + length) - below(start)) < fewer_than)
        .collect()
}

impl Reading {
    /// The board's marks in its order.
    fn marks(&self, lattice: &Lattice, columns: usize, rows: usize) -> Vec<Option<usize>> {
        let mut marks = vec![None; columns * rows];
        for (place, &mark) in lattice {
            let (x, y) = self.axes.place(place);
            let (column, row) = ((x - self.low.0).div_euclid(2), y - self.low.1);
            if (0..columns as i32).contains(&column) && (0..rows as i32).contains(&row) {
                marks[row as usize * columns + column as usize] = Some(mark);
            }
        }
        marks
    }
}

/// Where a board's first mark is, px, be it seen or not.
fn first_px(marks: &[Option<usize>], centres: &[Vec2], columns: usize) -> Option<Vec2> {
    if let Some(Some(first)) = marks.first() {
        return Some(centres[*first]);
    }
    let seen = || marks.iter().enumerate().filter_map(|(index, mark)| Some((index, (*mark)?)));
    let from: Vec<Vec2> = seen().map(|(index, _)| on_board(index, columns)).collect();
    let to: Vec<Vec2> = seen().map(|(_, mark)| centres[mark]).collect();
    Homography::fit(&from, &to).ok()?.homography.apply(&on_board(0, columns))
}

/// The place of a mark by its number.
fn place_on_board(index: usize, columns: usize) -> Place {
    let (column, row) = ((index % columns) as i32, (index / columns) as i32);
    (2 * column + row % 2, row)
}

/// The places of all marks of a board, in its order.
pub fn places_on_board(columns: usize, rows: usize) -> Vec<Vec2> {
    (0..columns * rows).map(|index| on_board(index, columns)).collect()
}

fn on_board(index: usize, columns: usize) -> Vec2 {
    let (x, y) = place_on_board(index, columns);
    Vec2::new(f64::from(x), f64::from(y))
}

/// The marks by the only one of some readings, or by that of two half a turn apart whose first mark is nearer
/// to the top left; `None` where there is a choice.
fn only(
    readings: &[Reading],
    lattice: &Lattice,
    centres: &[Vec2],
    (columns, rows): (usize, usize),
) -> Option<Vec<Option<usize>>> {
    match readings {
        [one] => Some(one.marks(lattice, columns, rows)),
        [one, other] if one.axes == other.axes.half_turned() => {
            let [one, other] = [one, other].map(|reading| reading.marks(lattice, columns, rows));
            let [to_one, to_other] = [&one, &other].map(|marks| first_px(marks, centres, columns));
            Some(if to_other?.sum() < to_one?.sum() { other } else { one })
        }
        _ => None,
    }
}

/// Columns and rows of a lattice that is a complete board of staggered rows.
pub fn complete_size(lattice: &Lattice, centres: &[Vec2]) -> Option<(usize, usize)> {
    if lattice.len() < LEAST_COLUMNS * LEAST_ROWS {
        return None;
    }
    Axes::all(hand(lattice, centres)).find_map(|axes| {
        let places = || lattice.keys().map(|place| axes.place(place));
        let (low, high) = (places().map(|p| p.0).min()?, places().map(|p| p.0).max()?);
        let (top, bottom) = (places().map(|p| p.1).min()?, places().map(|p| p.1).max()?);
        let (width, rows) = ((high - low + 1) as usize, (bottom - top + 1) as usize);
        let columns = width / 2;
        let is_board = width == 2 * columns && columns * rows == lattice.len() && (low + top) % 2 == 0;
        (is_board && columns >= LEAST_COLUMNS && rows >= LEAST_ROWS).then_some((columns, rows))
    })
}

/// The marks of a lattice in the order of a board of `rows` staggered rows of `columns`. `centres[mark]` is a
/// mark's place in the image.
///
/// # Errors
/// See [`GridError`].
pub fn ordered_staggered(
    lattice: &Lattice,
    centres: &[Vec2],
    columns: usize,
    rows: usize,
) -> Result<Vec<usize>, GridError> {
    let (found, expected) = (lattice.len(), columns.saturating_mul(rows));
    // A larger board has at least a whole row or column more.
    let most_strays = columns.min(rows) / 3;
    if found >= expected && found - expected <= most_strays {
        let strays = found - expected;
        let complete: Vec<Reading> = readings(lattice, hand(lattice, centres), columns, rows, strays + 1)
            .into_iter()
            .filter(|reading| reading.left_out == strays)
            .collect();
        let marks = only(&complete, lattice, centres, (columns, rows));
        if let Some(marks) = marks.and_then(|marks| marks.into_iter().collect::<Option<Vec<usize>>>()) {
            check_regular(&marks, centres, columns)?;
            return Ok(marks);
        }
    }
    Err(not_there(lattice, centres, columns, rows))
}

/// Why a lattice is not the board that was asked for.
fn not_there(lattice: &Lattice, centres: &[Vec2], columns: usize, rows: usize) -> GridError {
    let (found, expected, seen) = (lattice.len(), columns.saturating_mul(rows), centres.len());
    if let Some((found_columns, found_rows)) = complete_size(lattice, centres) {
        // A quarter turn of the mirror image.
        return if found_rows == 2 * columns && rows == 2 * found_columns {
            GridError::Mirrored { columns, rows, found_columns, found_rows }
        } else {
            GridError::Staggered { columns, rows, found_columns, found_rows }
        };
    }
    if let Some((found_columns, found_rows)) = complete_sides(lattice)
        && found_rows >= LEAST_NAMED_SIDE
    {
        return GridError::InLine { columns, rows, found_columns, found_rows };
    }
    if found < expected {
        GridError::Partial { columns, rows, found, expected, seen }
    } else {
        GridError::NotRectangular { columns, rows, found }
    }
}

/// The marks of a lattice in the order of a board of which marks are hidden; `None` where it is not certain
/// which: no mark may lie beside the board, half of its marks must be there and enough of its ends, and every
/// other reading must leave some out.
pub fn ordered_staggered_part(
    lattice: &Lattice,
    centres: &[Vec2],
    columns: usize,
    rows: usize,
) -> Option<Vec<Option<usize>>> {
    let expected = columns.saturating_mul(rows);
    if lattice.len() > expected || (lattice.len() as f64) < LEAST_PART * expected as f64 {
        return None;
    }
    let telling = libm::ceil(LEAST_TELLING_PART * columns.min(rows / 2) as f64) as usize;
    let readings = readings(lattice, hand(lattice, centres), columns, rows, LEAST_TELLING.max(telling));
    if readings.iter().any(|reading| reading.left_out > 0) {
        return None;
    }
    let marks = only(&readings, lattice, centres, (columns, rows))?;
    ends_are_seen(&marks, columns).then_some(marks)
}

/// Whether enough marks of the outermost rows and columns are there: what is missing may be missing on the
/// board itself, which is then another one. A board of 5 x 8 is, a quarter turn on, one of 4 x 11 without its
/// first row.
fn ends_are_seen(marks: &[Option<usize>], columns: usize) -> bool {
    let last_row = marks.len() / columns - 1;
    let enough = |is_on_side: &dyn Fn(usize, usize) -> bool| {
        let side = || (0..marks.len()).filter(|index| is_on_side(index % columns, index / columns));
        let (count, of) = (side().filter(|&index| marks[index].is_some()).count(), side().count());
        count >= LEAST_TELLING.min(of) && count as f64 > LEAST_TELLING_PART * of as f64
    };
    enough(&|_, row| row == 0)
        && enough(&|_, row| row == last_row)
        && enough(&|column, row| column == 0 && row % 2 == 0)
        && enough(&|column, row| column == columns - 1 && row % 2 == 1)
}

/// The marks of a board by their places along its two diagonals, so that neighbours are the nearest; and how
/// many are in a line. For what compares marks with those beside them in a grid.
pub fn along_diagonals(places_px: &[Option<Vec2>], columns: usize) -> (Vec<Option<Vec2>>, usize) {
    let (slots, width, height) = diagonal_slots(places_px.len(), columns);
    let mut grid = vec![None; width * height];
    slots.iter().zip(places_px).for_each(|(&slot, place)| grid[slot] = *place);
    (grid, width)
}

/// The marks of a board again, from [`along_diagonals`].
pub fn from_diagonals(grid: &[Option<Vec2>], count: usize, columns: usize) -> Vec<Option<Vec2>> {
    diagonal_slots(count, columns).0.into_iter().map(|slot| grid[slot]).collect()
}

/// The slot of each mark in a grid along the diagonals, and the grid's width and height.
fn diagonal_slots(count: usize, columns: usize) -> (Vec<usize>, usize, usize) {
    let places = (0..count).map(|index| place_on_board(index, columns));
    // (x + y) / 2 and (y - x) / 2, the latter from where it is least.
    let diagonal: Vec<(usize, usize)> =
        places.map(|(x, y)| (((x + y) / 2) as usize, ((y - x) / 2 + columns as i32) as usize)).collect();
    let width = diagonal.iter().map(|slot| slot.0 + 1).max().unwrap_or(0);
    let height = diagonal.iter().map(|slot| slot.1 + 1).max().unwrap_or(0);
    (diagonal.into_iter().map(|(along, across)| across * width + along).collect(), width, height)
}

/// Every mark lies near the middle of its neighbours on both sides.
fn check_regular(marks: &[usize], centres: &[Vec2], columns: usize) -> Result<(), GridError> {
    let rows = marks.len() / columns;
    let at = |(x, y): Place| {
        let inside = x >= 0 && y >= 0 && x < 2 * columns as i32 && y < rows as i32;
        inside.then(|| centres[marks[y as usize * columns + x as usize / 2]])
    };
    for (index, &mark) in marks.iter().enumerate() {
        let (x, y) = place_on_board(index, columns);
        for (along, across) in LINES {
            let ends = (at((x - along, y - across)), at((x + along, y + across)));
            let (Some(behind), Some(ahead)) = ends else { continue };
            let deviation = ((behind + ahead) * 0.5 - centres[mark]).norm() / ((ahead - behind).norm() * 0.5);
            if deviation > LARGEST_DEVIATION {
                let (column, row) = (index % columns, index / columns);
                return Err(GridError::Irregular { column, row, deviation, limit: LARGEST_DEVIATION });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
