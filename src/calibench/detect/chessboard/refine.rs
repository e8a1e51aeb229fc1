//! Where exactly are the board's corners? Each fitted in a window that has the shape of its squares.
//!
//! Directions, window and curvature of the edges come from the corners beside; markers in the squares are
//! left out of it. A corner found in a reduced image is fitted there first, where it is sharp and its place
//! is near enough, then in the photograph itself.

use super::level::{Pyramid, level_from_photo, photo_from_level, scale};
use super::look::Look;
use crate::detect::edge::SHARPEST_EDGE_PX;
use crate::detect::saddle::{Crossing, Window, fit_near_edges, misfit};
use crate::detect::smoothness::{expected, out_of_line};
use crate::geometry::Vec2;
use crate::raster::{Level, Raster};

/// Part of the distance to the next corner that a window reaches: beyond the middle, blur of the next edge
/// comes in.
const WINDOW_FRACTION: f64 = 0.42;

/// Largest reach of a window, px: longer edges bring little that the curvature's own error does not take
/// back.
const LARGEST_REACH_PX: f64 = 14.0;

/// Largest reach in a reduced image, where the fit is only a start, px.
const LARGEST_START_PX: f64 = 8.0;

/// How far the fit in a level may lie from where the corner was found, px of the level.
const LARGEST_MOVE_PX: f64 = 2.0;

/// Largest misfit of a corner against the middle one of all, and what is allowed beside it. Noise and blur
/// enter all alike; an edge of what covers a corner in part does not.
const LARGEST_MISFIT: f64 = 2.0;
const MISFIT_ALLOWED: f64 = 0.05;

/// Longest step of a grid of tags, in sides of a tag: a window then stays within a border of an eighth of a
/// side.
const LONGEST_STEP_OF_TAGS: f64 = 0.29;

/// Corners of a board, row by row, px; `None` for those that are hidden.
struct Corners<'a> {
    places: &'a [Option<Vec2>],
    columns: usize,
    look: &'a Look,
}

/// What the corners beside tell of a corner.
struct Around {
    /// Steps along a row and down a column.
    steps: [Vec2; 2],
    /// Curvature of the row and of the column.
    curvatures: [f64; 2],
}

impl Corners<'_> {
    /// The corners before and behind a corner, along a row (`axis` 0) or a column (1).
    fn beside(&self, index: usize, axis: usize) -> [Option<Vec2>; 2] {
        let rows = self.places.len() / self.columns;
        let (at, count, stride) = if axis == 0 {
            (index % self.columns, self.columns, 1)
        } else {
            (index / self.columns, rows, self.columns)
        };
        let at_place = |is_there: bool, place: usize| if is_there { self.places[place] } else { None };
        [at_place(at > 0, index.wrapping_sub(stride)), at_place(at + 1 < count, index + stride)]
    }

    /// Steps to the corners before and behind a corner. Of tags a step is the shorter of the way between two
    /// and what their borders leave plain.
    fn steps_to(&self, index: usize, axis: usize) -> [f64; 2] {
        let Some(between) = self.look.between_tags else { return [1.0; 2] };
        let at = if axis == 0 { index % self.columns } else { index / self.columns };
        let step = between.min(LONGEST_STEP_OF_TAGS);
        let (tag, between) = (1.0 / step, between / step);
        if at.is_multiple_of(2) { [between, tag] } else { [tag, between] }
    }

    /// `None` for a corner that is hidden or alone in its row or column.
    fn around(&self, index: usize) -> Option<Around> {
        let (mut steps, mut curvatures) = ([Vec2::zeros(); 2], [0.0; 2]);
        let here = self.places[index]?;
        for axis in 0..2 {
            let [before, behind] = self.beside(index, axis);
            let stride = if axis == 0 { 1 } else { self.columns };
            let [to_before, to_behind] = self.steps_to(index, axis);
            (steps[axis], curvatures[axis]) = match (before, behind) {
                (Some(before), Some(behind)) => {
                    ((behind - before) / (to_before + to_behind), curvature(&before, &here, &behind))
                }
                (None, Some(behind)) => {
                    let (step, bent) = end_of_line(here, behind, self.beside(index + stride, axis)[1]);
                    (step / to_behind, bent)
                }
                (Some(before), None) => {
                    let (step, bent) = end_of_line(here, before, self.beside(index - stride, axis)[0]);
                    // Walked backwards, the line turns the other way.
                    (-step / to_before, -bent)
                }
                (None, None) => return None,
            };
        }
        Some(Around { steps, curvatures })
    }
}

/// The step at the end of a line and its curvature: the direction is the chord's, turned by half the angle of
/// the arc.
fn end_of_line(here: Vec2, next: Vec2, after: Option<Vec2>) -> (Vec2, f64) {
    let step = next - here;
    let Some(after) = after else { return (step, 0.0) };
    let bent = curvature(&here, &next, &after);
    // The tangent of an arc of curvature k lies k s / 2 before its chord of length s.
    let turn = -0.5 * bent * step.norm();
    (step + Vec2::new(-step.y, step.x) * turn, bent)
}

