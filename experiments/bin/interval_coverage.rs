//! The experiment `interval-coverage` alone, as `calibench run interval-coverage`.

use calibench_experiments::interval_coverage::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
