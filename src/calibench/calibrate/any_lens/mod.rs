//! Which camera explains the pixels, with a lens of any model, marks of unequal weight, a board that is not
//! flat?
//!
//! The estimator of [`super::calibrate`] knows one lens, and much about it: every start, the floor of its
//! cost, its other minima. This one knows any lens ([`Model`]): the same least squares, normal equations and
//! covariance, with starts that need no pinhole. Nothing certifies its minimum, and every result says so.
//!
//! [`Model`]: crate::camera::Model

mod certificate;
mod counterpart;
mod curvature;
mod estimate;
mod falls;
#[cfg(test)]
mod fixture;
mod focal;
mod information;
mod judge;
mod kernel;
mod locate;
mod marks;
mod problem;
mod radial;
mod rays;
mod report;
mod resection;
mod rivals;
mod root;
mod shape;
mod start;
mod walk;

pub(super) use estimate::calibrate;
pub(super) use falls::Falls;
pub use information::lens_information;
pub(super) use locate::located;
pub use locate::{Located, locate};
pub use shape::{BoardShape, Deformation};

/// Room for the free parameters of any lens, the board's shape and the gradient, in whole lanes.
const WIDTH: usize = 24;
