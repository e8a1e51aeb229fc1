//! The experiment `focal-depth` alone, as `calibench run focal-depth`.

use calibench_experiments::focal_depth::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
