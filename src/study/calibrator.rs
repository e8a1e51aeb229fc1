//! Who calibrates in a trial? This library's solver, or whoever takes views and gives a camera.

use super::cells::Cell;
use calibench::board::View;
use calibench::calibrate::{CalibrationError, LensCalibration, Termination, calibrate, calibrate_lens};
use calibench::camera::{Camera, Lens};
use calibench::geometry::Pose;
use nalgebra::{DMatrix, DVector};
use std::fmt;

/// What a trial takes from a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// The camera.
    pub camera: Camera<Lens>,
    /// One pose a view, if they are stated.
    pub cam_from_target: Option<Vec<Pose>>,
    /// `sqrt(sum |r|^2 / N)`, px, if it is stated.
    pub rmse_px: Option<f64>,
    /// Covariance of the free parameters, in order, if it is stated.
    pub covariance: Option<DMatrix<f64>>,
    /// How the search ended, in kebab-case; values of `converged` only count in the statistics.
    pub outcome: String,
    /// Steps of the refinement; 0 where they are not stated.
    pub iterations: usize,
}

/// Somebody else's solver.
pub trait Calibrator: fmt::Debug + Send + Sync {
    /// Calibrates what several trials of a cell have seen, in their order. What a program refuses or breaks
    /// is the name of an outcome, in kebab-case.
    fn calibrate(&self, cell: &Cell, seen: &[Vec<View>]) -> Vec<Result<Estimate, String>>;
}

/// This library's solver with the settings of a cell.
pub(super) fn builtin(cell: &Cell, views: &[View]) -> Result<Estimate, String> {
    // Nobody reads a trial's warnings, and `calibrate_lens` takes half as long again for those of
    // Brown-Conrady's lens.
    let known = match calibrate(views, &cell.settings) {
        Err(CalibrationError::OfAnyLens { .. }) => calibrate_lens(views, &cell.settings),
        known => known.map(LensCalibration::from),
    };
    known.map(Estimate::from).map_err(|error| format!("refused-{}", reason(&error)))
}

impl From<LensCalibration> for Estimate {
    fn from(calibration: LensCalibration) -> Estimate {
        let ending = calibration.termination;
        Estimate {
            // Where the world is not the model, as with gross errors, a minimum is a minimum.
            outcome: if ending.is_minimum() { Termination::Converged } else { ending }.name().to_string(),
            camera: calibration.camera,
            cam_from_target: Some(calibration.cam_from_target),
            rmse_px: Some(calibration.rmse_px),
            covariance: Some(calibration.covariance.intrinsics),
            iterations: calibration.iterations,
        }
    }
}

impl Estimate {
    /// `e^T P^-1 e` under the stated covariance, see
    /// [`Covariance::normalised_error_squared`](calibench::calibrate::Covariance::normalised_error_squared).
    pub(super) fn normalised_error_squared(&self, error: &[f64]) -> Option<f64> {
        let covariance = self.covariance.as_ref().filter(|c| c.nrows() == error.len())?;
        let e = DVector::from_row_slice(error);
        Some(e.dot(&covariance.clone().cholesky()?.solve(&e)))
    }
}

fn reason(error: &CalibrationError) -> &'static str {
    match error {
        CalibrationError::TooFewViews { .. } => "too-few-views",
        CalibrationError::TooFewPoints { .. } => "too-few-points",
        CalibrationError::View { .. } => "homography",
        CalibrationError::HeldWithoutValue { .. } | CalibrationError::BadHeldValue { .. } => "held-value",
        CalibrationError::BadLoss | CalibrationError::NarrowLoss { .. } => "loss",
        CalibrationError::Outliers(_) => "gross-errors",
        CalibrationError::NotIdentifiable { .. } => "not-identifiable",
        CalibrationError::NoStart { .. } => "no-start",
        _ => "refused",
    }
}
