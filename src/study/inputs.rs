//! Which files does a study read beside its own? Tables of marks and poses that its scenes name, kept by
//! their content: where they lie is no part of a study.

use super::spec_error::SpecError;
use calibench::io::hash::sha256_hex;
use calibench::io::input::MOST_SPEC_BYTES;
use calibench::io::read_regular_text;
use serde_json::Value as Json;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::{Table, Value};

/// The text of every file that a study names, by the name that it gives it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Inputs(Arc<BTreeMap<String, String>>);

/// The field that names a file, of a target and of poses.
const FIELD: &str = "file";

impl Inputs {
    /// The files that a study names, read from the folder in which it lies; names that begin with `/` are
    /// taken as they are.
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

    /// Where the files lie that a study at `spec` names.
    pub fn places(&self, spec: &Path) -> Vec<PathBuf> {
        let folder = spec.parent().unwrap_or(Path::new(""));
        self.0.keys().map(|name| folder.join(name)).collect()
    }

    /// Those that stand in `inputs.json` of a run; `None` if the text is none of that.
    pub fn parse(text: &str) -> Option<Inputs> {
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
        let hashes = self.hashes();
        visit_names(spec, &mut |name| {
            if let Some(hash) = name.as_str().and_then(|name| hashes.get(name)) {
                *name = Json::String(format!("sha256:{hash}"));
            }
        });
    }
}

/// Visits every text of a study that names a file: in its scene, and in the levels of its factors.
fn visit_names(spec: &mut Json, visit: &mut dyn FnMut(&mut Json)) {
    if let Some(scene) = spec.get_mut("scene") {
        visit_fields(scene, visit);
    }
    for factor in spec.get_mut("factor").and_then(Json::as_array_mut).into_iter().flatten() {
        let set = factor.get("set").and_then(Json::as_array).into_iter().flatten();
        let set: Vec<bool> = set.map(|path| path.as_str().is_some_and(is_name)).collect();
        for level in factor.get_mut("levels").and_then(Json::as_array_mut).into_iter().flatten() {
            visit_fields(level, visit);
            // A factor of one field has its levels as they are, one of several a list for each.
            let parts = match level {
                Json::Array(parts) if set.len() > 1 => parts.as_mut_slice(),
                one => std::slice::from_mut(one),
            };
            parts.iter_mut().zip(&set).filter(|(_, is_file)| **is_file).for_each(|(part, _)| visit(part));
        }
    }
}

/// Visits every field `file` within a tree.
fn visit_fields(tree: &mut Json, visit: &mut dyn FnMut(&mut Json)) {
    match tree {
        Json::Object(fields) => fields.iter_mut().for_each(|(field, value)| match field == FIELD {
            true => visit(value),
            false => visit_fields(value, visit),
        }),
        Json::Array(values) => values.iter_mut().for_each(|value| visit_fields(value, visit)),
        _ => {}
    }
}

/// Whether the field at a path names a file.
fn is_name(path: &str) -> bool {
    path.rsplit('.').next() == Some(FIELD)
}

/// The names of files in a study's text; none where it is no TOML, of which its reader says why.
fn named_in(text: &str) -> BTreeSet<String> {
    let Ok(tree) = text.parse::<Table>() else { return BTreeSet::new() };
    let mut spec = serde_json::to_value(tree).expect("a table of TOML is JSON");
    let mut names = BTreeSet::new();
    visit_names(&mut spec, &mut |name| names.extend(name.as_str().map(String::from)));
    names
}

/// Whether a level of a factor that sets these fields names a file: its path must not become the name of a
/// cell.
pub(super) fn names_a_file(set: &[String], level: &Value) -> bool {
    let mut level = serde_json::to_value(level).expect("a value of TOML is JSON");
    let mut is_file = set.iter().any(|path| is_name(path));
    visit_fields(&mut level, &mut |name| is_file |= name.is_string());
    is_file
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

    #[test]
    fn a_file_is_found_in_a_level_that_sets_several_fields() {
        let text = "[[factor]]\nset = [\"scene.noise_px\", \"scene.poses\"]\n\
                    levels = [[0.1, { kind = \"file\", file = \"f.csv\" }]]";
        assert_eq!(named_in(text), BTreeSet::from(["f.csv".to_string()]));
        let factor = &text.parse::<Table>().unwrap()["factor"][0];
        let set = ["scene.noise_px", "scene.poses"].map(String::from);
        assert!(names_a_file(&set, &factor["levels"][0]));
    }

    #[test]
    fn files_lie_beside_the_study_that_names_them() {
        let inputs = Inputs::parse(r#"{ "/tables/b.csv": "", "a.csv": "" }"#).unwrap();
        let places = inputs.places(Path::new("studies/one.toml"));
        assert_eq!(places, ["/tables/b.csv", "studies/a.csv"].map(PathBuf::from));
        assert!(!inputs.is_empty() && Inputs::default().is_empty());
    }
}
