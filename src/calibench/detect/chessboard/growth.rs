//! Which corners are neighbours on the board? A lattice grown along the edges of its squares (after Geiger et
//! al. 2012).
//!
//! From one corner to the next runs an edge that both have: dark on the same side all the way, and the
//! corners' dark quadrants turn into each other's bright ones. A lattice starts where an edge leaves a corner
//! in two directions and ends in such neighbours. Then every empty place beside it is predicted from the
//! steps around it, in perspective along a line and parallel to the line beside it, so that it follows tilt,
//! lens and bent paper, and takes the corner that is there, if its edges fit. A predicted place without a
//! candidate is searched ([`probe`](super::probe)), which needs less contrast than finding a corner without
//! knowing where.

use super::candidates::Candidate;
use super::level::Smoothed;
use super::look::Look;
use super::places::Places;
use super::probe::probe;
use crate::detect::lattice::{Lattice, Place};
use crate::detect::neighbours::Neighbours;
use crate::geometry::Vec2;
use nalgebra::Matrix2;
use std::collections::BTreeMap;

/// What was found in a level.
pub struct Grown {
    /// The largest lattice first. Its i runs along the first corner's first edge; turning from i to j as from
    /// u to v, it is dark at places of even `i + j`.
    pub lattices: Vec<Lattice>,
    /// The corners that the lattices count, px of the level.
    pub corners: Vec<Candidate>,
}

/// How far from its prediction a corner may lie, in steps. Half would be the next corner's territory.
const SEARCH: f64 = 0.3;

/// Least cosine between an edge's direction and the way to the neighbour: 25 degrees for directions measured
/// on a circle of 3.5 px.
const LEAST_COSINE: f64 = 0.9;

/// A larger lattice is no board but a tiled wall, which need not be followed to its end.
const MOST: usize = 4000;

/// Least part of the board from which on empty places are searched: texture makes smaller lattices, not worth
/// the time.
const LEAST_PART_TO_PROBE: f64 = 0.2;

/// How often an empty place is searched: once more when the lattice around it has grown.
const MOST_TRIES: u8 = 2;

/// The lattices of a level; a board has the expected number of corners.
pub fn lattices(level: &Smoothed, look: &Look, candidates: Vec<Candidate>, expected: usize) -> Grown {
    let places: Vec<Vec2> = candidates.iter().map(|c| c.at).collect();
    let neighbours = Neighbours::new(&places);
    let taken = vec![false; candidates.len()];
    let fewest_to_probe = ((LEAST_PART_TO_PROBE * expected as f64) as usize).max(4);
    let mut growth = Growth {
        level,
        look,
        neighbours: &neighbours,
        corners: candidates,
        taken,
        lattice: Places::new(),
        fewest_to_probe,
        tried: BTreeMap::new(),
    };
    let mut lattices = Vec::new();
    for seed in 0..places.len() {
        if growth.taken[seed] || !growth.start(seed) {
            continue;
        }
        growth.grow();
        growth.tried.clear();
        lattices.push(growth.lattice.take());
    }
    lattices.sort_by_key(|lattice| std::cmp::Reverse(lattice.len()));
    Grown { lattices, corners: growth.corners }
}

struct Growth<'a> {
    level: &'a Smoothed,
    look: &'a Look,
    neighbours: &'a Neighbours<'a>,
    corners: Vec<Candidate>,
    /// Corners of this lattice or of an earlier one.
    taken: Vec<bool>,
    lattice: Places,
    fewest_to_probe: usize,
    /// How often an empty place was searched in vain.
    tried: BTreeMap<Place, u8>,
}

/// The four directions, as steps of a place.
const DIRECTIONS: [Place; 4] = [(1, 0), (-1, 0), (0, 1), (0, -1)];

/// Which of a corner's edges runs along i, and which along j: neighbours have them exchanged.
pub fn axes_at((i, j): Place) -> (usize, usize) {
    if (i + j).rem_euclid(2) == 0 { (0, 1) } else { (1, 0) }
}

