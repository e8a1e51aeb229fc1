//! Are the committed trials of the experiment other-solvers those that a program gives when it is asked
//! again?

use crate::program::{folder, text};
use calibench_experiments::other_solvers::trials::ask;
use calibench_gate::{Builtin, Process};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The committed lines of a program, by cell and trial.
fn committed(name: &str) -> BTreeMap<(usize, u64), String> {
    let file = root().join("golden/other-solvers").join(format!("{name}.csv"));
    let all = std::fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    let place = |line: &str| {
        let mut fields = line.split(',');
        Some((fields.next()?.parse().ok()?, fields.next()?.parse().ok()?))
    };
    all.lines().filter_map(|line| Some((place(line)?, line.to_string()))).collect()
}

#[test]
fn a_trial_does_not_depend_on_how_many_are_asked() {
    let committed = committed("calibench");
    assert_eq!(committed.len(), 23 * 200);
    // Not those that the experiment repeats: the fourth and the fifth trial too.
    let asked = ask(Builtin, 5).expect("studies");
    assert_eq!((asked.rows.len(), asked.rounding.len()), (23 * 5, 23 * 5));
    for row in &asked.rows {
        assert_eq!(Some(&row.text()), committed.get(&(row.cell, row.trial)));
    }
    // Pixels of an image 640 wide: half of the last digit of single precision is 3e-5 px at most, the noise
    // 0.1 px.
    assert!(asked.rounding.iter().all(|share| (1e-5..3e-4).contains(share)), "{:?}", asked.rounding);
}

#[test]
fn a_program_that_refuses_has_no_errors() {
    let refuses = r#"sed -u 's/^{"id":"\([^"]*\)".*/{"id":"\1","status":"refused"}/'"#;
    let asked = ask(Process::new(refuses, Duration::from_secs(20), 1), 1).expect("studies");
    let ends: Vec<String> = asked.rows.iter().map(|row| row.text()).collect();
    assert_eq!(ends.len(), 23);
    assert_eq!((ends[0].as_str(), ends[22].as_str()), ("0,0,refused,0,,,,,,", "22,0,refused,0,,,,,,"));
}

#[test]
#[cfg_attr(not(calibench_numpy), ignore = "needs python3 with NumPy")]
fn the_minimal_solver_gives_the_committed_trials_again() {
    let adapter = root().join("adapters/minimal_solver.py");
    let command = format!("python3 '{}'", adapter.display());
    let committed = committed("minimal");
    let asked = ask(Process::new(&command, Duration::from_secs(60), 1), 1).expect("studies");
    for row in &asked.rows {
        let then = &committed[&(row.cell, row.trial)];
        let numbers =
            |line: &str| -> Vec<Option<f64>> { line.split(',').map(|field| field.parse().ok()).collect() };
        let (now, then) = (row.text(), then.clone());
        // Cells 14, 17 and 20 tilt by one degree: whether their normal equations are singular is a matter of
        // rounding.
        if [14, 17, 20].contains(&row.cell) {
            continue;
        }
        for (a, b) in numbers(&now).iter().zip(numbers(&then)) {
            let same = match (a, b) {
                // Another NumPy sums in another order.
                (Some(a), Some(b)) => (a - b).abs() <= 1e-3 * (1e-6 + b.abs()),
                (a, b) => a.is_none() == b.is_none(),
            };
            assert!(same, "{now}\n{then}");
        }
    }
}

#[test]
fn what_a_python_lacks_is_named() {
    let out = folder("other-solvers-versions").join("x.csv");
    let done = Command::new(env!("CARGO_BIN_EXE_other-solvers-trials"))
        .args(["opencv", "--python", "false", "--trials", "1", "--out"])
        .arg(&out)
        .output()
        .expect("it runs");
    assert_eq!(done.status.code(), Some(1));
    assert!(text(&done.stderr).contains("false lacks cv2, numpy"), "{}", text(&done.stderr));
    assert!(!out.exists());
    let done =
        Command::new(env!("CARGO_BIN_EXE_other-solvers-trials")).arg("nobody").output().expect("it runs");
    assert_eq!(done.status.code(), Some(1));
    assert!(text(&done.stderr).contains("there are: calibench, opencv"), "{}", text(&done.stderr));
}
