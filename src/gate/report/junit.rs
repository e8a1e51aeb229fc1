//! The report for continuous integration: a JUnit test case a check.

use super::Report;
use crate::judge::{Basis, Verdict};
use quick_junit::{NonSuccessKind, TestCase, TestCaseStatus, TestSuite};

impl Report {
    /// JUnit XML: a suite a property, a case a scenario.
    pub fn to_junit(&self) -> String {
        let mut report = quick_junit::Report::new("calibench gate");
        for row in self.rows() {
            let mut suite = TestSuite::new(row.property.name());
            for check in self.checks.iter().filter(|c| c.property == row.property) {
                let evidence = match check.basis {
                    Basis::Chance(p) => format!("{}; p = {p:.3e}", check.evidence),
                    _ => check.evidence.clone(),
                };
                let status = match check.verdict {
                    Verdict::Held | Verdict::Accepted => TestCaseStatus::success(),
                    Verdict::NotJudged => TestCaseStatus::skipped(),
                    Verdict::Failed | Verdict::Grave => {
                        let mut status = TestCaseStatus::non_success(NonSuccessKind::Failure);
                        status.set_message(format!("{}: {evidence}", check.verdict.word()));
                        status
                    }
                };
                let mut case = TestCase::new(check.scenario, status);
                case.set_classname(row.property.name());
                case.set_system_out(evidence);
                suite.add_test_case(case);
            }
            report.add_test_suite(suite);
        }
        // Written to memory: nothing can fail.
        report.to_string().unwrap_or_default()
    }
}
