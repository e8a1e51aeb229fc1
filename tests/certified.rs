//! Are the certified problems what was certified, and does the polished solver reach their digits from every
//! start? With the lens models that it cannot polish: does it end at the certified minimum?

use calibench::board::View;
use calibench::calibrate::{Calibration, Settings, calibrate};
use calibench::camera::{Camera, FreeParameters, Lens, Model, Parameter};
use calibench::geometry::Vec2;
use calibench_gate::certified::{
    DigitsTable, Level, NoDigits, ReferenceError, ReferenceProblem, log_relative_error, measure, read,
};
use calibench_gate::solver::{Builtin, Polished};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("reference")
}

fn problems() -> Vec<ReferenceProblem> {
    read(&folder()).expect("reference/ holds certified problems")
}

/// Those of Brown-Conrady's lens, which the solver can polish.
fn of_brown() -> Vec<ReferenceProblem> {
    problems().into_iter().filter(|p| p.problem.lens_model() == Model::BrownConrady).collect()
}

fn of_other_lenses() -> Vec<ReferenceProblem> {
    problems().into_iter().filter(|p| p.problem.lens_model() != Model::BrownConrady).collect()
}

/// Digits that the polished solver must reach.
fn wanted(problem: &str) -> f64 {
    if problem == "near-degenerate" { 9.0 } else { 11.0 }
}

fn views(problem: &ReferenceProblem) -> Vec<View> {
    let points = |list: &[[f64; 2]]| list.iter().map(|&[x, y]| Vec2::new(x, y)).collect();
    let view = |v: &calibench_gate::protocol::ProblemView| {
        View::new(points(&v.target), points(&v.pixels)).expect("points and pixels pair")
    };
    problem.problem.views.iter().map(view).collect()
}

fn settings(problem: &ReferenceProblem) -> Settings {
    let parameter = |name: &String| name.parse::<Parameter>().expect("a parameter's name");
    let free: Vec<Parameter> = problem.problem.free.iter().map(parameter).collect();
    let [width, height] = problem.problem.image_size;
    problem.problem.held.iter().fold(
        Settings::new(FreeParameters::of(&free)).with_image_size((width, height)),
        |settings, (name, &value)| settings.hold(parameter(name), value),
    )
}

fn least_digits(problem: &ReferenceProblem, calibration: &Calibration) -> f64 {
    let certified = &problem.reference.certified.parameters;
    let of = |p: Parameter| log_relative_error(calibration.camera.get(p), certified[p.name()]);
    calibration.free.iter().map(of).fold(f64::INFINITY, f64::min)
}

#[test]
fn every_problem_is_well_formed() {
    let problems = problems();
    assert_eq!(of_brown().len(), 22, "those of version 1");
    assert!(of_brown().iter().all(|p| p.reference.version == 1), "they stay as they are");
    for model in Model::ALL {
        assert!(problems.iter().any(|p| p.problem.lens_model() == model), "a problem of {model}");
    }
    for level in [Level::Lower, Level::Average, Level::Higher] {
        let count = problems.iter().filter(|p| p.reference.level == level).count();
        assert!(count >= 5, "{count} problems of level {}", level.name());
    }
    for ReferenceProblem { problem, reference, .. } in &problems {
        let (id, certified) = (&problem.id, &reference.certified);
        assert!(folder().join(format!("{id}.json")).is_file(), "{id} stands in the file of its name");
        let free: BTreeSet<&String> = problem.free.iter().collect();
        assert!(free.is_disjoint(&problem.held.keys().collect()), "{id}");
        assert!(problem.model.parse::<Model>().is_ok(), "{id}: {}", problem.model);
        let named: BTreeSet<&str> =
            problem.free.iter().chain(problem.held.keys()).map(String::as_str).collect();
        let of_model: BTreeSet<&str> = problem.lens_model().parameters().map(Parameter::name).collect();
        assert_eq!(named, of_model, "{id}: free or held");
        assert_eq!(certified.parameters.keys().collect::<BTreeSet<_>>(), free, "{id}");
        assert_eq!(certified.standard_deviations.keys().collect::<BTreeSet<_>>(), free, "{id}");
        for kind in ["far", "near"] {
            let start = &reference.starts[kind];
            assert_eq!(start.parameters.keys().collect::<BTreeSet<_>>(), free, "{id}, {kind}");
            assert_eq!(start.poses.len(), problem.views.len(), "{id}, {kind}");
        }
        let unknowns = problem.free.len() + 6 * problem.views.len();
        assert_eq!(certified.degrees_of_freedom, 2 * problem.points() - unknowns, "{id}");
        assert_eq!(certified.poses.len(), problem.views.len(), "{id}");
        // A pixel of 8 decimals is a multiple of 1/256: a double holds it exactly.
        let pixels = problem.views.iter().flat_map(|v| v.pixels.iter().flatten());
        assert!(pixels.clone().all(|&p| (256.0 * p).fract() == 0.0), "{id}");
    }
}