/// The curvature of the arc through three places, positive where it turns as from u to v (Menger: `4 area /
/// product of sides`).
fn curvature(a: &Vec2, b: &Vec2, c: &Vec2) -> f64 {
    let (ab, bc, ac) = (b - a, c - b, c - a);
    2.0 * ab.perp(&bc) / (ab.norm() * bc.norm() * ac.norm())
}

/// The corners of a board, fitted.
pub struct Fitted {
    /// Row by row, px; `None` for those that were not found, have no fit or lie out of line.
    pub corners: Vec<Option<Vec2>>,
    /// Their fits in the photograph; `None` also where a reduced image gave the corner.
    crossings: Vec<Option<Crossing>>,
    look: Look,
}

/// The corners of a board that were found in a level, fitted in the photograph. `starts_dark`: the square
/// between the first row and column of corners is dark.
pub fn refined<T: Level>(
    pyramid: &Pyramid<'_, T>,
    level: usize,
    found: &[Option<Vec2>],
    columns: usize,
    starts_dark: bool,
    look: &Look,
) -> Fitted {
    let is_dark = |index: usize| (index % columns + index / columns).is_multiple_of(2) == starts_dark;
    let start_edge_px = [1.5 * SHARPEST_EDGE_PX; 2];
    let mut places: Vec<Option<Vec2>> =
        found.iter().map(|place| place.map(|place| photo_from_level(&place, level))).collect();
    let mut edges_px = vec![start_edge_px; found.len()];
    if let Some(reduced) = pyramid.reduced(level) {
        let fitting =
            Fitting { image: reduced, is_dark: &is_dark, columns, look, largest_px: LARGEST_START_PX };
        for (index, crossing) in fitting.all(found, &edges_px).into_iter().enumerate() {
            let Some(crossing) = crossing else { continue };
            places[index] = Some(photo_from_level(&crossing.corner, level));
            edges_px[index] = crossing.edges_px.map(|edge_px| edge_px * scale(level) * START_WIDTH);
        }
    }
    let fitting =
        Fitting { image: pyramid.photo(), is_dark: &is_dark, columns, look, largest_px: LARGEST_REACH_PX };
    let mut crossings = fitting.all(&places, &edges_px);
    let mut good: Vec<Option<Vec2>> = crossings.iter().map(|fit| fit.map(|fit| fit.corner)).collect();
    // Corners of tags have unequal steps, and the tags vouch for them.
    let out = if look.between_tags.is_some() { Vec::new() } else { out_of_line(&mut good, columns) };
    for index in out {
        crossings[index] = None;
        let Some((place, tolerance_px)) = expected(&good, columns, index).filter(|_| found[index].is_some())
        else {
            continue;
        };
        places[index] = Some(place);
        let is_near = |corner: &Vec2| (corner - place).norm() < tolerance_px;
        let fit = fitting.one(&places, index, edges_px[index]).filter(|fit| is_near(&fit.corner));
        crossings[index] = fit;
        good[index] = fit.map(|fit| fit.corner).or_else(|| {
            let in_level = |level| {
                fit_in_level(pyramid, level, &is_dark, &Corners { places: &places, columns, look }, index)
            };
            (1..=BLURRED_LEVELS).find_map(|level| in_level(level).filter(is_near))
        });
    }
    if look.between_tags.is_none() {
        // One that was fitted anew may lie beside its line still, and others may where it was their neighbour
        // before.
        for index in out_of_line(&mut good, columns) {
            crossings[index] = None;
        }
    }
    Fitted { corners: good, crossings, look: *look }
}

impl Fitted {
    /// The corners whose squares look like those of the others: something that covers a corner in part moves
    /// it, and leaves of the levels around it more than noise. A corner that only a reduced image shows is
    /// one of a blurred photograph where most are, and else is covered.
    pub fn alike<T: Level>(&self, photo: &Raster<T>, columns: usize) -> Vec<Option<Vec2>> {
        let neighbours = Corners { places: &self.corners, columns, look: &self.look };
        let misfit_of = |index: usize| {
            let (crossing, around) = (self.crossings[index]?, neighbours.around(index)?);
            let window = window(&around, LARGEST_REACH_PX, &self.look);
            misfit(photo, &crossing, &window, around.curvatures)
        };
        let misfits: Vec<Option<f64>> = (0..self.corners.len()).map(misfit_of).collect();
        let mut sorted: Vec<f64> = misfits.iter().copied().flatten().collect();
        sorted.sort_by(f64::total_cmp);
        let middle = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
        let most = LARGEST_MISFIT * middle + MISFIT_ALLOWED;
        let blurred = 2 * sorted.len() < self.corners.iter().flatten().count();
        let is_alike = |misfit: &Option<f64>| misfit.map_or(blurred, |misfit| misfit <= most);
        self.corners
            .iter()
            .zip(&misfits)
            .map(|(corner, misfit)| corner.filter(|_| is_alike(misfit)))
            .collect()
    }
}

