//! What may the estimator change, and from where does it start?

use super::{CalibrationError, Loss};
use crate::camera::{Camera, FreeParameters, Parameter};

/// What to estimate and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    free: FreeParameters,
    held: [Option<f64>; Parameter::COUNT],
    /// Image width and height in px, if known: the principal point of a start that needs one is the image's centre.
    pub image_size: Option<(usize, usize)>,
    /// Loss of a residual.
    pub loss: Loss,
    /// A start for the intrinsics instead of the closed form.
    pub start: Option<Camera>,
    /// Iterations of the refinement before it gives up.
    pub max_iterations: usize,
    /// Whether the minimum is followed to its last digits.
    pub polish: bool,
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
        }
    }

    /// The chapter's model: fx, fy, cx, cy, k1, k2 free.
    pub fn chapter() -> Settings {
        Settings::new(FreeParameters::CHAPTER)
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
