//! Are the committed trials of the experiment model-choice those that are drawn again, and does an
//! interrupted measurement go on?

use crate::program::{folder, text};
use calibench_experiments::model_choice::layout::LAYOUTS;
use calibench_experiments::model_choice::trial::Photographs;
use calibench_experiments::model_choice::truths::TRUTHS;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn committed(truth: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("golden/model-choice").join(format!("{truth}.csv"))
}

fn measure(truth: &str, out: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_model-choice-trials"))
        .args([truth, "--out"])
        .arg(out)
        .output()
        .expect("it runs")
}

#[test]
fn a_trial_does_not_depend_on_the_others() {
    // Not one that the experiment repeats.
    let rows = Photographs::new(&TRUTHS[0], LAYOUTS[1], 1, 7).expect("the board fits").rows();
    let table = std::fs::read_to_string(committed("two-radial")).expect("it is committed");
    assert_eq!(rows.len(), 8);
    for row in rows {
        assert!(table.lines().any(|line| line == row.text()), "{}", row.text());
    }
}

#[test]
fn what_was_measured_is_not_measured_again() {
    let out = folder("model-choice-again");
    let copy = out.join("division.csv");
    std::fs::copy(committed("division"), &copy).expect("it is committed");
    let before = std::fs::metadata(&copy).and_then(|m| m.modified()).expect("it is there");
    assert_eq!(measure("division", &out).status.code(), Some(0));
    assert_eq!(std::fs::metadata(&copy).and_then(|m| m.modified()).expect("it is there"), before);
}

#[test]
fn a_truth_that_is_not_there_is_named_with_those_that_are() {
    let done = measure("pinhole", &folder("model-choice-none"));
    assert_eq!(done.status.code(), Some(1));
    assert!(text(&done.stderr).contains("there are: two-radial, tangential"), "{}", text(&done.stderr));
}
