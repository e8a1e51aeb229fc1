//! `calibench study figure`: one panel of a run's figures as a figure of its own.

use super::{Failure, complete};
use crate::Exit;
use crate::format::Format;
use crate::said::{print_as, written_by};
use calibench_study::single_panels;
use serde_json::json;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Folder of the run
    run: PathBuf,
    /// The panel to print as SVG, such as bias/fx; without, the names of all are printed
    #[arg(long, value_name = "NAME")]
    panel: Option<String>,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, Failure> {
    let panels = single_panels(&complete(&arguments.run)?.replayed()?);
    let names: Vec<&str> = panels.iter().map(|(name, _)| name.as_str()).collect();
    if names.is_empty() {
        return Err(Failure::usage(
            "the figures of this study have no panels of one quantity against a factor: it has no factor with numbers, or too many others beside it",
        ));
    }
    let Some(wanted) = &arguments.panel else {
        print_as(
            arguments.format,
            || names.join("\n") + "\n",
            || json!({ "written_by": written_by(), "panels": names }),
        );
        return Ok(Exit::Held);
    };
    let Some((_, figure)) = panels.iter().find(|(name, _)| name == wanted) else {
        return Err(Failure::usage(format!("there is no panel `{wanted}`; there are: {}", names.join(", "))));
    };
    let svg = String::from_utf8_lossy(&figure.bytes);
    print_as(
        arguments.format,
        || svg.to_string(),
        || json!({ "written_by": written_by(), "panel": wanted, "caption": figure.caption, "svg": svg }),
    );
    Ok(Exit::Held)
}
