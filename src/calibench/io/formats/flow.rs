//! How are values in brackets read? Lists and maps of JSON, of YAML's flow style and of Python's literals,
//! over as many lines as they take.

use super::error::FormatError;
use super::node::{Budget, MOST_NAMES, Node, Source, Value, shortened};

/// Reads one value that begins at `offset`; returns it with the offset behind it.
pub(super) fn value_at(
    source: &Source,
    offset: usize,
    depth: usize,
    budget: &mut Budget,
) -> Result<(Node, usize), FormatError> {
    let mut flow = Flow { source, bytes: source.text.as_bytes(), at: offset, budget };
    let node = flow.value(depth)?;
    Ok((node, flow.at))
}

/// Reads a text that is one value in brackets, as JSON and Python's literals are.
pub(super) fn document(source: &Source) -> Result<Node, FormatError> {
    let mut budget = Budget::default();
    let (node, end) = value_at(source, 0, 0, &mut budget)?;
    let mut rest = Flow { source, bytes: source.text.as_bytes(), at: end, budget: &mut budget };
    rest.skip_blanks();
    match rest.at == rest.bytes.len() {
        true => Ok(node),
        false => Err(source.syntax(rest.at, "nothing is expected behind the last bracket")),
    }
}

/// Strict JSON, with the places of its values.
pub(super) fn json(source: &Source) -> Result<Node, FormatError> {
    serde_json::from_str::<serde::de::IgnoredAny>(source.text).map_err(|error| FormatError::Syntax {
        file: source.file.into(),
        line: error.line(),
        column: error.column(),
        message: error.to_string(),
    })?;
    document(source)
}

struct Flow<'a, 's> {
    source: &'a Source<'s>,
    bytes: &'a [u8],
    at: usize,
    budget: &'a mut Budget,
}

impl Flow<'_, '_> {
    fn peek(&self) -> Option<u8> {
        self.bytes.get(self.at).copied()
    }

    fn complain<T>(&self, message: &str) -> Result<T, FormatError> {
        Err(self.source.syntax(self.at, message))
    }

    /// Blanks, line ends and comments.
    fn skip_blanks(&mut self) {
        while let Some(byte) = self.peek() {
            match byte {
                b' ' | b'\t' | b'\r' | b'\n' => self.at += 1,
                b'#' => self.at = self.line_end(),
                _ => break,
            }
        }
    }

    fn line_end(&self) -> usize {
        let rest = &self.bytes[self.at..];
        self.at + rest.iter().position(|byte| *byte == b'\n').unwrap_or(rest.len())
    }

    fn value(&mut self, depth: usize) -> Result<Node, FormatError> {
        self.skip_blanks();
        self.skip_tag();
        let offset = self.at;
        self.budget.take(self.source, offset, depth)?;
        let value = match self.peek() {
            None => return self.complain("a value is expected"),
            Some(b'[') => Value::List(self.list(b']', depth)?),
            Some(b'(') => Value::List(self.list(b')', depth)?),
            Some(b'{') => Value::Map(self.map(depth)?),
            Some(b'"' | b'\'') => Value::Text(self.quoted()?),
            // The bytes of Python: what they hold is nothing that is read here.
            Some(b'b') if matches!(self.bytes.get(self.at + 1), Some(b'"' | b'\'')) => {
                self.at += 1;
                Value::Text(self.quoted()?)
            }
            Some(_) => Value::Text(self.plain(b",]})\n\r#", depth > 0)?),
        };
        Ok(Node { offset, value })
    }

    /// `!!name` before a value says its type, which its use says too.
    fn skip_tag(&mut self) {
        if self.peek() == Some(b'!') {
            while self.peek().is_some_and(|byte| !byte.is_ascii_whitespace()) {
                self.at += 1;
            }
            self.skip_blanks();
        }
    }

    fn list(&mut self, close: u8, depth: usize) -> Result<Vec<Node>, FormatError> {
        self.at += 1;
        let mut items = Vec::new();
        loop {
            self.skip_blanks();
            if self.peek() == Some(close) {
                break;
            }
            items.push(self.value(depth + 1)?);
            if !self.comma(close)? {
                break;
            }
        }
        self.at += 1;
        Ok(items)
    }

    fn map(&mut self, depth: usize) -> Result<Vec<(String, Node)>, FormatError> {
        self.at += 1;
        let mut pairs: Vec<(String, Node)> = Vec::new();
        loop {
            self.skip_blanks();
            if self.peek() == Some(b'}') {
                break;
            }
            let offset = self.at;
            let key = match self.peek() {
                Some(b'"' | b'\'') => self.quoted()?,
                _ => self.plain(b":,]}\n\r#", true)?,
            };
            self.skip_blanks();
            if self.peek() != Some(b':') {
                return self.complain("a colon is expected behind a key");
            }
            self.at += 1;
            refuse_second(self.source, &pairs, &key, offset)?;
            let node = self.value(depth + 1)?;
            pairs.push((key, node));
            if !self.comma(b'}')? {
                break;
            }
        }
        self.at += 1;
        Ok(pairs)
    }

