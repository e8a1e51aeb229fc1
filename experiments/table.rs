//! Which experiments are there? Adding one is adding its module and its line here.

use calibench::harness::Experiment;

#[path = "certified_digits.rs"]
mod certified_digits;
#[path = "collinearity.rs"]
mod collinearity;
#[path = "distortion_model.rs"]
mod distortion_model;
#[path = "expiry.rs"]
mod expiry;
#[path = "focal_depth.rs"]
mod focal_depth;
#[path = "four_pose.rs"]
mod four_pose;
#[path = "gate_power.rs"]
mod gate_power;
#[path = "interface.rs"]
mod interface;
#[path = "k2_observability.rs"]
mod k2_observability;
#[path = "line_bending.rs"]
mod line_bending;
#[path = "nine_point.rs"]
mod nine_point;
#[path = "noise_floor.rs"]
mod noise_floor;
#[path = "photographs.rs"]
mod photographs;
#[path = "pose_count.rs"]
mod pose_count;

/// All experiments, in the order of the book.
#[rustfmt::skip]
pub const EXPERIMENTS: &[Experiment] = &[
    line_bending::EXPERIMENT,
    four_pose::EXPERIMENT,
    k2_observability::EXPERIMENT,
    pose_count::EXPERIMENT,
    noise_floor::EXPERIMENT,
    focal_depth::EXPERIMENT,
    collinearity::EXPERIMENT,
    distortion_model::EXPERIMENT,
    nine_point::EXPERIMENT,
    photographs::EXPERIMENT,
    interface::EXPERIMENT,
    expiry::EXPERIMENT,
    gate_power::EXPERIMENT,
    certified_digits::EXPERIMENT,
];
