//! Do `convert` and `diff` say what they do, and are mrcal's own files read?

use crate::data;
use crate::program::{calibench as run, folder, text};
use calibench::camera::{Camera, Lens, Model};
use calibench::io::formats::{FormatError, VnlBoard, Wishes, detect, parse_vnl, read_camera_file};
use calibench::io::read_camera;
use serde_json::Value;
use std::fs;

const CAMERA: &str = r#"{"camera": {"fx": 600.5, "fy": 599.5, "cx": 326.25, "cy": 243.75, "k1": -0.18, "k2": 0.05},
    "image_size": [640, 480], "free": ["fx"], "covariance": [[1]], "degrees_of_freedom": 100}"#;

#[test]
fn a_camera_goes_to_colmap_and_back_and_what_was_done_is_said() {
    let folder = folder("convert");
    fs::write(folder.join("result.json"), CAMERA).expect("written");
    let there = run(&folder, &["convert", "result.json", "cameras.txt", "--format", "json"]);
    assert_eq!(there.status.code(), Some(0), "{}", text(&there.stderr));
    let said: Value = serde_json::from_slice(&there.stdout).expect("JSON");
    assert_eq!(said["out"]["format"], "colmap");
    assert!(said["converted"][0].as_str().expect("a line").contains("moves by +0.5 px"), "{said:#}");
    assert!(said["lost"][0].as_str().expect("a line").contains("the covariance"), "{said:#}");
    assert!(said["read_back_px"].as_f64().expect("a number") < 1e-9);
    let back = run(&folder, &["convert", "cameras.txt", "again.json"]);
    assert_eq!(back.status.code(), Some(0), "{}", text(&back.stderr));
    assert!(text(&back.stdout).contains("moves by -0.5 px"), "{}", text(&back.stdout));
    let read = |name: &str| read_camera(&folder.join(name)).expect("a camera");
    assert_eq!(read("again.json"), read("result.json"));
    let half =
        run(&folder, &["convert", "result.json", "half.json", "--resize", "320x240", "--to", "calibench"]);
    assert!(
        text(&half.stdout).contains("scaled from 640 x 480 px to 320 x 240 px"),
        "{}",
        text(&half.stderr)
    );
    assert_eq!(read("half.json").0.cx, 0.5 * (326.25 + 0.5) - 0.5);
}

