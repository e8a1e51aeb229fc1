//! What do the formats have in common? A tree of named values, each with its place in the text, so that every
//! complaint says where.

use super::error::FormatError;
use crate::geometry::Mat3;

/// A file's name and its text.
#[derive(Debug, Clone, Copy)]
pub(super) struct Source<'a> {
    pub file: &'a str,
    pub text: &'a str,
}

impl Source<'_> {
    /// Line and column, from 1, of a byte of the text.
    pub fn place(&self, offset: usize) -> (usize, usize) {
        let mut end = offset.min(self.text.len());
        while !self.text.is_char_boundary(end) {
            end -= 1;
        }
        let before = &self.text[..end];
        let line = before.bytes().filter(|byte| *byte == b'\n').count() + 1;
        let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
        (line, column)
    }

    /// The complaint that the text has not its form.
    pub fn syntax(&self, offset: usize, message: impl Into<String>) -> FormatError {
        let (line, column) = self.place(offset);
        FormatError::Syntax { file: self.file.into(), line, column, message: message.into() }
    }

    /// The complaint about a value.
    pub fn value(&self, offset: usize, what: &str, message: impl Into<String>) -> FormatError {
        let (line, column) = self.place(offset);
        FormatError::Value {
            file: self.file.into(),
            line,
            column,
            what: what.into(),
            message: message.into(),
        }
    }

    /// A finite number.
    pub fn number(&self, offset: usize, what: &str, text: &str) -> Result<f64, FormatError> {
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            Ok(_) => Err(self.value(offset, what, format!("`{}` is not a finite number", shortened(text)))),
            Err(_) => Err(self.value(offset, what, format!("`{}` is not a number", shortened(text)))),
        }
    }

    /// A refusal of a lens by its name.
    pub fn lens(&self, model: impl Into<String>, help: &'static str) -> FormatError {
        FormatError::Lens { file: self.file.into(), model: model.into(), help }
    }
}

/// The beginning of what may be long.
pub(super) fn shortened(text: &str) -> String {
    const MOST: usize = 40;
    let mut short: String = text.chars().take(MOST).collect();
    if text.chars().nth(MOST).is_some() {
        short.push_str("...");
    }
    short
}

/// Depth of nested values: no camera file goes beyond six.
pub(super) const MOST_DEPTH: usize = 32;
/// Values in a file: a tree of them takes some 100 MB.
pub(super) const MOST_NODES: usize = 1_000_000;

/// Names in a map: each is compared with those before it.
pub(super) const MOST_NAMES: usize = 1000;

/// A value and the byte at which it begins.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Node {
    pub offset: usize,
    pub value: Value,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    /// A number, a word or a text, without its quotes.
    Text(String),
    List(Vec<Node>),
    Map(Vec<(String, Node)>),
}

/// Counts what is read, so that a hostile file cannot fill the memory.
#[derive(Debug, Default)]
pub(super) struct Budget {
    nodes: usize,
}

impl Budget {
    /// One value more, at a depth.
    pub fn take(&mut self, source: &Source, offset: usize, depth: usize) -> Result<(), FormatError> {
        self.nodes += 1;
        if depth > MOST_DEPTH {
            return Err(source.syntax(offset, format!("more than {MOST_DEPTH} levels of nesting")));
        }
        if self.nodes > MOST_NODES {
            return Err(source.syntax(offset, format!("more than {MOST_NODES} values")));
        }
        Ok(())
    }
}

/// A node on its way to a number: what it is called, and where complaints point.
#[derive(Debug, Clone)]
pub(super) struct Field<'a> {
    pub source: Source<'a>,
    pub name: String,
    pub node: &'a Node,
}

