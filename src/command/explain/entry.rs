//! One thing of a record: what it is, how it is computed, what stands behind it, what the chapter prints,
//! where it is shown.

use super::known::Known;
use super::pages::pages;
use super::words::Answer;
use calibench::io::significant;
use calibench_harness::published::Entry;
use calibench_harness::{Claim, Entered, Experiment, Number, Reconciliation, Record};

/// Everything under one name; a figure and the table behind it may share theirs.
pub(super) fn explained(known: &Known, experiment: &Experiment, record: &Record, own: &str) -> Answer {
    let mut answer = Answer::headed(&format!("{}.{own}", experiment.id));
    let place = |what| match record.place(what, own) {
        Some(place) => format!("{}:{}", place.file(), place.line()),
        None => "not recorded".to_string(),
    };
    if let Some(number) = record.numbers().iter().find(|n| n.id == own) {
        let locked = known.locked_value(experiment.id, own);
        say_number(&mut answer, number, locked, &place(Entered::Number));
        let judged = record.claims().iter().filter(|claim| judges(claim, number));
        answer.list(
            "judged by",
            judged.map(|c| format!("claim {}: {} ({})", c.id, c.statement, verdict(c.held))),
        );
    }
    if let Some(claim) = record.claims().iter().find(|c| c.id == own) {
        say_claim(&mut answer, claim, &place(Entered::Claim));
        let against = known.sources.contradictions.iter();
        let id = format!("{}.{own}", experiment.id);
        let against = against.filter(|c| c.evidence.contains(&id));
        answer.list(
            "against",
            against.map(|c| {
                format!("the chapter's section {}: {} (contradiction {})", c.section, c.chapter, c.id)
            }),
        );
    }
    if let Some(table) = record.tables().iter().find(|t| t.name == own) {
        answer.say(
            "table",
            &format!(
                "{}; {} rows, in out/{}/{own}.csv after a run",
                table.caption,
                table.rows().len(),
                experiment.id
            ),
        );
        answer.say("computed", &place(Entered::Table));
    }
    if let Some(figure) = record.figures().iter().find(|f| f.name == own) {
        answer.say("figure", &format!("figures/{}/{}", experiment.id, figure.file_name()));
        answer.say("shows", &figure.caption);
        answer.say("drawn", &place(Entered::Figure));
    }
    let id = format!("{}.{own}", experiment.id);
    if let Some(reconciliation) = record.reconciliations().iter().find(|r| r.entry.id == id) {
        say_published(&mut answer, reconciliation);
    } else if let Some(entry) = known.sources.published.iter().find(|e| e.id == id) {
        answer.say("chapter", &printed(entry));
        answer.say("kind", &format!("{}: {}", entry.kind.name(), entry.because));
    }
    answer.say("seed", &experiment.seed.to_string());
    answer.list("pages", pages(&known.sources.pages, experiment.id, own));
    answer.say(
        "again",
        &format!("calibench run {0}; calibench check {0} compares it with golden/{0}.snap", experiment.id),
    );
    answer
}

fn say_number(answer: &mut Answer, number: &Number, locked: Option<f64>, place: &str) {
    let Number { value, unit, band, description, .. } = number;
    let now = match locked {
        Some(locked) if locked.to_bits() == value.to_bits() => {
            "the golden value, to the last bit".to_string()
        }
        Some(locked) if band.holds(locked, *value) => format!("golden: {locked:?}, within its band"),
        Some(locked) => format!("golden: {locked:?}: IT DEVIATES"),
        None => "no golden value yet".to_string(),
    };
    answer.say("number", description);
    answer.say("value", &format!("{value:?} {unit} ({now})"));
    answer.say("band", &format!("{}: {}", band.width(), band.reason()));
    answer.say("computed", place);
}

fn say_claim(answer: &mut Answer, claim: &Claim, place: &str) {
    answer.say("claim", &claim.statement);
    let found = claim.counted().unwrap_or_else(|| format!("{} {}", significant(claim.value, 7), claim.unit));
    answer.say("found", &format!("{found}: {}", verdict(claim.held)));
    if claim.cases.is_none() {
        let (low, high) = (significant(claim.interval.0, 6), significant(claim.interval.1, 6));
        answer.say("interval", &format!("{low} to {high} {}", claim.unit));
    }
    answer.say("because", &claim.reason);
    let rate = claim.false_alarm_rate;
    answer.say(
        "by chance",
        &rate.map_or("never: nothing is drawn".to_string(), |rate| {
            format!("fails a correct program at the rate {rate:?}")
        }),
    );
    answer.list("fails", claim.failures.iter().cloned());
    answer.say("computed", place);
}

fn say_published(answer: &mut Answer, reconciliation: &Reconciliation) {
    let entry = &reconciliation.entry;
    answer.say("chapter", &printed(entry));
    answer
        .say("held to", &format!("{} ({})", reconciliation.expectation_text(), reconciliation.rule().name()));
    answer.say(
        "verdict",
        &format!(
            "the chapter's value: {}; ours: {}",
            verdict(reconciliation.book_held),
            verdict(reconciliation.ours_held)
        ),
    );
    let because = if entry.because.is_empty() {
        "computed from the model, without use of the printed value"
    } else {
        &entry.because
    };
    answer.say("kind", &format!("{}: {because}", entry.kind.name()));
}

fn printed(entry: &Entry) -> String {
    format!("section {} prints {} {} for the {}", entry.section, entry.printed, entry.unit, entry.what)
}

/// Whether a claim is about a number: it judges this very value, or is named after the number.
fn judges(claim: &Claim, number: &Number) -> bool {
    let same =
        claim.cases.is_none() && claim.unit == number.unit && claim.value.to_bits() == number.value.to_bits();
    // Round values such as 0 and 600 are those of many numbers.
    let telling = number.value.fract() != 0.0;
    same && telling
        || claim
            .id
            .strip_prefix(number.id.as_str())
            .is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
}

fn verdict(held: bool) -> &'static str {
    if held { "holds" } else { "DOES NOT HOLD" }
}
