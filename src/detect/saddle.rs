//! Which crossing of two edges explains the pixels around a chessboard corner best?
//!
//! Model: `I(p) = m + g . (p - q) + a f1(d1) f2(d2)`, with `d = n . (p - q) - k (t . (p - q))^2 / 2` the distance from an edge of direction
//! `t`, normal `n` and curvature `k`, and `f = 1 - 2 S` running from -1 to 1 across it, `S` the edge as a square pixel sees it
//! ([`Edge`]). Gauss-Newton on the corner `q`, the two directions and widths, `m`, `a` and the slope `g` of uneven light. Both widths
//! are free, for a moving camera blurs one edge more than the other. The curvatures are given: the neighbouring corners show them
//! far better than a window's pixels. A pixel on neither edge adds nothing to `q`, so pixels farther away are left out, and unlike
//! gradients between pixels the model has no error of its own that depends on where the corner lies on the pixel grid.
//!
//! Blur of any symmetric shape leaves the image of two crossing lines symmetric under half a turn about `q`, and so is the model:
//! a wrong shape of the edge costs precision, but does not move the corner.

use super::edge::{Edge, SHARPEST_EDGE_PX};
use crate::geometry::Vec2;
use crate::raster::{Raster, Sample};
use nalgebra::{Matrix2, SMatrix, SVector};

/// Corner (2), directions (2), edge widths (2), mean, amplitude, slope (2).
const PARAMETERS: usize = 10;

/// Gauss-Newton steps; from half a pixel away five suffice.
const MAX_STEPS: usize = 16;

/// Steps in which the edges' widths are estimated too. Then they are held: sharp and soft edges have different models, and an edge
/// between the two would swing from one to the other for ever.
const WIDTH_STEPS: usize = 5;

/// Steps below this are at rest: a hundredth of the accuracy of a good image.
const REST_PX: f64 = 1e-4;

/// Pixels on either side of an edge's reach that show the level of the squares.
const PLATEAU_PX: f64 = 2.0;

/// Two crossing edges and the levels of their squares.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing {
    pub corner: Vec2,
    /// Directions of the edges; of a positive amplitude it is dark from the first to the second, turning as from u to v.
    pub angles_rad: [f64; 2],
    /// Half-widths of the edges, px ([`Edge::new`]).
    pub edges_px: [f64; 2],
    pub mean: f64,
    pub amplitude: f64,
    pub slope: Vec2,
}

/// The pixels that a crossing is fitted to.
#[derive(Debug, Clone, Copy)]
pub(super) enum Window {
    /// A disc of this radius, px.
    Disc(usize),
    /// A parallelogram: half its sides, along the first edge and along the second, px.
    Along([Vec2; 2]),
}

/// A pixel: its offset from the window's centre, and its level.
type Pixel = (Vec2, f64);

/// Refines a corner within a disc of radius `half_px`; `None` where no crossing fits or it leaves the start by a pixel.
pub(super) fn refine<T: Sample>(image: &Raster<T>, start: Vec2, half_px: usize) -> Option<Vec2> {
    let pixels = pixels_in(image, start, &Window::Disc(half_px))?;
    let crossing = initial(&pixels, start)?;
    Some(fit(&pixels, crossing, [0.0; 2], half_px as f64, 1.0)?.corner)
}

/// Fits a crossing to the pixels of a window near its edges, which bend by the curvatures; `None` where none fits or it leaves the
/// start by more than `most_px`.
pub(super) fn fit_near_edges<T: Sample>(
    image: &Raster<T>,
    start: &Crossing,
    window: &Window,
    curvatures: [f64; 2],
    most_px: f64,
) -> Option<Crossing> {
    let mut pixels = pixels_in(image, start.corner, window)?;
    let normals = directions(start).map(|along| Vec2::new(-along.y, along.x));
    let bands =
        start.edges_px.map(|edge_px| Edge::new(1.5 * edge_px).reach_px() + PLATEAU_PX + 0.5 * most_px);
    pixels.retain(|(offset, _)| (0..2).any(|i| normals[i].dot(offset).abs() < bands[i]));
    let widest_px = match window {
        Window::Disc(half_px) => *half_px as f64,
        Window::Along(sides) => sides[0].norm().max(sides[1].norm()),
    };
    fit(&pixels, *start, curvatures, widest_px, most_px)
}

