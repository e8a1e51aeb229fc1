//! What is told of an experiment's record, wherever it is told? Where its page is, its verdict in a line, and
//! its claims.

use super::evidence::{ExperimentEvidence, RecordClaim, number};
use super::format::{self, significant};
use super::golden_file::GoldenFile;
use super::text::{inline, sentence};
use calibench_harness::published::{Kind, not_judged};
use calibench_harness::verdict::ByKind;
use std::fmt::Write;

/// The page of an experiment's record, from the root of the book.
pub(super) fn page_of(experiment: &str) -> String {
    format!("record-{experiment}.md")
}

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
