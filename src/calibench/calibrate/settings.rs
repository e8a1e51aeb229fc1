//! What may the estimator change, and from where does it start?

use super::{CalibrationError, Loss, Prior};
use crate::camera::{Camera, FreeParameters, Lens, Model, Parameter};

/// What becomes of one parameter.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Role {
    /// Held at its default: skew and distortion at 0, the principal point in the image's centre. A focal
    /// length has none.
    #[default]
    Default,
    /// Held at a value.
    Held(f64),
    /// Estimated.
    Free,
    /// Estimated, and known beforehand: see [`super::Prior`].
    Known {
        /// Its value.
        mean: f64,
        /// How well it is known.
        standard_deviation: f64,
    },
}

/// What is estimated of a board that is not flat.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bend {
    /// Two bows, or with a twist three numbers.
    pub deformations: usize,
    /// Standard deviation of each beforehand, in the target's unit; infinite where nothing is known.
    pub standard_deviation: f64,
}

impl Board {
    /// What is to be estimated of it.
    pub(super) fn bend(self) -> Option<Bend> {
        match self {
            Board::Flat => None,
            Board::Bowed { standard_deviation } => Some(Bend { deformations: 2, standard_deviation }),
            Board::Bent { standard_deviation } => Some(Bend { deformations: 3, standard_deviation }),
        }
    }
}

/// How flat the board is taken to be.
///
/// A board that is not flat has its marks at the height `a (1 - x^2) + b (1 - y^2) + c x y` over its plane,
/// `x` and `y` from -1 to 1 over all marks: a bow along x, a bow along y, and a twist. The same board is seen
/// in all views.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Board {
    /// Exactly.
    #[default]
    Flat,
    /// Two bows are estimated, each known beforehand to be 0 with this standard deviation; infinite where
    /// nothing is known.
    Bowed {
        /// Of each, in the target's unit.
        standard_deviation: f64,
    },
    /// Two bows and a twist likewise.
    Bent {
        /// Of each, in the target's unit.
        standard_deviation: f64,
    },
}

/// What to estimate and how: a builder.
///
/// Every parameter has one [`Role`] and the last word on it wins, so that nothing can be held and estimated
/// at once:
///
/// ```
/// use calibench::calibrate::{Role, Settings};
/// use calibench::camera::Parameter;
///
/// let settings = Settings::standard().hold(Parameter::Cx, 320.0).hold(Parameter::K2, 0.0).estimate(Parameter::Cx);
/// assert_eq!(settings.role(Parameter::Cx), Role::Free);
/// assert_eq!(settings.free().to_string(), "fx,fy,cx,cy,k1");
/// ```
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Settings {
    #[cfg_attr(feature = "serde", serde(with = "by_name"))]
    roles: [Role; Parameter::OF_ALL_MODELS.len()],
    /// The lens model: the parameters that it has.
    model: Model,
    /// How flat the board is.
    pub board: Board,
    /// fy over fx where the two are tied; the role of fy is then of no account.
    fy_per_fx: Option<f64>,
    /// Image width and height in px, if known: the principal point of a start that needs one is the image's
    /// centre.
    pub image_size: Option<(usize, usize)>,
    /// Loss of a residual.
    pub loss: Loss,
    /// A start for the intrinsics instead of the closed form.
    pub start: Option<Camera>,
    /// Iterations of the refinement before it gives up; a search in doubt may take ten times as many.
    pub max_iterations: usize,
    /// Whether the minimum is followed to its last digits.
    pub polish: bool,
    /// Whether the search goes on from other starts where the first minimum is in doubt. Without, the answer
    /// is whatever the first start leads to: for studies of searches.
    pub search: bool,
    /// Coverage of intervals by the profile of the cost, if they are wanted: see [`super::ProfileInterval`].
    pub profile_coverage: Option<f64>,
}

/// Good data take five to ten iterations, the worst convergent ones seen about sixty.
const DEFAULT_MAX_ITERATIONS: usize = 200;

