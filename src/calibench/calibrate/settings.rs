//! What may the estimator change, and from where does it start?

use super::{CalibrationError, Loss};
use crate::camera::{Camera, FreeParameters, Parameter};

/// What to estimate and how.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    free: FreeParameters,
    held: [Option<f64>; Parameter::COUNT],
    /// Image width and height in px, if known: the principal point of a start that needs one is the image's centre.
    pub image_size: Option<(usize, usize)>,
    /// Loss of a residual.
    pub loss: Loss,
    /// A start for the intrinsics instead of the closed form.
    pub start: Option<Camera>,
    /// Iterations of the refinement before it gives up; a search in doubt may take ten times as many.
    pub max_iterations: usize,
    /// Whether the minimum is followed to its last digits.
    pub polish: bool,
    /// Whether the search goes on from other starts where the first minimum is in doubt. Without, the answer is whatever the first start leads
    /// to: for studies of searches.
    pub search: bool,
    /// Coverage of intervals by the profile of the cost, if they are wanted: see [`super::ProfileInterval`].
    pub profile_coverage: Option<f64>,
}

/// Good data take five to ten iterations, the worst convergent ones seen about sixty.
const DEFAULT_MAX_ITERATIONS: usize = 200;

impl Settings {
    /// Estimates the parameters of `free`. Skew and distortion that are not free are held at 0.
    pub fn new(free: FreeParameters) -> Settings {
        Settings {
            free,
            held: [None; Parameter::COUNT],
            image_size: None,
            loss: Loss::Squares,
            start: None,
            max_iterations: DEFAULT_MAX_ITERATIONS,
            polish: false,
            search: true,
            profile_coverage: None,
        }
    }

    /// fx, fy, cx, cy, k1, k2 free: what most lenses need and most data determine.
    pub fn standard() -> Settings {
        Settings::new(FreeParameters::STANDARD)
    }

    /// Holds `parameter` at `value`.
    pub fn hold(mut self, parameter: Parameter, value: f64) -> Settings {
        self.free = self.free.without(parameter);
        self.held[parameter as usize] = Some(value);
        self
    }

    /// States the image size.
    pub fn with_image_size(mut self, image_size: (usize, usize)) -> Settings {
        self.image_size = Some(image_size);
        self
    }

    /// Chooses the loss.
    pub fn with_loss(mut self, loss: Loss) -> Settings {
        self.loss = loss;
        self
    }

    /// Follows the minimum to its last digits, in double-double arithmetic: for comparisons digit by digit. No measurement notices the
    /// difference, some 1e-7 of a standard deviation, and it takes some twenty times as long.
    pub fn polished(mut self) -> Settings {
        self.polish = true;
        self
    }

    /// Takes the minimum that the first start leads to, and asks no further.
    pub fn without_search(mut self) -> Settings {
        self.search = false;
        self
    }

    /// Asks for intervals by the profile of the cost, each to contain its true value with probability `coverage`.
    pub fn with_profile_intervals(mut self, coverage: f64) -> Settings {
        self.profile_coverage = Some(coverage);
        self
    }

    /// The parameters to estimate.
    pub fn free(&self) -> FreeParameters {
        self.free
    }

    /// The value a parameter is held at; `None` if it is free.
    ///
    /// A principal point that is neither free nor given is the image's centre: `(w - 1) / 2`.
    pub(super) fn held(&self, parameter: Parameter) -> Result<Option<f64>, CalibrationError> {
        if self.free.contains(parameter) {
            return Ok(None);
        }
        let value = self.held[parameter as usize].or_else(|| self.default_of(parameter));
        match value {
            Some(value) if value.is_finite() && !(is_focal(parameter) && value <= 0.0) => Ok(Some(value)),
            Some(value) => Err(CalibrationError::BadHeldValue { parameter, value }),
            None => Err(CalibrationError::HeldWithoutValue { parameter }),
        }
    }

    fn default_of(&self, parameter: Parameter) -> Option<f64> {
        match parameter {
            Parameter::Fx | Parameter::Fy => None,
            Parameter::Cx => self.image_size.map(|(width, _)| 0.5 * (width as f64 - 1.0)),
            Parameter::Cy => self.image_size.map(|(_, height)| 0.5 * (height as f64 - 1.0)),
            _ => Some(0.0),
        }
    }
}

fn is_focal(parameter: Parameter) -> bool {
    matches!(parameter, Parameter::Fx | Parameter::Fy)
}
