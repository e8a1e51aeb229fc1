//! Does `calibench study plan` tell what is confirmed, what is refuted and what is open apart, in text, JSON
//! and exit code?

use crate::program::{calibench as run, folder, text};
use serde_json::Value;
use std::fs;

/// A study of which a plan takes camera, target and noise.
fn spec(rest: &str) -> String {
    format!(
        "name = \"plan\"\nquestion = \"How many views?\"\nseed = 3\ntrials = {{ per_cell = 100 }}\n[scene]\nimage = [640, 480]\n\
         camera = {{ fx = 600.0, fy = 600.0, cx = 326.0, cy = 243.0, k1 = -0.18, k2 = 0.05 }}\n\
         target = {{ columns = 9, rows = 7, spacing_mm = 10.0 }}\nposes = {{ kind = \"chapter\" }}\nnoise_px = 0.1\n{rest}\n"
    )
}

const DESIGN: [&str; 6] = ["--tilt", "30", "--coverage", "0.5", "--confirm", "200"];

/// Exit code, and the plan as JSON and as text.
fn plan(folder: &std::path::Path, arguments: &[&str]) -> (Option<i32>, Value, String) {
    let all = [&["study", "plan", "spec.toml"], arguments, &DESIGN].concat();
    let json = run(folder, &[&all[..], &["--format", "json"]].concat());
    let people = run(folder, &all);
    assert_eq!(json.status.code(), people.status.code(), "{}", text(&people.stderr));
    let value = serde_json::from_slice(&json.stdout)
        .unwrap_or_else(|error| panic!("{error}: {}", text(&json.stderr)));
    (people.status.code(), value, text(&people.stdout))
}

#[test]
fn what_is_confirmed_refuted_open_and_out_of_reach_is_told_apart() {
    let folder = folder("plan-outcomes");
    fs::write(folder.join("spec.toml"), spec("")).expect("written");
    let (code, far, said) = plan(&folder, &["--want", "fx=0.001", "--most-views", "9"]);
    assert_eq!(
        (code, &far["outcome"], &far["attempts"]),
        (Some(1), &"not-reached".into(), &Value::Array(vec![]))
    );
    assert!(said.contains("NOT REACHED by any design"), "{said}");
    // What nine views reach by the bound, to a hair.
    let bound = far["designs"][0]["predicted_sd"]["fx"].as_f64().expect("predicted");
    let want = format!("fx={}", 1.0001 * bound);
    let (code, open, said) = plan(&folder, &["--want", &want, "--most-views", "9"]);
    assert_eq!(
        (code, &open["outcome"], &open["confirmed_views"]),
        (Some(3), &"undecided".into(), &Value::Null),
        "{said}"
    );
    assert_eq!(open["attempts"].as_array().expect("attempts").len(), 1);
    let trials = open["deciding_trials"].as_u64();
    assert!(
        trials.is_none_or(|trials| trials > 200 && said.contains(&format!("About {trials} trials"))),
        "{said}"
    );
    assert!(said.contains("UNDECIDED with 9 views, the most"), "{said}");
    // The same wish with more views allowed.
    let (code, more, said) = plan(&folder, &["--want", &want, "--want", "cx=1"]);
    let attempts = more["attempts"].as_array().expect("attempts");
    assert_eq!((code, &more["outcome"]), (Some(0), &"confirmed".into()), "{said}");
    assert!(attempts.len() > 1 && attempts[0]["views"] == 9, "{more:#}");
    let last = attempts.last().expect("one");
    assert_eq!(last["views"], more["confirmed_views"]);
    for quantity in last["quantities"].as_array().expect("two") {
        assert!(quantity["sd"]["high"].as_f64() <= quantity["wanted_sd"].as_f64(), "{quantity:#}");
    }
    for attempt in attempts {
        assert!(
            said.contains(&format!("{} views, tilt 30 deg, coverage 0.5: 200 trials", attempt["views"])),
            "{said}"
        );
    }
    assert!(said.contains(&format!("CONFIRMED: {} views", more["confirmed_views"])), "{said}");
}

