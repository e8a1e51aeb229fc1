//! What became of every item of the chapter? book/items.toml, listed on one page with links to what shows it.

use super::listed;
use super::text::{inline, section};
use serde::Deserialize;
use std::fmt::Write;

/// What became of an item.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Answer {
    /// An independent computation agrees.
    Confirmed,
    /// Made anew; there is nothing to judge.
    Regenerated,
    /// Made from data of ours.
    StandIn,
    /// Put in, or chosen so that it comes out.
    Input,
    /// It does not hold as it stands.
    Contradicted,
    /// Not done, or impossible.
    Open,
}

impl Answer {
    /// All, in the order of counts.
    const ALL: [Answer; 6] = [
        Answer::Confirmed,
        Answer::Regenerated,
        Answer::StandIn,
        Answer::Input,
        Answer::Contradicted,
        Answer::Open,
    ];

    /// The word for people.
    pub fn word(self) -> &'static str {
        match self {
            Answer::Confirmed => "confirmed",
            Answer::Regenerated => "regenerated",
            Answer::StandIn => "stand-in",
            Answer::Input => "input",
            Answer::Contradicted => "contradicted",
            Answer::Open => "open",
        }
    }

    /// The style of its cell.
    fn class(self) -> &'static str {
        match self {
            Answer::Confirmed | Answer::Regenerated => "held",
            Answer::Contradicted => "deviates",
            Answer::StandIn | Answer::Input | Answer::Open => "missing",
        }
    }

    /// Whether it says that a run agrees or disagrees, so that something must show it.
    fn needs_evidence(self) -> bool {
        !matches!(self, Answer::Open)
    }
}

/// A figure, table, number, equation, method, function or statement of the chapter.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Item {
    /// Section of the chapter.
    pub section: String,
    /// What kind of thing it is.
    pub kind: String,
    /// The item, in our words.
    pub what: String,
    /// What became of it.
    pub answer: Answer,
    /// What shows it: `claim four-pose.no-outlier`, `page zhang.md`, `cite tsai1987` and the like.
    #[serde(default, rename = "where")]
    pub places: Vec<String>,
    /// Why it is open, or what the answer leaves out.
    #[serde(default)]
    pub why: String,
    /// Line of its entry in the file, from 1.
    #[serde(skip)]
    pub line: usize,
}

/// Reads the list; an error comes with its line.
pub(super) fn parse(text: &str) -> Result<Vec<Item>, (usize, String)> {
    let items = listed::entries(text, "item", |item, line| Item { line, ..item })?;
    for item in &items {
        if item.answer.needs_evidence() && item.places.is_empty() {
            return Err((
                item.line,
                format!("`{}` is {} and nothing shows it", item.what, item.answer.word()),
            ));
        }
        if item.answer == Answer::Open && item.why.is_empty() {
            return Err((item.line, format!("`{}` is open: say why", item.what)));
        }
    }
    Ok(items)
}

/// How many there are of each answer, in words.
pub(super) fn counts(items: &[Item]) -> String {
    let count = |answer: Answer| items.iter().filter(|item| item.answer == answer).count();
    let counted = Answer::ALL.map(|answer| format!("{} {}", count(answer), answer.word()));
    format!("{} items: {}", items.len(), counted.join(", "))
}

/// A row of the list; `shown` are the links to what shows it.
pub(super) fn row(item: &Item, shown: &str) -> String {
    let mut notes = String::new();
    if !item.why.is_empty() {
        let _ = write!(notes, "<div class=\"because\">{}</div>", inline(&item.why));
    }
    let answer = item.answer;
    format!(
        "<tr><td>{}</td><td class=\"text\">{}<div class=\"because\">{}</div></td><td class=\"{}\">{}</td>\
         <td class=\"text\">{shown}{notes}</td></tr>",
        section(&item.section),
        inline(&item.what),
        inline(&item.kind),
        answer.class(),
        answer.word(),
    )
}

/// The list around its rows.
pub(super) fn table(rows: &str) -> String {
    format!(
        "<div class=\"table-wrapper\"><table class=\"items\"><thead><tr><th>section</th>\
         <th>the chapter has</th><th>answer</th><th>where, and what is left out</th></tr></thead>\
         <tbody>{rows}</tbody></table></div>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_that_nothing_shows_is_refused_with_the_line() {
        let one =
            "[[item]]\nsection='5.1'\nkind='number'\nwhat='w'\nanswer='confirmed'\nwhere=['page a.md']\n";
        let items = parse(&one.repeat(2)).unwrap();
        assert_eq!((items[1].line, items[1].answer), (7, Answer::Confirmed));
        assert_eq!(
            counts(&items),
            "2 items: 2 confirmed, 0 regenerated, 0 stand-in, 0 input, 0 contradicted, 0 open"
        );
        let (line, message) = parse(&one.replace("where=['page a.md']\n", "")).unwrap_err();
        assert_eq!((line, message.as_str()), (1, "`w` is confirmed and nothing shows it"));
        assert!(parse(&one.replace("confirmed", "open")).unwrap_err().1.contains("say why"));
        assert!(parse(&one.replace("confirmed", "perhaps")).is_err());
    }
}
