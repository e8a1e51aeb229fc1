//! The table of experiments. Each is a file of its own, a module here and a binary of its own (see Cargo.toml).

use calibench::harness::Experiment;

#[path = "distortion_model.rs"]
mod distortion_model;
#[path = "expiry.rs"]
mod expiry;
#[path = "interface.rs"]
mod interface;
#[path = "line_bending.rs"]
mod line_bending;

/// All experiments, in the order of the book.
pub const EXPERIMENTS: &[Experiment] =
    &[line_bending::EXPERIMENT, distortion_model::EXPERIMENT, interface::EXPERIMENT, expiry::EXPERIMENT];