/// By the bound one view at 30 degrees and two at 2 degrees know fx to 100 px. No trial of one view has an
/// answer, and of two at 2 degrees a third.
#[test]
fn a_design_that_is_not_answered_gives_way_to_others() {
    let folder = folder("plan-unanswered");
    fs::write(folder.join("spec.toml"), spec("")).expect("written");
    let arguments = ["study", "plan", "spec.toml", "--want", "fx=100", "--tilt", "2,30", "--coverage", "0"];
    let output = run(&folder, &[&arguments[..], &["--confirm", "100", "--format", "json"]].concat());
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let attempts = found["attempts"].as_array().expect("attempts");
    assert_eq!((&attempts[0]["tilt_deg"], &attempts[0]["views"]), (&30.0.into(), &1.into()), "{found:#}");
    assert_eq!(attempts[0]["outcome"], "refuted", "{found:#}");
    let by_views: Vec<_> = attempts.iter().map(|attempt| attempt["views"].as_u64()).collect();
    assert!(by_views.is_sorted(), "fewest views first: {found:#}");
    let last = attempts.last().expect("one");
    for attempt in attempts {
        let is_answered = attempt["converged"].as_f64() >= Some(0.95);
        assert_eq!(attempt["quantities"].as_array().is_some_and(|q| !q.is_empty()), is_answered, "{found:#}");
    }
    assert_eq!((output.status.code(), &found["outcome"]), (Some(0), &"confirmed".into()), "{found:#}");
    assert_eq!(found["chosen"]["tilt_deg"], last["tilt_deg"], "{found:#}");
}

/// A board that bulges by half a millimetre makes the focal length wrong by 8 px, however many views there
/// are.
#[test]
fn a_mean_error_larger_than_the_wish_is_refuted_with_the_most_views() {
    let folder = folder("plan-bias");
    fs::write(folder.join("spec.toml"), spec("bow_mm = 0.5")).expect("written");
    let (code, found, said) = plan(&folder, &["--want", "fx=1", "--most-views", "20"]);
    assert_eq!((code, &found["outcome"]), (Some(1), &"refuted".into()), "{said}");
    let attempts = found["attempts"].as_array().expect("attempts");
    let mean_error = |attempt: &serde_json::Value| attempt["quantities"][0]["mean_error"]["high"].as_f64();
    assert!(attempts.len() == 2 && attempts.iter().all(|attempt| mean_error(attempt) < Some(-1.0)), "{said}");
    assert_eq!(attempts[1]["views"], 20);
    assert!(
        said.contains("REFUTED with 20 views, the most: the mean error is larger")
            && said.contains(", mean error -"),
        "{said}"
    );
}

#[test]
fn another_lens_than_the_cameras_cannot_be_planned_for() {
    let folder = folder("plan-model");
    fs::write(folder.join("spec.toml"), spec("[estimator]\nmodel = \"division\"")).expect("written");
    let output = run(&folder, &["study", "plan", "spec.toml", "--want", "fx=1"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output.stderr).contains("the estimator's lens model is not the camera's"),
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn factors_are_left_out_with_a_word() {
    let folder = folder("plan-factors");
    let factor = "[[factor]]\nname = \"noise\"\nset = [\"scene.noise_px\"]\nlevels = [0.1, 0.2]";
    fs::write(folder.join("spec.toml"), spec(factor)).expect("written");
    let wish = ["study", "plan", "spec.toml", "--want", "fx=0.5"];
    let output = run(&folder, &[&wish[..], &DESIGN].concat());
    assert!(text(&output.stderr).contains("factors are left out of the plan"), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains(": noise"), "{}", text(&output.stderr));
}

/// Least squares with gross errors do not keep the bound, which knows none.
#[test]
fn an_estimator_that_does_not_keep_the_bound_is_refuted() {
    let folder = folder("plan-refuted");
    fs::write(folder.join("spec.toml"), spec("outlier_share = 0.05\noutlier_px = 10.0")).expect("written");
    let (code, found, said) = plan(&folder, &["--want", "fx=0.5", "--most-views", "20"]);
    assert_eq!((code, &found["outcome"]), (Some(1), &"refuted".into()), "{said}");
    let attempts = found["attempts"].as_array().expect("attempts");
    let low = attempts[0]["quantities"][0]["sd"]["low"].as_f64();
    assert!(low > Some(0.5) && attempts.last().expect("one")["views"] == 20, "{found:#}");
    assert!(said.contains("REFUTED with 20 views, the most"), "{said}");
}

#[test]
fn wishes_that_cannot_be_are_wrong_usage() {
    let folder = folder("plan-usage");
    fs::write(folder.join("spec.toml"), spec("")).expect("written");
    for (wishes, words) in [
        (&["--want", "fx=1", "--want", "fx=2"][..], "`fx` is wanted twice"),
        (&["--want", "fx=0"], "positive"),
        (&["--want", "rmse=1"], "a plan cannot be made for `rmse`"),
        (&["--want", "fx"], "QUANTITY=SD"),
        (&["--want", "fx=1", "--distance", "16"], "no tilt and coverage shows the whole target"),
        (&["--want", "fx=1", "--at", "0,0,160", "--length", "20"], "are for --want length"),
        (&[], "--want"),
    ] {
        let output = run(&folder, &[&["study", "plan", "spec.toml"], wishes].concat());
        assert_eq!(output.status.code(), Some(2), "{wishes:?}");
        assert!(text(&output.stderr).contains(words), "{wishes:?}: {}", text(&output.stderr));
    }
}