/// Levels in which a corner is fitted that has no fit in the photograph: motion of twelve pixels is one of
/// three there.
const BLURRED_LEVELS: usize = 2;

/// The fit of a corner in a reduced image, as a place of the photograph.
fn fit_in_level<T: Level>(
    pyramid: &Pyramid<'_, T>,
    level: usize,
    is_dark: &dyn Fn(usize) -> bool,
    corners: &Corners<'_>,
    index: usize,
) -> Option<Vec2> {
    let image = pyramid.reduced(level)?;
    let in_level: Vec<Option<Vec2>> =
        corners.places.iter().map(|place| place.map(|place| level_from_photo(&place, level))).collect();
    let Corners { columns, look, .. } = *corners;
    let fitting = Fitting { image, is_dark, columns, look, largest_px: LARGEST_REACH_PX };
    let fit = fitting.one(&in_level, index, [1.5 * SHARPEST_EDGE_PX; 2])?;
    Some(photo_from_level(&fit.corner, level))
}

/// Part of an edge's width in a reduced image that the photograph's is thought to have: pixels four times as
/// large add to it.
const START_WIDTH: f64 = 0.8;

/// The fits of a board's corners in one image.
struct Fitting<'a, T> {
    image: &'a Raster<T>,
    is_dark: &'a dyn Fn(usize) -> bool,
    columns: usize,
    look: &'a Look,
    largest_px: f64,
}

impl<T: Level> Fitting<'_, T> {
    /// Every fit; each starts from the widths of the one before, whose edges have the same blur and
    /// direction.
    fn all(&self, places: &[Option<Vec2>], edges_px: &[[f64; 2]]) -> Vec<Option<Crossing>> {
        let mut before = None;
        let mut fit = |index: usize| {
            let crossing = self.one(places, index, before.unwrap_or(edges_px[index]));
            before = crossing.map(|crossing| crossing.edges_px);
            crossing
        };
        (0..places.len()).map(&mut fit).collect()
    }

    fn one(&self, places: &[Option<Vec2>], index: usize, edges_px: [f64; 2]) -> Option<Crossing> {
        let around = Corners { places, columns: self.columns, look: self.look }.around(index)?;
        let squares = Squares { around: &around, look: self.look, is_dark: (self.is_dark)(index) };
        let start = start(self.image, places[index]?, &squares, edges_px)?;
        let window = window(&around, self.largest_px, self.look);
        fitted(self.image, &start, &around, &window)
    }
}

/// The window of a corner.
fn sides(around: &Around, largest_px: f64) -> [Vec2; 2] {
    around.steps.map(|step| {
        let length = step.norm();
        step * (WINDOW_FRACTION * length).min(largest_px) / length
    })
}

fn window(around: &Around, largest_px: f64, look: &Look) -> Window {
    let sides = sides(around, largest_px);
    // The sides are parts of the steps, and what is plain is told in steps.
    let plain = look.plain.map(|plain| [0, 1].map(|i| plain * around.steps[i].norm() / sides[i].norm()));
    Window::Along { sides, plain }
}

fn fitted<T: Level>(
    image: &Raster<T>,
    start: &Crossing,
    around: &Around,
    window: &Window,
) -> Option<Crossing> {
    let shortest = around.steps[0].norm().min(around.steps[1].norm());
    fit_near_edges(image, start, window, around.curvatures, LARGEST_MOVE_PX.min(0.3 * shortest))
}

/// The squares about a corner.
struct Squares<'a> {
    around: &'a Around,
    look: &'a Look,
    /// Whether the square between both steps is dark.
    is_dark: bool,
}

/// Directions from the corners beside, levels from the pixels in the middle of the quadrants, or of what is
/// plain of them.
fn start<T: Level>(
    image: &Raster<T>,
    corner: Vec2,
    squares: &Squares<'_>,
    edges_px: [f64; 2],
) -> Option<Crossing> {
    let Squares { around, look, is_dark } = *squares;
    let [a, b] = match look.plain {
        None => sides(around, LARGEST_REACH_PX).map(|side| side * 0.6),
        Some(plain) => around.steps.map(|step| step * (0.5 * plain)),
    };
    let level = |s: f64, t: f64| {
        let place = corner + a * s + b * t;
        let (x, y) = (libm::round(place.x), libm::round(place.y));
        let inside = x >= 0.0 && y >= 0.0 && x < image.width() as f64 && y < image.height() as f64;
        inside.then(|| image.get(x as usize, y as usize).to_f64())
    };
    let between = 0.5 * (level(1.0, 1.0)? + level(-1.0, -1.0)?);
    let beside = 0.5 * (level(1.0, -1.0)? + level(-1.0, 1.0)?);
    let least = f64::MIN_POSITIVE;
    let amplitude =
        if is_dark { (0.5 * (beside - between)).max(least) } else { (0.5 * (beside - between)).min(-least) };
    Some(Crossing {
        corner,
        angles_rad: around.steps.map(|step| libm::atan2(step.y, step.x)),
        edges_px,
        mean: 0.5 * (between + beside),
        amplitude,
        slope: Vec2::zeros(),
    })
}
