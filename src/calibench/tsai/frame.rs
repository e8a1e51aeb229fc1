//! In which coordinates are a target's points of size one, and do they lie in a plane?

use super::SpatialView;
use crate::geometry::{Mat3, Pose, Vec3};

/// Thickness over extent below which a target is a plane: rounding of its coordinates. A target that is
/// thicker has to show by its singular values that the third dimension is seen.
const FLAT: f64 = 1e-9;

/// Centroid, principal axes and size of a target: `X = centre + scale axes x`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TargetFrame {
    centre: Vec3,
    /// Columns by falling extent, right-handed.
    axes: Mat3,
    scale: f64,
    is_flat: bool,
}

impl TargetFrame {
    /// Of a view's points; `None` if they lie on a line.
    pub fn of(view: &SpatialView) -> Option<TargetFrame> {
        let count = view.len() as f64;
        let centre = view.points().iter().sum::<Vec3>() / count;
        let scatter = |sum: Mat3, point: &Vec3| sum + (point - centre) * (point - centre).transpose();
        let eigen = (view.points().iter().fold(Mat3::zeros(), scatter) / count).symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let axis = |k: usize| eigen.eigenvectors.column(order[k]).into_owned();
        let extent = |k: usize| eigen.eigenvalues[order[k]].max(0.0).sqrt();
        // Half of the digits are lost in squares.
        if extent(1).is_nan() || extent(1) <= 1e-7 * extent(0) {
            return None;
        }
        let (first, second) = (axis(0), axis(1));
        let third = first.cross(&second);
        let axes = Mat3::from_columns(&[first, second, third]);
        let thickness = view.points().iter().map(|p| (p - centre).dot(&third).abs()).fold(0.0, f64::max);
        Some(TargetFrame { centre, axes, scale: extent(0), is_flat: thickness <= FLAT * extent(0) })
    }

    pub fn is_flat(&self) -> bool {
        self.is_flat
    }

    /// A point in these coordinates.
    pub fn of_point(&self, point: &Vec3) -> Vec3 {
        self.axes.transpose() * (point - self.centre) / self.scale
    }

    /// The pose of the target itself.
    pub fn cam_from_target(&self, cam_from_frame: &Pose) -> Pose {
        let rotation = cam_from_frame.rotation * self.axes.transpose();
        Pose { rotation, translation: self.scale * cam_from_frame.translation - rotation * self.centre }
    }
}
