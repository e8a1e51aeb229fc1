//! `calibench study cell`: one cell of a run as a study of its own.

use super::{Failure, complete};
use crate::Exit;
use crate::format::Format;
use crate::said::{print_as, written_by};
use calibench::io::ShownPath;
use calibench_study::{MARKS, POSES};
use serde_json::json;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Folder of the run
    run: PathBuf,
    /// Number of the cell, from 0, as in the first column of summary.csv
    cell: usize,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Failure> {
    let folder = complete(&arguments.run)?;
    for table in [MARKS, POSES] {
        folder.refuse_altered(table)?;
    }
    let engine = folder.engine(folder.shard()?)?;
    let place = arguments.run.canonicalize().unwrap_or_else(|_| arguments.run.clone());
    let Some(place) = place.to_str() else {
        return Err(Failure::usage(format!(
            "{}: a study's file names files in UTF-8, and this folder's name is not",
            arguments.run.shown()
        )));
    };
    let cells = engine.cells.len();
    let spec = engine.alone(arguments.cell, place).ok_or_else(|| {
        Failure::usage(format!("there is no cell {}: the run has cells 0 to {}", arguments.cell, cells - 1))
    })?;
    let text = spec.to_text();
    let name = &engine.cells[arguments.cell].name;
    print_as(
        arguments.format,
        || text.clone(),
        || json!({ "written_by": written_by(), "cell": arguments.cell, "levels": name, "spec": text }),
    );
    Ok(Exit::Held)
}
