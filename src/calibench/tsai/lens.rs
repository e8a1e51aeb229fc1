//! Which lens of this library is Tsai's?
//!
//! Tsai: `r_u = r_d + kappa r_d^3`, radii in units of the focal length. This library: `r_d = r_u (1 + k1
//! r_u^2 + k2 r_u^4 + k3 r_u^6)`. The series of the inverse is `k1 = -kappa`, `k2 = 3 kappa^2`, `k3 = -12
//! kappa^3` (Lagrange); what it leaves, `55 kappa^4 r^9` and smaller, is measured over the points.

use super::alignment::Aligned;
use super::depth::Deep;
use crate::camera::{BrownConrady, Camera};
use crate::geometry::Vec2;

/// The coefficients of the series.
pub(super) fn forward(kappa: f64) -> BrownConrady {
    let square = kappa * kappa;
    BrownConrady { k3: -12.0 * kappa * square, ..BrownConrady::radial(-kappa, 3.0 * square) }
}

/// The camera, and the largest distance between the two lenses over the points, px.
pub(super) fn camera(aligned: &Aligned, deep: &Deep, principal_point_px: Vec2) -> (Camera, f64) {
    let distortion = forward(deep.kappa);
    let off = |seen: &Vec2| {
        let distorted = seen / deep.focal_px;
        let ideal = distorted * (1.0 + deep.kappa * distorted.norm_squared());
        deep.focal_px * (distortion.distort(&ideal) - distorted).norm()
    };
    let (x, y) = (principal_point_px.x, principal_point_px.y);
    let camera = Camera::pinhole(deep.focal_px / aligned.fy_per_fx, deep.focal_px, x, y);
    (camera.with_distortion(distortion), aligned.seen.iter().map(off).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_leaves_a_ninth_power() {
        let left = |r: f64, kappa: f64| {
            let ideal = r * (1.0 + kappa * r * r);
            forward(kappa).distort(&Vec2::new(ideal, 0.0)).x - r
        };
        for kappa in [0.2, -0.15] {
            let (near, far) = (left(0.2, kappa), left(0.4, kappa));
            assert!(
                (near / (-55.0 * libm::pow(kappa, 4.0) * libm::pow(0.2, 9.0)) - 1.0).abs() < 0.2,
                "{near}"
            );
            // Twice the radius: 2^9, and the next power besides.
            assert!((300.0..800.0).contains(&(far / near)), "{}", far / near);
        }
    }
}
