//! What is said of a whole experiment, of a section of the chapter, and of a statement that does not hold?

use super::known::{Known, record_of};
use super::names::{Names, sections_of};
use super::words::Answer;
use crate::Exit;
use calibench::io::significant;
use calibench_book::Contradiction;
use calibench_harness::Experiment;
use calibench_harness::published::Kind;
use rayon::prelude::*;

pub(super) fn experiment(experiment: &Experiment, names: &Names) -> Answer {
    let mut answer = Answer::headed(experiment.id);
    answer.say("title", experiment.title);
    answer.say("question", experiment.question);
    answer.say("seed", &experiment.seed.to_string());
    answer.say("again", &format!("calibench run {}", experiment.id));
    answer.say("names", &names.within(experiment.id).join(" "));
    answer
}

/// The section's printed values beside ours, its items, and what of it does not hold.
pub(super) fn section(known: &Known, section: &str) -> Result<Answer, (Exit, String)> {
    let mut answer = Answer::headed(&format!("section {section} of the chapter"));
    let is_of = |text: &str| sections_of(text).any(|one| one == section);
    let entries: Vec<_> = known.sources.published.iter().filter(|e| is_of(&e.section)).collect();
    let asked =
        known.experiments.par_iter().filter(|e| entries.iter().any(|entry| entry.experiment() == e.id));
    let records = asked.map(record_of).collect::<Result<Vec<_>, _>>()?;
    let reconciled: Vec<_> = records.iter().flat_map(|record| record.reconciliations()).collect();
    for entry in entries {
        let ours = reconciled.iter().find(|r| r.entry.id == entry.id).map_or_else(
            || Kind::CannotBeJudged.name().to_string(),
            |r| {
                let verdict = if r.held() { "holds" } else { "DOES NOT HOLD" };
                format!("{} {}: {verdict}, {}", significant(r.ours, 7), entry.unit, entry.kind.name())
            },
        );
        answer.part(&entry.id);
        answer.say("printed", &format!("{} {}: {}", entry.printed, entry.unit, entry.what));
        answer.say("ours", &ours);
    }
    for item in known.sources.items.iter().filter(|item| is_of(&item.section)) {
        answer.part(&format!("{}: {}", item.kind, item.what));
        answer.say("answer", item.answer.word());
        answer.say("where", &item.places.join(", "));
        if !item.why.is_empty() {
            answer.say("why", &item.why);
        }
    }
    for contradiction in known.sources.contradictions.iter().filter(|c| is_of(&c.section)) {
        say_contradiction(&mut answer, known, contradiction);
    }
    Ok(answer)
}

pub(super) fn contradiction(known: &Known, id: &str) -> Answer {
    let mut answer = Answer::headed("against the chapter");
    known
        .sources
        .contradictions
        .iter()
        .filter(|c| c.id == id)
        .for_each(|c| say_contradiction(&mut answer, known, c));
    answer
}

fn say_contradiction(answer: &mut Answer, known: &Known, contradiction: &Contradiction) {
    answer.part(&format!("contradiction {}", contradiction.id));
    answer.say("section", &contradiction.section);
    answer.say("chapter", &contradiction.chapter);
    answer.say("found", &resolved(known, &contradiction.found));
    answer.list("shown by", contradiction.evidence.iter().cloned());
}

/// A text of the book with its numbers, to four digits.
fn resolved(known: &Known, text: &str) -> String {
    let mut pieces = text.split("{{");
    let mut plain = pieces.next().unwrap_or_default().to_string();
    for piece in pieces {
        let (placeholder, rest) = piece.split_once("}}").unwrap_or((piece, ""));
        let name = placeholder.split(' ').nth(1).unwrap_or_default();
        let value = name.split_once('.').and_then(|(experiment, own)| known.locked_value(experiment, own));
        plain.push_str(&value.map_or_else(|| name.to_string(), |value| significant(value, 4)));
        plain.push_str(rest);
    }
    plain
}