#[test]
fn what_cannot_be_converted_ends_with_two_and_writes_nothing() {
    let folder = folder("convert-refused");
    fs::write(folder.join("result.json"), CAMERA).expect("written");
    fs::write(folder.join("fisheye.txt"), "1 OPENCV_FISHEYE 640 480 1 1 0 0 0 0 0 0\n").expect("written");
    fs::write(folder.join("field.txt"), "1 FOV 640 480 1 1 0 0 0\n").expect("written");
    let cases: [(&[&str], &str); 7] = [
        (&["convert", "result.json", "camera.yaml"], "name it with --to, one of ros, kalibr, opencv-yaml"),
        (&["convert", "field.txt", "out.xml"], "the model FOV is none of the lenses here (brown-conrady"),
        (
            &["convert", "fisheye.txt", "out.cameramodel"],
            "mrcal cannot hold a kannala-brandt lens: calibrate again with another --model; it holds brown-conrady, rational, thin-prism",
        ),
        (&["convert", "result.json", "out.dat"], "--fit"),
        (&["convert", "result.json", "result.json"], "would be overwritten"),
        (&["convert", "result.json", "out.xml", "--image-size", "1x1"], "--resize 1x1"),
        (&["convert", "no-such-file", "out.xml"], "no-such-file"),
    ];
    for (arguments, expected) in cases {
        let output = run(&folder, arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(text(&output.stderr).contains(expected), "{}", text(&output.stderr));
    }
    assert_eq!(fs::read_dir(&folder).expect("a folder").count(), 3);
    let schema = run(&folder, &["convert", "--schema"]);
    assert!(serde_json::from_slice::<Value>(&schema.stdout).is_ok());
}

#[test]
fn boards_and_corners_are_converted() {
    let folder = folder("convert-corners");
    let target = run(&folder, &["convert", "chess:9x6:25mm", "target.yaml"]);
    assert_eq!(target.status.code(), Some(0), "{}", text(&target.stderr));
    assert!(
        fs::read_to_string(folder.join("target.yaml")).expect("read").contains("rowSpacingMeters: 0.025\n")
    );
    let board = run(&folder, &["convert", "target.yaml", "board.txt"]);
    assert!(text(&board.stdout).contains("--board chess:9x6:0.025m"), "{}", text(&board.stderr));
    let vnl = "# filename x y level\na 1 2 0\na 3 2 0\na 1 4 0\na 3 4.5 0\n";
    fs::write(folder.join("corners.vnl"), vnl).expect("written");
    let corners = run(&folder, &["convert", "corners.vnl", "corners.csv", "--board", "chess:2x2:10mm"]);
    assert_eq!(corners.status.code(), Some(0), "{}", text(&corners.stderr));
    let table = fs::read_to_string(folder.join("corners.csv")).expect("read");
    assert_eq!(table.lines().last(), Some("a,3,10,10,3,4.5"));
    let without = run(&folder, &["convert", "corners.vnl", "x.csv"]);
    assert!(text(&without.stderr).contains("--board"));
}

#[test]
fn diff_tells_a_turned_camera_from_another() {
    let folder = folder("diff");
    let camera = |fx: f64, cx: f64| {
        format!(
            "{{\"camera\": {{\"fx\": {fx}, \"fy\": {fx}, \"cx\": {cx}, \"cy\": 240}}, \"image_size\": [640, 480], \"free\": [\"fx\", \"fy\", \"cx\", \
             \"cy\"], \"covariance\": [[0.5, 0.4, 0, 0], [0.4, 0.5, 0, 0], [0, 0, 0.5, 0], [0, 0, 0, 0.5]], \"degrees_of_freedom\": 400}}"
        )
    };
    for (name, fx, cx) in [("a", 600.0, 320.0), ("near", 600.5, 320.5), ("far", 610.0, 320.0)] {
        fs::write(folder.join(format!("{name}.json")), camera(fx, cx)).expect("written");
    }
    let near = run(&folder, &["diff", "a.json", "near.json", "--format", "json", "--out", "out"]);
    assert_eq!(near.status.code(), Some(0), "{}", text(&near.stderr));
    let said: Value = serde_json::from_slice(&near.stdout).expect("JSON");
    assert_eq!(
        (&said["test"]["one_camera"], &said["test"]["degrees_of_freedom"]),
        (&Value::from(true), &Value::from(4))
    );
    assert!(said["max_px"].as_f64() > said["rms_px"].as_f64());
    for file in ["difference.json", "difference.svg", "difference-size.svg"] {
        assert!(folder.join("out").join(file).is_file(), "{file}");
    }
    let far = run(&folder, &["diff", "a.json", "far.json"]);
    assert_eq!(far.status.code(), Some(1), "{}", text(&far.stdout));
    assert!(text(&far.stdout).contains("they are two cameras"));
    // Where a file says that its standard deviations mislead, nothing is decided by them.
    let warned = "\"warnings\": [\"the standard deviation of fx misleads: an interval of two of them truly reaches 0.5 times\"], \"camera\"";
    fs::write(folder.join("warned.json"), camera(610.0, 320.0).replacen("\"camera\"", warned, 1))
        .expect("written");
    let doubted = run(&folder, &["diff", "a.json", "warned.json"]);
    assert_eq!(doubted.status.code(), Some(0), "{}", text(&doubted.stdout));
    assert!(text(&doubted.stdout).contains("not decided"), "{}", text(&doubted.stdout));
    assert!(text(&doubted.stdout).contains("warned.json: the standard deviation of fx misleads"));
    let json = run(&folder, &["diff", "a.json", "warned.json", "--format", "json"]);
    let said: Value = serde_json::from_slice(&json.stdout).expect("JSON");
    assert_eq!(
        (&said["test"]["one_camera"], said["doubts"].as_array().map(Vec::len)),
        (&Value::Null, Some(1))
    );
    // At one distance a camera that stands nearer shows the same.
    let at = run(&folder, &["diff", "a.json", "far.json", "--at", "1000", "--format", "json"]);
    let said: Value = serde_json::from_slice(&at.stdout).expect("JSON");
    assert!(
        (said["translation_mm"][2].as_f64().expect("a number") - 16.0).abs() < 5.0,
        "{}",
        said["translation_mm"]
    );
}

/// mrcal's files of a rational lens: fx and the last coefficient, as they stand there.
const MRCALS: [(&str, f64, f64); 2] =
    [("cam0.opencv8.cameramodel", 1761.181055, 0.0500223357), ("cam1.opencv8.cameramodel", 1761.0, 0.04)];

fn mrcals(name: &str) -> Result<Camera<Lens>, FormatError> {
    let path = data::folder().join("mrcal_models").join(name);
    let text = fs::read_to_string(path).expect("the file is there");
    assert_eq!(detect(name, &text)?.name, "mrcal");
    read_camera_file(detect(name, &text)?, name, &text, None, &Wishes::default()).map(|file| file.camera)
}

#[test]
#[cfg_attr(not(calibench_data), ignore = "needs the measurements of others: CONTRIBUTING.md, real data")]
fn mrcals_rational_lenses_are_read_and_its_splines_refused_by_name() {
    for (name, fx, k6) in MRCALS {
        let camera = mrcals(name).expect("a rational lens");
        assert_eq!(camera.distortion.model(), Model::Rational);
        assert_eq!((camera.fx, camera.distortion.coefficients().last()), (fx, Some(&k6)), "{name}");
    }
    let error = mrcals("cam0.splined.cameramodel").expect_err("another lens").to_string();
    assert!(error.contains("LENSMODEL_SPLINED_STEREOGRAPHIC_order=3"), "{error}");
    assert!(error.contains("mrcal-convert-lensmodel"), "{error}");
}

#[test]
#[cfg_attr(not(calibench_data), ignore = "needs the measurements of others: CONTRIBUTING.md, real data")]
fn mrcals_corners_are_read() {
    let name = "synthetic-board-observations.vnl";
    let text = fs::read_to_string(data::folder().join("mrcal_models").join(name)).expect("the file is there");
    let board = VnlBoard { columns: 10, rows: 10, spacing: 0.1 };
    let (corners, notes) = parse_vnl(name, &text, &board).expect("it is read");
    // Three frames of two cameras, all of whose corners were seen.
    assert_eq!(corners.view_names.len(), 6, "{:?}", corners.view_names);
    assert!(corners.views.iter().all(|view| view.len() == 100));
    assert_eq!((corners.views[0].pixels()[0].x, corners.views[0].pixels()[0].y), (1009.558, 1190.205));
    assert!(notes.iter().any(|note| note.contains("levels")), "{notes:?}");
}
