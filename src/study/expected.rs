//! What does theory expect of a quantity before anything is drawn?

/// Mean and standard deviation that theory expects, to first order in the noise and for Gaussian noise
/// without gross errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expected {
    /// Mean; 0 for an error.
    pub mean: f64,
    /// Standard deviation; the Cramer-Rao bound for an error.
    pub sd: f64,
}
