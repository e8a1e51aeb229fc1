//! Does `--format json` print one object on standard output, in place of the lines for people?

use crate::program::{calibench as run, folder, text};
use crate::provenance::SPEC;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// The one object that a call prints.
fn object(folder: &Path, arguments: &[&str]) -> Value {
    let output = run(folder, &[arguments, &["--format", "json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", text(&output.stderr));
    let said: Value = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|error| panic!("{arguments:?}: {error}: {}", text(&output.stdout)));
    assert!(said["written_by"].as_str().expect("a program").starts_with("calibench "), "{said:#}");
    said
}

/// Every file that an object names is there.
fn written(folder: &Path, said: &Value) -> usize {
    let names = said["written"].as_array().expect("a list");
    for name in names {
        let file = folder.join(name.as_str().expect("a path"));
        assert!(file.is_file(), "{}", file.display());
    }
    names.len()
}

#[test]
fn studies_say_what_they_found_to_programs() {
    let folder = folder("json-study");
    fs::write(folder.join("small.toml"), SPEC).expect("written");
    let whole = object(&folder, &["study", "run", "small.toml", "--out", "whole"]);
    assert_eq!((&whole["study"], &whole["trials"]), (&"small".into(), &40.into()));
    assert_eq!((&whole["shard"], &whole["ran"]["trials"]), (&"0/1".into(), &40.into()));
    assert!(written(&folder.join("whole"), &whole) > 5);
    let cell = &whole["cells"][1];
    assert_eq!((&cell["cell"], &cell["trials"]), (&"views = 8".into(), &20.into()));
    assert_eq!(cell["outcomes"][0]["trials"], 20, "{cell:#}");
    let fx = cell["quantities"].as_array().unwrap().iter().find(|q| q["quantity"] == "fx").unwrap();
    // Of 20 trials the spread is known to a sixth.
    assert!((0.5..2.0).contains(&fx["ratio"]["value"].as_f64().unwrap()), "{fx:#}");
    assert!(fx["sd"]["low"].as_f64() < fx["sd"]["high"].as_f64() && fx["predicted_sd"].as_f64() > Some(0.0));
    // Resumed, nothing is left to run; merged from its parts it is the same study.
    let resumed = object(&folder, &["study", "resume", "whole"]);
    assert_eq!(resumed["cells"], whole["cells"]);
    for part in ["0/2", "1/2"] {
        let out = format!("part-{}", &part[..1]);
        let said = object(&folder, &["study", "run", "small.toml", "--out", &out, "--shard", part]);
        assert_eq!(said["shard"], part);
    }
    let merged = object(&folder, &["study", "merge", "part-0", "part-1", "--out", "merged"]);
    assert_eq!((&merged["cells"], &merged["ran"]), (&whole["cells"], &Value::Null));
    let measured = object(&folder, &["study", "measure", "small.toml", "--trials", "10"]);
    let runs = measured["runs"].as_array().unwrap();
    assert_eq!(runs.iter().map(|run| run["trials"].as_u64().unwrap()).collect::<Vec<_>>(), [20, 80]);
    let plan = object(&folder, &["study", "plan", "small.toml", "--want", "fx=5", "--confirm", "20"]);
    assert_eq!((&plan["want"][0]["quantity"], &plan["outcome"]), (&"fx".into(), &"confirmed".into()));
    let last = plan["attempts"].as_array().unwrap().last().unwrap();
    assert_eq!((&last["outcome"], &last["views"]), (&"confirmed".into(), &plan["confirmed_views"]));
    assert!(last["quantities"][0]["sd"]["high"].as_f64() <= Some(5.0), "{last:#}");
    assert!(plan["designs"].as_array().unwrap().contains(&plan["chosen"]), "{plan:#}");
}

#[test]
fn verbs_that_only_write_name_their_files_to_programs() {
    let folder = folder("json-written");
    assert_eq!(written(&folder, &object(&folder, &["board", "chess:9x6:25mm", "--out", "page"])), 2);
    assert_eq!(written(&folder, &object(&folder, &["new", "study", "my-study"])), 1);
    assert_eq!(written(&folder, &object(&folder, &["new", "adapter", "mine", "--language", "rust"])), 1);
    assert!(written(&folder, &object(&folder, &["manual", "--out", "man"])) > 30);
    let camera = r#"{"camera": {"fx": 20, "fy": 20, "cx": 15.5, "cy": 11.5, "k1": -0.1}}"#;
    fs::write(folder.join("camera.json"), camera).expect("written");
    let photo = calibench::raster::Raster::filled(32, 24, 128u8);
    calibench::io::write_png(&folder.join("photo.png"), &photo).expect("written");
    let corrected = object(
        &folder,
        &["undistort", "--camera", "camera.json", "--out", "corrected", "--mask", "photo.png"],
    );
    assert_eq!(written(&folder, &corrected), 3, "{corrected:#}");
}
