//! The experiment `board-warp` alone, as `calibench run board-warp`.

use calibench_experiments::board_warp::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
