//! Where is the chapter contradicted? book/contradictions.toml, declared where the text says so and listed on
//! one page.

use super::listed;
use super::text::{inline, section};
use serde::Deserialize;

/// A statement of the chapter that does not hold as it stands.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Contradiction {
    /// Name in the sources, such as `two-views`.
    pub id: String,
    /// Section of the chapter.
    pub section: String,
    /// What the chapter says, in our words.
    pub chapter: String,
    /// What is found instead; may hold the placeholders of a page.
    pub found: String,
    /// The claims that show it, `<experiment>.<claim>`; or works, `cite <key>`.
    pub evidence: Vec<String>,
    /// Line of its entry in the file, from 1.
    #[serde(skip)]
    pub line: usize,
}

/// Reads the list; an error comes with its line.
pub(super) fn parse(text: &str) -> Result<Vec<Contradiction>, (usize, String)> {
    let entries = listed::entries(text, "contradiction", |entry, line| Contradiction { line, ..entry })?;
    for (i, entry) in entries.iter().enumerate() {
        if entries[..i].iter().any(|other| other.id == entry.id) {
            return Err((entry.line, format!("`{}` stands twice", entry.id)));
        }
        if entry.evidence.is_empty() {
            return Err((entry.line, format!("`{}` names nothing that shows it", entry.id)));
        }
    }
    Ok(entries)
}

/// The box in the text. `found` and `shown_by` are resolved already.
pub(super) fn declared(entry: &Contradiction, found: &str, shown_by: &str) -> String {
    format!(
        "<div class=\"contradiction\" id=\"contradiction-{}\"><b>Against the chapter</b> ({}): {} {found} \
         <span class=\"source\">Shown by {shown_by}; <a href=\"contradictions.md\">all such places</a>.</span></div>\n",
        entry.id,
        section(&entry.section),
        inline(&entry.chapter)
    )
}

/// A row of the list, with the page that declares it.
pub(super) fn row(entry: &Contradiction, found: &str, shown_by: &str, page: &str) -> String {
    format!(
        "<tr><td class=\"text\">{}<div class=\"because\">{}; <a href=\"{page}#contradiction-{}\">in the text</a></div></td>\
         <td class=\"text\">{found}<div class=\"because\">Shown by {shown_by}</div></td></tr>",
        inline(&entry.chapter),
        section(&entry.section),
        entry.id
    )
}

/// The list around its rows.
pub(super) fn table(rows: &str) -> String {
    format!(
        "<div class=\"table-wrapper\"><table class=\"contradictions\"><thead><tr><th>the chapter</th><th>found here</th></tr></thead>\
         <tbody>{rows}</tbody></table></div>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_that_shows_nothing_or_names_twice_is_refused_with_the_line() {
        let one = "[[contradiction]]\nid='a'\nsection='5.1'\nchapter='c'\nfound='f'\nevidence=['e.claim']\n";
        assert_eq!(parse(one).unwrap()[0].line, 1);
        let (line, message) = parse(&one.repeat(2)).unwrap_err();
        assert_eq!((line, message.as_str()), (7, "`a` stands twice"));
        assert_eq!(parse(&one.replace("'e.claim'", "")).unwrap_err().0, 1);
        assert_eq!(parse("[[contradiction]]\nid=3").unwrap_err().0, 2);
    }
}
