//! Which tags are there that could not be found by themselves? Where one must stand is told by those about
//! it, and so is which cells it must have: far fewer of them need be right than to tell one tag of 587.

use super::layout::AprilGrid;
use super::tag::{FARTHEST, Reading, Tag, side_px, unit_corners};
use crate::detect::chessboard::level::Pyramid;
use crate::detect::neighbours::Neighbours;
use crate::geometry::{Homography, Vec2};
use crate::raster::Level;

/// Fewest tags about a place that tell where one stands there.
const FEWEST_ABOUT: usize = 2;

/// Most cells of the 36 that may differ: of a random pattern's so few do in one of 1700.
const MOST_WRONG: u32 = 8;

/// How far from where it is expected a corner is looked for, in sides of a tag.
const REACH: f64 = 0.12;

/// The tags with those that are seen where they must be. `corners_px`: places that look like corners, px of
/// the photograph.
pub fn filled<T: Level>(
    pyramid: &Pyramid<'_, T>,
    corners_px: &[Vec2],
    mut tags: Vec<Tag>,
    grid: &AprilGrid,
) -> Vec<Tag> {
    let near = Neighbours::new(corners_px);
    loop {
        // Those of a round stand on the tags of the rounds before.
        let places = (0..grid.rows()).flat_map(|row| (0..grid.columns()).map(move |column| (column, row)));
        let missing = places.filter(|at| tags.iter().all(|tag| tag.at != *at));
        let new: Vec<Tag> = missing.filter_map(|at| expected(pyramid, &near, &tags, at, grid)).collect();
        if new.is_empty() {
            return tags;
        }
        tags.extend(new);
    }
}

/// The tag of a place, if it is seen there.
fn expected<T: Level>(
    pyramid: &Pyramid<'_, T>,
    near: &Neighbours<'_>,
    tags: &[Tag],
    at: (usize, usize),
    grid: &AprilGrid,
) -> Option<Tag> {
    let about: Vec<&Tag> = tags.iter().filter(|tag| tag.apart(at) <= FARTHEST).collect();
    let beside = about.iter().filter(|tag| tag.apart(at) == 1);
    if about.len() < FEWEST_ABOUT || beside.count() == 0 {
        return None;
    }
    let on_board = about.iter().flat_map(|tag| unit_corners().map(|corner| corner + tag.way_from(at, grid)));
    let in_photo = about.iter().flat_map(|tag| tag.corners_px);
    let (on_board, in_photo): (Vec<Vec2>, Vec<Vec2>) = (on_board.collect(), in_photo.collect());
    let photo_from_board = Homography::fit(&on_board, &in_photo).ok()?.homography;
    let mut corners_px = [Vec2::zeros(); 4];
    for (corner_px, corner) in corners_px.iter_mut().zip(unit_corners()) {
        *corner_px = photo_from_board.apply(&corner)?;
    }
    let reach_px = REACH * side_px(&corners_px);
    for corner_px in &mut corners_px {
        if let Some(found) = near.nearest(corner_px, reach_px) {
            *corner_px = near.points()[found];
        }
    }
    let contrast = about.iter().map(|tag| tag.contrast).fold(f64::INFINITY, f64::min);
    let reading = Reading::of(pyramid, corners_px, contrast, grid)?;
    let id = at.1 * grid.columns() + at.0;
    let is_there = reading.wrong_upright(id).is_some_and(|wrong| wrong <= MOST_WRONG);
    is_there.then_some(Tag { id, at, corners_px, contrast })
}
