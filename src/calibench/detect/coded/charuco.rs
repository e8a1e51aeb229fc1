//! Where are the corners of a ChArUco board? A chessboard's lattice, and which part of the board it is by the
//! markers in its white squares.
//!
//! 1. Corners are searched and joined to lattices as on a plain chessboard, only that near an edge nothing but a narrow
//!    strip of a white square is white.
//! 2. The markers of a lattice are read through the homography of the corners about each, and vote for a place of the
//!    lattice on the board.
//! 3. Corners are fitted to the photograph's pixels, those of markers left out.

use super::cells::{Patch, read};
use super::dictionary::{Cells, Dictionary, Recognised, mirrored};
use super::layout::Charuco;
use super::placement::{Placement, Vote};
use super::{CodedError, FEWEST_OF_ANOTHER};
use crate::detect::chessboard::candidates::{Candidate, Strength, candidates};
use crate::detect::chessboard::growth::lattices;
use crate::detect::chessboard::level::{Pyramid, photo_from_level};
use crate::detect::chessboard::look::Look;
use crate::detect::chessboard::refine::refined;
use crate::detect::chessboard::search_order;
use crate::detect::lattice::{Lattice, Place};
use crate::detect::misplaced::take_out_beside;
use crate::detect::{Orientation, SeenBoard};
use crate::geometry::{Homography, Vec2};
use crate::raster::{Level, Raster};
use std::collections::BTreeSet;

/// Fewest corners whose places make a view.
const FEWEST_MARKS: usize = 4;

/// Lattices of a level that are looked at: what covers a board may cut it in pieces, and markers have small
/// ones of their own.
const MOST_LATTICES: usize = 12;

/// Least difference of a marker's white and black, as part of the corners' contrast.
const LEAST_CONTRAST: f64 = 0.3;

/// Corners that lie beyond the board's edge, as part of all, that may be chance; one always may. A row or a
/// column of them is a board that goes on.
const MOST_BEYOND: f64 = 0.05;

/// How far a corner may lie from where the plane through all has it, in squares: pieces of a lattice that are
/// placed differently are a whole square apart, and no lens bends a board by so much.
const MOST_BENT: f64 = 0.6;

/// Finds the inner corners of a ChArUco board that are seen, row by row from the board's first square:
/// `columns - 1` along a row. Which they are is certain: at least two markers agree on it, and ten for each
/// that does not.
///
/// # Errors
/// See [`CodedError`].
pub fn seen_charuco<T: Level>(image: &Raster<T>, board: &Charuco) -> Result<SeenBoard, CodedError> {
    let search = Search { pyramid: Pyramid::new(image), board, look: Look::with_markers(board.marker()) };
    let mut best: Option<Placed> = None;
    let mut failures: Vec<Failure> = Vec::new();
    for level in search_order(image, search.pyramid.levels()) {
        match search.in_level(level, &mut failures) {
            Some(placed) if best.as_ref().is_none_or(|best| placed.count() > best.count()) => {
                best = Some(placed);
            }
            _ => {}
        }
        if best.as_ref().is_some_and(|best| best.is_all(&search)) {
            break;
        }
    }
    match best {
        Some(placed) => {
            search.refuse_if_of_any_width(&placed, &failures)?;
            search.fitted(&placed)
        }
        None => {
            let failure = failures.into_iter().reduce(|first, next| next.or(first));
            Err(failure.map_or(CodedError::NoCorners { seen: 0 }, |failure| search.explained(failure)))
        }
    }
}

struct Search<'a, T> {
    pyramid: Pyramid<'a, T>,
    board: &'a Charuco,
    look: Look,
}

/// The corners of a board in a level, in the board's order, px of the level.
struct Placed {
    level: usize,
    corners: Vec<Option<Vec2>>,
    /// Numbers of the markers that agree on where they are.
    markers: BTreeSet<usize>,
}

/// A lattice in a level: where its corners are in the photograph, px.
struct Part {
    corners: Vec<(Place, Vec2)>,
    lattice: Lattice,
    /// Contrast of its middle corner.
    contrast: f64,
}

/// A white square whose inside was read.
struct Square {
    low: Place,
    cells: Cells,
}

/// Why a level has no board.
struct Failure {
    error: CodedError,
    /// The largest lattice.
    part: Option<Part>,
}

