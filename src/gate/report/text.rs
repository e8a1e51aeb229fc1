//! The report on one screen.

use super::{Report, Row};
use crate::judge::{Basis, Check, Property, Verdict};
use calibench::io::significant;
use std::collections::BTreeMap;

/// Columns where nothing tells how wide the screen is.
pub const COLUMNS: usize = 132;
/// Columns before the evidence, which is cut where the screen ends.
const BEFORE_EVIDENCE: usize = 38;

impl Report {
    /// One line a property, no longer than `columns`, then what follows.
    pub fn to_text(&self, columns: usize) -> String {
        let mut text = format!(
            "gate: {} on {} problems, {} samples a scenario, seed {}, {} s{}\nlens models: {}{}\n\n",
            self.solver,
            self.problems,
            self.samples,
            self.seed,
            significant(self.seconds, 3),
            self.program_ended(),
            self.models.join(", "),
            if self.only.is_empty() { String::new() } else { format!("; only {}", self.only.join(", ")) },
        );
        for row in self.rows() {
            text.push_str(&line(&row, columns));
        }
        text.push_str(&self.assumptions_table(columns));
        text.push_str(&format!("\n{}\n{}", self.conclusion(), self.allowances_told()));
        text
    }

    /// What the solver says where the world is not the model, a line a scene.
    fn assumptions_table(&self, columns: usize) -> String {
        if self.assumptions.is_empty() {
            return String::new();
        }
        let mut text = format!(
            "\n{:<22} {:>9} {:>9}  {:<32} what is left out\n",
            "where the model fails", "visible", "flagged", "errors over stated deviations"
        );
        for row in &self.assumptions {
            let errors = row.errors_told();
            let line = format!(
                "{:<22} {:>7} % {:>9}  {errors:<32} {}",
                row.scenario,
                significant(100.0 * row.seen_in_residuals, 3),
                format!("{}/{}", row.flagged, row.samples),
                row.about
            );
            text.push_str(&format!("{}\n", cut(line, columns)));
        }
        text
    }

    /// The last line.
    pub fn conclusion(&self) -> String {
        let failures = self.failures();
        let rate = format!(
            "by chance a correct solver fails one run in {} ({} statistical checks, Holm)",
            significant(1.0 / self.false_alarm_rate, 3),
            self.statistical_checks
        );
        let accepted = self.accepted();
        let unsupported = match &self.unsupported[..] {
            [] => String::new(),
            scenes => format!(", not supported: {}", scenes.join(", ")),
        };
        match self.verdict {
            Verdict::Grave | Verdict::Failed => {
                let grave = failures.iter().filter(|c| c.verdict == Verdict::Grave).count();
                let fail = if failures.len() == 1 { "check fails" } else { "checks fail" };
                format!("NOT TRUSTED: {} {fail}, {grave} gravely{unsupported}; {rate}", failures.len())
            }
            _ if !self.only.is_empty() => {
                format!(
                    "HELD on the scenes asked, which is no verdict on the whole{accepted}{unsupported}; {rate}"
                )
            }
            _ => {
                format!("TRUSTED: every check that could be judged holds{accepted}{unsupported}; {rate}")
            }
        }
    }

    /// What fails and is known: stated in a file, or accepted as a whole.
    fn accepted(&self) -> String {
        let stated = self.allowances.iter().filter(|allowed| !allowed.needed_by.is_empty()).count();
        let of_files: usize = self.allowances.iter().map(|allowed| allowed.needed_by.len()).sum();
        let all = self.checks.iter().filter(|c| c.verdict == Verdict::Accepted).count();
        let stated = match stated {
            0 => String::new(),
            1 => ", with one stated allowance".to_string(),
            count => format!(", with {count} stated allowances"),
        };
        match all.saturating_sub(of_files) {
            0 => stated,
            1 => format!("{stated}, but for one that was accepted"),
            count => format!("{stated}, but for {count} that were accepted"),
        }
    }

    /// The stated allowances, a line each.
    fn allowances_told(&self) -> String {
        let told = self.allowances.iter().map(|allowed| format!("allowed: {}\n", allowed.told()));
        told.collect()
    }

