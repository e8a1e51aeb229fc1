//! Does `calibench next-pose` say what a photograph from its pose does? The photograph is taken, and the
//! camera calibrated anew.

use crate::program::{calibench as run, folder, text};
use calibench::board::View;
use calibench::geometry::{Pose, Vec2, Vec3, rotation};
use calibench::io::read_lens_camera;
use calibench::synth::{Scene, Stream, StreamKey, Truth};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

const BOARD: &str = "circles:9x7:10mm:3mm";

fn corner_lines(name: &str, view: &View, lines: &mut String) {
    for (point, (at, pixel)) in view.pairs().enumerate() {
        writeln!(lines, "{name},{point},{},{},{},{}", at.x, at.y, pixel.x, pixel.y).expect("text grows");
    }
}

/// Four noisy views of the example, as a corner file; their lines.
fn four_views(folder: &Path) -> String {
    let key = StreamKey { seed: 12, scenario: "next-pose", trial: 0, purpose: "noise" };
    let views = Scene::example().observe(0.1, &mut Stream::open(key));
    let mut lines = "view,point,X,Y,u,v\n".to_string();
    views.iter().enumerate().for_each(|(i, view)| corner_lines(&i.to_string(), view, &mut lines));
    fs::write(folder.join("corners.csv"), &lines).expect("written");
    lines
}

fn calibrated(folder: &Path, corners: &str, out: &str, options: &[&str]) -> Value {
    let output =
        run(folder, &[&["calibrate", corners, "--image-size", "640x480", "--out", out], options].concat());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    json_file(&folder.join(out).join("result.json"))
}

fn json_file(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).expect("read")).expect("JSON")
}

fn calibrated_folder(name: &str) -> (PathBuf, Value) {
    let folder = folder(name);
    four_views(&folder);
    let result = calibrated(&folder, "corners.csv", "result", &[]);
    (folder, result)
}

