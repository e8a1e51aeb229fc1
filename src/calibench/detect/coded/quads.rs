//! Where are dark quadrangles between corners of squares? Walks along the edges with the dark side on one
//! hand.

use crate::detect::chessboard::candidates::Candidate;
use crate::detect::chessboard::growth::{LEAST_EDGE, is_edge};
use crate::detect::chessboard::level::Smoothed;
use crate::detect::neighbours::{Neighbours, nearer};
use crate::geometry::Vec2;

/// Four corners with dark between them.
pub struct Quad {
    /// Turning as from u to v, px of the level.
    pub corners: [Vec2; 4],
    /// Bright minus dark at the corner where they differ least.
    pub contrast: f64,
}

/// Nearest candidates among which the next corner is looked for: those of a tag's cells and of the tags
/// beside it may be nearer.
const NEAREST: usize = 60;

/// Least cosine between an edge's direction at a corner and the way to the next: 25 degrees, as on a
/// chessboard.
const LEAST_COSINE: f64 = 0.9;

/// How far beside an edge its sides are compared, at most, in its lengths: the border of a tag is an eighth
/// of it.
const BESIDE: f64 = 0.08;

/// A corner, and which of its two dark quadrants is meant: that between both axes, or the one behind.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Turn {
    corner: usize,
    ahead: bool,
}

impl Turn {
    fn sign(self) -> f64 {
        if self.ahead { 1.0 } else { -1.0 }
    }

    fn index(self) -> usize {
        2 * self.corner + usize::from(!self.ahead)
    }
}

/// The dark quadrangles of a level.
pub fn quads(level: &Smoothed, candidates: &[Candidate]) -> Vec<Quad> {
    let places: Vec<Vec2> = candidates.iter().map(|candidate| candidate.at).collect();
    let neighbours = Neighbours::new(&places);
    let mut next: Vec<Option<Turn>> = Vec::with_capacity(2 * candidates.len());
    for corner in 0..candidates.len() {
        let near = neighbours.nearest_unsorted(corner, NEAREST);
        for ahead in [true, false] {
            let turn = Turn { corner, ahead };
            let mut on_edge: Vec<(usize, f64)> =
                near.iter().copied().filter(|(other, _)| is_on_edge(candidates, turn, *other)).collect();
            on_edge.sort_unstable_by(nearer);
            next.push(on_edge.iter().find_map(|&(other, _)| along(level, candidates, turn, other)));
        }
    }
    let step = |turn: Turn| next[turn.index()];
    let walk = |first: Turn| {
        let second = step(first)?;
        let third = step(second)?;
        let fourth = step(third)?;
        let all = [first, second, third, fourth];
        // Each quadrangle once, from its first corner.
        let is_first = all[1..].iter().all(|turn| turn.corner > first.corner);
        (is_first && step(fourth) == Some(first)).then_some(all)
    };
    let turns = (0..candidates.len()).flat_map(|corner| [true, false].map(|ahead| Turn { corner, ahead }));
    let quad = |turns: [Turn; 4]| Quad {
        corners: turns.map(|turn| candidates[turn.corner].at),
        contrast: turns.iter().map(|turn| candidates[turn.corner].contrast).fold(f64::INFINITY, f64::min),
    };
    turns.filter_map(walk).map(quad).collect()
}

/// Whether the edge on which a corner's quadrant begins has the direction of the way to another.
fn is_on_edge(candidates: &[Candidate], turn: Turn, other: usize) -> bool {
    let (here, there) = (&candidates[turn.corner], &candidates[other]);
    (there.at - here.at).normalize().dot(&here.axes[0]) * turn.sign() > LEAST_COSINE
}

/// The quadrant of another corner [on that edge](is_on_edge), if the edge leads there.
fn along(level: &Smoothed, candidates: &[Candidate], turn: Turn, other: usize) -> Option<Turn> {
    let (here, there) = (&candidates[turn.corner], &candidates[other]);
    let way = (there.at - here.at).normalize();
    // There the edge comes in on the second axis, from its far end.
    let cosine = -way.dot(&there.axes[1]);
    if cosine.abs() <= LEAST_COSINE {
        return None;
    }
    let least = LEAST_EDGE * here.contrast.min(there.contrast);
    is_edge(level, BESIDE, &here.at, &there.at, true, least)
        .then_some(Turn { corner: other, ahead: cosine > 0.0 })
}
