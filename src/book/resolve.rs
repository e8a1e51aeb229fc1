//! What does a placeholder stand for? One function a verb; an error says what is missing and what to do.

use super::constants::constant;
use super::contradictions::Contradiction;
use super::csv_table::csv_table;
use super::evidence::ExperimentEvidence;
use super::finding::Finding;
use super::golden_file::{GoldenFigure, GoldenFile, GoldenNumber};
use super::labels::{Labels, Uses};
use super::scan::{Kind, scan};
use super::sources::{CONTRADICTIONS, ITEMS, REFERENCES, Sources};
use super::text::{attribute, escape, inline, sentence};
use super::{
    appendix, contradictions, format, items, laboratory, layout, listing, picture, record_summary, references,
};
use calibench::io::hash::sha256_hex;
use calibench_harness::published::Entry;
use std::collections::{BTreeMap, BTreeSet};

/// Resolves placeholders and remembers what was used.
pub(super) struct Resolver<'a> {
    sources: &'a Sources,
    pub labels: Labels,
    pub assets: BTreeMap<String, Vec<u8>>,
    /// The page whose pieces are being resolved.
    pub page: String,
    cited: BTreeSet<String>,
    shown: BTreeSet<String>,
    /// Contradictions declared so far, with their pages.
    declared: BTreeMap<String, String>,
    /// Where the text shows a number, `<experiment>.<number>`: links to its first place on each page.
    pub used: Uses,
}

type Resolved = Result<String, String>;

/// Figures wider than this have panels side by side, CSS pixels; a single plot is 560 wide.
const WIDE_PX: f64 = 700.0;

impl<'a> Resolver<'a> {
    pub(super) fn new(sources: &'a Sources, labels: Labels) -> Resolver<'a> {
        Resolver {
            sources,
            labels,
            assets: BTreeMap::new(),
            page: String::new(),
            cited: BTreeSet::new(),
            shown: BTreeSet::new(),
            declared: BTreeMap::new(),
            used: Uses::new(),
        }
    }

    /// The text of a placeholder, which may be the first of a sentence.
    pub(super) fn resolve(&mut self, placeholder: &str, begins_sentence: bool) -> Resolved {
        let words: Vec<&str> = placeholder.split_whitespace().collect();
        match words.as_slice() {
            ["num", id, options @ ..] => self.number(id, options),
            ["published", id] => self.published(id),
            ["const", name] => constant(name).ok_or_else(|| format!("`{name}` is no constant of the scene")),
            ["figure", id, seen @ ..] => self.figure(id, &seen.join(" ")),
            ["lab", name] => laboratory::place(name, &self.sources.evidence),
            ["table", id, columns, options @ ..] => self.table(id, columns, options),
            ["caption", label, ..] => self.caption(label, placeholder),
            ["claims", experiment] => self.claims(experiment),
            ["run", experiment] => self.command(experiment),
            ["code", file, item] => self.code(file, item),
            ["shell", file, command @ ..] => self.shell(file, &command.join(" ")),
            ["cite", key] => self.cite(key, false),
            ["citep", key] => self.cite(key, true),
            ["ref", label] => self.refer(label, begins_sentence),
            ["contradiction", id] => self.contradiction(id),
            ["all-contradictions"] => self.contradictions(),
            ["item-counts"] => Ok(items::counts(&self.sources.items)),
            ["all-items"] => self.items(),
            ["published-counts"] => Ok(appendix::published_counts(self.sources)),
            ["all-published"] => Ok(appendix::published_table(self.sources)),
            ["all-records"] => Ok(appendix::record_list(self.sources)),
            ["all-references"] => Ok(references::list(&self.sources.references)),
            _ => Err(format!("placeholder `{placeholder}` is not understood")),
        }
    }

    fn experiment(&self, id: &str) -> Result<&'a ExperimentEvidence, String> {
        self.sources.evidence.experiments.get(id).ok_or_else(|| format!("there is no experiment `{id}`"))
    }

    fn golden(&self, id: &str) -> Result<(&'a ExperimentEvidence, &'a GoldenFile), String> {
        let evidence = self.experiment(id)?;
        let golden = evidence.golden.as_ref();
        let golden =
            golden.ok_or_else(|| format!("experiment `{id}` has no snapshot: `calibench bless {id}`"))?;
        Ok((evidence, golden))
    }

