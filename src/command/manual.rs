//! `calibench manual --out DIR`: a page of the manual for the command and for every verb.

use super::format::Format;
use super::said::say_written;
use super::{Exit, warn};
use calibench::io::write_together;
use clap::Args;
use clap_mangen::Man;
use std::io;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Folder for calibench.1 and a page for every verb, such as ~/.local/share/man/man1
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    let mut command = super::examples::command().disable_help_subcommand(true);
    command.build();
    let written = pages(&command, &arguments.out).and_then(|pages| {
        write_together(&pages)?;
        Ok(pages.into_iter().map(|(path, _)| path).collect::<Vec<_>>())
    });
    match written {
        // People see the folder that they named.
        Ok(files) => {
            say_written(&files, arguments.format, String::new);
            Exit::Held
        }
        Err(error) => {
            warn(&error.to_string());
            Exit::Incomplete
        }
    }
}

/// The pages of a command and of all verbs below it.
fn pages(command: &clap::Command, folder: &Path) -> io::Result<Vec<(PathBuf, Vec<u8>)>> {
    let page = Man::new(command.clone());
    let mut text = Vec::new();
    page.render(&mut text)?;
    let mut all = vec![(folder.join(page.get_filename()), text)];
    for verb in command.get_subcommands() {
        all.extend(pages(verb, folder)?);
    }
    Ok(all)
}