impl Failure {
    /// How much an error tells.
    fn rank(&self) -> usize {
        match self.error {
            CodedError::NoCorners { seen } => (seen > 0).into(),
            CodedError::NoMarker { corners, .. } => 1 + corners,
            CodedError::OneMarker { .. } => usize::MAX - 2,
            CodedError::Disagree { .. } => usize::MAX - 1,
            _ => usize::MAX,
        }
    }

    /// The one that tells more.
    fn or(self, other: Failure) -> Failure {
        if other.rank() >= self.rank() { other } else { self }
    }
}

impl<T: Level> Search<'_, T> {
    /// Inner corners along a row.
    fn columns(&self) -> usize {
        self.board.columns() - 1
    }

    /// Strong corners first; where they do not make the board, all.
    fn in_level(&self, level: usize, failures: &mut Vec<Failure>) -> Option<Placed> {
        [Strength::Strong, Strength::Any]
            .into_iter()
            .find_map(|strength| self.among(level, strength).map_err(|failure| failures.push(failure)).ok())
    }

    fn among(&self, level: usize, strength: Strength) -> Result<Placed, Failure> {
        let smoothed = self.pyramid.smoothed(level);
        let candidates = candidates(&smoothed, strength);
        let mut failure = Failure { error: CodedError::NoCorners { seen: candidates.len() }, part: None };
        let count = self.columns() * (self.board.rows() - 1);
        let grown = lattices(&smoothed, &self.look, candidates, count);
        let mut placed = Placed { level, corners: vec![None; count], markers: BTreeSet::new() };
        for lattice in grown.lattices.into_iter().take(MOST_LATTICES) {
            let part = Part::of(lattice, &grown.corners, level);
            match self.placement(&part) {
                Ok((placement, markers)) => {
                    // The largest piece comes first, and others must lie in its plane.
                    let mut with = self.with(&placed, &part, &placement, &grown.corners);
                    with.markers.extend(markers);
                    if placed.count() == 0 || with.is_flat(self.columns()) {
                        placed = with;
                    }
                }
                // A piece whose markers contradict each other puts all in doubt: the board may be another.
                Err(error) if error.is_grave() => return Err(Failure { error, part: Some(part) }),
                Err(error) => failure = Failure { error, part: Some(part) }.or(failure),
            }
        }
        if placed.count() > 0 { Ok(placed) } else { Err(failure) }
    }

    /// Markers of one row stand to each other alike on boards of any width, and those of two rows may on
    /// another one. That the board is the one asked is taken for granted, but not where others were read in
    /// the photograph that contradict it.
    fn refuse_if_of_any_width(&self, placed: &Placed, failures: &[Failure]) -> Result<(), CodedError> {
        let contradicted = failures.iter().any(|failure| failure.error.is_grave());
        match another_width(&self.board.markers(), self.board.columns(), &placed.markers) {
            Some(other) if contradicted => Err(CodedError::AnyWidth {
                markers: placed.markers.len(),
                columns: self.board.columns(),
                other,
            }),
            _ => Ok(()),
        }
    }

    /// Where on the board a lattice is, and the numbers of the markers that say so.
    fn placement(&self, part: &Part) -> Result<(Placement, Vec<usize>), CodedError> {
        let dictionary = self.board.dictionary();
        let read: Vec<(Place, Recognised)> = self
            .squares(part, dictionary.side())
            .into_iter()
            .filter_map(|square| Some((square.low, dictionary.recognise(square.cells, dictionary.len())?)))
            .collect();
        let markers = self.board.markers();
        let opinions: Vec<Option<Placement>> = read.iter().map(|read| opinion(read, &markers)).collect();
        let vote = match (Vote::of(&opinions), &read[..]) {
            (Some(vote), _) if vote.is_certain() => vote,
            (_, []) => return Err(CodedError::NoMarker { corners: part.corners.len(), dictionary }),
            (_, [(_, marker)]) => return Err(CodedError::OneMarker { id: marker.id }),
            (vote, _) => return Err(self.disagree(vote, &read)),
        };
        let beyond =
            part.corners.iter().filter(|(place, _)| self.index(&vote.placement, *place).is_none()).count();
        if beyond as f64 > (MOST_BEYOND * part.corners.len() as f64).max(1.0) {
            return Err(CodedError::GoesOn { columns: self.board.columns(), rows: self.board.rows() });
        }
        let for_it = read.iter().zip(&opinions).filter(|(_, opinion)| **opinion == Some(vote.placement));
        Ok((vote.placement, for_it.map(|((_, marker), _)| marker.id).collect()))
    }

    fn disagree(&self, vote: Option<Vote>, read: &[(Place, Recognised)]) -> CodedError {
        let (columns, rows) = (self.board.columns(), self.board.rows());
        let agree = vote.map_or(0, |vote| vote.agree);
        let other = other_board(read, (columns, !self.board.starts_dark()), agree);
        CodedError::Disagree { agree, read: read.len(), columns, rows, other }
    }

    /// The index of the board's corner at a place of a lattice.
    fn index(&self, placement: &Placement, place: Place) -> Option<usize> {
        let (column, row) = placement.on_board(place);
        let (columns, rows) = (self.columns() as i32, self.board.rows() as i32 - 1);
        let inside = (1..=columns).contains(&column) && (1..=rows).contains(&row);
        inside.then(|| ((row - 1) * columns + column - 1) as usize)
    }

    /// The corners with those of another piece.
    fn with(&self, placed: &Placed, part: &Part, placement: &Placement, corners: &[Candidate]) -> Placed {
        let mut with =
            Placed { level: placed.level, corners: placed.corners.clone(), markers: placed.markers.clone() };
        for (&place, &mark) in &part.lattice {
            if let Some(index) = self.index(placement, place) {
                with.corners[index].get_or_insert(corners[mark].at);
            }
        }
        with
    }

    /// The white squares of a lattice in which something like a marker of `side` cells a side can be read.
    fn squares(&self, part: &Part, side: usize) -> Vec<Square> {
        let with_corner: BTreeSet<Place> = part
            .lattice
            .keys()
            .flat_map(|&(i, j)| [(i, j), (i - 1, j), (i, j - 1), (i - 1, j - 1)])
            // Squares after places of even sum are dark.
            .filter(|(i, j)| (i + j).rem_euclid(2) == 1)
            .collect();
        let read_one = |low: Place| {
            let marker = self.board.marker();
            let white = 0.5 * (1.0 - marker);
            let photo_from_marker = part.homography(low, white, marker)?;
            let patch = Patch { photo_from_marker, border: 1, white: white / marker, inside: 1.0 };
            let cells = read(&self.pyramid, &patch, side, LEAST_CONTRAST * part.contrast)?.plain;
            Some(Square { low, cells })
        };
        with_corner.into_iter().filter_map(read_one).collect()
    }

    /// The same of every dictionary whose markers have such a side; none of a side that no dictionary has.
    fn squares_of(&self, part: &Part, side: usize) -> Vec<Square> {
        let is_known = Dictionary::all().any(|dictionary| dictionary.side() == side);
        if is_known { self.squares(part, side) } else { Vec::new() }
    }

    /// The corners, fitted in the photograph.
    fn fitted(&self, placed: &Placed) -> Result<SeenBoard, CodedError> {
        let (columns, rows) = (self.columns(), self.board.rows() - 1);
        let dark = self.board.starts_dark();
        let fitted = refined(&self.pyramid, placed.level, &placed.corners, columns, dark, &self.look);
        let mut corners = fitted.alike(self.pyramid.photo(), columns);
        // Where all is moved, a corner may be fitted to a marker's edge.
        let place = |index: usize| Vec2::new((index % columns) as f64, (index / columns) as f64);
        take_out_beside(&mut corners, &(0..columns * rows).map(place).collect::<Vec<Vec2>>());
        let found = corners.iter().flatten().count();
        if found < FEWEST_MARKS {
            return Err(CodedError::Unclear { found });
        }
        Ok(SeenBoard::new(columns, rows, corners, Orientation::Fixed))
    }

    /// The error, or that the markers are seen as in a mirror or are of another dictionary.
    fn explained(&self, failure: Failure) -> CodedError {
        // Of a few markers by chance.
        let (Some(part), Some(of_asked)) = (&failure.part, failure.error.by_chance()) else {
            return failure.error;
        };
        let asked = self.board.dictionary();
        let read: Vec<Vec<Square>> = (0..=MOST_CELLS).map(|side| self.squares_of(part, side)).collect();
        let count_in = |dictionary: &Dictionary, as_seen: &dyn Fn(Cells) -> Cells| {
            let cells = read[dictionary.side()].iter().map(|square| as_seen(square.cells));
            let read = cells.filter_map(|cells| dictionary.recognise(cells, dictionary.len()));
            read.filter(|marker| marker.wrong == 0).count()
        };
        let mut others: Vec<(usize, Dictionary)> =
            Dictionary::all().map(|dictionary| (count_in(&dictionary, &|cells| cells), dictionary)).collect();
        // Of equal counts the first stays the first: the smallest.
        others.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
        let in_mirror = count_in(&asked, &|cells| mirrored(cells, asked.side()));
        if in_mirror >= FEWEST_OF_ANOTHER.max(others[0].0).max(of_asked + 1) {
            return CodedError::Mirrored { count: in_mirror };
        }
        match others[..] {
            [(count, seen), ..] if count >= FEWEST_OF_ANOTHER.max(of_asked + 1) && seen != asked => {
                CodedError::OtherDictionary { asked, seen, count }
            }
            _ => failure.error,
        }
    }
}

