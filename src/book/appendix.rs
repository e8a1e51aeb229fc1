//! What stands in the appendix? Every published number beside ours, and the tables of what the experiments
//! found.

use super::evidence::{ExperimentEvidence, RecordClaim, number};
use super::format::{self, significant, typeset};
use super::golden_file::{GoldenFile, GoldenNumber};
use super::record_page::page_of;
use super::sources::Sources;
use super::text::{inline, sentence};
use calibench_harness::published::{Entry, Kind, not_judged};
use calibench_harness::verdict::ByKind;
use std::fmt::Write;

/// The published values of an experiment by kind, as its last run judged them.
pub(super) fn by_kind(id: &str, evidence: &ExperimentEvidence) -> ByKind {
    let mut counts = ByKind::default();
    for value in evidence.record.iter().flat_map(|r| &r.published) {
        if let Some(kind) = Kind::ALL.into_iter().find(|k| k.name() == value.kind) {
            counts.count(kind, value.book_held && value.ours_held);
        }
    }
    not_judged(id).for_each(|entry| counts.count(entry.kind, false));
    counts
}

/// Golden, claims and published values in one line.
pub(super) fn verdict(id: &str, evidence: &ExperimentEvidence, golden: &GoldenFile) -> String {
    let numbers = golden.numbers.len();
    let Some(record) = &evidence.record else { return format!("{numbers} locked numbers.") };
    let held = |held: usize, total: usize, what: &str| match (held, total) {
        (_, 0) => String::new(),
        (held, total) if held == total => format!(", all {total} {what} held"),
        (held, total) => format!(", <b class=\"deviates\">{held} of {total} {what} held</b>"),
    };
    let claims = held(record.claims.iter().filter(|c| c.held).count(), record.claims.len(), "claims");
    let published = match by_kind(id, evidence).to_string() {
        none if none.is_empty() => String::new(),
        counts => format!("; published values: {counts}"),
    };
    format!("{numbers} locked numbers{claims}{published}.")
}

/// The claims of a record, each with its reason and false-alarm rate. With `places`, every row can be linked
/// to.
pub(super) fn claims_table(claims: &[RecordClaim], places: bool) -> String {
    let mut rows = String::new();
    for claim in claims {
        let unit = format::unit(&claim.unit);
        let value = match &claim.counted {
            Some(counted) => inline(counted),
            None => format!("{}{unit}", significant(number(&claim.value), 4)),
        };
        let rate = claim
            .false_alarm_rate
            .map_or("Nothing is drawn.".to_string(), |r| format!("False-alarm rate {}.", significant(r, 2)));
        let (word, class) = if claim.held { ("held", "held") } else { ("fails", "deviates") };
        let place = if places { format!(" id=\"claim-{}\"", claim.id) } else { String::new() };
        let _ = write!(
            rows,
            "<tr{place}><td class=\"text\">{}<div class=\"because\">{}. {rate}</div></td>\
             <td class=\"value\">{value}<div class=\"because\">{}</div></td><td class=\"{class}\">{word}</td></tr>",
            inline(&claim.statement),
            inline(&sentence(&claim.reason)),
            interval(claim)
        );
    }
    let head = "<thead><tr><th>claim, and where its interval comes from</th><th>value, and where it must lie</th><th>verdict</th></tr></thead>";
    format!(
        "<div class=\"table-wrapper\"><table class=\"claims\">{head}<tbody>{rows}</tbody></table></div>\n"
    )
}

/// Where the value of a claim must lie.
fn interval(claim: &RecordClaim) -> String {
    if claim.counted.is_some() {
        return String::new();
    }
    let unit = format::unit(&claim.unit);
    let (low, high) = (number(&claim.interval.0), number(&claim.interval.1));
    match (low.is_finite(), high.is_finite()) {
        (false, true) => format!("\u{2264}\u{a0}{}{unit}", significant(high, 3)),
        (true, false) => format!("\u{2265}\u{a0}{}{unit}", significant(low, 3)),
        _ => format!("in [{}, {}]{unit}", significant(low, 4), significant(high, 4)),
    }
}

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

/// A section with its sign; `case study` has no number.
pub(super) fn section(name: &str) -> String {
    let sign = if name.starts_with(|c: char| c.is_ascii_digit()) { "\u{a7}" } else { "" };
    format!("{sign}{}", inline(name))
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
