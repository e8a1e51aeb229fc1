//! How are the lists of the book read? TOML files whose entries stand under one key, as `[[reference]]` does,
//! each with its line, so that a finding can name it.

use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use toml::Spanned;

/// The entries of a file, each given its line, from 1; an error comes with its line.
pub(super) fn entries<T: DeserializeOwned>(
    text: &str,
    key: &str,
    at_line: impl Fn(T, usize) -> T,
) -> Result<Vec<T>, (usize, String)> {
    let line = |at: usize| 1 + text.bytes().take(at).filter(|&b| b == b'\n').count();
    let mut file: BTreeMap<String, Vec<Spanned<T>>> = toml::from_str(text)
        .map_err(|e| (e.span().map_or(1, |span| line(span.start)), e.message().to_string()))?;
    let entries = file.remove(key).unwrap_or_default();
    if let Some(other) = file.keys().next() {
        return Err((1, format!("`{other}` is not `{key}`")));
    }
    let placed = |entry: Spanned<T>| {
        let line = line(entry.span().start);
        at_line(entry.into_inner(), line)
    };
    Ok(entries.into_iter().map(placed).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Debug, PartialEq, Deserialize)]
    struct Work {
        name: String,
        #[serde(skip)]
        line: usize,
    }

    fn works(text: &str) -> Result<Vec<Work>, (usize, String)> {
        entries(text, "work", |work, line| Work { line, ..work })
    }

    #[test]
    fn an_entry_knows_its_line_and_so_does_an_error() {
        let two = "# Works.\n\n[[work]]\nname = 'a'\n\n[[work]]\nname = 'b'\n";
        assert_eq!(works(two).unwrap().iter().map(|work| work.line).collect::<Vec<_>>(), [3, 6]);
        assert_eq!(works("[[work]]\nname = 'a'\n[[work]]\nname = 1\n").unwrap_err().0, 4);
        assert!(works("[[wrok]]\nname = 'a'\n").unwrap_err().1.contains("wrok"));
    }
}
