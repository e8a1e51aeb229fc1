//! Lens models against other programs, and as the command's user meets them.

use crate::program::{calibench as run, folder, text};
use calibench::camera::{BrownConrady, Camera, Lens, Model};
use calibench::geometry::{Pose, Vec2, Vec3, rotation};
use calibench::io::read_lens_camera;
use calibench::raster::Raster;
use calibench::synth::{Stream, StreamKey, Truth};
use serde_json::Value;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// The lens and linear parameters of `reference/lenses/make.py`.
fn reference_camera(model: &str, coefficients: &str) -> Camera<Lens> {
    let coefficients: Vec<f64> = coefficients.split(' ').map(|c| c.parse().unwrap()).collect();
    let lens = Lens::new(model.parse().unwrap(), &coefficients).unwrap();
    Camera::with_lens(812.5, 806.75, 641.25, 477.5, lens)
}

#[test]
fn pixels_are_those_of_other_programs() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("reference/lenses/pixels.csv");
    let mut seen = 0;
    for line in fs::read_to_string(file).unwrap().lines().skip(1) {
        let [model, coefficients, numbers @ ..] = &line.split(',').collect::<Vec<_>>()[..] else {
            panic!("{line}")
        };
        let [x, y, z, u, v] = numbers.iter().map(|n| n.parse().unwrap()).collect::<Vec<f64>>()[..] else {
            panic!("{line}")
        };
        let camera = reference_camera(model, coefficients);
        let pixel = camera.pixel(&Vec3::new(x, y, z)).unwrap();
        assert!((pixel - Vec2::new(u, v)).norm() < 1e-9, "{line}: {pixel}");
        // And the ray of that pixel is the point's direction.
        let ray = camera.ray(&pixel).unwrap();
        assert!((ray - Vec3::new(x, y, z).normalize()).norm() < 1e-12, "{line}: {ray}");
        seen += 1;
    }
    assert_eq!(seen, 40 * Model::ALL.len());
}

/// A corner file of a fisheye with noise of 0.1 px: eight views of a 9 x 7 board, `column` besides if given.
fn fisheye_corners(column: Option<(&str, &dyn Fn(usize) -> f64)>) -> (Camera<Lens>, String) {
    let lens = Lens::new(Model::KannalaBrandt, &[-0.03, 0.005, -0.001, 0.0]).unwrap();
    let camera = Camera::with_lens(310.0, 312.0, 322.0, 241.0, lens);
    let mut stream = Stream::open(StreamKey { seed: 9, scenario: "fisheye", trial: 0, purpose: "noise" });
    let name = column.map(|(name, _)| format!(",{name}")).unwrap_or_default();
    let mut file = format!("view,point,X,Y,u,v{name}\n");
    for view in 0..8 {
        let turn = f64::from(view);
        let pose = Pose {
            rotation: rotation::from_xyz_rad(0.5 * libm::sin(turn), 0.5 * libm::cos(turn), 0.3 * turn),
            translation: Vec3::new(
                35.0 * libm::cos(2.4 * turn) - 40.0,
                30.0 * libm::sin(2.4 * turn) - 30.0,
                60.0,
            ),
        };
        for i in 0..63_usize {
            let point = Vec2::new(10.0 * (i % 9) as f64, 10.0 * (i / 9) as f64);
            let pixel = camera.pixel(&pose.apply(&Vec3::new(point.x, point.y, 0.0))).unwrap();
            if !((0.0..639.0).contains(&pixel.x) && (0.0..479.0).contains(&pixel.y)) {
                continue;
            }
            let [du, dv] = [stream.normal(), stream.normal()].map(|n| 0.1 * n);
            let more = column.map(|(_, of)| format!(",{}", of(i))).unwrap_or_default();
            writeln!(file, "{view},{i},{},{},{},{}{more}", point.x, point.y, pixel.x + du, pixel.y + dv)
                .unwrap();
        }
    }
    (camera, file)
}

