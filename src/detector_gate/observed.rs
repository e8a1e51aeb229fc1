//! What was answered to a photograph, beside the truth?

use super::look::Photo;
use calibench::board::Board;
use calibench::geometry::Vec2;

/// A mark nearer to another's place than this part of the way to it is confused with it.
const CONFUSED: f64 = 0.4;

/// What is known of a photograph when its image is gone.
#[derive(Debug, Clone)]
pub(super) struct Truth {
    pub places_px: Vec<Vec2>,
    /// Distance of each from the next, px.
    pub spacings_px: Vec<f64>,
    /// Variance of a coordinate at the bound, px^2.
    pub variances_px2: Vec<Option<f64>>,
    columns: usize,
}

impl Truth {
    /// `variance` is told a place, and what leads from it to a next mark of its row and of its column.
    pub fn of(photo: &Photo, board: &Board, variance: impl Fn(&Vec2, [Vec2; 2]) -> Option<f64>) -> Truth {
        let columns = board.columns();
        let places = &photo.places_px;
        let to_next = |i: usize| {
            let across = if i % columns + 1 < columns { i + 1 } else { i - 1 };
            let down = if i + columns < places.len() { i + columns } else { i - columns };
            [places[across] - places[i], places[down] - places[i]]
        };
        let spacing = |[across, down]: [Vec2; 2]| across.norm().min(down.norm());
        let spacings_px: Vec<f64> = (0..places.len()).map(|i| spacing(to_next(i))).collect();
        let variances_px2 = (0..places.len()).map(|i| variance(&places[i], to_next(i))).collect();
        Truth { places_px: places.clone(), spacings_px, variances_px2, columns }
    }

    /// Number of the mark that stands at `i` when the board is numbered in another order.
    fn in_order(&self, order: Order, i: usize) -> usize {
        let (columns, last) = (self.columns, self.places_px.len() - 1);
        let mirrored = |i: usize| i / columns * columns + columns - 1 - i % columns;
        match order {
            Order::Own => i,
            Order::Turned => last - i,
            Order::Mirrored => mirrored(i),
            Order::MirroredAndTurned => mirrored(last - i),
        }
    }
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
        let errors = |order: Order| -> Vec<Error> {
            let seen =
                marks.iter().enumerate().filter_map(|(i, mark)| Some((truth.in_order(order, i), (*mark)?)));
            let error = |(i, mark): (usize, Vec2)| {
                let px = mark - truth.places_px[i];
                let is_confused = px.norm() > CONFUSED * truth.spacings_px[i];
                Error { px, at: truth.places_px[i], variance_px2: truth.variances_px2[i], is_confused }
            };
            seen.map(error).collect()
        };
        let distance = |errors: &[Error]| errors.iter().map(|e| e.px.norm()).sum::<f64>();
        let each = Order::ALL.map(|order| (order, errors(order)));
        let nearest = each.into_iter().min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)));
        let (order, errors) = nearest.expect("four orders");
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
        let board = Board::chessboard(5, 4, 10.0).unwrap();
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
