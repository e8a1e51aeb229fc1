//! The experiment `collinearity` alone, as `calibench run collinearity`.

use calibench_experiments::collinearity::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
