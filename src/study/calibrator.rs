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
        _ => "other",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stating(covariance: Option<DMatrix<f64>>) -> Estimate {
        Estimate {
            camera: Camera::pinhole(600.0, 600.0, 320.0, 240.0).into(),
            cam_from_target: None,
            rmse_px: None,
            covariance,
            outcome: "converged".into(),
            iterations: 0,
        }
    }

    #[test]
    fn an_error_is_measured_by_the_inverse_of_the_stated_covariance() {
        // The inverse is [[2, -1], [-1, 2]] / 3.
        let stated = stating(Some(DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0])));
        let square = |error: &[f64]| stated.normalised_error_squared(error);
        assert!((square(&[1.0, 1.0]).unwrap() - 2.0 / 3.0).abs() < 1e-14);
        assert!((square(&[1.0, -1.0]).unwrap() - 2.0).abs() < 1e-14);
        assert_eq!(square(&[1.0]), None, "a covariance of other parameters");
        assert_eq!(stating(None).normalised_error_squared(&[1.0]), None);
    }

    #[test]
    fn a_refusal_is_counted_under_the_name_of_its_reason() {
        let few = CalibrationError::TooFewViews { need: 3, got: 1, linear: 5, copies: 0 };
        assert_eq!(reason(&few), "too-few-views");
        assert_eq!(
            reason(&CalibrationError::TooFewPoints { coordinates: 8, unknowns: 12 }),
            "too-few-points"
        );
        assert_eq!(reason(&CalibrationError::BadLoss), "loss");
        let parameter = calibench::camera::Parameter::Cx;
        assert_eq!(reason(&CalibrationError::HeldWithoutValue { parameter }), "held-value");
    }

    #[test]
    fn views_without_a_start_are_refused_by_that_name() {
        let source = calibench::calibrate::ClosedFormError::NoRealCamera;
        assert_eq!(reason(&CalibrationError::NoStart { source }), "no-start");
    }
}
