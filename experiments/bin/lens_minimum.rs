//! The experiment `lens-minimum` alone, as `calibench run lens-minimum`.

use calibench_experiments::lens_minimum::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
