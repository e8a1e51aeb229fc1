//! Which marks are neighbours on the board? A lattice grown mark by mark from a seed.
//!
//! Every mark predicts its four neighbours from the steps around it; the mark nearest to a prediction, if
//! near enough and of similar size, takes the place. Steps are updated as the lattice grows, so it follows
//! perspective and distortion. The seed's two steps may be a row and a diagonal: any two independent steps
//! span the same lattice, and the caller straightens it.

use super::Blob;
use super::neighbours::Neighbours;
use super::order::LARGEST_DEVIATION;
use crate::geometry::Vec2;
use std::collections::{BTreeMap, VecDeque};

/// Place of a mark in its lattice: along the first and the second step.
pub type Place = (i32, i32);

/// Marks by their places.
pub type Lattice = BTreeMap<Place, usize>;

/// How far from its prediction a neighbour may lie, as a fraction of the step. Half would be the next mark's
/// territory; a strong lens and 45 deg of tilt change the step by less than a quarter from one mark to the
/// next.
const SEARCH_FRACTION: f64 = 0.3;

/// Largest ratio of areas of neighbouring marks: 45 deg of tilt at close range changes it by 1.5.
const LARGEST_AREA_RATIO: f64 = 2.5;

/// Least sine of the angle between the two steps of a seed.
const LEAST_SINE: f64 = 0.35;

/// A lattice of which marks are out of line may have slipped by a mark where perspective is strong and its
/// seed's steps are diagonals. It is grown again from so many of its marks at most: of those of a tilted
/// board half or more find it.
const MOST_SEEDS: usize = 12;

/// The four directions, as steps of a place.
const DIRECTIONS: [Place; 4] = [(1, 0), (-1, 0), (0, 1), (0, -1)];

/// The lattice with the most marks.
pub fn largest(blobs: &[Blob]) -> Lattice {
    let centres: Vec<Vec2> = blobs.iter().map(|blob| blob.centre_px).collect();
    let areas: Vec<f64> = blobs.iter().map(Blob::area_px2).collect();
    let marks = Marks { centres: &centres, areas: &areas, neighbours: Neighbours::new(&centres) };
    // How often each was a mark of a lattice, and of one out of line only so much.
    let mut tried = vec![0; blobs.len()];
    let (mut largest, mut most) = (Lattice::new(), 0);
    for seed in 0..blobs.len() {
        if tried[seed] >= MOST_SEEDS {
            continue;
        }
        let lattice = marks.grow(seed);
        let in_line = marks.in_line(&lattice);
        // A seed that finds no lattice may still be part of one that another seed finds.
        if lattice.len() >= 4 {
            let by = if in_line == lattice.len() { MOST_SEEDS } else { 1 };
            lattice.values().for_each(|&mark| tried[mark] += by);
        }
        if in_line > most {
            (largest, most) = (lattice, in_line);
        }
    }
    largest
}

struct Marks<'a> {
    centres: &'a [Vec2],
    areas: &'a [f64],
    neighbours: Neighbours<'a>,
}

