//! Do studies say what is true? Against the Cramer-Rao bound, against theory, and of designs that must fail.

use calibench::evaluate::interval::each_of;
use calibench_study::plan::{Attempt, Goal, Outcome, Search, attempt, next_views, ranked, search};
use calibench_study::{Spec, SpecError, in_memory, summarise};

/// Rate at which each test of this file may fail a correct program.
const FALSE_ALARM: f64 = 1e-5;

fn spec(poses: &str, rest: &str) -> String {
    format!(
        r#"
name = "test"
question = "Is it so?"
seed = 5
confidence = 0.95
scene.image = [640, 480]
scene.camera = {{ fx = 600.0, fy = 600.0, cx = 326.0, cy = 243.0, k1 = -0.18, k2 = 0.05 }}
scene.target = {{ columns = 9, rows = 7, spacing_mm = 10.0 }}
scene.poses = {poses}
scene.noise_px = 0.1
{rest}
"#
    )
}

#[test]
fn the_chapters_views_attain_the_bound_and_the_predicted_rmse() {
    let text = spec("{ kind = \"chapter\" }", "trials = { per_cell = 2000 }");
    let mut spec = Spec::parse(&text).unwrap();
    let quantities = 9; // rmse, nees, six parameters, depth
    spec.confidence = 1.0 - each_of(2 * quantities, FALSE_ALARM);
    let engine = in_memory(spec, &text, |_| {}).unwrap();
    let summary = summarise(&engine);
    let cell = &summary.cells[0];
    assert_eq!(cell.converged().unwrap().value, 1.0);
    assert_eq!(cell.statistics.len(), quantities);
    for s in &cell.statistics {
        let (name, predicted) = (s.quantity.name(), s.predicted.unwrap());
        let (mean, ratio) = (s.mean.unwrap(), s.ratio.unwrap());
        // First-order theory leaves a bias of the order of the noise over the focal length times the sd: 2 %
        // of it covers k2's.
        let slack = 0.02 * predicted.sd;
        assert!(
            mean.low - slack <= predicted.mean && predicted.mean <= mean.high + slack,
            "{name}: mean {mean:?} {predicted:?}"
        );
        assert!(ratio.low <= 1.02 && ratio.high >= 0.98, "{name}: sd / bound {ratio:?}");
    }
}

#[test]
fn a_measured_length_scatters_as_predicted() {
    let poses = r#"{ kind = "spread", views = 6, tilt_deg = 25.0, coverage = 0.7, distance_mm = 160.0 }"#;
    let length =
        "scene.length = { centre_mm = [30.0, -20.0, 160.0], length_mm = 25.0, direction_deg = 30.0 }";
    let text = spec(poses, &format!("{length}\ntrials = {{ per_cell = 1000 }}"));
    let mut spec = Spec::parse(&text).unwrap();
    spec.confidence = 1.0 - FALSE_ALARM;
    let summary = summarise(&in_memory(spec, &text, |_| {}).unwrap());
    let statistic = summary.cells[0].of("length").unwrap();
    let ratio = statistic.ratio.unwrap();
    assert!(ratio.contains(1.0), "{ratio:?}");
    assert!(statistic.mean.unwrap().contains(0.0));
}

#[test]
fn facing_views_are_counted_as_refused_and_predict_nothing() {
    let poses = r#"{ kind = "spread", views = 3, tilt_deg = 0.0, distance_mm = 120.0 }"#;
    let text = spec(poses, "trials = { per_cell = 20, batch = 20 }");
    let engine = in_memory(Spec::parse(&text).unwrap(), &text, |_| {}).unwrap();
    let summary = summarise(&engine);
    let cell = &summary.cells[0];
    let refused = cell.outcomes.iter().find(|o| o.0 == "refused-not-identifiable").unwrap();
    assert_eq!((refused.1, cell.trials), (20, 20));
    assert_eq!(cell.converged().unwrap().value, 0.0);
    assert_eq!(cell.of("fx").unwrap().count, 0);
}

