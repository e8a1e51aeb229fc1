//! What did the gate find? All checks of a run, decided; told on one screen, as JSON, as JUnit and as a page.

mod html;
mod junit;
mod text;

pub use text::COLUMNS;

use super::allowances::Allowed;
use super::bad_input::Fault;
use super::judge::{self, Admission, Basis, Check, Property, Terms, Verdict};
use super::plan::Plan;
use super::program::ProgramEnd;
use super::trial::Seen;
use calibench::io::{Commit, significant};
use serde::Serialize;

/// The outcome of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Report {
    /// Name or command of the solver.
    pub solver: String,
    /// Seed of the noise.
    pub seed: u64,
    /// Samples a scenario.
    pub samples: usize,
    /// Names of the lens models whose scenes were asked.
    pub models: Vec<&'static str>,
    /// Names of the scenes that were asked; empty if none was left out.
    pub only: Vec<String>,
    /// The command that repeats the run, if there is one. Every check that fails has the command that asks
    /// its scene again.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub repeat: Option<String>,
    /// Problems asked.
    pub problems: usize,
    /// Chance that a correct solver fails this run.
    pub false_alarm_rate: f64,
    /// Number of checks that share it.
    pub statistical_checks: usize,
    /// The worst verdict.
    pub verdict: Verdict,
    /// Wall-clock time, s.
    pub seconds: f64,
    /// How each copy of the program ended when its input did, and its memory; empty where no program ran at
    /// the end.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub program_ends: Vec<ProgramEnd>,
    /// Commit of the gate.
    pub commit: Option<String>,
    /// Scenes that were asked and that the solver says it is not made for.
    pub unsupported: Vec<&'static str>,
    /// Every check.
    pub checks: Vec<Check>,
    /// What the solver says where the world is not the model.
    pub assumptions: Vec<Admission>,
    /// What was stated as known, and what became of it.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub allowances: Vec<Allowed>,
    /// What was asked.
    pub scenarios: Vec<Described>,
}

/// A scenario or a bad problem in words.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct Described {
    /// Its name in checks.
    pub name: &'static str,
    /// What is particular about it.
    pub about: String,
}

/// One property over all scenarios.
#[derive(Debug, Clone, Serialize)]
pub struct Row<'a> {
    /// Which.
    pub property: Property,
    /// The worst verdict.
    pub verdict: Verdict,
    /// Checks that hold, of those that were judged.
    pub held: (usize, usize),
    /// The check to tell about: the worst, or else the most doubtful.
    #[serde(skip)]
    pub telling: &'a Check,
}

impl Report {
    /// Judges what was seen.
    pub fn new(plan: &Plan, solver: &str, seen: &[Option<Seen>], terms: &Terms, seconds: f64) -> Report {
        let checks = judge::judged(plan, seen, terms);
        let statistical = checks.iter().filter(|c| matches!(c.basis, Basis::Chance(_))).count();
        Report {
            solver: solver.to_string(),
            seed: plan.seed,
            samples: plan.samples,
            models: plan.asked.models.iter().map(|model| model.name()).collect(),
            only: plan.asked.scenes.clone(),
            repeat: None,
            problems: seen.iter().flatten().count(),
            false_alarm_rate: terms.false_alarm_rate,
            statistical_checks: statistical,
            verdict: checks.iter().map(|c| c.verdict).max().unwrap_or(Verdict::NotJudged),
            seconds,
            program_ends: Vec::new(),
            commit: None,
            allowances: terms.allowances.iter().map(|allowance| allowance.applied(&checks)).collect(),
            checks,
            unsupported: judge::unsupported(plan, seen),
            assumptions: judge::admissions(plan, seen),
            scenarios: described(plan),
        }
    }

    /// States how the program ended.
    pub fn with_program_ends(self, program_ends: Vec<ProgramEnd>) -> Report {
        Report { program_ends, ..self }
    }

    /// How the program ended and its memory, in words; nothing where none ran at the end.
    fn program_ended(&self) -> String {
        let mut how: Vec<String> = self.program_ends.iter().map(ProgramEnd::how).collect();
        how.sort();
        how.dedup();
        if how.is_empty() {
            return String::new();
        }
        let memory = match self.program_ends.iter().filter_map(|end| end.peak_memory_bytes).max() {
            Some(bytes) => format!("peak memory {} MB", significant(bytes as f64 / 1e6, 3)),
            None => "peak memory not known".to_string(),
        };
        format!("; {}, {memory}", how.join(" and "))
    }

    /// States the commit of the gate.
    pub fn with_commit(self, commit: Option<&Commit>) -> Report {
        Report { commit: commit.map(Commit::to_string), ..self }
    }

