//! Does every verb's help end with examples, and do they run? All of them, in the order of the help, in a
//! folder with what they read.

use crate::shell::verbs;
use calibench::calibrate::{Settings, calibrate};
use calibench::camera::Parameter;
use calibench::detect::circle_grid;
use calibench::geometry::{Pose, Vec3, rotation};
use calibench::io::{CalibrationFields, write_png};
use calibench::synth::render::{Imaging, SensorNoise, nine_dot_stand_in, photograph};
use calibench::synth::{Scene, Stream, StreamKey, Truth};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn calibench(folder: &Path, arguments: &[String]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.args(arguments).current_dir(folder).output().expect("the program starts")
}

fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(String::from).collect()
}

/// The words of a command line, quotation marks holding some together.
fn split(line: &str) -> Vec<String> {
    let pieces = line.split('"').enumerate();
    pieces.flat_map(|(i, piece)| if i % 2 == 1 { vec![piece.to_string()] } else { words(piece) }).collect()
}

fn help_of(verb: &str) -> String {
    let run = calibench(Path::new("."), &words(&format!("{verb} --help")));
    assert_eq!(run.status.code(), Some(0), "{verb}");
    String::from_utf8_lossy(&run.stdout).into_owned()
}

/// Verbs that do something: those without verbs of their own, such as `study run`, and `gate`, which may
/// stand alone.
fn leaves() -> Vec<String> {
    let below = |verb: String| -> Vec<String> {
        let help = help_of(&verb);
        let Some((_, listed)) = help.split_once("Commands:\n") else { return vec![verb] };
        let indented = |line: &&str| line.starts_with("  ") && !line.starts_with("   ");
        let names = listed.lines().take_while(|line| !line.is_empty()).filter(indented);
        let names = names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
        let alone = help.contains(&format!("\n       calibench {verb} <COMMAND>")).then(|| verb.clone());
        alone.into_iter().chain(names.map(|name| format!("{verb} {name}"))).collect()
    };
    verbs().into_iter().flat_map(below).collect()
}

/// The examples of a verb.
fn examples(verb: &str) -> Vec<String> {
    let help = help_of(verb);
    let (_, listed) = help.split_once("Examples:\n").unwrap_or_else(|| panic!("{verb} has no examples"));
    let lines: Vec<String> =
        listed.lines().map(|line| line.trim().to_string()).filter(|line| !line.is_empty()).collect();
    assert!(
        !lines.is_empty() && lines.iter().all(|line| line.starts_with(&format!("calibench {verb}"))),
        "{lines:?}"
    );
    lines
}

/// Photographs of a board that nobody touches, and their marks.
fn still_frames(folder: &Path) -> String {
    let pose = Truth::example_poses()[1];
    let imaging = Imaging { blur_px: 0.5, ..Imaging::default() };
    let board = Truth::example_board();
    let photo = photograph(&Truth::example_camera(), Truth::EXAMPLE_IMAGE, &board, &pose, &imaging);
    let photo = photo.expect("it is seen").image;
    let mut marks = "view,point,X,Y,u,v\n".to_string();
    for trial in 0..4 {
        let key = StreamKey { seed: 1, scenario: "examples", trial, purpose: "still" };
        let mut frame = photo.clone();
        SensorNoise::constant(0.01).add_to(&mut frame, &mut Stream::open(key));
        let frame = frame.to_u8();
        write_png(&folder.join(format!("still{trial}.png")), &frame).expect("written");
        let centres = circle_grid(&frame, 9, 7).expect("it is seen").centres_px();
        for (point, (at, pixel)) in board.points().iter().zip(centres).enumerate() {
            writeln!(marks, "{trial},{point},{},{},{},{}", at.x, at.y, pixel.x, pixel.y).expect("text grows");
        }
    }
    marks
}

