//! Which models are there, and a lens of any of them: the one place where a model is chosen by name.

use super::{
    LensModel, brown_conrady, division, double_sphere, kannala_brandt, rational, thin_prism, tilted,
};
use crate::camera::{FreeParameters, Parameter, UndistortError};
use crate::geometry::{Vec2, Vec3};
use std::fmt;
use std::str::FromStr;

/// Most coefficients that a model has.
const MOST: usize = 14;

/// Tells the compiler one model after another; `$body` is the same for all.
macro_rules! for_model {
    ($model:expr, $m:ident, $p:ident => $body:expr) => {
        match $model {
            Model::BrownConrady => for_model!(@ brown_conrady::BrownConrady, 5, $m, $p, $body),
            Model::Rational => for_model!(@ rational::Rational, 8, $m, $p, $body),
            Model::ThinPrism => for_model!(@ thin_prism::ThinPrism, 12, $m, $p, $body),
            Model::Tilted => for_model!(@ tilted::Tilted, 14, $m, $p, $body),
            Model::KannalaBrandt => for_model!(@ kannala_brandt::KannalaBrandt, 4, $m, $p, $body),
            Model::Division => for_model!(@ division::Division, 1, $m, $p, $body),
            Model::DoubleSphere => for_model!(@ double_sphere::DoubleSphere, 2, $m, $p, $body),
        }
    };
    (@ $kind:ty, $count:literal, $m:ident, $p:ident, $body:expr) => {{
        type $m = $kind;
        const $p: usize = $count;
        $body
    }};
}

/// A lens model, by the name that files and the command line use.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Model {
    /// Radial k1, k2, k3 and tangential p1, p2 (Brown 1971): lenses up to some 100 degrees.
    #[default]
    BrownConrady,
    /// OpenCV's rational model: k1 to k6, p1, p2.
    Rational,
    /// The rational model with thin prisms: s1 to s4 besides.
    ThinPrism,
    /// The thin-prism model behind a tilted sensor: tau_x, tau_y besides.
    Tilted,
    /// A polynomial of the angle, k1 to k4 (Kannala & Brandt 2006): fisheyes, beyond 90 degrees from the
    /// axis.
    KannalaBrandt,
    /// One coefficient, k1, and a simple inverse (Fitzgibbon 2001).
    Division,
    /// xi and alpha (Usenko et al. 2018): fisheyes with an inverse in closed form.
    DoubleSphere,
}

impl Model {
    /// All models.
    pub const ALL: [Model; 7] = [
        Model::BrownConrady,
        Model::Rational,
        Model::ThinPrism,
        Model::Tilted,
        Model::KannalaBrandt,
        Model::Division,
        Model::DoubleSphere,
    ];

    /// Its name: `brown-conrady`, `rational`, `thin-prism`, `tilted`, `kannala-brandt`, `division`,
    /// `double-sphere`.
    pub fn name(self) -> &'static str {
        match self {
            Model::BrownConrady => "brown-conrady",
            Model::Rational => "rational",
            Model::ThinPrism => "thin-prism",
            Model::Tilted => "tilted",
            Model::KannalaBrandt => "kannala-brandt",
            Model::Division => "division",
            Model::DoubleSphere => "double-sphere",
        }
    }

    /// Its coefficients, in the order of [`Parameter`].
    pub fn coefficients(self) -> &'static [Parameter] {
        for_model!(self, M, P => &<M as LensModel<P>>::PARAMETERS)
    }

    /// The five linear parameters and the coefficients: all that a camera with this lens has.
    pub fn parameters(self) -> impl Iterator<Item = Parameter> {
        Parameter::LINEAR.into_iter().chain(self.coefficients().iter().copied())
    }

    /// What is estimated if nothing else is said: fx, fy, cx, cy with k1 and k2 (Brown-Conrady, because most
    /// lenses need no more), with k1 to k6, p1, p2 (the rational family), or with all coefficients.
    pub fn standard_free(self) -> FreeParameters {
        use Parameter::*;
        let lens: &[Parameter] = match self {
            Model::BrownConrady => &[K1, K2],
            Model::Rational | Model::ThinPrism | Model::Tilted | Model::KannalaBrandt => self.coefficients(),
            Model::Division | Model::DoubleSphere => self.coefficients(),
        };
        lens.iter().fold(FreeParameters::of(&[Fx, Fy, Cx, Cy]), |set, &p| set.with(p))
    }

    /// Whether its lenses may see beyond 90 degrees from the axis.
    pub fn sees_behind(self) -> bool {
        matches!(self, Model::KannalaBrandt | Model::Division | Model::DoubleSphere)
    }
}

impl fmt::Display for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that is not a model's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown lens model `{0}`: the models are brown-conrady rational thin-prism tilted kannala-brandt division \
     double-sphere"
)]
pub struct UnknownModel(pub String);

impl FromStr for Model {
    type Err = UnknownModel;

    fn from_str(name: &str) -> Result<Model, UnknownModel> {
        Model::ALL.into_iter().find(|m| m.name() == name).ok_or_else(|| UnknownModel(name.to_string()))
    }
}

/// Not as many coefficients as the model has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the {model} model has {} coefficients ({}), not {got}", model.coefficients().len(), named(*model))]
pub struct WrongCoefficients {
    /// The model.
    pub model: Model,
    /// How many were given.
    pub got: usize,
}

