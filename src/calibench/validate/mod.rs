//! Does a calibration hold on photographs that it has not seen, and when it is made again?
//!
//! [`hold_out`] compares the error on new views with its prediction, [`folds`] leaves out the calibration's own views
//! in turn, [`repeated`] asks whether several calibrations are of one camera. Each states its chance of a false alarm.

mod folds;
mod hold_out;
mod quadratic;
mod repeated;

pub use folds::{Fold, FoldError, folds};
pub use hold_out::{CameraTest, Estimate, HoldOut, HoldOutError, Outcome, Unseen, hold_out};
pub use quadratic::Ratio;
pub use repeated::{Agreement, RepeatedError, repeated};
