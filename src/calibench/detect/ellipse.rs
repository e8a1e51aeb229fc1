//! How far is a pixel from the outline of an imaged disc?

use super::blob::semi_axes;
use super::region::Region;
use crate::geometry::Vec2;
use nalgebra::Matrix2;

/// An ellipse as a quadratic form: `rho^2 = (p - centre)^T form (p - centre)`, 1 on the ellipse.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ellipse {
    /// Its centre, px.
    pub centre: Vec2,
    /// Covariance of its area, px^2.
    pub covariance: Matrix2<f64>,
    /// The quadratic form.
    pub form: Matrix2<f64>,
    /// Smaller semi-axis, px.
    pub short_px: f64,
    /// Larger semi-axis, px.
    pub long_px: f64,
}

impl Ellipse {
    /// The ellipse with a covariance of area; `None` where it is none, or narrower than a pixel.
    pub fn new(centre: Vec2, covariance: Matrix2<f64>) -> Option<Ellipse> {
        let (short_px, long_px) = semi_axes(&covariance);
        let form = (covariance * 4.0).try_inverse()?;
        let is_finite = centre.iter().chain(form.iter()).all(|x| x.is_finite());
        (is_finite && short_px >= 1.0).then_some(Ellipse { centre, covariance, form, short_px, long_px })
    }

    /// The ellipse with its outline moved by a distance.
    pub fn grown(&self, by_px: f64) -> Option<Region> {
        Region::new(self.centre, &self.covariance, by_px)
    }

    /// Distance to the ellipse (positive outside) to first order, and its gradient.
    pub fn distance(&self, offset: &Vec2) -> (f64, Vec2) {
        let half_gradient = self.form * offset;
        let rho_sq = offset.dot(&half_gradient);
        let norm_sq = half_gradient.dot(&half_gradient);
        // At the centre itself: far inside, no direction.
        if norm_sq == 0.0 {
            return (-self.short_px, Vec2::zeros());
        }
        let inverse_norm = 1.0 / norm_sq.sqrt();
        ((rho_sq - rho_sq.sqrt()) * inverse_norm, half_gradient * inverse_norm)
    }

    /// Circumference, by Ramanujan's first approximation (relative error below 1e-4 for axis ratios above
    /// 1/4).
    pub fn circumference_px(&self) -> f64 {
        let (a, b) = (self.long_px, self.short_px);
        std::f64::consts::PI * (3.0 * (a + b) - ((3.0 * a + b) * (a + 3.0 * b)).sqrt())
    }
}
