//! What of the source tree travels in the program? The chapter's values, and the code that committed
//! measurements depend on, so that it can tell whether they are stale. Neither where the crate is built
//! outside the source tree.

#[path = "fingerprint/code.rs"]
mod code;

use std::path::{Path, PathBuf};

/// What draws and photographs scenes.
const SCENES: &[&str] = &[
    "src/calibench/board",
    "src/calibench/camera",
    "src/calibench/geometry",
    "src/calibench/synth/scene.rs",
    "src/calibench/synth/stream.rs",
];
/// What a calibration of drawn points and its judgement stand on besides.
const SOLVER: &[&str] =
    &["src/calibench/calibrate", "src/calibench/distribution.rs", "src/calibench/evaluate"];
/// What draws the scenes of the experiment global-minimum, and searches from their truth.
const GLOBAL_MINIMUM: &[&str] = &[
    "experiments/global_minimum/families.rs",
    "experiments/global_minimum/oracle.rs",
    "experiments/global_minimum/scenes.rs",
];
/// What judges its solver and rounds the result.
const JUDGED: &[&str] = &["experiments/global_minimum/committed.rs", "experiments/global_minimum/judged.rs"];

/// What draws the trials of the experiment other-solvers: grids, poses, and the streams of their noise.
const OTHER_SOLVERS: &[&str] = &[
    "experiments/other_solvers/grid.rs",
    "src/study/cells.rs",
    "src/study/poses.rs",
    "src/study/trial.rs",
    "studies/coverage-tilt.toml",
    "studies/few-flat-views.toml",
    "studies/pose-count.toml",
];

/// What draws the trials of the experiment model-choice, fits every candidate and rounds what is found.
const MODEL_CHOICE: &[&str] = &[
    "experiments/model_choice/layout.rs",
    "experiments/model_choice/row.rs",
    "experiments/model_choice/trial.rs",
    "experiments/model_choice/truths.rs",
    "src/calibench/validate/frame.rs",
    "src/calibench/validate/slopes.rs",
];

/// What draws the scenes of the experiment lens-minimum, searches from their truth, judges and rounds.
const LENS_MINIMUM: &[&str] = &[
    "experiments/lens_minimum/families.rs",
    "experiments/lens_minimum/judged.rs",
    "experiments/lens_minimum/reference.rs",
    "experiments/lens_minimum/scenes.rs",
];

/// What draws the photographs of the experiment detector-gate, judges what is found in them, and writes it
/// down.
const PHOTOGRAPHS: &[&str] = &[
    "src/calibench/board",
    "src/calibench/camera",
    "src/calibench/detect/bias.rs",
    "src/calibench/geometry",
    "src/calibench/raster",
    "src/calibench/synth/render",
    "src/calibench/synth/render.rs",
    "src/calibench/synth/stream.rs",
    "src/detector_gate/bound.rs",
    "src/detector_gate/cell.rs",
    "src/detector_gate/detectors.rs",
    "src/detector_gate/draw.rs",
    "src/detector_gate/look.rs",
    "src/detector_gate/observed.rs",
    "src/detector_gate/outcome.rs",
    "src/detector_gate/protocol.rs",
    "src/detector_gate/scene.rs",
    "experiments/detector_gate/row.rs",
];
/// Crates that pack those photographs as JPEG and read them again.
const CODEC_CRATES: &[&str] = &["image", "zune-core", "zune-jpeg"];
/// What draws the photographs in which wrong boards are looked for besides, and counts them.
const WRONG_BOARDS: &[&str] = &["src/detector_gate/sight.rs", "src/detector_gate/tally.rs"];
/// This library's detectors, as they are asked there.
const DETECTORS: &[&str] =
    &["src/calibench/detect", "src/calibench/photos/board.rs", "src/calibench/photos/discs.rs"];

/// What neither a photograph through Brown-Conrady's lens nor its calibration from marks of one weight on a
/// flat board comes to: the other lenses, the list of all, and their solver.
const OTHER_LENSES: &[&str] = &[
    "src/calibench/calibrate/any_lens",
    "src/calibench/camera/lens/division.rs",
    "src/calibench/camera/lens/double_sphere.rs",
    "src/calibench/camera/lens/halcon_polynomial.rs",
    "src/calibench/camera/lens/kannala_brandt.rs",
    "src/calibench/camera/lens/mod.rs",
    "src/calibench/camera/lens/models.rs",
    "src/calibench/camera/lens/rational.rs",
    "src/calibench/camera/lens/thin_prism.rs",
    "src/calibench/camera/lens/tilted.rs",
];