impl<'a> Field<'a> {
    pub fn root(source: Source<'a>, node: &'a Node) -> Field<'a> {
        Field { source, name: String::new(), node }
    }

    /// The value of a key; `None` where it is absent or empty.
    pub fn get(&self, key: &str) -> Option<Field<'a>> {
        let Value::Map(pairs) = &self.node.value else { return None };
        let (_, node) = pairs.iter().find(|(name, _)| name == key)?;
        (!is_empty(node)).then(|| self.child(key.to_string(), node))
    }

    /// The value of the first key that is there.
    pub fn get_any(&self, keys: &[&str]) -> Option<Field<'a>> {
        keys.iter().find_map(|key| self.get(key))
    }

    /// The value of a key that must be there.
    pub fn need(&self, key: &str) -> Result<Field<'a>, FormatError> {
        self.get(key).ok_or_else(|| self.missing(key))
    }

    /// The complaint that nothing of that name is inside.
    pub fn missing(&self, key: &str) -> FormatError {
        let (line, _) = self.source.place(self.node.offset);
        FormatError::Missing { file: self.source.file.into(), line, what: joined(&self.name, key) }
    }

    /// All pairs of a map; none of anything else.
    pub fn pairs(&self) -> Vec<(&'a str, Field<'a>)> {
        let Value::Map(pairs) = &self.node.value else { return Vec::new() };
        pairs.iter().map(|(key, node)| (key.as_str(), self.child(key.clone(), node))).collect()
    }

    fn child(&self, key: String, node: &'a Node) -> Field<'a> {
        Field { source: self.source, name: joined(&self.name, &key), node }
    }

    pub fn text(&self) -> Result<&'a str, FormatError> {
        match &self.node.value {
            Value::Text(text) => Ok(text),
            _ => Err(self.wrong("a single value is expected")),
        }
    }

    pub fn number(&self) -> Result<f64, FormatError> {
        self.source.number(self.node.offset, &self.name, self.text()?.trim())
    }

    /// A length of an image's side, px.
    pub fn side(&self) -> Result<usize, FormatError> {
        let number = self.number()?;
        side(number).ok_or_else(|| self.wrong(format!("{number} is no number of pixels")))
    }

    /// A list of numbers; in XML, words with blanks between them.
    pub fn numbers(&self) -> Result<Vec<f64>, FormatError> {
        match &self.node.value {
            Value::List(items) => items.iter().map(|item| self.child("".into(), item).number()).collect(),
            Value::Text(text) => text
                .split_whitespace()
                .map(|word| self.source.number(self.node.offset, &self.name, word))
                .collect(),
            Value::Map(_) => Err(self.wrong("a list of numbers is expected")),
        }
    }

    /// Exactly `N` numbers.
    pub fn array<const N: usize>(&self) -> Result<[f64; N], FormatError> {
        let numbers = self.numbers()?;
        let got = numbers.len();
        numbers.try_into().map_err(|_| self.wrong(format!("{N} numbers are expected, got {got}")))
    }

    /// Rows of numbers.
    pub fn rows(&self) -> Result<Vec<Vec<f64>>, FormatError> {
        match &self.node.value {
            Value::List(rows) => rows.iter().map(|row| self.child("".into(), row).numbers()).collect(),
            _ => Err(self.wrong("a list of rows is expected")),
        }
    }

    /// The numbers of a matrix, row by row: the `data` that OpenCV and ROS write, as many as `rows` and
    /// `cols` say, or a list of numbers or rows.
    pub fn matrix(&self) -> Result<Vec<f64>, FormatError> {
        let data = self.get("data").unwrap_or_else(|| self.clone());
        let numbers =
            data.numbers().or_else(|error| data.rows().map(|rows| rows.concat()).map_err(|_| error))?;
        let count = |key: &str| self.get(key).map(|count| count.number()).transpose();
        if let (Some(rows), Some(columns)) = (count("rows")?, count("cols")?)
            && rows * columns != numbers.len() as f64
        {
            let got = numbers.len();
            return Err(self.wrong(format!("{rows} rows of {columns} are said, and {got} numbers are there")));
        }
        Ok(numbers)
    }

    /// A matrix of three rows of three.
    pub fn square3(&self) -> Result<Mat3, FormatError> {
        let rows = self.rows()?;
        if rows.len() != 3 || rows.iter().any(|row| row.len() != 3) {
            return Err(self.wrong("3 rows of 3 numbers are expected"));
        }
        Ok(Mat3::from_fn(|i, j| rows[i][j]))
    }

    /// A complaint about this value.
    pub fn wrong(&self, message: impl Into<String>) -> FormatError {
        self.source.value(self.node.offset, &self.name, message)
    }
}

/// A number of pixels along a side.
pub(super) fn side(number: f64) -> Option<usize> {
    let most = super::super::input::MOST_SIDE_PX as f64;
    (number.fract() == 0.0 && (1.0..=most).contains(&number)).then_some(number as usize)
}

fn joined(path: &str, key: &str) -> String {
    match (path, key) {
        ("", key) => key.to_string(),
        (path, "") => path.to_string(),
        (path, key) => format!("{path}.{key}"),
    }
}

fn is_empty(node: &Node) -> bool {
    matches!(&node.value, Value::Text(text) if matches!(text.as_str(), "" | "~" | "null" | "None"))
}
