//! Who made these files, with what, from what? `ro-crate-metadata.json`: an RO-Crate 1.1 of the profile
//! Process Run Crate 0.5 (Leo et al. 2024), which says it in words that archives and workflow systems read.
//!
//! No time stands in it, although the profile recommends that of the end: a run gives the same bytes whenever
//! it is made. The date of a crate, which the standard demands, is that of the commit.

use super::provenance::Build;
use calibench::io::hash::sha256_hex;
use serde_json::{Value, json};

const PROFILE: &str = "https://w3id.org/ro/wfrun/process/0.5";
const CONTEXT: [&str; 2] =
    ["https://w3id.org/ro/crate/1.1/context", "https://w3id.org/ro/terms/workflow-run/context"];
const COMPLETED: &str = "http://schema.org/CompletedActionStatus";

/// A file of the folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PartFile {
    /// Path from the folder, with `/`.
    pub path: String,
    /// What it is.
    pub what: String,
    /// SHA-256 of its bytes, hexadecimal; `None` for a file that is written after the crate.
    pub sha256: Option<String>,
}

impl PartFile {
    /// A file of these bytes.
    pub fn new(path: impl Into<String>, what: impl Into<String>, bytes: &[u8]) -> PartFile {
        PartFile { path: path.into(), what: what.into(), sha256: Some(sha256_hex(bytes)) }
    }

    /// An input that is known by its hash alone is none of the folder's files.
    fn is_in_folder(&self) -> bool {
        !self.path.starts_with('#')
    }
}

/// A run of the program, and the files in its folder.
#[derive(Debug, Clone)]
pub struct RunCrate<'a> {
    /// A headline.
    pub title: &'a str,
    /// What was asked.
    pub description: &'a str,
    /// The command that makes the files again.
    pub command: String,
    /// Seed of the random streams.
    pub seed: u64,
    /// What went in: a file of the folder, or a name with the hash of its bytes.
    pub inputs: Vec<PartFile>,
    /// What came out.
    pub results: Vec<PartFile>,
    /// The program.
    pub build: &'a Build,
}

impl RunCrate<'_> {
    /// The text of `ro-crate-metadata.json`.
    pub fn to_text(&self) -> String {
        format!("{:#}\n", self.json())
    }

    fn json(&self) -> Value {
        let mut graph = vec![
            json!({
                "@id": "ro-crate-metadata.json",
                "@type": "CreativeWork",
                "conformsTo": { "@id": "https://w3id.org/ro/crate/1.1" },
                "about": { "@id": "./" },
            }),
            self.folder(),
            json!({ "@id": PROFILE, "@type": "CreativeWork", "name": "Process Run Crate", "version": "0.5" }),
            json!({
                "@id": LICENCE, "@type": "CreativeWork", "name": "MIT License",
                "description": "The licence of the program, at choice beside Apache-2.0, whose output these files are",
            }),
            self.software(),
            self.run(),
            json!({ "@id": AGENT, "@type": "Organization", "name": "The calibench authors" }),
            json!({ "@id": SEED, "@type": "PropertyValue", "name": "seed", "value": self.seed.to_string() }),
        ];
        graph.extend(self.build.crates.iter().map(|(name, version)| library(name, version)));
        graph.extend(self.inputs.iter().chain(&self.results).map(entity));
        json!({ "@context": CONTEXT, "@graph": graph })
    }

    /// The folder as a data set.
    fn folder(&self) -> Value {
        let files = self.inputs.iter().chain(&self.results);
        let mut root = json!({
            "@id": "./",
            "@type": "Dataset",
            "conformsTo": { "@id": PROFILE },
            "name": self.title,
            "description": self.description,
            "license": { "@id": LICENCE },
            "hasPart": values(files.filter(|file| file.is_in_folder()).map(reference)),
            "author": { "@id": AGENT },
            "publisher": { "@id": AGENT },
            "mentions": { "@id": self.action() },
        });
        if let Some(date) = &self.build.date {
            root["datePublished"] = json!(date);
        }
        root
    }

    /// What was done: from inputs and seed to results, by the program.
    fn run(&self) -> Value {
        let seed = json!({ "@id": SEED });
        json!({
            "@id": self.action(),
            "@type": "CreateAction",
            "name": format!("Run of {}", self.title),
            "description": self.command,
            "instrument": { "@id": SOFTWARE },
            "agent": { "@id": AGENT },
            "object": values(self.inputs.iter().map(reference).chain([seed])),
            "result": values(self.results.iter().map(reference)),
            "actionStatus": COMPLETED,
        })
    }

    /// One command, seed and program is one run.
    fn action(&self) -> String {
        let commit = self.build.commit.as_ref().map(ToString::to_string).unwrap_or_default();
        let said = format!("{}\n{}\n{commit}", self.command, self.seed);
        format!("#run-{}", &sha256_hex(said.as_bytes())[..16])
    }

    fn software(&self) -> Value {
        let version = match &self.build.commit {
            Some(commit) if commit.dirty => format!("{}+{}.changed", env!("CARGO_PKG_VERSION"), commit.hash),
            Some(commit) => format!("{}+{}", env!("CARGO_PKG_VERSION"), commit.hash),
            None => env!("CARGO_PKG_VERSION").to_string(),
        };
        let needs =
            self.build.crates.iter().map(|(name, version)| json!({ "@id": library_id(name, version) }));
        json!({
            "@id": SOFTWARE,
            "@type": "SoftwareApplication",
            "name": "calibench",
            "description": "A test bench for camera calibration",
            "softwareVersion": version,
            "softwareRequirements": values(needs),
        })
    }
}

