//! How is the YAML of camera files read? Maps and lists by their indent, and values in brackets.
//!
//! The part of YAML that OpenCV's FileStorage, ROS, Kalibr and PyYAML write. OpenCV's header `%YAML:1.0` and
//! `key:value` within braces are no YAML to most readers; anchors, aliases, blocks of text (`|`, `>`) and
//! words over several lines are refused.

use super::error::FormatError;
use super::flow::{self, refuse_second};
use super::node::{Budget, Node, Source, Value};

/// Reads a document.
pub(super) fn document(source: &Source) -> Result<Node, FormatError> {
    let lines = lines_of(source)?;
    let mut yaml = Yaml { source, lines, next: 0, budget: Budget::default() };
    let Some(first) = yaml.lines.first().copied() else {
        return Err(source.syntax(0, "nothing but blanks and comments"));
    };
    let node = match source.text.as_bytes()[first.start] {
        b'{' | b'[' => yaml.inline(first.start, 0)?,
        _ => yaml.block(first.indent, 0)?,
    };
    match yaml.lines.get(yaml.next) {
        Some(line) => Err(source.syntax(line.start, "this indent fits nothing above")),
        None => Ok(node),
    }
}

/// A line with something on it.
#[derive(Debug, Clone, Copy)]
struct Line {
    /// Column of the first character, from 0.
    indent: usize,
    /// Byte of the first character.
    start: usize,
    /// Byte behind the last.
    end: usize,
}

/// Lines that are not blank, a comment, a directive or a document's mark.
fn lines_of(source: &Source) -> Result<Vec<Line>, FormatError> {
    let mut lines = Vec::new();
    let mut offset = 0;
    for raw in source.text.split_inclusive('\n') {
        let content = raw.trim_start_matches(' ');
        let (indent, start) = (raw.len() - content.len(), offset + raw.len() - content.len());
        let text = content.trim_end();
        offset += raw.len();
        let mark = indent == 0 && (text.starts_with('%') || text == "---" || text == "...");
        if text.is_empty() || text.starts_with('#') || mark {
            continue;
        }
        if text.starts_with('\t') {
            return Err(source.syntax(start, "a tab cannot indent"));
        }
        lines.push(Line { indent, start, end: start + text.len() });
    }
    Ok(lines)
}

struct Yaml<'a, 's> {
    source: &'a Source<'s>,
    lines: Vec<Line>,
    next: usize,
    budget: Budget,
}

impl Yaml<'_, '_> {
    fn line(&self) -> Option<Line> {
        self.lines.get(self.next).copied()
    }

    fn text(&self, line: Line) -> &str {
        &self.source.text[line.start..line.end]
    }

    /// The map or list whose lines have this indent.
    fn block(&mut self, indent: usize, depth: usize) -> Result<Node, FormatError> {
        let offset = self.line().map_or(0, |line| line.start);
        self.budget.take(self.source, offset, depth)?;
        let listed = self.line().is_some_and(|line| is_item(self.text(line)));
        let value = if listed {
            Value::List(self.items(indent, depth)?)
        } else {
            Value::Map(self.pairs(indent, depth)?)
        };
        Ok(Node { offset, value })
    }

    fn items(&mut self, indent: usize, depth: usize) -> Result<Vec<Node>, FormatError> {
        let mut items = Vec::new();
        while let Some(line) = self.line().filter(|line| line.indent == indent) {
            let text = self.text(line);
            if !is_item(text) {
                break;
            }
            let blanks = text[1..].len() - text[1..].trim_start().len();
            let inner = Line {
                indent: indent + 1 + blanks,
                start: (line.start + 1 + blanks).min(line.end),
                end: line.end,
            };
            if inner.start == inner.end {
                self.next += 1;
                items.push(self.below(indent + 1, inner.start, depth)?);
            } else if is_item(self.text(inner)) || self.key(inner).is_some() {
                // What stands behind the dash is the first line of a block of its own.
                self.lines[self.next] = inner;
                items.push(self.block(inner.indent, depth + 1)?);
            } else {
                items.push(self.inline(inner.start, depth + 1)?);
            }
        }
        Ok(items)
    }

    fn pairs(&mut self, indent: usize, depth: usize) -> Result<Vec<(String, Node)>, FormatError> {
        let mut pairs: Vec<(String, Node)> = Vec::new();
        while let Some(line) = self.line().filter(|line| line.indent == indent) {
            if is_item(self.text(line)) {
                break;
            }
            let Some((key, value_at)) = self.key(line) else {
                return Err(self.source.syntax(line.start, "`key: value` is expected"));
            };
            refuse_second(self.source, &pairs, &key, line.start)?;
            let node = match self.value_on_line(value_at, line) {
                Some(start) => self.inline(start, depth + 1)?,
                None => {
                    self.next += 1;
                    self.value_below(indent, value_at, depth)?
                }
            };
            pairs.push((key, node));
        }
        Ok(pairs)
    }

    /// Key of a line, and where its value may begin: behind the colon.
    fn key(&self, line: Line) -> Option<(String, usize)> {
        let text = self.text(line);
        let (key, colon) = match text.as_bytes()[0] {
            quote @ (b'"' | b'\'') => {
                let close = text[1..].find(char::from(quote))? + 1;
                (&text[1..close], close + 1 + text[close + 1..].find(':')?)
            }
            b'[' | b'{' | b'&' | b'*' | b'|' | b'>' => return None,
            _ => {
                let colon = text
                    .match_indices(':')
                    .map(|(at, _)| at)
                    .find(|at| text[at + 1..].is_empty() || text[at + 1..].starts_with([' ', '\t']))?;
                (text[..colon].trim_end(), colon)
            }
        };
        Some((key.to_string(), line.start + colon + 1))
    }

