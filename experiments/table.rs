//! The table of experiments. Each is a file of its own, a module here and a binary of its own (see Cargo.toml).

use calibench::harness::Experiment;

#[path = "line_bending.rs"]
mod line_bending;

#[path = "collinearity.rs"]
mod collinearity;

#[path = "nine_point.rs"]
mod nine_point;

/// All experiments, in the order of the book.
pub const EXPERIMENTS: &[Experiment] =
    &[line_bending::EXPERIMENT, collinearity::EXPERIMENT, nine_point::EXPERIMENT];
