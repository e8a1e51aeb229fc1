//! The whole measurement of a program: asks it all trials, and writes what is committed.

use super::programs::{PROGRAMS, Program};
use super::row::{HEADER, Row};
use super::trials::{Asked, ask};
use calibench_gate::{Builtin, Process};
use calibench_harness::campaign;
use calibench_harness::fingerprint::Fingerprint;
use clap::Parser;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// Where the committed lines stand, from the root of the project.
pub const FOLDER: &str = "golden/other-solvers";
/// Longest time for one answer.
const TIMEOUT: Duration = Duration::from_secs(120);

/// Asks a program about the trials of the experiment other-solvers, and writes how it did to
/// golden/other-solvers/NAME.csv.
#[derive(Debug, Parser)]
struct Arguments {
    /// calibench, opencv, colmap, scipy or minimal
    name: String,
    /// The Python that has what the adapter needs
    #[arg(long, default_value = "python3")]
    python: String,
    /// First trials of each cell alone
    #[arg(long, requires = "out")]
    trials: Option<u64>,
    /// Writes there instead
    #[arg(long)]
    out: Option<PathBuf>,
}

/// The command.
pub fn main() -> ExitCode {
    campaign::exit_code(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let program = campaign::named(&PROGRAMS, |program| program.name, &arguments.name)?;
    let trials = arguments.trials.unwrap_or(program.trials);
    let text = measured(program, &arguments.python, trials)?;
    campaign::write(arguments.out.as_deref(), FOLDER, program.name, &text)
}

/// The first `trials` trials of every cell, as they are committed.
fn measured(program: &Program, python: &str, trials: u64) -> Result<String, String> {
    let (asked, versions, fingerprint) = match program.adapter {
        None => {
            let versions = format!("calibench {}", env!("CARGO_PKG_VERSION"));
            (ask(Builtin, trials), versions, Fingerprint::of_other_solvers())
        }
        Some((adapter, _)) => {
            let versions = campaign::python_versions(python, program.modules)?;
            let process = Process::new(&format!("{python} adapters/{adapter}"), TIMEOUT, 1);
            (ask(process, trials), versions, Fingerprint::of_other_solvers_scenes())
        }
    };
    let Asked { rows, .. } = asked.map_err(|error| error.to_string())?;
    let what = format!(
        "other-solvers-trials {}; versions {versions}; adapter {}",
        program.name,
        program.adapter_hash()
    );
    Ok(format!("{}\n{}", fingerprint.head(&what), campaign::table(HEADER, rows.iter().map(Row::text))))
}
