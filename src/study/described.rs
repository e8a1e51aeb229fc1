//! How do others read a study's folder? `datapackage.json` says what the columns of its tables are,
//! `ro-crate-metadata.json` what made them, and the same stands in the head of a Parquet file.

use super::engine::Engine;
use super::folder::INPUTS;
use super::manifest::Manifest;
use super::tables;
use super::trial_file::TrialFile;
use calibench::io::Commit;
use calibench_harness::{Build, Field, PartFile, Resource, RunCrate, Table, data_package};

/// `datapackage.json`: the tables of the summary, and the trials where they are CSV.
pub(super) fn package(engine: &Engine, tables: &[Table], manifest: &Manifest) -> String {
    let mut resources: Vec<Resource> = tables.iter().map(Resource::of).collect();
    if manifest.trials == TrialFile::Csv {
        resources.push(trials(engine, &manifest.files[TrialFile::Csv.name()]));
    }
    let package = data_package(&engine.spec.name, &title(engine), &engine.spec.question, &resources);
    format!("{package:#}\n")
}

fn title(engine: &Engine) -> String {
    format!("The study {}", engine.spec.name)
}

/// `trials.csv`.
fn trials(engine: &Engine, sha256: &str) -> Resource {
    let field = |header: String| {
        let kind = match header.as_str() {
            "cell" | "trial" | "iterations" => "integer",
            "outcome" => "string",
            _ => "number",
        };
        let unit = header.split_once(" [").map(|(_, unit)| unit.trim_end_matches(']').to_string());
        Field { kind, unit: unit.unwrap_or_default(), header }
    };
    Resource {
        name: "trials".to_string(),
        description: "Every trial: its cell, what became of it, and the errors of its estimates".to_string(),
        fields: tables::columns(&engine.quantities).into_iter().map(field).collect(),
        sha256: sha256.to_string(),
        bytes: None,
    }
}

/// `ro-crate-metadata.json`: all that the manifest names, and the manifest itself.
pub(super) fn run_crate(engine: &Engine, manifest: &Manifest) -> String {
    let part = |name: &str| PartFile {
        path: name.to_string(),
        what: what(name).to_string(),
        sha256: manifest.files.get(name).cloned(),
    };
    let (given, made): (Vec<&str>, Vec<&str>) =
        manifest.files.keys().map(String::as_str).partition(|name| [SPEC, INPUTS].contains(name));
    let results = made.into_iter().chain(["manifest.json"]);
    let build = Build {
        commit: manifest
            .commit
            .as_ref()
            .map(|hash| Commit { hash: hash.clone(), dirty: manifest.dirty == Some(true) }),
        date: manifest.day.clone(),
        crates: manifest.code.crates.clone(),
    };
    let run = RunCrate {
        title: &title(engine),
        description: &engine.spec.question,
        command: manifest.command(SPEC),
        seed: manifest.seed,
        inputs: given.into_iter().map(part).collect(),
        results: results.map(part).collect(),
        build: &build,
    };
    run.to_text()
}

const SPEC: &str = "spec.toml";

/// What a file of a study's folder is.
fn what(name: &str) -> &'static str {
    match name {
        SPEC => "The study: its question, factors, scene and seed",
        INPUTS => "The tables of marks and poses that the study names, by their names there",
        "manifest.json" => "The hash of every file, the specification with its defaults, and the code",
        "report.html" => "The report",
        "datapackage.json" => "The columns of the tables: types, units, descriptions",
        "trials.csv" | "trials.parquet" => "Every trial",
        "marks.csv" => "The marks of each cell's target, mm",
        "poses.csv" => "The poses of each cell's target, mm, for cells whose trials all meet the same",
        _ if name.starts_with("figures/") => "A figure of the report",
        _ => "A table of the report",
    }
}

