//! Can any solver calibrate in a study? On the same noise as this library's, and with its own endings.

use crate::program::{calibench, folder, text};
use calibench::board::View;
use calibench_gate::accept::Outcome;
use calibench_gate::protocol::Problem;
use calibench_gate::{Builtin, Solver};
use calibench_study::{Calibrator, Cell, Engine, Estimate, Folder, Interruption, Manifest, Shard, compare};
use std::path::Path;
use std::sync::Arc;

const SPEC: &str = r#"
name = "solver"
question = "Does another solver see what this one sees?"
seed = 3
scene.image = [640, 480]
scene.camera = { fx = 600.0, fy = 590.0, cx = 326.0, cy = 243.0, k1 = -0.18, k2 = 0.05, p1 = 0.001 }
scene.target = { columns = 9, rows = 7, spacing_mm = 10.0 }
scene.poses = { kind = "random", views = 5, tilt_min_deg = 10.0, tilt_deg = 35.0, distance_mm = 150.0 }
scene.noise_px = 0.1
estimator.hold = { p1 = 0.001 }
trials = { per_cell = 6, batch = 3 }

[[factor]]
name = "noise"
set = ["scene.noise_px"]
levels = [0.1, 0.3]
"#;

/// This library's solver, asked in the words of the protocol.
#[derive(Debug)]
struct Told;

impl Calibrator for Told {
    fn calibrate(&self, cell: &Cell, seen: &[Vec<View>]) -> Vec<Result<Estimate, String>> {
        let held = cell.held().expect("a camera");
        seen.iter()
            .map(|views| {
                let problem = Problem::of_views("one".into(), cell.image_size(), views, &held, cell.free());
                let problem: Problem = serde_json::from_str(&problem.to_line()).expect("a problem");
                let reply = Builtin.ask_all(&[problem]).remove(0);
                let Outcome::Estimate(estimate) = reply.outcome else { return Err("broken".into()) };
                Ok(Estimate {
                    camera: estimate.camera,
                    cam_from_target: estimate.cam_from_target,
                    rmse_px: estimate.rmse_px,
                    covariance: estimate.covariance,
                    outcome: "converged".into(),
                    iterations: 0,
                })
            })
            .collect()
    }
}

/// Runs the study into a folder.
fn run(mut engine: Engine, path: &Path, solver: Option<&str>) {
    let build = calibench_experiments::build();
    let manifest = Manifest::new(&engine.spec, Shard::WHOLE, &build).with_solver(solver.map(String::from));
    let run = Folder::create(path, SPEC, &manifest).expect("a folder");
    run.run(&mut engine, &Interruption::new(false), |_| {}).expect("it runs");
    assert_eq!(engine.trials(), 12);
    calibench_study::finish(&run, &engine).expect("it is written");
}

#[test]
fn a_solver_that_answers_as_this_library_does_gives_its_trials_to_the_last_bit() {
    let out = folder("study-solver");
    let engine = || Engine::new(SPEC, Shard::WHOLE).expect("a study");
    run(engine(), &out.join("ours"), None);
    run(engine().calibrated_by(Arc::new(Told)), &out.join("told"), Some("told"));
    let trials = |name: &str| {
        let text = std::fs::read_to_string(out.join(name).join("trials.csv")).expect("trials");
        // The protocol says nothing of iterations.
        let without = |line: &str| {
            let mut fields: Vec<String> = line.split(',').map(String::from).collect();
            fields.remove(3);
            fields
        };
        text.lines().map(without).collect::<Vec<_>>()
    };
    assert_eq!(trials("ours")[0][..3], ["cell", "trial", "outcome"]);
    assert!(trials("ours")[1].iter().all(|value| !value.is_empty()), "{:?}", trials("ours")[1]);
    assert_eq!(trials("ours"), trials("told"));
    let report = std::fs::read_to_string(out.join("told/report.html")).expect("a report");
    assert!(report.contains("Calibrated by <code>told</code>"));
    assert!(report.contains("They move together") && report.contains("<th>jointly</th>"));
    // Runs that met the same noise can be compared, whoever calibrated.
    compare::compare(&out.join("ours"), &out.join("told")).expect("a comparison");
}

#[cfg(unix)]
#[test]
fn a_program_that_refuses_is_counted_and_a_run_is_continued_by_the_same_program_only() {
    let out = folder("study-program");
    let (spec, run) = (out.join("spec.toml"), out.join("run"));
    std::fs::write(&spec, SPEC).expect("written");
    let refuses = r#"sed -u 's/^{"id":"\([^"]*\)".*/{"id":"\1","status":"refused"}/'"#;
    let paths = [spec.display().to_string(), run.display().to_string()];
    let [spec, run] = [&paths[0], &paths[1]];
    let ended = calibench(&out, &["study", "run", spec, "--out", run, "--solver", refuses]);
    assert_eq!(ended.status.code(), Some(1), "{}", text(&ended.stderr));
    assert!(text(&ended.stdout).contains("6 refused-by-program"), "{}", text(&ended.stdout));
    assert!(
        text(&ended.stderr).contains("first trial that is refused-by-program: refused"),
        "{}",
        text(&ended.stderr)
    );
    for wrong in [&["study", "resume", run][..], &["study", "resume", run, "--solver", "cat"]] {
        let refused = calibench(&out, wrong);
        assert_eq!(refused.status.code(), Some(2));
        assert!(text(&refused.stderr).contains("solver: was "), "{}", text(&refused.stderr));
    }
    let resumed = calibench(&out, &["study", "resume", run, "--solver", refuses]);
    assert_eq!(resumed.status.code(), Some(1), "{}", text(&resumed.stderr));
}

#[cfg(unix)]
#[test]
fn what_a_program_cannot_be_asked_is_said_before_it_is() {
    let out = folder("study-unasked");
    let spec = out.join("spec.toml");
    let cases = [
        (
            SPEC.replace(
                "estimator.hold",
                "estimator.loss = { kind = \"huber\", delta_px = 0.2 }\nestimator.hold",
            ),
            "least squares only",
        ),
        (
            SPEC.replace("estimator.hold = { p1 = 0.001 }", "estimator.model = \"division\""),
            "knows the lens model division",
        ),
    ];
    for (study, said) in cases {
        std::fs::write(&spec, study).expect("written");
        let run = out.join("run").display().to_string();
        let ended = calibench(
            &out,
            &[
                "study",
                "run",
                &spec.display().to_string(),
                "--out",
                &run,
                "--solver",
                "cat",
                "--timeout",
                "1",
            ],
        );
        assert_eq!(ended.status.code(), Some(2), "{}", text(&ended.stdout));
        assert!(text(&ended.stderr).contains(said), "{}", text(&ended.stderr));
        assert!(!out.join("run").exists());
    }
}
