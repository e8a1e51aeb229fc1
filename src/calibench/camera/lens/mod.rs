//! Which lens is it? One file a model: its parameters, the projection of a point with derivatives, the exact
//! inverse, and the angle up to which the model is one-to-one.
//!
//! A model takes a point in camera coordinates to the plane on which the linear parameters of [`Camera`] act:
//!
//! ```text
//! (x_d, y_d) = project(X, Y, Z),   u = fx x_d + skew y_d + cx,   v = fy y_d + cy
//! ```
//! It need not be in front of the camera: a fisheye sees beyond 90 degrees.
//!
//! [`Camera`]: super::Camera

mod brown_conrady;
mod division;
mod double_sphere;
mod halcon_polynomial;
mod kannala_brandt;
mod model;
mod models;
mod pinhole;
mod rational;
mod roots;
#[cfg(test)]
mod tests;
mod thin_prism;
mod tilted;

pub use model::{Lens, WrongCoefficients};
pub(crate) use model::{LensVisitor, visit};
pub use models::{Model, UnknownModel};

use super::{Parameter, UndistortError};
pub(crate) use crate::geometry::lanes::Real;
use crate::geometry::{Vec2, Vec3};

/// A point on the plane of the linear parameters, with its derivatives.
pub(crate) struct Projected<A, const P: usize> {
    /// `(x_d, y_d)`.
    pub at: [A; 2],
    /// By the point in camera coordinates.
    pub by_point: [[A; 3]; 2],
    /// By the coefficients.
    pub by_lens: [[A; 2]; P],
    /// Greater than 0 where the model has an image of the point.
    pub inside: A,
}

/// A model with `P` coefficients.
pub(crate) trait LensModel<const P: usize> {
    /// The coefficients' names, in the order of [`Parameter`].
    const PARAMETERS: [Parameter; P];
    /// What of the coefficients alone is needed at every point.
    type Constants<A: Real>: Copy;

    /// Computes it once for many points.
    fn constants<A: Real>(coefficients: [A; P]) -> Self::Constants<A>;

    /// The image of a point in camera coordinates.
    fn project<A: Real>(constants: &Self::Constants<A>, point: [A; 3]) -> Projected<A, P>;

    /// The angle from the optical axis, rad, up to which the model is one-to-one: what it does further out is
    /// no picture of the world.
    fn monotone_angle(coefficients: &[f64; P]) -> f64;

    /// The ray, of length 1, whose image is `at`.
    ///
    /// # Errors
    /// Outside the image of the cone of [`LensModel::monotone_angle`].
    fn ray(coefficients: &[f64; P], at: &Vec2) -> Result<Vec3, UndistortError>;
}
