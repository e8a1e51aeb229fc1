//! About which pixel does a lens distort? The centre from the points of planes, whatever the distortion is.
//!
//! A radial distortion moves a pixel along the line through the distortion's centre `e`, so the observed
//! pixel `m`, the ideal pixel `H X` and `e` lie on one line: `m^T [e]x H X = 0`. The matrix `F = [e]x H` of a
//! view is found linearly from eight points or more, and `e` is the left null vector that all views share
//! (Hartley & Kang 2007). No model of the distortion is needed, and no starting value.

use super::normal::Observations;
use crate::geometry::{Mat3, Vec2, Vec3};
use nalgebra::SMatrix;

/// Fewest points of a view that determine `F`.
const FEWEST: usize = 8;

/// The common centre, px; `None` where no view has enough points or the centre lies at infinity. Without
/// distortion it means nothing.
pub(super) fn radial_centre(views: &[Observations], (origin, half_width): (Vec2, f64)) -> Option<Vec2> {
    let mut sum = Mat3::zeros();
    for view in views.iter().filter(|view| view.len() >= FEWEST) {
        let f = radial_matrix(view, origin, half_width)?;
        sum += f * f.transpose();
    }
    let eigen = sum.symmetric_eigen();
    let e: Vec3 = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let centre = Vec2::new(e.x / e.z, e.y / e.z);
    (centre.norm() < FARTHEST).then(|| origin + centre * half_width)
}

/// A centre farther from the pixels seen than this many of their half-widths is no lens's.
const FARTHEST: f64 = 3.0;

/// `F` of a view, of unit norm, pixels reduced to size 1: the eigenvector of least eigenvalue of the sum over
/// points of the squares of `m (x) X`.
fn radial_matrix(view: &Observations, origin: Vec2, half_width: f64) -> Option<Mat3> {
    let mut normal = SMatrix::<f64, 9, 9>::zeros();
    for (point, pixel) in view.iter() {
        let m = (pixel - origin) / half_width;
        let (m, x) = ([m.x, m.y, 1.0], [point.x, point.y, 1.0]);
        let row = SMatrix::<f64, 9, 1>::from_fn(|i, _| m[i / 3] * x[i % 3]);
        normal += row * row.transpose();
    }
    let eigen = normal.symmetric_eigen();
    let least = eigen.eigenvectors.column(eigen.eigenvalues.imin());
    let f = Mat3::from_fn(|i, j| least[3 * i + j]);
    f.iter().all(|x| x.is_finite()).then_some(f)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{BrownConrady, Camera};
    use crate::geometry::{Pose, rotation};

    #[test]
    fn the_centre_is_found_without_knowing_the_distortion() {
        let camera =
            Camera::pinhole(550.0, 550.0, 396.0, 653.0).with_distortion(BrownConrady::radial(-0.25, 0.06));
        let view = |x: f64, y: f64| {
            let pose = Pose {
                rotation: rotation::from_xyz_rad(x, y, 0.1),
                translation: Vec3::new(20.0, -15.0, 100.0),
            };
            let points = (0..63).map(|i| Vec2::new(f64::from(i % 9) - 4.0, f64::from(i / 9) - 3.0) * 10.0);
            let pair = |p: Vec2| (p / 30.0, camera.project(&pose.apply(&Vec3::new(p.x, p.y, 0.0))).unwrap());
            Observations::new(points.map(pair).collect::<Vec<_>>().into_iter())
        };
        let views = [view(0.2, 0.1), view(-0.3, 0.0), view(0.0, 0.3)];
        let centre = radial_centre(&views, (Vec2::new(640.0, 480.0), 500.0)).unwrap();
        assert!((centre - Vec2::new(396.0, 653.0)).norm() < 1e-5, "{centre}");
    }
}