/// Most cells along a side of any dictionary's markers.
const MOST_CELLS: usize = 7;

/// Where a marker puts its square on a board.
fn opinion((low, marker): &(Place, Recognised), markers: &[(usize, usize)]) -> Option<Placement> {
    let (column, row) = *markers.get(marker.id)?;
    Some(Placement::of_square(*low, (column as i32, row as i32), marker.turns))
}

/// Widest board that is tried where markers do not stand as on the one that was asked.
const WIDEST: usize = 40;

/// The board on which more markers agree than on that asked: its width, and whether it begins with a white
/// square.
fn other_board(read: &[(Place, Recognised)], asked: (usize, bool), agree: usize) -> Option<(usize, bool)> {
    let last = read.iter().map(|(_, marker)| marker.id).max()?;
    let agree_on = |(width, white): (usize, bool)| {
        let markers = first_squares(width, white, last + 1);
        let opinions: Vec<Option<Placement>> = read.iter().map(|read| opinion(read, &markers)).collect();
        Vote::of(&opinions).filter(Vote::is_certain).map_or(0, |vote| vote.agree)
    };
    let others = other_boards().filter(|&board| board != asked).map(|board| (agree_on(board), board));
    // Of equal ones the last: black comes first on most boards.
    let (most, board) = others.max_by_key(|(count, _)| *count)?;
    (most > agree).then_some(board)
}