fn planned(folder: &Path, options: &[&str]) -> Value {
    let output = run(
        folder,
        &[&["next-pose", "result/result.json", "--board", BOARD, "--format", "json"], options].concat(),
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert_eq!(text(&output.stderr), "");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

fn vector(value: &Value) -> Vec3 {
    Vec3::from(std::array::from_fn(|i| value[i].as_f64().expect("a number")))
}

/// The noise of the added view is none, so that the estimate stays and only the covariance changes; that is
/// for the noise that the residuals tell, which is then a little smaller.
#[test]
fn the_camera_calibrated_with_the_view_is_as_sure_as_was_said() {
    for (name, options, want) in [
        ("next-pose-fx", &[][..], "fx"),
        ("next-pose-tied", &["--tie", "fy=fx"][..], "fy"),
        ("next-pose-fisheye", &["--model", "kannala-brandt"][..], "k1"),
    ] {
        let folder = folder(name);
        let lines = four_views(&folder);
        let result = calibrated(&folder, "corners.csv", "result", options);
        let found = planned(&folder, &["--want", want]);
        let best = &found["poses"][0];
        let pose = Pose {
            rotation: rotation::exp(&vector(&best["rotation_vector_rad"])),
            translation: vector(&best["translation"]),
        };
        let (camera, _) = read_lens_camera(&folder.join("result/result.json")).expect("a camera");
        let points = Truth::example().points;
        let pixel = |p: &Vec2| camera.pixel(&pose.apply(&Vec3::new(p.x, p.y, 0.0))).expect("it is seen");
        let pixels: Vec<Vec2> = points.iter().map(pixel).collect();
        assert!(pixels.iter().all(|p| (0.0..=639.0).contains(&p.x) && (0.0..=479.0).contains(&p.y)));
        let mut more = lines;
        corner_lines("next", &View::new(points, pixels).expect("a view"), &mut more);
        fs::write(folder.join("more.csv"), more).expect("written");
        let again = calibrated(&folder, "more.csv", "again", options);
        let sd = |result: &Value| {
            let sd = result["standard_deviations"][want].as_f64().expect("estimated");
            sd / result["sigma_px"].as_f64().expect("noise")
        };
        let gain = &best["gains"][0];
        let ratio = gain["ratio"].as_f64().expect("a number");
        assert!((ratio / (sd(&again) / sd(&result)) - 1.0).abs() < 1e-6, "{name}: {ratio}");
        assert!(ratio < 0.9, "{name}: {ratio}");
        let repeated = found["best_view_again"]["gains"][0]["ratio"].as_f64().expect("compared");
        assert!(repeated > ratio, "{name}: {repeated} {ratio}");
    }
}

#[test]
fn several_wishes_are_told_in_words_and_numbers_and_written() {
    let (folder, result) = calibrated_folder("next-pose-words");
    let arguments = [
        "next-pose",
        "result/result.json",
        "--corners",
        "corners.csv",
        "--want",
        "fx",
        "--want",
        "pixel",
        "--want",
        "length",
        "--at",
        "0,0,150",
        "--length",
        "50",
        "--out",
        "next",
    ];
    let output = run(&folder, &arguments);
    let said = text(&output.stdout);
    assert_eq!((output.status.code(), text(&output.stderr).as_str()), (Some(0), ""), "{said}");
    for words in [
        "for fx and pixel and length",
        "Hold the board with its middle",
        "away from the camera",
        "best view taken",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    let found = json_file(&folder.join("next/next-pose.json"));
    let gains = found["poses"][0]["gains"].as_array().expect("three");
    assert_eq!(
        gains.iter().map(|g| g["quantity"].as_str()).collect::<Vec<_>>(),
        [Some("fx"), Some("pixel"), Some("length")]
    );
    assert_eq!(gains[0]["sd_before"], result["standard_deviations"]["fx"]);
    assert!(gains.iter().all(|gain| gain["ratio"].as_f64() < Some(1.0)));
    // The marks of the file are those of the board, in whatever order.
    assert_eq!(found["marks"], 63);
    let of_board = planned(
        &folder,
        &["--want", "fx", "--want", "pixel", "--want", "length", "--at", "0,0,150", "--length", "50"],
    );
    let ratio = |found: &Value| found["poses"][0]["gains"][1]["ratio"].as_f64().expect("a number");
    assert!((ratio(&found) / ratio(&of_board) - 1.0).abs() < 1e-9);
    // One wish alone is met better than among others.
    let alone = planned(&folder, &["--want", "fx"]);
    assert!(alone["poses"][0]["gains"][0]["ratio"].as_f64() <= gains[0]["ratio"].as_f64());
}

#[test]
fn another_board_or_another_unit_is_noticed() {
    let (folder, _) = calibrated_folder("next-pose-board");
    let output = run(
        &folder,
        &[
            "next-pose",
            "result/result.json",
            "--board",
            "circles:9x7:1cm:3mm",
            "--want",
            "fx",
            "--distance",
            "10,20",
            "--format",
            "json",
        ],
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("would not have given its covariance"), "{}", text(&output.stderr));
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(found["best_view_again"], Value::Null);
}

#[test]
fn a_result_that_doubts_its_deviations_is_told_to() {
    let (folder, mut result) = calibrated_folder("next-pose-doubts");
    let doubt = "another camera explains the data nearly as well: fx = 1 beside 2";
    result["warnings"] = serde_json::json!([doubt]);
    fs::write(folder.join("doubting.json"), result.to_string()).expect("written");
    let asks = ["next-pose", "doubting.json", "--board", BOARD, "--want", "fx", "--format", "json"];
    let output = run(&folder, &asks);
    assert!(text(&output.stderr).contains(doubt), "{}", text(&output.stderr));
    let said: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(said["doubts"], serde_json::json!([doubt]));
}

#[test]
fn what_cannot_be_planned_is_wrong_usage_with_what_to_do() {
    let (folder, mut result) = calibrated_folder("next-pose-usage");
    let write = |name: &str, value: &Value| fs::write(folder.join(name), value.to_string()).expect("written");
    let whole = result.clone();
    let fields = result.as_object_mut().expect("an object");
    fields.remove("image_size");
    write("no-size.json", &result);
    let mut broken = whole.clone();
    broken["covariance"][0][0] = Value::Null;
    write("no-covariance.json", &broken);
    broken["covariance"][0][0] = (-1.0).into();
    write("negative.json", &broken);
    let mut silent = whole.clone();
    silent["sigma_px"] = 0.0.into();
    write("silent.json", &silent);
    let mut bent = whole.clone();
    bent["board"] = serde_json::json!({});
    write("bent.json", &bent);
    let mut alone = whole.clone();
    alone["views"] = Value::Array(vec![]);
    write("no-views.json", &alone);
    let mut impossible = whole;
    impossible["camera"]["fx"] = 0.0.into();
    write("impossible.json", &impossible);
    fs::write(
        folder.join("pairs.csv"),
        "point,px,py,X,Y\n0,0,0,0,0\n1,100,0,1,0\n2,0,100,0,1\n3,100,101,1,1\n4,50,51,0.5,0.5\n",
    )
    .expect("written");
    assert_eq!(
        run(&folder, &["calibrate", "pairs.csv", "--mode", "tilted", "--out", "plane"]).status.code(),
        Some(0)
    );
    let of = |result: &'static str, rest: &[&'static str]| {
        [&["next-pose", result, "--board", BOARD, "--want"][..], rest].concat()
    };
    let whole = "result/result.json";
    for (arguments, words) in [
        (of("no-size.json", &["fx"]), "--image-size"),
        (of(whole, &["fx", "--image-size", "320x240"]), "its image has 640 x 480 px"),
        (of(whole, &["fx", "--at", "0,0,150", "--length", "20"]), "are for --want length"),
        (of("no-covariance.json", &["fx"]), "no joint covariance"),
        (of("negative.json", &["fx"]), "the covariance of the camera is none"),
        (of("silent.json", &["fx"]), "--mark-sd"),
        (of("bent.json", &["fx"]), "the board's shape was estimated"),
        (of("no-views.json", &["fx"]), "--distance NEAR,FAR"),
        (of("impossible.json", &["fx"]), "fx"),
        (of("plane/result.json", &["fx"]), "the map of a plane"),
        (of("missing.json", &["fx"]), "missing.json"),
        (of(whole, &["p1"]), "p1 was not estimated"),
        (of(whole, &["focal"]), "or pixel, or length"),
        (of(whole, &["length"]), "--at X,Y,Z and --length"),
        (of(whole, &["length", "--at", "0,0,nan", "--length", "5"]), "X,Y,Z"),
        (of(whole, &["length", "--at", "0,0,10", "--length", "5000"]), "outside of the image"),
        (of(whole, &["fx", "--want", "fx"]), "twice"),
        (of(whole, &["fx", "--distance", "10,12"]), "no pose of"),
        (of(whole, &["fx", "--distance", "12,10"]), "NEAR,FAR"),
        (of(whole, &["fx", "--distance", "nan,10"]), "NEAR,FAR"),
        (of(whole, &["fx", "--most-tilt", "90"]), "less than 80"),
        (of(whole, &["fx", "--margin", "400"]), "no pose of"),
        (of(whole, &["fx", "--mark-sd", "nan"]), "from 1e-9 to 1e9"),
        (vec!["next-pose", whole, "--want", "fx"], "--board"),
        (vec!["next-pose", whole, "--board", BOARD], "--want"),
        (vec!["next-pose", whole, "--board", "circles:1000x1000:1mm:0.5mm", "--want", "fx"], "marks"),
    ] {
        let output = run(&folder, &arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(words), "{arguments:?}: {said}");
        assert_eq!(text(&output.stdout), "", "{arguments:?}");
    }
}

#[test]
fn what_residuals_with_strays_spread_by_is_not_taken_for_noise() {
    let (folder, _) = calibrated_folder("next-pose-robust");
    let robust = calibrated(&folder, "corners.csv", "robust", &["--loss", "huber:0.2"]);
    assert_eq!(robust["loss"], "huber:0.2");
    let bent = calibrated(&folder, "corners.csv", "bent", &["--board-shape", "bow:0.01"]);
    assert!(bent.get("loss").is_none());
    let measure = |of: &'static str| vec!["measure", of, "--view", "1", "--pixels", "300,200,340,200"];
    let plan = |of: &'static str| vec!["next-pose", of, "--board", BOARD, "--want", "fx"];
    let file = "robust/result.json";
    for (arguments, words) in [
        (measure(file), "--mark-sd"),
        (plan(file), "--mark-sd"),
        (vec!["validate", file, "corners.csv"], "--again"),
        (measure("bent/result.json"), "flat boards only"),
    ] {
        let output = run(&folder, &arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(words), "{arguments:?}: {said}");
    }
    for arguments in [measure(file), plan(file)] {
        let output = run(&folder, &[&arguments[..], &["--mark-sd", "0.1"]].concat());
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", text(&output.stderr));
    }
    // Its covariance is another than these marks would have given by squares: that is no other board.
    let output =
        run(&folder, &["next-pose", file, "--corners", "corners.csv", "--want", "fx", "--mark-sd", "0.1"]);
    let said = text(&output.stderr);
    assert!(said.contains("does not tell") && !said.contains("another board"), "{said}");
}
