//! The experiment `grid-image` alone, as `calibench run grid-image`.

use calibench_experiments::grid_image::EXPERIMENT;
use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_command::main_for(&EXPERIMENT, &calibench_experiments::build())
}