#[test]
fn common_random_numbers_pair_cells_exactly() {
    // Half the noise from the same draws gives, to first order, half the error: the ratio of the spreads is 2
    // to far better than independent draws could tell.
    let factor = "[[factor]]\nname = \"noise\"\nset = [\"scene.noise_px\"]\nlevels = [0.01, 0.02]";
    let text = spec("{ kind = \"chapter\" }", &format!("trials = {{ per_cell = 40, batch = 40 }}\n{factor}"));
    let sd = |text: &str| {
        let summary = summarise(&in_memory(Spec::parse(text).unwrap(), text, |_| {}).unwrap());
        summary.cells[1].of("fx").unwrap().sd.unwrap().value
            / summary.cells[0].of("fx").unwrap().sd.unwrap().value
    };
    let paired = sd(&text);
    // Second order: relative 1e-2 of the noise over that of 1 px, at sd of 0.1 px of 600: 1e-3 is ample.
    assert!((paired - 2.0).abs() < 2e-3, "{paired}");
    let unpaired = sd(&text.replace("seed = 5", "seed = 5\ncommon_random_numbers = false"));
    assert!((unpaired - 2.0).abs() > 2e-3, "{unpaired}");
}

#[test]
fn a_robust_loss_withstands_gross_errors() {
    let factor = "[[factor]]\nname = \"loss\"\nset = [\"estimator.loss\"]\n\
                  levels = [{ kind = \"squares\" }, { kind = \"cauchy\", scale_px = 0.2 }]";
    let text = spec(
        "{ kind = \"chapter\" }",
        &format!(
            "scene.outlier_share = 0.05\nscene.outlier_px = 5.0\ntrials = {{ per_cell = 200, batch = 100 }}\n{factor}"
        ),
    );
    let summary = summarise(&in_memory(Spec::parse(&text).unwrap(), &text, |_| {}).unwrap());
    let sd = |cell: usize| summary.cells[cell].of("fx").unwrap().sd.unwrap();
    // Noise variance 0.01 px^2 against 5 % of 25/3: least squares loses a factor of 6.5; the robust loss
    // stays within 2.
    assert!(sd(0).low > 3.0 * sd(1).high, "{:?} {:?}", sd(0), sd(1));
}

#[test]
fn a_robust_loss_knows_its_own_spread() {
    let factor = "[[factor]]\nname = \"loss\"\nset = [\"estimator.loss\"]\n\
                  levels = [{ kind = \"huber\", delta_px = 0.15 }, { kind = \"cauchy\", scale_px = 0.2 }]";
    let text = spec("{ kind = \"chapter\" }", &format!("trials = {{ per_cell = 1000 }}\n{factor}"));
    let mut spec = Spec::parse(&text).unwrap();
    spec.confidence = 1.0 - each_of(2, FALSE_ALARM);
    let summary = summarise(&in_memory(spec, &text, |_| {}).unwrap());
    for cell in &summary.cells {
        let nees = cell.of("nees").unwrap();
        let (mean, expected) = (nees.mean.unwrap(), nees.predicted.unwrap().mean);
        // The correction is asymptotic: its own terms of the next order are p / (2N - p), 30 of 474, or 6 %.
        assert!(
            mean.low < 1.06 * expected && mean.high > 0.94 * expected,
            "{}: {mean:?} {expected}",
            cell.name
        );
    }
}

fn wish(quantity: &str, sd: f64) -> Goal {
    Goal { quantity: quantity.to_string(), sd }
}

#[test]
fn a_plan_finds_the_fewest_views_and_trials_confirm_it() {
    let text = spec("{ kind = \"chapter\" }", "trials = { per_cell = 100 }");
    let mut spec = Spec::parse(&text).unwrap();
    let goals = [wish("fx", 0.4)];
    let range =
        Search { tilts_deg: vec![0.0, 10.0, 30.0], coverages: vec![0.5], most_views: 60, distance_mm: 160.0 };
    let designs = search(&spec, &goals, &range).unwrap();
    assert_eq!(designs[0].enough, None, "views that face the camera never suffice");
    let (views, chosen) = ranked(&designs, &goals)[0];
    assert_eq!(chosen.tilt_deg, 30.0);
    let (enough, sds) = chosen.enough.clone().unwrap();
    assert!(sds[0] <= 0.4 && views == enough);
    let fewer = Search { most_views: views - 1, ..range.clone() };
    assert_eq!(search(&spec, &goals, &fewer).unwrap()[2].enough, None, "one view less does not suffice");
    spec.confidence = 1.0 - FALSE_ALARM;
    let tried = attempt(&spec, &goals, (views, chosen), 160.0, 300, |_| {}).unwrap();
    assert!(tried.findings[0].ratio.contains(1.0), "{tried:?}");
}

