//! What is said? Figures of every scene and the checks that fail, as text and as JSON.

use super::check::{Check, Property};
use super::judge::Figures;
use super::protocol::Kind;
use calibench::io::significant;
use calibench_gate::judge::Verdict;
use serde::Serialize;
use std::fmt::Write;

/// The checks of a run, decided.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// The detector.
    pub detector: String,
    /// Kinds of boards that it was asked for.
    pub boards: Vec<Kind>,
    /// Seed of the photographs.
    pub seed: u64,
    /// Photographs of a scene.
    pub photos: usize,
    /// Chance that a detector without a fault fails a check that rests on chance.
    pub false_alarm_rate: f64,
    /// The figures.
    pub scenes: Vec<Figures>,
    /// Kinds of boards that the detector says it does not know: they are not judged.
    pub unsupported: Vec<Kind>,
    /// Every check.
    pub checks: Vec<Check>,
    /// Whether all hold.
    pub trusted: bool,
}

impl Report {
    /// For people.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "{}: {} (seed {}, {} photographs a scene)\n",
            self.detector,
            if self.trusted { "trusted" } else { "NOT TRUSTED" },
            self.seed,
            self.photos
        );
        // Writing to a string cannot fail, here and below.
        for &kind in &self.boards {
            let _ = match self.unsupported.contains(&kind) {
                true => writeln!(text, "\n{}: not supported, and not judged", kind.name()),
                false => writeln!(text, "\n{}", self.table(kind)),
            };
        }
        text.push('\n');
        for property in Property::ALL {
            let of: Vec<&Check> = self.checks.iter().filter(|c| c.property == property).collect();
            let judged = of.iter().filter(|check| check.verdict != Verdict::NotJudged).count();
            let failing: Vec<&&Check> = of.iter().filter(|check| check.fails()).collect();
            let _ = match (failing.first(), judged) {
                (_, 0) => writeln!(text, "{:<18} not judged", property.name()),
                (None, _) => writeln!(text, "{:<18} held in {judged} of {judged} scenes", property.name()),
                (Some(first), _) => {
                    writeln!(
                        text,
                        "{:<18} {} in {} of {judged} scenes",
                        property.name(),
                        first.verdict.word(),
                        failing.len()
                    )
                }
            };
            for check in failing {
                let _ =
                    writeln!(text, "    {:<10} {:<14} {}", check.kind.name(), check.scene, check.evidence);
            }
        }
        text
    }

    /// The figures of a kind of board.
    fn table(&self, kind: Kind) -> String {
        let mut text = format!(
            "{:<14} {:>9} {:>6} {:>9} {:>9} {:>9} {:>17} {:>9}",
            kind.name(),
            "found",
            "wrong",
            "rms px",
            "/ bound",
            "worst px",
            "bias px",
            "phase px"
        );
        let number = |value: Option<f64>| value.map_or("-".to_string(), |x| significant(x, 3));
        for f in self.scenes.iter().filter(|f| f.kind == kind) {
            let bias = f
                .bias_px
                .map_or("-".to_string(), |[x, y]| format!("{} {}", significant(x, 2), significant(y, 2)));
            let _ = write!(
                text,
                "\n{:<14} {:>9} {:>6} {:>9} {:>9} {:>9} {:>17} {:>9}",
                f.scene,
                format!("{}/{}", f.found, f.photos),
                f.wrong,
                number(f.rms_px),
                number(f.over_bound),
                number(f.worst_px),
                bias,
                number(f.phase_px)
            );
        }
        text
    }

    /// For programs.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a report has text keys only") + "\n"
    }
}