#[test]
fn certified_numbers_agree_with_each_other_and_with_the_data() {
    for problem in problems() {
        let (id, certified) = (&problem.problem.id, &problem.reference.certified);
        let points = problem.problem.points() as f64;
        let close = |a: f64, b: f64| log_relative_error(a, b) > 14.0;
        assert!(close(certified.rmse, (certified.sum_of_squares / points).sqrt()), "{id}");
        let freedom = certified.degrees_of_freedom as f64;
        assert!(close(certified.sigma, (certified.sum_of_squares / freedom).sqrt()), "{id}");
        // The certified camera and poses leave the certified sum of squares.
        let value = |p: Parameter| {
            certified
                .parameters
                .get(p.name())
                .or(problem.problem.held.get(p.name()))
                .copied()
                .unwrap_or(f64::NAN)
        };
        let ideal = Camera::with_lens(0.0, 0.0, 0.0, 0.0, Lens::ideal(problem.problem.lens_model()));
        let camera = problem
            .problem
            .lens_model()
            .parameters()
            .fold(ideal, |camera, p| camera.with_value(p, value(p)).expect("the model has it"));
        let mut square = 0.0;
        for (view, pose) in views(&problem).iter().zip(&certified.poses) {
            for (point, pixel) in view.pairs() {
                let predicted =
                    camera.pixel(&pose.pose().apply(&point.push(0.0))).expect("the lens has an image of it");
                square += (predicted - pixel).norm_squared();
            }
        }
        // At a minimum an error of the parameters counts squared, and that of a residual, some 1e-10 px where
        // the target's origin lies 300 m away, once over the residual.
        assert!(log_relative_error(square, certified.sum_of_squares) > 9.0, "{id}: {square}");
    }
}

#[test]
fn the_polished_solver_reaches_the_certified_digits() {
    let problems = of_brown();
    for (problem, digits) in problems.iter().zip(measure(&problems, &Polished)) {
        let id = &problem.problem.id;
        let digits = digits.unwrap_or_else(|why| panic!("{id}: {why}"));
        assert!(digits.least() >= wanted(id), "{id}: {digits:?}");
        assert!(digits.standard_deviations.is_some_and(|d| d >= wanted(id)), "{id}: {digits:?}");
        assert!(digits.rmse.is_some_and(|d| d >= wanted(id)), "{id}: {digits:?}");
    }
}

#[test]
fn with_other_lenses_the_solver_ends_at_the_certified_minimum() {
    let problems = of_other_lenses();
    for (problem, digits) in problems.iter().zip(measure(&problems, &Builtin)) {
        let id = &problem.problem.id;
        let digits = digits.unwrap_or_else(|why| panic!("{id}: {why}"));
        assert!(digits.least() >= 6.0, "{id}: {digits:?}");
        // A cost is flat at its minimum: it has twice the digits of the parameters.
        assert!(digits.rmse.is_some_and(|d| d >= 11.0), "{id}: {digits:?}");
        assert!(digits.standard_deviations.is_some_and(|d| d >= 5.0), "{id}: {digits:?}");
    }
}

