//! Does what `calibench new` writes run as it is?

use crate::program::{calibench, folder};
use calibench_harness::Context;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The file of a new experiment, compiled as it is written.
#[path = "../src/command/new/experiment_template.rs"]
mod experiment_template;

fn succeeds(folder: &Path, arguments: &[&str]) -> Output {
    let run = calibench(folder, arguments);
    assert_eq!(run.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&run.stderr));
    run
}

#[test]
fn a_new_study_runs_and_its_report_is_written() {
    let folder = folder("new-study");
    succeeds(&folder, &["new", "study", "few-views"]);
    succeeds(&folder, &["study", "run", "few-views.toml", "--out", "few-views"]);
    assert!(folder.join("few-views/report.html").is_file());
    let again = calibench(&folder, &["new", "study", "few-views"]);
    assert_eq!(again.status.code(), Some(2), "what is there is not written over");
}

#[test]
fn a_new_experiment_holds_and_is_registered_everywhere() {
    let experiment = experiment_template::EXPERIMENT;
    let record = experiment.execute(&Context::of(&experiment)).expect("the template runs");
    assert!(record.claims().iter().all(|claim| claim.held), "{:?}", record.claims());
    assert_eq!((record.numbers().len(), record.figures().len(), record.tables().len()), (4, 1, 1));
    let tree = folder("new-experiment");
    for name in ["golden/published.toml", "experiments/lib.rs", "Cargo.toml"] {
        fs::create_dir_all(tree.join(name).parent().expect("a folder")).expect("a folder is made");
        fs::copy(Path::new(env!("CARGO_MANIFEST_DIR")).join(name), tree.join(name)).expect("copied");
    }
    succeeds(&tree, &["new", "experiment", "mean-of-noise"]);
    let read = |name: &str| fs::read_to_string(tree.join(name)).expect("a file");
    assert!(read("experiments/mean_of_noise.rs").contains("id: \"mean-of-noise\""));
    assert!(
        read("experiments/bin/mean_of_noise.rs").contains("calibench_experiments::mean_of_noise::EXPERIMENT")
    );
    let list = read("experiments/lib.rs");
    assert!(
        list.contains("\npub mod mean_of_noise;\n")
            && list.contains("\n    mean_of_noise::EXPERIMENT,\n];\n")
    );
    let manifest: toml::Table = read("Cargo.toml").parse().expect("TOML");
    let binaries = manifest["bin"].as_array().expect("a list");
    assert!(binaries.iter().any(|binary| binary["name"].as_str() == Some("mean-of-noise")));
    // Names that others have are taken.
    assert_eq!(calibench(&tree, &["new", "experiment", "mean-of-noise"]).status.code(), Some(2));
    // The folders of tests lie inside of the source tree.
    let elsewhere = calibench(&std::env::temp_dir(), &["new", "experiment", "mean-of-noise"]);
    assert_eq!(elsewhere.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&elsewhere.stderr).contains("source tree"));
}

/// Starts an adapter in a language and makes it ready with a command.
fn adapter_made_ready(language: &str, command: &[&str]) -> PathBuf {
    let folder = folder(&format!("new-adapter-{language}"));
    succeeds(&folder, &["new", "adapter", "my-solver", "--language", language]);
    let run =
        Command::new(command[0]).args(&command[1..]).current_dir(&folder).output().expect("it is there");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    folder
}

fn is_trusted(folder: &Path, solver: &str) {
    let gate = succeeds(folder, &["gate", "--solver", solver, "--samples", "1", "--timeout", "120"]);
    assert!(String::from_utf8_lossy(&gate.stdout).contains("\nTRUSTED"), "{gate:?}");
}

#[test]
#[cfg_attr(not(calibench_cxx), ignore = "needs a C++ compiler, c++")]
fn a_new_adapter_in_cpp_is_compiled_and_trusted_by_the_gate() {
    let compiler =
        ["c++", "-std=c++17", "-O2", "-Wall", "-Wextra", "-Werror", "-o", "my-solver", "my-solver.cpp"];
    let folder = adapter_made_ready("cpp", &compiler);
    is_trusted(&folder, "./my-solver");
}

#[test]
fn a_new_adapter_in_rust_is_compiled_and_trusted_by_the_gate() {
    let compiler = ["rustc", "--edition", "2021", "-O", "-D", "warnings", "-o", "my-solver", "my-solver.rs"];
    let folder = adapter_made_ready("rust", &compiler);
    is_trusted(&folder, "./my-solver");
}

#[test]
#[cfg_attr(not(calibench_octave), ignore = "needs GNU Octave")]
fn a_new_adapter_in_octave_is_trusted_by_the_gate() {
    let folder = adapter_made_ready("octave", &["octave-cli", "--version"]);
    is_trusted(&folder, "octave-cli --quiet --eval my_solver");
}

#[test]
fn a_new_board_is_taken_by_calibrate() {
    let folder = folder("new-board");
    succeeds(&folder, &["new", "board", "mine"]);
    let run = calibench(&folder, &["calibrate", "--board", "mine.toml", "no-photo.png"]);
    let said = String::from_utf8_lossy(&run.stderr).into_owned();
    assert!(said.contains("none of 1 photographs shows the chessboard of 9 x 6"), "{said}");
}

#[test]
fn a_doctor_finds_a_program_that_does_not_belong_to_its_tree() {
    let well = succeeds(Path::new(env!("CARGO_MANIFEST_DIR")), &["doctor"]);
    assert!(String::from_utf8_lossy(&well.stdout).contains("those that the program was built with"));
    let tree = folder("doctor");
    fs::create_dir_all(tree.join("golden")).expect("a folder is made");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for file in fs::read_dir(root.join("golden")).expect("golden/").flatten().filter(|f| f.path().is_file()) {
        fs::copy(file.path(), tree.join("golden").join(file.file_name())).expect("copied");
    }
    let snapshot = tree.join("golden/line-bending.snap");
    let moved = fs::read_to_string(&snapshot).expect("a snapshot").replace("| 4.6", "| 4.5");
    fs::write(&snapshot, moved).expect("written");
    let other = calibench(&tree, &["doctor"]);
    let said = String::from_utf8_lossy(&other.stdout).into_owned();
    assert_eq!(other.status.code(), Some(1), "{said}");
    assert!(said.contains("golden/line-bending.snap") && said.contains("LOOK"), "{said}");
    fs::remove_file(&snapshot).expect("removed");
    let missing = calibench(&tree, &["doctor"]);
    assert!(String::from_utf8_lossy(&missing.stdout).contains("no snapshot of line-bending"));
}