impl Settings {
    /// Estimates the parameters of `free`. Skew and distortion that are not free are held at 0.
    pub fn new(free: FreeParameters) -> Settings {
        let role = |parameter| if free.contains(parameter) { Role::Free } else { Role::Default };
        Settings {
            roles: Parameter::OF_ALL_MODELS.map(role),
            model: Model::BrownConrady,
            board: Board::Flat,
            fy_per_fx: None,
            image_size: None,
            loss: Loss::Squares,
            start: None,
            max_iterations: DEFAULT_MAX_ITERATIONS,
            polish: false,
            search: true,
            profile_coverage: None,
        }
    }

    /// What [`Model::standard_free`] says of a lens model, for [`super::calibrate_lens`].
    ///
    /// ```
    /// use calibench::calibrate::Settings;
    /// use calibench::camera::Model;
    ///
    /// let settings = Settings::of_model(Model::KannalaBrandt);
    /// assert_eq!(settings.free().to_string(), "fx,fy,cx,cy,k1,k2,k3,k4");
    /// ```
    pub fn of_model(model: Model) -> Settings {
        Settings::new(model.standard_free()).with_model(model)
    }

    /// Chooses the lens model; roles stay as they are.
    pub fn with_model(self, model: Model) -> Settings {
        Settings { model, ..self }
    }

    /// Says how flat the board is.
    pub fn with_board(self, board: Board) -> Settings {
        Settings { board, ..self }
    }

    /// The lens model.
    pub fn model(&self) -> Model {
        self.model
    }

    /// fx, fy, cx, cy, k1, k2 free: what most lenses need and most data determine.
    pub fn standard() -> Settings {
        Settings::new(FreeParameters::STANDARD)
    }

    /// Holds `parameter` at `value`.
    pub fn hold(self, parameter: Parameter, value: f64) -> Settings {
        self.with_role(parameter, Role::Held(value))
    }

    /// Estimates `parameter`: undoes what was said of it before.
    pub fn estimate(self, parameter: Parameter) -> Settings {
        self.with_role(parameter, Role::Free)
    }

    /// Ties the focal lengths: `fy = fy_per_fx fx`, 1 for square pixels. What becomes of fx is left as it is;
    /// a role given to fy unties them.
    pub fn tie_focal_lengths(mut self, fy_per_fx: f64) -> Settings {
        self.fy_per_fx = Some(fy_per_fx);
        self.roles[Parameter::Fy as usize] = Role::Default;
        self
    }

    /// Estimates `parameter`, which is known beforehand to be `mean` with this standard deviation: one more
    /// measurement, with its share in the covariance. See [`super::Prior`].
    pub fn with_prior(self, parameter: Parameter, mean: f64, standard_deviation: f64) -> Settings {
        self.with_role(parameter, Role::Known { mean, standard_deviation })
    }