#[test]
fn a_solver_is_not_asked_what_it_does_not_know() {
    let problems = of_other_lenses();
    for (problem, found) in problems.iter().zip(measure(&problems, &Polished)) {
        assert_eq!(found, Err(NoDigits::UnknownModel(problem.problem.lens_model())));
    }
}

#[test]
fn the_digits_are_reached_from_the_starts_of_the_files() {
    for problem in of_brown() {
        for (kind, start) in &problem.reference.starts {
            let value = |p: Parameter| {
                start
                    .parameters
                    .get(p.name())
                    .or(problem.problem.held.get(p.name()))
                    .copied()
                    .unwrap_or(f64::NAN)
            };
            let camera = Camera::from_parameters(Parameter::ALL.map(value));
            let mut settings = settings(&problem).polished();
            settings.start = Some(camera);
            let calibration = calibrate(&views(&problem), &settings).expect("the data determine a camera");
            let digits = least_digits(&problem, &calibration);
            let id = &problem.problem.id;
            assert!(digits >= wanted(id), "{id} from the {kind} start: {digits} digits");
        }
    }
}

#[test]
fn polishing_moves_the_estimate_by_less_than_a_millionth_of_its_standard_deviation() {
    for problem in of_brown() {
        let (views, settings) = (views(&problem), settings(&problem));
        let plain = calibrate(&views, &settings).expect("the data determine a camera");
        let polished = calibrate(&views, &settings.clone().polished()).expect("the data determine a camera");
        for parameter in plain.free.iter() {
            let moved = (plain.camera.get(parameter) - polished.camera.get(parameter)).abs();
            let deviation = plain.standard_deviation(parameter).expect("it is free");
            // The refinement promises 1e-7 times the root of the degrees of freedom, of which there are up to
            // 4000.
            assert!(
                moved <= 1e-5 * deviation,
                "{}: {parameter} by {:e}",
                problem.problem.id,
                moved / deviation
            );
        }
        assert_eq!((polished.iterations, polished.termination), (plain.iterations, plain.termination));
        assert_eq!(polished.warnings, plain.warnings);
        // A few roundings: the pixels' over the residuals', some 1e-13 / 0.02.
        assert!(polished.rmse_px <= plain.rmse_px * (1.0 + 1e-11), "{}", problem.problem.id);
    }
}

#[test]
fn polished_poses_belong_to_the_certified_minimum() {
    for problem in of_brown() {
        let calibration = calibrate(&views(&problem), &settings(&problem).polished()).expect("a camera");
        for (pose, certified) in calibration.cam_from_target.iter().zip(&problem.reference.certified.poses) {
            let certified = certified.pose();
            assert!((pose.rotation - certified.rotation).abs().max() < 1e-13, "{}", problem.problem.id);
            let error = (pose.translation - certified.translation).norm() / certified.translation.norm();
            assert!(error < 1e-12, "{}: {error:e}", problem.problem.id);
        }
    }
}

#[test]
fn a_file_that_was_changed_is_not_read() {
    let copy = Path::new(env!("CARGO_TARGET_TMPDIR")).join("reference-changed");
    let _ = std::fs::remove_dir_all(&copy);
    std::fs::create_dir_all(&copy).expect("a folder");
    for entry in std::fs::read_dir(folder()).expect("reference/").flatten().filter(|e| e.path().is_file()) {
        std::fs::copy(entry.path(), copy.join(entry.file_name())).expect("a copy");
    }
    assert_eq!(read(&copy).expect("an exact copy").len(), problems().len());
    let path = copy.join("nine-points.json");
    let text = std::fs::read_to_string(&path).expect("a problem");
    std::fs::write(&path, text.replacen("600", "601", 1)).expect("written");
    assert!(matches!(read(&copy), Err(ReferenceError::Changed { name, .. }) if name == "nine-points.json"));
}