fn named(model: Model) -> String {
    model.coefficients().iter().map(|p| p.name()).collect::<Vec<_>>().join(" ")
}

/// A lens of any model: which, and its coefficients.
///
/// ```
/// use calibench::camera::{Camera, Lens, Model};
/// use calibench::geometry::Vec3;
///
/// let lens = Lens::new(Model::KannalaBrandt, &[-0.02, 0.003, 0.0, 0.0])?;
/// let camera = Camera::with_lens(400.0, 400.0, 639.5, 479.5, lens);
/// // A fisheye sees what lies beside the camera, and its inverse is exact.
/// let beside = Vec3::new(1.0, 0.2, -0.1).normalize();
/// let pixel = camera.pixel(&beside).expect("fisheyes see beyond 90 degrees");
/// assert!((camera.ray(&pixel)? - beside).norm() < 1e-14);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    model: Model,
    coefficients: [f64; MOST],
}

impl Lens {
    /// A lens with all coefficients 0, for the double sphere xi = 0 and alpha = 0.5.
    pub fn ideal(model: Model) -> Lens {
        let mut coefficients = [0.0; MOST];
        if model == Model::DoubleSphere {
            coefficients[1] = 0.5;
        }
        Lens { model, coefficients }
    }

    /// A lens with the coefficients of [`Model::coefficients`].
    ///
    /// # Errors
    /// Not as many as the model has.
    pub fn new(model: Model, coefficients: &[f64]) -> Result<Lens, WrongCoefficients> {
        if coefficients.len() != model.coefficients().len() {
            return Err(WrongCoefficients { model, got: coefficients.len() });
        }
        let mut lens = Lens { model, coefficients: [0.0; MOST] };
        lens.coefficients[..coefficients.len()].copy_from_slice(coefficients);
        Ok(lens)
    }

    /// Its model.
    pub fn model(&self) -> Model {
        self.model
    }

    /// Its coefficients, in the order of [`Model::coefficients`].
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients[..self.model.coefficients().len()]
    }

    /// One coefficient, if the model has it.
    pub fn get(&self, parameter: Parameter) -> Option<f64> {
        self.place(parameter).map(|i| self.coefficients[i])
    }

    /// This lens with one coefficient changed, if the model has it.
    pub(crate) fn with(mut self, parameter: Parameter, value: f64) -> Option<Lens> {
        self.coefficients[self.place(parameter)?] = value;
        Some(self)
    }

    fn place(&self, parameter: Parameter) -> Option<usize> {
        self.model.coefficients().iter().position(|&p| p == parameter)
    }

    /// The image of a point in camera coordinates on the plane of the linear parameters; `None` where the
    /// model has none: behind a pinhole, beyond the reach of a division.
    pub fn project(&self, point_cam: &Vec3) -> Option<Vec2> {
        for_model!(self.model, M, P => {
            let constants = <M as LensModel<P>>::constants(self.array::<P>());
            let p = M::project(&constants, [point_cam.x, point_cam.y, point_cam.z]);
            (p.inside > 0.0).then(|| Vec2::new(p.at[0], p.at[1]))
        })
    }

    /// The ray, of length 1, whose image is `at`.
    ///
    /// # Errors
    /// Outside the image of the cone in which the model is one-to-one, or not finite.
    pub fn ray(&self, at: &Vec2) -> Result<Vec3, UndistortError> {
        if !(at.x.is_finite() && at.y.is_finite()) {
            return Err(UndistortError::NotFinite { x: at.x, y: at.y });
        }
        for_model!(self.model, M, P => <M as LensModel<P>>::ray(&self.array::<P>(), at))
    }

    /// The same as a Brown-Conrady lens; `None` if it is another.
    pub fn brown_conrady(&self) -> Option<crate::camera::BrownConrady> {
        let [k1, k2, p1, p2, k3] = self.coefficients().try_into().ok()?;
        (self.model == Model::BrownConrady).then_some(crate::camera::BrownConrady { k1, k2, p1, p2, k3 })
    }

    /// The angle from the optical axis, rad, up to which the model is one-to-one.
    pub fn monotone_angle(&self) -> f64 {
        for_model!(self.model, M, P => <M as LensModel<P>>::monotone_angle(&self.array::<P>()))
    }

    fn array<const P: usize>(&self) -> [f64; P] {
        std::array::from_fn(|i| self.coefficients[i])
    }
}

impl From<crate::camera::BrownConrady> for Lens {
    fn from(lens: crate::camera::BrownConrady) -> Lens {
        let mut coefficients = [0.0; MOST];
        coefficients[..5].copy_from_slice(&[lens.k1, lens.k2, lens.p1, lens.p2, lens.k3]);
        Lens { model: Model::BrownConrady, coefficients }
    }
}

/// What is done with a lens whose model the compiler knows.
pub(crate) trait LensVisitor {
    type Output;
    fn run<M: LensModel<P>, const P: usize>(self, coefficients: [f64; P]) -> Self::Output;
}

/// The choice of the model, once for all that `visitor` does.
pub(crate) fn visit<V: LensVisitor>(lens: &Lens, visitor: V) -> V::Output {
    for_model!(lens.model, M, P => visitor.run::<M, P>(lens.array::<P>()))
}