    /// Whether a comma stands here, and not the closing bracket.
    fn comma(&mut self, close: u8) -> Result<bool, FormatError> {
        self.skip_blanks();
        match self.peek() {
            Some(b',') => {
                self.at += 1;
                Ok(true)
            }
            Some(byte) if byte == close => Ok(false),
            _ => self.complain(&format!("a comma or {} is expected", char::from(close))),
        }
    }

    /// A word or number up to one of `ends`.
    fn plain(&mut self, ends: &[u8], needed: bool) -> Result<String, FormatError> {
        let start = self.at;
        while self.peek().is_some_and(|byte| !ends.contains(&byte)) {
            self.at += 1;
        }
        let text = self.source.text[start..self.at].trim();
        if text.is_empty() && needed {
            return self.complain("a value is expected");
        }
        Ok(text.to_string())
    }

    fn quoted(&mut self) -> Result<String, FormatError> {
        let start = self.at;
        let quote = self.bytes[start];
        self.at += 1;
        let mut text = String::new();
        let mut from = self.at;
        while let Some(byte) = self.peek() {
            if byte == quote {
                text.push_str(&self.source.text[from..self.at]);
                self.at += 1;
                return Ok(text);
            }
            if byte == b'\\' {
                text.push_str(&self.source.text[from..self.at]);
                self.at += 1;
                text.push(self.escaped()?);
                from = self.at;
            } else {
                self.at += 1;
            }
        }
        Err(self.source.syntax(start, "the quote is never closed"))
    }

    /// The character of an escape, behind its backslash.
    fn escaped(&mut self) -> Result<char, FormatError> {
        let Some(c) = self.source.text[self.at..].chars().next() else {
            return self.complain("the quote is never closed");
        };
        self.at += c.len_utf8();
        Ok(match c {
            'n' => '\n',
            't' => '\t',
            'r' => '\r',
            'u' => {
                let digits = self.source.text.get(self.at..self.at + 4).unwrap_or("");
                let Ok(code) = u32::from_str_radix(digits, 16) else {
                    return self.complain("four hexadecimal digits are expected");
                };
                self.at += 4;
                // Half of a pair is no character: names of cameras do not need it.
                char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER)
            }
            other => other,
        })
    }
}

/// A key that stands twice leaves open which value counts.
pub(super) fn refuse_second(
    source: &Source,
    pairs: &[(String, Node)],
    key: &str,
    offset: usize,
) -> Result<(), FormatError> {
    if pairs.len() == MOST_NAMES {
        return Err(source.syntax(offset, format!("more than {MOST_NAMES} names")));
    }
    match pairs.iter().any(|(known, _)| known == key) {
        true => Err(source.syntax(offset, format!("`{}` stands here a second time", shortened(key)))),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Node, FormatError> {
        document(&Source { file: "f", text })
    }

    #[test]
    fn the_three_ways_to_write_a_map_give_the_same_tree() {
        let json = read(r#"{"a": [1, 2.5], "b": {"c": "x"}}"#).unwrap();
        let texts = [
            "# said first\n{ 'a': [ 1, 2.5, ], # and here\n 'b': {'c': 'x'} }",
            "{ a:[ 1, 2.5 ], b: !!map { c: x } }",
            "{'a': (1, 2.5), 'b': {'c': b'x'}}",
        ];
        for text in texts {
            assert_eq!(without_places(&read(text).unwrap()), without_places(&json), "{text}");
        }
    }

    fn without_places(node: &Node) -> Node {
        let value = match &node.value {
            Value::Text(text) => Value::Text(text.clone()),
            Value::List(items) => Value::List(items.iter().map(without_places).collect()),
            Value::Map(pairs) => {
                Value::Map(pairs.iter().map(|(key, node)| (key.clone(), without_places(node))).collect())
            }
        };
        Node { offset: 0, value }
    }

    #[test]
    fn complaints_say_where() {
        let cases = [
            ("{'a': 1,\n 'b' 2}", "f:2:6: a colon is expected behind a key"),
            ("[1, 2", "f:1:6: a comma or ] is expected"),
            ("{a: 1, a: 2}", "f:1:8: `a` stands here a second time"),
            ("['x", "f:1:2: the quote is never closed"),
            ("[1] 2", "f:1:5: nothing is expected behind the last bracket"),
            ("[1,, 2]", "f:1:4: a value is expected"),
        ];
        for (text, expected) in cases {
            assert_eq!(read(text).unwrap_err().to_string(), expected);
        }
        let deep = "[".repeat(100);
        assert!(read(&deep).unwrap_err().to_string().contains("32 levels"), "no stack is used up");
    }
}
