//! Which lenses do people calibrate? A distribution for every model but Brown-Conrady's, which has an
//! experiment of its own.

use calibench::camera::{FreeParameters, Model, Parameter, Parameter::*};

/// Lenses of a model.
#[derive(Debug, Clone, Copy)]
pub struct Family {
    /// The model; its name keys streams and files.
    pub model: Model,
    /// What is drawn.
    pub about: &'static str,
    /// Angle from the axis at which the farthest corner is seen, degrees.
    pub half_field_deg: (f64, f64),
    /// Ranges of the coefficients; what is not named is 0.
    pub coefficients: &'static [(Parameter, f64, f64)],
    /// Coefficients that are held at 0: they are 0.
    pub held: &'static [Parameter],
}

/// Scenes of every family.
pub const SCENES: u64 = 2000;

/// All families.
pub const FAMILIES: [Family; 7] = [
    Family {
        model: Model::Rational,
        about: "k1 to k6, p1, p2: numerator and denominator half cancel, as in what cameras' makers state",
        half_field_deg: (25.0, 62.0),
        coefficients: &[
            (K1, 0.1, 0.9),
            (K2, -0.05, 0.3),
            (P1, -0.001, 0.001),
            (P2, -0.001, 0.001),
            (K3, -0.005, 0.02),
            (K4, 0.5, 1.3),
            (K5, 0.05, 0.5),
            (K6, 0.0, 0.05),
        ],
        held: &[],
    },
    Family {
        model: Model::ThinPrism,
        about: "k1 to k3, p1, p2, s1 to s4",
        half_field_deg: (15.0, 45.0),
        coefficients: &[
            (K1, -0.3, 0.1),
            (K2, -0.05, 0.15),
            (P1, -0.001, 0.001),
            (P2, -0.001, 0.001),
            (K3, -0.03, 0.03),
            (S1, -0.002, 0.002),
            (S2, -0.002, 0.002),
            (S3, -0.002, 0.002),
            (S4, -0.002, 0.002),
        ],
        held: &[K4, K5, K6],
    },
    Family {
        model: Model::Tilted,
        about: "k1 to k3 and a sensor tilted by up to 5 degrees about two axes",
        half_field_deg: (15.0, 45.0),
        coefficients: &[
            (K1, -0.3, 0.1),
            (K2, -0.05, 0.15),
            (K3, -0.03, 0.03),
            (TauX, -0.09, 0.09),
            (TauY, -0.09, 0.09),
        ],
        held: &[P1, P2, K4, K5, K6, S1, S2, S3, S4],
    },
    Family {
        model: Model::KannalaBrandt,
        about: "k1 to k4, fields of 60 to 200 degrees",
        half_field_deg: (30.0, 100.0),
        coefficients: &[(K1, -0.06, 0.06), (K2, -0.02, 0.02), (K3, -0.004, 0.004), (K4, -0.001, 0.001)],
        held: &[],
    },
    Family {
        model: Model::Division,
        about: "one coefficient, fields of 30 to 150 degrees",
        half_field_deg: (15.0, 75.0),
        coefficients: &[(K1, -0.5, 0.05)],
        held: &[],
    },
    Family {
        model: Model::DoubleSphere,
        about: "xi and alpha, fields of 60 to 200 degrees",
        half_field_deg: (30.0, 100.0),
        coefficients: &[(Xi, -0.3, 0.3), (Alpha, 0.45, 0.7)],
        held: &[],
    },
    Family {
        model: Model::HalconPolynomial,
        about: "k1 to k3, p1, p2, fields of 30 to 120 degrees",
        half_field_deg: (15.0, 60.0),
        coefficients: &[
            (K1, -0.1, 0.4),
            (K2, -0.05, 0.1),
            (P1, -0.001, 0.001),
            (P2, -0.001, 0.001),
            (K3, -0.02, 0.03),
        ],
        held: &[],
    },
];

impl Family {
    /// Name in kebab-case.
    pub fn name(&self) -> &'static str {
        self.model.name()
    }

    /// What is estimated.
    pub fn free(&self) -> FreeParameters {
        self.held.iter().fold(self.model.standard_free(), |free, &p| free.without(p))
    }
}
