//! The experiment `prediction-map` alone, as `calibench run prediction-map`.

use calibench_experiments::prediction_map::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
