//! Which photograph should be taken next? From a calibration with its covariance: what a further view would
//! add, for every pose of the board that can be reached, and which lowers the uncertainty of what is wanted
//! most.
//!
//! To first order the covariance of the camera after one more view is `P' = (P^-1 + S)^-1`, with `P` the
//! covariance so far and `S` the information of the view about the camera, its own pose unknown
//! ([`view_information`]). `P` holds all views taken, and whatever was known beforehand, so that nothing else
//! of them is needed.
//!
//! It stands beside what uses a finished calibration, not in `calibrate`: it judges photographs that nobody
//! has taken.

mod candidates;
mod gain;
mod information;
mod same_marks;
mod search;
#[cfg(test)]
mod tests;
mod wanted;

pub use candidates::{Candidate, Reach, ReachError};
pub use gain::{Gain, GainError, Knowledge};
pub use information::{Estimated, ViewBlocks, view_information};
pub use same_marks::marks_against_covariance;
pub use search::{Found, Ranked, best_repeated, next_pose};
pub use wanted::{Wanted, WantedError, Wish, frame_form};
