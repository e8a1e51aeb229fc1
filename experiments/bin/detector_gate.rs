//! The experiment `detector-gate` alone, as `calibench run detector-gate`.

use calibench_experiments::detector_gate::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
