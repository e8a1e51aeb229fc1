//! What is a check? A property on a scenario, the evidence, and on what the verdict rests.

use serde::Serialize;

/// What a solver should be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Property {
    /// Every problem gets one well-formed answer.
    Protocol,
    /// Held parameters keep their values.
    HeldValues,
    /// Broken input is refused.
    BadInput,
    /// Data that determine no camera are refused, flagged, or answered with the uncertainty they deserve.
    Degenerate,
    /// Poor or contaminated data likewise.
    Honesty,
    /// Good data are answered.
    Convergence,
    /// No answer is far from the truth without a warning.
    NoSilentFailure,
    /// Without noise the truth is found.
    Exactness,
    /// The same problem gets the same bits.
    Determinism,
    /// Errors have zero mean.
    Bias,
    /// Every parameter's variance is the Cramer-Rao bound's.
    Variance,
    /// Errors are jointly as large as the bound says (normalised estimation error squared).
    Nees,
    /// Poses explain the pixels and are as far from the truth as the bound says.
    Poses,
    /// The stated RMSE is the one per point.
    RmseDefinition,
    /// The RMSE follows its distribution.
    Rmse,
    /// The stated covariance is the true one.
    Covariance,
    /// The order of views does not matter.
    ViewOrder,
    /// The order of points does not matter.
    PointOrder,
    /// The target's unit does not matter.
    TargetUnits,
    /// A larger image around the same one moves the principal point only.
    ImageShift,
    /// Rows and columns can be exchanged.
    SwappedAxes,
    /// Time per problem.
    Time,
}

impl Property {
    /// All, in the order of reports.
    pub const ALL: [Property; 22] = {
        use Property::*;
        [
            Protocol,
            HeldValues,
            BadInput,
            Degenerate,
            Honesty,
            Convergence,
            NoSilentFailure,
            Exactness,
            Determinism,
            Bias,
            Variance,
            Nees,
            Poses,
            RmseDefinition,
            Rmse,
            Covariance,
            ViewOrder,
            PointOrder,
            TargetUnits,
            ImageShift,
            SwappedAxes,
            Time,
        ]
    };

    /// Name in reports and on the command line.
    pub fn name(self) -> &'static str {
        use Property::*;
        match self {
            Protocol => "protocol",
            HeldValues => "held-values",
            BadInput => "bad-input",
            Degenerate => "degenerate",
            Honesty => "honesty",
            Convergence => "convergence",
            NoSilentFailure => "no-silent-failure",
            Exactness => "exactness",
            Determinism => "determinism",
            Bias => "bias",
            Variance => "variance",
            Nees => "nees",
            Poses => "poses",
            RmseDefinition => "rmse-definition",
            Rmse => "rmse",
            Covariance => "covariance",
            ViewOrder => "view-order",
            PointOrder => "point-order",
            TargetUnits => "target-units",
            ImageShift => "image-shift",
            SwappedAxes => "swapped-axes",
            Time => "time",
        }
    }
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
    /// What was decided; `NotJudged` until then.
    pub verdict: Verdict,
}

impl Check {
    pub(super) fn new(
        property: Property,
        scenario: &'static str,
        basis: Basis,
        problems: usize,
        evidence: impl Into<String>,
    ) -> Check {
        let evidence = evidence.into();
        Check { property, scenario, basis, grave: false, evidence, problems, verdict: Verdict::NotJudged }
    }

    /// Failing this check is a confident wrong answer.
    pub(super) fn gravely(self) -> Check {
        Check { grave: true, ..self }
    }
}
