//! What is a check? A property on a scenario, the evidence, and on what the verdict rests.

use serde::Serialize;

/// Declares the properties once: the enum, their order in reports, their names, and what each asks.
macro_rules! properties {
    ($(#[doc = $meaning:literal] $property:ident = $name:literal,)*) => {
        /// What a solver should be.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
        #[serde(rename_all = "kebab-case")]
        pub enum Property {
            $(#[doc = $meaning] $property,)*
        }

        impl Property {
            /// All, in the order of reports.
            pub const ALL: &[Property] = &[$(Property::$property,)*];

            /// Name in reports and on the command line.
            pub fn name(self) -> &'static str {
                match self {
                    $(Property::$property => $name,)*
                }
            }

            /// What holds if the property does, in a sentence.
            pub fn meaning(self) -> &'static str {
                match self {
                    $(Property::$property => $meaning,)*
                }
                .trim()
            }
        }
    };
}

properties! {
    /// Every problem gets one well-formed answer.
    Protocol = "protocol",
    /// Held parameters keep their values.
    HeldValues = "held-values",
    /// Broken input is refused.
    BadInput = "bad-input",
    /// Data that determine no camera are refused, flagged, or answered with the uncertainty they deserve.
    Degenerate = "degenerate",
    /// Poor or contaminated data mislead no more often than they mislead textbook least squares.
    Honesty = "honesty",
    /// Where the world is not the model and residuals show it, that is said, or covered by what is stated.
    Assumptions = "assumptions",
    /// Good data are answered.
    Convergence = "convergence",
    /// No answer is far from the truth without a warning.
    NoSilentFailure = "no-silent-failure",
    /// Good data bring no warnings, or hardly any.
    Specificity = "specificity",
    /// Without noise the truth is found.
    Exactness = "exactness",
    /// The same problem gets the same bits.
    Determinism = "determinism",
    /// Errors have zero mean.
    Bias = "bias",
    /// Every parameter's variance is the Cramer-Rao bound's.
    Variance = "variance",
    /// Errors are jointly as large as the bound says (normalised estimation error squared).
    Nees = "nees",
    /// Poses explain the pixels and are as far from the truth as the bound says.
    Poses = "poses",
    /// The stated RMSE is the one per point.
    RmseDefinition = "rmse-definition",
    /// The RMSE follows its distribution.
    Rmse = "rmse",
    /// A stated covariance is symmetric, positive definite, and of the names and deviations beside it.
    CovarianceForm = "covariance-form",
    /// The stated covariance is the true one.
    Covariance = "covariance",
    /// Stated pose covariances are symmetric, positive definite, and the true ones.
    PoseCovariance = "pose-covariance",
    /// The order of views does not matter.
    ViewOrder = "view-order",
    /// The order of points does not matter.
    PointOrder = "point-order",
    /// The target's unit does not matter.
    TargetUnits = "target-units",
    /// A larger image around the same one moves the principal point only.
    ImageShift = "image-shift",
    /// Rows and columns can be exchanged.
    SwappedAxes = "swapped-axes",
    /// The median time for a problem is within the limit, if one was set.
    Time = "time",
}

/// On what a verdict rests.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Basis {
    /// Nothing is drawn, or what is drawn cannot matter: it holds or it does not.
    Certain(bool),
    /// The probability that a correct solver shows evidence at least as strong.
    Chance(f64),
    /// Nothing to judge: the solver does not state it, or a figure without a limit.
    Told,
}

/// What was decided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Not judged.
    NotJudged,
    /// Holds.
    Held,
    /// Does not, and the user said that it is known.
    Accepted,
    /// Does not hold.
    Failed,
    /// A confident wrong answer.
    Grave,
}

impl Verdict {
    /// The word in reports.
    pub fn word(self) -> &'static str {
        match self {
            Verdict::NotJudged => "not judged",
            Verdict::Held => "held",
            Verdict::Accepted => "accepted",
            Verdict::Failed => "FAILED",
            Verdict::Grave => "GRAVE",
        }
    }
}

/// One check.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// What should hold.
    pub property: Property,
    /// Where; the name of a scenario or of bad input.
    pub scenario: &'static str,
    /// On what the verdict rests.
    pub basis: Basis,
    /// Whether failing is a confident wrong answer.
    pub grave: bool,
    /// What was seen, with numbers.
    pub evidence: String,
    /// Number of problems behind it.
    pub problems: usize,
    /// What was compared with a limit, px: of exactness and of the invariances.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_px: Option<f64>,
    /// What was decided; `NotJudged` until then.
    pub verdict: Verdict,
    /// The command that asks its scene again, where it fails.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeat: Option<String>,
}

impl Check {
    /// A check that is not decided yet.
    pub fn new(
        property: Property,
        scenario: &'static str,
        basis: Basis,
        problems: usize,
        evidence: impl Into<String>,
    ) -> Check {
        let evidence = evidence.into();
        Check {
            property,
            scenario,
            basis,
            grave: false,
            evidence,
            problems,
            size_px: None,
            verdict: Verdict::NotJudged,
            repeat: None,
        }
    }

    /// Properties whose checks compare a size in px with a limit.
    pub const HAVE_SIZE: [Property; 6] = [
        Property::Exactness,
        Property::ViewOrder,
        Property::PointOrder,
        Property::TargetUnits,
        Property::ImageShift,
        Property::SwappedAxes,
    ];

    /// States what was compared with a limit; what is no number is not stated.
    pub(super) fn of_size(self, px: f64) -> Check {
        Check { size_px: px.is_finite().then_some(px), ..self }
    }

    /// Failing this check is a confident wrong answer.
    pub(crate) fn gravely(self) -> Check {
        Check { grave: true, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_verdict_has_a_word_of_its_own_and_the_worse_ones_are_greater() {
        use Verdict::{Accepted, Failed, Grave, Held, NotJudged};
        let all = [NotJudged, Held, Accepted, Failed, Grave];
        for pair in all.windows(2) {
            assert!(pair[0] < pair[1]);
        }
        let words: std::collections::BTreeSet<&str> = all.map(Verdict::word).into();
        assert!(words.len() == 5 && !words.contains(""), "{words:?}");
    }
}
