//! The experiment `hand-eye` alone, as `calibench run hand-eye`.

use calibench_experiments::hand_eye::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
