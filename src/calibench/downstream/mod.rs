//! What does a calibration feed? Positions in target units with their uncertainty: what drawings and machines
//! ask for.

pub mod coverage;
pub mod registration;

pub use coverage::{coverage_factor, effective_freedom};
pub use registration::{MapModel, Mark, Registration, RegistrationError, register};