    /// Where a value begins on the line of its key, behind a tag, if it is there.
    fn value_on_line(&self, from: usize, line: Line) -> Option<usize> {
        let mut rest = self.source.text[from..line.end].trim_start();
        if rest.starts_with('!') {
            rest = rest.split_once([' ', '\t']).map_or("", |(_, value)| value.trim_start());
        }
        (!rest.is_empty() && !rest.starts_with('#')).then(|| line.end - rest.len())
    }

    /// The value of a key with nothing behind it; a list may stand at the key's own indent.
    fn value_below(&mut self, indent: usize, offset: usize, depth: usize) -> Result<Node, FormatError> {
        match self.line() {
            Some(line) if line.indent == indent && is_item(self.text(line)) => self.block(indent, depth + 1),
            _ => self.below(indent + 1, offset, depth),
        }
    }

    /// The block that is indented by at least so much, or an empty value.
    fn below(&mut self, least: usize, offset: usize, depth: usize) -> Result<Node, FormatError> {
        match self.line() {
            Some(line) if line.indent >= least => {
                let bracketed = matches!(self.source.text.as_bytes()[line.start], b'[' | b'{');
                if bracketed {
                    self.inline(line.start, depth + 1)
                } else {
                    self.block(line.indent, depth + 1)
                }
            }
            _ => {
                self.budget.take(self.source, offset, depth + 1)?;
                Ok(Node { offset, value: Value::Text(String::new()) })
            }
        }
    }

    /// A word, a number, or brackets, which may end some lines below.
    fn inline(&mut self, start: usize, depth: usize) -> Result<Node, FormatError> {
        let (node, end) = match self.source.text.as_bytes()[start] {
            b'[' | b'{' | b'"' | b'\'' => flow::value_at(self.source, start, depth, &mut self.budget)?,
            b'&' | b'*' | b'|' | b'>' => {
                return Err(self
                    .source
                    .syntax(start, "anchors, aliases and blocks of text are not read here"));
            }
            _ => {
                self.budget.take(self.source, start, depth)?;
                self.plain(start)
            }
        };
        self.end_line(end)?;
        Ok(node)
    }

    /// The rest of a line, without a comment.
    fn plain(&self, start: usize) -> (Node, usize) {
        let rest = self.source.text[start..].lines().next().unwrap_or("");
        let text = rest.split(" #").next().unwrap_or("").trim();
        (Node { offset: start, value: Value::Text(text.to_string()) }, start + text.len())
    }

    /// Goes on below the line on which a value ended.
    fn end_line(&mut self, end: usize) -> Result<(), FormatError> {
        let rest = self.source.text[end..].lines().next().unwrap_or("").trim();
        if !(rest.is_empty() || rest.starts_with('#')) {
            return Err(self.source.syntax(end, "nothing is expected behind the value"));
        }
        while self.line().is_some_and(|line| line.start < end) {
            self.next += 1;
        }
        Ok(())
    }
}

/// Whether a line begins an item of a list.
fn is_item(text: &str) -> bool {
    text == "-" || text.starts_with("- ")
}

#[cfg(test)]
mod tests {
    use super::super::node::Field;
    use super::*;

    fn read(text: &str) -> Result<Node, FormatError> {
        document(&Source { file: "f", text })
    }

    #[test]
    fn what_opencv_writes_is_read() {
        let text = "%YAML:1.0\n---\nimage_width: 640\nK: !!opencv-matrix\n   rows: 1\n   cols: 3\n   dt: d\n   \
                    data: [ 1., 2.5000000000000000e+00,\n       3. ]\nframes:\n   - { a:1, b:\"x\" }\n";
        let node = read(text).unwrap();
        let root = Field::root(Source { file: "f", text }, &node);
        assert_eq!(root.need("image_width").unwrap().side().unwrap(), 640);
        assert_eq!(root.need("K").unwrap().need("data").unwrap().numbers().unwrap(), [1.0, 2.5, 3.0]);
    }

    #[test]
    fn lists_by_dashes_are_lists_of_rows() {
        let text = "cam0:\n  T:\n  - [1.0, 2.0]\n  - [3.0, 4.0]\n  U:\n  - - 1\n    - 2\n  - - 3\n    - 4\n  name: a # b\n";
        let node = read(text).unwrap();
        let root = Field::root(Source { file: "f", text }, &node);
        let camera = root.need("cam0").unwrap();
        for key in ["T", "U"] {
            assert_eq!(camera.need(key).unwrap().rows().unwrap(), [[1.0, 2.0], [3.0, 4.0]]);
        }
        assert_eq!(camera.need("name").unwrap().text().unwrap(), "a");
    }

    #[test]
    fn complaints_say_where() {
        let cases = [
            ("a: 1\n  b: 2\n", "f:2:3: this indent fits nothing above"),
            ("a: 1\na: 2\n", "f:2:1: `a` stands here a second time"),
            ("a: [1, 2\n", "f:2:1: a comma or ] is expected"),
            ("a: [1] 2\n", "f:1:7: nothing is expected behind the value"),
            ("a: &x 1\n", "f:1:4: anchors, aliases and blocks of text are not read here"),
            ("words\n", "f:1:1: `key: value` is expected"),
            ("a:\n\tb: 1\n", "f:2:1: a tab cannot indent"),
            ("# nothing\n", "f:1:1: nothing but blanks and comments"),
        ];
        for (text, expected) in cases {
            assert_eq!(read(text).unwrap_err().to_string(), expected);
        }
        let deep: String = (0..100).map(|i| format!("{}a:\n", " ".repeat(i))).collect();
        assert!(read(&deep).unwrap_err().to_string().contains("32 levels"));
        assert!(read(&"- ".repeat(100)).is_err());
    }
}
