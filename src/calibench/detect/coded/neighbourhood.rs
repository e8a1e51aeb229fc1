//! Which corners of tags lie where those about them do not put them? What covers a corner in part moves it.

use super::layout::AprilGrid;
use crate::geometry::{Homography, Vec2};

/// How far apart corners tell of each other, in corners along a row or a column: a tag and a half.
const FARTHEST: usize = 3;

/// Fewest corners that tell where one is.
const FEWEST: usize = 8;

/// Largest distance from there against the middle one of all, and what is allowed beside it, px. Noise, blur
/// and the lens enter all alike.
const LARGEST: f64 = 4.0;
const ALLOWED_PX: f64 = 0.1;

/// Takes out the corners that are farther from where those about them put them than the others are, the worst
/// first, for one moves what is expected of those beside it. Corners row by row from above.
pub fn take_out_outlying(corners_px: &mut [Option<Vec2>], grid: &AprilGrid) {
    let on_board = grid.points();
    let columns = 2 * grid.columns();
    let mut off: Vec<Option<f64>> =
        (0..corners_px.len()).map(|index| off_px(corners_px, &on_board, columns, index)).collect();
    let mut sorted: Vec<f64> = off.iter().copied().flatten().collect();
    sorted.sort_by(f64::total_cmp);
    let Some(middle) = sorted.get(sorted.len() / 2) else { return };
    let most = LARGEST * middle + ALLOWED_PX;
    loop {
        let all = off.iter().enumerate().filter_map(|(index, off)| Some((index, (*off)?)));
        let Some((worst, _)) = all.max_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, off)| *off > most) else {
            return;
        };
        corners_px[worst] = None;
        for (index, off) in off.iter_mut().enumerate().filter(|(index, _)| is_near(*index, worst, columns)) {
            *off = off_px(corners_px, &on_board, columns, index);
        }
    }
}

fn is_near(a: usize, b: usize, columns: usize) -> bool {
    (a % columns).abs_diff(b % columns).max((a / columns).abs_diff(b / columns)) <= FARTHEST
}

/// How far a corner lies from where those about it put it, px.
fn off_px(corners_px: &[Option<Vec2>], on_board: &[Vec2], columns: usize, index: usize) -> Option<f64> {
    let here = corners_px[index]?;
    let about = || {
        let others = corners_px.iter().enumerate().filter_map(|(other, at)| Some((other, (*at)?)));
        others.filter(|(other, _)| *other != index && is_near(*other, index, columns))
    };
    if about().count() < FEWEST {
        return None;
    }
    // Rows from above: the board's order is from below, and its mirror is as plane.
    let from: Vec<Vec2> = about().map(|(other, _)| on_board[other]).collect();
    let to: Vec<Vec2> = about().map(|(_, at)| at).collect();
    let plane = Homography::fit(&from, &to).ok()?.homography;
    Some((plane.apply(&on_board[index])? - here).norm())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A grid in perspective, its corners off by a few hundredths of a pixel.
    fn corners(grid: &AprilGrid) -> Vec<Option<Vec2>> {
        let at = |(index, p): (usize, Vec2)| {
            let noise = 0.02 * Vec2::new((index * 7 % 5) as f64 - 2.0, (index * 11 % 7) as f64 - 3.0);
            Vec2::new(100.0 + 40.0 * p.x, 50.0 + 35.0 * p.y) / (1.0 + 0.05 * p.x + 0.03 * p.y) + noise
        };
        grid.points().into_iter().enumerate().map(at).map(Some).collect()
    }

    #[test]
    fn corners_that_lie_elsewhere_are_taken_out_and_no_others() {
        let grid = AprilGrid::new(5, 4, 0.3).unwrap();
        for moved in [vec![], vec![0], vec![34, 35], vec![79, 12, 50]] {
            let mut places = corners(&grid);
            for &index in &moved {
                places[index] = places[index].map(|p| p + Vec2::new(1.0, -1.5));
            }
            take_out_outlying(&mut places, &grid);
            let mut out = moved.clone();
            out.sort_unstable();
            assert_eq!((0..80).filter(|&k| places[k].is_none()).collect::<Vec<_>>(), out);
        }
    }

    #[test]
    fn too_few_corners_are_left_as_they_are() {
        let grid = AprilGrid::new(2, 1, 0.3).unwrap();
        let mut places = corners(&grid);
        places[3] = places[3].map(|p| p + Vec2::new(9.0, 0.0));
        take_out_outlying(&mut places, &grid);
        assert!(places.iter().all(Option::is_some));
    }
}
