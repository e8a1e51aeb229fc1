//! The experiment `millimetres` alone, as `calibench run millimetres`.

use calibench_experiments::millimetres::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
