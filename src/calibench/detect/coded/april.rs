//! Where are the corners of a grid of AprilTags? Between the tags small black squares touch their corners, as Kalibr
//! draws them, so that each is a corner of a chessboard to the search and to the fit.
//!
//! 1. From corner to corner along the edges, the dark side always on the same hand: four edges that lead back to the
//!    first corner are a dark quadrangle ([`quads`](super::quads)).
//! 2. Those with a tag inside tell their place on the board.
//! 3. A tag counts if one beside it lies where the two numbers say.
//! 4. Corners are fitted to the photograph's pixels.

use super::CodedError;
use super::cells::{Patch, read};
use super::dictionary::{Dictionary, turned};
use super::layout::AprilGrid;
use super::quads::{Quad, quads};
use crate::detect::chessboard::candidates::{Strength, candidates};
use crate::detect::chessboard::level::{Pyramid, level_from_photo, photo_from_level};
use crate::detect::chessboard::look::Look;
use crate::detect::chessboard::refine::refined;
use crate::detect::chessboard::search_order;
use crate::detect::{Orientation, SeenBoard};
use crate::geometry::{Homography, Vec2};
use crate::raster::{Level, Raster};

/// Cells of a tag's border: Kalibr's two, and one of AprilTag's own.
const BORDERS: [usize; 2] = [2, 1];

/// Least difference of a tag's white and black, as part of the corners' contrast.
const LEAST_CONTRAST: f64 = 0.3;

/// How far from where another tag puts it a tag's middle may lie, in its sides, for each tag between the two.
const MOST_OFF: f64 = 0.25;

/// How far apart tags vouch for each other, in places of the grid: farther, the lens bends what a homography says.
const FARTHEST: usize = 2;

/// Fewest corners whose places make a view.
const FEWEST_MARKS: usize = 4;

/// Side neighbours whose distance tells the spacing of the tags, and by how much it may differ from what was said, in sides.
const FEWEST_NEIGHBOURS: usize = 8;
const MOST_WIDER: f64 = 0.04;

/// Tags beyond the board that others confirm: one may be read wrongly.
const FEWEST_BEYOND: usize = 2;

/// Finds the corners of a grid of AprilTags that are seen, in Kalibr's order: row by row of corners from the lower left
/// one of the first tag upwards, twice as many along a row as tags. A tag counts if one near it agrees.
///
/// # Errors
/// See [`CodedError`]; a grid of another size or spacing too, where enough of it is seen to tell.
pub fn seen_april_grid<T: Level>(image: &Raster<T>, grid: &AprilGrid) -> Result<SeenBoard, CodedError> {
    let pyramid = Pyramid::new(image);
    let mut best: Option<(usize, Vec<Tag>)> = None;
    let mut failure = CodedError::NoCorners { seen: 0 };
    for level in search_order(image, pyramid.levels()) {
        for strength in [Strength::Strong, Strength::Any] {
            match in_level(&pyramid, level, strength, grid) {
                Ok(tags) => {
                    if best.as_ref().is_none_or(|(_, best)| tags.len() > best.len()) {
                        best = Some((level, tags));
                    }
                    break;
                }
                Err(failed) => failure = telling(failure, failed),
            }
        }
        if best.as_ref().is_some_and(|(_, tags)| tags.len() == grid.columns() * grid.rows()) {
            break;
        }
    }
    match best {
        Some((level, tags)) if !contradicts(&failure, tags.len()) => fitted(&pyramid, level, &tags, grid),
        _ => Err(failure),
    }
}

/// Whether what one level showed speaks against so many tags that agree in another.
fn contradicts(failure: &CodedError, agreeing: usize) -> bool {
    match failure {
        CodedError::GoesOn { .. } | CodedError::Spacing { .. } => true,
        CodedError::Disagree { read, .. } => *read > agreeing,
        _ => false,
    }
}

/// The error that tells more, the first of equal ones.
fn telling(first: CodedError, other: CodedError) -> CodedError {
    let rank = |error: &CodedError| match error {
        CodedError::NoCorners { seen } => (0, usize::from(*seen > 0)),
        CodedError::NoMarker { corners, .. } => (1, *corners),
        CodedError::OneMarker { .. } => (2, 0),
        CodedError::Disagree { read, .. } => (3, *read),
        _ => (4, 0),
    };
    if rank(&other) > rank(&first) { other } else { first }
}

/// A tag that was read.
struct Tag {
    id: usize,
    /// Its place on the grid: column, and row from below.
    at: (usize, usize),
    /// Its corners as it stands on the board, px of the photograph: top left, top right, bottom right, bottom left.
    corners_px: [Vec2; 4],
}

