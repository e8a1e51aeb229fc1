//! `calibench gate` without a verb after it: asks a solver, and judges or compares what it answers.

use super::super::format::Format;
use super::super::{Exit, print};
use super::compare::Against;
use super::options::{Copies, Judgement, Problems, Reports};
use super::verdict::{asked, told};
use super::{Stop, of_files, usage};
use calibench::io::ShownPath;
use calibench_gate::faults::{Faulty, planted};
use calibench_gate::{Builtin, Plan, Recorder, Report, Solver, files};
use calibench_harness::Build;
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[group(skip)]
pub(super) struct Arguments {
    /// Program to judge: reads problems, writes answers, one JSON object a line (see adapters/PROTOCOL.md)
    /// [default: this library's solver]
    #[arg(long, value_name = "COMMAND")]
    solver: Option<String>,
    /// Judges this library's solver with a planted fault; `calibench gate faults` names them
    #[arg(long, value_name = "FAULT", conflicts_with = "solver")]
    planted: Option<String>,
    #[command(flatten)]
    copies: Copies,
    #[command(flatten)]
    problems: Problems,
    #[command(flatten)]
    judgement: Judgement,
    #[command(flatten)]
    reports: Reports,
    /// Judges as ever, and writes the problems and the solver's answers to a folder
    #[arg(long, value_name = "DIR", conflicts_with = "against")]
    record: Option<PathBuf>,
    /// Compares with a reference on the same problems: `builtin`, a program, or a folder written by --record
    #[arg(long, value_name = "REF", conflicts_with_all = ["format", "junit", "html"])]
    against: Option<String>,
}

pub(super) fn run(arguments: &Arguments, build: &Build) -> Result<Exit, Stop> {
    arguments.reports.check()?;
    arguments.problems.check()?;
    arguments.copies.check()?;
    let solver = arguments.solver()?;
    if let Some(reference) = &arguments.against {
        let Arguments { copies, judgement, reports, .. } = arguments;
        let against = Against { reference, copies, judgement, reports };
        return against.solver(&arguments.problems, solver.as_ref());
    }
    let plan = arguments.problems.plan(|| solver.models())?;
    match &arguments.record {
        Some(folder) => record(arguments, &plan, solver.as_ref(), folder, build),
        None => Ok(told(&arguments.reports, &report(arguments, &plan, solver.as_ref(), build)?)),
    }
}

impl Arguments {
    fn solver(&self) -> Result<Box<dyn Solver>, Stop> {
        match (&self.solver, &self.planted) {
            (Some(command), _) => self.copies.process(command),
            (None, Some(id)) => {
                let fault = planted().into_iter().find(|fault| fault.id == id);
                let unknown =
                    || usage(format!("no planted fault `{id}`; `calibench gate faults` names them"));
                Ok(Box::new(Faulty::new(fault.ok_or_else(unknown)?)))
            }
            (None, None) => Ok(Box::new(Builtin)),
        }
    }

    /// The command that asks all scenes again, to which some may be added.
    fn repeat(&self, plan: &Plan) -> String {
        let solver = match (&self.solver, &self.planted) {
            (Some(command), _) => format!(" --solver '{}'", command.replace('\'', "'\\''")),
            (None, Some(fault)) => format!(" --planted {fault}"),
            (None, None) => String::new(),
        };
        let models: Vec<&str> = plan.asked.models.iter().map(|model| model.name()).collect();
        let limit = self.judgement.median_time.map_or(String::new(), |s| format!(" --median-time {s}"));
        format!(
            "calibench gate{solver} --models {} --samples {} --seed {}{limit}",
            models.join(","),
            plan.samples,
            plan.seed
        )
    }
}

fn report(arguments: &Arguments, plan: &Plan, solver: &dyn Solver, build: &Build) -> Result<Report, Stop> {
    Ok(asked(&arguments.judgement, plan, solver, build)?.with_repeat(&arguments.repeat(plan)))
}

/// Judges, and files problems and answers.
fn record(
    arguments: &Arguments,
    plan: &Plan,
    solver: &dyn Solver,
    folder: &Path,
    build: &Build,
) -> Result<Exit, Stop> {
    files::export(plan, folder).map_err(of_files)?;
    let recorder = Recorder::new(solver);
    let report = report(arguments, plan, &recorder, build)?;
    // Before the report: where that cannot be written the answers are kept.
    files::file_answers(plan, folder, &recorder).map_err(of_files)?;
    let exit = told(&arguments.reports, &report);
    // The report is the one object on standard output.
    if arguments.reports.told.format == Format::Text {
        print(&format!("{} problems and answers written to {}\n", plan.cases.len(), folder.shown()));
    }
    Ok(exit)
}
