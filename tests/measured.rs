//! `calibench calibrate CORNERS.csv --target TARGET.csv`: what it prints and leaves, what other verbs make of
//! that, and what it refuses. The estimator itself is tested in `src/calibench/measured/tests.rs`.

use crate::program::{calibench as run, folder, text};
use calibench::geometry::{Pose, Vec2, Vec3, rotation};
use calibench::io::{Known, parse_target, read_known};
use calibench::synth::{Stream, StreamKey, Truth};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// Two walls of 8 x 4 marks each.
fn walls() -> Vec<Vec3> {
    let mark = |i: u32| {
        let (row, column) = (12.0 * f64::from(i % 32 / 8) - 18.0, 8.0 * f64::from(i % 8));
        if i < 32 { Vec3::new(-column, row, 0.0) } else { Vec3::new(0.8 * column, row, 0.6 * column) }
    };
    (0..64).map(mark).collect()
}

/// A folder with `target.csv` and `corners.csv`: marks measured to 0.02 mm, one bumped by 0.3 mm, and seen
/// with noise of 0.1 px; nominal places in the corner file that are wrong.
fn scene(name: &str) -> PathBuf {
    let folder = folder(name);
    let mut noise =
        Stream::open(StreamKey { seed: 9, scenario: "measured-command", trial: 0, purpose: "noise" });
    let mut target = "point,X,Y,Z,sd\n".to_string();
    let mut corners = "view,point,X,Y,u,v\n".to_string();
    for (i, p) in walls().iter().enumerate() {
        let mut draw = || 0.02 * noise.normal();
        let bump = if i == 17 { 0.3 } else { 0.0 };
        let at = p + Vec3::new(draw(), draw() + bump, draw());
        writeln!(target, "w{i},{},{},{},0.02", at.x, at.y, at.z).expect("text grows");
    }
    for (view, [x, y]) in [[0.2, 0.1], [-0.3, 0.2], [0.1, -0.4], [0.35, 0.3]].into_iter().enumerate() {
        let pose =
            Pose { rotation: rotation::from_xyz_rad(x, y, 0.1), translation: Vec3::new(0.0, 0.0, 190.0) };
        for (i, p) in walls().iter().enumerate() {
            let pixel = Truth::example_camera().project(&pose.apply(p)).expect("it is before the camera");
            let pixel = pixel + 0.1 * Vec2::new(noise.normal(), noise.normal());
            writeln!(corners, "view{view},w{i},0,0,{},{}", pixel.x, pixel.y).expect("text grows");
        }
    }
    fs::write(folder.join("target.csv"), target).expect("written");
    fs::write(folder.join("corners.csv"), corners).expect("written");
    folder
}

const MEASURED: [&str; 6] = ["calibrate", "corners.csv", "--target", "target.csv", "--image-size", "640x480"];