/// The width of another board on which these markers stand to each other as on one of width `columns` with
/// its markers in these squares.
fn another_width(squares: &[(usize, usize)], columns: usize, markers: &BTreeSet<usize>) -> Option<usize> {
    let last = *markers.last()?;
    let stand_alike = |&(width, white): &(usize, bool)| {
        let there = first_squares(width, white, last + 1);
        let shift = |&id: &usize| {
            let ((a, b), (c, d)) = (there[id], squares[id]);
            (a as isize - c as isize, b as isize - d as isize)
        };
        let mut shifts = markers.iter().map(shift);
        let first = shifts.next();
        shifts.all(|shift| Some(shift) == first)
    };
    other_boards().find(|board| board.0 != columns && stand_alike(board)).map(|(width, _)| width)
}

/// Widths of boards, and whether they begin with a white square.
fn other_boards() -> impl Iterator<Item = (usize, bool)> {
    (3..=WIDEST).flat_map(|width| [(width, true), (width, false)])
}

/// The white squares of a board, column and row, in the order of their markers.
fn first_squares(width: usize, starts_white: bool, count: usize) -> Vec<(usize, usize)> {
    let squares = (0..).flat_map(|row| (0..width).map(move |column| (column, row)));
    squares.filter(|(column, row)| ((column + row) % 2 == 0) == starts_white).take(count).collect()
}

impl Part {
    fn of(lattice: Lattice, corners: &[Candidate], level: usize) -> Part {
        let places =
            lattice.iter().map(|(&place, &mark)| (place, photo_from_level(&corners[mark].at, level)));
        let mut contrasts: Vec<f64> = lattice.values().map(|&mark| corners[mark].contrast).collect();
        contrasts.sort_by(f64::total_cmp);
        let contrast = contrasts.get(contrasts.len() / 2).copied().unwrap_or(0.0);
        Part { corners: places.collect(), contrast, lattice }
    }

