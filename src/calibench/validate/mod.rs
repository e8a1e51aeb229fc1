//! Does a calibration hold on photographs that it has not seen, and when it is made again? Whatever its lens.
//!
//! [`hold_out`] compares the error on new views with its prediction, [`folds`] leaves out the calibration's
//! own views in turn, [`repeated`] asks whether several calibrations are of one camera, [`one_camera`]
//! whether two are, of one lens model or of two. Each states its chance of a false alarm.

mod folds;
mod frame;
mod hold_out;
mod one_camera;
mod quadratic;
mod repeated;
mod root;
mod slopes;

pub use folds::{Fold, FoldError, folds};
pub use frame::frame_difference;
pub use hold_out::{CameraTest, Estimate, HoldOut, HoldOutError, Outcome, Unseen, hold_out};
pub use one_camera::{Calibrated, OneCamera, one_camera};
pub use quadratic::Ratio;
pub use repeated::{Agreement, RepeatedError, repeated};
