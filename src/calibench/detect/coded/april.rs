//! Where are the corners of a grid of AprilTags? Between the tags small black squares touch their corners, as
//! Kalibr draws them, so that each is a corner of a chessboard to the search and to the fit.
//!
//! 1. From corner to corner along the edges, the dark side always on the same hand: four edges that lead back to the
//!    first corner are a dark quadrangle ([`quads`](super::quads)).
//! 2. Those with a tag inside tell their place on the board. A tag counts if one beside it lies where the two numbers say;
//!    where hardly one can be read, all are told together ([`together`](super::together)).
//! 3. Tags that were not seen by themselves are looked for where the others put them ([`filled`](super::filled)).
//! 4. Corners are fitted to the photograph's pixels; those that lie elsewhere than the corners about them say are left out
//!    ([`neighbourhood`](super::neighbourhood)).

use super::dictionary::Dictionary;
use super::filled::filled;
use super::layout::AprilGrid;
use super::neighbourhood::take_out_outlying;
use super::quads::quads;
use super::tag::{FARTHEST, Reading, Tag, middle_px, side_px};
use super::together::together;
use super::{CodedError, FEWEST_OF_ANOTHER};
use crate::detect::chessboard::candidates::{Strength, candidates};
use crate::detect::chessboard::level::{
    Pyramid, Smoothed, TWICE_PX, level_from_photo, photo_from_scale, scale,
};
use crate::detect::chessboard::look::Look;
use crate::detect::chessboard::refine::refined;
use crate::detect::chessboard::search_order;
use crate::detect::{Orientation, SeenBoard};
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};

/// How far from where another tag puts it a tag's middle may lie, in its sides, for each tag between the two.
const MOST_OFF: f64 = 0.25;

/// Fewest corners whose places make a view.
const FEWEST_MARKS: usize = 4;

/// Least part of the tags' corners that must have exact places: where motion leaves edges to a few by chance,
/// these are wrong.
const LEAST_CLEAR: f64 = 1.0 / 3.0;

/// Side neighbours whose distance tells the spacing of the tags, and by how much it may differ from what was
/// said, in sides.
const FEWEST_NEIGHBOURS: usize = 8;
const MOST_WIDER: f64 = 0.04;

/// By how much the spacing may differ where corners have exact places, in sides of a tag, beside the middle
/// deviation of what single pairs of tags tell: that of corners that err by a tenth of a pixel, or that a
/// strong lens bends.
const MOST_WIDER_EXACTLY: f64 = 0.01;

/// Fewest pairs of tags whose corners tell the spacing; that of so few may differ as that of the tags'
/// middles may.
const FEWEST_PAIRS: usize = 5;

/// Tags beyond the board that others confirm: one may be read wrongly.
const FEWEST_BEYOND: usize = 2;

/// Finds the corners of a grid of AprilTags that are seen, in Kalibr's order: row by row of corners from the
/// lower left one of the first tag upwards, twice as many along a row as tags. A tag counts if one near it
/// agrees, and the tags of more than one row are needed: one row of them looks alike on grids of any width.
///
/// # Errors
/// See [`CodedError`]; a grid of another size or spacing too, where enough of it is seen to tell.
///
/// ```
/// use calibench::detect::{AprilGrid, seen_april_grid};
/// use calibench::geometry::Vec2;
/// use calibench::synth::Truth;
/// use calibench::synth::render::{Imaging, photograph_dark};
/// use calibench::synth::scene::looking_at_centre;
///
/// // Tags of 9 mm, 2.7 mm apart, about the board's middle; Kalibr's y points up, the camera's down.
/// let grid = AprilGrid::new(5, 3, 0.3)?;
/// let middle = 0.5 * Vec2::new(5.0 + 4.0 * 0.3, 3.0 + 2.0 * 0.3);
/// let on_board = |p: Vec2| 9.0 * Vec2::new(p.x - middle.x, middle.y - p.y);
/// let sorted = |[a, b]: [Vec2; 2]| [a.inf(&b), a.sup(&b)];
/// let dark: Vec<[Vec2; 2]> = grid.dark().into_iter().map(|square| sorted(square.map(on_board))).collect();
/// let marks: Vec<Vec2> = grid.points().into_iter().map(on_board).collect();
/// let (camera, pose) = (Truth::example_camera(), looking_at_centre([20.0, -10.0, 5.0], 150.0));
/// let imaging = Imaging { blur_px: 0.6, ..Imaging::default() };
/// let photo = photograph_dark(&camera, Truth::EXAMPLE_IMAGE, &dark, &marks, &pose, &imaging)?;
/// let seen = seen_april_grid(&photo.image, &grid)?;
/// assert_eq!((seen.places_px().len(), seen.missing()), (60, 0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn seen_april_grid<T: Level>(image: &Raster<T>, grid: &AprilGrid) -> Result<SeenBoard, CodedError> {
    let search = Search { pyramid: Pyramid::new(image), grid };
    let mut found = Found { best: None, failure: CodedError::NoCorners { seen: 0 } };
    for level in search_order(image, search.pyramid.levels()) {
        let scaled = Scaled { smoothed: search.pyramid.smoothed(level), pixel_px: scale(level) };
        found.add(level, search.among_all(&scaled));
        if found.is_all(grid) {
            break;
        }
    }
    if !found.is_all(grid)
        && let Some(smoothed) = search.pyramid.twice()
    {
        found.add(0, search.among_all(&Scaled { smoothed, pixel_px: TWICE_PX }));
    }
    let (level, tags) = found.certain(grid)?;
    search.fitted(level, &tags)
}