impl Marks<'_> {
    fn similar(&self, a: usize, b: usize) -> bool {
        let ratio = self.areas[a] / self.areas[b];
        (1.0 / LARGEST_AREA_RATIO..=LARGEST_AREA_RATIO).contains(&ratio)
    }

    /// The steps to the nearest similar mark and to the nearest one in another direction.
    fn seed_steps(&self, seed: usize) -> Option<[Vec2; 2]> {
        let steps: Vec<Vec2> = self
            .neighbours
            .nearest_of(seed, 8)
            .into_iter()
            .filter(|&other| self.similar(seed, other))
            .map(|other| self.centres[other] - self.centres[seed])
            .collect();
        let first = *steps.first()?;
        let across = |step: &&Vec2| first.perp(step).abs() > LEAST_SINE * first.norm() * step.norm();
        Some([first, *steps.iter().find(across)?])
    }

    /// Grows the lattice of a seed, breadth first.
    fn grow(&self, seed: usize) -> Lattice {
        let mut lattice = Lattice::from([((0, 0), seed)]);
        let Some(steps) = self.seed_steps(seed) else { return lattice };
        let mut place_of = BTreeMap::from([(seed, (0, 0))]);
        let mut queue = VecDeque::from([((0, 0), steps)]);
        while let Some((place, inherited)) = queue.pop_front() {
            let mark = lattice[&place];
            let steps = self.steps_at(&lattice, place, inherited);
            for (i, j) in DIRECTIONS {
                let next_place = (place.0 + i, place.1 + j);
                if lattice.contains_key(&next_place) {
                    continue;
                }
                let step = steps[0] * f64::from(i) + steps[1] * f64::from(j);
                let Some(next) =
                    self.neighbours.nearest(&(self.centres[mark] + step), SEARCH_FRACTION * step.norm())
                else {
                    continue;
                };
                if !place_of.contains_key(&next) && self.similar(mark, next) {
                    lattice.insert(next_place, next);
                    place_of.insert(next, next_place);
                    queue.push_back((next_place, steps));
                }
            }
        }
        lattice
    }

    /// How many marks of a lattice lie near the middle of their neighbours, along both steps.
    fn in_line(&self, lattice: &Lattice) -> usize {
        let at = |i: i32, j: i32| lattice.get(&(i, j)).map(|&mark| self.centres[mark]);
        let is_out = |here: Vec2, behind: Option<Vec2>, ahead: Option<Vec2>| match (behind, ahead) {
            (Some(behind), Some(ahead)) => {
                ((behind + ahead) * 0.5 - here).norm() > LARGEST_DEVIATION * 0.5 * (ahead - behind).norm()
            }
            _ => false,
        };
        let is_in_line = |(&(i, j), &mark): (&Place, &usize)| {
            let here = self.centres[mark];
            !is_out(here, at(i - 1, j), at(i + 1, j)) && !is_out(here, at(i, j - 1), at(i, j + 1))
        };
        lattice.iter().filter(|entry| is_in_line(*entry)).count()
    }

    /// The steps around a place: between the marks on either side where they are known, else the inherited
    /// ones.
    fn steps_at(&self, lattice: &Lattice, place: Place, inherited: [Vec2; 2]) -> [Vec2; 2] {
        let here = self.centres[lattice[&place]];
        let at =
            |di: i32, dj: i32| lattice.get(&(place.0 + di, place.1 + dj)).map(|&mark| self.centres[mark]);
        let along = |behind: Option<Vec2>, ahead: Option<Vec2>, inherited: Vec2| match (behind, ahead) {
            (Some(behind), Some(ahead)) => (ahead - behind) * 0.5,
            (Some(behind), None) => here - behind,
            (None, Some(ahead)) => ahead - here,
            (None, None) => inherited,
        };
        [along(at(-1, 0), at(1, 0), inherited[0]), along(at(0, -1), at(0, 1), inherited[1])]
    }
}

#[cfg(test)]
mod tests {
    use super::super::order::complete_sides;
    use super::*;
    use crate::geometry::{Homography, Mat3};
    use nalgebra::Matrix2;

    /// The discs of a 9 x 7 grid that is tilted by 60 degrees, in the order of their rows in the image.
    fn tilted() -> Vec<Blob> {
        let plane = Mat3::new(-7.8, -26.6, 371.2, -33.5, -20.4, 456.0, -0.0518, 0.0097, 1.0);
        let disc = |index: usize| {
            let place = Vec2::new((index % 9) as f64, (index / 9) as f64);
            let depth = plane[(2, 0)] * place.x + plane[(2, 1)] * place.y + 1.0;
            Blob {
                centre_px: Homography(plane).apply(&place).unwrap(),
                covariance_px2: Matrix2::identity() * (10.0 / (depth * depth * depth)),
                edge_px: 0.7,
                contrast: 0.7,
                misfit: 0.05,
            }
        };
        let mut discs: Vec<Blob> = (0..63).map(disc).collect();
        discs.sort_by(|a, b| a.centre_px.y.total_cmp(&b.centre_px.y));
        discs
    }

    #[test]
    fn a_lattice_that_slips_by_a_mark_is_grown_again_from_another() {
        let discs = tilted();
        let centres: Vec<Vec2> = discs.iter().map(|disc| disc.centre_px).collect();
        let areas: Vec<f64> = discs.iter().map(Blob::area_px2).collect();
        let marks = Marks { centres: &centres, areas: &areas, neighbours: Neighbours::new(&centres) };
        let first = marks.grow(0);
        assert!(marks.in_line(&first) < first.len() && complete_sides(&first).is_none());
        let found = largest(&discs);
        assert_eq!(complete_sides(&found), Some((9, 7)));
        assert_eq!(marks.in_line(&found), 63);
    }
}
