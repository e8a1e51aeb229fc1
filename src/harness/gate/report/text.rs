//! The report on one screen.

use super::{Report, Row};
use crate::harness::gate::judge::{Basis, Verdict};
use crate::harness::significant;

/// Characters of evidence on a line.
const EVIDENCE: usize = 92;

impl Report {
    /// One line a property, then what fails.
    pub fn to_text(&self) -> String {
        let mut text = format!(
            "gate: {} on {} problems, {} samples a scenario, seed {}, {} s\n\n",
            self.solver,
            self.problems,
            self.samples,
            self.seed,
            significant(self.seconds, 3)
        );
        for row in self.rows() {
            text.push_str(&line(&row));
        }
        text.push_str(&format!("\n{}\n", self.conclusion()));
        text
    }

    /// The last line.
    pub fn conclusion(&self) -> String {
        let failures = self.failures();
        let rate = format!(
            "a correct solver fails {} runs of 100000 ({} statistical checks, Holm)",
            significant(1e5 * self.false_alarm_rate, 3),
            self.statistical_checks
        );
        match self.verdict {
            Verdict::Grave | Verdict::Failed => {
                let grave = failures.iter().filter(|c| c.verdict == Verdict::Grave).count();
                format!("NOT TRUSTED: {} checks fail, {grave} of them gravely; {rate}", failures.len())
            }
            _ => format!("TRUSTED: every check that could be judged holds; {rate}"),
        }
    }

    /// Every failing check in full.
    pub fn details(&self) -> String {
        let line = |c: &&crate::harness::gate::Check| {
            let p = match c.basis {
                Basis::Chance(p) => format!(" (p = {})", significant(p, 2)),
                _ => String::new(),
            };
            format!("{} {} / {}: {}{p}\n", c.verdict.word(), c.property.name(), c.scenario, c.evidence)
        };
        self.failures().iter().map(line).collect()
    }
}

fn line(row: &Row<'_>) -> String {
    let (held, judged) = row.held;
    let count = if judged == 0 { "-".to_string() } else { format!("{held}/{judged}") };
    let p = match row.telling.basis {
        Basis::Chance(p) => format!(" p={}", significant(p, 1)),
        _ => String::new(),
    };
    let full = format!("{}{p}: {}", row.telling.scenario, row.telling.evidence);
    let evidence: String = full.chars().take(EVIDENCE).collect();
    format!("{:<18} {:<10} {count:>6}  {evidence}\n", row.property.name(), row.verdict.word())
}
