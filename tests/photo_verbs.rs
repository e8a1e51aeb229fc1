//! Do the verbs on photographs do what they say? `calibench ninepoint` and `calibench undistort`, from file
//! to file.

use crate::program::folder;
use calibench::geometry::Vec2;
use calibench::io::{Channels, Grey, read_channels, read_image, write_png, write_png_16};
use calibench::raster::Raster;
use calibench::synth::Truth;
use calibench::synth::render::nine_dot_stand_in;
use calibench_harness::Context;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn calibench(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_calibench")).args(arguments).output().expect("the program starts")
}

fn text(path: &Path) -> &str {
    path.to_str().expect("the path is text")
}

#[test]
fn nine_dots_are_calibrated_from_file_to_json_and_overlay() {
    let folder = folder("ninepoint");
    let (image, out) = (folder.join("dots.png"), folder.join("out"));
    write_png(&image, &nine_dot_stand_in().image.to_u8()).unwrap();
    for mode in ["planar", "tilted", "similarity"] {
        let run =
            calibench(&["ninepoint", text(&image), "--mode", mode, "--out", text(&out), "--format", "json"]);
        assert_eq!(run.status.code(), Some(0), "{run:?}");
        let printed: Value = serde_json::from_slice(&run.stdout).unwrap();
        let written: Value =
            serde_json::from_str(&std::fs::read_to_string(out.join("result.json")).unwrap()).unwrap();
        assert_eq!(printed, written);
        assert_eq!(printed["mode"], mode);
        assert_eq!(printed["points"].as_array().map(Vec::len), Some(9));
        // Centres are found within 0.005 px (8-bit rounding), so is a column's spacing of 236.23 px; a
        // similarity takes the mean of both spacings, 0.02 px away.
        let spacing = 1.0 / printed["scale_x"].as_f64().unwrap();
        assert!((spacing - 236.23).abs() < 0.025, "{mode}: {spacing}");
    }
    assert_eq!(read_image(&out.join("overlay.png")).unwrap().size(), (1571, 1053));
    let wrong = calibench(&["ninepoint", text(&image), "--columns", "4"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(
        String::from_utf8_lossy(&wrong.stderr)
            .contains("a grid of 4 x 3 was asked, a complete 3 x 3 was seen"),
        "{wrong:?}"
    );
}

#[test]
fn the_experiment_takes_an_image_and_records_its_hash() {
    let folder = folder("ninepoint-image");
    let image = folder.join("dots.png");
    write_png(&image, &nine_dot_stand_in().image.to_u8()).unwrap();
    let experiment = calibench_experiments::EXPERIMENTS.iter().find(|e| e.id == "nine-point").unwrap();
    let own = experiment.execute(&Context::of(experiment)).unwrap();
    let given = experiment.execute(&Context::of(experiment).with_image(Some(image))).unwrap();
    assert_eq!((given.inputs().len(), given.inputs()[0].name.as_str()), (1, "dots.png"));
    assert_eq!(given.value("tx"), own.value("tx"));
    assert!(own.notes().iter().any(|n| n.contains("STAND-IN")));
    assert!(!given.notes().iter().any(|n| n.contains("STAND-IN")));
}

const CAMERA: &str = r#"{"camera": {"fx": 600, "fy": 600, "cx": 326, "cy": 243, "k1": -0.18, "k2": 0.05},
    "image_size": [640, 480], "something_else": true}"#;

#[test]
fn photographs_are_corrected_and_the_new_camera_is_told() {
    let folder = folder("undistort");
    let (camera, out) = (folder.join("result.json"), folder.join("out"));
    std::fs::write(&camera, CAMERA).unwrap();
    // A ramp along u: its value tells where a sample was taken.
    let ramp = Raster::from_fn(640, 480, |x, _| (x * 100) as u16);
    write_png_16(&folder.join("deep.photo.png"), &ramp).unwrap();
    write_png(&folder.join("eight.png"), &ramp.map(|&level| (level / 256) as u8)).unwrap();
    let (deep, eight) = (folder.join("deep.photo.png"), folder.join("eight.png"));
    let arguments = ["undistort", "--camera", text(&camera), "--out", text(&out), "--mask", "--border", "1"];
    for (view, empty) in [("same", false), ("all", true), ("valid", false)] {
        let run = calibench(&[&arguments[..], &["--view", view, text(&deep), text(&eight)]].concat());
        assert_eq!(run.status.code(), Some(0), "{run:?}");
        let told = std::fs::read_to_string(out.join("camera-640x480.json")).unwrap();
        let told: Value = serde_json::from_str(&told).unwrap();
        assert_eq!(told["camera"]["k1"], 0.0);
        assert_eq!(told["pixels_without_data"].as_u64().unwrap() > 0, empty, "{view}");
        let Grey::U8(mask) = read_image(&out.join("mask-640x480.png")).unwrap() else { panic!("8 bits") };
        let missing = mask.samples().iter().filter(|&&level| level == 0).count() as u64;
        assert_eq!(told["pixels_without_data"], missing);
        let Grey::U16(corrected) = read_image(&out.join("deep.photo.png")).unwrap() else {
            panic!("16 bits")
        };
        assert!(matches!(read_image(&out.join("eight.png")).unwrap(), Grey::U8(_)));
        if empty {
            assert_eq!((mask.get(0, 240), corrected.get(0, 240)), (0, u16::MAX));
        }
        if view == "same" {
            let source = Truth::example_camera().distort_pixel(&Vec2::new(40.0, 60.0));
            // The ramp is linear, so interpolation is exact; the level is rounded.
            assert!((f64::from(corrected.get(40, 60)) - 100.0 * source.x).abs() <= 0.51);
        }
    }
}

#[test]
fn a_photograph_that_cannot_be_used_is_named_and_the_others_are_done() {
    let folder = folder("undistort-bad");
    let (camera, out) = (folder.join("result.json"), folder.join("out"));
    std::fs::write(&camera, CAMERA).unwrap();
    let (good, small) = (folder.join("good.png"), folder.join("small.png"));
    write_png(&good, &Raster::filled(640, 480, 9)).unwrap();
    write_png(&small, &Raster::filled(64, 48, 9)).unwrap();
    let missing = folder.join("missing.png");
    let all = [text(&missing), text(&small), text(&good)];
    let run = calibench(&[&["undistort", "--camera", text(&camera), "--out", text(&out)][..], &all].concat());
    assert_eq!(run.status.code(), Some(3), "what is finished stands");
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(said.contains("missing.png") && said.contains("64 x 48") && said.contains("640 x 480"), "{said}");
    assert!(out.join("good.png").is_file() && !out.join("small.png").exists());
    let over = calibench(&["undistort", "--camera", text(&camera), "--out", text(&folder), text(&good)]);
    assert_eq!(over.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&over.stderr).contains("overwritten"), "{over:?}");
}

