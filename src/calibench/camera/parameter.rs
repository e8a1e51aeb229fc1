//! Which of the camera's numbers are estimated? The intrinsic parameters of all lens models and subsets of
//! them.

use std::fmt;
use std::str::FromStr;

/// One intrinsic parameter, in the order of every parameter vector and covariance matrix of this library.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
#[repr(u8)]
#[non_exhaustive]
pub enum Parameter {
    /// Focal length along u, in px.
    Fx,
    /// Focal length along v, in px.
    Fy,
    /// Principal point, u, in px.
    Cx,
    /// Principal point, v, in px.
    Cy,
    /// Skew of the pixel axes, in px.
    Skew,
    /// Radial distortion of third order.
    K1,
    /// Radial distortion of fifth order.
    K2,
    /// Tangential distortion along y.
    P1,
    /// Tangential distortion along x.
    P2,
    /// Radial distortion of seventh order.
    K3,
    /// Radial: the first of the rational model's denominator, the fourth of a fisheye's polynomial.
    K4,
    /// Radial, the second of the rational model's denominator.
    K5,
    /// Radial, the third of the rational model's denominator.
    K6,
    /// Thin prism along x, second order.
    S1,
    /// Thin prism along x, fourth order.
    S2,
    /// Thin prism along y, second order.
    S3,
    /// Thin prism along y, fourth order.
    S4,
    /// Tilt of the sensor about x, rad.
    #[cfg_attr(feature = "serde", serde(rename = "tau_x"))]
    TauX,
    /// Tilt of the sensor about y, rad.
    #[cfg_attr(feature = "serde", serde(rename = "tau_y"))]
    TauY,
    /// Distance of the spheres' centres in the double-sphere model.
    Xi,
    /// Place of the pinhole behind the second sphere, 0 to 1.
    Alpha,
}

impl Parameter {
    /// Number of parameters of a camera with Brown-Conrady's lens.
    pub const COUNT: usize = 10;

    /// The parameters of a camera with Brown-Conrady's lens, in order.
    pub const ALL: [Parameter; Parameter::COUNT] = {
        use Parameter::*;
        [Fx, Fy, Cx, Cy, Skew, K1, K2, P1, P2, K3]
    };

    /// The linear parameters, which every camera has.
    pub const LINEAR: [Parameter; 5] = {
        use Parameter::*;
        [Fx, Fy, Cx, Cy, Skew]
    };

    /// The parameters of all lens models, in order.
    pub const OF_ALL_MODELS: [Parameter; 21] = {
        use Parameter::*;
        [Fx, Fy, Cx, Cy, Skew, K1, K2, P1, P2, K3, K4, K5, K6, S1, S2, S3, S4, TauX, TauY, Xi, Alpha]
    };

    /// The name used in files and on the command line: `fx fy cx cy skew`, then the coefficients `k1 k2 p1 p2
    /// k3`, `k4 k5 k6`, `s1 s2 s3 s4`, `tau_x tau_y`, `xi alpha`.
    pub fn name(self) -> &'static str {
        const NAMES: [&str; 21] = [
            "fx", "fy", "cx", "cy", "skew", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3",
            "s4", "tau_x", "tau_y", "xi", "alpha",
        ];
        NAMES[self as usize]
    }

    /// The unit, empty for a pure number.
    pub fn unit(self) -> &'static str {
        match self {
            linear if linear <= Parameter::Skew => "px",
            Parameter::TauX | Parameter::TauY => "rad",
            _ => "",
        }
    }

    /// The lowest and the highest value for which a camera is defined: a focal length above 0, a sensor
    /// tilted by less than a right angle, a double sphere's `xi` from -1 to 1 and `alpha` from 0 to 1
    /// (Usenko, Demmel & Cremers 2018).
    pub fn defined_range(self) -> (f64, f64) {
        match self {
            Parameter::Fx | Parameter::Fy => (f64::MIN_POSITIVE, f64::MAX),
            Parameter::TauX | Parameter::TauY => (-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2),
            Parameter::Xi => (-1.0, 1.0),
            Parameter::Alpha => (0.0, 1.0),
            _ => (f64::MIN, f64::MAX),
        }
    }

    /// Whether a camera may have this value.
    pub fn is_defined_at(self, value: f64) -> bool {
        let (low, high) = self.defined_range();
        (low..=high).contains(&value)
    }

    /// What [`Parameter::defined_range`] says, as part of a sentence.
    pub(crate) fn range_in_words(self) -> &'static str {
        match self {
            Parameter::Fx | Parameter::Fy => "a focal length is a positive number",
            Parameter::TauX | Parameter::TauY => "a sensor is tilted by less than a right angle",
            Parameter::Xi => "xi lies between -1 and 1",
            Parameter::Alpha => "alpha lies between 0 and 1",
            _ => "it is a finite number",
        }
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that is not a parameter's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown camera parameter `{0}`: the parameters are fx fy cx cy skew k1 k2 p1 p2 k3, and with other lens models k4 \
     k5 k6 s1 s2 s3 s4 tau_x tau_y xi alpha"
)]
pub struct UnknownParameter(pub String);