impl Growth<'_> {
    /// The seed and its first neighbours along both edges; `false` if it lacks one.
    fn start(&mut self, seed: usize) -> bool {
        let here = self.corners[seed];
        let near = self.neighbours.nearest_of(seed, self.look.nearest);
        let mut nearest = [None; 2];
        for (axis, nearest) in nearest.iter_mut().enumerate() {
            *nearest = near.iter().copied().find(|&other| self.is_neighbour(&here, axis, other));
        }
        let [Some(along), Some(across)] = nearest else { return false };
        let side = |other: usize, axis: usize| {
            if (self.corners[other].at - here.at).dot(&here.axes[axis]) > 0.0 { 1 } else { -1 }
        };
        let (i, j) = (side(along, 0), side(across, 1));
        for (place, mark) in [((0, 0), seed), ((i, 0), along), ((0, j), across)] {
            self.lattice.insert(place, mark);
            self.taken[mark] = true;
        }
        if self.close_square((i, j)) {
            return true;
        }
        self.release();
        false
    }

    /// Adds the fourth corner of the first square.
    fn close_square(&mut self, (i, j): Place) -> bool {
        let (Some(here), Some(along), Some(across)) = (self.at((0, 0)), self.at((i, 0)), self.at((0, j)))
        else {
            return false;
        };
        let steps = Matrix2::from_columns(&[(along - here) * f64::from(i), (across - here) * f64::from(j)]);
        let Some(mark) = self.candidate_for((i, j), &(along + across - here), &steps) else { return false };
        self.lattice.insert((i, j), mark);
        self.taken[mark] = true;
        true
    }

    /// Gives up the lattice.
    fn release(&mut self) {
        self.lattice.take().values().for_each(|&mark| self.taken[mark] = false);
    }

    /// Whether an edge of a corner leads to another corner, in either direction.
    fn is_neighbour(&self, here: &Candidate, axis: usize, other: usize) -> bool {
        let there = &self.corners[other];
        let way = (there.at - here.at).normalize();
        !self.taken[other]
            && way.dot(&here.axes[axis]).abs() > LEAST_COSINE
            && way.dot(&there.axes[1 - axis]).abs() > LEAST_COSINE
            && there.axes[axis].dot(&here.axes[1 - axis]).abs() > 0.5
            && self.joined(here, axis, there)
    }

    /// Whether the edge runs from one corner to the other.
    fn joined(&self, here: &Candidate, axis: usize, there: &Candidate) -> bool {
        let least = LEAST_EDGE * here.contrast.min(there.contrast);
        is_edge(self.level, self.look.beside, &here.at, &there.at, axis == 0, least)
    }

    /// Adds corners to the lattice until no place beside it takes one.
    fn grow(&mut self) {
        loop {
            let mut grew = false;
            for place in self.empty_places() {
                let Some((at, steps)) = self.prediction(place) else { continue };
                if let Some(mark) = self.candidate_for(place, &at, &steps) {
                    self.taken[mark] = true;
                    grew |= self.lattice.insert(place, mark);
                }
            }
            let grew = grew || self.probe_places();
            if !grew || self.lattice.len() > MOST {
                break;
            }
        }
    }

    /// Empty places beside the lattice, in order.
    fn empty_places(&self) -> Vec<Place> {
        let beside = |&(i, j): &Place| DIRECTIONS.map(|(di, dj)| (i + di, j + dj));
        let is_empty = |place: &Place| self.lattice.get(*place).is_none();
        let mut empty: Vec<Place> = self.lattice.filled().iter().flat_map(beside).filter(is_empty).collect();
        empty.sort_unstable();
        empty.dedup();
        empty
    }

    fn at(&self, (i, j): Place) -> Option<Vec2> {
        self.lattice.get((i, j)).map(|mark| self.corners[mark].at)
    }

    /// Where a place should be, and the steps along i and j there.
    fn prediction(&self, (i, j): Place) -> Option<(Vec2, Matrix2<f64>)> {
        let steps = Matrix2::from_columns(&[self.step((i, j), (1, 0))?, self.step((i, j), (0, 1))?]);
        let (mut sum, mut count) = (Vec2::zeros(), 0.0);
        for (di, dj) in DIRECTIONS {
            let behind = |k: i32| self.at((i - k * di, j - k * dj));
            let Some(first) = behind(1) else { continue };
            if let Some(second) = behind(2) {
                sum += first + next_step(first - second, behind(3).map(|third| second - third));
                count += 1.0;
            }
            for side in [(dj, di), (-dj, -di)] {
                let (i, j) = (i + side.0, j + side.1);
                if let (Some(beside), Some(from)) = (self.at((i, j)), self.at((i - di, j - dj))) {
                    sum += first + (beside - from);
                    count += 1.0;
                }
            }
        }
        if count == 0.0 {
            // The first corners: one neighbour along each edge, so the square's fourth corner has no line to
            // follow.
            let (di, dj) = DIRECTIONS.into_iter().find(|(di, dj)| self.at((i - di, j - dj)).is_some())?;
            let step = steps * Vec2::new(f64::from(di), f64::from(dj));
            return Some((self.at((i - di, j - dj))? + step, steps));
        }
        let at = sum / count;
        (at.amax().is_finite() && steps.determinant() > 0.0).then_some((at, steps))
    }

    /// The step in a direction near a place: that between the nearest pair of corners which has the
    /// direction.
    fn step(&self, (i, j): Place, (di, dj): Place) -> Option<Vec2> {
        for reach in 0..3i32 {
            let (mut sum, mut count) = (Vec2::zeros(), 0.0);
            for a in -reach - 1..=reach {
                for b in -reach..=reach {
                    // `a` counts along the step, `b` across.
                    let from = (i + a * di + b * dj, j + a * dj + b * di);
                    if let (Some(start), Some(end)) = (self.at(from), self.at((from.0 + di, from.1 + dj))) {
                        sum += end - start;
                        count += 1.0;
                    }
                }
            }
            if count > 0.0 {
                return Some(sum / count);
            }
        }
        None
    }

    /// The candidate at a predicted place whose edges fit the lattice.
    fn candidate_for(&self, place: Place, at: &Vec2, steps: &Matrix2<f64>) -> Option<usize> {
        let inverse = steps.try_inverse()?;
        let reach = SEARCH * (steps.column(0).norm() + steps.column(1).norm());
        let mut near: Vec<(usize, f64)> = self
            .neighbours
            .within(at, reach)
            .filter(|(mark, _)| !self.taken[*mark])
            .map(|(mark, _)| (mark, (inverse * (self.corners[mark].at - at)).norm()))
            .filter(|(_, distance)| *distance < SEARCH)
            .collect();
        near.sort_by(|a, b| a.1.total_cmp(&b.1));
        near.into_iter().map(|(mark, _)| mark).find(|&mark| self.fits(place, &self.corners[mark], steps))
    }

    /// Whether a corner's edges have the lattice's directions and lead to its neighbours there.
    fn fits(&self, place: Place, corner: &Candidate, steps: &Matrix2<f64>) -> bool {
        let (along, across) = axes_at(place);
        let turned = |axis: usize, step: usize| {
            let step = steps.column(step);
            corner.axes[axis].dot(&step).abs() > LEAST_COSINE * step.norm()
        };
        turned(along, 0) && turned(across, 1) && self.is_joined_at(place, corner)
    }

    /// Whether edges lead from a corner to all its neighbours in the lattice.
    fn is_joined_at(&self, (i, j): Place, corner: &Candidate) -> bool {
        let (along, across) = axes_at((i, j));
        DIRECTIONS.iter().all(|(di, dj)| {
            let Some(mark) = self.lattice.get((i + di, j + dj)) else { return true };
            self.joined(corner, if *di != 0 { along } else { across }, &self.corners[mark])
        })
    }

    /// Searches the empty places; whether a corner was found.
    fn probe_places(&mut self) -> bool {
        if self.lattice.len() < self.fewest_to_probe {
            return false;
        }
        let mut grew = false;
        for place in self.empty_places() {
            let tried = self.tried.entry(place).or_insert(0);
            if *tried >= MOST_TRIES {
                continue;
            }
            *tried += 1;
            let Some((at, steps)) = self.prediction(place) else { continue };
            let Some(corner) = probe(self.level, self.look, &at, &steps, axes_at(place) == (0, 1)) else {
                continue;
            };
            let shortest = steps.column(0).norm().min(steps.column(1).norm());
            let is_new = self
                .lattice
                .filled()
                .iter()
                .filter_map(|&place| self.at(place))
                .all(|other| (other - corner.at).norm() > 0.5 * shortest);
            if is_new && self.is_joined_at(place, &corner) {
                grew |= self.lattice.insert(place, self.corners.len());
                self.corners.push(corner);
                self.taken.push(true);
            }
        }
        grew
    }
}

