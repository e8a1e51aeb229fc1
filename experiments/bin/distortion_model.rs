//! The experiment `distortion-model` alone, as `calibench run distortion-model`.

use calibench_experiments::distortion_model::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