    /// The failing checks, property by property in the order in which one causes another: the first in full,
    /// the others by scenario.
    pub fn details(&self) -> String {
        let mut groups: BTreeMap<(Property, Verdict), Vec<&Check>> = BTreeMap::new();
        for check in self.failures() {
            groups.entry((check.property, check.verdict)).or_default().push(check);
        }
        groups.values().map(|checks| finding(checks)).collect()
    }
}

/// What one property does wrong, and how its first scene is asked again.
fn finding(checks: &[&Check]) -> String {
    let first = checks[0];
    let p = match first.basis {
        Basis::Chance(p) => format!(" (p = {})", significant(p, 2)),
        _ => String::new(),
    };
    let (verdict, property) = (first.verdict.word(), first.property.name());
    let mut text = format!("{verdict} {property} / {}: {}{p}\n", first.scenario, first.evidence);
    let others: Vec<&str> = checks[1..].iter().map(|c| c.scenario).collect();
    if !others.is_empty() {
        text.push_str(&format!("    likewise {}\n", others.join(", ")));
    }
    if let Some(repeat) = &first.repeat {
        text.push_str(&format!("    again: {repeat}\n"));
    }
    text
}

impl Row<'_> {
    /// The check to tell about, with its scenario and probability.
    pub fn told(&self) -> String {
        let p = match self.telling.basis {
            Basis::Chance(p) => format!(" p={}", significant(p, 1)),
            _ => String::new(),
        };
        format!("{}{p}: {}", self.telling.scenario, self.telling.evidence)
    }
}

/// A text that is no longer than `room`.
fn cut(text: String, room: usize) -> String {
    match text.chars().count() > room {
        true => text.chars().take(room.saturating_sub(1)).chain(['…']).collect(),
        false => text,
    }
}

fn line(row: &Row<'_>, columns: usize) -> String {
    let (held, judged) = row.held;
    let count = if judged == 0 { "-".to_string() } else { format!("{held}/{judged}") };
    let told = row.told();
    let evidence = cut(told, columns.saturating_sub(BEFORE_EVIDENCE));
    format!("{:<18} {:<10} {count:>6}  {evidence}\n", row.property.name(), row.verdict.word())
}

#[cfg(test)]
mod tests {
    use super::super::tests::{check, report_of};
    use crate::allowances::Allowance;
    use crate::judge::{Check, Terms, Verdict};
    use Verdict::{Failed, Held, NotJudged};

    fn text(checks: Vec<Check>) -> String {
        report_of(checks, &Terms::default()).to_text(200)
    }

    #[test]
    fn checks_that_hold_are_counted_of_those_that_were_judged() {
        let line = |checks: Vec<Check>| {
            let text = text(checks);
            text.lines().find(|line| line.starts_with("bias ")).unwrap().to_string()
        };
        let judged = line(vec![check("a", Failed, 1e-9), check("b", Held, 0.5), check("c", NotJudged, 1.0)]);
        assert!(judged.contains(" 1/2  ") && judged.contains("<seen on a>"), "{judged}");
        let unjudged = line(vec![check("a", NotJudged, 1.0)]);
        assert!(unjudged.contains(" -  ") && unjudged.contains("<seen on a>"), "{unjudged}");
    }

    #[test]
    fn the_last_line_counts_the_checks_that_fail() {
        let one = text(vec![check("a", Failed, 1e-9), check("b", Held, 0.5)]);
        assert!(one.contains("NOT TRUSTED: 1 check fails, 0 gravely"), "{one}");
        let two = text(vec![check("a", Failed, 1e-9), check("b", Verdict::Grave, 1e-9)]);
        assert!(two.contains("NOT TRUSTED: 2 checks fail, 1 gravely"), "{two}");
    }

    #[test]
    fn a_finding_has_its_chance_and_the_other_scenes() {
        let failed = vec![check("a", Failed, 1.2e-7), check("b", Failed, 1e-9)];
        let details = report_of(failed, &Terms::default()).details();
        assert!(details.contains("<seen on a> (p = 1.2e-7)") && details.contains("likewise b"), "{details}");
    }

    #[test]
    fn stated_allowances_are_told_with_their_reasons() {
        let allowances = Allowance::of_toml("[[allow]]\nproperty = 'bias'\nreason = 'known for long'\n");
        let terms = Terms { allowances: allowances.unwrap(), ..Terms::default() };
        let text = report_of(vec![check("a", Held, 0.5)], &terms).to_text(200);
        assert!(text.contains("known for long"), "{text}");
    }
}
