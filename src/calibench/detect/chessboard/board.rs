//! Is the asked board in a lattice, and which corner is its first? A complete rectangle, ordered by the
//! colours of its squares.

use super::Orientation;
use super::growth::axes_at;
use crate::detect::lattice::{Lattice, Place};
use crate::detect::rectangle::Rectangle;
use crate::geometry::{Homography, Vec2};
use std::collections::BTreeMap;

/// What a lattice holds of a board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Found {
    /// The board.
    Board(Rectangle),
    /// A full rectangle that is another board.
    Other {
        /// Its larger side.
        columns: usize,
        /// Its smaller side.
        rows: usize,
    },
    /// No such rectangle.
    Incomplete,
}

/// Looks for a board of `columns x rows` in a lattice.
pub fn find(lattice: &Lattice, columns: usize, rows: usize) -> Found {
    let mut full = lattice
        .keys()
        .flat_map(|&low| {
            [(columns, rows), (rows, columns)].map(|(width, height)| Rectangle { low, width, height })
        })
        .filter(|rectangle| rectangle.is_full(lattice));
    // Of a square board both ways round are one.
    let only = full.next().filter(|first| full.all(|other| other == *first));
    if let Some(board) = only.filter(|only| !only.goes_on(lattice)) {
        return Found::Board(board);
    }
    match largest(lattice) {
        Some(seen) if !seen.goes_on(lattice) => {
            Found::Other { columns: seen.width.max(seen.height), rows: seen.width.min(seen.height) }
        }
        _ => Found::Incomplete,
    }
}

/// The full rectangle with the most places, at least 3 x 3; of equal ones the first, and the lower.
fn largest(lattice: &Lattice) -> Option<Rectangle> {
    let runs = runs(lattice);
    let (mut best, mut most) = (None, 0);
    for (&low, &(mut width, below)) in &runs {
        for height in 1..=below {
            width = width.min(runs[&(low.0, low.1 + height as i32 - 1)].0);
            if width * below <= most {
                break;
            }
            if width.min(height) >= 3 && width * height > most {
                (best, most) = (Some(Rectangle { low, width, height }), width * height);
            }
        }
    }
    best
}

/// How many places follow each other from every place on, itself among them: along i, and along j.
fn runs(lattice: &Lattice) -> BTreeMap<Place, (usize, usize)> {
    let mut runs = BTreeMap::<Place, (usize, usize)>::new();
    for &(i, j) in lattice.keys().rev() {
        let along_i = runs.get(&(i + 1, j)).map_or(0, |next| next.0);
        let along_j = runs.get(&(i, j + 1)).map_or(0, |next| next.1);
        runs.insert((i, j), (along_i + 1, along_j + 1));
    }
    runs
}

/// A rectangle's marks in the board's order.
pub struct Ordered {
    /// Marks of the lattice, row by row; `None` for those that are hidden.
    pub marks: Vec<Option<usize>>,
    /// How far the image fixes the first.
    pub orientation: Orientation,
    /// Whether the square before the first is dark.
    pub starts_dark: bool,
}

/// The order of a rectangle's marks.
///
/// Orders that see the board from its front and have the asked columns and rows: one, of a rectangle, or two
/// of a square, and as many from the other end. Where some have a dark square at the board's origin, before
/// the first mark, and others a bright one, the dark ones are the board. Among what remains the first mark is
/// the one nearest to the image's top left.
pub fn ordered(
    lattice: &Lattice,
    rectangle: &Rectangle,
    places_px: &[Vec2],
    (columns, rows): (usize, usize),
) -> Ordered {
    let orders: Vec<Order> =
        Order::all(rectangle).into_iter().filter(|order| order.size == (columns, rows)).collect();
    let some_dark = orders.iter().any(Order::starts_dark);
    let mut left: Vec<Order> = orders.into_iter().filter(|order| order.starts_dark() == some_dark).collect();
    if left.len() > 1 {
        let first_px = |order: &Order| place_px(lattice, places_px, order.place(0, 0)).sum();
        left.sort_by(|a, b| first_px(a).total_cmp(&first_px(b)));
    }
    let orientation = match left.len() {
        1 => Orientation::Fixed,
        2 => Orientation::HalfTurn,
        _ => Orientation::QuarterTurn,
    };
    let marks = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
    let order = left[0];
    let marks =
        marks.map(|(column, row)| lattice.get(&order.place(column as i32, row as i32)).copied()).collect();
    Ordered { marks, orientation, starts_dark: some_dark }
}