/// Four views of the example board through a lens with k1 and k2.
fn corners_through(k1: f64, k2: f64, noise_px: f64) -> String {
    let camera = Truth::example_camera().with_distortion(BrownConrady::radial(k1, k2));
    let mut stream = Stream::open(StreamKey { seed: 3, scenario: "alike", trial: 0, purpose: "noise" });
    let mut file = String::from("view,point,X,Y,u,v\n");
    for (view, pose) in Truth::example_poses().iter().enumerate() {
        for (i, point) in Truth::example_board().points().iter().enumerate() {
            let pixel = camera.project(&pose.apply(&Vec3::new(point.x, point.y, 0.0))).unwrap();
            let [du, dv] = [stream.normal(), stream.normal()].map(|n| noise_px * n);
            writeln!(file, "{view},{i},{},{},{},{}", point.x, point.y, pixel.x + du, pixel.y + dv).unwrap();
        }
    }
    file
}

#[test]
fn lenses_that_the_criterion_does_not_tell_from_the_chosen_one_are_named() {
    let folder = folder("alike");
    let arguments =
        ["calibrate", "corners.csv", "--image-size", "640x480", "--model", "auto", "--out", "result"];
    let (mut named, mut behind) = (0, 0);
    // A division has one coefficient only, which is an advantage until noise no longer hides that it is
    // wrong: on the way it is as good as the right lens.
    for (k1, k2) in [(-0.3, 0.1), (-0.1, 0.0)] {
        for noise_px in [0.4, 0.2, 0.1, 0.05, 0.025, 0.0125] {
            fs::write(folder.join("corners.csv"), corners_through(k1, k2, noise_px)).unwrap();
            let told = text(&run(&folder, &arguments).stdout);
            let file = fs::read_to_string(folder.join("result/result.json")).unwrap();
            let said: Value = serde_json::from_str(&file).unwrap();
            let models = said["models"].as_array().unwrap();
            let bic = |model: &Value| model["bic"].as_f64().unwrap();
            let near: Vec<&Value> =
                models[1..].iter().filter(|m| (bic(m) - bic(&models[0])).abs() < 2.0).collect();
            let alike: Vec<&Value> =
                near.iter().copied().filter(|model| model["is_behind"] == false).collect();
            let verdict = told.lines().find(|line| line.starts_with("chosen: ")).unwrap();
            let sentence = verdict.split_once("a difference of BIC below 2 is no evidence: ");
            let names: Vec<&str> = sentence.map_or_else(Vec::new, |(_, names)| names.split(" or ").collect());
            assert_eq!(names.len(), alike.len(), "{verdict}");
            let agree = |(name, model): (&&str, &&Value)| name.starts_with(model["model"].as_str().unwrap());
            assert!(names.iter().zip(&alike).all(agree), "{verdict}");
            // The table says why another one is not named.
            let is_behind = models.iter().any(|model| model["is_behind"] == true);
            assert_eq!(told.contains("behind: a coefficient"), is_behind, "{told}");
            let is_unpredicted = models.iter().any(|model| model["hold_out_px"].is_null());
            assert_eq!(told.contains("none: without a part"), is_unpredicted, "{told}");
            (named, behind) = (named + names.len(), behind + near.len() - alike.len());
        }
    }
    assert!(named > 0 && behind > 0, "{named} {behind}");
}

#[test]
fn that_views_left_out_cannot_be_predicted_is_told() {
    let folder = folder("unpredicted");
    // Of two views none can be left out.
    let all = corners_through(-0.3, 0.1, 0.05);
    let two: Vec<&str> = all.lines().take_while(|line| !line.starts_with("2,")).collect();
    fs::write(folder.join("corners.csv"), two.join("\n")).unwrap();
    let arguments = ["calibrate", "corners.csv", "--image-size", "640x480", "--model", "auto"];
    let told = text(&run(&folder, &arguments).stdout);
    assert!(told.contains("none: without a part of the views the lens is not determined"), "{told}");
    let verdict = told.lines().find(|line| line.starts_with("chosen: ")).unwrap();
    assert!(verdict.contains("predicts views that were left out is not known"), "{verdict}");
}

