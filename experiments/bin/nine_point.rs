//! The experiment `nine-point` alone, as `calibench run nine-point`.

use calibench_experiments::nine_point::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
