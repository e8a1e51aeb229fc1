//! `calibench gate export`: problems as files, for programs that cannot be driven by a pipe.

use super::options::Problems;
use super::{Stop, of_files};
use crate::{Exit, print};
use calibench::camera::Model;
use calibench::io::ShownPath;
use calibench_gate::files;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Folder to write: the problems, and apart from them the truth
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    #[command(flatten)]
    problems: Problems,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Stop> {
    let plan = arguments.problems.plan(|| vec![Model::BrownConrady])?;
    files::export(&plan, &arguments.folder).map_err(of_files)?;
    print(&format!("{} problems written to {}\n", plan.cases.len(), arguments.folder.shown()));
    Ok(Exit::Held)
}
