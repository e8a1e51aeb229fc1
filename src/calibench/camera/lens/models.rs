//! Which models are there? The one place where a model is chosen by name.

use super::LensModel;
use crate::camera::{FreeParameters, Parameter};
use std::fmt;
use std::str::FromStr;

/// Tells the compiler one model after another; `$body` is the same for all.
macro_rules! for_model {
    ($model:expr, $m:ident, $p:ident => $body:expr) => {
        match $model {
            Model::BrownConrady => for_model!(@ crate::camera::lens::brown_conrady::BrownConrady, 5, $m, $p, $body),
            Model::Rational => for_model!(@ crate::camera::lens::rational::Rational, 8, $m, $p, $body),
            Model::ThinPrism => for_model!(@ crate::camera::lens::thin_prism::ThinPrism, 12, $m, $p, $body),
            Model::Tilted => for_model!(@ crate::camera::lens::tilted::Tilted, 14, $m, $p, $body),
            Model::KannalaBrandt => for_model!(@ crate::camera::lens::kannala_brandt::KannalaBrandt, 4, $m, $p, $body),
            Model::Division => for_model!(@ crate::camera::lens::division::Division, 1, $m, $p, $body),
            Model::DoubleSphere => for_model!(@ crate::camera::lens::double_sphere::DoubleSphere, 2, $m, $p, $body),
            Model::HalconPolynomial => {
                for_model!(@ crate::camera::lens::halcon_polynomial::HalconPolynomial, 5, $m, $p, $body)
            }
        }
    };
    (@ $kind:ty, $count:literal, $m:ident, $p:ident, $body:expr) => {{
        type $m = $kind;
        const $p: usize = $count;
        $body
    }};
}
pub(super) use for_model;

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
    /// HALCON's polynomial from the seen point to the ideal one: k1, k2, k3, p1, p2.
    HalconPolynomial,
}

impl Model {
    /// All models.
    pub const ALL: [Model; 8] = [
        Model::BrownConrady,
        Model::Rational,
        Model::ThinPrism,
        Model::Tilted,
        Model::KannalaBrandt,
        Model::Division,
        Model::DoubleSphere,
        Model::HalconPolynomial,
    ];

    /// Its name: `brown-conrady`, `rational`, `thin-prism`, `tilted`, `kannala-brandt`, `division`,
    /// `double-sphere`, `halcon-polynomial`.
    pub fn name(self) -> &'static str {
        match self {
            Model::BrownConrady => "brown-conrady",
            Model::Rational => "rational",
            Model::ThinPrism => "thin-prism",
            Model::Tilted => "tilted",
            Model::KannalaBrandt => "kannala-brandt",
            Model::Division => "division",
            Model::DoubleSphere => "double-sphere",
            Model::HalconPolynomial => "halcon-polynomial",
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
            Model::Division | Model::DoubleSphere | Model::HalconPolynomial => self.coefficients(),
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
     double-sphere halcon-polynomial"
)]
pub struct UnknownModel(pub String);

impl FromStr for Model {
    type Err = UnknownModel;

    fn from_str(name: &str) -> Result<Model, UnknownModel> {
        Model::ALL.into_iter().find(|m| m.name() == name).ok_or_else(|| UnknownModel(name.to_string()))
    }
}
