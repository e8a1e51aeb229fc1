//! Does the gate treat any program as a black box, and end as it says? Programs that work, hang, crash and
//! babble.
#![cfg(unix)]

use crate::gate_programs::greets_and_refuses;
use calibench_gate::accept::Breakage;
use calibench_gate::faults::{Faulty, planted};
use calibench_gate::plan::Purpose;
use calibench_gate::power::Measured;
use calibench_gate::protocol::{Answer, Problem, Status, schemas};
use calibench_gate::{Asked, Builtin, Plan, Property, Report, Solver, Terms, Verdict, run};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub const CALIBENCH: &str = env!("CARGO_BIN_EXE_calibench");

pub fn gate(arguments: &[&str]) -> Output {
    Command::new(CALIBENCH).arg("gate").args(arguments).output().expect("the program starts")
}

pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    if folder.exists() {
        std::fs::remove_dir_all(&folder).expect("an old folder is removed");
    }
    folder
}

pub fn problems(count: usize) -> Vec<Problem> {
    let plan = Plan::new(1, 1).expect("a plan");
    let samples = plan.cases.iter().filter(|case| case.purpose == Purpose::Sample);
    samples.take(count).map(|case| plan.problem(case)).collect()
}

#[test]
fn the_correct_solver_is_trusted_with_every_lens() {
    let plan = Plan::of(1, 2, Asked::of(&Builtin.models()[1..])).expect("a plan");
    assert_eq!(plan.scenarios.len(), 8);
    let report = Report::new(&plan, "", &run(&plan, &Builtin, &|_| ()), &Terms::default(), 0.0);
    assert!(report.held(), "{}{}", report.to_text(200), report.details());
}

#[test]
fn one_scene_is_asked_alone_and_the_verdict_says_so() {
    let planted = ["--planted", "fy-cx-swapped"];
    let one = gate(&[&planted[..], &["--samples", "2", "--scene", "non-square"]].concat());
    let text = String::from_utf8_lossy(&one.stdout).into_owned();
    let details = String::from_utf8_lossy(&one.stderr).into_owned();
    assert_eq!(one.status.code(), Some(1), "{text}{details}");
    assert!(text.contains("; only non-square\n"), "{text}");
    let again = "again: calibench gate --planted fy-cx-swapped --models brown-conrady --samples 2 --seed 1 \
                 --scene non-square";
    assert!(details.contains(again), "{details}");
    let held = gate(&["--samples", "1", "--scene", "no-views", "--scene", "four-pose"]);
    assert_eq!(held.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&held.stdout).contains("HELD on the scenes asked, which is no verdict"));
    let unknown = gate(&["--scene", "five-pose"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&unknown.stderr).contains("there are: four-pose, many-views"));
}

#[test]
fn files_keep_the_lens_models_that_were_asked() {
    let dir = folder("gate-lenses");
    let path = dir.display().to_string();
    let written = gate(&["--samples", "1", "--models", "division,kannala-brandt", "--record", &path]);
    assert_eq!(written.status.code(), Some(0), "{}", String::from_utf8_lossy(&written.stderr));
    let judged = gate(&["judge", &path]);
    assert_eq!(judged.status.code(), Some(0), "{}", String::from_utf8_lossy(&judged.stderr));
    assert!(String::from_utf8_lossy(&judged.stdout).contains("lens models: division, kannala-brandt\n"));
    let problems = std::fs::read_to_string(dir.join("problems.jsonl")).expect("problems");
    assert!(problems.lines().all(|line| line.contains(r#""model":"#)), "{problems}");
}

#[test]
fn our_solver_is_trusted_and_every_report_is_written() {
    let out = folder("gate-reports");
    let path = |name: &str| out.join(name).to_string_lossy().into_owned();
    let (json, junit, html) = (path("a.json"), path("a.xml"), path("a.html"));
    let output = gate(&["--samples", "4", "--json", &json, "--junit", &junit, "--html", &html]);
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stdout));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    // A line for each of 26 properties, and one for each of nine scenes where the model fails.
    assert!(text.lines().count() <= 42, "one screen:\n{text}");
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&json).expect("written")).expect("JSON");
    assert_eq!(report["verdict"], "held");
    assert!(report["checks"].as_array().is_some_and(|checks| checks.len() > 100));
    let xml = std::fs::read_to_string(&junit).expect("written");
    assert!(xml.contains("<testsuite name=\"exactness\"") && !xml.contains("<failure"), "{xml}");
    let page = std::fs::read_to_string(&html).expect("written");
    assert!(page.contains("TRUSTED") && !page.contains("http"), "self-contained");
}

