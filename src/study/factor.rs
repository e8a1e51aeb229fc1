//! What varies, and how does a level change the study? A level takes the place of one field or of several
//! together.

use super::inputs::names_a_file;
use super::spec_error::{SpecError, place};
use serde::{Deserialize, Serialize};
use std::collections::HashSet;
use toml::{Spanned, Table, Value};

/// One factor of a study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Factor {
    /// Name in tables and figures.
    pub name: String,
    /// Unit of the levels, empty for a pure number or a word.
    #[serde(default)]
    pub unit: String,
    /// Path of the fields that a level sets, such as `["scene.poses.views"]`. With several, each level is a
    /// list of as many values.
    pub set: Vec<String>,
    /// The levels.
    pub levels: Spanned<Vec<Spanned<Value>>>,
    /// Names of the levels; their values otherwise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub labels: Vec<String>,
}

impl Factor {
    /// How many levels there are.
    pub fn count(&self) -> usize {
        self.levels.get_ref().len()
    }

    fn value(&self, level: usize) -> &Value {
        self.levels.get_ref()[level].get_ref()
    }

    /// What a level is called.
    pub fn label(&self, level: usize) -> String {
        match (self.labels.get(level), self.value(level)) {
            (Some(label), _) => label.clone(),
            (None, Value::String(text)) => text.clone(),
            (None, value) => value.to_string(),
        }
    }

    /// The level as a number, where it is one.
    pub fn number(&self, level: usize) -> Option<f64> {
        match self.value(level) {
            Value::Integer(i) => Some(*i as f64),
            Value::Float(f) => Some(*f),
            _ => None,
        }
    }

    /// Whether every level is a number.
    pub fn is_numeric(&self) -> bool {
        (0..self.count()).all(|level| self.number(level).is_some())
    }

    pub(super) fn check(&self, text: &str) -> Result<(), SpecError> {
        if self.count() == 0 || self.set.is_empty() {
            return Err(self.error(
                text,
                None,
                "it needs at least one level, and a field to `set`".to_string(),
            ));
        }
        let names_a_file = |level: &Spanned<Value>| names_a_file(&self.set, level.get_ref());
        if self.labels.is_empty() && self.levels.get_ref().iter().any(names_a_file) {
            return Err(SpecError::Unlabelled(self.name.clone()));
        }
        if !self.labels.is_empty() && self.labels.len() != self.count() {
            let counts =
                format!("{} labels for {} levels: give one a level", self.labels.len(), self.count());
            return Err(self.error(text, None, counts));
        }
        self.refuse_same_levels(text)
    }

    /// Levels that are called the same cannot be told apart in any table.
    fn refuse_same_levels(&self, text: &str) -> Result<(), SpecError> {
        let mut seen = HashSet::with_capacity(self.count());
        match (0..self.count()).find(|&level| !seen.insert(self.label(level))) {
            Some(level) => {
                let message = format!(
                    "level {} is named twice: give each a value or a label of its own",
                    self.label(level)
                );
                Err(self.error(text, Some(level), message))
            }
            None => Ok(()),
        }
    }

    /// Puts a level into the study's tree.
    pub(super) fn apply(&self, tree: &mut Table, level: usize, text: &str) -> Result<(), SpecError> {
        let value = self.value(level);
        let parts: Vec<&Value> = match (self.set.len(), value) {
            (1, value) => vec![value],
            (n, Value::Array(parts)) if parts.len() == n => parts.iter().collect(),
            (n, other) => {
                let message =
                    format!("level {other} must be a list of {n} values, one for each field of `set`");
                return Err(self.error(text, Some(level), message));
            }
        };
        for (path, part) in self.set.iter().zip(parts) {
            put(tree, path, part).map_err(|message| self.error(text, Some(level), message))?;
        }
        Ok(())
    }

    pub(super) fn error(&self, text: &str, level: Option<usize>, message: String) -> SpecError {
        let span = level.map_or(self.levels.span(), |level| self.levels.get_ref()[level].span());
        let (line, column) = place(text, span.start);
        SpecError::Factor { line, column, factor: self.name.clone(), message }
    }
}

/// Replaces or adds the value at a dotted path. Its parents must be there: a misspelt table is an error, and
/// a misspelt field is found when the tree is read.
fn put(tree: &mut Table, path: &str, value: &Value) -> Result<(), String> {
    let (parents, field) =
        path.rsplit_once('.').ok_or_else(|| format!("`{path}`: name a field of scene or estimator"))?;
    let mut table = tree;
    for parent in parents.split('.') {
        table = table
            .get_mut(parent)
            .and_then(Value::as_table_mut)
            .ok_or_else(|| format!("`{path}`: there is no table `{parent}` in this study"))?;
    }
    table.insert(field.to_string(), value.clone());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn factor(set: &str, levels: &str) -> Factor {
        toml::from_str(&format!("name = \"f\"\nset = {set}\nlevels = {levels}\n")).unwrap()
    }

    #[test]
    fn a_level_is_a_number_where_it_is_written_as_one() {
        let numbers = factor("[\"scene.noise_px\"]", "[4, 0.5]");
        assert_eq!((numbers.number(0), numbers.number(1)), (Some(4.0), Some(0.5)));
        assert!(numbers.is_numeric());
        let mixed = factor("[\"estimator.model\"]", "[2, \"pinhole\"]");
        assert_eq!((mixed.number(0), mixed.number(1)), (Some(2.0), None));
        assert!(!mixed.is_numeric());
        assert_eq!((mixed.label(0), mixed.label(1)), ("2".to_string(), "pinhole".to_string()));
    }

    #[test]
    fn a_level_of_two_fields_has_two_values() {
        let apply = |levels: &str| {
            let both = factor("[\"scene.a\", \"scene.b\"]", levels);
            let mut tree: Table = toml::from_str("[scene]\na = 0\nb = 0").unwrap();
            both.apply(&mut tree, 0, "").map(|()| (tree["scene"]["a"].clone(), tree["scene"]["b"].clone()))
        };
        assert_eq!(apply("[[1, 2]]").unwrap(), (Value::Integer(1), Value::Integer(2)));
        for wrong in ["[[1]]", "[[1, 2, 3]]", "[1]"] {
            let refused = apply(wrong).unwrap_err().to_string();
            assert!(refused.contains("must be a list of 2 values"), "{wrong}: {refused}");
        }
    }

    #[test]
    fn labels_are_as_many_as_levels_and_each_is_called_once() {
        let with = |levels: &str, labels: &str| {
            let text = format!("name = \"f\"\nset = [\"scene.a\"]\nlevels = {levels}\nlabels = {labels}\n");
            toml::from_str::<Factor>(&text).unwrap().check("").map_err(|refused| refused.to_string())
        };
        assert_eq!(with("[1, 2]", "[]"), Ok(()));
        assert_eq!(with("[1, 1]", "[\"a\", \"b\"]"), Ok(()));
        for (levels, labels, told) in [
            ("[1, 2]", "[\"a\"]", "1 labels for 2 levels"),
            ("[1, 2]", "[\"a\", \"a\"]", "level a is named twice"),
            ("[1, 1]", "[]", "level 1 is named twice"),
            ("[]", "[]", "at least one level"),
        ] {
            let refused = with(levels, labels).unwrap_err();
            assert!(refused.contains(told), "{levels} {labels}: {refused}");
        }
    }
}
