//! Is the estimate a minimum, and if not, why did the search end?

/// How the refinement ended. Every way is a result; only the first is a minimum.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Termination {
    /// A further step would lower the cost by less than 1e-14 of it, or by less than its rounding: the estimate is a minimum to
    /// about a millionth of its standard deviation, or to rounding.
    Converged,
    /// The iterations ran out.
    IterationLimit,
    /// No step lowers the cost although the gradient is not zero: the surface is too flat or too rough for the arithmetic.
    Stalled,
}

impl Termination {
    /// `converged`, `iteration-limit` or `stalled`.
    pub const fn name(self) -> &'static str {
        match self {
            Termination::Converged => "converged",
            Termination::IterationLimit => "iteration-limit",
            Termination::Stalled => "stalled",
        }
    }
}
