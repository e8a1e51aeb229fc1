//! Which crossing of two edges explains the pixels around a chessboard corner best?
//!
//! Model: `I(p) = m + a f(n1 . (p - q)) f(n2 . (p - q))`, with `f = 1 - 2 S` running from -1 to 1 across an edge, `S` the
//! edge as a square pixel sees it ([`Edge`]) and `n` the edges' normals. Gauss-Newton on the corner `q`, the two directions,
//! `m`, `a` and the edge's width. A pixel on neither edge adds nothing to `q`, so the noise of flat squares does no harm, and
//! unlike gradients between pixels the model has no error of its own that depends on where the corner lies on the pixel grid.

use super::edge::{Edge, SHARPEST_EDGE_PX};
use crate::geometry::Vec2;
use crate::raster::{Raster, Sample};
use nalgebra::{Matrix2, SMatrix, SVector};

/// Corner (2), directions (2), mean, amplitude, edge width.
const PARAMETERS: usize = 7;

/// Gauss-Newton steps; from half a pixel away five suffice.
const MAX_STEPS: usize = 20;

/// Steps in which the edge's width is estimated too. Then it is held: sharp and soft edges have different models, and an edge
/// between the two would swing from one to the other for ever.
const WIDTH_STEPS: usize = 6;

/// Steps below this are at rest: a hundredth of the accuracy of a good image.
const REST_PX: f64 = 1e-5;

#[derive(Debug, Clone, Copy)]
struct Crossing {
    corner: Vec2,
    angles_rad: [f64; 2],
    mean: f64,
    amplitude: f64,
    edge_px: f64,
}

/// Refines a corner within a disc of radius `half_px`; `None` where no crossing fits or it leaves the start by a pixel.
pub(super) fn refine<T: Sample>(image: &Raster<T>, start: Vec2, half_px: usize) -> Option<Vec2> {
    let pixels = pixels_around(image, start, half_px)?;
    let mut crossing = initial(&pixels, start)?;
    for i in 0..MAX_STEPS {
        let edge_px = crossing.edge_px;
        let moved = step(&pixels, &mut crossing, half_px as f64)?;
        if i >= WIDTH_STEPS {
            crossing.edge_px = edge_px;
        }
        if (crossing.corner - start).norm().is_nan() || (crossing.corner - start).norm() > 1.0 {
            return None;
        }
        if i >= WIDTH_STEPS && moved < REST_PX {
            return Some(crossing.corner);
        }
    }
    None
}

fn pixels_around<T: Sample>(image: &Raster<T>, centre: Vec2, half_px: usize) -> Option<Vec<(Vec2, f64)>> {
    let radius = half_px as f64;
    let (x, y) = (libm::round(centre.x), libm::round(centre.y));
    let fits = |at: f64, size: usize| at >= radius && at + radius < size as f64;
    if !(fits(x, image.width()) && fits(y, image.height())) {
        return None;
    }
    let range = |at: f64| at as usize - half_px..at as usize + half_px + 1;
    let places = range(y).flat_map(|y| range(x).map(move |x| (x, y)));
    let pixel = |(x, y): (usize, usize)| (Vec2::new(x as f64, y as f64), image.get(x, y).to_f64());
    Some(places.map(pixel).filter(|(p, _)| (p - centre).norm() <= radius + 0.5).collect())
}

/// Directions from the quadric that fits the pixels: along an edge through a saddle it does not curve.
fn initial(pixels: &[(Vec2, f64)], corner: Vec2) -> Option<Crossing> {
    let mut normal = SMatrix::<f64, 6, 6>::zeros();
    let mut right = SVector::<f64, 6>::zeros();
    for (p, level) in pixels {
        let d = p - corner;
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
        mean: 0.5 * (low + high),
        amplitude: -0.5 * (high - low),
        edge_px: 1.5 * SHARPEST_EDGE_PX,
    })
}

/// One Gauss-Newton step; returns how far the corner moved.
fn step(pixels: &[(Vec2, f64)], crossing: &mut Crossing, widest_px: f64) -> Option<f64> {
    let edge = Edge::new(crossing.edge_px);
    let along = crossing.angles_rad.map(|angle| {
        let (sine, cosine) = libm::sincos(angle);
        Vec2::new(cosine, sine)
    });
    let normals = along.map(|direction| Vec2::new(-direction.y, direction.x));
    let mut system = SMatrix::<f64, PARAMETERS, PARAMETERS>::zeros();
    let mut gradient = SVector::<f64, PARAMETERS>::zeros();
    for (p, level) in pixels {
        let offset = p - crossing.corner;
        let sides = [0, 1].map(|i| {
            let d = normals[i].dot(&offset);
            let (coverage, slope) = edge.coverage(d, &normals[i]);
            (1.0 - 2.0 * coverage, 2.0 * slope, d)
        });
        let [(f1, s1, d1), (f2, s2, d2)] = sides;
        let by_distance = [crossing.amplitude * s1 * f2, crossing.amplitude * s2 * f1];
        let by_corner = -(normals[0] * by_distance[0] + normals[1] * by_distance[1]);
        // d(n . offset) / d(angle) = -(along . offset); a wider edge looks like one nearer to its middle.
        let by_angle = [0, 1].map(|i| -along[i].dot(&offset) * by_distance[i]);
        let by_width = -(by_distance[0] * d1 + by_distance[1] * d2) / crossing.edge_px;
        let row = SVector::from([by_corner.x, by_corner.y, by_angle[0], by_angle[1], 1.0, f1 * f2, by_width]);
        let residual = level - (crossing.mean + crossing.amplitude * f1 * f2);
        system += row * row.transpose();
        gradient += row * residual;
    }
    // A perfectly sharp image leaves the width undetermined below the pixel's own: hold it lightly where it is.
    system[(6, 6)] *= 1.0 + 1e-6;
    let change = system.cholesky()?.solve(&gradient);
    let moved = Vec2::new(change[0], change[1]);
    crossing.corner += moved;
    crossing.angles_rad = [crossing.angles_rad[0] + change[2], crossing.angles_rad[1] + change[3]];
    crossing.mean += change[4];
    crossing.amplitude += change[5];
    crossing.edge_px =
        (crossing.edge_px + change[6]).clamp(SHARPEST_EDGE_PX, widest_px.max(SHARPEST_EDGE_PX));
    Some(moved.norm())
}
