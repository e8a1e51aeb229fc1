//! The experiment `global-minimum` alone, as `calibench run global-minimum`.

use calibench_experiments::global_minimum::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
