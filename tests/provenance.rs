//! Can others read what a run wrote? `datapackage.json` and `ro-crate-metadata.json` against the files beside
//! them.

use crate::program::{calibench as run, folder, text};
use calibench::io::hash::sha256_hex;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

fn json(path: &Path) -> Value {
    let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).expect("JSON")
}

fn hash(path: &Path) -> String {
    sha256_hex(&fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())))
}

fn said(value: &Value) -> &str {
    value.as_str().unwrap_or_else(|| panic!("no text: {value}"))
}

/// Every table that the package names is there, with its hash, its columns and values of their types.
fn holds_package(folder: &Path) -> usize {
    let package = json(&folder.join("datapackage.json"));
    let resources = package["resources"].as_array().expect("a list");
    for resource in resources {
        let path = folder.join(said(&resource["path"]));
        assert_eq!(said(&resource["hash"]), format!("sha256:{}", hash(&path)));
        let fields = resource["schema"]["fields"].as_array().expect("a list");
        let mut csv = csv_rows(&path).into_iter();
        let header: Vec<&str> = fields.iter().map(|field| said(&field["name"])).collect();
        assert_eq!(csv.next().expect("a header"), header);
        for row in csv {
            for (cell, field) in row.iter().zip(fields) {
                let is_missing = ["", "NaN", "inf", "-inf"].contains(&cell.as_str());
                let fits = match said(&field["type"]) {
                    "integer" => cell.parse::<i64>().is_ok(),
                    "number" => cell.parse::<f64>().is_ok(),
                    "string" => true,
                    other => panic!("no type: {other}"),
                };
                assert!(is_missing || fits, "{}: {cell} is no {}", path.display(), field["type"]);
            }
        }
    }
    resources.len()
}

/// The cells of a file whose cells hold no line ends.
fn csv_rows(path: &Path) -> Vec<Vec<String>> {
    let text = fs::read_to_string(path).expect("a table");
    let cells = |line: &str| {
        let (mut cells, mut quoted) = (vec![String::new()], false);
        for c in line.chars() {
            match c {
                '"' => quoted = !quoted,
                ',' if !quoted => cells.push(String::new()),
                _ => cells.last_mut().expect("there is one").push(c),
            }
        }
        cells
    };
    text.lines().map(cells).collect()
}

/// Every file that the crate describes is there with its hash, and the run names program, seed and results.
fn holds_crate(folder: &Path, command: &str) {
    let graph = json(&folder.join("ro-crate-metadata.json"));
    let graph = graph["@graph"].as_array().expect("a graph");
    let by_id: BTreeMap<&str, &Value> = graph.iter().map(|entity| (said(&entity["@id"]), entity)).collect();
    let root = by_id["./"];
    let parts: Vec<&str> =
        root["hasPart"].as_array().expect("parts").iter().map(|p| said(&p["@id"])).collect();
    for part in &parts {
        let path = folder.join(part.replace("%20", " "));
        assert!(path.is_file(), "{part}");
        if let Some(stated) = by_id[part]["sha256"].as_str() {
            assert_eq!(stated, hash(&path), "{part}");
        }
    }
    let action = by_id[said(&root["mentions"]["@id"])];
    assert_eq!(said(&action["description"]), command);
    assert_eq!(said(&by_id[said(&action["instrument"]["@id"])]["name"]), "calibench");
    let several = |value: &Value| value.as_array().cloned().unwrap_or_else(|| vec![value.clone()]);
    assert!(several(&action["object"]).iter().any(|input| input["@id"] == "#seed"));
    let results = several(&action["result"]);
    assert!(results.iter().all(|result| parts.contains(&said(&result["@id"]))));
    let text = fs::read_to_string(folder.join("ro-crate-metadata.json")).expect("read before");
    assert!(!text.contains("endTime"), "a run gives the same bytes whenever it is made");
}

#[test]
fn a_run_is_described_as_it_is_and_twice_alike() {
    let folder = folder("provenance-run");
    for out in ["one", "two"] {
        let output = run(&folder, &["run", "line-bending", "--out", out, "--format", "json"]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let said: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(said["record"]["experiment"], "line-bending");
        assert_eq!(said["verdict"]["held"], true);
        assert!(said["cost"]["seconds"].as_f64().expect("a number") > 0.0);
    }
    let [one, two] = ["one", "two"].map(|out| folder.join(out).join("line-bending"));
    assert!(holds_package(&one) > 0);
    holds_crate(&one, "calibench run line-bending --seed 0");
    for name in ["datapackage.json", "ro-crate-metadata.json", "record.json"] {
        assert_eq!(hash(&one.join(name)), hash(&two.join(name)), "{name}");
    }
}

/// A study of two cells.
pub const SPEC: &str = r#"
name = "small"
question = "Is a study described as it is?"
seed = 1
trials = { per_cell = 20 }
factor = [{ name = "views", set = ["scene.poses.views"], levels = [4, 8] }]
[scene]
image = [640, 480]
camera = { fx = 600.0, fy = 600.0, cx = 326.0, cy = 243.0, k1 = -0.18, k2 = 0.05 }
target = { columns = 9, rows = 7, spacing_mm = 10.0 }
poses = { kind = "spread", views = 4, tilt_deg = 30.0, distance_mm = 130.0 }
noise_px = 0.1
"#;

#[test]
fn a_study_is_described_as_it_is() {
    let folder = folder("provenance-study");
    fs::write(folder.join("small.toml"), SPEC).expect("written");
    let output = run(&folder, &["study", "run", "small.toml", "--out", "small"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let whole = folder.join("small");
    assert!(holds_package(&whole) > 1);
    holds_crate(&whole, "calibench study run spec.toml");
    let manifest = json(&whole.join("manifest.json"));
    for name in ["datapackage.json", "ro-crate-metadata.json"] {
        assert_eq!(said(&manifest["files"][name]), hash(&whole.join(name)));
    }
}

#[test]
fn what_people_read_programs_read_too() {
    let folder = folder("format-json");
    let as_json = |arguments: &[&str]| -> Value {
        let output = run(&folder, &[arguments, &["--format", "json"]].concat());
        serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{arguments:?}: {error}"))
    };
    let listed = as_json(&["list"]);
    let ids: Vec<&str> = listed.as_array().expect("a list").iter().map(|e| said(&e["id"])).collect();
    assert!(ids.contains(&"four-pose"));
    let explained = as_json(&["explain", "line-bending.max-deviation"]);
    assert_eq!(said(&explained[0]["name"]), "line-bending.max-deviation");
    assert!(said(&explained[0]["band"]).contains(':'));
    let looks = as_json(&["doctor"]);
    assert!(looks.as_array().expect("a list").iter().any(|look| look["what"] == "program"));
    let gate = as_json(&["gate", "hand-eye", "--samples", "32"]);
    assert_eq!(gate["trusted"], true);
    let claims = as_json(&["claims", "line-bending"]);
    assert_eq!(said(&claims[0]["command"]), "calibench run line-bending");
    assert!(claims[0]["claims"].as_array().expect("a list").iter().all(|claim| claim["held"] == true));
}
