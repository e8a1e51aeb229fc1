//! The report as one page that needs nothing else.

use super::{Report, Row};
use crate::judge::{Basis, Verdict};
use calibench::io::significant;
use std::fmt::Write;

const STYLE: &str = "body{font:15px/1.45 system-ui,sans-serif;max-width:76rem;margin:2rem auto;padding:0 1rem;color:#1a1a1a;\
background:#fff}table{border-collapse:collapse;width:100%}th,td{text-align:left;padding:.25rem .6rem;border-bottom:1px solid \
#ddd;vertical-align:top}th{font-weight:600}td.n,th.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}\
.sum{padding:.6rem .9rem;border-left:.4rem solid #2b8a3e;background:#f2f8f3}.sum.bad{border-color:#b00020;background:#fcf1f1}\
.GRAVE{background:#b00020;color:#fff}.FAILED{background:#c94a00;color:#fff}.held{color:#2b8a3e}.not{color:#666}\
.accepted{color:#8a5a00}b.v{padding:.05rem .4rem;border-radius:.2rem;white-space:nowrap}small{color:#555}td{overflow-wrap:\
anywhere}td:first-child{white-space:nowrap}details{margin:.4rem 0}summary{cursor:pointer}a{color:inherit}\
@media(prefers-color-scheme:dark){body{background:#16181b;color:#e4e4e4}th,td{border-color:#3a3d42}.held{color:#69db7c}\
.not,small{color:#a5a5a5}.accepted{color:#f0b040}.sum{background:#1d2a20}.sum.bad{background:#2d1c1e}}";

impl Report {
    /// Self-contained HTML: the conclusion, a row a property, every check behind it, and what the scenarios
    /// are.
    pub fn to_html(&self) -> String {
        let mut page = format!(
            "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" \
             content=\"width=device-width\"><title>calibench gate: {0}</title><style>{STYLE}</style>\n<h1>calibench gate</h1>\n\
             <p class=\"sum{1}\"><b>{2}</b></p>\n<p>Solver <code>{0}</code>; {3} problems, {4} samples a scenario, seed {5}, {6} s{8}; \
             gate at commit {7}.</p>\n",
            escape(&self.solver),
            if self.held() { "" } else { " bad" },
            escape(&self.conclusion()),
            self.problems,
            self.samples,
            self.seed,
            significant(self.seconds, 3),
            escape(self.commit.as_deref().unwrap_or("unknown")),
            self.program_ended(),
        );
        page.push_str(
            "<p>Per property the worst check, or else the least probable. A p-value is the chance that a correct solver shows \
             evidence at least as strong; all of them share the stated rate of false alarms. A grave failure is a confident \
             wrong answer: nothing warns the user. What a solver does not state is not judged.</p>\n\
             <table><tr><th>property<th>verdict<th class=n>hold<th>what should hold, and what was seen</tr>\n",
        );
        for row in self.rows() {
            let (held, judged) = row.held;
            let count = if judged == 0 { "&ndash;".to_string() } else { format!("{held} / {judged}") };
            // Writing to a string cannot fail.
            let _ = writeln!(
                page,
                "<tr><td><a href=\"#{0}\">{0}</a><td>{1}<td class=n>{count}<td>{2}<br><small>{3}</small></tr>",
                row.property.name(),
                badge(row.verdict),
                escape(row.property.meaning()),
                escape(&row.told()),
            );
        }
        page.push_str("</table>\n");
        for allowed in &self.allowances {
            let _ = writeln!(page, "<p>Allowed: {}</p>", escape(&allowed.told()));
        }
        self.assumptions_of(&mut page);
        page.push_str("<h2>Every check</h2>\n");
        self.rows().iter().for_each(|row| self.checks_of(row, &mut page));
        page.push_str("<h2>Scenarios</h2>\n<table>\n");
        for scenario in &self.scenarios {
            let _ = writeln!(page, "<tr><td>{}<td>{}</tr>", scenario.name, escape(&scenario.about));
        }
        page.push_str("</table>\n</html>\n");
        page
    }

    /// The table of scenes whose world is not the model.
    fn assumptions_of(&self, page: &mut String) {
        if self.assumptions.is_empty() {
            return;
        }
        page.push_str(
            "<h2>Where the world is not the model</h2>\n<p>Visible: the share of samples whose residuals show it to ordinary tests. \
             Flagged: refused, or answered with a warning. Errors are told in stated standard deviations, of the parameter that is \
             covered least.</p>\n<table><tr><th>scenario<th>what is left out<th class=n>visible<th class=n>flagged<th>errors over \
             stated deviations</tr>\n",
        );
        for row in &self.assumptions {
            let errors = row.errors_told();
            let _ = writeln!(
                page,
                "<tr><td>{}<td>{}<td class=n>{} %<td class=n>{} / {}<td>{errors}</tr>",
                row.scenario,
                escape(row.about),
                significant(100.0 * row.seen_in_residuals, 3),
                row.flagged,
                row.samples,
            );
        }
        page.push_str("</table>\n");
    }

    fn checks_of(&self, row: &Row<'_>, page: &mut String) {
        let (held, judged) = row.held;
        let hold =
            if judged == 0 { "told, not judged".to_string() } else { format!("{held} of {judged} hold") };
        let _ = writeln!(
            page,
            "<details id=\"{0}\"{1}><summary>{2} <b>{0}</b> &ndash; {hold}</summary>\n<table><tr><th>scenario<th>verdict\
             <th class=n>problems<th class=n>p<th>evidence</tr>",
            row.property.name(),
            if row.verdict >= Verdict::Failed { " open" } else { "" },
            badge(row.verdict),
        );
        for check in self.checks.iter().filter(|c| c.property == row.property) {
            let p = match check.basis {
                Basis::Chance(p) => significant(p, 2),
                _ => "&ndash;".to_string(),
            };
            let _ = writeln!(
                page,
                "<tr><td>{}<td>{}<td class=n>{}<td class=n>{p}<td>{}</tr>",
                check.scenario,
                badge(check.verdict),
                check.problems,
                escape(&check.evidence)
            );
        }
        page.push_str("</table></details>\n");
    }
}

fn badge(verdict: Verdict) -> String {
    format!("<b class=\"v {0}\">{0}</b>", verdict.word())
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::super::tests::{check, report_of};
    use crate::judge::{Terms, Verdict};

    #[test]
    fn the_page_has_every_check_with_its_evidence() {
        let checks = vec![check("a", Verdict::Held, 0.25), check("b", Verdict::Failed, 1e-9)];
        let page = report_of(checks, &Terms::default()).to_html();
        for seen in ["&lt;seen on a&gt;", "&lt;seen on b&gt;"] {
            assert!(page.contains(&format!("<td>{seen}</tr>")), "{seen} in {page}");
        }
        assert!(page.contains("1 of 2 hold") && page.contains("0.25"), "{page}");
    }
}
