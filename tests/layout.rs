//! Was anything forgotten? Every experiment has its file, its three registrations, its snapshot and its
//! figures. Between the rooms the compiler keeps the walls, which are crates; inside the library each folder
//! imports only from those below it.

use calibench_harness::Experiment;
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// Files below a folder with one of these extensions, in order.
pub(crate) fn files(folder: &str, extensions: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root().join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| extensions.iter().any(|x| e == *x)) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

fn source_file(experiment: &Experiment) -> String {
    format!("experiments/{}.rs", experiment.id.replace('-', "_"))
}

#[test]
fn every_experiment_is_registered_everywhere() {
    let manifest = read("Cargo.toml");
    let mut forgotten = Vec::new();
    for experiment in calibench_experiments::EXPERIMENTS {
        let (id, file) = (experiment.id, source_file(experiment));
        let mut need = |there: bool, what: String| {
            if !there {
                forgotten.push(format!("{id}: {what}"));
            }
        };
        need(root().join(&file).is_file(), format!("{file} is missing"));
        let own = format!("experiments/bin/{}.rs", id.replace('-', "_"));
        need(root().join(&own).is_file(), format!("{own} is missing"));
        let binary = format!("[[bin]]\nname = \"{id}\"\npath = \"{own}\"\n");
        need(manifest.contains(&binary), format!("Cargo.toml lacks\n{binary}"));
        need(root().join(format!("golden/{id}.snap")).is_file(), format!("run `calibench bless {id}`"));
    }
    assert!(forgotten.is_empty(), "{}", forgotten.join("\n"));
}

#[test]
fn every_file_of_an_experiment_is_in_the_table() {
    let known: BTreeSet<String> = calibench_experiments::EXPERIMENTS.iter().map(source_file).collect();
    for file in fs::read_dir(root().join("experiments")).expect("experiments/ is there").flatten() {
        let name = format!("experiments/{}", file.file_name().to_string_lossy());
        let experiment = file.path().extension().is_some_and(|e| e == "rs") && name != "experiments/lib.rs";
        assert!(!experiment || known.contains(&name), "{name} is not in experiments/lib.rs");
    }
}

#[test]
fn ids_are_unique_and_every_snapshot_has_its_experiment() {
    let ids: BTreeSet<&str> = calibench_experiments::EXPERIMENTS.iter().map(|e| e.id).collect();
    assert_eq!(ids.len(), calibench_experiments::EXPERIMENTS.len());
    for snapshot in files("golden", &["snap"]) {
        let id = snapshot.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
        assert!(ids.contains(id.as_str()), "golden/{id}.snap belongs to no experiment: delete it");
    }
}

#[test]
fn every_file_of_tests_is_run() {
    let all = read("tests/all.rs");
    for file in fs::read_dir(root().join("tests")).expect("tests/ is there").flatten() {
        let name = file.file_name().to_string_lossy().trim_end_matches(".rs").to_string();
        assert!(
            name == "all" || all.contains(&format!("mod {name};")),
            "`mod {name};` is missing in tests/all.rs"
        );
    }
}

/// The library's folders from the ground up. Those of one inner list do not know each other: `calibrate`
/// never sees the truth that `synth` makes.
const LAYERS: [&[&str]; 9] = [
    &["distribution", "geometry", "rows"],
    &["camera", "board", "raster"],
    &["synth", "detect", "calibrate", "tsai", "planar", "rectify"],
    &["evaluate"],
    &["downstream", "measured", "planning", "validate"],
    &["noise"],
    &["io"],
    &["photos"],
    &["as_data"],
];

/// What `layer` may import; `None` if it is none. The crate's root imports nothing.
fn allowed(layer: &str) -> Option<Vec<&'static str>> {
    if layer == "lib" {
        return Some(Vec::new());
    }
    let height = LAYERS.iter().position(|names| names.contains(&layer))?;
    Some(LAYERS[..height].concat())
}

/// Names that follow `crate::` in a source text, comments left out.
fn imports(source: &str) -> BTreeSet<String> {
    let code: String =
        source.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n");
    let name =
        |rest: &str| rest.chars().take_while(|c| c.is_ascii_lowercase() || *c == '_').collect::<String>();
    code.split("crate::").skip(1).map(name).filter(|n| !n.is_empty()).collect()
}

