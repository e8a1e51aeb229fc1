//! The experiment `interface` alone, as `calibench run interface`.

use calibench_experiments::interface::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
