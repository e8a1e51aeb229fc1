//! What made these results? Specification, part, seed, code and commit; and whether they may be continued.

use super::fingerprint::Fingerprint;
use super::inputs::Inputs;
use super::shard::Shard;
use super::spec::Spec;
use super::trial_file::TrialFile;
use calibench::io::hash::sha256_hex;
use calibench_harness::Build;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt;

/// `manifest.json` of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Name of the study.
    pub study: String,
    /// Seed.
    pub seed: u64,
    /// Part of the study, `i/n`.
    pub shard: String,
    /// In which file its trials stand once it is complete.
    #[serde(default)]
    pub trials: TrialFile,
    /// Whether every trial of the part is done.
    pub complete: bool,
    /// Commit of the source tree, where known.
    pub commit: Option<String>,
    /// Whether the tree differed from that commit.
    pub dirty: Option<bool>,
    /// The day of that commit, where known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub day: Option<String>,
    /// The command of the program that calibrates, where it is not this library's solver. Whether it gives
    /// the same answers another day is its own business.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solver: Option<String>,
    /// Code.
    pub code: Fingerprint,
    /// SHA-256 of the canonical specification.
    pub spec_sha256: String,
    /// The specification with its defaults.
    pub spec: Value,
    /// SHA-256 of the files that the specification names, by their names there; they stand in `inputs.json`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub inputs: BTreeMap<String, String>,
    /// Their contents, of a run that begins.
    #[serde(skip)]
    pub(super) contents: Inputs,
    /// SHA-256 of the result files; empty until complete.
    pub files: BTreeMap<String, String>,
}

/// One thing in which two manifests differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// Path of the field.
    pub what: String,
    /// There.
    pub then: String,
    /// Here.
    pub now: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: was {}, is {}", self.what, self.then, self.now)
    }
}

impl Manifest {
    /// Of a run that begins.
    pub fn new(spec: &Spec, shard: Shard, build: &Build) -> Manifest {
        let canonical = spec.canonical();
        Manifest {
            study: spec.name.clone(),
            seed: spec.seed,
            shard: shard.to_string(),
            trials: TrialFile::Csv,
            complete: false,
            commit: build.commit.as_ref().map(|c| c.hash.clone()),
            dirty: build.commit.as_ref().map(|c| c.dirty),
            day: build.date.clone(),
            solver: None,
            code: Fingerprint::of(build),
            spec_sha256: sha256_hex(canonical.to_string().as_bytes()),
            spec: canonical,
            inputs: spec.inputs.hashes(),
            contents: spec.inputs.clone(),
            files: BTreeMap::new(),
        }
    }

    /// The same, with another kind of file for its trials.
    #[must_use]
    pub fn with_trials(self, trials: TrialFile) -> Manifest {
        Manifest { trials, ..self }
    }

    /// The same, calibrated by the program of a command.
    #[must_use]
    pub fn with_solver(self, solver: Option<String>) -> Manifest {
        Manifest { solver, ..self }
    }

    /// The command that makes the files of the run again, beside the study's text in `study`.
    pub(super) fn command(&self, study: &str) -> String {
        let shard = if self.shard == "0/1" { String::new() } else { format!(" --shard {}", self.shard) };
        let trials = if self.trials == TrialFile::Csv { "" } else { " --trials parquet" };
        let quoted = |command: &String| format!(" --solver '{}'", command.replace('\'', "'\\''"));
        let solver = self.solver.as_ref().map_or(String::new(), quoted);
        format!("calibench study run {study}{shard}{trials}{solver}")
    }

    /// Whatever would make trials of `now` unfit to stand beside those of `self`. Commits may differ as long
    /// as the code behaves alike.
    pub fn differences(&self, now: &Manifest) -> Vec<Difference> {
        let mut found = Vec::new();
        differ("spec", &self.spec, &now.spec, &mut found);
        let code = |manifest: &Manifest| serde_json::to_value(&manifest.code).unwrap_or(Value::Null);
        differ("code", &code(self), &code(now), &mut found);
        let solver = |manifest: &Manifest| manifest.solver.clone().map_or(Value::Null, Value::String);
        differ("solver", &solver(self), &solver(now), &mut found);
        found
    }

    /// Which trials may stand in the run's folder: SHA-256 of specification, part, code, and solver if it is
    /// not this library's.
    pub(super) fn identity(&self) -> String {
        let parts = match &self.solver {
            None => serde_json::json!([self.spec, self.shard, self.code]),
            Some(solver) => serde_json::json!([self.spec, self.shard, self.code, solver]),
        };
        sha256_hex(parts.to_string().as_bytes())
    }

    pub(super) fn to_text(&self) -> String {
        let value = serde_json::to_value(self).expect("a manifest holds nothing that JSON cannot");
        format!("{value:#}\n")
    }
}

/// Walks two trees side by side and notes the leaves that differ.
fn differ(path: &str, then: &Value, now: &Value, found: &mut Vec<Difference>) {
    match (then, now) {
        (Value::Object(a), Value::Object(b)) => {
            let keys: std::collections::BTreeSet<&String> = a.keys().chain(b.keys()).collect();
            for key in keys {
                let side =
                    |map: &serde_json::Map<String, Value>| map.get(key).cloned().unwrap_or(Value::Null);
                differ(&format!("{path}.{key}"), &side(a), &side(b), found);
            }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            for (i, (a, b)) in a.iter().zip(b).enumerate() {
                differ(&format!("{path}[{i}]"), a, b, found);
            }
        }
        _ if then != now => {
            found.push(Difference { what: path.to_string(), then: then.to_string(), now: now.to_string() });
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_that_makes_a_run_again_names_its_part_its_file_and_its_solver() {
        let spec = Spec::parse(crate::example::STUDY).unwrap();
        let run = |index, count| Manifest::new(&spec, Shard { index, count }, &Build::default());
        assert_eq!(run(0, 1).command("spec.toml"), "calibench study run spec.toml");
        let part = run(1, 3).with_trials(TrialFile::Parquet).with_solver(Some("it's ours".into()));
        assert_eq!(
            part.command("spec.toml"),
            r"calibench study run spec.toml --shard 1/3 --trials parquet --solver 'it'\''s ours'"
        );
    }
}
