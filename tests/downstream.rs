//! Do `register`, `measure` and `hand-eye` say what they find, and are their stated uncertainties those of
//! repeated calibrations?

use crate::program::{calibench as run, folder, text};
use calibench::board::View;
use calibench::calibrate::{Calibration, Settings, calibrate};
use calibench::downstream::{
    Conditions, Length, PlaneView, Repeatability, SetUp, Stations, hand_eye, length_in_view, length_on_map,
};
use calibench::geometry::{Pose, Vec2, rotation};
use calibench::planar::{PlaneModel, calibrate_plane};
use calibench::synth::scene::looking_at_centre;
use calibench::synth::{Scene, Stream, StreamKey, Truth};
use nalgebra::{DMatrix, DVector};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// What a verb that must succeed prints as JSON.
fn said(folder: &Path, arguments: &[&str]) -> Value {
    let output = run(folder, &[arguments, &["--format", "json"]].concat());
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", text(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("standard output is JSON")
}

/// Standard error of a verb that must end with 2.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", text(&output.stdout));
    text(&output.stderr)
}

#[test]
fn a_found_part_is_registered_by_the_names_of_its_marks() {
    let folder = folder("register");
    fs::write(folder.join("taught.csv"), "point,X,Y\na,0,0\nb,100,0\nc,100,60\nd,0,60\nspare,5,5\n")
        .expect("written");
    // Turned by a quarter and shifted by (10, 20), in another order.
    let found = "point,X,Y,sd\nc,-50,120,0.02\na,10,20,0.02\nd,-50,20,0.02\nb,10,120,0.02\n";
    fs::write(folder.join("found.csv"), found).expect("written");
    let json = said(
        &folder,
        &["register", "taught.csv", "found.csv", "--at", "50,30", "--at", "-1000,30", "--out", "out"],
    );
    assert!((json["angle_rad"].as_f64().expect("a number") - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
    let position = |i: usize, what: &str, k: usize| json["positions"][i][what][k].as_f64().expect("a number");
    assert!((position(1, "found", 0) + 20.0).abs() < 1e-9 && (position(1, "found", 1) - 70.0).abs() < 1e-9);
    // In the middle of four marks a standard deviation is halved; 1050 mm away the angle's is added, 0.02 mm
    // over the root of the sum of squared distances, 4 (50^2 + 30^2), and moves y, which was x.
    assert!((position(1, "standard_deviations", 0) - 0.01).abs() < 1e-12);
    let far = (0.01 * 0.01 + 21.0 * 21.0 / 13600.0_f64).sqrt();
    assert!((position(2, "standard_deviations", 0) - far).abs() < 1e-9);
    assert_eq!(json["left_out"][0], "spare of taught.csv");
    let written = fs::read_to_string(folder.join("out/registration.json")).expect("written");
    assert_eq!(serde_json::from_str::<Value>(&written).expect("JSON"), json);
    let shown = text(&run(&folder, &["register", "taught.csv", "found.csv"]).stdout);
    assert!(shown.starts_with("4 marks, rigid map\nangle 90.000000 +- 0.0098 degrees"), "{shown}");
}

#[test]
fn a_part_that_cannot_be_registered_is_refused_with_its_reason() {
    let folder = folder("register-refused");
    fs::write(folder.join("a.csv"), "point,X,Y\na,0,0\nb,100,0\nc,100,60\n").expect("written");
    fs::write(folder.join("mirrored.csv"), "point,X,Y\na,0,0\nb,-100,0\nc,-100,60\n").expect("written");
    fs::write(folder.join("other.csv"), "point,X,Y\na,0,0\ne,1,1\n").expect("written");
    fs::write(folder.join("line.csv"), "point,X,Y\na,0,0\nb,1,1\nc,2,2\n").expect("written");
    assert!(refused(&folder, &["register", "a.csv", "mirrored.csv"]).contains("mirror image"));
    let few = refused(&folder, &["register", "a.csv", "other.csv"]);
    assert!(few.contains("at least 2 marks, got 1") && few.contains("e of other.csv"), "{few}");
    assert!(refused(&folder, &["register", "line.csv", "a.csv", "--model", "affine"]).contains("collinear"));
    assert!(refused(&folder, &["register", "a.csv", "a.csv", "--loss", "huber:-1"]).contains("huber:D"));
}

/// Five views of the example's board by its camera: four as they are, and one tilted and off the middle.
fn station() -> Scene {
    let mut truth = Truth::example();
    let mut fifth = looking_at_centre([18.0, 24.0, 30.0], 150.0);
    fifth.translation.x += 12.0;
    truth.cam_from_target.push(fifth);
    Scene::new(truth).expect("the board is seen whole")
}

const NOISE_PX: f64 = 0.1;
/// The points of the board between which is measured, and the view: the tilted one.
const ENDS: [usize; 2] = [10, 51];
const VIEW: usize = 4;

fn noisy(pixel: &Vec2, stream: &mut Stream) -> Vec2 {
    pixel + NOISE_PX * Vec2::new(stream.normal(), stream.normal())
}

/// A calibration with noise of its own, and the pixels of both ends with noise of theirs.
fn drawn(scene: &Scene, trial: u64) -> (Calibration, [Vec2; 2]) {
    let mut stream = Stream::open(StreamKey { seed: 11, scenario: "measure", trial, purpose: "noise" });
    let views = scene.observe(NOISE_PX, &mut stream);
    let settings = Settings::standard().with_image_size(Truth::EXAMPLE_IMAGE);
    let calibration = calibrate(&views, &settings).expect("five tilted views make a camera");
    (calibration, ENDS.map(|i| noisy(&scene.pixels()[VIEW][i], &mut stream)))
}

/// The length with what the calibration knows of its own noise.
fn length(calibration: &Calibration, pixels: &[Vec2; 2]) -> Length {
    let (camera, poses) = (&calibration.camera, &calibration.cam_from_target);
    let plane = PlaneView::of_view(camera, poses, &calibration.covariance, VIEW).expect("the view is there");
    let conditions = Conditions {
        noise_freedom: Some(calibration.degrees_of_freedom),
        mark_is_noise: true,
        ..Conditions::marks(calibration.sigma_px)
    };
    length_in_view(&plane, pixels, &conditions).expect("both ends are on the board")
}

#[test]
fn lengths_of_repeated_calibrations_spread_as_each_of_them_states() {
    const DRAWS: u64 = 600;
    let scene = station();
    let truth = (scene.truth.points[ENDS[1]] - scene.truth.points[ENDS[0]]).norm();
    let lengths: Vec<Length> = (0..DRAWS)
        .map(|trial| {
            let (calibration, pixels) = drawn(&scene, trial);
            length(&calibration, &pixels)
        })
        .collect();
    let mean = |of: &dyn Fn(&Length) -> f64| lengths.iter().map(of).sum::<f64>() / DRAWS as f64;
    let squared = mean(&|l| {
        let z = (l.value - truth) / l.standard_uncertainty();
        z * z
    });
    let bias = mean(&|l| (l.value - truth) / l.standard_uncertainty());
    let covered = lengths
        .iter()
        .filter(|l| (l.value - truth).abs() <= l.coverage_factor(0.95) * l.standard_uncertainty());
    // Fisher's distribution of 1 and some 600 degrees of freedom: mean 1.003, variance 2.02; each limit is
    // left by one draw in ten thousand.
    assert!((squared - 1.0).abs() < 3.9 * (2.02 / DRAWS as f64).sqrt(), "mean square {squared}");
    assert!(bias.abs() < 3.9 / (DRAWS as f64).sqrt(), "mean {bias}");
    let covered = covered.count();
    assert!((548..=590).contains(&covered), "{covered} of {DRAWS} intervals of 95 %");
    // Camera and pose make up for each other, or the calibration would cost more than the marks.
    let without_correlation = mean(&|l| {
        l.budget.iter().filter(|c| c.variance > 0.0).map(|c| c.variance).sum::<f64>().sqrt()
            / l.standard_uncertainty()
    });
    assert!(without_correlation > 2.0, "{without_correlation}");
}

#[test]
fn the_law_of_propagation_agrees_with_the_propagation_of_distributions() {
    // JCGM 101:2008, section 8: the interval of 95 % by both, to half of the first digit of u.
    const DRAWS: usize = 100_000;
    let (calibration, pixels) = drawn(&station(), 0);
    let linear = length(&calibration, &pixels);
    let covariance = &calibration.covariance;
    let n = covariance.free.len();
    let entry = |i: usize, j: usize| match (i < n, j < n) {
        (true, true) => covariance.intrinsics[(i, j)],
        (true, false) => covariance.cross[VIEW][(i, j - n)],
        (false, true) => covariance.cross[VIEW][(j, i - n)],
        (false, false) => covariance.poses[VIEW][(i - n, j - n)],
    };
    let joint = DMatrix::from_fn(n + 6, n + 6, entry);
    let root = joint.cholesky().expect("a covariance is positive definite").unpack();
    let mut stream =
        Stream::open(StreamKey { seed: 12, scenario: "measure", trial: 0, purpose: "propagation" });
    let mut lengths: Vec<f64> = (0..DRAWS)
        .map(|_| {
            let step = &root * DVector::from_fn(n + 6, |_, _| stream.normal());
            let camera = calibration.camera.stepped(covariance.free, &step.as_slice()[..n]);
            let of_pose = nalgebra::Vector6::from_row_slice(&step.as_slice()[n..]);
            let pose = calibration.cam_from_target[VIEW].perturbed(&of_pose);
            let plane = PlaneView::with_pose(&camera, &pose, covariance, [0.0; 6]);
            let sigma = calibration.sigma_px;
            let ends = pixels.map(|p| {
                let moved = p + sigma * Vec2::new(stream.normal(), stream.normal());
                plane.point(&moved).expect("the ends stay on the board")
            });
            (ends[1] - ends[0]).norm()
        })
        .collect();
    lengths.sort_by(f64::total_cmp);
    let at = |p: f64| lengths[(p * DRAWS as f64) as usize];
    let u = linear.standard_uncertainty();
    // u = c 10^l with one digit c: the tolerance is half of 10^l.
    let tolerance = 0.5 * libm::exp10(libm::floor(libm::log10(u)));
    let (low, high) = (at(0.025) - (linear.value - 1.96 * u), at(0.975) - (linear.value + 1.96 * u));
    assert!(low.abs() < tolerance && high.abs() < tolerance, "{low} and {high} against {tolerance}, u {u}");
    let mean = lengths.iter().sum::<f64>() / DRAWS as f64;
    let spread = (lengths.iter().map(|l| (l - mean) * (l - mean)).sum::<f64>() / DRAWS as f64).sqrt();
    // A standard deviation of that many draws is known to 1 / sqrt(2 DRAWS); 3.9 of these.
    assert!((spread / u - 1.0).abs() < 3.9 / (2.0 * DRAWS as f64).sqrt(), "{spread} against {u}");
}

#[test]
fn lengths_on_a_map_of_nine_dots_spread_as_is_stated() {
    const DRAWS: u64 = 3000;
    let world: Vec<Vec2> =
        (0..9).map(|i| Vec2::new(f64::from(i % 3) - 1.0, 1.0 - f64::from(i / 3))).collect();
    let exact: Vec<Vec2> =
        world.iter().map(|w| Vec2::new(714.7 + 236.2 * w.x, 566.0 - 236.2 * w.y)).collect();
    let ends = [Vec2::new(500.0, 400.0), Vec2::new(1100.0, 700.0)];
    let truth = 10.0 * (ends[1] - ends[0]).norm() / 236.2;
    let mut squared = 0.0;
    for trial in 0..DRAWS {
        let mut stream = Stream::open(StreamKey { seed: 13, scenario: "measure", trial, purpose: "dots" });
        let pixels: Vec<Vec2> = exact.iter().map(|p| noisy(p, &mut stream)).collect();
        let map = calibrate_plane(PlaneModel::Affine, &pixels, &world).expect("nine dots make a map");
        let sigma_px = map.spread.as_ref().expect("12 degrees of freedom").sigma / map.scale_x;
        let conditions =
            Conditions { noise_freedom: Some(12), mark_is_noise: true, ..Conditions::marks(sigma_px) };
        let length = length_on_map(&map, 10.0, &ends.map(|p| noisy(&p, &mut stream)), &conditions)
            .expect("on the map");
        let z = (length.value - truth) / length.standard_uncertainty();
        assert!((length.effective_freedom().expect("estimated") - 12.0).abs() < 1e-9);
        squared += z * z / DRAWS as f64;
    }
    // Fisher's distribution of 1 and 12 degrees of freedom: mean 1.2, variance 3.96.
    assert!((squared - 1.2).abs() < 3.9 * (3.96 / DRAWS as f64).sqrt(), "mean square {squared}");
}

/// The example's views with noise as a corner file.
fn write_corners(path: &Path, views: &[View]) {
    let mut text = "view,point,X,Y,u,v\n".to_string();
    for (view, seen) in views.iter().enumerate() {
        for (point, (at, pixel)) in seen.pairs().enumerate() {
            text += &format!("{view},{point},{},{},{},{}\n", at.x, at.y, pixel.x, pixel.y);
        }
    }
    fs::write(path, text).expect("written");
}

#[test]
fn measure_reads_what_calibrate_and_ninepoint_write() {
    let folder = folder("measure");
    let scene = station();
    let mut stream = Stream::open(StreamKey { seed: 11, scenario: "measure", trial: 0, purpose: "noise" });
    write_corners(&folder.join("corners.csv"), &scene.observe(NOISE_PX, &mut stream));
    said(&folder, &["calibrate", "corners.csv", "--image-size", "640x480", "--out", "camera"]);
    let (calibration, pixels) = drawn(&scene, 0);
    let [a, b] = pixels;
    let line = format!("{},{},{},{}", a.x, a.y, b.x, b.y);
    fs::write(folder.join("ends.csv"), format!("length,u1,v1,u2,v2\ndiagonal,{line}\n")).expect("written");
    let file = "camera/result.json";
    let json = said(&folder, &["measure", file, "--view", "4", "--pixels", &line, "--ends", "ends.csv"]);
    let expected = length(&calibration, &pixels);
    for (i, name) in ["1", "diagonal"].into_iter().enumerate() {
        let found = &json["lengths"][i];
        let number = |what: &str| found[what].as_f64().expect("a number");
        assert_eq!(found["length"], name);
        assert!((number("value") - expected.value).abs() < 1e-9);
        assert!((number("standard_uncertainty") / expected.standard_uncertainty() - 1.0).abs() < 1e-9);
        assert!((number("expanded_uncertainty") / number("standard_uncertainty") - 2.0).abs() < 1e-12);
    }
    let board =
        ["--scale-sd", "1e-3", "--flatness", "0.02", "--temperature-sd", "2", "--expansion", "11.5e-6"];
    let more = said(&folder, &[&["measure", file, "--view", "4", "--pixels", &line][..], &board].concat());
    let u = |json: &Value| json["lengths"][0]["standard_uncertainty"].as_f64().expect("a number");
    assert!(u(&more) > u(&json));
    let shown = text(&run(&folder, &["measure", file, "--view", "4", "--pixels", &line]).stdout);
    assert!(
        shown.starts_with("length 1: ") && shown.contains("k = 2") && shown.contains("camera and pose"),
        "{shown}"
    );
    for (arguments, why) in [
        (vec!["measure", file, "--view", "9", "--pixels", &line], "there are: 0, 1, 2, 3, 4"),
        (vec!["measure", file, "--pixels", &line], "which plane?"),
        (vec!["measure", file, "--view", "4"], "--pixels"),
        (vec!["measure", file, "--view", "4", "--pixels", "1,2,3"], "4 numbers"),
        (vec!["measure", file, "--view", "4", "--pixels", "1,2,9000,3"], "outside the image"),
        (vec!["measure", "ends.csv", "--pixels", &line], "ends.csv:1:"),
    ] {
        let said = refused(&folder, &arguments);
        assert!(said.contains(why), "{arguments:?}: {said}");
    }
    fs::write(
        folder.join("pairs.csv"),
        "point,px,py,X,Y\n0,0,0,0,0\n1,100,0,1,0\n2,0,100,0,1\n3,100,101,1,1\n",
    )
    .expect("written");
    said(&folder, &["calibrate", "pairs.csv", "--out", "plane"]);
    let on_map =
        said(&folder, &["measure", "plane/result.json", "--pixels", "10,10,60,10", "--spacing", "10"]);
    assert!((on_map["lengths"][0]["value"].as_f64().expect("a number") - 5.0).abs() < 0.05, "{on_map:#}");
    let refusal =
        refused(&folder, &["measure", "plane/result.json", "--view", "0", "--pixels", "10,10,60,10"]);
    assert!(refusal.contains("the map of one plane"), "{refusal}");
}

/// What the robot repeats in these tests: 0.05 mm and 0.02 degrees.
const ROBOT: Repeatability =
    Repeatability { position: 0.05, rotation_rad: 0.02 * std::f64::consts::PI / 180.0 };

/// The camera on its robot: gripper_from_cam and base_from_target.
fn mounted() -> (Pose, Pose) {
    let pose = |turn: [f64; 3], shift: [f64; 3]| Pose {
        rotation: rotation::exp(&turn.into()),
        translation: shift.into(),
    };
    (pose([0.1, -0.2, 1.5], [30.0, -55.0, 80.0]), pose([3.0, 0.2, 0.1], [520.0, -90.0, 15.0]))
}

/// Fourteen views of the example's board; the first four are turned about x only.
fn fourteen_views() -> Scene {
    let about_x = [-24.0, -12.0, 12.0, 24.0].map(|degrees| looking_at_centre([degrees, 0.0, 0.0], 130.0));
    let others = (0..10).map(f64::from).map(|i| {
        let degrees = [25.0 * libm::sin(i), 25.0 * libm::cos(1.3 * i), 40.0 * libm::sin(2.1 * i)];
        looking_at_centre(degrees, 125.0 + 3.0 * i)
    });
    let cam_from_target = about_x.into_iter().chain(others).collect();
    Scene::new(Truth { cam_from_target, ..Truth::example() }).expect("the board is seen whole")
}

/// Where the robot truly is in every view: `G = Y C^-1 X^-1`, base_from_gripper or its inverse.
fn robot(scene: &Scene, set_up: SetUp) -> Vec<Pose> {
    let (x, y) = mounted();
    let station = |cam_from_target: &Pose| {
        let g = y.compose(&cam_from_target.inverse()).compose(&x.inverse());
        if set_up == SetUp::EyeInHand { g } else { g.inverse() }
    };
    scene.truth.cam_from_target.iter().map(station).collect()
}

fn with_robot_noise(pose: &Pose, stream: &mut Stream) -> Pose {
    let deviation = |i: usize| if i < 3 { ROBOT.rotation_rad } else { ROBOT.position };
    pose.perturbed(&nalgebra::Vector6::from_fn(|i, _| deviation(i) * stream.normal()))
}

#[test]
fn hand_eye_errors_of_repeated_calibrations_are_as_large_as_each_states() {
    const DRAWS: u64 = 250;
    let scene = fourteen_views();
    let settings = Settings::standard().with_image_size(Truth::EXAMPLE_IMAGE);
    for set_up in [SetUp::EyeInHand, SetUp::EyeToHand] {
        let exact = robot(&scene, set_up);
        let (mut nees, mut squares, mut closed_form) = (0.0, 0.0, 0.0);
        for trial in 0..DRAWS {
            let key = StreamKey { seed: 21, scenario: "hand-eye", trial, purpose: "noise" };
            let mut stream = Stream::open(key);
            let calibration = calibrate(&scene.observe(NOISE_PX, &mut stream), &settings).expect("a camera");
            let said: Vec<Pose> = exact.iter().map(|pose| with_robot_noise(pose, &mut stream)).collect();
            let found = hand_eye(&Stations {
                set_up,
                base_from_gripper: &said,
                cam_from_target: &calibration.cam_from_target,
                covariance: &calibration.covariance,
                robot: ROBOT,
            })
            .expect("fourteen stations");
            let inverse = found.x_covariance().try_inverse().expect("positive definite");
            let square = |pose: &Pose| {
                let error = pose.step_to(&mounted().0);
                error.dot(&(inverse * error))
            };
            nees += square(&found.x) / DRAWS as f64;
            closed_form += square(&found.park_martin) / DRAWS as f64;
            squares += found.chi_squared / DRAWS as f64;
        }
        // Chi-squared of 6 and of 6 * 14 - 12 = 72; each limit is left by one draw in ten thousand.
        let near = |mean: f64, d: f64| (mean - d).abs() < 3.9 * (2.0 * d / DRAWS as f64).sqrt();
        assert!(near(nees, 6.0), "{set_up:?}: {nees} of 6");
        assert!(near(squares, 72.0), "{set_up:?}: {squares} of 72");
        // Weighing is worth something: the closed form errs more than the most likely pose, in squares by a
        // fifth when this was written.
        assert!(closed_form > nees, "{set_up:?}: {closed_form} against {nees}");
    }
}

#[test]
fn hand_eye_pairs_the_views_of_both_files_and_refuses_what_fixes_nothing() {
    let folder = folder("hand-eye");
    let scene = fourteen_views();
    let mut stream = Stream::open(StreamKey { seed: 22, scenario: "hand-eye", trial: 0, purpose: "noise" });
    write_corners(&folder.join("corners.csv"), &scene.observe(NOISE_PX, &mut stream));
    said(&folder, &["calibrate", "corners.csv", "--image-size", "640x480", "--out", "camera"]);
    let stations: Vec<Pose> =
        robot(&scene, SetUp::EyeInHand).iter().map(|pose| with_robot_noise(pose, &mut stream)).collect();
    let write = |name: &str, views: &[usize]| {
        let mut text = "view,x,y,z,rx,ry,rz\n".to_string();
        for &view in views {
            let (t, w) = (stations[view].translation, rotation::log(&stations[view].rotation));
            text += &format!("{view},{},{},{},{},{},{}\n", t.x, t.y, t.z, w.x, w.y, w.z);
        }
        fs::write(folder.join(name), text).expect("written");
    };
    // In another order, without the last view.
    write("robot.csv", &(0..13).rev().collect::<Vec<_>>());
    let robot = ["--robot-sd-mm", "0.05", "--robot-sd-deg", "0.02"];
    let verb = |file: &'static str| [&["hand-eye", file, "camera/result.json"][..], &robot].concat();
    let json = said(&folder, &[&verb("robot.csv")[..], &["--out", "out"]].concat());
    let numbers = |value: &Value| -> Vec<f64> {
        value.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
    };
    let found = &json["gripper_from_cam"];
    let x = Pose {
        rotation: rotation::exp(&nalgebra::Vector3::from_row_slice(&numbers(&found["rotation_vector_rad"]))),
        translation: nalgebra::Vector3::from_row_slice(&numbers(&found["translation"])),
    };
    let (error, deviations) = (x.step_to(&mounted().0), numbers(&json["standard_deviations"]));
    assert!((0..6).all(|i| error[i].abs() < 4.5 * deviations[i]), "{error} of {deviations:?}");
    assert!(deviations[3] > 0.01 && deviations[3] < 0.5, "{deviations:?}");
    assert_eq!(json["left_out"][0], "13 of camera/result.json");
    assert!(folder.join("out/hand-eye.json").is_file());
    let shown = text(&run(&folder, &verb("robot.csv")).stdout);
    assert!(
        shown.contains("13 stations, eye-in-hand") && shown.contains("Tsai & Lenz 1989 differs"),
        "{shown}"
    );
    write("about_x.csv", &[0, 1, 2, 3]);
    assert!(refused(&folder, &verb("about_x.csv")).contains("nearly one axis"));
    write("two.csv", &[0, 5]);
    assert!(refused(&folder, &verb("two.csv")).contains("at least 3 stations, got 2"));
    let wrong = refused(&folder, &[&verb("robot.csv")[..], &["--robot-sd-mm", "0"]].concat());
    assert!(wrong.contains("above 0") || wrong.contains("cannot be used multiple times"), "{wrong}");
}

#[test]
fn a_reference_is_watched_by_its_history_and_an_alarm_ends_with_one() {
    let folder = folder("check-reference");
    let station = ["--reference", "25", "--sd", "0.004"];
    let check =
        |more: &[&str]| run(&folder, &[&["check-reference", "history.csv"][..], &station, more].concat());
    assert_eq!(check(&[]).status.code(), Some(2), "there is no history yet");
    for value in ["25.003", "24.996", "25.001"] {
        let output = check(&["--add", value]);
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        assert!(text(&output.stdout).contains("in control"));
    }
    let written = fs::read_to_string(folder.join("history.csv")).expect("a history");
    assert_eq!(written, "when,value\n1,25.003\n2,24.996\n3,25.001\n");
    // Nine standard deviations off: beyond any limit.
    let alarm = check(&["--add", "25.036", "--when", "night shift", "--format", "json", "--out", "out"]);
    assert_eq!(alarm.status.code(), Some(1), "{}", text(&alarm.stderr));
    let json: Value = serde_json::from_slice(&alarm.stdout).expect("JSON");
    assert_eq!(
        (&json["first_alarm"]["when"], &json["first_alarm"]["rule"]),
        (&"night shift".into(), &"threshold".into())
    );
    assert!(folder.join("out/trend.svg").is_file() && folder.join("out/check.json").is_file());
    // It stays out of control until a new history begins.
    let after = check(&["--add", "25.000"]);
    assert_eq!(after.status.code(), Some(1));
    assert!(
        text(&after.stdout).contains("OUT OF CONTROL since check night shift"),
        "{}",
        text(&after.stdout)
    );
    fs::write(
        folder.join("drift.csv"),
        (0..90).fold("when,value\n".to_string(), |t, i| t + &format!("{i},{}\n", 25.0 + 1e-4 * f64::from(i))),
    )
    .expect("written");
    let drift = run(&folder, &[&["check-reference", "drift.csv"][..], &station].concat());
    assert!(text(&drift.stdout).contains("by the moving average"), "{}", text(&drift.stdout));
    assert_eq!(check(&["--add", "1", "--when", "a,b"]).status.code(), Some(2));
    assert_eq!(check(&["--weight", "0.01"]).status.code(), Some(2));
}