fn fit(
    pixels: &[Pixel],
    start: Crossing,
    curvatures: [f64; 2],
    widest_px: f64,
    most_px: f64,
) -> Option<Crossing> {
    if pixels.len() < 2 * PARAMETERS {
        return None;
    }
    let mut crossing = start;
    for i in 0..MAX_STEPS {
        let edges_px = crossing.edges_px;
        let moved_px = step(pixels, &mut crossing, &start.corner, curvatures, widest_px)?;
        if i >= WIDTH_STEPS {
            crossing.edges_px = edges_px;
        }
        let away_px = (crossing.corner - start.corner).norm();
        if away_px.is_nan() || away_px > most_px {
            return None;
        }
        let width_moved = (0..2).map(|i| (crossing.edges_px[i] - edges_px[i]).abs()).fold(0.0, f64::max);
        if moved_px < REST_PX && (i >= WIDTH_STEPS || width_moved < 0.02) {
            return (crossing.amplitude * start.amplitude > 0.0).then_some(crossing);
        }
    }
    None
}

fn pixels_in<T: Sample>(image: &Raster<T>, centre: Vec2, window: &Window) -> Option<Vec<Pixel>> {
    let (reach, inverse) = match window {
        Window::Disc(half_px) => (Vec2::repeat(*half_px as f64), None),
        Window::Along([first, second]) => {
            let sides = Matrix2::from_columns(&[*first, *second]);
            let inverse = sides.try_inverse()?;
            ((first.abs() + second.abs()).map(libm::ceil), Some(inverse))
        }
    };
    let (x, y) = (libm::round(centre.x), libm::round(centre.y));
    let fits = |at: f64, reach: f64, size: usize| at >= reach && at + reach < size as f64;
    if !(fits(x, reach.x, image.width()) && fits(y, reach.y, image.height())) {
        return None;
    }
    let is_inside = |offset: &Vec2| match inverse {
        Some(inverse) => (inverse * offset).amax() <= 1.0,
        None => offset.norm() <= reach.x + 0.5,
    };
    let (left, right) = (x as usize - reach.x as usize, x as usize + reach.x as usize);
    let (top, bottom) = (y as usize - reach.y as usize, y as usize + reach.y as usize);
    let mut pixels = Vec::with_capacity((right - left + 1) * (bottom - top + 1));
    for y in top..=bottom {
        for (x, sample) in (left..=right).zip(&image.row(y)[left..=right]) {
            let offset = Vec2::new(x as f64, y as f64) - centre;
            if is_inside(&offset) {
                pixels.push((offset, sample.to_f64()));
            }
        }
    }
    Some(pixels)
}

/// Directions from the quadric that fits the pixels: along an edge through a saddle it does not curve.
fn initial(pixels: &[Pixel], corner: Vec2) -> Option<Crossing> {
    let mut normal = SMatrix::<f64, 6, 6>::zeros();
    let mut right = SVector::<f64, 6>::zeros();
    for (d, level) in pixels {
        let row = SVector::from([1.0, d.x, d.y, d.x * d.x, d.x * d.y, d.y * d.y]);
        normal += row * row.transpose();
        right += row * *level;
    }
    let fit = normal.cholesky()?.solve(&right);
    let hessian = Matrix2::new(2.0 * fit[3], fit[4], fit[4], 2.0 * fit[5]);
    let eigen = hessian.symmetric_eigen();
    let (low, high) = if eigen.eigenvalues[0] < eigen.eigenvalues[1] { (0, 1) } else { (1, 0) };
    let (least, greatest) = (eigen.eigenvalues[low], eigen.eigenvalues[high]);
    if !(least < 0.0 && greatest > 0.0) {
        return None;
    }
    // d = u cos t + v sin t with greatest cos^2 t + least sin^2 t = 0.
    let axis = eigen.eigenvectors.column(high);
    let axis_rad = libm::atan2(axis[1], axis[0]);
    let half_opening_rad = libm::atan((-greatest / least).sqrt());
    let angles_rad = [axis_rad - half_opening_rad, axis_rad + half_opening_rad];
    let levels = || pixels.iter().map(|(_, level)| *level);
    let (low, high) = (levels().fold(f64::INFINITY, f64::min), levels().fold(f64::NEG_INFINITY, f64::max));
    // Along the axis of greatest curvature the image is bright: there the two normals point to different sides.
    Some(Crossing {
        corner,
        angles_rad,
        edges_px: [1.5 * SHARPEST_EDGE_PX; 2],
        mean: 0.5 * (low + high),
        amplitude: -0.5 * (high - low),
        slope: Vec2::zeros(),
    })
}

