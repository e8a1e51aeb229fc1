//! What should hold of a detector, and what was decided?

use super::protocol::Kind;
use calibench_gate::judge::{Basis, Verdict, rejected};
use serde::Serialize;

/// What a detector should be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Property {
    /// Every question gets one well-formed answer.
    Protocol,
    /// Boards that can be seen are found.
    Found,
    /// No board is found that is not there.
    NothingInvented,
    /// No mark is at another's place.
    Places,
    /// Marks are numbered row by row, from one end or the other, never as in a mirror.
    Order,
    /// No mark lies far beyond what noise explains.
    Strays,
    /// Places have no mean error that matters.
    Bias,
    /// Places do not depend on where in a pixel they are, by what matters.
    PixelPhase,
    /// A photograph that is turned by half a turn has its marks at the turned places.
    Turned,
    /// The same photograph gets the same bits.
    Determinism,
}

impl Property {
    /// All, in the order of reports.
    pub const ALL: [Property; 10] = [
        Property::Protocol,
        Property::Found,
        Property::NothingInvented,
        Property::Places,
        Property::Order,
        Property::Strays,
        Property::Bias,
        Property::PixelPhase,
        Property::Turned,
        Property::Determinism,
    ];

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Property::Protocol => "protocol",
            Property::Found => "found",
            Property::NothingInvented => "nothing-invented",
            Property::Places => "places",
            Property::Order => "order",
            Property::Strays => "strays",
            Property::Bias => "bias",
            Property::PixelPhase => "pixel-phase",
            Property::Turned => "turned",
            Property::Determinism => "determinism",
        }
    }

    /// Whether failing it is a confident wrong answer.
    pub fn is_grave(self) -> bool {
        matches!(self, Property::NothingInvented | Property::Places | Property::Order)
    }
}

/// One check.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// What should hold.
    pub property: Property,
    /// The kind of board.
    pub kind: Kind,
    /// Where.
    pub scene: &'static str,
    /// On what the verdict rests.
    pub basis: Basis,
    /// What was seen, with numbers.
    pub evidence: String,
    /// Photographs behind it.
    pub photos: usize,
    /// What was decided.
    pub verdict: Verdict,
}

impl Check {
    /// Whether it does not hold.
    pub fn fails(&self) -> bool {
        matches!(self.verdict, Verdict::Failed | Verdict::Grave)
    }
}

/// Decides every check: those that rest on chance at one rate of false alarms for all of them together.
pub(super) fn decide(mut checks: Vec<Check>, overall: f64) -> Vec<Check> {
    let p_values: Vec<f64> = checks
        .iter()
        .filter_map(|check| match check.basis {
            Basis::Chance(p) => Some(p),
            _ => None,
        })
        .collect();
    let mut rejected = rejected(&p_values, overall).into_iter();
    for check in &mut checks {
        let fails = match check.basis {
            Basis::Chance(_) => rejected.next().unwrap_or(false),
            Basis::Certain(holds) => !holds,
            Basis::Told => false,
        };
        check.verdict = match (check.basis, fails) {
            (Basis::Told, _) => Verdict::NotJudged,
            (_, false) if check.photos == 0 => Verdict::NotJudged,
            (_, false) => Verdict::Held,
            (_, true) if check.property.is_grave() => Verdict::Grave,
            (_, true) => Verdict::Failed,
        };
    }
    checks
}
