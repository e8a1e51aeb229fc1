//! Which of the camera's numbers are estimated? The ten intrinsic parameters and subsets of them.

use std::fmt;
use std::str::FromStr;

/// One intrinsic parameter, in the order of every parameter vector and covariance matrix of this library.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
#[repr(u8)]
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
}

impl Parameter {
    /// Number of intrinsic parameters.
    pub const COUNT: usize = 10;

    /// All parameters, in order.
    pub const ALL: [Parameter; Parameter::COUNT] = {
        use Parameter::*;
        [Fx, Fy, Cx, Cy, Skew, K1, K2, P1, P2, K3]
    };

    /// The name used in files and on the command line: `fx fy cx cy skew k1 k2 p1 p2 k3`.
    pub fn name(self) -> &'static str {
        ["fx", "fy", "cx", "cy", "skew", "k1", "k2", "p1", "p2", "k3"][self as usize]
    }

    /// The unit, empty for a pure number.
    pub fn unit(self) -> &'static str {
        if self <= Parameter::Skew { "px" } else { "" }
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A name that is not a parameter's.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("unknown camera parameter `{0}`: the parameters are fx fy cx cy skew k1 k2 p1 p2 k3")]
pub struct UnknownParameter(pub String);

impl FromStr for Parameter {
    type Err = UnknownParameter;

    fn from_str(name: &str) -> Result<Parameter, UnknownParameter> {
        Parameter::ALL
            .into_iter()
            .find(|p| p.name() == name)
            .ok_or_else(|| UnknownParameter(name.to_string()))
    }
}

/// A set of parameters: those that an estimator may change. The others keep the values they are given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(into = "String", try_from = "String"))]
pub struct FreeParameters(u16);

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
            bits |= 1 << parameters[i] as u16;
            i += 1;
        }
        FreeParameters(bits)
    }

    /// Whether `parameter` is free.
    pub fn contains(self, parameter: Parameter) -> bool {
        self.0 & (1 << parameter as u16) != 0
    }

    /// This set and `parameter`.
    pub fn with(self, parameter: Parameter) -> FreeParameters {
        FreeParameters(self.0 | 1 << parameter as u16)
    }

    /// This set without `parameter`.
    pub fn without(self, parameter: Parameter) -> FreeParameters {
        FreeParameters(self.0 & !(1 << parameter as u16))
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
        Parameter::ALL.into_iter().filter(move |&p| self.contains(p))
    }

    /// The row of `parameter` in a vector of the free parameters.
    pub fn position(self, parameter: Parameter) -> Option<usize> {
        self.iter().position(|p| p == parameter)
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
    type Error = UnknownParameter;

    fn try_from(list: String) -> Result<FreeParameters, UnknownParameter> {
        list.parse()
    }
}

impl FromStr for FreeParameters {
    type Err = UnknownParameter;

    /// Reads a comma-separated list, such as `fx,fy,cx,cy,k1`.
    fn from_str(list: &str) -> Result<FreeParameters, UnknownParameter> {
        list.split(',')
            .map(str::trim)
            .filter(|name| !name.is_empty())
            .try_fold(FreeParameters::NONE, |set, name| Ok(set.with(name.parse()?)))
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
        assert_eq!("fx,focal".parse::<FreeParameters>(), Err(UnknownParameter("focal".into())));
    }

    #[test]
    fn every_parameter_has_its_own_name_and_place() {
        for (place, parameter) in Parameter::ALL.into_iter().enumerate() {
            assert_eq!(parameter as usize, place);
            assert_eq!(parameter.name().parse(), Ok(parameter));
        }
    }
}
