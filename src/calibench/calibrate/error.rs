//! Why can no camera be estimated from these data?

use super::{ClosedFormError, Outliers, Unknown, unknown};
use crate::camera::{Model, Parameter};
use crate::geometry::HomographyError;
use std::borrow::Cow;

/// Why a lens may not see every mark.
fn unseen(model: Model) -> &'static str {
    if model.sees_behind() {
        "; is a coefficient held, or known beforehand, at a value that no such lens has?"
    } else {
        "; a lens beyond 90 degrees from the axis needs a fisheye model (kannala-brandt, division, double-sphere), and a coefficient may \
         be held at a value that no lens has"
    }
}

fn coefficients(model: Model) -> String {
    model.coefficients().iter().map(|p| p.name()).collect::<Vec<_>>().join(" ")
}

/// A calibration that is refused. Every variant carries the numbers and says what to do.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum CalibrationError {
    /// Each view gives two constraints on the linear parameters.
    #[error(
        "{got} view(s){} cannot determine the {linear} that are free of fx, fy, cx, cy and skew: a view gives two constraints (and what a \
         distortion tells of its centre leaves nothing to check it by), so at least {need} are needed; add views of other tilt or hold parameters",
        if *copies > 0 { format!(", {copies} copies of them not counted,") } else { String::new() }
    )]
    TooFewViews {
        /// Views needed.
        need: usize,
        /// Views given.
        got: usize,
        /// Free parameters among fx, fy, cx, cy, skew.
        linear: usize,
        /// Views that are copies of others.
        copies: usize,
    },
    /// The points are fewer than the unknowns.
    #[error(
        "{coordinates} pixel coordinates cannot determine {unknowns} unknowns: give more points or hold parameters"
    )]
    TooFewPoints {
        /// Twice the number of points.
        coordinates: usize,
        /// Free intrinsics and six per view.
        unknowns: usize,
    },
    /// A view has no homography.
    #[error("view {view} has no homography")]
    View {
        /// Index of the view.
        view: usize,
        /// What is wrong with it.
        source: HomographyError,
    },
    /// A parameter that is not free has no value.
    #[error(
        "{parameter} is neither free nor given a value: give it a value to be held at, or state the image size for cx and cy"
    )]
    HeldWithoutValue {
        /// Which.
        parameter: Parameter,
    },
    /// A value that no camera has.
    #[error("{parameter} cannot be held at {value}: {}", parameter.range_in_words())]
    BadHeldValue {
        /// Which.
        parameter: Parameter,
        /// The value.
        value: f64,
    },
    /// A parameter that the lens model does not have.
    #[error("the {model} model has no {parameter}: its coefficients are {}", coefficients(*model))]
    NotOfModel {
        /// Which.
        parameter: Parameter,
        /// The model.
        model: Model,
    },
    /// What only one estimator knows was asked of the other.
    #[error("{what} is known to `calibrate_lens` only: call that")]
    OfAnyLens {
        /// Another lens model, marks of unequal weight, a board that is not flat.
        what: Cow<'static, str>,
    },
    /// What only the estimator for brown-conrady lenses, flat boards and marks of one weight knows.
    #[error("{what} is known for brown-conrady lenses, flat boards and marks without weights only")]
    OfBrownConrady {
        /// Profile intervals, last digits, a start.
        what: Cow<'static, str>,
    },
    /// A standard deviation that no board has.
    #[error("a board's bow cannot be known to {standard_deviation}: a standard deviation is positive")]
    BadBoard {
        /// The standard deviation.
        standard_deviation: f64,
    },
    /// Focal lengths cannot be tied in this ratio.
    #[error("fy cannot be {ratio} times fx: a ratio is a positive number")]
    BadRatio {
        /// fy over fx.
        ratio: f64,
    },
    /// A prior that no camera has, or that says nothing.
    #[error(
        "{parameter} = {mean} +- {standard_deviation:?} is no prior: a standard deviation is positive (1e-100 or more), and {}", parameter.range_in_words()
    )]
    BadPrior {
        /// Which.
        parameter: Parameter,
        /// Its value.
        mean: f64,
        /// Its standard deviation.
        standard_deviation: f64,
    },
    /// A coverage that is no probability.
    #[error(
        "an interval cannot cover the true value with probability {coverage}: choose one between 0 and 1, such as 0.95"
    )]
    BadCoverage {
        /// The probability.
        coverage: f64,
    },
    /// A start that is no camera.
    #[error("no search can start from {parameter} = {value}")]
    BadStart {
        /// Which.
        parameter: Parameter,
        /// Its value.
        value: f64,
    },
    /// An image without pixels.
    #[error("an image of {width} x {height} px has no pixels")]
    BadImageSize {
        /// Width, px.
        width: usize,
        /// Height, px.
        height: usize,
    },
    /// The loss has no scale, or one whose square is lost in rounding.
    #[error("a robust loss needs a scale from 1e-9 to 1e9 px")]
    BadLoss,
    /// A robust loss under which most marks count as outliers.
    #[error(
        "the scale of the robust loss, {scale_px:e}, lies far below the residuals, half of which exceed {median_px:.2e} (px, or where marks \
         have weights that of a mark of weight 1): noise would count as outliers, and the standard deviations would be wrong; use a scale of about {:.2e}",
        2.0 * median_px
    )]
    NarrowLoss {
        /// Scale of the loss, px.
        scale_px: f64,
        /// The residual that half of the marks stay below, px.
        median_px: f64,
    },
    /// Gross errors that hide what the other marks could tell.
    #[error(
        "{} mark(s) lie too far off to be noise, the worst (view {}, point {}) by {:.2} px where half of all stay below {:.2} px, and with \
         them nothing is determined: correct or remove them, or use a robust loss (huber:{}); where nothing is wrong with them, the lens model, \
         the board or a value that is held or known beforehand is",
        .0.marks, .0.view, .0.point, .0.residual_px, .0.median_px, super::report::digits(2.0 * .0.median_px)
    )]
    Outliers(Outliers),
    /// The data do not tell the free parameters apart.
    #[error(
        "the data cannot separate {}: {why}. {}",
        unknown::joined(inseparable),
        unknown::advice(inseparable)
    )]
    NotIdentifiable {
        /// What trades off against each other, strongest first.
        inseparable: Vec<Unknown>,
        /// What in the data makes it so.
        why: String,
    },
    /// No start lets the lens see every mark.
    #[error("no starting values: no {model} lens was found that sees every mark{}", unseen(*model))]
    NoImage {
        /// The model.
        model: Model,
    },
    /// No start put every point in front of the camera.
    #[error(
        "no starting values: no focal length puts the target in front of the camera, and the closed form fails"
    )]
    NoStart {
        /// Why the closed form failed.
        source: ClosedFormError,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_coefficients_of_a_model_are_listed_in_its_order() {
        assert_eq!(coefficients(Model::KannalaBrandt), "k1 k2 k3 k4");
    }
}
