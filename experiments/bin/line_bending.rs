//! The experiment `line-bending` alone, as `calibench run line-bending`.

use calibench_experiments::line_bending::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