impl Tag {
    /// From its own plane, in its sides about its middle with y down, to the photograph.
    fn unit(&self) -> Option<Homography> {
        let unit = CORNERS.map(|(x, y)| 0.5 * Vec2::new(f64::from(x), f64::from(y)));
        Homography::fit(&unit, &self.corners_px).ok().map(|fit| fit.homography)
    }

    fn middle_px(&self) -> Vec2 {
        self.corners_px.iter().sum::<Vec2>() / 4.0
    }
}

/// A tag's corners about its middle, y down, in halves of its side.
const CORNERS: [(i32, i32); 4] = [(-1, -1), (1, -1), (1, 1), (-1, 1)];

fn in_level<T: Level>(
    pyramid: &Pyramid<'_, T>,
    level: usize,
    strength: Strength,
    grid: &AprilGrid,
) -> Result<Vec<Tag>, CodedError> {
    let smoothed = pyramid.smoothed(level);
    let candidates = candidates(&smoothed, strength);
    let seen = quads(&smoothed, &candidates);
    if seen.is_empty() {
        return Err(CodedError::NoCorners { seen: candidates.len() });
    }
    let tags: Vec<Tag> = seen.iter().filter_map(|quad| tag(pyramid, level, quad, grid)).collect();
    let (columns, rows) = (grid.columns(), grid.rows());
    let (read, only) = (tags.len(), tags.first().map_or(0, |tag| tag.id));
    if goes_on(&tags, grid) {
        return Err(CodedError::GoesOn { columns, rows });
    }
    let agreeing = agreeing(tags, grid);
    if let Some(seen) = pitch(&agreeing).filter(|pitch| (pitch - 1.0 - grid.spacing()).abs() > MOST_WIDER) {
        let thousandths = |spacing: f64| libm::round(1000.0 * spacing.max(0.0)) as usize;
        return Err(CodedError::Spacing {
            asked: thousandths(grid.spacing()),
            seen: thousandths(seen - 1.0),
        });
    }
    if !agreeing.is_empty() {
        return Ok(agreeing);
    }
    Err(match read {
        0 => CodedError::NoMarker { corners: 4 * seen.len(), dictionary: Dictionary::april_36h11() },
        1 => CodedError::OneMarker { id: only },
        _ => CodedError::Disagree { agree: 0, read, columns, rows, other: None },
    })
}

/// Whether tags are seen that follow the board's last, where they would stand on one with more rows.
fn goes_on(tags: &[Tag], grid: &AprilGrid) -> bool {
    let is_beyond = |tag: &&Tag| tag.at.1 >= grid.rows();
    let is_confirmed = |tag: &&Tag| {
        let confirms = |other: &Tag| {
            other.id != tag.id
                && apart(tag, other) <= FARTHEST
                && agree(tag, other, grid)
                && agree(other, tag, grid)
        };
        tags.iter().any(confirms)
    };
    tags.iter().filter(is_beyond).filter(is_confirmed).count() >= FEWEST_BEYOND
}

/// The median distance of side neighbours' middles, in sides of a tag; `None` of too few.
fn pitch(tags: &[Tag]) -> Option<f64> {
    let beside = |tag: &Tag, other: &Tag| {
        let (dx, dy) = (tag.at.0.abs_diff(other.at.0), tag.at.1.abs_diff(other.at.1));
        dx + dy == 1
    };
    // From a tag as near as from its neighbour: what perspective adds to one it takes from the other.
    let seen_from = |tag: &Tag, other: &Tag| {
        let middle_px = other.unit()?.apply(&Vec2::zeros())?;
        Some(tag.unit()?.inverse()?.apply(&middle_px)?.norm())
    };
    let mut distances: Vec<f64> = Vec::new();
    for (i, tag) in tags.iter().enumerate() {
        for other in tags[i + 1..].iter().filter(|other| beside(tag, other)) {
            distances.push(0.5 * (seen_from(tag, other)? + seen_from(other, tag)?));
        }
    }
    distances.sort_by(f64::total_cmp);
    (distances.len() >= FEWEST_NEIGHBOURS).then(|| distances[distances.len() / 2])
}

