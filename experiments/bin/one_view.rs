//! The experiment `one-view` alone, as `calibench run one-view`.

use calibench_experiments::one_view::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
