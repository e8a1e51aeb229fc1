//! Which works does the book cite? book/references.toml, and the two ways to name one in the text.

use super::listed;
use super::text::{attribute, inline};
use serde::Deserialize;

/// A work.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reference {
    /// Name in the sources, such as `zhang2000`.
    pub key: String,
    /// Family names as the text says them: `Zhang`, `Tsai & Lenz`.
    pub short: String,
    /// All authors as the list says them.
    pub authors: String,
    /// Year of publication.
    pub year: u16,
    /// Title.
    pub title: String,
    /// Journal, volume, pages; or publisher.
    pub venue: String,
    /// Digital object identifier, where there is one.
    #[serde(default)]
    pub doi: String,
    /// Line of its entry in the file, from 1.
    #[serde(skip)]
    pub line: usize,
}

/// The page on which the list of references stands.
pub(super) const PAGE: &str = "references.md";

/// Reads the list; an error comes with its line.
pub(super) fn parse(text: &str) -> Result<Vec<Reference>, (usize, String)> {
    listed::entries(text, "reference", |entry, line| Reference { line, ..entry })
}

impl Reference {
    /// `Zhang (2000)`, or with parentheses around all.
    pub(super) fn link(&self, parenthetical: bool) -> String {
        let (short, year) = (inline(&self.short), self.year);
        let title = attribute(&format!("{} ({year}): {}", self.authors, self.title));
        let target = format!("{PAGE}#ref-{}", self.key);
        if parenthetical {
            format!(r#"(<a class="cite" href="{target}" title="{title}">{short} {year}</a>)"#)
        } else {
            format!(r#"<a class="cite" href="{target}" title="{title}">{short} ({year})</a>"#)
        }
    }

    /// The entry in the list.
    fn entry(&self) -> String {
        let doi = match self.doi.as_str() {
            "" => String::new(),
            doi => format!(r#" <a href="https://doi.org/{0}">doi:{0}</a>"#, inline(doi)),
        };
        format!(
            r#"<li id="ref-{}">{} ({}): <cite>{}</cite>. {}.{doi}</li>"#,
            self.key,
            inline(&self.authors),
            self.year,
            inline(&self.title),
            inline(&self.venue)
        )
    }
}

/// The list of all references, by author and year.
pub(super) fn list(references: &[Reference]) -> String {
    let mut sorted: Vec<&Reference> = references.iter().collect();
    sorted.sort_by(|a, b| (&a.authors, a.year).cmp(&(&b.authors, b.year)));
    let entries: Vec<String> = sorted.into_iter().map(Reference::entry).collect();
    format!("<ul class=\"references\">\n{}\n</ul>", entries.join("\n"))
}