#[test]
fn every_file_beside_the_data_is_in_the_list_of_sums() {
    let sums = std::fs::read_to_string(folder().join("SHA256SUMS")).expect("the list");
    let listed: BTreeSet<String> =
        sums.lines().filter_map(|l| l.split_once("  ")).map(|l| l.1.into()).collect();
    // The table of digits is a result of the solvers, and not of what is certified.
    let others = ["SHA256SUMS", "digits.csv"];
    let there: BTreeSet<String> = std::fs::read_dir(folder())
        .expect("reference/")
        .flatten()
        .filter(|entry| entry.path().is_file())
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| !others.contains(&name.as_str()))
        .collect();
    assert_eq!(listed, there, "python3 reference/certify.py --sums");
}

#[test]
fn the_committed_table_has_our_digits_and_its_page_shows_it() {
    let text = std::fs::read_to_string(folder().join("digits.csv")).expect("the table");
    let table = DigitsTable::of_csv(&text).expect("a table of digits");
    let problems = problems();
    let mut ours = DigitsTable::default();
    ours.add("calibench, polished", &problems, &measure(&problems, &Polished));
    let committed: Vec<_> = table.rows.iter().filter(|row| row.solver == "calibench, polished").collect();
    assert_eq!(committed, ours.rows.iter().collect::<Vec<_>>(), "just digits");
    let others = of_other_lenses();
    let mut plain = DigitsTable::default();
    plain.add("calibench", &others, &measure(&others, &Builtin));
    for row in &plain.rows {
        assert_eq!(table.row("calibench", &row.problem), Some(row), "just digits");
    }
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("adapters/DIGITS.md");
    let page = std::fs::read_to_string(page).expect("the page");
    let shown = page
        .split_once("<!-- begin certified -->\n")
        .and_then(|(_, rest)| rest.split_once("<!-- end certified -->"))
        .map(|(shown, _)| shown);
    assert_eq!(
        shown,
        Some(table.to_markdown().as_str()),
        "put there what `calibench gate digits-table` prints"
    );
}

fn gate(arguments: &[&str]) -> (Option<i32>, String) {
    let run = Command::new(env!("CARGO_BIN_EXE_calibench"))
        .arg("gate")
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("the program starts");
    (run.status.code(), String::from_utf8_lossy(&[run.stdout, run.stderr].concat()).into_owned())
}

#[test]
fn the_command_counts_digits_and_says_who_refused() {
    let (code, text) = gate(&["certified", "--problem", "nine-points", "--least-digits", "11"]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("nine-points") && text.contains("higher"), "{text}");
    let refuses = r#"while read -r line; do id=${line#*'"id":"'}; echo "{\"id\":\"${id%%'"'*}\",\"status\":\"refused\",\"message\":\"too few\"}"; done"#;
    let (code, text) = gate(&["certified", "--problem", "nine-points", "--solver", refuses]);
    assert_eq!(code, Some(1), "{text}");
    assert!(text.contains("refused: too few"), "{text}");
    // A program that does not say that it knows a lens model is not asked; of what it knows nothing is left
    // here.
    let (code, text) = gate(&["certified", "--problem", "rational", "--solver", refuses]);
    assert_eq!(code, Some(1), "{text}");
    assert!(text.contains("unsupported: it does not know the lens model rational"), "{text}");
    assert!(text.contains("nothing was asked"), "{text}");
    // This library's own solver, as it is: there is no polishing.
    let (code, text) = gate(&["certified", "--problem", "fisheye", "--least-digits", "6"]);
    assert_eq!(code, Some(0), "{text}");
    assert!(!text.contains("polished") && text.contains("k4"), "{text}");
    let (code, text) = gate(&["certified", "--problem", "no-such-problem"]);
    assert_eq!(code, Some(2), "{text}");
    assert!(text.contains("there are: "), "{text}");
}
