//! The experiment `expiry` alone, as `calibench run expiry`.

use calibench_experiments::expiry::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
