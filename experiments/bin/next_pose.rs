//! The experiment `next-pose` alone, as `calibench run next-pose`.

use calibench_experiments::next_pose::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
