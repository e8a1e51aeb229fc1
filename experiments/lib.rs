//! Which experiments are there? Adding one is adding its module and its line here, and its binary in
//! `experiments/bin`.

use calibench_harness::{Build, Experiment};

pub mod board_warp;
pub mod certified_digits;
pub mod closed_form;
pub mod collinearity;
pub mod detector_gate;
pub mod distortion_model;
pub mod expiry;
pub mod focal_depth;
pub mod four_pose;
pub mod gate_power;
pub mod global_minimum;
pub mod grid_image;
pub mod hand_eye;
pub mod interface;
pub mod interval_coverage;
pub mod k2_observability;
pub mod lens_minimum;
pub mod line_bending;
pub mod millimetres;
pub mod model_choice;
pub mod next_pose;
pub mod nine_point;
pub mod noise_floor;
pub mod one_view;
pub mod other_solvers;
pub mod photographs;
pub mod pose_count;
pub mod position_correction;
pub mod prediction_map;
pub mod scoreboard;
mod sweep;

/// All experiments, in the order of the book.
#[rustfmt::skip]
pub const EXPERIMENTS: &[Experiment] = &[
    line_bending::EXPERIMENT,
    closed_form::EXPERIMENT,
    four_pose::EXPERIMENT,
    k2_observability::EXPERIMENT,
    prediction_map::EXPERIMENT,
    pose_count::EXPERIMENT,
    interval_coverage::EXPERIMENT,
    noise_floor::EXPERIMENT,
    focal_depth::EXPERIMENT,
    next_pose::EXPERIMENT,
    one_view::EXPERIMENT,
    collinearity::EXPERIMENT,
    grid_image::EXPERIMENT,
    millimetres::EXPERIMENT,
    distortion_model::EXPERIMENT,
    board_warp::EXPERIMENT,
    model_choice::EXPERIMENT,
    hand_eye::EXPERIMENT,
    position_correction::EXPERIMENT,
    nine_point::EXPERIMENT,
    photographs::EXPERIMENT,
    interface::EXPERIMENT,
    expiry::EXPERIMENT,
    gate_power::EXPERIMENT,
    detector_gate::EXPERIMENT,
    certified_digits::EXPERIMENT,
    scoreboard::EXPERIMENT,
    other_solvers::EXPERIMENT,
    global_minimum::EXPERIMENT,
    lens_minimum::EXPERIMENT,
];

/// Those that compute for more than some seconds: `cargo test` leaves them to `calibench run` and
/// `calibench check`.
pub const HEAVY: &[&str] = &[
    k2_observability::EXPERIMENT.id,
    focal_depth::EXPERIMENT.id,
    one_view::EXPERIMENT.id,
    board_warp::EXPERIMENT.id,
    model_choice::EXPERIMENT.id,
    hand_eye::EXPERIMENT.id,
    gate_power::EXPERIMENT.id,
    detector_gate::EXPERIMENT.id,
    global_minimum::EXPERIMENT.id,
];

/// What this program was built from, as `build.rs` found it.
pub fn build() -> Build {
    Build::read(env!("CALIBENCH_COMMIT"), env!("CALIBENCH_CHANGED"), env!("CALIBENCH_CRATES"))
        .dated(env!("CALIBENCH_DAY"))
}

/// The README's example, compiled and run with the documentation's tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
