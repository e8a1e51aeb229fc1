//! Which pages are there, in which order? A line each in SUMMARY.md; those of its list are chapters and have
//! numbers.

/// A line of the summary.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Entry {
    /// Title in the contents.
    pub title: String,
    /// Path below book/text.
    pub path: String,
    /// Number of the chapter; `None` before and after the list.
    pub number: Option<u32>,
}

/// Reads `[title](path)` and `- [title](path)`.
///
/// # Errors
/// The first line that is neither these, nor empty, nor a heading, with its number.
pub(super) fn parse(text: &str) -> Result<Vec<Entry>, (usize, String)> {
    let mut chapters = 0;
    let mut entries = Vec::new();
    for (i, line) in text.lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let item = line.strip_prefix("- ");
        let link = item.unwrap_or(line).strip_prefix('[').and_then(|rest| rest.strip_suffix(')'));
        let (title, path) = link
            .and_then(|link| link.split_once("]("))
            .ok_or_else(|| (i + 1, format!("`{line}` is not [title](page.md)")))?;
        let number = item.map(|_| {
            chapters += 1;
            chapters
        });
        entries.push(Entry { title: title.to_string(), path: path.to_string(), number });
    }
    Ok(entries)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_of_the_list_are_numbered_and_nothing_else_is() {
        let found =
            parse("# Summary\n\n[About](index.md)\n\n- [One](a.md)\n- [Two](b.md)\n\n[End](z.md)\n").unwrap();
        let numbers: Vec<_> = found.iter().map(|e| (e.path.as_str(), e.number)).collect();
        assert_eq!(numbers, [("index.md", None), ("a.md", Some(1)), ("b.md", Some(2)), ("z.md", None)]);
        assert_eq!(found[2].title, "Two");
        assert_eq!(parse("[About](index.md)\nnonsense\n").unwrap_err().0, 2);
    }
}
