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

const RULES: [Rule; 7] = [
    Rule { weights: &[(-1, 4.0 / 6.0), (1, 4.0 / 6.0), (-2, -1.0 / 6.0), (2, -1.0 / 6.0)], tolerance: 0.05 },
    Rule { weights: &[(-1, 1.0 / 3.0), (1, 1.0), (2, -1.0 / 3.0)], tolerance: 0.1 },
    Rule { weights: &[(1, 1.0 / 3.0), (-1, 1.0), (-2, -1.0 / 3.0)], tolerance: 0.1 },
    Rule { weights: &[(1, 3.0), (2, -3.0), (3, 1.0)], tolerance: 0.2 },
    Rule { weights: &[(-1, 3.0), (-2, -3.0), (-3, 1.0)], tolerance: 0.2 },
    Rule { weights: &[(-1, 0.5), (1, 0.5)], tolerance: 0.3 },
    // A square's fourth corner, from the line beside: along the line alone there is nothing to compare with.
    Rule { weights: &[], tolerance: 0.4 },
];

/// Least tolerance, px: noise.
const LEAST_TOLERANCE_PX: f64 = 1.0;

/// Where the corners beside put a corner along a row (`axis` 0) or a column (1), and how far from it it may
/// lie, px.
fn expected_along(good: &[Option<Vec2>], columns: usize, index: usize, axis: usize) -> Option<(Vec2, f64)> {
    let rows = good.len() / columns;
    let (column, row) = ((index % columns) as isize, (index / columns) as isize);
    let at = |along: isize, across: isize| {
        let (x, y) = if axis == 0 { (column + along, row + across) } else { (column + across, row + along) };
        let inside = x >= 0 && y >= 0 && x < columns as isize && y < rows as isize;
        inside.then(|| good[y as usize * columns + x as usize]).flatten()
    };
    RULES.iter().find_map(|Rule { weights, tolerance }| {
        let (place, step) = match weights {
            [] => [(1, 1), (1, -1), (-1, 1), (-1, -1)].into_iter().find_map(|(along, across)| {
                let step = at(0, across)? - at(along, across)?;
                Some((at(along, 0)? + step, step))
            })?,
            [(near, _), (far, _), ..] => {
                let mut place = Vec2::zeros();
                for (k, weight) in *weights {
                    place += at(*k, 0)? * *weight;
                }
                (place, (at(*far, 0)? - at(*near, 0)?) / (far - near) as f64)
            }
            [_] => return None,
        };
        Some((place, (tolerance * step.norm()).max(LEAST_TOLERANCE_PX)))
    })
}

/// Where the corners beside put a corner, by the surer of its row and its column, and how far from it it may
/// lie, px.
pub fn expected(good: &[Option<Vec2>], columns: usize, index: usize) -> Option<(Vec2, f64)> {
    let along = [0, 1].map(|axis| expected_along(good, columns, index, axis));
    along.into_iter().flatten().min_by(|a, b| a.1.total_cmp(&b.1))
}

/// How far a corner lies from where its neighbours put it, in tolerances, along the line that it fits better.
fn deviation(good: &[Option<Vec2>], columns: usize, index: usize) -> f64 {
    let Some(here) = good[index] else { return 0.0 };
    let of = |(place, tolerance): (Vec2, f64)| (here - place).norm() / tolerance;
    let along = [0, 1].map(|axis| expected_along(good, columns, index, axis).map(of));
    along.into_iter().flatten().reduce(f64::min).unwrap_or(0.0)
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
}