#[test]
fn several_wishes_take_the_most_views_that_one_of_them_needs() {
    let text = spec("{ kind = \"chapter\" }", "trials = { per_cell = 100 }");
    let spec = Spec::parse(&text).unwrap();
    let range = Search { tilts_deg: vec![30.0], coverages: vec![0.5], most_views: 60, distance_mm: 160.0 };
    let views = |goals: &[Goal]| search(&spec, goals, &range).unwrap()[0].enough.clone().unwrap().0;
    let (fx, cx) = (wish("fx", 0.4), wish("cx", 0.15));
    let one = std::slice::from_ref;
    let (of_fx, of_cx) = (views(one(&fx)), views(one(&cx)));
    assert_ne!(of_fx, of_cx);
    assert_eq!(views(&[fx.clone(), cx]), of_fx.max(of_cx));
    let twice = search(&spec, &[fx.clone(), fx], &range).unwrap_err().to_string();
    assert!(twice.contains("`fx` is wanted twice"), "{twice}");
}

/// A wish that the bound of some number of views meets to a hair: trials cannot confirm that number, and are
/// asked for more until they do.
#[test]
fn a_number_of_views_that_is_too_near_the_wish_is_followed_by_a_larger_one_that_is_confirmed() {
    let text = spec("{ kind = \"chapter\" }", "trials = { per_cell = 100 }");
    let spec = Spec::parse(&text).unwrap();
    let range = Search { tilts_deg: vec![30.0], coverages: vec![0.5], most_views: 60, distance_mm: 160.0 };
    let twelve = Search { most_views: 12, ..range.clone() };
    let of_twelve = search(&spec, &[wish("fx", 1e-3)], &twelve).unwrap()[0].best.clone().unwrap().unwrap()[0];
    let goals = [wish("fx", 1.0001 * of_twelve)];
    let designs = search(&spec, &goals, &range).unwrap();
    let (views, design) = ranked(&designs, &goals)[0];
    assert_eq!(views, 12);
    let mut tried = vec![attempt(&spec, &goals, (12, design), 160.0, 200, |_| {}).unwrap()];
    // Trials know the spread to a tenth: a wish that is met to a hair lies within.
    assert_eq!(tried[0].outcome(), Outcome::Undecided, "{tried:?}");
    assert!(tried[0].findings[0].deciding_trials.is_none_or(|trials| trials > 200));
    while let Some(views) = next_views(&spec, &goals, (tried.last().unwrap(), design), &range).unwrap() {
        assert!(views > tried.last().unwrap().views && views <= 60);
        tried.push(attempt(&spec, &goals, (views, design), 160.0, 200, |_| {}).unwrap());
        if tried.last().unwrap().outcome() == Outcome::Confirmed {
            break;
        }
    }
    let last = tried.last().unwrap();
    assert_eq!(last.outcome(), Outcome::Confirmed, "{tried:?}");
    assert!(last.findings[0].sd.high <= goals[0].sd);
    // Beyond the most views there are none, and an attempt of which nothing converged asks for twice as many.
    let most = Search { most_views: last.views, ..range.clone() };
    assert_eq!(next_views(&spec, &goals, (last, design), &most).unwrap(), None);
    let nothing = Attempt { findings: Vec::new(), views: 7, ..last.clone() };
    assert_eq!(next_views(&spec, &goals, (&nothing, design), &range).unwrap(), Some(14));
}

