//! What is left of a verb's work where one of its files cannot be written? All the rest, and above all what
//! was found. A folder in the place of a file is what every system refuses.
#![cfg(target_os = "linux")]

use crate::hostile::{limited, refused};
use crate::program::{folder, text};
use calibench::io::CornerFile;
use calibench::io::formats::corner_text;
use calibench::synth::Scene;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

const SPEC: &str = r#"name = "unwritten"
question = "Is what was done kept?"
seed = 1

[scene]
camera = { fx = 600.0, fy = 600.0, cx = 320.0, cy = 240.0 }
image = [640, 480]
target = { columns = 9, rows = 7, spacing_mm = 10.0 }
poses = { kind = "spread", views = 3, tilt_deg = 30.0, distance_mm = 150.0 }
noise_px = 0.1

[trials]
per_cell = 6
batch = 2
"#;

/// A folder of the test's own, with a corner file in it.
fn with_corners(name: &str) -> PathBuf {
    let folder = folder(name);
    let views = Scene::example().exact();
    let view_names = (0..views.len()).map(|view| view.to_string()).collect();
    fs::write(folder.join("corners.csv"), corner_text(&CornerFile { view_names, views })).unwrap();
    folder
}

fn blocked(folder: &Path, name: &str) {
    fs::create_dir_all(folder.join(name)).unwrap();
}

/// Ends with 3, names the file on standard error, and says what was found on standard output.
fn found(folder: &Path, arguments: &[&str], file: &str) -> String {
    let output = limited(folder, arguments);
    let (out, said) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(3), "{arguments:?}: {said}");
    assert!(said.contains(file), "{arguments:?}: {said}");
    assert!(said.contains("what was found is on standard output only"), "{arguments:?}: {said}");
    out
}

#[test]
fn what_was_found_is_said_where_a_file_of_it_cannot_be_written() {
    let folder = with_corners("unwritten-found");
    for file in ["residuals.svg", "report.html", "result.json"] {
        let out = format!("of-{file}");
        blocked(&folder, &format!("{out}/{file}"));
        let calibrate =
            ["calibrate", "corners.csv", "--image-size", "640x480", "--format", "json", "--out", &out];
        let result: Value = serde_json::from_str(&found(&folder, &calibrate, file)).unwrap();
        assert!((result["camera"]["fx"].as_f64().unwrap() - 600.0).abs() < 1e-6, "{file}");
        // All files or none.
        assert_eq!(fs::read_dir(folder.join(&out)).unwrap().count(), 1, "{file}");
    }
    assert_eq!(limited(&folder, &["calibrate", "corners.csv", "--out", "whole"]).status.code(), Some(0));
    let camera = "whole/result.json";
    blocked(&folder, "d/difference.svg");
    let diff =
        found(&folder, &["diff", camera, camera, "--image-size", "640x480", "--out", "d"], "difference.svg");
    assert!(diff.contains("px"), "{diff}");
    assert!(!folder.join("d/difference.json").exists());
    blocked(&folder, "t/tsai.json");
    let tsai = found(&folder, &["tsai", "corners.csv", "--image-size", "640x480", "--out", "t"], "t/");
    assert!(tsai.contains("fx") || tsai.contains("focal"), "{tsai}");
    blocked(&folder, "v/validation.json");
    let validate = ["validate", camera, "corners.csv", "--k-fold", "2", "--out", "v"];
    assert!(!found(&folder, &validate, "validation.json").is_empty());
}

/// A check is added once, whatever becomes of what is said of it, and who cannot read it is told.
#[test]
fn a_check_that_was_added_is_told_where_nothing_else_can_be() {
    let folder = folder("unwritten-check");
    fs::write(folder.join("h.csv"), "when,value\n1,25.0\n").unwrap();
    blocked(&folder, "c/trend.svg");
    let check = ["check-reference", "h.csv", "--reference", "25", "--sd", "0.01", "--add", "26"];
    let output = limited(&folder, &[&check[..], &["--out", "c"]].concat());
    let (out, said) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(out.contains("OUT OF CONTROL"), "{out}");
    assert!(
        said.contains("trend.svg") && said.contains("number 2 of h.csv now: do not add it again"),
        "{said}"
    );
    assert_eq!(fs::read_to_string(folder.join("h.csv")).unwrap(), "when,value\n1,25.0\n2,26\n");
    let full = std::process::Command::new(crate::hostile::CALIBENCH)
        .args(check)
        .current_dir(&folder)
        .stdout(fs::OpenOptions::new().write(true).open("/dev/full").unwrap())
        .output()
        .unwrap();
    let said = text(&full.stderr);
    assert!(full.status.code() == Some(3) && said.contains("number 3 of h.csv now"), "{said}");
}

/// A solver may take hours: where its report cannot be written, it is not asked; where that shows later only,
/// the verdict is given, and the other reports are written.
#[test]
fn a_report_that_cannot_be_written_is_refused_before_a_solver_is_asked() {
    let folder = folder("unwritten-report");
    blocked(&folder, "blocked");
    for (gate, option) in [
        (&["gate", "--samples", "1"][..], "--json"),
        (&["gate", "--samples", "1"], "--junit"),
        (&["gate", "--samples", "1"], "--html"),
        (&["gate", "hand-eye"], "--json"),
        (&["gate", "detector"], "--json"),
    ] {
        let output = limited(&folder, &[gate, &["--solver", "touch asked; cat", option, "blocked"]].concat());
        let said = text(&output.stderr);
        assert!(output.status.code() == Some(3) && said.contains("a folder is there"), "{gate:?}: {said}");
    }
    assert!(!folder.join("asked").exists());
}

/// Trials are not computed again, nor thrown away, because a file beside them was lost.
#[test]
fn a_complete_run_without_its_checkpoint_is_left_as_it_is() {
    let folder = folder("unwritten-checkpoint");
    fs::write(folder.join("study.toml"), SPEC).unwrap();
    let run = |arguments: &[&str]| limited(&folder, &[&["study"], arguments].concat());
    assert_eq!(run(&["run", "study.toml", "--out", "out"]).status.code(), Some(0));
    let trials = fs::read(folder.join("out/trials.csv")).unwrap();
    let checkpoint = fs::read(folder.join("out/checkpoint.json")).unwrap();
    fs::remove_file(folder.join("out/checkpoint.json")).unwrap();
    refused(
        &folder,
        &["study", "resume", "out"],
        &["checkpoint.json", "it is missing, and the run was complete"],
    );
    assert_eq!(fs::read(folder.join("out/trials.csv")).unwrap(), trials);
    fs::write(folder.join("out/checkpoint.json"), checkpoint).unwrap();
    fs::remove_file(folder.join("out/trials.csv")).unwrap();
    refused(&folder, &["study", "resume", "out"], &["trials.csv", "it is missing"]);
    assert!(!folder.join("out/trials.csv").exists());
    fs::create_dir(folder.join("other")).unwrap();
    fs::write(folder.join("other/figures"), "").unwrap();
    refused(&folder, &["study", "run", "study.toml", "--out", "other"], &["figures is no folder"]);
}

/// Where the cost falls to numbers that no verb takes for a camera's, no verb is given them.
#[test]
fn what_is_no_camera_is_not_told_as_one() {
    let folder = with_corners("unwritten-camera");
    let calibrate =
        ["calibrate", "corners.csv", "--fix", "k1=1e29", "--image-size", "640x480", "--out", "out"];
    refused(&folder, &calibrate, &["no camera", "focal lengths are from"]);
    assert!(!folder.join("out").exists());
}