/// What the examples read.
fn folder(name: &str) -> PathBuf {
    // Outside of the source tree: verbs that look for one find the one that the test makes, or none.
    let folder = std::env::temp_dir().join(format!("calibench-examples-{name}-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a folder is made");
    let scene = Scene::example();
    let mut corners = "view,point,X,Y,u,v\n".to_string();
    let mut solid = "view,point,X,Y,Z,u,v\n".to_string();
    let mut target = "point,X,Y,Z,sd\n".to_string();
    let mut robot = "view,x,y,z,rx,ry,rz\n".to_string();
    for (view, (seen, pose)) in scene.exact().iter().zip(&scene.truth.cam_from_target).enumerate() {
        for (point, (at, pixel)) in seen.pairs().enumerate() {
            writeln!(corners, "{view},{point},{},{},{},{}", at.x, at.y, pixel.x, pixel.y)
                .expect("text grows");
            // The target folded along a column, and taken further away.
            let place = Vec3::new(at.x.min(0.0), at.y, at.x.max(0.0));
            let pose = Pose { translation: 1.5 * pose.translation, ..*pose };
            let pixel = scene.truth.camera.project(&pose.apply(&place)).expect("it is before the camera");
            if view == 0 {
                writeln!(target, "{point},{},{},{},0.01", place.x, place.y, place.z).expect("text grows");
            }
            writeln!(solid, "{view},{point},{},{},{},{},{}", place.x, place.y, place.z, pixel.x, pixel.y)
                .expect("text grows");
        }
        let (t, w) = (pose.inverse().translation, -rotation::log(&pose.rotation));
        writeln!(robot, "{view},{},{},{},{},{},{}", t.x, t.y, t.z, w.x, w.y, w.z).expect("text grows");
        let imaging = Imaging { blur_px: 0.5, ..Imaging::default() };
        let photo =
            photograph(&scene.truth.camera, Truth::EXAMPLE_IMAGE, &Truth::example_board(), pose, &imaging);
        let photo = photo.expect("it is seen").image.to_u8();
        write_png(&folder.join(format!("photo{view}.png")), &photo).expect("written");
    }
    let still = still_frames(&folder);
    write_png(&folder.join("dots.png"), &nine_dot_stand_in().image.to_u8()).expect("written");
    // The same calibration, and other photographs from the same places, by other names.
    let settings = Settings::standard().hold(Parameter::K2, 0.0).with_image_size(Truth::EXAMPLE_IMAGE);
    let result = calibrate(&scene.exact(), &settings).expect("four views");
    let again = CalibrationFields::of(&result.into(), &[], Some(Truth::EXAMPLE_IMAGE)).to_json();
    let renamed = corners.replace("\n0,", "\nnew0,").replace("\n1,", "\nnew1,");
    let renamed = renamed.replace("\n2,", "\nnew2,").replace("\n3,", "\nnew3,");
    for (name, text) in [
        ("corners.csv", corners.as_str()),
        ("rings.csv", crate::examples::own_layout::corner_file().expect("they are seen").as_str()),
        ("new.csv", renamed.as_str()),
        ("solid.csv", solid.as_str()),
        ("target.csv", target.as_str()),
        ("again.json", again.as_str()),
        ("still.csv", still.as_str()),
        ("robot.csv", robot.as_str()),
        (
            "fisheye.json",
            r#"{"camera": {"model": "kannala-brandt", "fx": 310, "fy": 312, "cx": 322, "cy": 241, "k1": -0.03}, "image_size": [640, 480]}"#,
        ),
        (
            "pairs.csv",
            "point,px,py,X,Y\n0,0,0,0,0\n1,100,0,1,0\n2,0,100,0,1\n3,100,101,1,1\n4,50,51,0.5,0.5\n",
        ),
        ("taught.csv", "point,X,Y\na,0,0\nb,10,0\nc,0,10\n"),
        ("found.csv", "point,X,Y\na,1,0\nb,11,0\nc,1,10\n"),
        ("history.csv", "when,value\n1,25.01\n2,24.99\n"),
    ] {
        fs::write(folder.join(name), text).expect("written");
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    fs::create_dir_all(folder.join("gate-power")).expect("a folder is made");
    for table in ["faults.csv", "false-alarms.csv", "textbook.csv"] {
        let measured = Path::new("gate-power").join(table);
        fs::copy(root.join("golden").join(&measured), folder.join(measured)).expect("copied");
    }
    fs::copy(root.join("reference/digits.csv"), folder.join("digits.csv")).expect("copied");
    folder
}

/// A folder that is a source tree to the two verbs that write into one.
fn tree(folder: &Path) -> PathBuf {
    let tree = folder.join("tree");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for name in ["golden/published.toml", "golden/line-bending.snap", "experiments/lib.rs", "Cargo.toml"] {
        let path = tree.join(name);
        fs::create_dir_all(path.parent().expect("it lies in a folder")).expect("a folder is made");
        fs::copy(root.join(name), path).expect("copied");
    }
    tree
}

/// Runs the examples of every verb that are `wanted`, in their order.
fn run_examples(folder: &Path, wanted: impl Fn(&str) -> bool) {
    let tree = tree(folder);
    let leaves = leaves();
    assert!(leaves.len() > 25, "{leaves:?}");
    for verb in &leaves {
        let place = if ["bless", "new experiment"].contains(&verb.as_str()) { &tree } else { folder };
        for line in examples(verb).iter().filter(|line| wanted(line)) {
            let run = calibench(place, &split(line)[1..]);
            // A planted fault is found, which is what its example shows.
            let expected = if line.contains("--planted") { 1 } else { 0 };
            let said = String::from_utf8_lossy(&run.stderr);
            let found = String::from_utf8_lossy(&run.stdout);
            assert_eq!(run.status.code(), Some(expected), "{line}\n{found}{said}");
        }
    }
}

#[test]
fn every_verb_has_examples_and_they_run() {
    let folder = folder("all");
    // The book is built by a test of `tests/command.rs`: it takes the runs of all experiments. The gate's
    // power is a measurement of a quarter of an hour.
    let elsewhere = ["calibench book", "calibench gate power "];
    run_examples(&folder, |line| {
        !line.contains("python3") && !elsewhere.iter().any(|words| line.starts_with(words))
    });
    fs::remove_dir_all(folder).expect("removed");
}

#[test]
#[cfg_attr(not(calibench_numpy), ignore = "needs python3 with NumPy")]
fn examples_with_a_solver_in_python_run() {
    let folder = folder("python");
    let makes = ["calibench new adapter my-solver", "calibench new study my-study"];
    run_examples(&folder, |line| line.contains("python3") || makes.contains(&line));
    fs::remove_dir_all(folder).expect("removed");
}

#[test]
fn the_page_of_exit_codes_names_every_verb() {
    let run = calibench(Path::new("."), &words("exit-codes"));
    let page = String::from_utf8_lossy(&run.stdout).into_owned();
    for verb in verbs() {
        assert!(page.contains(&format!("`{verb}`")), "`{verb}` is not on the page of exit codes");
    }
}
