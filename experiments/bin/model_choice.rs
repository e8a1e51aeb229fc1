//! The experiment `model-choice` alone, as `calibench run model-choice`.

use calibench_experiments::model_choice::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