    /// Gives `parameter` a role, whatever it had before.
    pub fn with_role(mut self, parameter: Parameter, role: Role) -> Settings {
        self.roles[parameter as usize] = role;
        if parameter == Parameter::Fy {
            self.fy_per_fx = None;
        }
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

    /// Starts from these intrinsics instead of the closed form; parameters that are held keep their values.
    pub fn starting_at(mut self, camera: Camera) -> Settings {
        self.start = Some(camera);
        self
    }

    /// Gives up after so many iterations of the refinement.
    pub fn with_max_iterations(mut self, max_iterations: usize) -> Settings {
        self.max_iterations = max_iterations;
        self
    }

    /// Follows the minimum to its last digits, in double-double arithmetic: for comparisons digit by digit.
    /// No measurement notices the difference, some 1e-7 of a standard deviation, and it takes some twenty
    /// times as long.
    pub fn polished(mut self) -> Settings {
        self.polish = true;
        self
    }

    /// Takes the minimum that the first start leads to, and asks no further.
    pub fn without_search(mut self) -> Settings {
        self.search = false;
        self
    }

    /// Asks for intervals by the profile of the cost, each to contain its true value with probability
    /// `coverage`, between 0 and 1.
    pub fn with_profile_intervals(mut self, coverage: f64) -> Settings {
        self.profile_coverage = Some(coverage);
        self
    }

    /// What becomes of `parameter`; of an fy that is tied to fx see [`Settings::fy_per_fx`].
    pub fn role(&self, parameter: Parameter) -> Role {
        self.roles[parameter as usize]
    }

    /// fy over fx, if they are tied.
    pub fn fy_per_fx(&self) -> Option<f64> {
        self.fy_per_fx
    }

    /// The parameters to estimate; an fy that is tied to fx is none of its own.
    pub fn free(&self) -> FreeParameters {
        let is_estimated = |p: &Parameter| matches!(self.role(*p), Role::Free | Role::Known { .. });
        let is_free = |p: &Parameter| is_estimated(p) && !self.is_tied(*p);
        Parameter::OF_ALL_MODELS.into_iter().filter(is_free).fold(FreeParameters::NONE, FreeParameters::with)
    }

    /// What is known beforehand.
    pub fn priors(&self) -> impl Iterator<Item = Prior> {
        Parameter::OF_ALL_MODELS.into_iter().filter_map(|parameter| match self.role(parameter) {
            Role::Known { mean, standard_deviation } => Some(Prior { parameter, mean, standard_deviation }),
            _ => None,
        })
    }

    fn is_tied(&self, parameter: Parameter) -> bool {
        parameter == Parameter::Fy && self.fy_per_fx.is_some()
    }

    /// fy over fx where the two are estimated together.
    pub(super) fn tie(&self) -> Result<Option<f64>, CalibrationError> {
        match self.fy_per_fx {
            Some(ratio) if !(ratio > 0.0 && ratio.is_finite()) => Err(CalibrationError::BadRatio { ratio }),
            ratio => Ok(ratio.filter(|_| self.free().contains(Parameter::Fx))),
        }
    }

    /// The value a parameter is held at; `None` if it is free, or tied to one that is.
    ///
    /// A principal point that is neither free nor given is the image's centre: `(w - 1) / 2`.
    ///
    /// # Errors
    /// A value that no camera has; a focal length, or a principal point of an image of unknown size, that is
    /// held without one.
    pub fn held(&self, parameter: Parameter) -> Result<Option<f64>, CalibrationError> {
        if self.is_tied(parameter) {
            return Ok(self.held(Parameter::Fx)?.zip(self.fy_per_fx).map(|(fx, ratio)| ratio * fx));
        }
        let value = match self.role(parameter) {
            Role::Free | Role::Known { .. } => return Ok(None),
            Role::Held(value) => Some(value),
            Role::Default => self.default_of(parameter),
        };
        match value {
            Some(value) if parameter.is_defined_at(value) => Ok(Some(value)),
            Some(value) => Err(CalibrationError::BadHeldValue { parameter, value }),
            None => Err(CalibrationError::HeldWithoutValue { parameter }),
        }
    }

    fn default_of(&self, parameter: Parameter) -> Option<f64> {
        match parameter {
            Parameter::Fx | Parameter::Fy => None,
            Parameter::Cx => self.image_size.map(|(width, _)| 0.5 * (width as f64 - 1.0)),
            Parameter::Cy => self.image_size.map(|(_, height)| 0.5 * (height as f64 - 1.0)),
            _ => Some(Lens::ideal(self.model).get(parameter).unwrap_or(0.0)),
        }
    }
}

/// Roles as data: by the parameters' names, those at their default left out.
#[cfg(feature = "serde")]
mod by_name {
    use super::{Parameter, Role};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::collections::BTreeMap;

    pub fn serialize<S: Serializer>(
        roles: &[Role; Parameter::OF_ALL_MODELS.len()],
        to: S,
    ) -> Result<S::Ok, S::Error> {
        let told =
            Parameter::OF_ALL_MODELS.into_iter().zip(roles).filter(|(_, role)| **role != Role::Default);
        told.collect::<BTreeMap<Parameter, &Role>>().serialize(to)
    }

    pub fn deserialize<'a, D: Deserializer<'a>>(
        from: D,
    ) -> Result<[Role; Parameter::OF_ALL_MODELS.len()], D::Error> {
        let told = BTreeMap::<Parameter, Role>::deserialize(from)?;
        Ok(Parameter::OF_ALL_MODELS.map(|parameter| told.get(&parameter).copied().unwrap_or_default()))
    }
}