/// Keys and values in the head of a Parquet file.
#[cfg_attr(not(feature = "parquet"), allow(dead_code))]
pub(super) fn in_head(manifest: &Manifest) -> Vec<(String, String)> {
    let seed = manifest.seed.to_string();
    let commit = manifest.commit.as_deref().unwrap_or("unknown");
    [
        ("study", manifest.study.as_str()),
        ("seed", &seed),
        ("shard", &manifest.shard),
        ("spec_sha256", &manifest.spec_sha256),
        ("version", &manifest.code.calibench),
        ("commit", commit),
        ("solver", manifest.solver.as_deref().unwrap_or("calibench")),
    ]
    .map(|(key, value)| (format!("calibench.{key}"), value.to_string()))
    .to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::STUDY;
    use crate::{Shard, Spec, summarise};
    use std::collections::BTreeSet;

    #[test]
    fn the_head_of_a_file_of_trials_says_what_made_them() {
        let commit = Some(Commit { hash: "abc".into(), dirty: false });
        let build = Build { commit, ..Build::default() };
        let spec = Spec::parse(STUDY).unwrap();
        let shard = Shard { index: 1, count: 3 };
        let manifest = Manifest::new(&spec, shard, &build);
        let head = in_head(&manifest);
        let keys: Vec<&str> = head.iter().map(|(key, _)| key.strip_prefix("calibench.").unwrap()).collect();
        assert_eq!(keys, ["study", "seed", "shard", "spec_sha256", "version", "commit", "solver"]);
        let of = |key: &str| {
            let name = format!("calibench.{key}");
            head.iter().find(|(k, _)| *k == name).map(|(_, value)| value.clone()).unwrap()
        };
        assert_eq!([of("study"), of("seed"), of("shard"), of("commit")], ["two-cells", "1", "1/3", "abc"]);
        assert_eq!(of("spec_sha256"), manifest.spec_sha256);
    }

    #[test]
    fn every_column_of_the_trials_is_described_by_its_header_type_and_unit() {
        let engine = Engine::new(STUDY, Shard::WHOLE).unwrap();
        let mut manifest = Manifest::new(&engine.spec, Shard::WHOLE, &Build::default());
        manifest.files.insert("trials.csv".into(), "0a1b".into());
        let described = |trials: TrialFile| {
            let manifest = manifest.clone().with_trials(trials);
            let text = package(&engine, &summarise(&engine).tables(), &manifest);
            serde_json::from_str::<serde_json::Value>(&text).unwrap()["resources"].clone()
        };
        let resources = described(TrialFile::Csv);
        let trials = &resources[3];
        assert_eq!(["path", "hash"].map(|key| &trials[key]), ["trials.csv", "sha256:0a1b"]);
        let fields = trials["schema"]["fields"].as_array().unwrap();
        let told = fields.iter().map(|f| ["name", "type", "unit"].map(|key| f[key].as_str().unwrap_or("")));
        assert_eq!(
            told.collect::<Vec<_>>()[..7],
            [
                ["cell", "integer", ""],
                ["trial", "integer", ""],
                ["outcome", "string", ""],
                ["iterations", "integer", ""],
                ["rmse [px]", "number", "px"],
                ["nees", "number", ""],
                ["fx_error [px]", "number", "px"],
            ]
        );
        // A package describes tables of text.
        let others = described(TrialFile::Parquet);
        assert_eq!(others.as_array().unwrap(), &resources.as_array().unwrap()[..3]);
    }

    #[test]
    fn the_kinds_of_files_of_a_run_are_told_apart_and_trials_are_trials_in_either_format() {
        let others =
            ["report.html", "datapackage.json", "marks.csv", "poses.csv", "figures/a.svg", "summary.csv"];
        let files = [SPEC, INPUTS, "manifest.json", "trials.csv"].into_iter().chain(others);
        let told: BTreeSet<&str> = files.map(what).collect();
        assert_eq!(told.len(), 10, "{told:?}");
        assert_eq!(what("trials.parquet"), what("trials.csv"));
        assert_eq!(what("figures/b.svg"), what("figures/a.svg"));
        assert_eq!(what("outcomes.csv"), what("summary.csv"));
    }
}
