//! The experiment `four-pose` alone, as `calibench run four-pose`.

use calibench_experiments::four_pose::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
