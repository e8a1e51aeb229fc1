//! What is equation (3.2)? Names of equations, figures, tables and places, numbered by chapter in the order
//! of the text.

use super::finding::Finding;
use super::scan::{Kind, Piece};
use std::collections::{BTreeMap, BTreeSet};

/// What a name stands for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Label {
    /// Page below book/text.
    pub page: String,
    /// `equation (3.2)`, `Figure 1.1`; empty for a place, which has no number.
    pub words: String,
    /// `(3.2)`, `Figure 1.1`.
    pub number: String,
    file: String,
    line: usize,
}

/// Links into the text, by what they show.
pub(super) type Uses = BTreeMap<String, Vec<String>>;

/// All names of the book.
#[derive(Debug, Default)]
pub(super) struct Labels {
    known: BTreeMap<String, Label>,
    used: BTreeSet<String>,
    /// Counts of the pages without a chapter number, which share one row of numbers.
    unnumbered: BTreeMap<&'static str, usize>,
}

/// The name under which a placeholder can be referred to.
pub(super) fn label_of(placeholder: &str) -> Option<String> {
    let mut words = placeholder.split_whitespace();
    match (words.next()?, words.next()?) {
        ("figure", id) => Some(format!("fig:{id}")),
        ("table", id) => Some(format!("tab:{id}")),
        ("caption", label) => Some(label.to_string()),
        _ => None,
    }
}

/// The name that a piece of a page gives.
fn name_of(piece: &Piece<'_>, page: &str) -> Option<String> {
    match &piece.kind {
        Kind::Equation { label, .. } => label.map(str::to_string),
        // Places may bear the same name on different pages.
        Kind::Place(name) => Some(format!("{page}#{name}")),
        Kind::Placeholder(text) => label_of(text),
        _ => None,
    }
}

/// What kind of thing a name is of; empty for a place.
fn class_of(name: &str) -> &'static str {
    let class = name.split_once(':').map_or("", |(class, _)| class);
    ["eq", "fig", "tab"].into_iter().find(|known| *known == class).unwrap_or("")
}

/// How the text says the number of a thing, and how the thing bears it.
fn numbered(class: &str, count: &str) -> (String, String) {
    let same = |words: String| (words.clone(), words);
    match class {
        "eq" => (format!("equation\u{a0}({count})"), format!("({count})")),
        "fig" => same(format!("Figure\u{a0}{count}")),
        "tab" => same(format!("Table\u{a0}{count}")),
        _ => same(String::new()),
    }
}

impl Labels {
    /// Takes the names of one page. Counts begin anew in every chapter.
    pub(super) fn take(
        &mut self,
        (page, file): (&str, &str),
        chapter: Option<u32>,
        pieces: &[Piece<'_>],
        findings: &mut Vec<Finding>,
    ) {
        let mut in_chapter = BTreeMap::new();
        let named = pieces.iter().filter_map(|piece| Some((piece.line, name_of(piece, page)?)));
        for (line, name) in named {
            let class = class_of(&name);
            let counts = if chapter.is_none() { &mut self.unnumbered } else { &mut in_chapter };
            let count = counts.entry(class).or_insert(0);
            *count += 1;
            let prefix = chapter.map(|n| format!("{n}.")).unwrap_or_default();
            let (words, number) = numbered(class, &format!("{prefix}{count}"));
            let (page, file) = (page.to_string(), file.to_string());
            let label = Label { page, words, number, file: file.clone(), line };
            if self.known.insert(name.clone(), label).is_some() {
                findings.push(Finding::new(file, line, format!("the name `{name}` is given twice")));
            }
        }
    }

    /// What a name stands for, noted as used.
    pub(super) fn refer(&mut self, name: &str) -> Option<&Label> {
        self.used.insert(name.to_string());
        self.known.get(name)
    }

    /// Whether a page has a place or a named thing that a link can lead to.
    pub(super) fn on_page(&self, page: &str, name: &str) -> bool {
        self.known.contains_key(&format!("{page}#{name}"))
            || self.known.get(name).is_some_and(|l| l.page == page)
    }

    /// What a name stands for.
    pub(super) fn get(&self, name: &str) -> Option<&Label> {
        self.known.get(name)
    }

    /// Equations, figures and tables that the text never speaks of.
    pub(super) fn unused(&self) -> Vec<Finding> {
        let silent = self.known.iter().filter(|(name, l)| !l.words.is_empty() && !self.used.contains(*name));
        silent
            .map(|(name, l)| {
                let message = format!("`{name}` is never referred to: write {{{{ref {name}}}}} in the text");
                Finding::new(&l.file, l.line, message)
            })
            .collect()
    }
}
