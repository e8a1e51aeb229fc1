//! How is a verdict told to a person? One table over all experiments, then every deviation in full.

use calibench::io::significant;
use calibench_harness::published::not_judged;
use calibench_harness::verdict::{ByKind, Golden, Run, Tally, Verdict};
use calibench_harness::{Reconciliation, Record};
use comfy_table::{CellAlignment, ContentArrangement, LineStyle, Table, TableStyle};

/// Characters in a line, whatever the terminal: a saved report looks like the one on the screen.
const WIDTH: u16 = 120;

/// One rule under the header, none elsewhere.
const STYLE: TableStyle =
    TableStyle::new().header_separator(LineStyle::new('\u{2500}', '\u{2500}', '\u{2500}', '\u{2500}'));

/// A table in the one style of all reports.
pub(super) fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(STYLE);
    table.set_content_arrangement(ContentArrangement::Dynamic);
    table.set_width(WIDTH);
    table.set_header(header.to_vec());
    table
}

fn tally(t: Tally) -> String {
    if t.total == 0 { "\u{2013}".to_string() } else { format!("{} of {}", t.held, t.total) }
}

fn by_kind(counts: ByKind) -> String {
    let text = counts.to_string();
    if text.is_empty() { "\u{2013}".to_string() } else { text }
}

/// One line an experiment, and the published values of all by kind.
pub(super) fn reconciliation_table(runs: &[Run], verdicts: &[Option<Verdict>]) -> String {
    let mut table =
        table(&["experiment", "golden numbers", "claims", "published, by kind", "time", "verdict"]);
    for column in [1, 2, 4] {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    for (run, verdict) in runs.iter().zip(verdicts) {
        let time = format!("{:.2} s", run.took.as_secs_f64());
        let id = run.experiment.id.to_string();
        table.add_row(match verdict {
            None => [id, "\u{2013}".into(), "\u{2013}".into(), "\u{2013}".into(), time, "FAILED".into()],
            Some(verdict) => {
                let golden = match verdict.golden {
                    Golden::Compared(t) => tally(t),
                    Golden::Skipped(_) => "not compared".to_string(),
                    Golden::Missing => "no snapshot".to_string(),
                };
                let word = if verdict.held() { "held" } else { "DEVIATES" };
                [id, golden, tally(verdict.claims), by_kind(verdict.published), time, word.to_string()]
            }
        });
    }
    let all = verdicts.iter().flatten().fold(ByKind::default(), |sum, v| sum.plus(&v.published));
    format!("{}\npublished values: {}\n", table.trim_fmt(), by_kind(all))
}

/// Every deviation, every drift, and why a comparison was left out.
pub(super) fn details(verdicts: &[Verdict]) -> String {
    let mut text = String::new();
    for verdict in verdicts {
        for deviation in &verdict.deviations {
            text.push_str(&format!("DEVIATES {}: {deviation}\n", verdict.experiment));
        }
        for drift in &verdict.drift {
            text.push_str(&format!("bits moved in {}: {drift}\n", verdict.experiment));
        }
        if let Golden::Skipped(reason) = verdict.golden {
            text.push_str(&format!("{}: golden values not compared: {reason}\n", verdict.experiment));
        }
    }
    text
}

/// The numbers, claims and published values of one record.
pub(super) fn summary(record: &Record) -> String {
    let mut text = format!("{} (seed {})\n", record.experiment(), record.seed());
    for note in record.notes() {
        text.push_str(&format!("note: {note}\n"));
    }
    let mut numbers = table(&["number", "value", "unit", "what"]);
    for n in record.numbers() {
        numbers.add_row([n.id.clone(), significant(n.value, 7), n.unit.clone(), n.description.clone()]);
    }
    let mut claims = table(&["claim", "value", "interval", "statement"]);
    for c in record.claims() {
        let interval =
            format!("[{}, {}] {}", significant(c.interval.0, 4), significant(c.interval.1, 4), c.unit);
        let (value, interval) = match c.counted() {
            Some(counted) => (counted, "all".to_string()),
            None => (significant(c.value, 4), interval),
        };
        let mark = if c.held { "" } else { "FAILS: " };
        let statement = format!("{mark}{}", c.statement);
        claims.add_row([c.id.clone(), value, interval, statement]);
    }
    text.push_str(&format!("{}\n{}\n", numbers.trim_fmt(), claims.trim_fmt()));
    if !record.reconciliations().is_empty() {
        text.push_str(&format!("{}\n", published_table(record).trim_fmt()));
    }
    text
}

fn published_table(record: &Record) -> Table {
    let mut published = table(&["published", "section", "book", "ours", "unit", "rule", "kind", "verdict"]);
    for r in record.reconciliations() {
        published.add_row([
            r.entry.number().to_string(),
            r.entry.section.clone(),
            r.entry.printed.clone(),
            significant(r.ours, 7),
            r.entry.unit.clone(),
            r.rule().name().to_string(),
            r.entry.kind.name().to_string(),
            word(r).to_string(),
        ]);
    }
    for e in not_judged(record.experiment()) {
        let none = || "\u{2013}".to_string();
        let (number, section) = (e.number().to_string(), e.section.clone());
        let (printed, unit) = (e.printed.clone(), e.unit.clone());
        published.add_row([
            number,
            section,
            printed,
            none(),
            unit,
            none(),
            e.kind.name().to_string(),
            "not judged".to_string(),
        ]);
    }
    published
}

fn word(r: &Reconciliation) -> &'static str {
    match (r.book_held, r.ours_held) {
        (true, true) => "held",
        (false, true) => "BOOK OUTSIDE",
        (true, false) => "OURS OUTSIDE",
        (false, false) => "BOTH OUTSIDE",
    }
}
