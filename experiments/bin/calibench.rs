//! The `calibench` command.

use calibench_experiments::{EXPERIMENTS, build};
use std::process::ExitCode;

/// Golden and published values, certified problems, figures, the book's text and the code it quotes, gathered
/// by `build.rs`.
const CARRIED: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/carried.rs"));

fn main() -> ExitCode {
    calibench_command::main(EXPERIMENTS, &build(), CARRIED)
}