    /// From the unit square of a marker to the photograph, through the corners about its square, the nearest
    /// that fix a homography.
    fn homography(&self, (i, j): Place, white: f64, marker: f64) -> Option<Homography> {
        (0..MOST_REACH).find_map(|reach| {
            let is_near = |&&((a, b), _): &&(Place, Vec2)| {
                (i - reach..=i + 1 + reach).contains(&a) && (j - reach..=j + 1 + reach).contains(&b)
            };
            let on_marker = |(a, b): Place| {
                (Vec2::new(f64::from(a - i), f64::from(b - j)) - Vec2::repeat(white)) / marker
            };
            let near = || self.corners.iter().filter(is_near);
            let from: Vec<Vec2> = near().map(|(place, _)| on_marker(*place)).collect();
            let to: Vec<Vec2> = near().map(|(_, at)| *at).collect();
            Homography::fit(&from, &to).ok().map(|fit| fit.homography)
        })
    }
}

/// How far corners are taken from, in squares.
const MOST_REACH: i32 = 3;

impl Placed {
    fn count(&self) -> usize {
        self.corners.iter().flatten().count()
    }

    /// From the board's corners, counted along rows and down columns, to the photograph.
    fn plane(&self, columns: usize) -> Option<Homography> {
        let seen = || self.corners.iter().enumerate().filter_map(|(index, at)| Some((index, (*at)?)));
        let from: Vec<Vec2> = seen().map(|(index, _)| on_board(index, columns)).collect();
        let to: Vec<Vec2> = seen().map(|(_, at)| photo_from_level(&at, self.level)).collect();
        Homography::fit(&from, &to).ok().map(|fit| fit.homography)
    }

    /// Whether all corners lie about where the plane through them has them.
    fn is_flat(&self, columns: usize) -> bool {
        let Some(plane) = self.plane(columns) else { return false };
        (0..self.corners.len()).all(|index| {
            let Some(at) = self.corners[index] else { return true };
            let at_offset = |x: f64, y: f64| plane.apply(&(on_board(index, columns) + Vec2::new(x, y)));
            let (Some(expected), Some(right), Some(below)) =
                (at_offset(0.0, 0.0), at_offset(1.0, 0.0), at_offset(0.0, 1.0))
            else {
                return false;
            };
            let square_px = (right - expected).norm().min((below - expected).norm());
            (photo_from_level(&at, self.level) - expected).norm() < MOST_BENT * square_px
        })
    }

    /// Whether no corner of the board is missing that should be in the image.
    fn is_all<T: Level>(&self, search: &Search<'_, T>) -> bool {
        let columns = search.columns();
        let Some(plane) = self.plane(columns) else { return false };
        let (width, height) = (search.pyramid.photo().width() as f64, search.pyramid.photo().height() as f64);
        let is_outside = |index: usize| {
            let inside = |p: &Vec2| (0.0..width).contains(&p.x) && (0.0..height).contains(&p.y);
            !plane.apply(&on_board(index, columns)).is_some_and(|p| inside(&p))
        };
        (0..self.corners.len()).all(|index| self.corners[index].is_some() || is_outside(index))
    }
}

fn on_board(index: usize, columns: usize) -> Vec2 {
    Vec2::new((index % columns) as f64, (index / columns) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markers_of_one_row_stand_alike_on_boards_of_any_width_and_those_of_two_may_on_another() {
        // Six squares wide, black first: markers 0, 1, 2 after one square each, and 3, 4, 5 in the row below.
        let squares = first_squares(6, false, 12);
        assert_eq!(squares[..4], [(1, 0), (3, 0), (5, 0), (0, 1)]);
        let other = |markers: &[usize]| another_width(&squares, 6, &markers.iter().copied().collect());
        assert!(other(&[0, 1]).is_some() && other(&[3, 4, 5]).is_some());
        // On one seven squares wide the second row goes on to marker 6, and the third begins later.
        assert_eq!(other(&[0, 1, 2, 3, 4, 5]), Some(7));
        assert_eq!(other(&[0, 3, 6]), None);
    }
}