/// An image in which tags are searched, smoothed.
struct Scaled {
    smoothed: Smoothed,
    /// Side of its pixels, px of the photograph.
    pixel_px: f64,
}

/// What the sizes of an image showed.
struct Found {
    /// The most tags, and their level.
    best: Option<(usize, Vec<Tag>)>,
    failure: CodedError,
}

impl Found {
    fn add(&mut self, level: usize, found: Result<Vec<Tag>, CodedError>) {
        match found {
            Ok(tags) if self.best.as_ref().is_none_or(|(_, best)| tags.len() > best.len()) => {
                self.best = Some((level, tags));
            }
            Ok(_) => {}
            Err(failed) => {
                let failure = std::mem::replace(&mut self.failure, CodedError::NoCorners { seen: 0 });
                self.failure = telling(failure, failed);
            }
        }
    }

    fn is_all(&self, grid: &AprilGrid) -> bool {
        self.best.as_ref().is_some_and(|(_, tags)| tags.len() == grid.columns() * grid.rows())
    }

    /// The tags of the best level, if nothing speaks against them.
    fn certain(self, grid: &AprilGrid) -> Result<(usize, Vec<Tag>), CodedError> {
        let Some((level, tags)) = self.best else { return Err(self.failure) };
        if contradicts(&self.failure, tags.len()) {
            return Err(self.failure);
        }
        let row = tags[0].at.1;
        if grid.rows() > 1 && tags.iter().all(|tag| tag.at.1 == row) {
            return Err(CodedError::OneRow { tags: tags.len() });
        }
        Ok((level, tags))
    }
}

struct Search<'a, T> {
    pyramid: Pyramid<'a, T>,
    grid: &'a AprilGrid,
}

