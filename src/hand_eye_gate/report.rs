//! What is said? Every check with its verdict, as text, as JSON, and as a line of a table of methods.

use super::judge::Answered;
use super::scene::Demand;
use calibench::io::significant;
use calibench_gate::Terms;
use calibench_gate::judge::{Check, Property, Verdict, decide};
use serde::Serialize;
use std::fmt::Write;

/// The checks of a run, decided.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// The solver.
    pub solver: String,
    /// Seed of the noise.
    pub seed: u64,
    /// Samples of a scene.
    pub samples: usize,
    /// How large its errors are.
    pub scenes: Vec<SceneResult>,
    /// Every check.
    pub checks: Vec<Check>,
    /// Whether all hold.
    pub trusted: bool,
}

/// How a solver's errors compare with the bound in a scene.
#[derive(Debug, Clone, Serialize)]
pub struct SceneResult {
    /// Name of the scene.
    pub scene: &'static str,
    /// What it is.
    pub about: &'static str,
    /// Root mean squared error over the bound; `None` where there is no bound or no answer.
    pub over_bound: Option<f64>,
}

impl Report {
    pub(super) fn new(
        solver: String,
        seed: u64,
        samples: usize,
        answered: &[Answered],
        terms: &Terms,
    ) -> Report {
        let checks = decide(answered.iter().flat_map(Answered::checks).collect(), terms);
        let scenes = answered.iter().map(|answered| SceneResult {
            scene: answered.scene.id,
            about: answered.scene.about,
            over_bound: match answered.scene.demand {
                Demand::Law => answered.over_bound(),
                Demand::Refusal => None,
            },
        });
        let trusted = checks.iter().all(|check| !fails(check));
        Report { solver, seed, samples, scenes: scenes.collect(), checks, trusted }
    }

    /// The properties that were asked, in the order of reports.
    fn properties(&self) -> impl Iterator<Item = (Property, Vec<&Check>)> {
        Property::ALL.iter().filter_map(|property| {
            let of: Vec<&Check> = self.checks.iter().filter(|check| check.property == *property).collect();
            (!of.is_empty()).then_some((*property, of))
        })
    }

    /// For people.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{}: {} (seed {}, {} samples a scene)\n\nerrors over the Cramer-Rao bound\n",
            self.solver,
            if self.trusted { "trusted" } else { "NOT TRUSTED" },
            self.seed,
            self.samples
        );
        // Writing to a string cannot fail, here and below.
        for scene in &self.scenes {
            if let Some(over) = scene.over_bound {
                let _ = writeln!(text, "  {:<14} {:>8}  {}", scene.scene, significant(over, 4), scene.about);
            }
        }
        text.push('\n');
        for (property, checks) in self.properties() {
            let failing: Vec<&&Check> = checks.iter().filter(|check| fails(check)).collect();
            let judged = checks.iter().filter(|check| check.verdict != Verdict::NotJudged).count();
            let _ = match (failing.first(), judged) {
                (_, 0) => writeln!(text, "{:<18} not judged: {}", property.name(), checks[0].evidence),
                (None, _) => writeln!(text, "{:<18} held in {judged} of {judged} scenes", property.name()),
                (Some(_), _) => writeln!(
                    text,
                    "{:<18} {} in {} of {judged} scenes",
                    property.name(),
                    failing[0].verdict.word(),
                    failing.len()
                ),
            };
            for check in failing {
                let _ = writeln!(text, "    {:<14} {}", check.scenario, check.evidence);
            }
        }
        text
    }

    /// For programs.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a report has text keys only") + "\n"
    }

    /// `| method | licence | twelve | ... | what does not hold |`.
    pub fn to_row(&self, name: &str) -> String {
        let mut row = format!("| {name} |");
        for scene in self.scenes.iter().filter(|scene| self.is_law(scene.scene)) {
            let _ =
                write!(row, " {} |", scene.over_bound.map_or("–".to_string(), |over| significant(over, 3)));
        }
        let failing = self.properties().filter_map(|(property, checks)| {
            let scenes: Vec<&str> =
                checks.iter().filter(|check| fails(check)).map(|check| check.scenario).collect();
            (!scenes.is_empty()).then(|| format!("{} ({})", property.name(), scenes.join(", ")))
        });
        let failing = failing.collect::<Vec<_>>().join("; ");
        let _ = write!(row, " {} |", if self.trusted { "**trusted**".to_string() } else { failing });
        row
    }

    /// Head of the table whose lines [`Report::to_row`] writes.
    pub fn head(&self) -> String {
        let scenes: Vec<&str> =
            self.scenes.iter().map(|scene| scene.scene).filter(|id| self.is_law(id)).collect();
        let rule = "---|".repeat(scenes.len() + 2);
        format!("| method | {} | does not hold |\n|{rule}", scenes.join(" | "))
    }

    fn is_law(&self, scene: &str) -> bool {
        self.checks.iter().any(|check| check.scenario == scene && check.property == Property::Convergence)
    }
}

fn fails(check: &Check) -> bool {
    matches!(check.verdict, Verdict::Failed | Verdict::Grave)
}
