//! How far is the estimate from the truth, and how far should it be? The only place where both are known.

pub mod bound;
pub mod difference;
pub mod errors;
pub mod interval;
pub mod leverage;
pub mod rmse;
pub mod sample;

pub use crate::distribution;
pub use bound::{BoundError, Bounded, cramer_rao};
pub use difference::{DifferenceError, FrameDifference, TakenOut, frame_difference};
pub use errors::{Errors, errors_of};
pub use interval::Interval;
pub use leverage::leverages;
pub use rmse::RmseDistribution;
pub use sample::Sample;
