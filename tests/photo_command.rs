//! Does `calibench calibrate --board` get from image files to a camera, and say what it left out?

use crate::program::folder;
use calibench::board::Board;
use calibench::camera::Camera;
use calibench::geometry::Pose;
use calibench::io::{write_png, write_png_16};
use calibench::raster::Raster;
use calibench::synth::Truth;
use calibench::synth::render::{Imaging, photograph};
use calibench::synth::scene::looking_at_centre;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

const CALIBENCH: &str = env!("CARGO_BIN_EXE_calibench");

fn calibrate(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(CALIBENCH)
        .arg("calibrate")
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn rendered(board: &Board, pose: &Pose) -> Raster<f32> {
    let imaging = Imaging { blur_px: 0.5, ..Imaging::default() };
    photograph(&Truth::example_camera(), Truth::EXAMPLE_IMAGE, board, pose, &imaging)
        .expect("it is seen")
        .image
}

/// The chapter's four photographs, 16 bits each: `pose0.png` to `pose3.png`.
fn chapter_photos(folder: &Path) {
    for (i, pose) in Truth::example_poses().iter().enumerate() {
        let photo = rendered(&Truth::example_board(), pose).to_u16();
        write_png_16(&folder.join(format!("pose{i}.png")), &photo).expect("it is written");
    }
}

fn result(folder: &Path) -> serde_json::Value {
    let text = fs::read_to_string(folder.join("out/result.json")).expect("a result is written");
    serde_json::from_str(&text).expect("the result is JSON")
}

const CHAPTER_PHOTOS: [&str; 4] = ["pose0.png", "pose1.png", "pose2.png", "pose3.png"];

#[test]
fn photographs_give_the_camera_and_bad_files_are_named_and_left_out() {
    let folder = folder("photo-command");
    chapter_photos(&folder);
    let whole = fs::read(folder.join("pose0.png")).unwrap();
    fs::write(folder.join("broken.png"), &whole[..whole.len() / 2]).unwrap();
    fs::write(folder.join("empty.png"), b"").unwrap();
    write_png(&folder.join("small.png"), &Raster::filled(320, 240, 200u8)).unwrap();
    write_png(&folder.join("blank.png"), &Raster::filled(640, 480, 200u8)).unwrap();
    let bad = ["broken.png", "empty.png", "small.png", "blank.png", "missing.png"];
    let mut arguments = vec!["--board", "circles:9x7:10mm:3mm", "--out", "out"];
    // The broken file comes first: the size is that of the first photograph that can be read.
    arguments.push(bad[0]);
    arguments.extend(CHAPTER_PHOTOS);
    arguments.extend(&bad[1..]);
    let output = calibrate(&folder, &arguments);
    let (out, err) = (text(&output.stdout), text(&output.stderr));
    assert_eq!(output.status.code(), Some(0), "{out}\n{err}");
    for name in bad {
        assert!(err.contains(&format!("left out: {name}: ")), "{name}: {err}");
        assert!(out.contains(&format!("left out: {name}: ")), "{name}: {out}");
    }
    assert!(err.contains("320 x 240 px") && err.contains("0 bytes") && err.contains("broken image"), "{err}");
    let result = result(&folder);
    assert_eq!(result["left_out"].as_array().map(Vec::len), Some(bad.len()));
    assert_eq!(result["views"].as_array().map(Vec::len), Some(4));
    // The detector leaves 0.0014 px RMS at most on sharp renders (its tests), over 252 points an error vector
    // of 0.022 px; by Cauchy-Schwarz it moves fx by 6.81 px a pixel of unit noise at most: 0.15 px, and k1 by
    // 0.035 x 0.022 = 8e-4.
    let camera = |name: &str| result["camera"][name].as_f64().unwrap();
    assert!((camera("fx") - 600.0).abs() < 0.15 && (camera("cx") - 326.0).abs() < 0.15, "{result:#}");
    assert!((camera("k1") + 0.18).abs() < 8e-4, "{result:#}");
    assert!(out.contains("bias of the discs' centres corrected"), "{out}");
    for i in 0..4 {
        let overlay = fs::read(folder.join(format!("out/overlay/{:03}-pose{i}.png", i + 2))).unwrap();
        assert_eq!(&overlay[1..4], b"PNG");
    }
    // What cannot be read has no picture; what was read and holds no board has one.
    for (name, there) in
        [("001-broken", false), ("006-empty", false), ("007-small", true), ("008-blank", true)]
    {
        assert_eq!(folder.join(format!("out/overlay/{name}.png")).exists(), there, "{name}");
    }
    let page = fs::read_to_string(folder.join("out/report.html")).unwrap();
    for name in bad.iter().chain(&CHAPTER_PHOTOS) {
        assert!(page.contains(name), "{name} is not in the report");
    }
    // Residuals, views, lens, scatter, histogram, poses in space, from above and from the side, coverage,
    // deviation of a pixel.
    assert_eq!(page.matches("<svg").count(), 10);
    for external in ["http", "<script", "<link", "@import", "url("] {
        let found = page.replace("xmlns=\"http://www.w3.org/2000/svg\"", "").contains(external);
        assert!(!found, "the page must need nothing from elsewhere, but holds {external}");
    }
}

#[test]
fn the_marks_are_written_and_give_the_same_camera_again() {
    let folder = folder("photo-command-corners");
    chapter_photos(&folder);
    // A disc of the last photograph is covered: it costs itself.
    let mut photo = rendered(&Truth::example_board(), &Truth::example_poses()[3]);
    let exact = photograph(
        &Truth::example_camera(),
        Truth::EXAMPLE_IMAGE,
        &Truth::example_board(),
        &Truth::example_poses()[3],
        &Imaging::default(),
    );
    let at = exact.expect("it is seen").centres_true[31];
    for y in 0..photo.height() {
        for x in 0..photo.width() {
            if (x as f64 - at.x).abs() < 9.0 && (y as f64 - at.y).abs() < 9.0 {
                photo.set(x, y, 0.85);
            }
        }
    }
    write_png_16(&folder.join("pose3.png"), &photo.to_u16()).expect("it is written");
    let mut arguments = vec!["--board", "circles:9x7:10mm:3mm", "--out", "out"];
    arguments.extend(CHAPTER_PHOTOS);
    let output = calibrate(&folder, &arguments);
    let out = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{out}");
    assert!(out.contains("first mark: not fixed by this board") && out.contains("pose3.png (1)"), "{out}");
    let first = result(&folder);
    assert_eq!(first["orientation"], "half-turn");
    assert_eq!((&first["views"][0]["points"], &first["views"][3]["points"]), (&63.into(), &62.into()));
    let output = calibrate(&folder, &["out/corners.csv", "--image-size", "640x480", "--format", "json"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let again: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    for field in ["camera", "covariance", "sigma_px", "views"] {
        assert_eq!(first[field], again[field], "{field}");
    }
    // Corners that were given do not say which is the first.
    assert!(again["orientation"].is_null());
}

#[test]
fn without_the_diameter_the_bias_stays_and_is_said() {
    let folder = folder("photo-command-bias");
    chapter_photos(&folder);
    let mut arguments = vec!["--board", "circles:9x7:10mm", "--format", "json"];
    arguments.extend(CHAPTER_PHOTOS);
    let output = calibrate(&folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let result: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let warnings = result["warnings"].to_string();
    assert!(warnings.contains("not corrected for their bias"), "{warnings}");
    // r_max is 0.44 of a corner radius of about 0.67 in the chapter's camera.
    assert!(warnings.contains("of the corner radius"), "{warnings}");
}

#[test]
fn a_mis_detected_view_is_rejected_on_request() {
    let folder = folder("photo-command-reject");
    chapter_photos(&folder);
    for i in 0..3 {
        let pose = looking_at_centre([12.0 * f64::from(i) - 20.0, 18.0, 5.0], 125.0);
        write_png(&folder.join(format!("more{i}.png")), &rendered(&Truth::example_board(), &pose).to_u8())
            .unwrap();
    }
    // A grid that the detector takes for the board, though it is not: its rows are a tenth farther apart,
    // which a camera of longer fy shows.
    let stretching = Camera { fy: 660.0, ..Truth::example_camera() };
    let pose = looking_at_centre([25.0, 0.0, 0.0], 140.0);
    let stretched =
        photograph(&stretching, Truth::EXAMPLE_IMAGE, &Truth::example_board(), &pose, &Imaging::default());
    let photo = stretched.expect("it is seen").image;
    write_png(&folder.join("other.png"), &photo.to_u8()).unwrap();
    let mut arguments =
        vec!["--board", "circles:9x7:10mm:3mm", "--out", "out", "--reject-views", "3", "other.png"];
    arguments.extend(CHAPTER_PHOTOS);
    arguments.extend(["more0.png", "more1.png", "more2.png"]);
    let output = calibrate(&folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let result = result(&folder);
    let left_out = result["left_out"].as_array().unwrap();
    assert_eq!(left_out.len(), 1, "{left_out:?}");
    assert_eq!(left_out[0]["name"], "other.png");
    assert!(left_out[0]["reason"].as_str().unwrap().contains("times the median"), "{left_out:?}");
    assert!((result["camera"]["fx"].as_f64().unwrap() - 600.0).abs() < 0.15);
}

#[test]
fn colour_and_bright_discs_on_dark_ground_are_read_too() {
    let folder = folder("photo-command-bright");
    for (i, pose) in Truth::example_poses().iter().enumerate() {
        let dark = rendered(&Truth::example_board(), pose).to_u8();
        let colours = dark.samples().iter().flat_map(|&level| {
            let bright = 255 - level;
            // Red, green and blue differ, as under coloured light.
            [bright, bright / 2, bright / 3]
        });
        let image = image::RgbImage::from_raw(640, 480, colours.collect()).expect("three samples a pixel");
        image.save(folder.join(format!("pose{i}.png"))).expect("it is written");
    }
    let mut arguments = vec!["--board", "circles:9x7:10mm:3mm", "--format", "json"];
    arguments.extend(CHAPTER_PHOTOS);
    let output = calibrate(&folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let result: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    // A quarter of the contrast of the grey photographs, rounded to whole levels: an edge pixel is off by
    // half a level of about 100, over some 60 edge pixels of a disc 15 px wide, so a centre by about 0.003
    // px: ten times the error of sharp renders above at most.
    assert!((result["camera"]["fx"].as_f64().unwrap() - 600.0).abs() < 1.5, "{result:#}");
}

#[test]
fn nothing_usable_ends_with_two() {
    let folder = folder("photo-command-none");
    write_png(&folder.join("blank.png"), &Raster::filled(640, 480, 200u8)).unwrap();
    let none = calibrate(&folder, &["--board", "circles:9x7:10mm", "blank.png", "missing.png"]);
    assert_eq!(none.status.code(), Some(2));
    assert!(text(&none.stderr).contains("none of 2 photographs"), "{}", text(&none.stderr));
    for board in ["squares:9x7:10mm", "circles:9x7", "chess:9x6:25mm:3mm"] {
        assert_eq!(calibrate(&folder, &["--board", board, "blank.png"]).status.code(), Some(2), "{board}");
    }
    assert_eq!(calibrate(&folder, &["--reject-views", "0.5", "blank.png"]).status.code(), Some(2));
    let several = calibrate(&folder, &["a.csv", "b.csv"]);
    assert_eq!(several.status.code(), Some(2));
    assert!(text(&several.stderr).contains("--board"));
}

#[test]
#[cfg_attr(not(calibench_data), ignore = "needs the measurements of others: CONTRIBUTING.md, real data")]
fn the_bumblebee_camera_comes_out_of_the_command() {
    let data = crate::data::folder();
    let folder = folder("photo-command-bumblebee");
    let photos: Vec<String> = (1..=11)
        .map(|i| data.join(format!("bumblebee_left/left{i:02}.jpg")).to_string_lossy().into_owned())
        .collect();
    let mut arguments = vec!["--board", "chess:4x6:30mm", "--out", "out"];
    arguments.extend(photos.iter().map(String::as_str));
    let output = calibrate(&folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let published: toml::Table = fs::read_to_string(data.join("published.toml")).unwrap().parse().unwrap();
    let numbers = |key: &str| published["bumblebee_left"][key].as_array().unwrap().clone();
    let result = result(&folder);
    let names = ["fx", "fy", "cx", "cy", "k1", "k2"];
    for ((name, theirs), tolerance) in names.iter().zip(numbers("published")).zip(numbers("tolerance")) {
        let difference = result["camera"][name].as_f64().unwrap() - theirs.as_float().unwrap();
        // As in `detect_photos`: two standard deviations where the published tolerance is narrower.
        let deviation = result["standard_deviations"][name].as_f64().unwrap();
        let allowed = tolerance.as_float().unwrap().max(2.0 * deviation);
        assert!(difference.abs() <= allowed, "{name} differs by {difference}");
    }
}

#[test]
fn the_size_that_most_photographs_with_the_board_have_rules_whatever_comes_first() {
    let folder = folder("photo-sizes");
    chapter_photos(&folder);
    // A foreign photograph that can be read stands in front, as `left.jpg` before `left01.jpg`.
    write_png(&folder.join("a-foreign.png"), &Raster::filled(320, 240, 200u8)).unwrap();
    let board = ["--board", "circles:9x7:10mm:3mm", "--out", "out"];
    let output = calibrate(&folder, &[&board[..], &["a-foreign.png"], &CHAPTER_PHOTOS[..]].concat());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let said = text(&output.stderr);
    assert!(said.contains("left out: a-foreign.png") && said.contains("320 x 240"), "{said}");
    assert!(said.contains("4 of the 4 photographs with the board have 640 x 480 px"), "{said}");
    assert_eq!(result(&folder)["views"].as_array().map(Vec::len), Some(4));
    // Two cameras, equally many photographs: nothing says which is meant.
    let cropped = |name: &str, to: &str| {
        let photo = calibench::io::read_image(&folder.join(name)).unwrap().to_u8();
        let crop = Raster::from_fn(639, 480, |x, y| photo.get(x, y));
        write_png(&folder.join(to), &crop).unwrap();
    };
    cropped("pose0.png", "other0.png");
    cropped("pose1.png", "other1.png");
    let four = ["pose0.png", "pose1.png", "other0.png", "other1.png"];
    let output = calibrate(&folder, &[&board[..], &four[..]].concat());
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
    assert!(
        text(&output.stderr).contains("2 photographs of each of the sizes 639x480, 640x480"),
        "{}",
        text(&output.stderr)
    );
}
