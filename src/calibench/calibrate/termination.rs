//! Is the estimate a minimum, and if not, why did the search end?

/// How the refinement ended. Every way is a result; only the first two are minima.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum Termination {
    /// A further step would lower the cost by less than 1e-14 of it, or by less than its rounding: the
    /// estimate is a minimum to about a millionth of its standard deviation, or to rounding. And it is
    /// certified: see [`super::Certificate`].
    Converged,
    /// A minimum that no other start bettered, but free homographies explain the pixels better than chance
    /// allows: the lens model does not fit, or a better minimum was not found.
    AboveFloor,
    /// The iterations ran out.
    IterationLimit,
    /// No step lowers the cost although the gradient is not zero: the surface is too flat or too rough for
    /// the arithmetic.
    Stalled,
}

impl Termination {
    /// Whether the estimate is a minimum, certified or not.
    pub const fn is_minimum(self) -> bool {
        matches!(self, Termination::Converged | Termination::AboveFloor)
    }

    /// `converged`, `above-floor`, `iteration-limit` or `stalled`.
    pub const fn name(self) -> &'static str {
        match self {
            Termination::Converged => "converged",
            Termination::AboveFloor => "above-floor",
            Termination::IterationLimit => "iteration-limit",
            Termination::Stalled => "stalled",
        }
    }
}
