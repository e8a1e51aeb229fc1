//! Which files does a study read beside its own? Tables of marks and poses that its scenes name, kept by their content: where they lie is no
//! part of a study.

use super::spec_error::SpecError;
use calibench::io::hash::sha256_hex;
use calibench::io::input::MOST_SPEC_BYTES;
use calibench::io::read_regular_text;
use serde_json::Value as Json;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;
use toml::{Table, Value};

/// The text of every file that a study names, by the name that it gives it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Inputs(Arc<BTreeMap<String, String>>);

/// The field that names a file, of a target and of poses.
const FIELD: &str = "file";

impl Inputs {
    /// The files that a study names, read from the folder in which it lies; names that begin with `/` are taken as they are.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn beside(spec: &Path, text: &str) -> Result<Inputs, SpecError> {
        let folder = spec.parent().unwrap_or(Path::new(""));
        let mut files = BTreeMap::new();
        let mut room = MOST_SPEC_BYTES;
        for name in named_in(text) {
            let read = read_regular_text(&folder.join(&name), room);
            let content =
                read.map_err(|cause| SpecError::Input { name: name.clone(), cause: cause.to_string() })?;
            // All of them together stand in one file of the run.
            room -= content.len() as u64;
            files.insert(name, content);
        }
        Ok(Inputs(Arc::new(files)))
    }

    /// Those that stand in `inputs.json` of a run; `None` if the text is none of that.
    pub(super) fn parse(text: &str) -> Option<Inputs> {
        Some(Inputs(Arc::new(serde_json::from_str(text).ok()?)))
    }

    /// The text of `inputs.json`.
    pub(super) fn to_text(&self) -> String {
        let value = serde_json::to_value(&*self.0).expect("names and texts are JSON");
        format!("{value:#}\n")
    }

    /// Whether the study names none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// SHA-256 of each, by its name.
    pub fn hashes(&self) -> BTreeMap<String, String> {
        self.0.iter().map(|(name, text)| (name.clone(), sha256_hex(text.as_bytes()))).collect()
    }

    /// The text of a file.
    pub(super) fn get(&self, name: &str) -> Result<&str, SpecError> {
        self.0.get(name).map(String::as_str).ok_or_else(|| SpecError::Input {
            name: name.to_string(),
            cause: "it was not read: a study that names files is read from its own file".to_string(),
        })
    }

    /// Puts the content of every file in the place of its name in a study's canonical tree.
    pub(super) fn put_contents(&self, spec: &mut Json) {
        if self.is_empty() {
            return;
        }
        let hashes = self.hashes();
        put_in_fields(&mut spec["scene"], &hashes);
        for factor in spec["factor"].as_array_mut().into_iter().flatten() {
            let fields: Vec<bool> = factor["set"]
                .as_array()
                .into_iter()
                .flatten()
                .map(|p| p.as_str().is_some_and(is_name))
                .collect();
            for level in factor["levels"].as_array_mut().into_iter().flatten() {
                put_in_fields(level, &hashes);
                match (&fields[..], level) {
                    ([true], name) => put(name, &hashes),
                    ([_], _) => {}
                    (_, parts) => {
                        let parts = parts.as_array_mut().into_iter().flatten().zip(&fields);
                        parts.filter(|(_, is_file)| **is_file).for_each(|(part, _)| put(part, &hashes));
                    }
                }
            }
        }
    }
}

/// Whether the field at a path names a file.
fn is_name(path: &str) -> bool {
    path.rsplit('.').next() == Some(FIELD)
}

fn put(name: &mut Json, hashes: &BTreeMap<String, String>) {
    if let Some(hash) = name.as_str().and_then(|name| hashes.get(name)) {
        *name = Json::String(format!("sha256:{hash}"));
    }
}

fn put_in_fields(tree: &mut Json, hashes: &BTreeMap<String, String>) {
    match tree {
        Json::Object(fields) => fields.iter_mut().for_each(|(field, value)| {
            if field == FIELD { put(value, hashes) } else { put_in_fields(value, hashes) }
        }),
        Json::Array(values) => values.iter_mut().for_each(|value| put_in_fields(value, hashes)),
        _ => {}
    }
}

/// The names of files in a study's text; none where it is no TOML, of which its reader says why.
fn named_in(text: &str) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    let Ok(tree) = text.parse::<Table>() else { return names };
    tree.get("scene").into_iter().for_each(|scene| collect(scene, &mut names));
    for factor in tree.get("factor").and_then(Value::as_array).into_iter().flatten() {
        for level in factor.get("levels").and_then(Value::as_array).into_iter().flatten() {
            collect(level, &mut names);
            let set = factor.get("set").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
            let parts = match level.as_array() {
                Some(parts) if set.len() > 1 => parts.as_slice(),
                _ => std::slice::from_ref(level),
            };
            let named = set.iter().zip(parts).filter(|(path, _)| path.as_str().is_some_and(is_name));
            names.extend(named.filter_map(|(_, part)| part.as_str().map(String::from)));
        }
    }
    names
}

fn collect(tree: &Value, names: &mut BTreeSet<String>) {
    match tree {
        Value::Table(fields) => fields.iter().for_each(|(field, value)| match value.as_str() {
            Some(name) if field == FIELD => {
                names.insert(name.to_string());
            }
            _ => collect(value, names),
        }),
        Value::Array(values) => values.iter().for_each(|value| collect(value, names)),
        _ => {}
    }
}

/// Whether a level of a factor that sets these fields names a file: its path must not become the name of a cell.
pub(super) fn names_a_file(set: &[String], level: &Value) -> bool {
    let mut names = BTreeSet::new();
    collect(level, &mut names);
    !names.is_empty() || set.iter().any(|path| is_name(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    const STUDY: &str = r#"
scene = { target = { file = "a.csv" }, poses = { kind = "file", file = "b.csv" } }
[[factor]]
set = ["scene.target.file"]
levels = ["c.csv", "a.csv"]
[[factor]]
set = ["scene.noise_px", "scene.poses.file"]
levels = [[0.1, "d.csv"]]
[[factor]]
set = ["scene.poses"]
levels = [{ kind = "chapter" }, { kind = "file", file = "e.csv" }]
"#;

    #[test]
    fn files_are_found_wherever_a_scene_may_name_them() {
        let names: Vec<String> = named_in(STUDY).into_iter().collect();
        assert_eq!(names, ["a.csv", "b.csv", "c.csv", "d.csv", "e.csv"]);
        assert!(named_in("name = [").is_empty());
    }

    #[test]
    fn a_canonical_tree_holds_contents_and_no_names() {
        let files = |renamed: &str| {
            let text = STUDY.replace(".csv", renamed);
            let contents = named_in(&text).into_iter().map(|name| {
                let content = format!("contents of {}", &name[..1]);
                (name, content)
            });
            let inputs = Inputs(Arc::new(contents.collect()));
            let mut tree = serde_json::to_value(text.parse::<Table>().unwrap()).unwrap();
            inputs.put_contents(&mut tree);
            assert_eq!(Inputs::parse(&inputs.to_text()), Some(inputs));
            tree.to_string()
        };
        assert_eq!(files(".csv"), files("/moved.txt"));
        assert!(!files(".csv").contains(".csv") && files(".csv").matches("sha256:").count() == 6);
    }
}
