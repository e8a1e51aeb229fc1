//! Which camera explains photographs of marks whose places in space were measured? A target from a coordinate
//! measuring machine or from photogrammetry: marks in any layout, each with the standard deviation of its
//! measurement.
//!
//! With the noise `sigma` of a pixel coordinate of weight 1, weights `w`, the mark positions `X` and what was
//! measured of them, `X0 +- sd`, the estimate is the most likely one of lens parameters, poses and positions
//! together (Gauss-Markov with stochastic prior information; Triggs, McLauchlan, Hartley & Fitzgibbon 2000,
//! section 2):
//!
//! ```text
//! sum w^2 |r|^2 / sigma^2 + sum ((X - X0) / sd)^2 + sum ((p - mean) / prior sd)^2   is least
//! Q = (J^T W J + P)^-1,   P = diag(sigma^2 / sd^2),   covariance = sigma^2 Q
//! ```
//! A coordinate whose `sd` is 0 is no unknown. What was measured fixes the frame: the seven numbers of a
//! similarity are known as well as the measurements together tell them.
//!
//! `sigma` is given, or estimated with the rest as under every prior of [`crate::calibrate::Prior`]: of the
//! `p` unknowns the measurements settle the part `s = tr(Q P)`, which costs the pixels no degree of freedom,
//!
//! ```text
//! sigma^2 = sum w^2 |r|^2 / (2 N - p + s)
//! ```
//! repeated until it agrees with the `sigma` in `P`. It is the variance component of the pixels beside that
//! of the measurements, which stays as stated (Foerstner 1979). Whether what is stated can be believed is
//! tested: see [`SumTest`].
//!
//! Where the cost is no parabola and standard deviations mislead, as of a double sphere seen over a narrow
//! angle, whose parameters hang together, [`crate::calibrate::Warning::NotLinear`] says so, as after
//! [`crate::calibrate::calibrate_lens`].
//!
//! The folder lies outside of `calibrate`, whose solver knows planes and up to three numbers of a board's
//! shape, and builds on it: a target near a plane starts from [`crate::calibrate::calibrate_lens`].

mod data;
mod descent;
mod equations;
mod error;
mod estimate;
mod focal;
mod identifiability;
mod left_out;
mod lens;
mod linearity;
mod noise;
mod plane;
mod problem;
mod report;
mod resection;
mod rivals;
mod search;
mod shape;
mod space;
mod target;
#[cfg(test)]
mod tests;
mod tests_of_sums;
mod tilts;
mod view;
mod warnings;

pub use error::MeasuredError;
pub use estimate::{MOST_UNCERTAIN_MARKS, Noise, calibrate_measured};
pub use report::{CorrectedMark, MeasuredCalibration};
pub use target::{MeasuredMark, MeasuredTarget, TargetError};
pub use tests_of_sums::{FALSE_ALARM, SumTest};
pub use view::{MeasuredView, SeenMark};
