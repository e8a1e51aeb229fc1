//! `calibench gate judge`: the answers in a folder, judged or compared.

use super::Stop;
use super::compare::Against;
use super::options::{Copies, Judgement, Reports};
use super::verdict::{asked, keep_recorded, recorded, told};
use crate::Exit;
use calibench_harness::Build;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Folder with problems and answers: DIR/answers.jsonl, or files in DIR/answers/
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    #[command(flatten)]
    judgement: Judgement,
    #[command(flatten)]
    reports: Reports,
    /// Compares with a reference on the same problems: `builtin`, a program, or another such folder
    #[arg(long, value_name = "REF", conflicts_with_all = ["format", "junit", "html"])]
    against: Option<String>,
    #[command(flatten)]
    copies: Copies,
}

pub(super) fn run(arguments: &Arguments, build: &Build) -> Result<Exit, Stop> {
    arguments.reports.check()?;
    arguments.copies.check()?;
    keep_recorded(&arguments.folder);
    if let Some(reference) = &arguments.against {
        let Arguments { copies, judgement, reports, .. } = arguments;
        let against = Against { reference, copies, judgement, reports };
        return against.answers(&arguments.folder);
    }
    let (plan, answers) = recorded(&arguments.folder)?;
    Ok(told(&arguments.reports, &asked(&arguments.judgement, &plan, &answers, build)?))
}
