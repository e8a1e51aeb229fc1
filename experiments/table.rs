//! The table of experiments. Each is a file of its own, a module here and a binary of its own (see Cargo.toml).

use calibench::harness::Experiment;

#[path = "four_pose.rs"]
mod four_pose;
#[path = "k2_observability.rs"]
mod k2_observability;
#[path = "line_bending.rs"]
mod line_bending;
#[path = "photographs.rs"]
mod photographs;

/// All experiments, in the order of the book.
pub const EXPERIMENTS: &[Experiment] =
    &[line_bending::EXPERIMENT, four_pose::EXPERIMENT, k2_observability::EXPERIMENT, photographs::EXPERIMENT];
