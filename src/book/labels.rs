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
        for piece in pieces {
            let name = match &piece.kind {
                Kind::Equation { label: Some(label), .. } => label.to_string(),
                // Places may bear the same name on different pages.
                Kind::Place(name) => format!("{page}#{name}"),
                Kind::Placeholder(text) => match label_of(text) {
                    Some(name) => name,
                    None => continue,
                },
                _ => continue,
            };
            let class = name.split_once(':').map_or("", |(class, _)| class);
            let class = ["eq", "fig", "tab"].into_iter().find(|c| *c == class).unwrap_or("");
            let counts = if chapter.is_none() { &mut self.unnumbered } else { &mut in_chapter };
            let count = counts.entry(class).or_insert(0);
            *count += 1;
            let prefix = chapter.map(|n| format!("{n}.")).unwrap_or_default();
            let count = format!("{prefix}{count}");
            let (words, number) = match class {
                "eq" => (format!("equation\u{a0}({count})"), format!("({count})")),
                "fig" => (format!("Figure\u{a0}{count}"), format!("Figure\u{a0}{count}")),
                "tab" => (format!("Table\u{a0}{count}"), format!("Table\u{a0}{count}")),
                _ => (String::new(), String::new()),
            };
            let (page, file, line) = (page.to_string(), file.to_string(), piece.line);
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
