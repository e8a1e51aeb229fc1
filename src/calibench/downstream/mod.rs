//! What does a calibration feed? Positions and lengths in target units with their uncertainty: what drawings
//! and machines ask for.

pub mod coverage;
pub mod length;
pub mod plane_view;
pub mod registration;

pub use coverage::{coverage_factor, effective_freedom};
pub use length::{Cause, Conditions, Contribution, Length, LengthError, length_in_view, length_on_map};
pub use plane_view::{PlaneView, PlaneViewError};
pub use registration::{MapModel, Mark, Registration, RegistrationError, register};
