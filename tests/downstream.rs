//! Do `register`, `measure` and `hand-eye` say what they find, and are their stated uncertainties those of
//! repeated calibrations?

use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn run(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.args(arguments).current_dir(folder).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// An empty folder of this test's own.
fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder is made");
    folder
}

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
