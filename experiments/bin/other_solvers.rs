//! The experiment `other-solvers` alone, as `calibench run other-solvers`.

use calibench_experiments::other_solvers::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
