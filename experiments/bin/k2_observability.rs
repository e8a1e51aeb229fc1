//! The experiment `k2-observability` alone, as `calibench run k2-observability`.

use calibench_experiments::k2_observability::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
