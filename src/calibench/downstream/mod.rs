//! What does a calibration feed? Positions, lengths and mountings in target units with their uncertainty:
//! what drawings and machines ask for.

pub mod control;
pub mod coverage;
pub mod hand_eye;
pub mod length;
pub mod plane_view;
pub mod registration;

pub use coverage::{coverage_factor, effective_freedom};
pub use hand_eye::{HandEye, HandEyeError, Repeatability, SetUp, Stations, hand_eye};
pub use length::{Cause, Conditions, Contribution, Length, LengthError, length_in_view, length_on_map};
pub use plane_view::{PlaneView, PlaneViewError};
pub use registration::{MapModel, Mark, Registration, RegistrationError, register};
