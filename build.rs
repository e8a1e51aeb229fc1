//! Which code do committed measurements depend on? Its lines are put into the program, so that it can tell whether they are stale.

#[path = "src/harness/fingerprint/code.rs"]
mod code;

use std::path::PathBuf;

/// What draws and photographs scenes.
const SCENES: &[&str] = &["src/camera", "src/geometry", "src/synth/scene.rs", "src/synth/stream.rs", "src/target"];
/// What a calibration of drawn points and its judgement stand on besides.
const SOLVER: &[&str] = &["src/calibrate", "src/evaluate"];

/// What draws the scenes of the experiment global-minimum, and searches from their truth.
const GLOBAL_MINIMUM: &[&str] = &[
    "experiments/global_minimum/families.rs",
    "experiments/global_minimum/oracle.rs",
    "experiments/global_minimum/scenes.rs",
];
/// What judges its solver and rounds the result.
const JUDGED: &[&str] = &["experiments/global_minimum/committed.rs", "experiments/global_minimum/judged.rs"];

/// Measurements by name: the folders and files whose lines change them.
const MEASUREMENTS: &[(&str, &[&[&str]])] = &[
    ("global-minimum", &[SCENES, SOLVER, GLOBAL_MINIMUM, JUDGED]),
    ("global-minimum-scenes", &[SCENES, GLOBAL_MINIMUM]),
    ("gate-power", &[SCENES, SOLVER, &["src/harness/gate"]]),
];

fn main() {
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it"));
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));
    println!("cargo:rerun-if-changed=build.rs");
    for (name, lists) in MEASUREMENTS {
        let paths = lists.concat();
        for path in &paths {
            println!("cargo:rerun-if-changed={path}");
        }
        let lines = code::of_paths(&root, &paths).unwrap_or_else(|error| panic!("{}: {error}", root.display()));
        std::fs::write(out.join(format!("{name}.code")), lines).unwrap_or_else(|error| panic!("{error}"));
    }
}