fn directions(crossing: &Crossing) -> [Vec2; 2] {
    crossing.angles_rad.map(|angle| {
        let (sine, cosine) = libm::sincos(angle);
        Vec2::new(cosine, sine)
    })
}

/// An edge of a crossing, with all that a pixel needs of it.
struct Side {
    along: Vec2,
    normal: Vec2,
    curvature: f64,
    edge: Edge,
    reach_px: f64,
}

impl Side {
    /// `f`, its slope `df/dd`, the distance `d`, and `t . (p - q)`.
    fn at(&self, offset: &Vec2) -> (f64, f64, f64, f64) {
        let along = self.along.dot(offset);
        let d = self.normal.dot(offset) - 0.5 * self.curvature * along * along;
        if d.abs() >= self.reach_px {
            return (1.0f64.copysign(d), 0.0, d, along);
        }
        let (coverage, slope) = self.edge.coverage(d, &self.normal);
        (1.0 - 2.0 * coverage, 2.0 * slope, d, along)
    }
}

/// One Gauss-Newton step; returns how far the corner moved.
fn step(
    pixels: &[Pixel],
    crossing: &mut Crossing,
    centre: &Vec2,
    curvatures: [f64; 2],
    widest_px: f64,
) -> Option<f64> {
    let along = directions(crossing);
    let sides = [0, 1].map(|i| {
        let edge = Edge::new(crossing.edges_px[i]);
        let normal = Vec2::new(-along[i].y, along[i].x);
        Side { along: along[i], normal, curvature: curvatures[i], edge, reach_px: edge.reach_px() }
    });
    let from_centre = crossing.corner - centre;
    let mut system = [0.0f64; PARAMETERS * (PARAMETERS + 1) / 2];
    let mut gradient = [0.0f64; PARAMETERS];
    for (from_window, level) in pixels {
        let offset = from_window - from_centre;
        let [(f1, s1, d1, t1), (f2, s2, d2, t2)] = [sides[0].at(&offset), sides[1].at(&offset)];
        let by_distance = [crossing.amplitude * s1 * f2, crossing.amplitude * s2 * f1];
        let by_corner = -(sides[0].normal * by_distance[0] + sides[1].normal * by_distance[1]);
        let row = [
            by_corner.x,
            by_corner.y,
            // d(n . offset) / d(angle) = -(t . offset); a wider edge looks like one nearer to its middle.
            -t1 * by_distance[0],
            -t2 * by_distance[1],
            -by_distance[0] * d1 / crossing.edges_px[0],
            -by_distance[1] * d2 / crossing.edges_px[1],
            1.0,
            f1 * f2,
            offset.x,
            offset.y,
        ];
        let predicted = crossing.mean + crossing.slope.dot(&offset) + crossing.amplitude * f1 * f2;
        let residual = level - predicted;
        let mut at = 0;
        for i in 0..PARAMETERS {
            for j in 0..=i {
                system[at + j] += row[i] * row[j];
            }
            at += i + 1;
            gradient[i] += row[i] * residual;
        }
    }
    let mut normal = SMatrix::<f64, PARAMETERS, PARAMETERS>::from_fn(|i, j| {
        let (i, j) = (i.max(j), i.min(j));
        system[i * (i + 1) / 2 + j]
    });
    // A perfectly sharp image leaves the widths undetermined below the pixel's own: hold them lightly where they are.
    let hold = 1e-6 * crossing.amplitude * crossing.amplitude * pixels.len() as f64;
    normal[(4, 4)] += hold;
    normal[(5, 5)] += hold;
    let change = normal.cholesky()?.solve(&SVector::from(gradient));
    let moved = Vec2::new(change[0], change[1]);
    crossing.corner += moved;
    crossing.angles_rad = [crossing.angles_rad[0] + change[2], crossing.angles_rad[1] + change[3]];
    crossing.edges_px = [0, 1].map(|i| {
        let edge_px = crossing.edges_px[i];
        (edge_px + change[4 + i])
            .clamp(0.5 * edge_px, 2.0 * edge_px)
            .clamp(SHARPEST_EDGE_PX, widest_px.max(SHARPEST_EDGE_PX))
    });
    crossing.mean += change[6];
    crossing.amplitude += change[7];
    crossing.slope += Vec2::new(change[8], change[9]);
    Some(moved.norm())
}