/// Where a place of a lattice is, or, where its mark is hidden, where the plane through the others has it.
fn place_px(lattice: &Lattice, places_px: &[Vec2], place: Place) -> Vec2 {
    if let Some(&mark) = lattice.get(&place) {
        return places_px[mark];
    }
    let on_board = |(i, j): Place| Vec2::new(f64::from(i), f64::from(j));
    let from: Vec<Vec2> = lattice.keys().map(|&place| on_board(place)).collect();
    let to: Vec<Vec2> = lattice.values().map(|&mark| places_px[mark]).collect();
    let plane = Homography::fit(&from, &to).ok();
    plane.and_then(|plane| plane.homography.apply(&on_board(place))).unwrap_or_else(Vec2::zeros)
}

/// A way to count a rectangle's places.
#[derive(Debug, Clone, Copy)]
struct Order {
    first: Place,
    along_row: Place,
    along_column: Place,
    size: (usize, usize),
}

impl Order {
    /// The four quarter turns; none is mirrored.
    fn all(rectangle: &Rectangle) -> [Order; 4] {
        let (w, h) = (rectangle.width, rectangle.height);
        let corner = |i: usize, j: usize| (rectangle.low.0 + i as i32, rectangle.low.1 + j as i32);
        let order = |first, along_row, along_column, size| Order { first, along_row, along_column, size };
        [
            order(corner(0, 0), (1, 0), (0, 1), (w, h)),
            order(corner(w - 1, 0), (0, 1), (-1, 0), (h, w)),
            order(corner(w - 1, h - 1), (-1, 0), (0, -1), (w, h)),
            order(corner(0, h - 1), (0, -1), (1, 0), (h, w)),
        ]
    }

    fn place(&self, column: i32, row: i32) -> Place {
        let (a, b) = (self.along_row, self.along_column);
        (self.first.0 + column * a.0 + row * b.0, self.first.1 + column * a.1 + row * b.1)
    }

