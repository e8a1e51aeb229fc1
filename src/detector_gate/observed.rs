//! What was answered to a photograph, beside the truth?

use super::cell::Cell;
use super::look::Photo;
use calibench::geometry::Vec2;
use calibench::photos::BoardSpec;

/// A mark nearer to another's place than this part of the way to it is confused with it.
const CONFUSED: f64 = 0.4;
/// Marks of a board nearer to each other than this, in its unit, are one.
const SAME: f64 = 1e-6;

/// What is known of a photograph when its image is gone.
#[derive(Debug, Clone)]
pub(super) struct Truth {
    pub places_px: Vec<Vec2>,
    /// Distance of each from the next, px.
    pub spacings_px: Vec<f64>,
    /// Variance of a coordinate at the bound, px^2.
    pub variances_px2: Vec<Option<f64>>,
    /// The orders in which its marks may be numbered, and which mark stands where in each.
    orders: Vec<(Order, Vec<usize>)>,
}

impl Truth {
    /// `variance` is told a place, and its cell.
    pub fn of(photo: &Photo, board: &BoardSpec, variance: impl Fn(&Vec2, &Cell) -> Option<f64>) -> Truth {
        let places = &photo.places_px;
        let cells: Vec<Cell> = (0..places.len()).map(|i| Cell::of(board, places, i)).collect();
        let variances_px2 = places.iter().zip(&cells).map(|(place, cell)| variance(place, cell)).collect();
        let spacings_px = cells.iter().map(Cell::spacing_px).collect();
        Truth { places_px: places.clone(), spacings_px, variances_px2, orders: orders(board) }
    }
}

/// The orders of a board: markers tell its marks apart; other boards may map to themselves.
fn orders(board: &BoardSpec) -> Vec<(Order, Vec<usize>)> {
    let marks = board.points();
    let is_coded = board.dark().is_some();
    let orders = Order::ALL.into_iter().filter(|order| *order == Order::Own || !is_coded);
    let numbered = |order: Order| {
        let number = |mark: &Vec2| {
            let wanted = order.place(mark);
            marks.iter().position(|other| (other - wanted).amax() < SAME)
        };
        Some((order, marks.iter().map(number).collect::<Option<Vec<usize>>>()?))
    };
    orders.filter_map(numbered).collect()
}

/// How marks are numbered. Half a turn maps a board to itself; a mirror shows it from behind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Order {
    Own,
    Turned,
    Mirrored,
    MirroredAndTurned,
}

impl Order {
    const ALL: [Order; 4] = [Order::Own, Order::Turned, Order::Mirrored, Order::MirroredAndTurned];

    /// The place of the mark that stands where `mark` does in the board's own order.
    fn place(self, mark: &Vec2) -> Vec2 {
        match self {
            Order::Own => *mark,
            Order::Turned => -mark,
            Order::Mirrored => Vec2::new(-mark.x, mark.y),
            Order::MirroredAndTurned => Vec2::new(mark.x, -mark.y),
        }
    }

    pub fn is_mirrored(self) -> bool {
        matches!(self, Order::Mirrored | Order::MirroredAndTurned)
    }
}

/// A mark that was found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Error {
    /// Place found minus true place, px.
    pub px: Vec2,
    /// The true place, px.
    pub at: Vec2,
    pub variance_px2: Option<f64>,
    pub is_confused: bool,
}

/// A board that was found.
#[derive(Debug, Clone)]
pub(super) struct Found {
    pub order: Order,
    pub errors: Vec<Error>,
    /// Marks that are in the photograph and were not found.
    pub missing: usize,
}

impl Found {
    /// Marks in the order of the board that is nearest to them.
    pub fn of(truth: &Truth, marks: &[Option<Vec2>]) -> Found {
        let errors = |numbers: &[usize]| -> Vec<Error> {
            let seen = numbers.iter().zip(marks).filter_map(|(i, mark)| Some((*i, (*mark)?)));
            let error = |(i, mark): (usize, Vec2)| {
                let px = mark - truth.places_px[i];
                let is_confused = px.norm() > CONFUSED * truth.spacings_px[i];
                Error { px, at: truth.places_px[i], variance_px2: truth.variances_px2[i], is_confused }
            };
            seen.map(error).collect()
        };
        let distance = |errors: &[Error]| errors.iter().map(|e| e.px.norm()).sum::<f64>();
        let each = truth.orders.iter().map(|(order, numbers)| (*order, errors(numbers)));
        let nearest = each.min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
        let (order, errors) = nearest.expect("a board's own order is one");
        Found { order, missing: marks.iter().filter(|mark| mark.is_none()).count(), errors }
    }

    /// Whether a mark is at another's place, or nowhere.
    pub fn is_wrong(&self) -> bool {
        self.errors.iter().any(|error| error.is_confused)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::look::Look;

    fn truth() -> (Truth, Vec<Vec2>) {
        let board = "chess:5x4:10".parse().unwrap();
        let photo = Look::default().photo(&board, 1, "observed", 0).unwrap();
        (Truth::of(&photo, &board, |_, _| None), photo.places_px)
    }

    fn found(truth: &Truth, marks: impl Iterator<Item = Vec2>) -> Found {
        Found::of(truth, &marks.map(Some).collect::<Vec<_>>())
    }

    #[test]
    fn a_board_may_be_numbered_from_either_end_and_not_mirrored() {
        let (truth, places) = truth();
        let order = |marks: Vec<Vec2>| {
            let found = found(&truth, marks.into_iter());
            assert!(!found.is_wrong());
            found.order
        };
        assert_eq!(order(places.clone()), Order::Own);
        assert_eq!(order(places.iter().rev().copied().collect()), Order::Turned);
        let rows: Vec<Vec2> = places.chunks(5).rev().flatten().copied().collect();
        assert!(order(rows).is_mirrored());
    }

    #[test]
    fn only_boards_that_map_to_themselves_have_other_orders() {
        let count = |words: &str| orders(&words.parse().unwrap()).len();
        assert_eq!([count("chess:5x4:10"), count("circles:4x4:10")], [4, 4]);
        // Of an odd number of staggered rows the mirror image is the board upside down, of an even one half a
        // turn is.
        for kind in ["asymmetric", "hexagonal"] {
            let named = |rows: usize| -> Vec<Order> {
                orders(&format!("{kind}:4x{rows}:10").parse().unwrap())
                    .iter()
                    .map(|(order, _)| *order)
                    .collect()
            };
            assert_eq!(named(7), [Order::Own, Order::MirroredAndTurned]);
            assert_eq!(named(6), [Order::Own, Order::Turned]);
        }
        assert_eq!([count("charuco:5x4:10:7:DICT_4X4_50"), count("aprilgrid:4x3:10:0.3")], [1, 1]);
    }

    #[test]
    fn a_board_that_is_a_column_off_is_wrong_and_one_that_is_a_pixel_off_is_not() {
        let (truth, places) = truth();
        let shifted = (0..places.len()).map(|i| places[if i % 5 == 4 { i } else { i + 1 }]);
        assert!(found(&truth, shifted).is_wrong());
        let moved = found(&truth, places.iter().map(|p| p + Vec2::new(1.0, -0.5)));
        assert!(
            !moved.is_wrong() && moved.errors.iter().all(|e| (e.px - Vec2::new(1.0, -0.5)).norm() < 1e-9)
        );
    }
}
