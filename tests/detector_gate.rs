//! Are the committed photographs of the experiment detector-gate those that a program is shown when it is
//! asked again?

use crate::program::{folder, text};
use calibench_detector_gate::{Builtin, Program, Scene, scenes};
use calibench_experiments::detector_gate::{PHOTOS, campaign::rows_of};
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// The committed lines of a program.
fn committed(name: &str) -> BTreeSet<String> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/detector-gate").join(format!("{name}.csv"));
    let all = std::fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    all.lines().skip(2).map(str::to_string).collect()
}

fn named(name: &str) -> Scene {
    scenes().into_iter().find(|scene| scene.name() == name).expect("it is a scene")
}

#[test]
fn a_photograph_does_not_depend_on_the_others() {
    let committed = committed("calibench");
    assert_eq!(committed.len() as u64, 114 * PHOTOS);
    // Not the first, which the experiment repeats: the last two, with none before them.
    for scene in ["chessboard tilted", "circles blurred", "circles another-size"] {
        let rows = rows_of(&named(scene), &mut Builtin, PHOTOS - 2..PHOTOS).expect("it is answered");
        assert_eq!(rows.len(), 2);
        for row in rows {
            assert!(committed.contains(&row.text()), "{}", row.text());
        }
    }
}

#[test]
#[ignore = "needs a Python with OpenCV, named by CALIBENCH_PYTHON: .ci/gate runs it"]
fn opencv_gives_the_committed_photographs_again() {
    let python = std::env::var("CALIBENCH_PYTHON").unwrap_or_else(|_| "python3".to_string());
    let adapter = Path::new(env!("CARGO_MANIFEST_DIR")).join("adapters/detector_opencv.py");
    let command = format!("'{python}' '{}' classic", adapter.display());
    let mut program = Program::new(&command, Duration::from_secs(60)).expect("a folder for photographs");
    let committed = committed("opencv");
    // The bound and what was found; the last digits of the places are those of its version.
    let first = |line: &str| line.split(',').take(8).collect::<Vec<_>>().join(",");
    let known: BTreeSet<String> = committed.iter().map(|line| first(line)).collect();
    for row in rows_of(&named("chessboard clean"), &mut program, 1..3).expect("it is answered") {
        assert!(known.contains(&first(&row.text())), "{}", row.text());
    }
}

#[test]
fn a_program_that_finds_nothing_has_no_errors() {
    let blind = r#"sed -u 's/^{"id":"\([^"]*\)".*/{"id":"\1","status":"not-found"}/'"#;
    let mut program = Program::new(blind, Duration::from_secs(20)).expect("a folder for photographs");
    let rows = rows_of(&named("circles clean"), &mut program, 0..2).expect("it is answered");
    let lines: Vec<String> = rows.iter().map(|row| row.text()).collect();
    assert_eq!(lines, ["circles,clean,0,not-found,,,,,,,", "circles,clean,1,not-found,,,,,,,"]);
}

#[test]
fn what_a_python_lacks_is_named() {
    let out = folder("detector-gate-versions").join("x.csv");
    let done = Command::new(env!("CARGO_BIN_EXE_detector-gate-trials"))
        .args(["opencv", "--python", "false", "--photos", "1", "--out"])
        .arg(&out)
        .output()
        .expect("it runs");
    assert_eq!(done.status.code(), Some(1));
    assert!(text(&done.stderr).contains("false lacks cv2, numpy"), "{}", text(&done.stderr));
    assert!(!out.exists());
    let done =
        Command::new(env!("CARGO_BIN_EXE_detector-gate-trials")).arg("nobody").output().expect("it runs");
    assert_eq!(done.status.code(), Some(1));
    assert!(text(&done.stderr).contains("there are: calibench, opencv"), "{}", text(&done.stderr));
}