#[test]
fn a_camera_that_did_not_converge_and_a_photograph_named_like_a_mask_are_refused() {
    let folder = folder("undistort-refused");
    let (camera, out) = (folder.join("result.json"), folder.join("out"));
    let unconverged = CAMERA.replace("\"something_else\": true", "\"termination\": \"iteration-limit\"");
    std::fs::write(&camera, unconverged).unwrap();
    let photo = folder.join("mask-640x480.bmp");
    write_png(&photo, &Raster::filled(640, 480, 9)).unwrap();
    let arguments = ["undistort", "--camera", text(&camera), "--out", text(&out)];
    let run = calibench(&[&arguments[..], &[text(&photo)]].concat());
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("iteration-limit"), "{run:?}");
    std::fs::write(&camera, CAMERA).unwrap();
    let run = calibench(&[&arguments[..], &["--mask", text(&photo)]].concat());
    assert_eq!(run.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&run.stderr).contains("name of a mask"), "{run:?}");
    let run = calibench(&[&arguments[..], &[text(&photo)]].concat());
    assert_eq!(run.status.code(), Some(0), "{run:?}");
}

#[test]
fn colours_alpha_and_depth_are_kept() {
    let folder = folder("undistort-colour");
    let (camera, out, photo) = (folder.join("result.json"), folder.join("out"), folder.join("colour.png"));
    std::fs::write(&camera, CAMERA).unwrap();
    let ramp = |c: usize| Raster::from_fn(640, 480, move |x, y| (60 * x + 20 * y + 3000 * c) as u16);
    let channels: Vec<Raster<u16>> = (0..4).map(ramp).collect();
    Channels::U16(channels).write_png(&photo).unwrap();
    let run = calibench(&[
        "undistort",
        "--camera",
        text(&camera),
        "--out",
        text(&out),
        "--view",
        "all",
        text(&photo),
    ]);
    assert_eq!(run.status.code(), Some(0), "{run:?}");
    let Channels::U16(corrected) = read_channels(&out.join("colour.png")).unwrap() else { panic!("16 bits") };
    assert_eq!(corrected.len(), 4);
    // In the middle all channels are the ramp at one place; outside of the photograph alpha is clear.
    let levels: Vec<u16> = corrected.iter().map(|c| c.get(320, 240)).collect();
    assert!(levels.windows(2).all(|pair| pair[1].abs_diff(pair[0]).abs_diff(3000) <= 1), "{levels:?}");
    assert_eq!(corrected[3].get(0, 240), 0);
}
