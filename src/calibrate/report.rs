//! What does a calibration say? The estimate, how sure it is, how it fits, and what to be careful about.

use super::{Conditioning, Covariance, Termination};
use crate::camera::{Camera, FreeParameters, Parameter};
use crate::geometry::{Pose, Vec2};
use std::fmt;

/// The result of a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The estimate; parameters that were not free have the values they were held at.
    pub camera: Camera,
    /// What was estimated.
    pub free: FreeParameters,
    /// One pose a view.
    pub cam_from_target: Vec<Pose>,
    /// Predicted - observed, px, view by view, point by point.
    pub residuals: Vec<Vec<Vec2>>,
    /// `sqrt(sum |r|^2 / N)` over all N points, px: the chapter's RMSE, and OpenCV's.
    pub rmse_px: f64,
    /// Estimated standard deviation of one pixel coordinate: `sqrt(sum |r|^2 / (2 N - p))`, px. Under a robust loss see
    /// [`Calibration::covariance`].
    pub sigma_px: f64,
    /// Degrees of freedom `2 N - p`.
    pub degrees_of_freedom: usize,
    /// First-order covariance of intrinsics and poses. Under a robust loss it is scaled by Huber's correction
    /// `[sum psi^2 / (2N - p)] / [mean psi']^2` (Huber & Ronchetti 2009, section 7.6), psi' being [`Loss::slope`](crate::calibrate::Loss::slope).
    pub covariance: Covariance,
    /// Weakest direction of the estimate; `None` if nothing but poses was free.
    pub conditioning: Option<Conditioning>,
    /// How the refinement ended.
    pub termination: Termination,
    /// Refinement steps.
    pub iterations: usize,
    /// What to be careful about.
    pub warnings: Vec<Warning>,
}

/// Something a user should know before trusting the numbers.
#[derive(Debug, Clone, PartialEq)]
pub enum Warning {
    /// The search did not end in a minimum.
    NotConverged {
        /// How it ended.
        termination: Termination,
        /// After how many steps.
        iterations: usize,
    },
    /// Two parameters cannot be told apart well: an error of one is made up by the other.
    Correlated {
        /// One.
        a: Parameter,
        /// The other.
        b: Parameter,
        /// Correlation coefficient.
        correlation: f64,
    },
    /// A focal length known only roughly; its standard deviation, being first-order, is itself rough.
    FocalLengthUncertain {
        /// Which.
        parameter: Parameter,
        /// Standard deviation over value.
        relative: f64,
    },
    /// The lens model folds back inside the image.
    FoldsInsideImage {
        /// Radius, in normalised coordinates, beyond which the model is not one-to-one.
        monotone_radius: f64,
        /// Largest radius of an observed point.
        largest_observed: f64,
    },
    /// No residual degrees of freedom: the fit is exact whatever the noise, and no standard deviation can be told.
    NoDegreesOfFreedom,
    /// The last digits were asked for, and the steps towards them did not shrink: the estimate is the refinement's.
    NotPolished,
}

/// Beyond this two parameters share 96 % of their variance; k1 and k2 of an ordinary set of views stay below it.
pub(super) const STRONG_CORRELATION: f64 = 0.98;
/// A focal length worse than this makes the linearisation behind the covariance doubtful.
pub(super) const UNCERTAIN_FOCAL: f64 = 0.05;

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Warning::NotConverged { termination, iterations } => {
                write!(
                    f,
                    "the refinement did not converge ({termination:?} after {iterations} steps): do not use the result"
                )
            }
            Warning::Correlated { a, b, correlation } => write!(
                f,
                "{a} and {b} are correlated {correlation:+.4}: the data hardly tell them apart; cover the image corners, or \
                 hold one of them"
            ),
            Warning::FocalLengthUncertain { parameter, relative } => write!(
                f,
                "{parameter} is known to {:.0} % only: tilt the target more, about different axes",
                100.0 * relative
            ),
            Warning::FoldsInsideImage { monotone_radius, largest_observed } => write!(
                f,
                "the lens model folds back at normalised radius {monotone_radius:.3}, and points were seen out to \
                 {largest_observed:.3}: it must not be used beyond them"
            ),
            Warning::NoDegreesOfFreedom => f.write_str(
                "as many unknowns as measurements: the fit is exact and says nothing about its accuracy",
            ),
            Warning::NotPolished => f.write_str(
                "the last digits could not be had: undamped steps from the minimum do not shrink; the estimate is that of an \
                 ordinary calibration",
            ),
        }
    }
}

impl Calibration {
    /// Standard deviation of an estimated parameter; `None` if it was held.
    pub fn standard_deviation(&self, parameter: Parameter) -> Option<f64> {
        self.covariance.standard_deviation(parameter)
    }

    /// Number of points over all views.
    pub fn points(&self) -> usize {
        self.residuals.iter().map(Vec::len).sum()
    }

    /// RMSE of one view, per point, px.
    pub fn view_rmse_px(&self, view: usize) -> Option<f64> {
        self.residuals.get(view).map(|r| rms(r.iter()))
    }

    /// Root mean square of u and of v residuals apart, px: the definition of programs that report one number an axis.
    pub fn rms_per_axis_px(&self) -> Vec2 {
        let sums = self.residuals.iter().flatten().fold(Vec2::zeros(), |s, r| s + r.component_mul(r));
        (sums / self.points() as f64).map(f64::sqrt)
    }
}

/// `sqrt(mean |r|^2)`.
fn rms<'a>(residuals: impl ExactSizeIterator<Item = &'a Vec2>) -> f64 {
    let count = residuals.len() as f64;
    (residuals.map(|r| r.norm_squared()).sum::<f64>() / count).sqrt()
}