    /// Whether the square before the first mark is dark: it has the colour of the square behind it.
    fn starts_dark(&self) -> bool {
        let dark_between_i_and_j = axes_at(self.first) == (0, 1);
        // Quarter turns exchange the colours of the quadrants.
        let is_half_turn = self.along_row.1 == 0;
        dark_between_i_and_j == is_half_turn
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lattice(width: i32, height: i32) -> Lattice {
        (0..height).flat_map(|j| (0..width).map(move |i| ((i, j), (j * width + i) as usize))).collect()
    }

    fn places_px(width: usize, height: usize) -> Vec<Vec2> {
        (0..height).flat_map(|j| (0..width).map(move |i| Vec2::new(i as f64, j as f64))).collect()
    }

    #[test]
    fn a_board_is_found_in_either_direction_and_another_is_named() {
        let board = Rectangle { low: (0, 0), width: 9, height: 6 };
        assert_eq!(find(&lattice(9, 6), 9, 6), Found::Board(board));
        assert_eq!(find(&lattice(9, 6), 6, 9), Found::Board(board));
        assert_eq!(find(&lattice(7, 7), 7, 7), Found::Board(Rectangle { low: (0, 0), width: 7, height: 7 }));
        assert_eq!(find(&lattice(10, 7), 9, 6), Found::Other { columns: 10, rows: 7 });
        assert_eq!(find(&lattice(9, 6), 10, 7), Found::Other { columns: 9, rows: 6 });
        assert_eq!(find(&lattice(9, 7), 9, 6), Found::Other { columns: 9, rows: 7 });
    }

    /// The definition, place by place: what [`largest`] finds faster.
    fn largest_by_trying_all(lattice: &Lattice) -> Option<Rectangle> {
        let sizes = |low| (3..=12).flat_map(move |height| (3..=12).map(move |width| (low, width, height)));
        let all = lattice.keys().flat_map(|&low| sizes(low));
        all.map(|(low, width, height)| Rectangle { low, width, height })
            .filter(|rectangle| rectangle.is_full(lattice))
            .reduce(
                |best, next| if next.width * next.height > best.width * best.height { next } else { best },
            )
    }

    #[test]
    fn the_largest_rectangle_among_holes_is_that_of_the_definition() {
        let mut state = 7_u32;
        for holes in (0..24).cycle().take(240) {
            let mut part = lattice(12, 9);
            for _ in 0..holes {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                part.remove(&((state >> 8) as i32 % 12, (state >> 20) as i32 % 9));
            }
            assert_eq!(largest(&part), largest_by_trying_all(&part), "{part:?}");
        }
    }

    #[test]
    fn a_stray_corner_is_left_and_a_hole_or_half_a_row_more_refused() {
        let mut stray = lattice(9, 6);
        stray.insert((9, 2), 54);
        assert!(matches!(find(&stray, 9, 6), Found::Board(_)));
        stray.insert((9, 3), 55);
        stray.insert((9, 4), 56);
        assert!(!matches!(find(&stray, 9, 6), Found::Board(_)));
        let mut hole = lattice(9, 6);
        hole.remove(&(4, 3));
        assert_eq!(find(&hole, 9, 6), Found::Incomplete);
    }

    #[test]
    fn the_colour_of_the_corner_square_fixes_odd_by_even_boards() {
        // The square between +i and +j of place (0, 0) is dark, so that (0, 0) starts the board; one place
        // on, it does not.
        let (lattice_96, places) = (lattice(9, 6), places_px(9, 6));
        let board = Rectangle { low: (0, 0), width: 9, height: 6 };
        let found = ordered(&lattice_96, &board, &places, (9, 6));
        assert_eq!(
            (found.marks[0], found.marks[53], found.orientation),
            (Some(0), Some(53), Orientation::Fixed)
        );
        let shifted: Lattice = lattice_96.iter().map(|(&(i, j), &mark)| ((i + 1, j), mark)).collect();
        let found = ordered(&shifted, &Rectangle { low: (1, 0), ..board }, &places, (9, 6));
        assert_eq!(
            (found.marks[0], found.marks[53], found.orientation),
            (Some(53), Some(0), Orientation::Fixed)
        );
    }

    #[test]
    fn what_colours_do_not_fix_starts_at_the_top_left_and_says_so() {
        let both = |width: i32, height: i32, asked: (usize, usize)| {
            let (lattice, places) = (lattice(width, height), places_px(width as usize, height as usize));
            let board = Rectangle { low: (0, 0), width: width as usize, height: height as usize };
            let found = ordered(&lattice, &board, &places, asked);
            (found.marks[0].unwrap(), found.marks[1].unwrap(), found.orientation)
        };
        assert_eq!(both(7, 5, (7, 5)), (0, 1, Orientation::HalfTurn));
        assert_eq!(both(8, 6, (8, 6)), (0, 1, Orientation::HalfTurn));
        assert_eq!(both(7, 7, (7, 7)), (0, 1, Orientation::HalfTurn));
        assert_eq!(both(6, 6, (6, 6)).2, Orientation::QuarterTurn);
        // Counted across, seen from the front: the dark squares in the corners lie on the left, and a row of
        // six runs along them, with the nine rows to its right hand; so the first corner is the lower one,
        // and the next lies above it.
        assert_eq!(both(9, 6, (6, 9)), (45, 36, Orientation::Fixed));
    }

    #[test]
    fn a_hidden_corner_is_told_apart_by_where_it_would_be() {
        let board = Rectangle { low: (0, 0), width: 8, height: 6 };
        for (hidden, first) in [((0, 0), None), ((7, 5), Some(0))] {
            let mut part = lattice(8, 6);
            part.remove(&hidden);
            let found = ordered(&part, &board, &places_px(8, 6), (8, 6));
            assert_eq!((found.marks[0], found.orientation), (first, Orientation::HalfTurn));
            assert_eq!(found.marks[1], Some(1));
        }
    }
}