/// The gate, and what it plants and bounds with.
const GATE: &[&str] =
    &["src/calibench/planning/information.rs", "src/calibench/synth/departure.rs", "src/gate"];

/// A measurement, and the folders and files whose lines change it.
struct Measurement {
    name: &'static str,
    of: &'static [&'static [&'static str]],
    /// Folders and files below these whose lines do not.
    without: &'static [&'static str],
    /// Crates whose versions change it, beside the numeric ones.
    crates: &'static [&'static str],
}

const fn measurement(name: &'static str, of: &'static [&'static [&'static str]]) -> Measurement {
    Measurement { name, of, without: &[], crates: &[] }
}

/// One that knows Brown-Conrady's lens alone.
const fn of_one_lens(name: &'static str, of: &'static [&'static [&'static str]]) -> Measurement {
    Measurement { without: OTHER_LENSES, ..measurement(name, of) }
}

/// One that photographs are drawn for, through Brown-Conrady's lens.
const fn of_photographs(name: &'static str, of: &'static [&'static [&'static str]]) -> Measurement {
    Measurement { crates: CODEC_CRATES, ..of_one_lens(name, of) }
}

const MEASUREMENTS: &[Measurement] = &[
    of_photographs("detector-gate", &[PHOTOGRAPHS, DETECTORS]),
    of_photographs("detector-gate-scenes", &[PHOTOGRAPHS]),
    of_photographs("wrong-boards", &[PHOTOGRAPHS, WRONG_BOARDS, DETECTORS]),
    of_one_lens("global-minimum", &[SCENES, SOLVER, GLOBAL_MINIMUM, JUDGED]),
    of_one_lens("global-minimum-scenes", &[SCENES, GLOBAL_MINIMUM]),
    measurement("gate-power", &[SCENES, SOLVER, GATE]),
    measurement("lens-minimum", &[SCENES, SOLVER, LENS_MINIMUM]),
    measurement("model-choice", &[SCENES, SOLVER, MODEL_CHOICE]),
    of_one_lens("other-solvers", &[SCENES, SOLVER, OTHER_SOLVERS]),
    of_one_lens("other-solvers-scenes", &[SCENES, OTHER_SOLVERS]),
];

fn main() {
    let variable = |name| PathBuf::from(std::env::var_os(name).expect("cargo sets it"));
    let root = variable("CARGO_MANIFEST_DIR").join("../..");
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=fingerprint/code.rs");
    let write = |name: &str, text: &str| {
        let file = variable("OUT_DIR").join(name);
        std::fs::write(&file, text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    };
    write("published.toml", &published(&root));
    for measurement in MEASUREMENTS {
        write(&format!("{}.code", measurement.name), &lines_of(&root, measurement));
    }
}

/// The values that the chapter prints.
fn published(root: &Path) -> String {
    let file = root.join("golden/published.toml");
    println!("cargo:rerun-if-changed={}", file.display());
    std::fs::read_to_string(file).unwrap_or_else(|_| "value = []".to_string())
}

/// The code lines that a measurement depends on, and the versions of the crates.
fn lines_of(root: &Path, measurement: &Measurement) -> String {
    if !root.join("golden/published.toml").is_file() {
        return String::new();
    }
    let paths = measurement.of.concat();
    for path in &paths {
        println!("cargo:rerun-if-changed={}", root.join(path).display());
    }
    let lines = code::of_paths(root, &paths, measurement.without)
        .unwrap_or_else(|error| panic!("a path of src/harness/build.rs: {error}"));
    println!("cargo:rerun-if-changed={}", root.join("Cargo.lock").display());
    let lock = std::fs::read_to_string(root.join("Cargo.lock")).unwrap_or_default();
    lines + &code::versions_of(&lock, &[code::NUMERIC_CRATES, measurement.crates].concat())
}
