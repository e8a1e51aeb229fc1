//! Is a mark at another mark's place, or beside its own? Each is asked of the plane through the marks about
//! it.
//!
//! Lattices are grown from mark to mark, and one that is taken a place too far at the rim may have nothing
//! beside it in its rows that would tell. A corner that was fitted to another edge of a moved photograph lies
//! beside its place, and where corners about it are missing, its row and its column tell little. The plane
//! through those that are there tells.

use super::neighbours::Neighbours;
use crate::geometry::{Homography, Vec2};

/// Marks through which the plane goes: three times as many as a homography needs tell it in spite of one that
/// is misplaced, and of more the lens bends what it says.
const ABOUT: usize = 12;
/// Fewer do not tell.
const FEWEST: usize = 8;
/// Places about a mark's own that it might have been taken from.
const OTHERS: usize = 8;

/// How far a mark may lie from the plane, in steps: what a lens bends a board within three steps.
const BENT: f64 = 0.05;
/// The same, in the middle one of such distances on the board: what blur, noise and a stronger lens do to
/// all.
const MIDDLES: f64 = 5.0;
/// The same, px: what no mark is taken out for.
const LEAST_PX: f64 = 1.0;

/// Takes out the marks that lie nearer to where another one is expected than to their own place. `on_board`:
/// where marks are on the board, neighbours about 1 apart.
pub fn take_out_misplaced(places_px: &mut [Option<Vec2>], on_board: &[Vec2]) {
    let all = Neighbours::new(on_board);
    take_out(places_px, on_board, |mark, _| {
        let others = all.nearest_of(mark.index, OTHERS).into_iter();
        let to_others = others
            .filter_map(|other| mark.plane.apply(&on_board[other]))
            .map(|other_px| (mark.place_px - other_px).norm());
        to_others.reduce(f64::min).unwrap_or(f64::INFINITY)
    });
}

/// Takes out the marks that lie beside their place, farther than a lens, blur or noise puts others of the
/// board.
pub fn take_out_beside(places_px: &mut [Option<Vec2>], on_board: &[Vec2]) {
    let all = Neighbours::new(on_board);
    take_out(places_px, on_board, |mark, middle_px| {
        let next = all.nearest_of(mark.index, 1).into_iter();
        let step_px = next
            .filter_map(|next| mark.plane.apply(&on_board[next]))
            .map(|next_px| (mark.expected_px - next_px).norm())
            .sum::<f64>();
        LEAST_PX.max(BENT * step_px).max(MIDDLES * middle_px)
    });
}

/// A mark and what the plane through those about it, without itself, expects.
struct Mark {
    index: usize,
    place_px: Vec2,
    plane: Homography,
    expected_px: Vec2,
}

impl Mark {
    fn off_px(&self) -> f64 {
        (self.place_px - self.expected_px).norm()
    }
}

/// Takes out the marks that lie farther from where they are expected than allowed, px, which is told a mark
/// and the middle one of the distances of all: the worst first, for one moves what is expected of those about
/// it.
fn take_out(places_px: &mut [Option<Vec2>], on_board: &[Vec2], allowed_px: impl Fn(&Mark, f64) -> f64) {
    loop {
        let marks = marks(places_px, on_board);
        let mut off_px: Vec<f64> = marks.iter().map(Mark::off_px).collect();
        off_px.sort_by(f64::total_cmp);
        let Some(&middle_px) = off_px.get(off_px.len() / 2) else { return };
        let beyond = marks.iter().map(|mark| (mark.index, mark.off_px() / allowed_px(mark, middle_px)));
        let Some((worst, _)) = beyond.filter(|mark| mark.1 > 1.0).max_by(|a, b| a.1.total_cmp(&b.1)) else {
            return;
        };
        places_px[worst] = None;
    }
}

/// The marks that are seen, of which enough others are.
fn marks(places_px: &[Option<Vec2>], on_board: &[Vec2]) -> Vec<Mark> {
    let seen: Vec<(usize, Vec2)> =
        places_px.iter().enumerate().filter_map(|(index, place)| Some((index, (*place)?))).collect();
    if seen.len() <= FEWEST {
        return Vec::new();
    }
    let seen_on_board: Vec<Vec2> = seen.iter().map(|(index, _)| on_board[*index]).collect();
    let sorted = Neighbours::new(&seen_on_board);
    let mark = |(nth, &(index, place_px)): (usize, &(usize, Vec2))| {
        let about = sorted.nearest_of(nth, ABOUT);
        let from: Vec<Vec2> = about.iter().map(|&other| seen_on_board[other]).collect();
        let to: Vec<Vec2> = about.iter().map(|&other| seen[other].1).collect();
        let plane = Homography::fit(&from, &to).ok()?.homography;
        let expected_px = plane.apply(&on_board[index])?;
        Some(Mark { index, place_px, plane, expected_px })
    };
    seen.iter().enumerate().filter_map(mark).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Staggered rows in strong perspective, as through a lens that bends them.
    fn places() -> (Vec<Option<Vec2>>, Vec<Vec2>) {
        let on_board: Vec<Vec2> =
            (0..44).map(|k| Vec2::new(f64::from(2 * (k % 4) + k / 4 % 2), f64::from(k / 4))).collect();
        let at = |p: &Vec2| {
            let plane = Vec2::new(60.0 * p.x + 6.0 * p.y, 70.0 * p.y) / (1.0 + 0.05 * p.x + 0.08 * p.y);
            let off = (plane - Vec2::new(200.0, 200.0)) / 600.0;
            Some(plane * (1.0 - 0.2 * off.norm_squared()))
        };
        (on_board.iter().map(at).collect(), on_board)
    }

    #[test]
    fn marks_at_their_places_stay() {
        let (mut places_px, on_board) = places();
        take_out_misplaced(&mut places_px, &on_board);
        assert!(places_px.iter().all(Option::is_some));
    }

    #[test]
    fn a_mark_that_is_taken_for_the_missing_one_beside_it_is_taken_out() {
        let (whole, on_board) = places();
        // At the rim, where no line goes through it, and in the middle.
        for (taken_for, mark) in [(3, 6), (0, 4), (43, 38), (21, 25)] {
            let mut places_px = whole.clone();
            places_px[taken_for] = places_px[mark].take();
            // What would tell along the rows is missing too.
            places_px[2] = None;
            take_out_misplaced(&mut places_px, &on_board);
            let out: Vec<usize> = (0..44).filter(|&k| places_px[k].is_none()).collect();
            let mut expected = vec![2, taken_for, mark];
            expected.sort_unstable();
            assert_eq!(out, expected);
        }
    }

    #[test]
    fn a_corner_that_was_fitted_to_another_edge_is_taken_out() {
        let whole: Vec<Option<Vec2>> = places().0;
        for beside in [0, 9, 22, 43] {
            let (mut places_px, on_board) = (whole.clone(), places().1);
            places_px[beside] = places_px[beside].map(|place| place + Vec2::new(-3.0, 4.0));
            take_out_beside(&mut places_px, &on_board);
            let out: Vec<usize> = (0..44).filter(|&k| places_px[k].is_none()).collect();
            assert_eq!(out, [beside]);
        }
    }

    #[test]
    fn noise_takes_no_corner_out() {
        let (mut places_px, on_board) = places();
        for (index, place) in places_px.iter_mut().enumerate() {
            // Of every direction, half a pixel long.
            let angle = index as f64 * 2.4;
            *place = place.map(|place| place + 0.5 * Vec2::new(libm::cos(angle), libm::sin(angle)));
        }
        take_out_beside(&mut places_px, &on_board);
        assert!(places_px.iter().all(Option::is_some));
    }
}