    /// A golden number with its provenance on it.
    fn number(&mut self, id: &str, options: &[&str]) -> Resolved {
        let (experiment, name) = split(id)?;
        let (evidence, golden) = self.golden(experiment)?;
        let (row, number) = golden.number(name).ok_or_else(|| {
            format!("experiment `{experiment}` has no number `{name}`; it has: {}", names(golden))
        })?;
        let mut how = "s4";
        let mut unit = String::new();
        for option in options {
            match *option {
                "unit" => unit = format::unit(&number.unit),
                other => how = other,
            }
        }
        let percent = how.starts_with('%');
        let text = format::format(number.value, how)
            .ok_or_else(|| format!("`{how}` is no format: .4, s3, e1 or %1"))?;
        let unit = if percent { "\u{a0}%" } else { &unit };
        let held = evidence.published(name).is_none_or(|p| p.book_held && p.ours_held);
        let class = if held { "num" } else { "num deviates" };
        let title = attribute(&provenance(experiment, evidence, golden, row, number));
        let href = format!("{}#number-{name}", record_summary::page_of(experiment));
        let place = self.place_in_text(id);
        Ok(format!(r#"<a class="{class}"{place} href="{href}" title="{title}">{text}{unit}</a>"#))
    }

    /// The name of a number's first place on this page, noted so that its record can lead there.
    fn place_in_text(&mut self, id: &str) -> String {
        let name = format!("at-{id}");
        let link = format!("{}#{name}", self.page);
        let places = self.used.entry(id.to_string()).or_default();
        if places.contains(&link) {
            return String::new();
        }
        places.push(link);
        format!(r#" id="{name}""#)
    }

    fn published(&self, id: &str) -> Resolved {
        let entry = self.sources.published.iter().find(|e| e.id == id);
        let entry: &Entry = entry.ok_or_else(|| format!("golden/published.toml has no value `{id}`"))?;
        let text = format::typeset(entry.printed.trim_start_matches('+'));
        let unit = format::unit(&entry.unit);
        let title = attribute(&format!(
            "printed in the chapter, section {}: {} {}\n{}\nverdict: {}",
            entry.section,
            entry.printed,
            entry.unit,
            entry.what,
            entry.kind.name()
        ));
        let href = format!("published.md#published-{}", entry.id);
        Ok(format!(r#"<a class="num printed" href="{href}" title="{title}">{text}{unit}</a>"#))
    }

    /// `seen` describes it to those who do not see it.
    fn figure(&mut self, id: &str, seen: &str) -> Resolved {
        let (experiment, name) = split(id)?;
        let (evidence, golden) = self.golden(experiment)?;
        let locked = golden.figures.iter().find(|f| stem(&f.file) == name);
        let GoldenFigure { file, hash, .. } =
            locked.ok_or_else(|| format!("experiment `{experiment}` draws no figure `{name}`"))?;
        let path = format!("figures/{experiment}/{file}");
        let bytes = self
            .sources
            .project
            .read(&path)
            .map_err(|e| format!("figure {path}: {e}; run `calibench run {experiment}`"))?;
        if hash.strip_prefix("sha256 ").is_some_and(|digits| !sha256_hex(&bytes).starts_with(digits)) {
            return Err(format!("figure {path} is stale: run `calibench run {experiment}`"));
        }
        if seen.is_empty() {
            return Err(format!(
                "figure `{id}`: say behind its name what is seen, for those who do not see it"
            ));
        }
        // Several panels side by side are too small on a phone to be shrunk to its width: there they scroll.
        let size = picture::size(&bytes);
        let class = if size.is_some_and(|(width, _)| width > WIDE_PX) { " class=\"wide\"" } else { "" };
        let size = size.map_or(String::new(), |(w, h)| format!(" width=\"{w}\" height=\"{h}\""));
        self.assets.insert(path.clone(), bytes);
        self.shown.insert(id.to_string());
        self.used.insert(format!("fig:{id}"), vec![format!("{}#fig:{id}", self.page)]);
        let caption = inline(evidence.caption(file).unwrap_or_default());
        let seen = attribute(seen);
        let number = self.labels.get(&format!("fig:{id}")).map_or(String::new(), |l| l.number.clone());
        let command = command_line(experiment, golden);
        Ok(format!(
            "<figure id=\"fig:{id}\"{class}><div class=\"drawing\"><img src=\"{path}\" alt=\"{seen}\"{size}></div><figcaption><b>{number}.</b> {caption} {command}\
             </figcaption></figure>\n"
        ))
    }

    fn table(&mut self, id: &str, columns: &str, options: &[&str]) -> Resolved {
        let (experiment, name) = split(id)?;
        let (evidence, golden) = self.golden(experiment)?;
        if golden.tables.iter().all(|(table, _)| table != name) {
            return Err(format!("experiment `{experiment}` has no table `{name}`"));
        }
        let csv = evidence.tables.get(name);
        let csv =
            csv.ok_or_else(|| format!("table `{id}` is not in the last run: `calibench run {experiment}`"))?;
        let path = format!("data/{experiment}/{name}.csv");
        self.assets.insert(path.clone(), csv.clone().into_bytes());
        let label = format!("tab:{id}");
        let number = self.labels.get(&label).map_or(String::new(), |l| l.number.clone());
        self.used.insert(label.clone(), vec![format!("{}#{label}", self.page)]);
        let caption = inline(&sentence(evidence.caption(&format!("{name}.csv")).unwrap_or_default()));
        let command = command_line(experiment, golden);
        let body = csv_table(csv, columns, options, &path)?;
        Ok(format!(
            "<div class=\"caption\" id=\"{label}\"><b>{number}.</b> {caption} (<a href=\"{path}\">CSV</a>) {command}</div>\n\
             <div class=\"table-wrapper\"><table>{body}</table></div>\n"
        ))
    }

    /// The caption of a table that the page itself lays out below it.
    fn caption(&self, label: &str, placeholder: &str) -> Resolved {
        let number = self.labels.get(label).map_or("", |l| l.number.as_str());
        let text = placeholder.split_once(label).map_or("", |(_, text)| text.trim());
        Ok(format!("<div class=\"caption\" id=\"{label}\"><b>{number}.</b> {}</div>\n", inline(text)))
    }

    fn claims(&self, experiment: &str) -> Resolved {
        let (evidence, _) = self.golden(experiment)?;
        let record = evidence.record.as_ref();
        let record = record
            .ok_or_else(|| format!("claims of `{experiment}`: run `calibench run {experiment}` first"))?;
        Ok(record_summary::claims_table(&record.claims, false))
    }

    fn command(&self, experiment: &str) -> Resolved {
        let (evidence, golden) = self.golden(experiment)?;
        let verdict = record_summary::verdict(experiment, evidence, golden);
        let href = record_summary::page_of(experiment);
        Ok(format!(
            "<div class=\"run\"><b>Reproduce it:</b> <code>calibench run {experiment}</code> (seed {}). {verdict} \
             <a href=\"{href}\">All it found</a>.</div>\n",
            golden.seed
        ))
    }

    fn code(&mut self, file: &str, item: &str) -> Resolved {
        let source = self.sources.project.read_text(file).map_err(|e| format!("code {file}: {e}"))?;
        let (line, text) =
            listing::item(&source, item).ok_or_else(|| format!("{file} has no item `{item}`"))?;
        let page = format!("code/{}.html", file.replace('/', "-"));
        self.assets.entry(page.clone()).or_insert_with(|| layout::source(file, &source).into_bytes());
        Ok(format!(
            "<div class=\"listing\"><a href=\"{page}#L{line}\">{}, line {line}</a></div>\n\n```rust,ignore\n{text}\n```\n",
            escape(file)
        ))
    }

    /// A command and what it prints, as another text of the project shows them.
    fn shell(&self, file: &str, command: &str) -> Resolved {
        let source = self.sources.project.read_text(file).map_err(|e| format!("shell {file}: {e}"))?;
        let shown = listing::shell(&source, command)
            .ok_or_else(|| format!("{file} has no block that begins with `$ {command}`"))?;
        Ok(format!("```text\n{shown}\n```\n"))
    }

    fn cite(&mut self, key: &str, parenthetical: bool) -> Resolved {
        let reference = self.sources.references.iter().find(|r| r.key == key);
        let reference = reference.ok_or_else(|| format!("book/references.toml has no `{key}`"))?;
        self.cited.insert(key.to_string());
        Ok(reference.link(parenthetical))
    }

    fn refer(&mut self, name: &str, begins_sentence: bool) -> Resolved {
        let label = self.labels.refer(name).ok_or_else(|| format!("nothing is named `{name}`"))?;
        let words = if begins_sentence { sentence(&label.words) } else { label.words.clone() };
        Ok(format!(r##"<a class="ref" href="{}#{name}">{words}</a>"##, label.page))
    }

    fn contradiction(&mut self, id: &str) -> Resolved {
        let entry = self.sources.contradictions.iter().find(|c| c.id == id);
        let entry = entry.ok_or_else(|| format!("{CONTRADICTIONS} has no `{id}`"))?;
        if let Some(page) = self.declared.insert(id.to_string(), self.page.clone()) {
            return Err(format!("contradiction `{id}` is declared on {page} already"));
        }
        Ok(contradictions::declared(entry, &self.within(&entry.found)?, &self.shown_by(entry)?))
    }

    fn contradictions(&mut self) -> Resolved {
        let mut rows = String::new();
        for entry in &self.sources.contradictions {
            let page = self.declared.get(&entry.id).cloned();
            let page = page.ok_or_else(|| format!("contradiction `{}` is not declared above", entry.id))?;
            let (found, shown_by) = (self.within(&entry.found)?, self.shown_by(entry)?);
            rows.push_str(&contradictions::row(entry, &found, &shown_by, &page));
        }
        Ok(contradictions::table(&rows))
    }

    fn items(&mut self) -> Resolved {
        let mut rows = String::new();
        for item in &self.sources.items {
            let shown: Result<Vec<String>, String> = item.places.iter().map(|p| self.place(p)).collect();
            let shown = shown.map_err(|e| format!("line {} of {ITEMS}: {e}", item.line))?;
            rows.push_str(&items::row(item, &shown.join(", ")));
        }
        Ok(items::table(&rows))
    }

    /// A link to what shows an item of the chapter.
    fn place(&mut self, place: &str) -> Resolved {
        let (kind, name) = place.split_once(' ').ok_or_else(|| format!("`{place}` is no place"))?;
        match kind {
            "claim" => self.claim(name),
            "published" => self.published(name),
            "figure" => self.refer(&format!("fig:{name}"), true),
            "cite" => self.cite(name, false),
            "contradiction" => {
                let page =
                    self.declared.get(name).ok_or_else(|| format!("`{name}` is not declared above"))?;
                Ok(format!("<a href=\"{page}#contradiction-{name}\">Against the chapter</a>"))
            }
            "page" => {
                let file = name.split('#').next().unwrap_or(name);
                let page = self.sources.pages.iter().find(|page| page.path == file);
                let page = page.ok_or_else(|| format!("there is no page `{file}`"))?;
                Ok(format!("<a href=\"{name}\">{}</a>", inline(&page.title)))
            }
            _ => Err(format!("`{kind}` is no kind of place")),
        }
    }

    /// Plain text with placeholders, resolved.
    fn within(&mut self, text: &str) -> Resolved {
        let pieces = scan(text);
        pieces
            .iter()
            .map(|piece| match &piece.kind {
                Kind::Prose(text) => Ok(inline(text)),
                Kind::Placeholder(text) => self.resolve(text, false),
                _ => Err(format!("`{text}`: words and placeholders only")),
            })
            .collect()
    }

    /// Links to the claims and works that show a contradiction. A claim must be there and hold.
    fn shown_by(&mut self, entry: &Contradiction) -> Resolved {
        let mut shown = Vec::new();
        for evidence in &entry.evidence {
            if let Some(key) = evidence.strip_prefix("cite ") {
                shown.push(self.cite(key, false)?);
                continue;
            }
            shown.push(self.claim(evidence).map_err(|e| format!("{e}, and is to show `{}`", entry.id))?);
        }
        Ok(shown.join(", "))
    }

    /// A link to a claim, `<experiment>.<claim>`, which must be there and hold.
    fn claim(&self, id: &str) -> Resolved {
        let (experiment, claim) = split(id)?;
        let (found, golden) = self.golden(experiment)?;
        if !golden.claims.iter().any(|c| c == claim) {
            return Err(format!("experiment `{experiment}` has no claim `{claim}`"));
        }
        if found.record.as_ref().is_some_and(|r| r.claims.iter().any(|c| c.id == claim && !c.held)) {
            return Err(format!("claim `{id}` fails"));
        }
        let page = record_summary::page_of(experiment);
        Ok(format!("<a href=\"{page}#claim-{claim}\"><code>{}</code></a>", inline(id)))
    }

    /// Names that nothing uses: references, labels, contradictions that no page declares, figures that are
    /// drawn for nobody.
    pub(super) fn unused(&self) -> Vec<Finding> {
        let mut findings = self.labels.unused();
        let uncited = self.sources.references.iter().filter(|r| !self.cited.contains(&r.key));
        findings
            .extend(uncited.map(|r| Finding::new(REFERENCES, r.line, format!("`{}` is never cited", r.key))));
        let silent = self.sources.contradictions.iter().filter(|c| !self.declared.contains_key(&c.id));
        findings.extend(silent.map(|c| {
            let message = format!("`{}` is declared on no page: write {{{{contradiction {}}}}}", c.id, c.id);
            Finding::new(CONTRADICTIONS, c.line, message)
        }));
        for (experiment, evidence) in &self.sources.evidence.experiments {
            let figures = evidence.golden.iter().flat_map(|g| &g.figures);
            for GoldenFigure { file, line, .. } in figures {
                let id = format!("{experiment}.{}", stem(file));
                if !self.shown.contains(&id) {
                    let message = format!("figure `{id}` is shown on no page: write {{{{figure {id}}}}}");
                    findings.push(Finding::new(format!("golden/{experiment}.snap"), *line, message));
                }
            }
        }
        findings
    }
}

/// `experiment.name`.
fn split(id: &str) -> Result<(&str, &str), String> {
    id.split_once('.').ok_or_else(|| format!("`{id}` is not <experiment>.<name>"))
}

/// A file's name without its ending.
fn stem(file: &str) -> &str {
    file.rsplit_once('.').map_or(file, |(stem, _)| stem)
}

fn names(golden: &GoldenFile) -> String {
    golden.numbers.iter().map(|n| n.id.as_str()).collect::<Vec<_>>().join(", ")
}

fn command_line(experiment: &str, golden: &GoldenFile) -> String {
    format!("<span class=\"source\"><code>calibench run {experiment}</code>, seed {}</span>", golden.seed)
}

/// Everything about a number that a reader may want to know, a line each.
fn provenance(
    experiment: &str,
    evidence: &ExperimentEvidence,
    golden: &GoldenFile,
    row: usize,
    number: &GoldenNumber,
) -> String {
    let GoldenNumber { id, value, unit, band, reason } = number;
    let mut lines = vec![format!("{experiment}.{id} = {value:?} {unit}")];
    lines.extend(evidence.description(id).filter(|d| !d.is_empty()).map(str::to_string));
    lines.push(format!("seed {}", golden.seed));
    lines.push(format!("golden band: {band} ({reason})"));
    if let Some(published) = golden.published.iter().find(|p| p.id == *id) {
        let (low, high) = published.interval;
        lines
            .push(format!("published {} ({}): {}", published.printed, published.rule, published.expectation));
        let verdict = evidence.published(id).map_or("not judged yet", |p| match (p.book_held, p.ours_held) {
            (true, true) => "held",
            (false, true) => "the book's value is outside",
            (true, false) => "ours is outside",
            (false, false) => "both are outside",
        });
        lines.push(format!("interval [{low}, {high}]; verdict: {verdict}, {}", published.kind));
    } else {
        lines.push("verdict: locked in golden/; not printed in the chapter".to_string());
    }
    lines.push(format!("row {row} of data/{experiment}/numbers.csv"));
    lines.push(format!("calibench run {experiment}"));
    lines.join("\n")
}
