//! What stands on the page of a record? Everything that an experiment found, what computed it, and where the
//! text speaks of it.

use super::evidence::{ExperimentEvidence, RecordItem, RecordProvenance};
use super::format::{self, significant};
use super::golden_file::GoldenFile;
use super::labels::Uses;
use super::page::CompiledPage;
use super::record_summary::{claims_table, page_of, verdict};
use super::sources::Sources;
use super::text::{attribute, inline};
use std::collections::BTreeMap;
use std::fmt::Write;

/// One page an experiment with a snapshot; its numbers, tables and record among the assets.
pub(super) fn record_pages(
    sources: &Sources,
    used: &Uses,
    assets: &mut BTreeMap<String, Vec<u8>>,
) -> Vec<CompiledPage> {
    let mut pages = Vec::new();
    for (id, evidence) in &sources.evidence.experiments {
        let Some(golden) = &evidence.golden else { continue };
        assets.insert(format!("data/{id}/numbers.csv"), numbers_csv(evidence, golden).into_bytes());
        if evidence.record.is_some() {
            assets.insert(format!("data/{id}/record.json"), evidence.record_text.clone().into_bytes());
        }
        for (name, csv) in &evidence.tables {
            assets.insert(format!("data/{id}/{name}.csv"), csv.clone().into_bytes());
        }
        let content = Page { id, evidence, golden, sources, used }.content();
        pages.push(CompiledPage {
            path: page_of(id),
            title: format!("Record: {id}"),
            number: None,
            below: true,
            content,
        });
    }
    pages
}

/// What a page is made from.
struct Page<'a> {
    id: &'a str,
    evidence: &'a ExperimentEvidence,
    golden: &'a GoldenFile,
    sources: &'a Sources,
    used: &'a Uses,
}

impl Page<'_> {
    fn content(&self) -> String {
        let Page { id, evidence, golden, .. } = self;
        let mut page =
            format!("# Record: {id}\n\n**{}.** {}\n\n", inline(&evidence.title), inline(&evidence.question));
        let verdict = verdict(id, evidence, golden);
        let _ = writeln!(page, "`calibench run {id}`, seed {}. {verdict}\n", golden.seed);
        let Some(record) = &evidence.record else { return page + &self.numbers() };
        for note in &record.notes {
            let _ = writeln!(page, "Note: {}\n", inline(note));
        }
        let _ = writeln!(page, "{}\n", self.provenance(&record.provenance));
        let _ = writeln!(page, "## Numbers\n\n{}\n", self.numbers());
        let _ = writeln!(page, "## Claims\n\n{}\n", claims_table(&record.claims, true));
        page.push_str(&self.list("Tables", "tab", &record.tables));
        page.push_str(&self.list("Figures", "fig", &record.figures));
        page
    }

    /// Commit, changes and crates of the program that computed the record.
    fn provenance(&self, from: &RecordProvenance) -> String {
        let commit = match (&from.commit, from.dirty) {
            (Some(hash), Some(true)) => format!("of commit <code>{}</code>, with changes", inline(hash)),
            (Some(hash), _) => format!("of commit <code>{}</code>, without changes", inline(hash)),
            (None, _) => {
                "of a commit that it does not know: it was built outside of its repository".to_string()
            }
        };
        let crates: Vec<String> = from
            .crates
            .iter()
            .map(|(name, version)| format!("{} {}", inline(name), inline(version)))
            .collect();
        let crates =
            if crates.is_empty() { String::new() } else { format!(" Crates: {}.", crates.join(", ")) };
        let inputs: String = from
            .inputs
            .iter()
            .map(|input| {
                format!(" Input: {}, SHA-256 <code>{}</code>.", inline(&input.name), inline(&input.sha256))
            })
            .collect();
        format!(
            "<p id=\"provenance\">Computed by a program {commit}.{crates}{inputs} All of it as the program wrote it: \
             <a href=\"data/{}/record.json\">record.json</a>.</p>",
            self.id
        )
    }

    fn numbers(&self) -> String {
        let Page { id, evidence, golden, .. } = self;
        let mut rows = String::new();
        for (row, n) in golden.numbers.iter().enumerate() {
            let value = significant(n.value, 7);
            let what = inline(evidence.description(&n.id).unwrap_or_default());
            let title = attribute(&format!(
                "{:?}\nseed {}\nrow {} of data/{id}/numbers.csv\ncalibench run {id}\n{}",
                n.value,
                golden.seed,
                row + 1,
                n.reason
            ));
            let (name, band) = (inline(&n.id), inline(&n.band));
            let unit = format::unit(&n.unit);
            let places = self.places(&format!("{id}.{}", n.id));
            let _ = write!(
                rows,
                "<tr id=\"number-{}\" title=\"{title}\"><td><code>{name}</code></td><td class=\"value\">{value}{unit}</td>\
                 <td>{band}</td><td>{what}</td><td>{places}</td></tr>",
                n.id
            );
        }
        let head = "<thead><tr><th>number</th><th>value</th><th>band</th><th>what</th><th>in the text</th></tr></thead>";
        let csv = format!("<a href=\"data/{id}/numbers.csv\">numbers.csv</a>");
        format!(
            "<div class=\"table-wrapper\"><table class=\"numbers\"><caption>Locked numbers ({csv})</caption>{head}<tbody>{rows}</tbody></table></div>"
        )
    }

    /// Links to where the text shows something.
    fn places(&self, what: &str) -> String {
        let links = self.used.get(what).into_iter().flatten().map(|link| {
            let path = link.split('#').next().unwrap_or_default();
            let page = self.sources.pages.iter().find(|page| page.path == path);
            let words = match page {
                Some(page) if page.number.is_some() => format!("section {}", page.number.unwrap_or_default()),
                Some(page) => inline(&page.title),
                None => "text".to_string(),
            };
            format!("<a href=\"{link}\">{words}</a>")
        });
        links.collect::<Vec<_>>().join(", ")
    }

    /// Tables or figures with their captions and where the text shows them.
    fn list(&self, heading: &str, class: &str, items: &[RecordItem]) -> String {
        if items.is_empty() {
            return String::new();
        }
        let mut list = format!("## {heading}\n\n");
        for item in items {
            let name = item.file.rsplit_once('.').map_or(item.file.as_str(), |(stem, _)| stem);
            let places = match self.places(&format!("{class}:{}.{name}", self.id)) {
                places if places.is_empty() => places,
                places => format!(" ({places})"),
            };
            let folder = if class == "tab" { "data" } else { "figures" };
            let (id, file) = (self.id, &item.file);
            let _ = writeln!(
                list,
                "- <a href=\"{folder}/{id}/{file}\">{file}</a>{places}: {}",
                inline(&item.caption)
            );
        }
        list + "\n"
    }
}

fn numbers_csv(evidence: &ExperimentEvidence, golden: &GoldenFile) -> String {
    let quoted = |text: &str| format!("\"{}\"", text.replace('"', "\"\""));
    let mut csv = String::from("id,value,unit,band,band_reason,description\n");
    for n in &golden.numbers {
        let description = evidence.description(&n.id).unwrap_or_default();
        let (unit, band) = (quoted(&n.unit), quoted(&n.band));
        let _ = writeln!(
            csv,
            "{},{:?},{unit},{band},{},{}",
            n.id,
            n.value,
            quoted(&n.reason),
            quoted(description)
        );
    }
    csv
}
