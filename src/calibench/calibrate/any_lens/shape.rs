//! How is a board bent? Two bows and a twist.

use crate::board::View;
use crate::geometry::Vec2;

/// The shape of a board that is not flat: the mark at `(X, Y)` lies `bow_x (1 - x^2) + bow_y (1 - y^2) +
/// twist x y` towards +Z of the target, with `x` and `y` from -1 to 1 over the box around all marks (the bows
/// as in mrcal's `calobject_warp`).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct BoardShape {
    /// Height of the middle over the edges in x, in the target's unit.
    pub bow_x: f64,
    /// Height of the middle over the edges in y, in the target's unit.
    pub bow_y: f64,
    /// Height of the corners where `x y = 1`, in the target's unit.
    pub twist: f64,
    /// Standard deviations of the three; 0 where none was estimated.
    pub standard_deviations: [f64; 3],
    /// The box around all marks: least and greatest X and Y.
    pub region: [Vec2; 2],
}

/// One of the numbers of a [`BoardShape`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Deformation {
    /// `bow_x`.
    BowX,
    /// `bow_y`.
    BowY,
    /// `twist`.
    Twist,
}

impl Deformation {
    /// All, in the order of a board's numbers.
    pub(in super::super) const ALL: [Deformation; 3] =
        [Deformation::BowX, Deformation::BowY, Deformation::Twist];
}

impl std::fmt::Display for Deformation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Deformation::BowX => "bow along x",
            Deformation::BowY => "bow along y",
            Deformation::Twist => "twist",
        })
    }
}

impl BoardShape {
    /// The height of a mark over the board's plane, in the target's unit.
    pub fn height(&self, mark: &Vec2) -> f64 {
        let [a, b, c] = basis(&self.region, mark);
        self.bow_x * a + self.bow_y * b + self.twist * c
    }

    /// The three deformations, in the order of [`basis`].
    pub(in super::super) fn deformations(&self) -> [f64; 3] {
        [self.bow_x, self.bow_y, self.twist]
    }
}

/// The box around the marks of all views.
pub(super) fn region(views: &[View]) -> [Vec2; 2] {
    let outside = [Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY)];
    let points = views.iter().flat_map(View::points);
    points.fold(outside, |[low, high], p| [low.inf(p), high.sup(p)])
}

/// `1 - x^2`, `1 - y^2`, `x y` of a mark.
pub(super) fn basis([low, high]: &[Vec2; 2], mark: &Vec2) -> [f64; 3] {
    let across = |low: f64, high: f64, at: f64| {
        if high > low { (2.0 * at - low - high) / (high - low) } else { 0.0 }
    };
    let (x, y) = (across(low.x, high.x, mark.x), across(low.y, high.y, mark.y));
    [1.0 - x * x, 1.0 - y * y, x * y]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_is_as_high_as_its_bows_and_twist_make_it() {
        let region = [Vec2::new(-10.0, -5.0), Vec2::new(30.0, 15.0)];
        let board = BoardShape { bow_x: 0.3, bow_y: -0.2, twist: 0.7, standard_deviations: [0.0; 3], region };
        // In the middle, at corners, and half-way to an edge.
        for (x, y, height) in [
            (10.0, 5.0, 0.3 - 0.2),
            (30.0, 15.0, 0.7),
            (-10.0, 15.0, -0.7),
            (20.0, 5.0, 0.75 * 0.3 - 0.2),
            (10.0, 0.0, 0.3 - 0.75 * 0.2),
        ] {
            let own = board.height(&Vec2::new(x, y));
            assert!((own - height).abs() < 1e-15, "{x} {y}: {own}");
        }
        assert_eq!(Deformation::ALL.map(|d| d.to_string()), ["bow along x", "bow along y", "twist"]);
    }
}
