//! `calibench gate --against`: two solvers on the same problems, asked now or judged by the answers they gave
//! before.

use super::options::{Copies, Judgement, Problems, Reports};
use super::verdict::{keep_recorded, recorded};
use super::{Stop, usage};
use crate::{Exit, program};
use calibench::camera::Model;
use calibench::io::ShownPath;
use calibench_gate::paired::{self, Paired};
use calibench_gate::{Asked, Builtin, Plan, Report, Solver};
use calibench_harness::ProgressDisplay;
use std::path::Path;

/// Refuses a folder that holds no recorded run, and a name of which there is neither a folder nor a program:
/// as a command it would only say that it is not found.
fn refuse_what_is_not_there(reference: &str) -> Result<(), Stop> {
    let path = Path::new(reference);
    if path.is_dir() {
        return Err(usage(format!(
            "{} holds no manifest.json: a reference is a folder that `calibench gate --record DIR` wrote, a program, or builtin",
            path.shown()
        )));
    }
    if program::is_missing(reference) {
        return Err(usage(format!(
            "{} is neither there as a folder nor as a program: a reference is a folder that `calibench gate --record DIR` wrote, a \
             program, or builtin",
            path.shown()
        )));
    }
    Ok(())
}

/// What is compared with, how, and where the report goes.
pub(super) struct Against<'a> {
    pub reference: &'a str,
    pub copies: &'a Copies,
    pub judgement: &'a Judgement,
    pub reports: &'a Reports,
}

impl Against<'_> {
    /// Compares a solver that is asked now.
    pub fn solver(&self, problems: &Problems, solver: &dyn Solver) -> Result<Exit, Stop> {
        keep_recorded(Path::new(self.reference));
        let (plan, other): (Plan, Box<dyn Solver>) = match self.reference {
            "builtin" => (problems.plan(|| solver.models())?, Box::new(Builtin)),
            folder if holds_a_run(folder) => {
                let (plan, answers) = recorded(Path::new(folder))?;
                (plan, Box::new(answers))
            }
            command => {
                refuse_what_is_not_there(command)?;
                let other = self.copies.process(command)?;
                let both = || solver.models().into_iter().filter(|m| other.models().contains(m)).collect();
                (problems.plan(both)?, other)
            }
        };
        self.compared(&plan, solver, other.as_ref())
    }

    /// Compares the answers in a folder, whose problems the reference is asked if it has not answered them
    /// before.
    pub fn answers(&self, folder: &Path) -> Result<Exit, Stop> {
        keep_recorded(Path::new(self.reference));
        let (plan, answers) = recorded(folder)?;
        let (plan, other): (Plan, Box<dyn Solver>) = match self.reference {
            "builtin" => (plan, Box::new(Builtin)),
            before if holds_a_run(before) => {
                let before = Path::new(before);
                let (theirs, answers) = recorded(before)?;
                (common((folder, &plan), (before, &theirs))?, Box::new(answers))
            }
            command => {
                refuse_what_is_not_there(command)?;
                let other = self.copies.process(command)?;
                let known = other.models();
                let plan = of_models(&plan, &known)?.ok_or_else(|| {
                    usage(format!(
                        "{command} knows none of the lens models whose problems {} answers",
                        folder.shown()
                    ))
                })?;
                (plan, other)
            }
        };
        self.compared(&plan, &answers, other.as_ref())
    }

    fn compared(&self, plan: &Plan, solver: &dyn Solver, other: &dyn Solver) -> Result<Exit, Stop> {
        let terms = self.judgement.terms()?;
        let ask = |solver: &dyn Solver| {
            let progress = ProgressDisplay::stderr().start("gate", plan.cases.len());
            let seen = calibench_gate::run(plan, solver, &|done| progress.advance(done));
            let report = Report::new(plan, "", &seen, &terms, 0.0);
            (seen, report.checks)
        };
        let (old, old_checks) = ask(other);
        let (new, new_checks) = ask(solver);
        let paired: Paired = paired::compare(
            plan,
            (&solver.name(), &new, &new_checks),
            (&other.name(), &old, &old_checks),
            terms.false_alarm_rate,
        );
        Ok(self.reports.told.tell(&paired.to_json(), &paired.to_text(), paired.held()))
    }
}

fn holds_a_run(reference: &str) -> bool {
    Path::new(reference).join("manifest.json").is_file()
}

/// The problems that both folders answer: of the lens models that both have.
fn common((ours, plan): (&Path, &Plan), (theirs, other): (&Path, &Plan)) -> Result<Plan, Stop> {
    let asked = |plan: &Plan| (plan.seed, plan.samples, plan.asked.scenes.clone());
    let common = if asked(plan) == asked(other) { of_models(plan, &other.asked.models)? } else { None };
    common.ok_or_else(|| {
        usage(format!(
            "{} and {} answer other problems ({}; {}): record both with the same --seed, --samples, --scene and --models",
            ours.shown(),
            theirs.shown(),
            in_words(plan),
            in_words(other)
        ))
    })
}

/// The part of a plan that is of these lens models; `None` if it is empty.
fn of_models(plan: &Plan, known: &[Model]) -> Result<Option<Plan>, Stop> {
    let models: Vec<Model> =
        plan.asked.models.iter().copied().filter(|model| known.contains(model)).collect();
    if models.is_empty() {
        return Ok(None);
    }
    let asked = Asked { models, scenes: plan.asked.scenes.clone() };
    Plan::of(plan.seed, plan.samples, asked).map(Some).map_err(usage)
}

/// What a plan asks.
fn in_words(plan: &Plan) -> String {
    let models: Vec<&str> = plan.asked.models.iter().map(|model| model.name()).collect();
    let scenes = match &plan.asked.scenes[..] {
        [] => "all scenes".to_string(),
        scenes => scenes.join(", "),
    };
    format!("seed {}, {} samples of {scenes} with {}", plan.seed, plan.samples, models.join(", "))
}
