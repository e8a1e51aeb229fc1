//! The report as one page that needs nothing else.

use super::Report;
use crate::harness::gate::judge::{Basis, Verdict};
use crate::harness::significant;

const STYLE: &str = "body{font:15px/1.45 system-ui,sans-serif;max-width:70rem;margin:2rem auto;padding:0 1rem;color:#1a1a1a;\
background:#fff}table{border-collapse:collapse;width:100%}th,td{text-align:left;padding:.25rem .6rem;border-bottom:1px solid \
#ddd;vertical-align:top}td.n{text-align:right;font-variant-numeric:tabular-nums}.GRAVE{background:#b00020;color:#fff}\
.FAILED{background:#e8590c;color:#fff}.held{color:#2b8a3e}.not{color:#777}.accepted{color:#9c6500}b.v{padding:.05rem .4rem;\
border-radius:.2rem;white-space:nowrap}details{margin:.4rem 0}summary{cursor:pointer}@media(prefers-color-scheme:dark){\
body{background:#16181b;color:#e4e4e4}th,td{border-color:#3a3d42}.held{color:#69db7c}}";

impl Report {
    /// Self-contained HTML: the conclusion, a row a property, every check behind it.
    pub fn to_html(&self) -> String {
        let mut page = format!(
            "<!doctype html>\n<html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" \
             content=\"width=device-width\"><title>calibench gate</title><style>{STYLE}</style>\n<h1>calibench gate</h1>\n\
             <p><b>{}</b></p>\n<p>Solver <code>{}</code>; {} problems, {} samples a scenario, seed {}, {} s; gate at commit {}.</p>\n",
            escape(&self.conclusion()),
            escape(&self.solver),
            self.problems,
            self.samples,
            self.seed,
            significant(self.seconds, 3),
            escape(self.commit.as_deref().unwrap_or("unknown")),
        );
        page.push_str("<p>A p-value is the chance that a correct solver shows evidence at least as strong. A grave failure is a \
                       confident wrong answer: nothing warns the user.</p>\n");
        for row in self.rows() {
            let (held, judged) = row.held;
            page.push_str(&format!(
                "<details{}><summary>{} <b>{}</b> &ndash; {held} of {judged} hold</summary>\n<table><tr><th>scenario<th>verdict\
                 <th>problems<th>p<th>evidence</tr>\n",
                if row.verdict >= Verdict::Failed { " open" } else { "" },
                badge(row.verdict),
                row.property.name(),
            ));
            for check in self.checks.iter().filter(|c| c.property == row.property) {
                let p = match check.basis {
                    Basis::Chance(p) => significant(p, 2),
                    _ => "&ndash;".to_string(),
                };
                page.push_str(&format!(
                    "<tr><td>{}<td>{}<td class=n>{}<td class=n>{p}<td>{}</tr>\n",
                    check.scenario,
                    badge(check.verdict),
                    check.problems,
                    escape(&check.evidence)
                ));
            }
            page.push_str("</table></details>\n");
        }
        page.push_str("</html>\n");
        page
    }
}

fn badge(verdict: Verdict) -> String {
    format!("<b class=\"v {0}\">{0}</b>", verdict.word())
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
