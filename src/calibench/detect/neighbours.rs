//! Which mark is nearest to this place? Points sorted into the cells of a square raster.

use crate::geometry::Vec2;
use std::cmp::Ordering;

/// Radius of the circle that is searched first for so many points, against that of one which holds as many
/// cells.
const SURELY: f64 = 1.2;

/// Points in cells about as many as points.
#[derive(Debug)]
pub struct Neighbours<'a> {
    points: &'a [Vec2],
    low: Vec2,
    cell_px: f64,
    columns: usize,
    rows: usize,
    /// Points of cell `c` are `order[starts[c]..starts[c + 1]]`.
    starts: Vec<usize>,
    order: Vec<usize>,
}

impl<'a> Neighbours<'a> {
    /// Sorts finite points.
    pub fn new(points: &'a [Vec2]) -> Neighbours<'a> {
        let fold = |start: f64, pick: fn(f64, f64) -> f64| {
            points.iter().fold(Vec2::new(start, start), |b, p| Vec2::new(pick(b.x, p.x), pick(b.y, p.y)))
        };
        let (low, high) = (fold(f64::INFINITY, f64::min), fold(f64::NEG_INFINITY, f64::max));
        let extent = if points.is_empty() { Vec2::zeros() } else { high - low };
        let area = extent.x.max(1.0) * extent.y.max(1.0);
        let cell_px = (area / points.len().max(1) as f64).sqrt().max(1.0);
        let (columns, rows) = ((extent.x / cell_px) as usize + 1, (extent.y / cell_px) as usize + 1);
        let mut sorted = Neighbours {
            points,
            low,
            cell_px,
            columns,
            rows,
            starts: vec![0; columns * rows + 1],
            order: vec![0; points.len()],
        };
        sorted.sort();
        sorted
    }

    fn cell(&self, p: &Vec2) -> (usize, usize) {
        let offset = (p - self.low) / self.cell_px;
        // Casts saturate: places outside count as the nearest border cell.
        ((offset.x as usize).min(self.columns - 1), (offset.y as usize).min(self.rows - 1))
    }

    /// Counting sort by cell.
    fn sort(&mut self) {
        let cells: Vec<usize> = self
            .points
            .iter()
            .map(|p| {
                let (column, row) = self.cell(p);
                row * self.columns + column
            })
            .collect();
        for &cell in &cells {
            self.starts[cell + 1] += 1;
        }
        for cell in 1..self.starts.len() {
            self.starts[cell] += self.starts[cell - 1];
        }
        let mut next = self.starts.clone();
        for (index, &cell) in cells.iter().enumerate() {
            self.order[next[cell]] = index;
            next[cell] += 1;
        }
    }

    /// The points.
    pub fn points(&self) -> &'a [Vec2] {
        self.points
    }

    /// Indices of the points within `radius_px` of a place, with their squared distances, in a fixed order.
    pub fn within(&self, place: &Vec2, radius_px: f64) -> impl Iterator<Item = (usize, f64)> {
        let reach = Vec2::new(radius_px, radius_px);
        let (first, last) = (self.cell(&(place - reach)), self.cell(&(place + reach)));
        let place = *place;
        (first.1..=last.1)
            .flat_map(move |row| {
                let start = self.starts[row * self.columns + first.0];
                let end = self.starts[row * self.columns + last.0 + 1];
                self.order[start..end].iter().copied()
            })
            .map(move |index| (index, (self.points[index] - place).norm_squared()))
            .filter(move |(_, square)| *square <= radius_px * radius_px)
    }

    /// The nearest point to a place within `radius_px`.
    pub fn nearest(&self, place: &Vec2, radius_px: f64) -> Option<usize> {
        self.within(place, radius_px).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
    }

    /// The `count` nearest other points of a point, nearest first.
    pub fn nearest_of(&self, index: usize, count: usize) -> Vec<usize> {
        let mut found = self.nearest_unsorted(index, count);
        found.sort_unstable_by(nearer);
        found.into_iter().map(|(other, _)| other).collect()
    }

    /// The same in any order, with their squared distances, for who sorts but a few of them by [`nearer`].
    pub fn nearest_unsorted(&self, index: usize, count: usize) -> Vec<(usize, f64)> {
        let place = self.points[index];
        let everything = self.cell_px * (self.columns + self.rows) as f64;
        let mut radius = SURELY * self.cell_px * (count as f64 / std::f64::consts::PI).sqrt();
        loop {
            let mut found: Vec<(usize, f64)> = Vec::with_capacity(4 * count);
            found.extend(self.within(&place, radius).filter(|(other, _)| *other != index));
            if found.len() >= count || radius > everything {
                if found.len() > count && count > 0 {
                    found.select_nth_unstable_by(count - 1, nearer);
                }
                found.truncate(count);
                return found;
            }
            radius *= 2.0;
        }
    }
}

/// By distance, and of equal ones by number.
pub fn nearer(a: &(usize, f64), b: &(usize, f64)) -> Ordering {
    a.1.total_cmp(&b.1).then(a.0.cmp(&b.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_nearest_is_what_a_full_search_finds(
            places in prop::collection::vec((0.0f64..640.0, 0.0f64..480.0), 1..80), x in -50.0f64..700.0, y in -50.0f64..500.0,
        ) {
            let points: Vec<Vec2> = places.into_iter().map(|(x, y)| Vec2::new(x, y)).collect();
            let place = Vec2::new(x, y);
            let sorted = Neighbours::new(&points);
            let full = |from: &Vec2, skip: usize| (0..points.len()).filter(|&i| i != skip)
                .min_by(|&a, &b| (points[a] - from).norm_squared().total_cmp(&(points[b] - from).norm_squared()));
            let found = sorted.nearest(&place, 1000.0);
            prop_assert_eq!(found, full(&place, usize::MAX));
            prop_assert_eq!(sorted.nearest_of(0, 1).first().copied(), full(&points[0], 0));
            prop_assert_eq!(sorted.nearest_of(0, 200).len(), points.len() - 1);
        }
    }
}
