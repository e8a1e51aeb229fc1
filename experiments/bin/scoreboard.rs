//! The experiment `scoreboard` alone, as `calibench run scoreboard`.

use calibench_experiments::scoreboard::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
