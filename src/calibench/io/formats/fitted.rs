//! How near does one lens come to another of a different kind? A linear fit over the frame, and its largest
//! error.

use crate::camera::{BrownConrady, Camera, Lens};
use crate::geometry::Vec2;
use nalgebra::{SMatrix, SVector};

/// Nodes along each side of the frame, border included: a lens's polynomial of seventh order has no detail
/// between them.
const NODES: usize = 33;

/// Pixels spread over a frame, out to its edges.
pub(super) fn frame((width, height): (usize, usize)) -> impl Iterator<Item = Vec2> {
    let along = |i: usize, side: usize| i as f64 / (NODES - 1) as f64 * side as f64 - 0.5;
    (0..NODES).flat_map(move |j| (0..NODES).map(move |i| Vec2::new(along(i, width), along(j, height))))
}

/// The polynomial of Brown and Conrady that takes the first point of each pair nearest to the second, in
/// least squares; it is linear in its coefficients. `None` where the pairs do not determine it.
pub(super) fn polynomial(pairs: &[(Vec2, Vec2)]) -> Option<BrownConrady> {
    let mut normal = SMatrix::<f64, 5, 5>::zeros();
    let mut right = SVector::<f64, 5>::zeros();
    // Powers up to the seventh of what may be small: coefficients of a unit frame are better conditioned.
    let radius = pairs.iter().map(|(from, _)| from.norm()).fold(0.0, f64::max);
    for (from, to) in pairs {
        let terms = terms(&(from / radius));
        let wanted = (to - from) / radius;
        for (row, value) in [(0, wanted.x), (1, wanted.y)] {
            let a = terms.row(row).transpose();
            normal += a * a.transpose();
            right += a * value;
        }
    }
    let [k1, k2, p1, p2, k3]: [f64; 5] = normal.cholesky()?.solve(&right).into();
    let square = radius * radius;
    let lens = BrownConrady {
        k1: k1 / square,
        k2: k2 / (square * square),
        p1: p1 / radius,
        p2: p2 / radius,
        k3: k3 / (square * square * square),
    };
    [lens.k1, lens.k2, lens.p1, lens.p2, lens.k3].iter().all(|c| c.is_finite()).then_some(lens)
}

/// Why a fit is none.
pub(super) const FAR: &str = "no lens there comes near it over the frame";

/// What a camera sees over a frame: the seen point of each pixel, on the plane of the linear parameters, and
/// the ideal one.
///
/// # Errors
/// In words, where it sees no ideal point at some pixel.
pub(super) fn seen_and_ideal(
    camera: &Camera<Lens>,
    size: (usize, usize),
) -> Result<Vec<(Vec2, Vec2)>, String> {
    let pair = |pixel: Vec2| match camera.ray(&pixel) {
        Ok(ray) if ray.z > 0.0 => {
            let y = (pixel.y - camera.cy) / camera.fy;
            let x = (pixel.x - camera.cx - camera.skew * y) / camera.fx;
            Ok((Vec2::new(x, y), ray.xy() / ray.z))
        }
        Ok(_) => Err("it sees beyond 90 degrees, where its lens has no image".to_string()),
        Err(error) => Err(format!("it does not reach the whole frame: {error}")),
    };
    frame(size).map(pair).collect()
}

/// The camera with the Brown-Conrady lens nearest to its own over a frame, and the largest error, px.
///
/// # Errors
/// Why there is none, in words.
pub(super) fn nearest_brown_conrady(
    camera: &Camera<Lens>,
    size: (usize, usize),
) -> Result<(Camera<Lens>, f64), String> {
    let pairs: Vec<(Vec2, Vec2)> =
        seen_and_ideal(camera, size)?.into_iter().map(|(seen, ideal)| (ideal, seen)).collect();
    let lens = polynomial(&pairs).ok_or(FAR)?;
    let fitted = Camera { distortion: lens.into(), ..*camera };
    let rays: Vec<(Vec2, Vec2)> = pairs.iter().map(|(ideal, _)| *ideal).zip(frame(size)).collect();
    let error_px = largest_error_px(&fitted, &rays);
    if error_px.is_finite() { Ok((fitted, error_px)) } else { Err(FAR.into()) }
}

/// What k1, k2, p1, p2, k3 of one each move a point by: the columns.
fn terms(p: &Vec2) -> SMatrix<f64, 2, 5> {
    let (x, y, s) = (p.x, p.y, p.norm_squared());
    let (xy, xx, yy) = (2.0 * x * y, s + 2.0 * x * x, s + 2.0 * y * y);
    SMatrix::from_row_slice(&[
        x * s,
        x * s * s,
        xy,
        xx,
        x * s * s * s,
        y * s,
        y * s * s,
        yy,
        xy,
        y * s * s * s,
    ])
}

/// Largest distance between pixels and where a camera shows the rays that another lens sees there, px.
pub(super) fn largest_error_px(camera: &Camera<Lens>, seen: &[(Vec2, Vec2)]) -> f64 {
    seen.iter()
        .map(|(ray, pixel)| camera.pixel(&ray.push(1.0)).map_or(f64::INFINITY, |seen| (seen - pixel).norm()))
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lens_of_the_same_kind_is_found_again() {
        let lens = BrownConrady { k1: -0.2, k2: 0.05, p1: 1e-3, p2: -2e-3, k3: 0.01 };
        let pairs: Vec<_> = frame((640, 480))
            .map(|p| (p - Vec2::new(320.0, 240.0)) / 600.0)
            .map(|p| (p, lens.distort(&p)))
            .collect();
        let found = polynomial(&pairs).unwrap();
        assert!(pairs.iter().all(|(from, to)| (found.distort(from) - to).norm() < 1e-12));
        assert!(polynomial(&[]).is_none());
    }
}