#[test]
fn a_fisheye_is_calibrated_told_as_one_and_undone() {
    let folder = folder("fisheye");
    let (truth, corners) = fisheye_corners(None);
    fs::write(folder.join("corners.csv"), corners).unwrap();
    let fixed = ["calibrate", "corners.csv", "--image-size", "640x480", "--format", "json"];
    let with = |more: &[&str]| run(&folder, &[&fixed[..], more].concat());
    let fisheye = with(&["--model", "kannala-brandt", "--out", "result"]);
    assert_eq!(fisheye.status.code(), Some(0), "{}", text(&fisheye.stderr));
    let said: Value = serde_json::from_slice(&fisheye.stdout).unwrap();
    assert_eq!(said["camera"]["model"], "kannala-brandt");
    let sigma = said["sigma_px"].as_f64().unwrap();
    assert!((0.09..0.11).contains(&sigma), "{sigma}");
    let (camera, size) = read_lens_camera(&folder.join("result/result.json")).unwrap();
    assert_eq!(size, Some((640, 480)));
    for (parameter, value) in camera.values() {
        let Some(sd) = said["standard_deviations"][parameter.name()].as_f64() else { continue };
        let z = (value - truth.value(parameter).unwrap()) / sd;
        assert!(z.abs() < 4.0, "{parameter}: {z} standard deviations");
    }
    // The plain lens is told not to fit, and what would.
    let plain = with(&[]);
    let warnings = text(&plain.stdout);
    assert!(
        warnings.contains("a kannala-brandt lens (--model kannala-brandt) lowers the RMSE"),
        "{warnings}"
    );
    let chosen: Value = serde_json::from_slice(&with(&["--model", "auto"]).stdout).unwrap();
    assert_eq!(chosen["camera"]["model"], chosen["models"][0]["model"]);
    assert_eq!(chosen["camera"]["model"], "kannala-brandt");
    assert_eq!(chosen["models"].as_array().unwrap().len(), 8);
    // A line of the world is straight after the correction.
    let photo = Raster::from_fn(640, 480, |x, y| {
        let seen = truth.ray(&Vec2::new(x as f64, y as f64)).unwrap();
        // The plane X = 0.4 Z is an edge between dark and bright.
        if seen.x > 0.4 * seen.z { 200u8 } else { 40 }
    });
    calibench::io::write_png(&folder.join("photo.png"), &photo).unwrap();
    let undone = run(&folder, &["undistort", "--camera", "result/result.json", "--out", "out", "photo.png"]);
    assert_eq!(undone.status.code(), Some(0), "{}", text(&undone.stderr));
    let corrected = calibench::io::read_image(&folder.join("out/photo.png")).unwrap().to_u8();
    let edge = camera.fx * 0.4 + camera.cx;
    for row in [120, 180, 240, 300, 360] {
        let first = (0..640).find(|&x| corrected.get(x, row) > 120).unwrap() as f64;
        assert!((first - edge).abs() < 1.5, "row {row}: {first} against {edge}");
    }
    for (projection, said) in [("equidistant", "kannala-brandt"), ("equirectangular", "equirectangular")] {
        let arguments = [
            "undistort",
            "--camera",
            "result/result.json",
            "--out",
            projection,
            "--projection",
            projection,
            "photo.png",
        ];
        assert_eq!(run(&folder, &arguments).status.code(), Some(0));
        let camera = fs::read_to_string(folder.join(projection).join("camera-640x480.json")).unwrap();
        assert!(camera.contains(said), "{camera}");
    }
}