/// A package URL, which is a URI that belongs to no host.
const SOFTWARE: &str = "pkg:generic/calibench";
const AGENT: &str = "#authors";
const SEED: &str = "#seed";
const LICENCE: &str = "https://spdx.org/licenses/MIT";

/// One value as it stands, several as a list: so the standard writes them.
fn values(each: impl IntoIterator<Item = Value>) -> Value {
    let mut each: Vec<Value> = each.into_iter().collect();
    if each.len() == 1 { each.remove(0) } else { json!(each) }
}

/// How a file is referred to.
fn reference(file: &PartFile) -> Value {
    json!({ "@id": id(&file.path) })
}

/// A path as part of a URI.
fn id(path: &str) -> String {
    path.replace('%', "%25").replace(' ', "%20")
}

fn library_id(name: &str, version: &str) -> String {
    format!("pkg:cargo/{name}@{version}")
}

fn library(name: &str, version: &str) -> Value {
    json!({
        "@id": library_id(name, version), "@type": "SoftwareApplication", "name": name, "softwareVersion": version,
    })
}

fn entity(file: &PartFile) -> Value {
    let kind = if file.is_in_folder() { "File" } else { "CreativeWork" };
    let mut entity =
        json!({ "@id": id(&file.path), "@type": kind, "name": file.path, "description": file.what });
    if let Some(format) = encoding(&file.path) {
        entity["encodingFormat"] = json!(format);
    }
    if let Some(sha256) = &file.sha256 {
        entity["sha256"] = json!(sha256);
    }
    entity
}

/// The media type of a file, by the end of its name.
fn encoding(path: &str) -> Option<&'static str> {
    let types = [
        (".csv", "text/csv"),
        (".json", "application/json"),
        (".svg", "image/svg+xml"),
        (".png", "image/png"),
        (".toml", "application/toml"),
        (".html", "text/html"),
        (".parquet", "application/vnd.apache.parquet"),
    ];
    types.iter().find(|(end, _)| path.ends_with(end)).map(|(_, kind)| *kind)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn crate_of(inputs: Vec<PartFile>) -> Value {
        let build =
            Build { date: Some("2026-01-31".into()), ..Build::read("0123abcd", "false", "libm 0.2.16") };
        let run = RunCrate {
            title: "a title",
            description: "a question",
            command: "calibench run e --seed 1".into(),
            seed: 1,
            inputs,
            results: vec![PartFile::new("a table.csv", "rows", b"x")],
            build: &build,
        };
        serde_json::from_str(&run.to_text()).unwrap()
    }

    /// Every `@id` below a value.
    fn references(value: &Value, found: &mut BTreeSet<String>) {
        match value {
            Value::Object(map) => {
                found.extend(map.get("@id").and_then(Value::as_str).map(str::to_string));
                map.values().for_each(|value| references(value, found));
            }
            Value::Array(list) => list.iter().for_each(|value| references(value, found)),
            _ => {}
        }
    }

    #[test]
    fn everything_that_is_referred_to_is_described_once() {
        let json = crate_of(vec![PartFile::new("#photo", "an input known by its hash", b"y")]);
        let graph = json["@graph"].as_array().unwrap();
        let described: Vec<&str> = graph.iter().map(|entity| entity["@id"].as_str().unwrap()).collect();
        let unique: BTreeSet<&str> = described.iter().copied().collect();
        assert_eq!(unique.len(), described.len());
        let mut referred = BTreeSet::new();
        references(&json, &mut referred);
        let outside = ["https://w3id.org/ro/crate/1.1"];
        for id in referred.iter().filter(|id| !outside.contains(&id.as_str())) {
            assert!(unique.contains(id.as_str()), "{id}");
        }
    }

    #[test]
    fn the_profiles_demands_are_met() {
        let json = crate_of(Vec::new());
        let of =
            |id: &str| json["@graph"].as_array().unwrap().iter().find(|e| e["@id"] == id).unwrap().clone();
        let root = of("./");
        assert_eq!(root["conformsTo"]["@id"], PROFILE);
        assert_eq!(root["datePublished"], "2026-01-31");
        assert_eq!(root["hasPart"]["@id"], "a%20table.csv");
        let action = of(root["mentions"]["@id"].as_str().unwrap());
        assert_eq!(action["@type"], "CreateAction");
        assert_eq!(of(action["instrument"]["@id"].as_str().unwrap())["softwareVersion"], "0.1.0+0123abcd");
        assert_eq!(action["result"]["@id"], "a%20table.csv");
        assert_eq!(action["object"]["@id"], "#seed");
        // SHA-256 of "x".
        assert!(of("a%20table.csv")["sha256"].as_str().unwrap().starts_with("2d711642b726b044"));
    }
}
