//! Does a mark lie where the marks beside it put it? Rows and columns are smooth: perspective and lens
//! change a step little by little.
//!
//! A corner is compared with the polynomial through its neighbours on a line, of the highest degree that they
//! allow. One that was fitted to another edge stands out along its row and along its column; a crease in the
//! paper only along one of them, and stays.

use crate::geometry::Vec2;

/// A polynomial's value at place 0 from its values at other places, and how far a corner may lie from it, in
/// steps. The distances are twice what a board tilted by 70 degrees at close range shows, where a step is
/// three quarters of the one before.
struct Rule {
    weights: &'static [(isize, f64)],
    tolerance: f64,
}

const RULES: [Rule; 6] = [
    Rule { weights: &[(-1, 4.0 / 6.0), (1, 4.0 / 6.0), (-2, -1.0 / 6.0), (2, -1.0 / 6.0)], tolerance: 0.05 },
    Rule { weights: &[(-1, 1.0 / 3.0), (1, 1.0), (2, -1.0 / 3.0)], tolerance: 0.1 },
    Rule { weights: &[(1, 1.0 / 3.0), (-1, 1.0), (-2, -1.0 / 3.0)], tolerance: 0.1 },
    Rule { weights: &[(1, 3.0), (2, -3.0), (3, 1.0)], tolerance: 0.2 },
    Rule { weights: &[(-1, 3.0), (-2, -3.0), (-3, 1.0)], tolerance: 0.2 },
    Rule { weights: &[(-1, 0.5), (1, 0.5)], tolerance: 0.3 },
];

/// How far a corner may lie from where the other three of a square put it, in steps.
const FOURTH_TOLERANCE: f64 = 0.4;

/// Least tolerance, px: noise.
const LEAST_TOLERANCE_PX: f64 = 1.0;

/// The corners about one, along a row (`axis` 0) or a column (1).
struct About<'a> {
    good: &'a [Option<Vec2>],
    columns: usize,
    index: usize,
    axis: usize,
}

impl About<'_> {
    fn at(&self, along: isize, across: isize) -> Option<Vec2> {
        let (columns, rows) = (self.columns as isize, (self.good.len() / self.columns) as isize);
        let (column, row) = ((self.index % self.columns) as isize, (self.index / self.columns) as isize);
        let (x, y) =
            if self.axis == 0 { (column + along, row + across) } else { (column + across, row + along) };
        let inside = x >= 0 && y >= 0 && x < columns && y < rows;
        inside.then(|| self.good[(y * columns + x) as usize]).flatten()
    }

    /// Where those on its line put it, and how far from it it may lie, px.
    fn on_line(&self) -> Option<(Vec2, f64)> {
        RULES.iter().find_map(|Rule { weights, tolerance }| {
            let mut place = Vec2::zeros();
            for (k, weight) in *weights {
                place += self.at(*k, 0)? * *weight;
            }
            let [(near, _), (far, _), ..] = weights else { return None };
            let step = (self.at(*far, 0)? - self.at(*near, 0)?) / (far - near) as f64;
            Some(allowed(place, step, *tolerance))
        })
    }

    /// Where the other corners of a square put it, and how far from it it may lie, px.
    fn of_square(&self) -> Option<(Vec2, f64)> {
        [(1, 1), (1, -1), (-1, 1), (-1, -1)].into_iter().find_map(|(along, across)| {
            let step = self.at(0, across)? - self.at(along, across)?;
            Some(allowed(self.at(along, 0)? + step, step, FOURTH_TOLERANCE))
        })
    }
}

/// A place and how far from it a corner may lie, px.
fn allowed(place: Vec2, step: Vec2, tolerance: f64) -> (Vec2, f64) {
    (place, (tolerance * step.norm()).max(LEAST_TOLERANCE_PX))
}

/// Where its row and its column put a corner, and how far from it it may lie, px. Where neither goes on
/// beside it, the squares there tell, which are far less sure of it: a corner that its row has out of line
/// must not be kept by them because its column has a gap.
fn expectations(good: &[Option<Vec2>], columns: usize, index: usize) -> [Option<(Vec2, f64)>; 2] {
    let about = [0, 1].map(|axis| About { good, columns, index, axis });
    let on_lines = about.each_ref().map(About::on_line);
    if on_lines == [None; 2] { about.each_ref().map(About::of_square) } else { on_lines }
}

/// Where the corners beside put a corner, by the surer of its row and its column, and how far from it it may
/// lie, px.
pub fn expected(good: &[Option<Vec2>], columns: usize, index: usize) -> Option<(Vec2, f64)> {
    let beside = expectations(good, columns, index).into_iter().flatten();
    beside.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// How far a corner lies from where its neighbours put it, in tolerances, along the line that it fits better.
fn deviation(good: &[Option<Vec2>], columns: usize, index: usize) -> f64 {
    let Some(here) = good[index] else { return 0.0 };
    let of = |(place, tolerance): (Vec2, f64)| (here - place).norm() / tolerance;
    expectations(good, columns, index).into_iter().flatten().map(of).reduce(f64::min).unwrap_or(0.0)
}

/// The corners that are missing, and those out of line, which are taken out: the worst first, for one shifts
/// what is expected of its neighbours.
pub fn out_of_line(good: &mut [Option<Vec2>], columns: usize) -> Vec<usize> {
    loop {
        let worst = (0..good.len())
            .map(|index| (index, deviation(good, columns, index)))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        match worst {
            Some((index, deviation)) if deviation.is_nan() || deviation > 1.0 => good[index] = None,
            _ => break,
        }
    }
    (0..good.len()).filter(|&index| good[index].is_none()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A board in strong perspective: steps fall to three quarters of the one before.
    fn places() -> Vec<Option<Vec2>> {
        let at = |i: f64, j: f64| Vec2::new(40.0 * i, 50.0 * j) / (1.0 + 0.1 * i + 0.05 * j);
        (0..54).map(|k| Some(at(f64::from(k % 9), f64::from(k / 9)))).collect()
    }

    #[test]
    fn a_board_in_strong_perspective_is_in_line() {
        assert!(out_of_line(&mut places(), 9).is_empty());
    }

    #[test]
    fn displaced_corners_are_named_and_expected_where_they_were() {
        for displaced in [vec![0], vec![8, 22], vec![30, 31], vec![53, 45, 20]] {
            let (mut good, truth) = (places(), places());
            for &index in &displaced {
                // Ten pixels: a corner at an end of its lines may lie eight from where they put it.
                good[index] = good[index].map(|p| p + Vec2::new(6.0, -8.0));
            }
            let mut expected_out = displaced.clone();
            expected_out.sort_unstable();
            assert_eq!(out_of_line(&mut good, 9), expected_out);
            for index in displaced {
                let (place, tolerance) = expected(&good, 9, index).unwrap();
                assert!((place - truth[index].unwrap()).norm() < tolerance);
            }
        }
    }

    #[test]
    fn a_corner_that_its_row_has_out_of_line_is_not_kept_because_its_column_has_a_gap() {
        let (mut good, truth) = (places(), places());
        // Column 4 of row 2, with nothing above and below it within reach but one corner beside.
        for index in [4, 4 + 3 * 9, 4 + 4 * 9, 4 + 5 * 9] {
            good[index] = None;
        }
        let index = 4 + 2 * 9;
        // A third of a step along its column, which the squares beside would allow.
        let step = truth[index + 9].unwrap() - truth[index].unwrap();
        good[index] = truth[index].map(|place| place + 0.33 * step);
        assert!(out_of_line(&mut good, 9).contains(&index));
    }
}