impl<T: Level> Search<'_, T> {
    /// Strong corners first; where they do not make the board, all.
    fn among_all(&self, scaled: &Scaled) -> Result<Vec<Tag>, CodedError> {
        self.among(scaled, Strength::Strong)
            .or_else(|strong| self.among(scaled, Strength::Any).map_err(|any| telling(strong, any)))
    }

    /// The tags of the board that are seen.
    fn among(&self, scaled: &Scaled, strength: Strength) -> Result<Vec<Tag>, CodedError> {
        let candidates = candidates(&scaled.smoothed, strength);
        let seen = quads(&scaled.smoothed, &candidates);
        if seen.is_empty() {
            return Err(CodedError::NoCorners { seen: candidates.len() });
        }
        let in_photo = |place: &Vec2| photo_from_scale(place, scaled.pixel_px);
        let reading = |quad: &super::quads::Quad| {
            Reading::of(&self.pyramid, quad.corners.map(|corner| in_photo(&corner)), quad.contrast, self.grid)
        };
        let readings: Vec<Reading> = seen.iter().filter_map(reading).collect();
        let read: Vec<Tag> = readings.iter().filter_map(|reading| reading.tag(self.grid)).collect();
        let tags = self.told(&readings, read).map_err(|error| error.of_corners(4 * seen.len()))?;
        let corners_px: Vec<Vec2> = candidates.iter().map(|candidate| in_photo(&candidate.at)).collect();
        Ok(filled(&self.pyramid, &corners_px, tags, self.grid))
    }

    /// The tags of which it is certain which they are.
    fn told(&self, readings: &[Reading], read: Vec<Tag>) -> Result<Vec<Tag>, CodedError> {
        let grid = self.grid;
        let (columns, rows) = (grid.columns(), grid.rows());
        let (count, only) = (read.len(), read.first().map_or(0, |tag| tag.id));
        if goes_on(&read, grid) {
            return Err(CodedError::GoesOn { columns, rows });
        }
        let mut tags = agreeing(read, grid);
        if tags.is_empty() {
            tags = together(readings, grid);
        }
        if let Some(seen) = pitch(&tags).filter(|pitch| (pitch - 1.0 - grid.spacing()).abs() > MOST_WIDER) {
            return Err(of_spacing(grid, seen - 1.0));
        }
        if !tags.is_empty() {
            return Ok(tags);
        }
        let in_mirror = readings.iter().filter(|reading| reading.is_mirrored()).count();
        Err(match count {
            _ if in_mirror >= FEWEST_OF_ANOTHER.max(count + 1) => CodedError::Mirrored { count: in_mirror },
            0 => CodedError::NoMarker { corners: 0, dictionary: Dictionary::april_36h11() },
            1 => CodedError::OneMarker { id: only },
            _ => CodedError::Disagree { agree: 0, read: count, columns, rows, other: None },
        })
    }

    /// The corners of the tags, fitted in the photograph.
    fn fitted(&self, level: usize, tags: &[Tag]) -> Result<SeenBoard, CodedError> {
        let grid = self.grid;
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
        let fitted = refined(&self.pyramid, level, &places, columns, true, &look);
        let mut corners_px = fitted.alike(self.pyramid.photo(), columns);
        take_out_outlying(&mut corners_px, grid);
        let found = corners_px.iter().flatten().count();
        let looked_for = places.iter().flatten().count();
        if let Some(seen) = another_spacing(&corners_px, columns, grid) {
            return Err(of_spacing(grid, seen));
        }
        if found < FEWEST_MARKS || (found as f64) < LEAST_CLEAR * looked_for as f64 {
            return Err(CodedError::Unclear { found });
        }
        let upwards = corners_px.chunks(columns).rev().flatten().copied().collect();
        Ok(SeenBoard::new(columns, rows, upwards, Orientation::Fixed))
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

/// Whether tags are seen that follow the board's last, where they would stand on one with more rows.
fn goes_on(tags: &[Tag], grid: &AprilGrid) -> bool {
    let is_beyond = |tag: &&Tag| tag.at.1 >= grid.rows();
    let is_confirmed = |tag: &&Tag| {
        let confirms = |other: &Tag| {
            other.id != tag.id
                && other.apart(tag.at) <= FARTHEST
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

fn of_spacing(grid: &AprilGrid, seen: f64) -> CodedError {
    let thousandths = |spacing: f64| libm::round(1000.0 * spacing.max(0.0)) as usize;
    CodedError::Spacing { asked: thousandths(grid.spacing()), seen: thousandths(seen) }
}

/// The spacing of the tags by their corners, if it is another than was asked. Four corners of two tags on a
/// line, at 0, 1, 1 + s and 2 + s, have a cross ratio that perspective leaves as it is:
///
/// ```text
/// c = (x3 - x1) (x4 - x2) / ((x3 - x2) (x4 - x1)) = (1 + s)^2 / (s (2 + s)),      1 + s = sqrt(c / (c - 1))
/// ```
fn another_spacing(corners_px: &[Option<Vec2>], columns: usize, grid: &AprilGrid) -> Option<f64> {
    let rows = corners_px.len() / columns;
    let at = |column: usize, row: usize| {
        if column < columns && row < rows { corners_px[row * columns + column] } else { None }
    };
    let of_four = |step: &dyn Fn(usize) -> (usize, usize)| {
        let place = |k: usize| {
            let (column, row) = step(k);
            at(column, row)
        };
        let [a, b, c, d] = [place(0)?, place(1)?, place(2)?, place(3)?];
        let ratio = (c - a).norm() * (d - b).norm() / ((c - b).norm() * (d - a).norm());
        Some((ratio / (ratio - 1.0)).sqrt() - 1.0).filter(|spacing| spacing.is_finite())
    };
    let along_row = (0..rows).flat_map(|row| (0..columns).step_by(2).map(move |column| (column, row)));
    let down_column = (0..columns).flat_map(|column| (0..rows).step_by(2).map(move |row| (column, row)));
    let mut told: Vec<f64> = along_row
        .filter_map(|(column, row)| of_four(&|k| (column + k, row)))
        .chain(down_column.filter_map(|(column, row)| of_four(&|k| (column, row + k))))
        .collect();
    let spacing = median(&mut told).filter(|_| told.len() >= FEWEST_PAIRS)?;
    let mut off: Vec<f64> = told.iter().map(|one| (one - spacing).abs()).collect();
    let (few, deviation) = (told.len() < 2 * FEWEST_NEIGHBOURS, median(&mut off)?);
    let most = if few { MOST_WIDER + 2.0 * deviation } else { MOST_WIDER_EXACTLY + deviation };
    ((spacing - grid.spacing()).abs() > most).then_some(spacing)
}

/// The middle one.
fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

/// Pairs of tags that agree for each that does not. Of a grid of another width those of a row agree, and
/// those above each other do not.
const FOR_EACH_AGAINST: usize = 10;

/// The tags of a grid that others confirm, each number once; none where too many contradict each other.
fn agreeing(tags: Vec<Tag>, grid: &AprilGrid) -> Vec<Tag> {
    let is_on_board = |tag: &Tag| tag.at.1 < grid.rows();
    // Those near a tag that agree, and those that do not.
    let votes = |tag: &Tag| {
        let near = |other: &&Tag| other.id != tag.id && is_on_board(other) && other.apart(tag.at) <= FARTHEST;
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
    one_board(tags.into_iter().zip(kept).filter(|(_, kept)| *kept).map(|(tag, _)| tag).collect(), grid)
}

/// The tags, if all stand on one board; none where some that confirm each other stand elsewhere than the most
/// do. Rows of a grid of which the numbers begin elsewhere, or of another width, go on in the next row of
/// this one: their parts agree, each by itself.
fn one_board(tags: Vec<Tag>, grid: &AprilGrid) -> Vec<Tag> {
    let agree = |tag: &Tag, other: &Tag| agree(tag, other, grid) && agree(other, tag, grid);
    let parts = connected(tags, |tag, other| other.apart(tag.at) <= FARTHEST && agree(tag, other));
    let mut parts = parts.into_iter();
    let Some(mut most) = parts.next() else { return Vec::new() };
    let mut elsewhere = 0;
    for part in parts {
        // What lies farther from the rest than tags look, as beyond something that covers the middle.
        if part.iter().any(|tag| most.iter().any(|other| agree(tag, other))) {
            most.extend(part);
        } else {
            elsewhere += part.len();
        }
    }
    if most.len() < FOR_EACH_AGAINST * elsewhere { Vec::new() } else { most }
}

/// Parts of which each tag is linked to another, the largest first, and the first of equal ones.
fn connected(tags: Vec<Tag>, are_linked: impl Fn(&Tag, &Tag) -> bool) -> Vec<Vec<Tag>> {
    let mut left = tags;
    let mut parts = Vec::new();
    while !left.is_empty() {
        let mut part = vec![left.remove(0)];
        let mut next = 0;
        while next < part.len() {
            let (linked, others) = left.into_iter().partition(|tag| are_linked(&part[next], tag));
            left = others;
            part.extend::<Vec<Tag>>(linked);
            next += 1;
        }
        parts.push(part);
    }
    parts.sort_by_key(|part| std::cmp::Reverse(part.len()));
    parts
}

/// Whether a tag lies where another puts it.
fn agree(tag: &Tag, other: &Tag, grid: &AprilGrid) -> bool {
    let way = other.way_from(tag.at, grid);
    let Some(expected) = tag.unit().and_then(|photo_from_tag| photo_from_tag.apply(&way)) else {
        return false;
    };
    (expected - middle_px(&other.corners_px)).norm()
        < MOST_OFF * side_px(&other.corners_px) * other.apart(tag.at) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tag of a grid of six columns, 20 px wide, which stands elsewhere than its number says.
    fn tag(id: usize, column: usize, row: usize) -> Tag {
        let corner = |x: f64, y: f64| {
            26.0 * Vec2::new(column as f64, -(row as f64)) + 20.0 * Vec2::new(x, y) + Vec2::new(300.0, 300.0)
        };
        let corners_px = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
        Tag { id, at: (id % 6, id / 6), corners_px, contrast: 1.0 }
    }

    fn ids(tags: Vec<Tag>) -> Vec<usize> {
        let mut ids: Vec<usize> =
            agreeing(tags, &AprilGrid::new(6, 6, 0.3).unwrap()).iter().map(|tag| tag.id).collect();
        ids.sort_unstable();
        ids
    }

    #[test]
    fn rows_that_go_on_in_the_next_row_are_another_grid() {
        // Its numbers begin with 3: what stands right of its third column seems to stand left of it, a row
        // higher.
        let of_six = |id: usize| tag(id, (id - 3) % 6, (id - 3) / 6);
        let left = [9, 10, 11, 15, 16, 17, 22, 23, 28, 29, 34, 35].map(of_six).to_vec();
        let right = [12, 18, 24, 30, 31].map(of_six).to_vec();
        assert_eq!(ids(left.clone()).len(), 12);
        assert_eq!(ids(right.clone()).len(), 5);
        assert!(ids([left, right].concat()).is_empty());
    }

    #[test]
    fn a_grid_of_which_the_middle_is_covered_is_one() {
        let seen: Vec<usize> = (0..36).filter(|id| matches!(id % 6, 0 | 1 | 5)).collect();
        let tags = seen.iter().map(|&id| tag(id, id % 6, id / 6)).collect();
        assert_eq!(ids(tags), seen);
    }
}
