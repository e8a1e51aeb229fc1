//! What is an imaged disc? Its centre, and the ellipse of its area.

use crate::geometry::Vec2;
use nalgebra::Matrix2;

/// An imaged disc.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Blob {
    /// Sub-pixel centre of the imaged disc, px. It is not the image of the disc's centre: see
    /// [`disc_bias`](super::disc_bias).
    pub centre_px: Vec2,
    /// Covariance of the imaged disc's area, px^2: an ellipse with semi-axes `2 sqrt(eigenvalue)`.
    pub covariance_px2: Matrix2<f64>,
    /// Half the width of the edge's transition, px: 0.65 for a sharp lens.
    pub edge_px: f64,
    /// Ground minus mark, in levels of the image (negative for bright marks).
    pub contrast: f64,
    /// RMS difference between the pixels at the edge and the ellipse, as a fraction of the contrast.
    pub misfit: f64,
}

impl Blob {
    /// Area of the ellipse, px^2: `4 pi sqrt(det covariance)`.
    pub fn area_px2(&self) -> f64 {
        4.0 * std::f64::consts::PI * self.covariance_px2.determinant().max(0.0).sqrt()
    }

    /// Smaller and larger semi-axis, px.
    pub fn semi_axes_px(&self) -> (f64, f64) {
        semi_axes(&self.covariance_px2)
    }
}

/// Semi-axes of the ellipse with this covariance of area, smaller first.
pub(super) fn semi_axes(covariance: &Matrix2<f64>) -> (f64, f64) {
    let mean = 0.5 * covariance.trace();
    let half_difference = 0.5 * (covariance[(0, 0)] - covariance[(1, 1)]);
    let spread = libm::hypot(half_difference, covariance[(0, 1)]);
    (2.0 * (mean - spread).max(0.0).sqrt(), 2.0 * (mean + spread).sqrt())
}