#[test]
fn marks_have_weights_or_standard_deviations() {
    let folder = folder("weights");
    let weighted = |name: &str, of: &dyn Fn(usize) -> f64| fisheye_corners(Some((name, of))).1;
    fs::write(folder.join("weight.csv"), weighted("weight", &|i| if i % 2 == 0 { 0.5 } else { 2.0 }))
        .unwrap();
    fs::write(folder.join("sigma.csv"), weighted("sigma_px", &|i| if i % 2 == 0 { 2.0 } else { 0.5 }))
        .unwrap();
    fs::write(folder.join("none.csv"), weighted("weight", &|_| 0.0)).unwrap();
    let camera = |file: &str| -> Value {
        let output = run(&folder, &["calibrate", file, "--model", "kannala-brandt", "--format", "json"]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        serde_json::from_slice::<Value>(&output.stdout).unwrap()["camera"].clone()
    };
    assert_eq!(camera("weight.csv"), camera("sigma.csv"));
    let refused = run(&folder, &["calibrate", "none.csv"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("point 0 has weight 0"), "{}", text(&refused.stderr));
}

#[test]
fn what_a_model_does_not_have_is_refused_by_name() {
    let folder = folder("lens-refused");
    fs::write(folder.join("c.csv"), fisheye_corners(None).1).unwrap();
    let refusals = [
        (&["--model", "division", "--free", "fx,k2"][..], "the division model has no k2"),
        (&["--model", "fisheye"], "unknown lens model `fisheye`"),
        (&["--model", "auto", "--fix", "k1=0"], "--model auto chooses what is estimated of a lens"),
        (&["--board-shape", "bow:0"], "expected bow:SD or bent:SD"),
    ];
    for (more, wanted) in refusals {
        let output = run(&folder, &[&["calibrate", "c.csv"], more].concat());
        assert_eq!(output.status.code(), Some(2), "{more:?}");
        assert!(text(&output.stderr).contains(wanted), "{more:?}: {}", text(&output.stderr));
    }
    // What every model has.
    let intervals = &["calibrate", "c.csv", "--model", "kannala-brandt", "--intervals", "profile"];
    let output = run(&folder, intervals);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("by the standard deviation from"), "{}", text(&output.stdout));
    // Another command that knows the plain lens only says so.
    let done = run(&folder, &["calibrate", "c.csv", "--model", "kannala-brandt", "--out", "r"]);
    assert_eq!(done.status.code(), Some(0));
    let measured = run(&folder, &["measure", "r/result.json", "--view", "0", "--pixels", "200,200,300,250"]);
    assert_eq!(measured.status.code(), Some(2));
    assert!(text(&measured.stderr).contains("kannala-brandt"), "{}", text(&measured.stderr));
    // One that knows every lens goes on.
    let converted = run(&folder, &["convert", "r/result.json", "camera.yaml", "--to", "opencv-yaml"]);
    assert_eq!(converted.status.code(), Some(0), "{}", text(&converted.stderr));
}

#[test]
fn a_wrong_model_of_few_marks_is_told_by_one_that_fits() {
    let folder = folder("lens-few-marks");
    let (_, whole) = fisheye_corners(None);
    // Every fifth mark: 12 or 13 a view.
    let few = |line: &&str| {
        line.split(',')
            .nth(1)
            .is_none_or(|point| point == "point" || point.parse::<usize>().unwrap() % 5 == 0)
    };
    let text_of_few: Vec<&str> = whole.lines().filter(few).collect();
    fs::write(folder.join("few.csv"), text_of_few.join("\n") + "\n").unwrap();
    let told = |model: &str| -> Vec<String> {
        let done = run(&folder, &["calibrate", "few.csv", "--model", model, "--format", "json"]);
        let result: Value = serde_json::from_str(&text(&done.stdout)).expect("JSON");
        let all =
            result["warnings"].as_array().expect("a list").iter().map(|w| w.as_str().unwrap().to_string());
        all.filter(|warning| warning.contains("explains the marks better")).collect()
    };
    let division = told("division");
    // Both models of a fisheye explain so few marks.
    let is_fisheye = |said: &String| {
        ["a kannala-brandt lens", "a double-sphere lens"].iter().any(|name| said.starts_with(name))
    };
    assert!(division.len() == 1 && is_fisheye(&division[0]), "{division:?}");
    assert_eq!(told("kannala-brandt"), Vec::<String>::new());
}
