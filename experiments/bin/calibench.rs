//! The `calibench` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main(calibench_experiments::EXPERIMENTS, &calibench_experiments::build())
}
