//! The experiment `noise-floor` alone, as `calibench run noise-floor`.

use calibench_experiments::noise_floor::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