    /// States the command that asks all scenes of the run, from which follow that of the run and that of
    /// every check that fails.
    pub fn with_repeat(mut self, command: &str) -> Report {
        let of_scene = |scene: &str| format!(" --scene {scene}");
        for check in self.checks.iter_mut().filter(|c| c.verdict >= Verdict::Failed) {
            check.repeat = Some(format!("{command}{}", of_scene(check.scenario)));
        }
        let scenes: String = self.only.iter().map(|scene| of_scene(scene)).collect();
        Report { repeat: Some(format!("{command}{scenes}")), ..self }
    }

    /// Whether nothing fails.
    pub fn held(&self) -> bool {
        self.verdict < Verdict::Failed
    }

    /// Checks that fail, the gravest first.
    pub fn failures(&self) -> Vec<&Check> {
        let mut failures: Vec<&Check> = self.checks.iter().filter(|c| c.verdict >= Verdict::Failed).collect();
        failures.sort_by_key(|c| (std::cmp::Reverse(c.verdict), c.property));
        failures
    }

    /// One row a property that was looked at.
    pub fn rows(&self) -> Vec<Row<'_>> {
        Property::ALL.iter().filter_map(|&property| self.row(property)).collect()
    }

    fn row(&self, property: Property) -> Option<Row<'_>> {
        let of_property = || self.checks.iter().filter(move |c| c.property == property);
        // The worst verdict first, then the least probable evidence; ties go to the first scenario.
        let doubt = |c: &Check| match c.basis {
            Basis::Chance(p) => p,
            _ => 1.0,
        };
        let telling = of_property()
            .reduce(|a, b| if (b.verdict, -doubt(b)) > (a.verdict, -doubt(a)) { b } else { a })?;
        let judged = of_property().filter(|c| c.verdict != Verdict::NotJudged).count();
        let held = of_property().filter(|c| c.verdict == Verdict::Held).count();
        Some(Row { property, verdict: telling.verdict, held: (held, judged), telling })
    }

    /// The report as JSON: its fields, and under `properties` a verdict each.
    pub fn to_json(&self) -> String {
        // Evidence is text and rates are finite, so nothing can fail.
        let mut value = serde_json::to_value(self).unwrap_or_default();
        value["properties"] = serde_json::to_value(self.rows()).unwrap_or_default();
        format!("{value:#}\n")
    }
}

fn described(plan: &Plan) -> Vec<Described> {
    let scenarios = plan.scenarios.iter().map(|s| Described { name: s.id, about: s.about.to_string() });
    let bad = plan.bad.iter().map(|case| {
        let views = case.problem.views.len();
        let points = case.problem.points();
        let kind = match case.fault {
            Fault::Degenerate => "well formed, but determines no camera",
            Fault::Malformed => "broken",
        };
        Described { name: case.id, about: format!("{kind}: {views} views, {points} pixels") }
    });
    scenarios.chain(bad).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::Asked;

    /// A report of a run in which nothing was asked, with these checks.
    pub(super) fn report_of(checks: Vec<Check>, terms: &Terms) -> Report {
        let plan = Plan::of(1, 0, Asked { scenes: vec!["four-pose".into()], ..Asked::default() }).unwrap();
        let verdict = checks.iter().map(|check| check.verdict).max().unwrap();
        let allowances = terms.allowances.iter().map(|allowance| allowance.applied(&checks)).collect();
        let nothing = vec![None; plan.cases.len()];
        Report { verdict, checks, allowances, ..Report::new(&plan, "mine", &nothing, terms, 0.0) }
    }

    /// A check of a scene's bias, with a p-value unless it was not judged.
    pub(super) fn check(scene: &'static str, verdict: Verdict, p: f64) -> Check {
        let basis = if verdict == Verdict::NotJudged { Basis::Told } else { Basis::Chance(p) };
        Check { verdict, ..Check::new(Property::Bias, scene, basis, 3, format!("<seen on {scene}>")) }
    }

    #[test]
    fn the_worst_check_tells_of_a_property_or_else_the_least_probable() {
        use Verdict::{Failed, Held};
        let told = |checks: Vec<Check>| report_of(checks, &Terms::default()).rows()[0].telling.scenario;
        assert_eq!(told(vec![check("a", Held, 0.5), check("b", Held, 0.01), check("c", Held, 0.2)]), "b");
        assert_eq!(told(vec![check("a", Held, 1e-9), check("b", Failed, 0.1)]), "b");
        assert_eq!(told(vec![check("a", Held, 0.5), check("b", Held, 0.5)]), "a");
    }
}
