//! Which camera explains the pixels? Zhang's method: homographies, closed form, maximum-likelihood
//! refinement, covariance.
//!
//! [`calibrate`] is the whole way; the steps stand in files of their own. Truth never enters here.

mod any_lens;
mod blocks;
mod certificate;
mod chance;
mod choice;
mod chunks;
mod closed_form;
mod condensed;
mod conditioning;
mod copies;
mod covariance;
mod duplicates;
mod elimination;
mod error;
mod estimate;
mod identifiability;
mod in_words;
mod intervals;
mod kernel;
mod lens;
mod loss;
mod minimise;
mod normal;
mod polish;
mod prior;
mod radial_centre;
mod relaxed;
mod report;
mod retraction;
mod rival;
mod search;
mod settings;
pub mod single_plane;
mod start;
mod strays;
mod structure;
mod system;
mod target_frame;
mod termination;
mod tie;
mod tilt;
mod unknown;
mod walk;
mod warnings;

pub use any_lens::{BoardShape, Located, lens_information, locate};
pub use certificate::Certificate;
pub use choice::{Candidate, Compared, Freedom, compare_models, explaining_freedoms};
pub use closed_form::{ClosedFormError, closed_form, pose_from_homography};
pub use conditioning::{Conditioning, WeakComponent};
pub use covariance::Covariance;
pub use error::CalibrationError;
pub use estimate::calibrate;
pub use in_words::in_words;
pub use intervals::ProfileInterval;
pub use lens::{LensCalibration, calibrate_lens};
pub use loss::Loss;
pub use normal::information;
pub use prior::Prior;
pub use report::{Calibration, Warning};
pub use settings::{Board, Role, Settings};
pub use system::System;
pub use termination::Termination;
pub use unknown::Unknown;