fn object(folder: &Path, more: &[&str]) -> Value {
    let output = run(folder, &[&MEASURED[..], &["--format", "json"], more].concat());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn a_measured_target_gives_a_camera_and_names_the_mark_that_was_bumped() {
    let folder = scene("measured-target");
    let output = run(&folder, &[&MEASURED[..], &["--out", "out"]].concat());
    let said = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(said.contains("warning: marks that are not where they were measured: w17 ("), "{said}");
    assert!(
        said.contains("warning: corners.csv: columns X,Y were not read: target.csv says where the marks are"),
        "{said}"
    );
    let said = object(&folder, &[]);
    let off = said["camera"]["fx"].as_f64().unwrap() - 600.0;
    let sd = said["standard_deviations"]["fx"].as_f64().unwrap();
    assert!(off.abs() < 4.5 * sd && sd < 3.0, "{off} {sd}");
    assert_eq!(said["target"]["beyond_expectation"], serde_json::json!(["w17"]));
    assert_eq!(
        (said["target"]["noise"].as_str(), said["views"][0]["name"].as_str()),
        (Some("estimated"), Some("view0"))
    );
    let marks = said["target"]["marks"].as_array().unwrap();
    assert!(marks.len() == 64 && marks[17]["correction"][1].as_f64().unwrap() < -0.1, "{}", marks[17]);
    let page = fs::read_to_string(folder.join("out/report.html")).unwrap();
    for words in [
        "marks that are not where they were measured: w17 (",
        "<td>w17</td>",
        "54 more marks",
        "Points in each part of the frame",
    ] {
        assert!(page.contains(words), "{words}");
    }
    assert!(folder.join("out/residuals.svg").is_file());
    // What stands in the folder is read by whoever reads cameras, with the covariance; marks.csv is a target
    // again.
    let Known::Camera(known) = read_known(&folder.join("out/result.json")).unwrap() else {
        panic!("a camera")
    };
    assert_eq!(known.covariance.intrinsics.nrows(), 6);
    let marks = parse_target("marks.csv", &fs::read(folder.join("out/marks.csv")).unwrap()).unwrap();
    assert!(marks.marks().len() == 64 && (marks.marks()[17].position - walls()[17]).norm() < 0.25);
    for verb in [
        vec!["convert", "out/result.json", "camera.yaml", "--to", "opencv-yaml"],
        vec!["diff", "out/result.json", "out/result.json"],
    ] {
        let output = run(&folder, &verb);
        assert_eq!(output.status.code(), Some(0), "{verb:?}: {}", text(&output.stderr));
    }
}

#[test]
fn a_noise_that_is_known_is_taken_and_tested() {
    let folder = scene("measured-noise");
    // Without the bumped mark all is as it was stated.
    let target = fs::read_to_string(folder.join("target.csv")).unwrap();
    let corners = fs::read_to_string(folder.join("corners.csv")).unwrap();
    let without =
        |file: &str| file.lines().filter(|line| !line.contains("w17,")).collect::<Vec<_>>().join("\n") + "\n";
    fs::write(folder.join("target.csv"), without(&target)).unwrap();
    fs::write(folder.join("corners.csv"), without(&corners)).unwrap();
    let said = object(&folder, &["--sigma", "0.1"]);
    assert_eq!((said["sigma_px"].as_f64(), said["target"]["noise"].as_str()), (Some(0.1), Some("given")));
    assert_eq!(
        (&said["target"]["noise_test"]["holds"], &said["target"]["credibility"]["holds"]),
        (&true.into(), &true.into())
    );
    let wrong = object(&folder, &["--sigma", "0.03"]);
    assert_eq!(wrong["target"]["noise_test"]["holds"], false);
    assert!(wrong["warnings"].to_string().contains("the noise that was given"), "{}", wrong["warnings"]);
}

#[test]
fn what_contradicts_a_target_is_refused() {
    let folder = scene("measured-contradictions");
    let refused = |arguments: &[&str], words: &str| {
        let output = run(&folder, arguments);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains(words) && text(&output.stdout).is_empty(), "{arguments:?}: {said}");
    };
    for (more, words) in [
        (vec!["--board", "circles:9x7:10mm:3mm"], "--board and --out DIR first"),
        (vec!["--model", "auto"], "with --target name a lens"),
        (vec!["--board-shape", "bow:0.1"], "--board-shape estimates"),
        (vec!["--loss", "huber:0.5"], "--loss resists strays"),
        (vec!["--intervals", "profile"], "--intervals is not known"),
        (vec!["--reject-views", "3"], "--reject-views is not known"),
        (vec!["--mode", "planar"], "--mode is for point pairs"),
        (vec!["--fix", "k1=0", "--prior", "k1=0+-1"], "k1 is in --prior and in --fix"),
        (vec!["--image-size", "320x240"], "marks lie outside of the image"),
    ] {
        let mut arguments = MEASURED.to_vec();
        if more[0] == "--image-size" {
            arguments.truncate(4);
        }
        refused(&[arguments, more].concat(), words);
    }
    refused(&["calibrate", "corners.csv", "--sigma", "0.1"], "--sigma goes with --target");
    refused(&["calibrate", "-", "--target", "-"], "standard input cannot be both files");
    refused(&["calibrate", "corners.csv", "--target", "nowhere.csv"], "nowhere.csv");
    let corners = fs::read_to_string(folder.join("corners.csv")).unwrap();
    fs::write(folder.join("corners.csv"), corners.replace("view2,w5,", "view2,x5,")).unwrap();
    refused(&MEASURED, "corners.csv: view 'view2' shows mark 'x5', which the target does not have");
}