/// The step after a step. Equal steps on a line seen in perspective are `1 / ((1 + t c) (1 + (t + 1) c))`
/// apart, so that with `u` the ratio of the last two the next is `(u + 1) / (3 u - 1)` times the last.
fn next_step(last: Vec2, before: Option<Vec2>) -> Vec2 {
    let Some(before) = before else { return last };
    let ratio = (before.norm() / last.norm()).clamp(0.7, 1.5);
    let turn = last - before * (last.norm() / before.norm());
    (last + turn) * ((ratio + 1.0) / (3.0 * ratio - 1.0))
}

/// Least difference across an edge as part of the corners' contrast.
pub const LEAST_EDGE: f64 = 0.3;

/// Distance from an edge at which its two sides are compared, px of the level.
const SIDE_PX: f64 = 2.0;

/// Whether the way from one corner to the other has a dark side and a bright one that differ by `least`,
/// compared `beside` lengths of the way beside it at most; `dark_after`: the dark side is where the way turns
/// to as u turns to v.
pub fn is_edge(level: &Smoothed, beside: f64, from: &Vec2, to: &Vec2, dark_after: bool, least: f64) -> bool {
    let way = to - from;
    let length = way.norm();
    let side = Vec2::new(-way.y, way.x) * (SIDE_PX.min(beside * length) / length);
    let mut differences = 0.0;
    for part in [0.35, 0.5, 0.65] {
        let at = from + way * part;
        let (after, before) = (at + side, at - side);
        if !(level.holds(&after, 0.0) && level.holds(&before, 0.0)) {
            return false;
        }
        let difference = level.at(&before) - level.at(&after);
        let difference = if dark_after { difference } else { -difference };
        differences += difference / 3.0;
    }
    differences > least
}
