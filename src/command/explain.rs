//! `calibench explain NAME`: where does a number, a claim, a published value, a figure or a table come from,
//! and what is it worth? Its experiment is run, and what it says is put beside golden/, the chapter and the
//! book.

mod chapter;
mod entry;
mod known;
mod names;
mod pages;
mod words;

use super::format::Format;
use super::terminal::warn_lines;
use super::{Exit, print};
use calibench_book::{Evidence, Sources};
use calibench_harness::Experiment;
use calibench_harness::project::Project;
use clap::Args;
use known::{Known, record_of};
use names::{Meant, Names};
use words::Answer;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// What is asked for: a number, claim, published value, figure or table (four-pose.fx), an experiment
    /// (four-pose), a section of the chapter (5.1), or one of the book's contradictions (two-views-suffice)
    name: String,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

pub(super) fn run(experiments: &[Experiment], arguments: &Arguments) -> Exit {
    match explained(experiments, &arguments.name) {
        Ok(answer) => {
            match arguments.format {
                Format::Text => print(&answer.text()),
                Format::Json => print(&format!("{:#}\n", answer.json())),
            }
            Exit::Held
        }
        Err((exit, message)) => {
            warn_lines(&message);
            exit
        }
    }
}

fn explained(experiments: &[Experiment], name: &str) -> Result<Answer, (Exit, String)> {
    let project = Project::find().map_err(|error| (Exit::Usage, error.to_string()))?;
    let sources = Sources::load(&project, Evidence::default()).map_err(|finding| {
        (Exit::Incomplete, format!("{}:{}: {}", finding.file, finding.line, finding.message))
    })?;
    let known = Known { project, experiments, sources };
    let names = Names::of(&known);
    match names.meant(name) {
        Some(Meant::Experiment(experiment)) => Ok(chapter::experiment(experiment, &names)),
        Some(Meant::Section) => chapter::section(&known, name),
        Some(Meant::Contradiction) => Ok(chapter::contradiction(&known, name)),
        Some(Meant::Entry(experiment, own)) => {
            let record = record_of(experiment)?;
            Ok(entry::explained(&known, experiment, &record, own))
        }
        None => Err((Exit::Usage, names.not_found(name))),
    }
}