/// The tag in a quadrangle.
fn tag<T: Level>(pyramid: &Pyramid<'_, T>, level: usize, quad: &Quad, grid: &AprilGrid) -> Option<Tag> {
    let corners_px = quad.corners.map(|corner| photo_from_level(&corner, level));
    let unit = [Vec2::zeros(), Vec2::new(1.0, 0.0), Vec2::new(1.0, 1.0), Vec2::new(0.0, 1.0)];
    let photo_from_marker = Homography::fit(&unit, &corners_px).ok()?.homography;
    let dictionary = Dictionary::april_36h11();
    let recognised = BORDERS.iter().find_map(|&border| {
        let patch = Patch { photo_from_marker, border, white: grid.spacing() };
        let cells = read(pyramid, &patch, dictionary.side(), LEAST_CONTRAST * quad.contrast)?;
        dictionary.recognise(cells, dictionary.len())
    })?;
    let mut upright = corners_px;
    for (corner, at) in corners_px.iter().zip(CORNERS) {
        // OpenCV's table has the tags turned by half.
        let stands_at = turned(at, recognised.turns + 2);
        upright[CORNERS.iter().position(|&corner| corner == stands_at)?] = *corner;
    }
    let at = (recognised.id % grid.columns(), recognised.id / grid.columns());
    Some(Tag { id: recognised.id, at, corners_px: upright })
}

/// Pairs of tags that agree for each that does not. Of a grid of another width those of a row agree, and those above each
/// other do not.
const FOR_EACH_AGAINST: usize = 10;

/// The tags of a grid that others confirm, each number once; none where too many contradict each other.
fn agreeing(tags: Vec<Tag>, grid: &AprilGrid) -> Vec<Tag> {
    let is_on_board = |tag: &Tag| tag.at.1 < grid.rows();
    // Those near a tag that agree, and those that do not.
    let votes = |tag: &Tag| {
        let near = |other: &&Tag| other.id != tag.id && is_on_board(other) && apart(tag, other) <= FARTHEST;
        let near = || tags.iter().filter(near);
        let agree = near().filter(|other| agree(tag, other, grid) && agree(other, tag, grid)).count();
        (agree, near().count() - agree)
    };
    let votes: Vec<(usize, usize)> =
        tags.iter().map(|tag| if is_on_board(tag) { votes(tag) } else { (0, 0) }).collect();
    let total = votes.iter().fold((0, 0), |sum, vote| (sum.0 + vote.0, sum.1 + vote.1));
    if total.0 < FOR_EACH_AGAINST * total.1 {
        return Vec::new();
    }
    let mut best: Vec<Option<usize>> = vec![None; grid.columns() * grid.rows()];
    for (index, tag) in tags.iter().enumerate() {
        let (agree, against) = votes[index];
        if agree > against && agree > best[tag.id].map_or(0, |other| votes[other].0) {
            best[tag.id] = Some(index);
        }
    }
    let kept: Vec<bool> = (0..tags.len()).map(|index| best.contains(&Some(index))).collect();
    tags.into_iter().zip(kept).filter(|(_, kept)| *kept).map(|(tag, _)| tag).collect()
}

/// How many places of the grid lie between two tags.
fn apart(tag: &Tag, other: &Tag) -> usize {
    tag.at.0.abs_diff(other.at.0).max(tag.at.1.abs_diff(other.at.1))
}

/// Whether a tag lies where another puts it.
fn agree(tag: &Tag, other: &Tag, grid: &AprilGrid) -> bool {
    let pitch = 1.0 + grid.spacing();
    let step = |a: usize, b: usize| (a as f64 - b as f64) * pitch;
    // Rows are counted upwards, and y points down.
    let way = Vec2::new(step(other.at.0, tag.at.0), -step(other.at.1, tag.at.1));
    let Some(expected) = tag.unit().and_then(|photo_from_tag| photo_from_tag.apply(&way)) else {
        return false;
    };
    let side = (other.corners_px[0] - other.corners_px[2]).norm() / std::f64::consts::SQRT_2;
    (expected - other.middle_px()).norm() < MOST_OFF * side * apart(tag, other) as f64
}

/// The corners of the tags, fitted in the photograph.
fn fitted<T: Level>(
    pyramid: &Pyramid<'_, T>,
    level: usize,
    tags: &[Tag],
    grid: &AprilGrid,
) -> Result<SeenBoard, CodedError> {
    let (columns, rows) = (2 * grid.columns(), 2 * grid.rows());
    // From above downwards, as the fit takes them.
    let mut places = vec![None; columns * rows];
    for tag in tags {
        let row = grid.rows() - 1 - tag.at.1;
        for (corner, (x, y)) in tag.corners_px.iter().zip([(0, 0), (1, 0), (1, 1), (0, 1)]) {
            places[(2 * row + y) * columns + 2 * tag.at.0 + x] = Some(level_from_photo(corner, level));
        }
    }
    let look = Look::of_tags(grid.spacing());
    let fitted = refined(pyramid, level, &places, columns, true, &look).alike(pyramid.photo(), columns);
    let found = fitted.iter().flatten().count();
    if found < FEWEST_MARKS {
        return Err(CodedError::Unclear { found });
    }
    let upwards = fitted.chunks(columns).rev().flatten().copied().collect();
    Ok(SeenBoard::new(columns, rows, upwards, Orientation::Fixed))
}
