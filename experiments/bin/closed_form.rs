//! The experiment `closed-form` alone, as `calibench run closed-form`.

use calibench_experiments::closed_form::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
