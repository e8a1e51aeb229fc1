//! Does a user of the library get what it computes with, and nothing else? Its dependency graph, and that of
//! the command.

use std::collections::BTreeSet;
use std::process::Command;

/// What `cargo tree` prints of the crates that are compiled with the given arguments. It may ask for no
/// feature that the tests were not built with: nobody has downloaded those crates.
fn tree(format: &str, arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO"))
        .args([
            "tree",
            "--offline",
            "--edges",
            "normal",
            "--prefix",
            "none",
            "--no-dedupe",
            "--format",
            format,
        ])
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs: it runs this test");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Names of all crates of a graph.
fn crates(arguments: &[&str]) -> BTreeSet<String> {
    tree("{lib}", arguments).split_whitespace().map(str::to_string).collect()
}

const SOLVER: [&str; 3] = ["--package", "calibench", "--no-default-features"];

#[test]
fn the_solver_alone_pulls_no_plots_command_line_or_images() {
    let solver = crates(&SOLVER);
    assert!(solver.contains("nalgebra"), "the graph was read: {solver:?}");
    for heavy in ["plotters", "clap", "image", "comfy_table", "rayon", "csv", "serde_json", "insta"] {
        assert!(!solver.contains(heavy), "{heavy} is in the solver's graph");
    }
}

#[test]
fn threads_are_all_that_the_library_adds_by_default() {
    let (solver, library) = (crates(&SOLVER), crates(&SOLVER[..2]));
    let added: Vec<&str> = library.difference(&solver).map(String::as_str).collect();
    assert!(added.contains(&"rayon") && added.iter().all(|name| RAYON.contains(name)), "{added:?}");
}

#[test]
fn the_readme_counts_them() {
    let [solver, library] = [&SOLVER[..], &SOLVER[..2]]
        .map(|arguments| tree("{p}", arguments).lines().collect::<BTreeSet<_>>().len());
    let said = format!("{library} crates, itself counted, {solver} with `default-features = false`");
    assert!(include_str!("../README.md").contains(&said), "README.md does not say: {said}");
}

/// rayon and what it needs.
const RAYON: [&str; 6] =
    ["rayon", "rayon_core", "either", "crossbeam_deque", "crossbeam_epoch", "crossbeam_utils"];

/// Its kernels sum in an order that depends on the processor.
#[test]
fn nothing_multiplies_matrices_behind_our_back() {
    for graph in [crates(&SOLVER), crates(&[])] {
        assert!(!graph.contains("matrixmultiply"));
    }
}

#[test]
fn there_is_one_linear_algebra_and_one_random_core() {
    let packages = tree("{p}", &[]);
    for name in ["nalgebra", "rand_core"] {
        let versions: BTreeSet<&str> = packages
            .lines()
            .filter(|line| line.split(' ').next() == Some(name))
            .filter_map(|line| line.split(' ').nth(1))
            .collect();
        assert_eq!(versions.len(), 1, "{name}: {versions:?}");
    }
    // With every feature and for every target: what the lock file holds.
    let lock = include_str!("../Cargo.lock");
    assert_eq!(lock.matches("name = \"nalgebra\"\n").count(), 1);
}
