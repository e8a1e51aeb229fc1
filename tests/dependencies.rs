//! Does a user of the solver alone get the solver alone? The dependency graph without features.

use std::collections::BTreeSet;
use std::process::Command;

/// Names of all crates that the library needs with the given arguments.
fn crates(arguments: &[&str]) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--edges", "normal", "--prefix", "none", "--format", "{lib}"])
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs: it runs this test");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).split_whitespace().map(str::to_string).collect()
}

#[test]
fn the_solver_alone_pulls_no_plots_command_line_or_images() {
    let solver = crates(&["--no-default-features"]);
    assert!(solver.contains("nalgebra"), "the graph was read: {solver:?}");
    for heavy in
        ["plotters", "clap", "image", "indicatif", "comfy_table", "rayon", "csv", "serde_json", "insta"]
    {
        assert!(!solver.contains(heavy), "{heavy} is in the solver's graph");
    }
}

/// Its kernels sum in an order that depends on the processor.
#[test]
fn nothing_multiplies_matrices_behind_our_back() {
    for graph in [crates(&["--no-default-features"]), crates(&[])] {
        assert!(!graph.contains("matrixmultiply"));
    }
}

#[test]
fn there_is_one_linear_algebra_and_one_random_core() {
    for (name, features) in [("nalgebra", "--all-features"), ("rand_core", "--no-default-features")] {
        let output = Command::new(env!("CARGO"))
            .args(["tree", "--offline", "--edges", "normal", "--prefix", "none", "--format", "{p}", features])
            .current_dir(env!("CARGO_MANIFEST_DIR"))
            .output()
            .expect("cargo runs: it runs this test");
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let versions: BTreeSet<&str> = text
            .lines()
            .filter(|line| line.split(' ').next() == Some(name))
            .filter_map(|line| line.split(' ').nth(1))
            .collect();
        assert_eq!(versions.len(), 1, "{name}: {versions:?}");
    }
}
