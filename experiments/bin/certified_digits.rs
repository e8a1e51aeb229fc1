//! The experiment `certified-digits` alone, as `calibench run certified-digits`.

use calibench_experiments::certified_digits::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
