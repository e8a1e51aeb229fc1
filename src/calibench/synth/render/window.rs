//! Which part of an outline can change the image? What lies above, below or right of it changes nothing, and
//! of what lies left of it only how far it goes up or down.

use super::outline::Arc;
use crate::geometry::Vec2;

/// How many image sizes to the left an outline is followed as it is.
const FAR: f64 = 16.0;

/// The part of the plane that an image sees, px.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    low: Vec2,
    high: Vec2,
    far_left: f64,
}

/// Where an arc lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Where it may change the image in any way.
    Seen,
    /// Above, below or right of the image: it changes nothing.
    Unseen,
    /// Far left of the image: only how far it goes up or down changes anything.
    FarLeft,
}

impl Window {
    /// Sees everything.
    #[cfg(test)]
    pub const ALL: Window = Window {
        low: Vec2::new(f64::NEG_INFINITY, f64::NEG_INFINITY),
        high: Vec2::new(f64::INFINITY, f64::INFINITY),
        far_left: f64::NEG_INFINITY,
    };

    /// That of an image of width and height whose pixels see `reach_px` beyond their squares, and a pixel of
    /// margin.
    pub fn of((width, height): (usize, usize), reach_px: f64) -> Window {
        let (width, height) = (width as f64, height as f64);
        let margin = reach_px + 1.0;
        Window {
            low: Vec2::new(-margin, -margin),
            high: Vec2::new(width + margin, height + margin),
            far_left: -margin - FAR * width.max(height),
        }
    }

    /// Where an arc lies, with all that its halves may reach: no further beyond its three points than these
    /// are apart.
    pub fn side(&self, arc: &Arc) -> Side {
        let low = arc.from.inf(&arc.middle).inf(&arc.to);
        let high = arc.from.sup(&arc.middle).sup(&arc.to);
        let beyond = high - low;
        let (low, high) = (low - beyond, high + beyond);
        if low.x > self.high.x || low.y > self.high.y || high.y < self.low.y {
            Side::Unseen
        } else if high.x < self.far_left {
            Side::FarLeft
        } else {
            Side::Seen
        }
    }

    /// The way up or down of an arc along the left border, in pieces of `longest` px at most.
    pub fn down_the_left(&self, arc: &Arc, longest: f64) -> impl Iterator<Item = Arc> + use<> {
        let (from, to) = (arc.from.y.clamp(self.low.y, self.high.y), arc.to.y.clamp(self.low.y, self.high.y));
        let pieces = libm::ceil((to - from).abs() / longest).max(1.0);
        let x = self.low.x;
        let at = move |piece: f64| Vec2::new(x, from + (to - from) * (piece / pieces));
        (0..pieces as usize).map(move |piece| {
            let piece = piece as f64;
            Arc { from: at(piece), middle: at(piece + 0.5), to: at(piece + 1.0) }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::coverage::Coverage;
    use super::super::outline::{Outline, Steps, trace};
    use super::*;
    use std::convert::Infallible;

    fn covered(outline: &Outline, window: &Window) -> (Coverage, usize) {
        let (mut coverage, mut arcs) = (Coverage::new(12, 9), 0);
        for piece in &outline.pieces {
            let curve = |t: f64| Ok::<_, Infallible>(piece.at(t));
            trace(&curve, piece.start_parts(), &Steps::SHARP, window, &mut |arc| {
                coverage.add_arc(arc);
                arcs += 1;
            })
            .unwrap();
        }
        coverage.finish();
        (coverage, arcs)
    }

    #[test]
    fn what_is_left_out_changes_nothing_and_the_cost_is_bounded() {
        let window = Window::of((12, 9), 0.0);
        // Its edge crosses the image; most of it lies far left, right, above or below.
        for centre in [
            Vec2::new(-2e4 + 5.0, 3.0),
            Vec2::new(2e4 + 5.0, 3.0),
            Vec2::new(6.0, -2e4 + 4.0),
            Vec2::new(6.0, 2e4 + 4.0),
            Vec2::new(-1.4e4, 1.4e4),
        ] {
            let disc = Outline::disc(centre, 2e4);
            let ((whole, of_whole), (part, of_part)) =
                (covered(&disc, &Window::ALL), covered(&disc, &window));
            let cells = (0..9).flat_map(|row| (0..12).map(move |column| (column, row)));
            let largest = cells.map(|(c, r)| (whole.at(c, r) - part.at(c, r)).abs()).fold(0.0, f64::max);
            assert!(largest < 1e-11, "{centre:?}: {largest:e}");
            assert!(
                of_whole > 100_000 && of_part < 2000,
                "{centre:?}: {of_whole} arcs, {of_part} in the window"
            );
        }
    }
}
