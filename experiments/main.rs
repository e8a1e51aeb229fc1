//! The `calibench` command.

use std::process::ExitCode;

#[path = "table.rs"]
mod table;

fn main() -> ExitCode {
    calibench::harness::cli::main(table::EXPERIMENTS)
}
