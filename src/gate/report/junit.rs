//! The report for continuous integration: a JUnit test case a check.

use super::Report;
use crate::judge::{Basis, Check, Verdict};
use std::fmt::Write;

impl Report {
    /// JUnit XML: a suite a property, a case a scenario.
    pub fn to_junit(&self) -> String {
        let mut suites = String::new();
        for row in self.rows() {
            let checks: Vec<&Check> = self.checks.iter().filter(|c| c.property == row.property).collect();
            suites.push_str(&suite(row.property.name(), &checks));
        }
        let every: Vec<&Check> = self.checks.iter().collect();
        let counts = counts(&every);
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"calibench gate\" {counts}>\n{suites}</testsuites>\n"
        )
    }
}

fn suite(name: &str, checks: &[&Check]) -> String {
    let cases: String = checks.iter().map(|check| case(name, check)).collect();
    format!("  <testsuite name=\"{}\" {}>\n{cases}  </testsuite>\n", escaped(name), counts(checks))
}

/// How many there are, as attributes.
fn counts(checks: &[&Check]) -> String {
    let failed = checks.iter().filter(|c| matches!(c.verdict, Verdict::Failed | Verdict::Grave)).count();
    let skipped = checks.iter().filter(|c| matches!(c.verdict, Verdict::NotJudged)).count();
    format!("tests=\"{}\" skipped=\"{skipped}\" failures=\"{failed}\" errors=\"0\"", checks.len())
}

fn case(property: &str, check: &Check) -> String {
    let evidence = match check.basis {
        Basis::Chance(p) => format!("{}; p = {p:.3e}", check.evidence),
        _ => check.evidence.clone(),
    };
    let mut case =
        format!("    <testcase name=\"{}\" classname=\"{}\">\n", escaped(check.scenario), escaped(property));
    let _ = match check.verdict {
        Verdict::Held | Verdict::Accepted => Ok(()),
        Verdict::NotJudged => writeln!(case, "      <skipped/>"),
        Verdict::Failed | Verdict::Grave => {
            let message = escaped(&format!("{}: {evidence}", check.verdict.word()));
            writeln!(case, "      <failure message=\"{message}\"/>")
        }
    };
    let _ = writeln!(case, "      <system-out>{}</system-out>\n    </testcase>", escaped(&evidence));
    case
}

/// Text for XML: its own signs are escaped, and what XML cannot hold is left out.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\n' | '\r' | '\t' => escaped.push_str(&format!("&#{};", u32::from(c))),
            '\0'..' ' | '\u{fffe}' | '\u{ffff}' => {}
            _ => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_solver_says_cannot_break_the_report() {
        assert_eq!(escaped("a<b> & \"c\"\n\u{1b}[0m"), "a&lt;b&gt; &amp; &quot;c&quot;&#10;[0m");
    }

    #[test]
    fn a_property_is_a_suite_that_counts_its_cases() {
        use super::super::tests::{check, report_of};
        use Verdict::{Failed, Grave, Held, NotJudged};
        let checks = [("a", Held), ("b", Failed), ("c", Grave), ("d", NotJudged)];
        let checks = checks.map(|(scene, verdict)| check(scene, verdict, 0.5)).to_vec();
        let xml = report_of(checks, &crate::Terms::default()).to_junit();
        let suite = "<testsuite name=\"bias\" tests=\"4\" skipped=\"1\" failures=\"2\" errors=\"0\">";
        assert!(xml.contains(suite), "{xml}");
        let cases =
            ["a", "b", "c", "d"].map(|scene| format!("<testcase name=\"{scene}\" classname=\"bias\">"));
        assert!(cases.iter().all(|case| xml.contains(case)), "{xml}");
    }
}
