//! The table of experiments. Each is a file of its own, a module here and a binary of its own (see Cargo.toml).

use calibench::harness::Experiment;

#[path = "line_bending.rs"]
mod line_bending;

#[path = "focal_depth.rs"]
mod focal_depth;
#[path = "noise_floor.rs"]
mod noise_floor;
#[path = "pose_count.rs"]
mod pose_count;

/// All experiments, in the order of the book.
pub const EXPERIMENTS: &[Experiment] =
    &[line_bending::EXPERIMENT, pose_count::EXPERIMENT, noise_floor::EXPERIMENT, focal_depth::EXPERIMENT];