impl FromStr for Parameter {
    type Err = UnknownParameter;

    fn from_str(name: &str) -> Result<Parameter, UnknownParameter> {
        Parameter::OF_ALL_MODELS
            .into_iter()
            .find(|p| p.name() == name)
            .ok_or_else(|| UnknownParameter(name.to_string()))
    }
}

/// A set of parameters: those that an estimator may change. The others keep the values they are given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(into = "String", try_from = "String"))]
pub struct FreeParameters(u32);

impl FreeParameters {
    /// Nothing is free: only poses are estimated.
    pub const NONE: FreeParameters = FreeParameters(0);

    /// What most lenses need and most data determine: fx, fy, cx, cy, k1, k2.
    pub const STANDARD: FreeParameters = {
        use Parameter::*;
        FreeParameters::of(&[Fx, Fy, Cx, Cy, K1, K2])
    };

    /// The set of the given parameters.
    pub const fn of(parameters: &[Parameter]) -> FreeParameters {
        let mut bits = 0;
        let mut i = 0;
        while i < parameters.len() {
            bits |= 1 << parameters[i] as u32;
            i += 1;
        }
        FreeParameters(bits)
    }

    /// Whether `parameter` is free.
    pub fn contains(self, parameter: Parameter) -> bool {
        self.0 & (1 << parameter as u32) != 0
    }

    /// This set and `parameter`.
    pub fn with(self, parameter: Parameter) -> FreeParameters {
        FreeParameters(self.0 | 1 << parameter as u32)
    }

    /// This set without `parameter`.
    pub fn without(self, parameter: Parameter) -> FreeParameters {
        FreeParameters(self.0 & !(1 << parameter as u32))
    }

    /// Number of free parameters.
    pub fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    /// Whether nothing is free.
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The free parameters, in order.
    pub fn iter(self) -> impl Iterator<Item = Parameter> {
        let mut left = self.0;
        std::iter::from_fn(move || {
            let next = *Parameter::OF_ALL_MODELS.get(left.trailing_zeros() as usize)?;
            left &= left - 1;
            Some(next)
        })
    }

    /// The row of `parameter` in a vector of the free parameters.
    pub fn position(self, parameter: Parameter) -> Option<usize> {
        let before = self.0 & ((1 << parameter as u32) - 1);
        self.contains(parameter).then_some(before.count_ones() as usize)
    }
}

impl fmt::Display for FreeParameters {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<&str> = self.iter().map(Parameter::name).collect();
        f.write_str(&names.join(","))
    }
}

#[cfg(feature = "serde")]
impl From<FreeParameters> for String {
    fn from(set: FreeParameters) -> String {
        set.to_string()
    }
}

#[cfg(feature = "serde")]
impl TryFrom<String> for FreeParameters {
    type Error = BadParameters;

    fn try_from(list: String) -> Result<FreeParameters, BadParameters> {
        list.parse()
    }
}

/// A list that is no set of parameters.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BadParameters {
    /// A name that is not a parameter's.
    #[error(transparent)]
    Unknown(#[from] UnknownParameter),
    /// A name that comes again: another may have been meant.
    #[error("{0} is named twice: was another parameter meant?")]
    Twice(Parameter),
}

impl FromStr for FreeParameters {
    type Err = BadParameters;

    /// Reads a comma-separated list, such as `fx,fy,cx,cy,k1`.
    fn from_str(list: &str) -> Result<FreeParameters, BadParameters> {
        list.split(',').map(str::trim).filter(|name| !name.is_empty()).try_fold(
            FreeParameters::NONE,
            |set, name| match name.parse()? {
                parameter if set.contains(parameter) => Err(BadParameters::Twice(parameter)),
                parameter => Ok(set.with(parameter)),
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_is_written_and_read_in_the_fixed_order() {
        let set: FreeParameters = "k1, fx,fy".parse().unwrap();
        assert_eq!(set.to_string(), "fx,fy,k1");
        assert_eq!(set.position(Parameter::K1), Some(2));
        assert_eq!(set.position(Parameter::Cx), None);
        let unknown = BadParameters::Unknown(UnknownParameter("focal".into()));
        assert_eq!("fx,focal".parse::<FreeParameters>(), Err(unknown));
        assert_eq!("fx,fy,fx".parse::<FreeParameters>(), Err(BadParameters::Twice(Parameter::Fx)));
    }

    #[test]
    fn every_parameter_has_its_own_name_and_place() {
        assert!(Parameter::OF_ALL_MODELS.starts_with(&Parameter::ALL));
        for (place, parameter) in Parameter::OF_ALL_MODELS.into_iter().enumerate() {
            assert_eq!(parameter as usize, place);
            assert_eq!(parameter.name().parse(), Ok(parameter));
        }
    }
}
