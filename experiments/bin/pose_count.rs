//! The experiment `pose-count` alone, as `calibench run pose-count`.

use calibench_experiments::pose_count::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