#[test]
fn a_wrong_file_is_refused_with_place_and_reason() {
    let good = spec("{ kind = \"chapter\" }", "trials = { per_cell = 100 }");
    let refuse = |text: &str| match Spec::parse(text).and_then(|s| s.cells(text)) {
        Err(error) => error,
        Ok(_) => panic!("accepted: {text}"),
    };
    let error = refuse(&good.replace("scene.noise_px", "scene.noise"));
    assert!(matches!(error, SpecError::Toml { line: 10, .. }), "{error}");
    let error = refuse(&good.replace("\"chapter\"", "\"book\""));
    assert!(
        matches!(error, SpecError::Toml { line: 9, .. }) && error.to_string().contains("spread"),
        "{error}"
    );
    let error = refuse(&good.replace("noise_px = 0.1", "noise_px = -0.1"));
    assert!(matches!(error, SpecError::Value { field: "scene.noise_px", .. }), "{error}");
    let factor = |set: &str, levels: &str| {
        format!("{good}\n[[factor]]\nname = \"f\"\nset = [{set}]\nlevels = {levels}\n")
    };
    let error = refuse(&factor("\"scene.poses.view\"", "[1]"));
    assert!(matches!(error, SpecError::Factor { line: 16, column: 11, .. }), "{error}");
    let error = refuse(&factor("\"scene.lens.k1\"", "[1.0]"));
    assert!(error.to_string().contains("no table `lens`"), "{error}");
    let error = refuse(&factor("\"scene.camera.k1\", \"scene.camera.k2\"", "[[0.1, 0.2], [0.3]]"));
    assert!(error.to_string().contains("list of 2 values"), "{error}");
    let error = refuse(&factor("\"scene.camera.k1\"", "[]"));
    assert!(matches!(error, SpecError::Factor { line: 16, column: 10, .. }), "{error}");
    let error = refuse(&good.replace("per_cell = 100", "per_cell = 1.5"));
    assert!(error.to_string().contains("number `1.5`, expected a whole number from 0"), "{error}");
    let error = refuse(&good.replace("noise_px = 0.1", "noise_px = true"));
    assert!(error.to_string().contains("expected a number"), "{error}");
    let error = refuse(&good.replace(
        "per_cell = 100",
        "per_cell = 100, precision = { quantity = \"k3\", relative_half_width = 0.1 }",
    ));
    assert!(matches!(error, SpecError::Precision { .. }), "{error}");
}

#[test]
fn the_studies_that_ship_can_be_run() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("studies");
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "toml") {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        let mut spec = Spec::parse(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        assert_eq!(Some(spec.name.as_str()), path.file_stem().and_then(|s| s.to_str()));
        spec.trials.per_cell = 2;
        spec.trials.precision = None;
        let engine = in_memory(spec, &text, |_| {}).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let converged: u64 = engine.tallies.iter().map(|t| t.converged()).sum();
        assert!(converged > 0, "{}", path.display());
        count += 1;
    }
    assert!(count >= 7, "{count}");
}

#[test]
fn intervals_that_hold_together_are_those_of_a_share_of_the_rate() {
    let poses = r#"{ kind = "spread", views = 4, tilt_deg = 25.0, distance_mm = 160.0 }"#;
    let factor = r#"factor = [{ name = "views", set = ["scene.poses.views"], levels = [3, 5] }]"#;
    let text = spec(poses, &format!("trials = {{ per_cell = 200 }}\n{factor}"));
    let summary = |confidence: f64| {
        let mut spec = Spec::parse(&text).unwrap();
        spec.confidence = confidence;
        summarise(&in_memory(spec, &text, |_| {}).unwrap())
    };
    let usual = summary(0.95);
    let statistics = || usual.cells.iter().flat_map(|cell| &cell.statistics);
    // Two cells, each with rmse, nees, six parameters and depth.
    assert_eq!(statistics().filter(|s| s.ratio_jointly.is_some()).count(), 18);
    let shared = summary(1.0 - 0.05 / 18.0);
    for (one, other) in statistics().zip(shared.cells.iter().flat_map(|cell| &cell.statistics)) {
        let (jointly, alone) = (one.ratio_jointly.unwrap(), other.ratio.unwrap());
        assert!((jointly.low - alone.low).abs() < 1e-9 && (jointly.high - alone.high).abs() < 1e-9);
        assert!(jointly.low < one.ratio.unwrap().low && jointly.high > one.ratio.unwrap().high);
    }
}
