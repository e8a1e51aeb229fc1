//! The table of experiments. Each is a file of its own, a module here and a binary of its own (see Cargo.toml).

use calibench::harness::Experiment;

#[path = "gate_power.rs"]
mod gate_power;
#[path = "line_bending.rs"]
mod line_bending;

/// All experiments, in the order of the book.
pub const EXPERIMENTS: &[Experiment] = &[line_bending::EXPERIMENT, gate_power::EXPERIMENT];