/// Measurements that know Brown-Conrady's lens alone are not stale when the estimator for others changes
/// (src/harness/build.rs): who leads to it is therefore listed here.
#[test]
fn the_estimator_of_other_lenses_is_reached_in_few_places() {
    let reached: Vec<String> = files("src/calibench/calibrate", &["rs"])
        .into_iter()
        .filter(|path| !path.components().any(|part| part.as_os_str() == "any_lens"))
        .filter(|path| fs::read_to_string(path).expect("the file is read").contains("any_lens"))
        .map(|path| path.file_name().expect("a file has a name").to_string_lossy().into_owned())
        .collect();
    assert_eq!(
        BTreeSet::from_iter(reached.iter().map(String::as_str)),
        ["choice.rs", "left_out.rs", "lens.rs", "mod.rs"].into()
    );
}

#[test]
fn layers_import_only_from_the_layers_below() {
    let mut wrong = Vec::new();
    for path in files("src/calibench", &["rs"]) {
        let inside = path.strip_prefix(root().join("src/calibench")).expect("it was found there");
        let first = inside.components().next().expect("a file has a name").as_os_str().to_string_lossy();
        let layer = first.trim_end_matches(".rs").to_string();
        let Some(allowed) = allowed(&layer) else {
            wrong.push(format!("{} belongs to no layer of tests/layout.rs", inside.display()));
            continue;
        };
        let source = fs::read_to_string(&path).expect("the file is read");
        for import in imports(&source) {
            let known = LAYERS.concat().contains(&import.as_str());
            if known && import != layer && !allowed.contains(&import.as_str()) {
                wrong.push(format!("{}: `{layer}` may not import `{import}`", inside.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_import_scanner_sees_imports_and_no_comments() {
    let source = "// crate::synth\nuse crate::geometry::Vec2;\nlet x = crate::camera::f();\n";
    assert_eq!(imports(source).into_iter().collect::<Vec<_>>(), ["camera", "geometry"]);
}

/// The committed figures together stay small enough to clone.
const FIGURES_LIMIT_BYTES: u64 = 10_000_000;

#[test]
fn figures_stay_small_and_golden_files_carry_no_trace_of_the_machine() {
    let figures = files("figures", &["svg", "png"]);
    let total: u64 = figures.iter().map(|f| fs::metadata(f).map_or(0, |m| m.len())).sum();
    assert!(total < FIGURES_LIMIT_BYTES, "figures/ holds {total} bytes");
    let here = root().to_string_lossy().into_owned();
    for file in files("golden", &["snap", "toml"]).into_iter().chain(files("figures", &["svg"])) {
        let text = fs::read_to_string(&file).expect("a text file");
        assert!(!text.contains(&here), "{} names this machine's folder", file.display());
    }
}

/// The formatter keeps code within its width, and leaves comments as they are.
#[test]
fn the_text_of_comments_is_within_the_formatters_width() {
    let settings = read("rustfmt.toml");
    let width = settings.lines().find_map(|line| line.strip_prefix("max_width = ")).expect("it is set");
    let width: usize = width.trim().parse().expect("a number");
    let mut long = Vec::new();
    for path in ["src", "experiments", "tests", "benches"].iter().flat_map(|folder| files(folder, &["rs"])) {
        let text = fs::read_to_string(&path).expect("it is text");
        let mut is_code = false;
        for (i, line) in text.lines().enumerate() {
            let Some(comment) = line.trim_start().strip_prefix("//") else {
                is_code = false;
                continue;
            };
            let words = comment.trim_start_matches(['/', '!']);
            is_code ^= words.trim_start().starts_with("```");
            // Lists, tables and formulae stand by themselves.
            let is_text = words.strip_prefix(' ').is_some_and(|words| words.starts_with(char::is_alphabetic));
            if is_text && !is_code && line.chars().count() > width {
                long.push(format!("{}:{}", path.display(), i + 1));
            }
        }
    }
    assert!(long.is_empty(), "lines of comments beyond {width} characters:\n{}", long.join("\n"));
}
