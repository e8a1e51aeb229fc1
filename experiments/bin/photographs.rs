//! The experiment `photographs` alone, as `calibench run photographs`.

use calibench_experiments::photographs::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
