//! What can data fail to tell apart? The names of a calibration's unknowns, one by one and in groups.

use crate::camera::Parameter;
use std::fmt;

/// An unknown of a calibration, or a group of them that a user thinks of as one. [`fmt::Display`] gives its
/// name in words.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum Unknown {
    /// fx and fy.
    FocalLength,
    /// cx and cy.
    PrincipalPoint,
    /// k1, k2 and k3, with other lens models up to k6.
    RadialDistortion,
    /// p1 and p2.
    TangentialDistortion,
    /// Turns of the targets about the camera's x and y axes.
    Tilt,
    /// Turns of the targets about the optical axis.
    Roll,
    /// The targets' positions along x and y.
    LateralPosition,
    /// The targets' positions along the optical axis.
    Distance,
    /// All intrinsics.
    Camera,
    /// All poses.
    Poses,
    /// One intrinsic parameter.
    #[cfg_attr(feature = "serde", serde(untagged))]
    Intrinsic(Parameter),
}

impl Unknown {
    /// The group that a parameter belongs to; an unknown without one is its own.
    pub fn group(self) -> Unknown {
        use Parameter::{Cx, Cy, Fx, Fy, K1, K2, K3, K4, K5, K6, P1, P2};
        match self {
            Unknown::Intrinsic(Fx | Fy) => Unknown::FocalLength,
            Unknown::Intrinsic(Cx | Cy) => Unknown::PrincipalPoint,
            Unknown::Intrinsic(K1 | K2 | K3 | K4 | K5 | K6) => Unknown::RadialDistortion,
            Unknown::Intrinsic(P1 | P2) => Unknown::TangentialDistortion,
            other => other,
        }
    }

    /// Whether it is a coefficient of the lens, or a group of them.
    fn is_of_lens(self) -> bool {
        use Parameter::{Cx, Cy, Fx, Fy, Skew};
        match self {
            Unknown::RadialDistortion | Unknown::TangentialDistortion => true,
            Unknown::Intrinsic(parameter) => !matches!(parameter, Fx | Fy | Cx | Cy | Skew),
            _ => false,
        }
    }

    /// `fx`, ..., `k3`, `focal length`, `lateral position` and so on.
    pub fn name(self) -> &'static str {
        match self {
            Unknown::Intrinsic(parameter) => parameter.name(),
            Unknown::FocalLength => "focal length",
            Unknown::PrincipalPoint => "principal point",
            Unknown::RadialDistortion => "radial distortion",
            Unknown::TangentialDistortion => "tangential distortion",
            Unknown::Tilt => "tilt",
            Unknown::Roll => "roll",
            Unknown::LateralPosition => "lateral position",
            Unknown::Distance => "distance",
            Unknown::Camera => "camera",
            Unknown::Poses => "poses",
        }
    }
}

impl fmt::Display for Unknown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// The names in a row: `focal length and distance`.
pub(super) fn joined(unknowns: &[Unknown]) -> String {
    unknowns.iter().map(|unknown| unknown.name()).collect::<Vec<_>>().join(" and ")
}

/// What to do where they cannot be told apart: coefficients of the lens alone are too many, the camera's
/// frame alone needs tilts, and where both take part it may be either.
pub(super) fn advice(unknowns: &[Unknown]) -> &'static str {
    if unknowns.iter().all(|unknown| unknown.is_of_lens()) {
        "Take a lens model with fewer coefficients, or give one of them a value to be held at"
    } else if unknowns.iter().any(|unknown| unknown.is_of_lens() || *unknown == Unknown::Camera) {
        "Tilt the target by 20 degrees or more, about different axes, in some views; where it is tilted already, take a lens model with \
         fewer coefficients, or give one of them a value to be held at"
    } else {
        "Tilt the target by 20 degrees or more, about different axes, in some views, or give one of them a value to be held at"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn advice_is_of_the_lens_where_its_coefficients_take_part() {
        let k1 = Unknown::Intrinsic(Parameter::K1);
        let (model, tilt) = ("lens model with fewer coefficients", "Tilt the target");
        for (unknowns, of_model, of_tilt) in [
            (vec![k1, Unknown::TangentialDistortion], true, false),
            (vec![k1, Unknown::FocalLength], true, true),
            (vec![Unknown::Camera, Unknown::Poses], true, true),
            (vec![Unknown::FocalLength, Unknown::Distance], false, true),
        ] {
            let told = advice(&unknowns);
            assert_eq!((told.contains(model), told.contains(tilt)), (of_model, of_tilt), "{told}");
        }
    }
}
