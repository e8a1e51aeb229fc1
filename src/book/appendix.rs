//! What stands in the appendix? Every published number beside ours, and the tables of what the experiments
//! found.

use super::evidence::ExperimentEvidence;
use super::format::{self, significant, typeset};
use super::golden_file::GoldenNumber;
use super::record_summary::{by_kind, page_of, verdict};
use super::sources::Sources;
use super::text::{inline, section, sentence};
use calibench_harness::published::Entry;
use calibench_harness::verdict::ByKind;
use std::fmt::Write;

/// The published values of all experiments by kind, as a sentence.
pub(super) fn published_counts(sources: &Sources) -> String {
    let experiments = sources.evidence.experiments.iter();
    let all = experiments.fold(ByKind::default(), |sum, (id, evidence)| sum.plus(&by_kind(id, evidence)));
    all.to_string()
}

/// Every number that the chapter prints: ours, what both are held against, what the verdict is worth, and the
/// verdict.
pub(super) fn published_table(sources: &Sources) -> String {
    let rows: String = sources.published.iter().map(|entry| published_row(entry, sources)).collect();
    let head = "<thead><tr><th>what, and what it is held against</th><th>printed</th><th>ours</th><th>verdict</th></tr></thead>";
    format!(
        "<div class=\"table-wrapper\"><table class=\"published\">{head}<tbody>{rows}</tbody></table></div>\n"
    )
}

fn published_row(entry: &Entry, sources: &Sources) -> String {
    let evidence = sources.evidence.experiments.get(entry.experiment());
    let golden = evidence.and_then(|e| e.golden.as_ref());
    let ours = golden.and_then(|g| g.number(entry.number())).filter(|_| entry.rule.is_some());
    let ours = ours.map_or("\u{2013}".to_string(), |(_, number)| golden_link(entry, number));
    let locked = golden.and_then(|g| g.published.iter().find(|p| p.id == entry.number()));
    let expectation = locked.map_or(String::new(), |p| {
        let (low, high) = p.interval;
        let interval = format!("[{}, {}]", significant(low, 6), significant(high, 6));
        format!("Ours in {interval}. {}.", inline(&sentence(&format!("{}: {}", p.rule, p.expectation))))
    });
    let because = match entry.because.as_str() {
        "" => String::new(),
        because => format!(" {}.", inline(&sentence(because))),
    };
    let (word, class) = judged(entry, evidence);
    format!(
        "<tr id=\"published-{}\"><td class=\"text\">{} {}<div class=\"because\">{expectation}{because}</div></td>\
         <td class=\"value\" data-label=\"printed\">{}{}</td><td class=\"value\" data-label=\"ours\">{ours}</td>\
         <td class=\"{class}\" data-label=\"verdict\">{word}<div class=\"because\">{}</div></td></tr>",
        entry.id,
        section(&entry.section),
        inline(&entry.what),
        typeset(&entry.printed),
        format::unit(&entry.unit),
        entry.kind.name()
    )
}

/// Our number with a digit more than the chapter prints.
fn golden_link(entry: &Entry, number: &GoldenNumber) -> String {
    let decimals = entry.decimals() + 1;
    let value = typeset(&format!("{:.decimals$}", number.value));
    let page = page_of(entry.experiment());
    format!("<a class=\"num\" href=\"{page}#number-{}\" title=\"{:?}\">{value}</a>", number.id, number.value)
}

/// The verdict on a published value, and the style of its cell.
fn judged(entry: &Entry, evidence: Option<&ExperimentEvidence>) -> (&'static str, &'static str) {
    let judged = evidence.and_then(|e| e.published(entry.number()));
    match judged.map(|p| (p.book_held, p.ours_held)) {
        None if entry.rule.is_none() => ("not judged", "missing"),
        None => ("not reproduced yet", "missing"),
        Some((true, true)) => ("held", "held"),
        Some((false, true)) => ("book outside", "deviates"),
        Some((true, false)) => ("ours outside", "deviates"),
        Some((false, false)) => ("both outside", "deviates"),
    }
}

/// Links to the pages of all records.
pub(super) fn record_list(sources: &Sources) -> String {
    let mut list = String::new();
    for (id, evidence) in &sources.evidence.experiments {
        let Some(golden) = &evidence.golden else { continue };
        let _ = writeln!(
            list,
            "- [{id}]({}): {}. {}",
            page_of(id),
            inline(&evidence.title),
            verdict(id, evidence, golden)
        );
    }
    list
}
