//! The experiment `gate-power` alone, as `calibench run gate-power`.

use calibench_experiments::gate_power::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