#[test]
fn answers_from_files_get_the_verdict_of_the_same_answers_from_a_pipe() {
    let out = folder("gate-files");
    let place = out.to_string_lossy().into_owned();
    assert_eq!(gate(&["--samples", "2", "--record", &place]).status.code(), Some(0));
    let problems = std::fs::read_to_string(out.join("problems.jsonl")).expect("written");
    assert!(!problems.contains("truth"), "truth stands apart");
    let judged = gate(&["judge", &place]);
    assert_eq!(judged.status.code(), Some(0), "{}", String::from_utf8_lossy(&judged.stdout));
    // The same solver against its own record: not a bit differs.
    let same = gate(&["--against", &place]);
    assert!(String::from_utf8_lossy(&same.stdout).contains("SAME: not a bit differs"));
    // What is wrong with an answer in a file is a finding about its problem.
    let path = out.join("answers.jsonl");
    let answers = std::fs::read_to_string(&path).expect("written");
    let spoilt: String = answers
        .lines()
        .enumerate()
        .map(|(i, line)| match i {
            3 => format!("{{{}\n", &line[1..].replacen("\"rmse\":", "\"rmse\":NaN,\"x\":", 1)),
            5 => format!("{line}\n{line}\n"),
            6 => format!("{line}\n{}\n", line.replace("\"id\":\"", "\"id\":\"another-\u{1b}[31m")),
            7 => "garbage\n".to_string(),
            _ => format!("{line}\n"),
        })
        .collect();
    std::fs::write(&path, spoilt).expect("written");
    let judged = gate(&["judge", &place]);
    assert_eq!(judged.status.code(), Some(1));
    let text = String::from_utf8_lossy(&judged.stderr).into_owned();
    assert!(
        text.contains("protocol / four-pose: 3 of 15 broken, first: a number of the answer is NaN"),
        "{text}"
    );
    // So is what answers a problem of another folder.
    assert!(text.contains("answers.jsonl, line 9: no problem here is called another-"), "{text}");
    assert!(!text.contains('\u{1b}'), "{text:?}");
    std::fs::remove_file(path).expect("removed");
    assert_eq!(gate(&["judge", &place]).status.code(), Some(2));
}

/// A scene without estimates has no check of its bias or its poses: the checks of the other run must not be
/// compared with those that stand in their places.
#[test]
fn verdicts_are_compared_scene_by_scene_where_one_run_has_fewer_checks() {
    let [silent, off] = ["gate-silent", "gate-off"].map(folder);
    let place = |folder: &std::path::Path| folder.to_string_lossy().into_owned();
    let scenes = ["--scene", "four-pose", "--scene", "metres"];
    let record = |to: &std::path::Path, planted: &[&str]| {
        let to = place(to);
        let arguments = [&["--samples", "16", "--record", &to][..], &scenes, planted].concat();
        assert!(gate(&arguments).status.code().is_some_and(|code| code < 2));
    };
    record(&silent, &[]);
    record(&off, &["--planted", "pose-covariance-in-degrees"]);
    let truth = std::fs::read_to_string(silent.join("problems.jsonl")).expect("written");
    let of_metres = |line: &str| {
        // Marks of a board in metres are less than 1 apart from the middle.
        let problem: serde_json::Value = serde_json::from_str(line).expect("JSON");
        let x = problem["views"][0]["target"][0][0].as_f64();
        (problem["id"].clone(), x.is_some_and(|x| x.abs() < 1.0))
    };
    let in_metres: Vec<_> = truth.lines().map(of_metres).filter(|(_, is)| *is).map(|(id, _)| id).collect();
    assert!(!in_metres.is_empty() && in_metres.len() < truth.lines().count());
    let path = silent.join("answers.jsonl");
    let answers = std::fs::read_to_string(&path).expect("written");
    let without: String = answers
        .lines()
        .map(|line| {
            let answer: serde_json::Value = serde_json::from_str(line).expect("JSON");
            match in_metres.contains(&answer["id"]) {
                true => format!("{{\"id\": {}, \"status\": \"unsupported\"}}\n", answer["id"]),
                false => format!("{line}\n"),
            }
        })
        .collect();
    std::fs::write(&path, without).expect("written");
    let output = gate(&["judge", &place(&off), "--against", &place(&silent)]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(1), "{text}");
    let verdicts: Vec<&str> = text.lines().filter(|line| line.contains(" -> ")).collect();
    assert!(verdicts.contains(&"pose-covariance: held -> FAILED (four-pose)"), "{text}");
    assert!(verdicts.contains(&"bias: not judged -> held (metres)"), "{text}");
    assert!(!verdicts.iter().any(|line| line.starts_with("rmse: ") && line.contains("four-pose")), "{text}");
}

