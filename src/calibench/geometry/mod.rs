//! Plane and space geometry that knows nothing of cameras: rotations, poses, homographies, fits.

pub mod affine;
pub(crate) mod double_double;
pub mod homography;
mod homography_system;
pub(crate) mod lanes;
pub mod line;
pub mod pose;
pub mod projective_frame;
pub mod rotation;
pub mod scatter;
pub mod similarity;

pub use affine::{Affine, LinearFitError};
pub use homography::{Homography, HomographyError, HomographyFit, Side};
pub use line::{LineError, LineFit};
pub use pose::Pose;
pub use scatter::Scatter;
pub use similarity::{Handedness, Similarity};

/// A point or vector of the plane.
pub type Vec2 = nalgebra::Vector2<f64>;
/// A point or vector of space.
pub type Vec3 = nalgebra::Vector3<f64>;
/// A 3 x 3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
