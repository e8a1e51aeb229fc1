//! How is the XML of OpenCV's FileStorage read? Elements with elements or words inside; what the elements are
//! is known by their names.

use super::error::FormatError;
use super::flow::refuse_second;
use super::node::{Budget, Node, Source, Value};

/// Reads the contents of `<opencv_storage>`.
pub(super) fn document(source: &Source) -> Result<Node, FormatError> {
    let mut xml = Xml { source, at: 0, budget: Budget::default() };
    xml.skip_between()?;
    let (name, node) = xml.element(0)?;
    if name != "opencv_storage" {
        return Err(source.syntax(node.offset, "<opencv_storage> is expected"));
    }
    xml.skip_between()?;
    match xml.rest().is_empty() {
        true => Ok(node),
        false => Err(source.syntax(xml.at, "nothing is expected behind the last element")),
    }
}

struct Xml<'a, 's> {
    source: &'a Source<'s>,
    at: usize,
    budget: Budget,
}

impl<'s> Xml<'_, 's> {
    fn rest(&self) -> &'s str {
        &self.source.text[self.at..]
    }

    fn complain<T>(&self, message: &str) -> Result<T, FormatError> {
        Err(self.source.syntax(self.at, message))
    }

    /// Takes everything up to and with `mark`.
    fn take_to(&mut self, mark: &str, unclosed: &str) -> Result<&'s str, FormatError> {
        let rest = self.rest();
        let Some(end) = rest.find(mark) else { return self.complain(unclosed) };
        self.at += end + mark.len();
        Ok(&rest[..end])
    }

    /// Blanks, comments and the declaration.
    fn skip_between(&mut self) -> Result<(), FormatError> {
        loop {
            let rest = self.rest();
            self.at += rest.len() - rest.trim_start().len();
            if self.rest().starts_with("<!--") {
                self.take_to("-->", "the comment is never closed")?;
            } else if self.rest().starts_with("<?") {
                self.take_to("?>", "the declaration is never closed")?;
            } else if self.rest().starts_with("<!") {
                return self.complain("definitions of document types are not read here");
            } else {
                return Ok(());
            }
        }
    }

    fn element(&mut self, depth: usize) -> Result<(&'s str, Node), FormatError> {
        let offset = self.at;
        self.budget.take(self.source, offset, depth)?;
        if !self.rest().starts_with('<') {
            return self.complain("an element is expected");
        }
        self.at += 1;
        let head = self.take_to(">", "the element's head is never closed")?;
        let (head, empty) = head.strip_suffix('/').map_or((head, false), |head| (head, true));
        let name = head.split_whitespace().next().unwrap_or("");
        let named = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
        if name.is_empty() || !name.chars().all(named) {
            return Err(self.source.syntax(offset, "an element's name is expected"));
        }
        if empty {
            return Ok((name, Node { offset, value: Value::Text(String::new()) }));
        }
        let value = self.contents(name, depth)?;
        Ok((name, Node { offset, value }))
    }

    /// What stands between an element's head and its end: either elements or words.
    fn contents(&mut self, name: &str, depth: usize) -> Result<Value, FormatError> {
        let mut text = String::new();
        let mut items = Vec::new();
        let mut pairs: Vec<(String, Node)> = Vec::new();
        loop {
            self.skip_between()?;
            if self.rest().starts_with("</") {
                self.at += 2;
                let end = self.take_to(">", "the element's end is never closed")?;
                if end.trim() != name {
                    return self.complain(&format!("</{name}> is expected"));
                }
                break;
            }
            if self.rest().starts_with('<') {
                let offset = self.at;
                let (key, node) = self.element(depth + 1)?;
                if key == "_" {
                    items.push(node);
                } else {
                    refuse_second(self.source, &pairs, key, offset)?;
                    pairs.push((key.to_string(), node));
                }
            } else {
                let Some(end) = self.rest().find('<') else {
                    return self.complain(&format!("<{name}> is never closed"));
                };
                text.push_str(&self.words(end)?);
            }
        }
        let kinds = [!text.trim().is_empty(), !items.is_empty(), !pairs.is_empty()];
        if kinds.iter().filter(|there| **there).count() > 1 {
            return self.complain("an element has words, <_> or named elements inside, not several of them");
        }
        Ok(match kinds {
            [_, true, _] => Value::List(items),
            [_, _, true] => Value::Map(pairs),
            _ => Value::Text(text.trim().trim_matches('"').to_string()),
        })
    }

    /// Words of so many bytes, with the five characters that XML writes by name.
    fn words(&mut self, length: usize) -> Result<String, FormatError> {
        let raw = &self.rest()[..length];
        const NAMED: [(&str, &str); 5] =
            [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&apos;", "'"), ("&amp;", "&")];
        let unknown =
            raw.match_indices('&').find(|(at, _)| !NAMED.iter().any(|n| raw[*at..].starts_with(n.0)));
        if let Some((at, _)) = unknown {
            return Err(self.source.syntax(self.at + at, "this entity is not read here"));
        }
        self.at += length;
        Ok(NAMED.iter().fold(raw.to_string(), |text, (name, character)| text.replace(name, character)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::node::Field;
    use super::*;

    #[test]
    fn what_opencv_writes_is_read() {
        let text = "<?xml version=\"1.0\"?>\n<opencv_storage>\n<K type_id=\"opencv-matrix\">\n  <rows>1</rows>\n  <cols>2</cols>\n  \
                    <dt>d</dt>\n  <data>\n    1. 2.5e+00</data></K>\n<!-- said -->\n<name>\"a &amp; b\"</name>\n<l><_>1</_><_>2</_></l>\n\
                    </opencv_storage>\n";
        let source = Source { file: "f", text };
        let node = document(&source).unwrap();
        let root = Field::root(source, &node);
        assert_eq!(root.need("K").unwrap().need("data").unwrap().numbers().unwrap(), [1.0, 2.5]);
        assert_eq!(root.need("name").unwrap().text().unwrap(), "a & b");
        assert_eq!(root.need("l").unwrap().numbers().unwrap(), [1.0, 2.0]);
    }

    #[test]
    fn complaints_say_where() {
        let cases = [
            ("<a>", "f:1:4: <a> is never closed"),
            ("<opencv_storage><a>1</b></opencv_storage>", "f:1:25: </a> is expected"),
            ("<!DOCTYPE x><a/>", "f:1:1: definitions of document types are not read here"),
            ("<other/>", "f:1:1: <opencv_storage> is expected"),
            ("<opencv_storage><a>&x;</a></opencv_storage>", "f:1:20: this entity is not read here"),
        ];
        for (text, expected) in cases {
            assert_eq!(document(&Source { file: "f", text }).unwrap_err().to_string(), expected);
        }
        assert!(document(&Source { file: "f", text: &"<a>".repeat(100) }).is_err());
    }
}