#[test]
fn a_change_far_below_the_noise_shows_on_common_noise() {
    let same_law = gate(&["--samples", "64", "--against", "builtin", "--planted", "last-bits"]);
    let text = String::from_utf8_lossy(&same_law.stdout).into_owned();
    assert!(text.contains("determinism") && text.contains("CHANGED"), "{text}");
    let biased = gate(&["--samples", "64", "--against", "builtin", "--planted", "biased-fx"]);
    let text = String::from_utf8_lossy(&biased.stdout).into_owned();
    assert_eq!(biased.status.code(), Some(1));
    assert!(
        text.lines().any(|l| l.starts_with("four-pose") && l.contains("fx 0.") && l.contains("MOVED")),
        "{text}"
    );
}

#[test]
fn two_files_of_answers_are_compared_as_the_solvers_behind_them_are() {
    let place = |name: &str| folder(name).to_string_lossy().into_owned();
    let (before, after, other) = (place("gate-before"), place("gate-after"), place("gate-other"));
    let scene = ["--scene", "four-pose", "--scene", "marks-missing"];
    let record = |to: &str, more: &[&str]| {
        let arguments = [&["--samples", "64", "--record", to][..], &scene, more].concat();
        assert!(gate(&arguments).status.code().is_some_and(|code| code < 2), "{to}");
    };
    record(&before, &[]);
    record(&after, &["--planted", "biased-fx"]);
    record(&other, &["--seed", "2"]);
    let compare = |new: &str, reference: &str| {
        let output = gate(&["judge", new, "--against", reference]);
        let text = [output.stdout, output.stderr].map(|o| String::from_utf8_lossy(&o).into_owned()).concat();
        (output.status.code(), text)
    };
    let (code, text) = compare(&after, &before);
    assert_eq!(code, Some(1), "{text}");
    // The table is that of the live program, but for the times, which no file has.
    let live = [&["--samples", "64", "--against", "builtin", "--planted", "biased-fx"][..], &scene].concat();
    let live = String::from_utf8_lossy(&gate(&live).stdout).into_owned();
    let row = |text: &str| {
        let line = text.lines().find(|l| l.starts_with("marks-missing")).expect("a row");
        line.replace("MOVED", "").trim_end().rsplit_once(' ').expect("columns").0.trim_end().to_string()
    };
    assert_eq!(row(&text), row(&live));
    assert!(text.contains("MOVED") && text.contains("times are not known of answers in files"), "{text}");
    let (code, text) = compare(&before, &before);
    assert!(code == Some(0) && text.contains("SAME: not a bit differs"), "{text}");
    let (code, text) = compare(&before, "builtin");
    assert!(code == Some(0) && text.contains("SAME: not a bit differs"), "{text}");
    let (code, text) = compare(&before, &other);
    assert!(code == Some(2) && text.contains("answer other problems (seed 1, 64 samples"), "{text}");
    // A program is asked the problems that were answered.
    let (code, text) = compare(&before, &greets_and_refuses(r#"{"protocol": 2}"#, 0.0));
    assert!(code.is_some_and(|code| code < 2) && text.contains("0 answers lost, 64 gained"), "{text}");
    let (code, text) =
        compare(&before, &greets_and_refuses(r#"{"protocol": 2, "models": ["division"]}"#, 0.0));
    assert!(code == Some(2), "{text}");
    // Of runs with other lens models the common part is compared.
    let (plain, more) = (place("gate-plain"), place("gate-more"));
    let all_scenes = |to: &str, models: &str| {
        assert_eq!(gate(&["--samples", "1", "--models", models, "--record", to]).status.code(), Some(0));
    };
    all_scenes(&plain, "brown-conrady");
    all_scenes(&more, "brown-conrady,division");
    let (code, text) = compare(&plain, &more);
    assert!(code == Some(0) && text.contains("four-pose") && !text.contains("division"), "{text}");
    let (code, text) = compare(&before, "no-such-folder");
    assert!(code == Some(2) && text.contains("neither there as a folder nor as a program"), "{text}");
    // Where nothing took the time, nothing is said of it.
    let judged = gate(&["judge", &before, "--median-time", "600"]);
    let text = String::from_utf8_lossy(&judged.stdout).into_owned();
    assert!(
        text.lines().any(|l| l.starts_with("time ") && l.contains("not known of answers in files")),
        "{text}"
    );
}

/// With too few pairs for a test a difference that would matter is not called none, whichever of the two is
/// the reference.
#[test]
fn answers_that_differ_by_much_are_not_called_of_one_law_for_being_few() {
    let (good, biased) = (folder("gate-few-good"), folder("gate-few-biased"));
    let path = |folder: &Path| folder.to_string_lossy().into_owned();
    let recorded = gate(&["--samples", "4", "--scene", "four-pose", "--record", &path(&good)]);
    assert_eq!(recorded.status.code(), Some(0));
    std::fs::create_dir_all(&biased).expect("a folder");
    let read = |name: &str| std::fs::read_to_string(good.join(name)).expect("recorded");
    let off = |line: &str| {
        let mut answer: serde_json::Value = serde_json::from_str(line).expect("an answer");
        if let Some(fx) = answer["parameters"]["fx"].as_f64() {
            answer["parameters"]["fx"] = (fx + 0.3).into();
        }
        format!("{answer}\n")
    };
    let answers: String = read("answers.jsonl").lines().map(off).collect();
    std::fs::write(biased.join("answers.jsonl"), answers).expect("written");
    std::fs::write(biased.join("manifest.json"), read("manifest.json")).expect("written");
    for (new, reference) in [(&good, &biased), (&biased, &good)] {
        let json = good.with_extension("json");
        let compared =
            gate(&["judge", &path(new), "--against", &path(reference), "--json", &json.to_string_lossy()]);
        let text = String::from_utf8_lossy(&compared.stdout).into_owned();
        assert_eq!(compared.status.code(), Some(1), "{text}");
        assert!(text.contains("\nTOO FEW PAIRS: ") || text.contains("\nCHANGED: "), "{text}");
        let report: serde_json::Value =
            serde_json::from_slice(&std::fs::read(&json).expect("written")).expect("JSON");
        assert_eq!(report["held"], false);
        assert!(["too-few-pairs", "changed"].contains(&report["conclusion"].as_str().expect("a word")));
    }
}

#[test]
fn a_reference_that_estimates_nothing_is_compared_with_nothing() {
    let asked = ["--samples", "2", "--scene", "four-pose", "--against"];
    let compared = gate(&[&asked[..], &["exit 1"]].concat());
    let text = String::from_utf8_lossy(&compared.stdout).into_owned();
    assert_eq!(compared.status.code(), Some(1), "{text}");
    assert!(text.contains("\nNOT COMPARED: of no problem are there two estimates"), "{text}");
    // Of bad input nothing is estimated, and both refuse it.
    let refused = gate(&["--samples", "2", "--scene", "no-views", "--against", "builtin"]);
    assert_eq!(refused.status.code(), Some(0), "{}", String::from_utf8_lossy(&refused.stdout));
}

#[test]
fn wrong_usage_ends_with_two() {
    for arguments in [
        &["--samples", "0"][..],
        &["--accept", "beauty"],
        &["--planted", "no-such-fault"],
        &["--timeout", "-1", "--solver", "true"],
        &["--median-time", "0"],
        &["power-table", "/no/such/folder"],
        &["judge", "/no/such/folder"],
    ] {
        assert_eq!(gate(arguments).status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn what_is_known_can_be_accepted() {
    let fault = planted().into_iter().find(|f| f.id == "rounded-to-f32").expect("the fault");
    let plan = Plan::new(1, 1).expect("a plan");
    let solver = Faulty::new(fault);
    let seen = run(&plan, &solver, &|_| ());
    let report = |accepted: &[Property]| {
        Report::new(&plan, "", &seen, &Terms { accepted: accepted.to_vec(), ..Terms::default() }, 0.0)
    };
    assert!(!report(&[]).held());
    assert!(report(&[Property::Exactness]).held(), "{}", report(&[Property::Exactness]).details());
}

#[test]
fn excess_variance_is_no_business_of_the_invariances() {
    let fault = planted().into_iter().find(|f| f.id == "excess-variance").expect("the fault");
    let plan = Plan::new(1, 2).expect("a plan");
    let seen = run(&plan, &Faulty::new(fault), &|_| ());
    let report = Report::new(&plan, "", &seen, &Terms::default(), 0.0);
    assert!(report.held(), "{}", report.details());
    let clean = Report::new(&plan, "", &run(&plan, &Builtin, &|_| ()), &Terms::default(), 0.0);
    let bias = |report: &Report| -> Vec<String> {
        let of = report.checks.iter().filter(|c| c.property == Property::Bias);
        of.map(|c| c.evidence.clone()).collect()
    };
    assert_ne!(bias(&report), bias(&clean), "the noise is there all the same");
}

#[test]
fn time_is_judged_where_a_limit_is_set() {
    let code = |limit: &str| gate(&["--samples", "2", "--median-time", limit]).status.code();
    // No problem takes a nanosecond, and none ten minutes.
    assert_eq!((code("1e-9"), code("600")), (Some(1), Some(0)));
}

#[test]
fn the_page_of_planted_faults_quotes_the_committed_table() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let measured = Measured::read(&root.join("golden/gate-power")).expect("committed tables");
    assert_eq!(measured.wrong(), Vec::<&str>::new());
    let page = std::fs::read_to_string(root.join("adapters/POWER.md")).expect("the page");
    let quoted = page
        .split_once("<!-- begin gate-power -->\n")
        .and_then(|(_, rest)| rest.split_once("<!-- end gate-power -->"));
    assert_eq!(
        quoted.expect("the two marks").0,
        measured.to_markdown(),
        "put there what `calibench gate power-table golden/gate-power` prints"
    );
}

#[test]
fn the_same_seed_gives_the_same_problems_and_another_does_not() {
    let lines = |seed: u64| -> Vec<String> {
        let plan = Plan::new(seed, 1).expect("a plan");
        plan.cases.iter().map(|case| plan.problem(case).to_line()).collect()
    };
    assert_eq!(lines(5), lines(5));
    assert_ne!(lines(5), lines(6));
}

#[test]
fn the_schemas_know_every_field_that_is_sent() {
    let [_, (_, problem), (_, answer)] = schemas();
    let fields = |schema: &str| -> Vec<String> {
        let schema: serde_json::Value = serde_json::from_str(schema).expect("JSON");
        schema["properties"].as_object().expect("an object").keys().cloned().collect()
    };
    let problem_line: serde_json::Value = serde_json::from_str(&problems(1)[0].to_line()).expect("JSON");
    assert!(problem_line.as_object().expect("an object").keys().all(|key| fields(problem).contains(key)));
    let given = Builtin.ask(&problems(1)[0]).expect("an answer");
    let given = serde_json::to_value(given).expect("JSON");
    assert!(given.as_object().expect("an object").keys().all(|key| fields(answer).contains(key)));
}

fn judged(fault: &str, samples: usize) -> Report {
    let fault = planted().into_iter().find(|f| f.id == fault).expect("the fault");
    let plan = Plan::new(1, samples).expect("a plan");
    Report::new(&plan, "", &run(&plan, &Faulty::new(fault), &|_| ()), &Terms::default(), 0.0)
}

fn verdicts(report: &Report, property: Property) -> Vec<Verdict> {
    report.checks.iter().filter(|c| c.property == property).map(|c| c.verdict).collect()
}

#[test]
fn warnings_count_for_nothing_where_good_data_bring_them_too() {
    let report = judged("warns-of-everything", 16);
    assert!(verdicts(&report, Property::Specificity).contains(&Verdict::Failed), "{}", report.details());
    assert!(verdicts(&report, Property::Degenerate).contains(&Verdict::Grave), "{}", report.details());
}

#[test]
fn a_solver_that_never_answers_holds_nothing_but_the_protocol() {
    let report = judged("refuses-everything", 16);
    let held: Vec<Property> =
        report.checks.iter().filter(|c| c.verdict == Verdict::Held).map(|c| c.property).collect();
    assert!(held.iter().all(|p| *p == Property::Protocol), "{held:?}");
    assert!(verdicts(&report, Property::Convergence).iter().all(|v| *v == Verdict::Failed));
}

#[test]
fn a_matrix_that_is_no_covariance_and_lost_correlations_are_findings_of_a_quick_run() {
    for fault in ["covariance-of-one-triangle", "covariance-not-definite", "covariance-in-another-order"] {
        let report = judged(fault, 1);
        assert!(verdicts(&report, Property::CovarianceForm).contains(&Verdict::Failed), "{fault}");
    }
    let report = judged("correlations-dropped", 1);
    assert!(verdicts(&report, Property::Covariance).contains(&Verdict::Failed), "{}", report.details());
    assert!(!verdicts(&report, Property::CovarianceForm).contains(&Verdict::Failed), "{}", report.details());
}

#[test]
fn views_that_see_different_marks_show_who_reads_them_as_a_table() {
    let report = judged("views-cut-to-the-shortest", 16);
    let scenes: BTreeSet<&str> = report.failures().iter().map(|check| check.scenario).collect();
    // Everywhere else all views see as many marks.
    assert_eq!(scenes, BTreeSet::from(["marks-missing", "over-the-edge"]), "{}", report.details());
}

#[test]
fn pose_covariances_are_judged_by_their_form_unit_axes_and_what_they_leave_out() {
    let of = |id: &str| {
        let fault = planted().into_iter().find(|f| f.id == id).expect("the fault");
        let scenes = ["four-pose", "marks-missing", "poses-anew"].map(String::from).to_vec();
        let plan = Plan::of(1, 32, Asked { scenes, ..Asked::default() }).expect("a plan");
        Report::new(&plan, "", &run(&plan, &Faulty::new(fault), &|_| ()), &Terms::default(), 0.0)
    };
    for id in ["of-a-known-camera", "in-degrees", "about-the-target"] {
        let report = of(&format!("pose-covariance-{id}"));
        let failed: BTreeSet<&str> = report.failures().iter().map(|check| check.property.name()).collect();
        assert_eq!(failed, BTreeSet::from(["pose-covariance"]), "{id}: {}", report.details());
        assert_eq!(report.failures().len(), 3, "{id}: {}", report.details());
    }
    assert!(!verdicts(&of("last-bits"), Property::PoseCovariance).contains(&Verdict::NotJudged));
    // One triangle only.
    struct OneTriangle;
    impl Solver for OneTriangle {
        fn name(&self) -> String {
            "a solver".into()
        }
        fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
            let mut answer = Builtin.ask(problem)?;
            for row in answer.pose_covariances.iter_mut().flatten().flat_map(|m| m.iter_mut().enumerate()) {
                row.1[..row.0].fill(0.0);
            }
            Ok(answer)
        }
    }
    let plan =
        Plan::of(1, 2, Asked { scenes: vec!["four-pose".into()], ..Asked::default() }).expect("a plan");
    let report = Report::new(&plan, "", &run(&plan, &OneTriangle, &|_| ()), &Terms::default(), 0.0);
    assert!(
        report.details().contains(
            "pose-covariance / four-pose: 2 of 2 answers have a pose covariance that is not symmetric"
        ),
        "{}",
        report.details()
    );
}

#[test]
fn a_change_of_what_is_stated_is_a_change() {
    let doubled = gate(&["--samples", "64", "--against", "builtin", "--planted", "covariance-doubled"]);
    let text = String::from_utf8_lossy(&doubled.stdout).into_owned();
    assert!(
        text.lines().any(|l| l.starts_with("four-pose") && l.contains(" 2.000 ") && l.contains("MOVED")),
        "{text}"
    );
}

#[test]
fn what_is_not_supported_is_named_and_not_judged_but_not_everything_can_be() {
    struct Without(&'static str);
    impl Solver for Without {
        fn name(&self) -> String {
            "a solver".into()
        }
        fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
            let unknown = problem.free.iter().any(|name| name == self.0);
            let unsupported = || Answer::without_estimate(&problem.id, Status::Unsupported, "not known here");
            if unknown { Ok(unsupported()) } else { Builtin.ask(problem) }
        }
    }
    let plan = Plan::new(1, 16).expect("a plan");
    let report = |name| Report::new(&plan, "", &run(&plan, &Without(name), &|_| ()), &Terms::default(), 0.0);
    let skewless = report("skew");
    assert!(skewless.held(), "{}", skewless.details());
    assert!(skewless.conclusion().contains("not supported: skew-and-k3"), "{}", skewless.conclusion());
    // fx is free in all good scenes.
    assert!(!report("fx").held());
}

#[test]
fn what_is_known_stands_in_a_file_with_its_reason() {
    let dir = folder("gate-allowances");
    std::fs::create_dir_all(&dir).expect("a folder");
    let path = dir.join("known.toml");
    let name = path.display().to_string();
    let allowed = |text: &str| {
        std::fs::write(&path, text).expect("written");
        let planted = ["--planted", "rounded-to-f32", "--samples", "1", "--allow", &name];
        let output = gate(&planted);
        (
            output.status.code(),
            [output.stdout, output.stderr].map(|o| String::from_utf8_lossy(&o).into_owned()).concat(),
        )
    };
    let single = "[[allow]]\nproperty = 'exactness'\nlimit_px = 1e-4\nreason = 'single precision'\n";
    let (code, text) = allowed(single);
    assert_eq!(code, Some(0), "{text}");
    assert!(
        text.contains("TRUSTED: every check that could be judged holds, with one stated allowance;"),
        "{text}"
    );
    assert!(
        text.contains("allowed: exactness up to 0.0001 px: single precision (needed by four-pose, "),
        "{text}"
    );
    let idle =
        format!("{single}[[allow]]\nproperty = 'degenerate'\nscenes = ['one-view']\nreason = 'none'\n");
    let (code, text) = allowed(&idle);
    assert!(code == Some(0) && text.contains("NOTHING NEEDS IT; not needed by one-view"), "{text}");
    // Too small a limit covers nothing.
    assert_eq!(allowed(&single.replace("1e-4", "1e-9")).0, Some(1));
    let (code, text) = allowed(&single.replace("limit_px", "limit"));
    assert!(code == Some(2) && text.contains("line 3: unknown field `limit`"), "{text}");
}

#[test]
fn the_allowances_of_the_adapters_can_be_read() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("adapters");
    for name in ["opencv.allow.toml", "opencv_lenses.allow.toml"] {
        let allowances = calibench_gate::Allowance::read(&root.join(name)).expect("allowances");
        assert!(!allowances.is_empty(), "{name}");
    }
}
