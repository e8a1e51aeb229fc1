//! The experiment `position-correction` alone, as `calibench run position-correction`.

use calibench_experiments::position_correction::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
