//! `calibench explain NAME`: where does a number, a claim, a published value, a figure or a table come from,
//! and what is it worth? Its experiment is run, and what it says is put beside golden/, the chapter and the
//! book.

mod chapter;
mod entry;
mod names;
mod pages;
mod words;

use super::calibrate::Format;
use super::terminal::warn_lines;
use super::{Exit, print};
use calibench_book::{Evidence, Sources};
use calibench_harness::project::Project;
use calibench_harness::{Context, Experiment, Record, golden};
use clap::Args;
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

/// What an explanation draws on.
struct Known<'a> {
    project: Project,
    experiments: &'a [Experiment],
    sources: Sources,
}

impl Known<'_> {
    /// The value of a number that golden/ locks.
    fn locked_value(&self, experiment: &str, own: &str) -> Option<f64> {
        let snapshot = self.project.snapshot_text(experiment)?;
        let line = format!("number | {own} | ");
        let value = golden::contents(&snapshot).lines().find_map(|text| text.strip_prefix(&line))?;
        value.split(" | ").next()?.parse().ok()
    }
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

/// The record of the locked run.
fn record_of(experiment: &Experiment) -> Result<Record, (Exit, String)> {
    let record = experiment.execute(&Context::of(experiment));
    record.map_err(|error| (Exit::of_failure(&error), format!("{}: {error}", experiment.id)))
}
