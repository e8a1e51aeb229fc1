//! Do studies take marks and poses of the user's own, write out those that they used, and give the same bits
//! from them?

use crate::study::{SPEC, assert_same, scratch};
use calibench::calibrate::{Settings, calibrate};
use calibench::synth::{Departure, Scene, Stream, StreamKey, Truth};
use calibench_experiments::build;
use calibench_study::{
    Engine, Estimated, Inputs, Manifest, Shard, Spec, SpecError, Summary, in_memory, run_trial, summarise,
};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Own marks against a grid, whose noise neighbours may share, own poses against drawn ones, in nine cells
/// that draw noise of their own.
const OWN: &str = r#"
name = "own"
question = "Do files give what they hold?"
seed = 5
common_random_numbers = false
measure = ["frame"]
trials = { per_cell = 6, batch = 4 }

[scene]
image = [640, 480]
camera = { fx = 600.0, fy = 600.0, cx = 326.0, cy = 243.0, k1 = -0.18, k2 = 0.05 }
target = { columns = 9, rows = 7, spacing_mm = 10.0 }
poses = { kind = "chapter" }
noise_px = 0.1

[[factor]]
name = "target"
set = ["scene.target", "scene.bow_mm", "scene.noise_correlation"]
levels = [
    [{ file = "data/marks.csv" }, 0.2, 0.0],
    [{ columns = 7, rows = 5, spacing_mm = 10.0 }, 0.0, 0.0],
    [{ columns = 7, rows = 5, spacing_mm = 10.0 }, 0.0, 0.6],
]
labels = ["own", "grid", "shared"]

[[factor]]
name = "poses"
set = ["scene.poses"]
levels = [
    { kind = "file", file = "data/poses.csv" },
    { kind = "random", views = 4, tilt_deg = 30.0, distance_mm = 170.0 },
    { kind = "random", views = 4, tilt_deg = 30.0, distance_mm = 170.0, redraw = true },
]
labels = ["own", "drawn", "redrawn"]
"#;

const MARKS: &str = "name,X,Y,Z\na,-40,-30,0\nb,40,-30.5,0\nc,41,30,0\nd,-40,29,0\ne,3,0.1,0\nf,20,11,0\ng,-21,9,0\nh,17,-12,0\n";
const POSES: &str =
    "x,y,z,rx,ry,rz\n1.5,-2,170,0.3,0,0\n0,0,165,0,-0.4,0.1\n0,3,170,-0.3,0.2,0\n-2,0,180,0.2,0.4,1\n";

fn write_own(folder: &Path) {
    fs::create_dir_all(folder.join("data")).unwrap();
    fs::write(folder.join("own.toml"), OWN).unwrap();
    fs::write(folder.join("data/marks.csv"), MARKS).unwrap();
    fs::write(folder.join("data/poses.csv"), POSES).unwrap();
}

fn calibench(folder: &Path, line: &str) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.args(line.split_whitespace()).current_dir(folder).output().expect("the program starts")
}

fn done(folder: &Path, line: &str) -> String {
    let output = calibench(folder, line);
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The trials of a cell, without its number.
fn trials(path: &Path, cell: usize) -> Vec<String> {
    let text = fs::read_to_string(path.join("trials.csv")).unwrap();
    let first = format!("{cell},");
    text.lines().filter_map(|line| line.strip_prefix(&first)).map(String::from).collect()
}

#[test]
fn a_cell_that_is_run_again_from_what_it_used_gives_the_same_bits() {
    let folder = scratch("own-cells");
    write_own(&folder);
    done(&folder, "study run own.toml --out run");
    let poses = fs::read_to_string(folder.join("run/poses.csv")).unwrap();
    for redrawn in ["\n2,", "\n5,", "\n8,"] {
        assert!(!poses.contains(redrawn), "trials there draw poses of their own");
    }
    for cell in 0..9 {
        let spec = done(&folder, &format!("study cell run {cell}"));
        assert_eq!(spec.contains("redraw = true"), cell % 3 == 2, "{spec}");
        fs::write(folder.join("alone.toml"), spec).unwrap();
        done(&folder, &format!("study run alone.toml --out alone-{cell}"));
        let of_run = trials(&folder.join("run"), cell);
        assert_eq!(of_run.len(), 6);
        assert!(of_run.iter().all(|line| line.contains("converged")), "{of_run:?}");
        assert_eq!(of_run, trials(&folder.join(format!("alone-{cell}")), 0), "cell {cell}");
        let summary = |run: &str| fs::read_to_string(folder.join(run).join("summary.csv")).unwrap();
        let own =
            summary("run").lines().find(|line| line.starts_with(&format!("{cell},"))).unwrap().to_string();
        let again = summary(&format!("alone-{cell}"));
        assert_eq!(own.split_once(',').unwrap().1, again.lines().nth(1).unwrap().split_once(',').unwrap().1);
    }
    let refused = calibench(&folder, "study cell run 9");
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("the run has cells 0 to 8"));
    fs::write(folder.join("run/poses.csv"), poses.replacen("170", "171", 1)).unwrap();
    let refused = calibench(&folder, "study cell run 0");
    assert!(String::from_utf8_lossy(&refused.stderr).contains("poses.csv is damaged"));
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn the_content_of_a_file_counts_and_its_place_does_not() {
    let folder = scratch("own-place");
    write_own(&folder);
    done(&folder, "study run own.toml --out run");
    done(&folder, "study run own.toml --shard 0/2 --out part-0");
    // The same content under other names: the parts are of one study, and join.
    fs::create_dir(folder.join("moved")).unwrap();
    fs::rename(folder.join("data"), folder.join("moved/elsewhere")).unwrap();
    fs::write(folder.join("moved/own.toml"), OWN.replace("data/", "elsewhere/")).unwrap();
    done(&folder, "study run moved/own.toml --shard 1/2 --out part-1");
    done(&folder, "study merge part-0 part-1 --out joined");
    assert_same(&folder.join("run"), &folder.join("joined"));
    // A run keeps what it read.
    done(&folder, "study resume run");
    let commands = done(&folder, "study commands moved/own.toml --shards 2 --out parts");
    assert_eq!(commands.lines().count(), 2);
    // Another content is another study.
    fs::write(folder.join("moved/elsewhere/marks.csv"), MARKS.replace("-30.5", "-30.4")).unwrap();
    done(&folder, "study run moved/own.toml --shard 1/2 --out other");
    let refused = calibench(&folder, "study merge part-0 other --out none");
    assert_eq!(refused.status.code(), Some(2));
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(said.contains("spec.factor[0].levels[0][0].file: was \"sha256:"), "{said}");
    // A file of the run that was changed is seen.
    let kept = folder.join("part-0/inputs.json");
    fs::write(&kept, fs::read_to_string(&kept).unwrap().replace("-30.5", "-30.6")).unwrap();
    let refused = calibench(&folder, "study resume part-0");
    assert!(String::from_utf8_lossy(&refused.stderr).contains("inputs.json is damaged"));
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn files_that_cannot_be_used_are_refused_and_say_why() {
    let folder = scratch("own-refused");
    write_own(&folder);
    let refused = |file: &str, content: &str, what: &str| {
        let path = folder.join("data").join(file);
        let before = fs::read_to_string(&path).unwrap();
        fs::write(&path, content).unwrap();
        let output = calibench(&folder, "study run own.toml --out none");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(what), "{said}");
        assert!(!folder.join("none").exists(), "nothing is begun");
        fs::write(&path, before).unwrap();
    };
    refused("marks.csv", "X,Y\n1,2\n3\n", "data/marks.csv:3: 1 fields where the header has 2");
    refused("marks.csv", "X,Y\n1,2\n3,4\n5,7\n", "3 marks: a target needs 4");
    refused("marks.csv", "X,Y\n0,0\n1,2\n2,4\n4,8\n", "the marks lie on a line");
    refused("marks.csv", &MARKS.replace("17,-12,0", "17,-12,3"), "data/marks.csv:9: the mark has Z = 3");
    let far = format!("{MARKS}i,900,3,0\n");
    refused("marks.csv", &far, "mark 8 lies outside of the image in every view");
    let aside = POSES.replace("0,0,165", "0,50,165");
    refused("poses.csv", &aside, "view 1: mark 2 lies outside of the image");
    refused("poses.csv", &POSES.replace("rx,ry,rz", "a,b,c"), "the rotation is expected in one form");
    fs::remove_file(folder.join("data/poses.csv")).unwrap();
    let output = calibench(&folder, "study run own.toml --out none");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2));
    assert!(said.contains("own.toml: file `data/poses.csv`") && said.contains("No such file"), "{said}");
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_frame_that_the_lens_does_not_show_whole_is_told() {
    let folder = scratch("frame-part");
    write_own(&folder);
    let study = |fx: &str, k1: &str| {
        let text = OWN
            .split("[[factor]]")
            .next()
            .unwrap()
            .replace("fx = 600.0, fy = 600.0", &format!("fx = {fx}, fy = {fx}"));
        fs::write(
            folder.join("frame.toml"),
            text.replace("k1 = -0.18, k2 = 0.05", &format!("k1 = {k1}, k2 = 0.0")),
        )
        .unwrap();
        let output = calibench(&folder, &format!("study run frame.toml --out frame{k1}"));
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let said = study("300.0", "-0.35");
    assert!(said.contains("the lens shows 39 % of the frame"), "{said}");
    let said = study("600.0", "-0.18");
    assert!(!said.contains("of the frame"), "{said}");
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn targets_that_are_neither_grid_nor_file_are_refused() {
    let with = |target: &str| {
        let text = SPEC.replace("{ columns = 9, rows = 7, spacing_mm = 10.0 }", target);
        Spec::parse(&text).and_then(|spec| spec.cells(&text)).map(|_| ()).unwrap_err()
    };
    for (target, what) in [
        ("{ columns = 9, rows = 7 }", "missing field `spacing_mm`"),
        ("{ columns = 9, rows = 7, spacing_mm = 10.0, file = \"a.csv\" }", "not both"),
        ("{ columns = 9, rows = 7, spacing_mm = 10.0, cell = 3 }", "`cell` chooses"),
        ("{ file = \"a.csv\" }", "file `a.csv`: it was not read"),
    ] {
        let said = with(target).to_string();
        assert!(said.contains(what), "{said}");
    }
    let text = OWN.replace("labels = [\"own\", \"grid\", \"shared\"]", "");
    let unlabelled = Spec::parse(&text).and_then(|spec| spec.cells(&text)).unwrap_err();
    assert_eq!(unlabelled, SpecError::Unlabelled("target".to_string()));
}

#[test]
fn what_is_not_there_changes_no_manifest() {
    let plain = Spec::parse(SPEC).unwrap();
    let none = SPEC.replace("noise_px = 0.1\n", "noise_px = 0.1\nnoise_correlation = 0.0\nbow_mm = 0.0\n");
    assert_eq!(Spec::parse(&none).unwrap().canonical(), plain.canonical());
    let text = plain.canonical().to_string();
    assert!(!["correlation", "bow", "measure", "file"].iter().any(|word| text.contains(word)), "{text}");
    let manifest = serde_json::to_string(&Manifest::new(&plain, Shard::WHOLE, &build())).unwrap();
    assert!(!manifest.contains("inputs"), "{manifest}");
}

/// The chapter's views with further fields of the scene.
fn chapter(fields: &str, rest: &str) -> String {
    let poses = SPEC.lines().find(|line| line.starts_with("poses")).unwrap();
    let text = SPEC.replace(poses, "poses = { kind = \"chapter\" }");
    let text = text.replace("noise_px = 0.1\n", &format!("noise_px = 0.1\n{fields}\n"));
    let factor = text.find("[[factor]]").unwrap();
    let (study, _) = text.split_at(factor);
    study.replace("seed = 11", &format!("seed = 11\n{rest}"))
}

#[test]
fn a_trial_sees_noise_that_neighbours_share_on_a_board_that_is_bowed() {
    let text = chapter("noise_correlation = 0.6\nbow_mm = 0.3", "");
    let engine = Engine::new(&text, Shard::WHOLE).unwrap();
    let found = run_trial(&engine.cells[0], &engine.quantities, 4);
    let key = StreamKey { seed: 11, scenario: "study", trial: 4, purpose: "noise" };
    let departure = Departure { noise_correlation: 0.6, bow: 0.3 };
    let views = departure.observe(&Scene::example(), 9, 0.1, &mut Stream::open(key)).unwrap();
    let camera = calibrate(&views, &Settings::standard().with_image_size((640, 480))).unwrap().camera;
    let fx = engine.quantities.iter().position(|q| q.name() == "fx").unwrap();
    assert_eq!(found.values[fx], Some(camera.fx - Truth::example_camera().fx));
    for (fields, what) in [
        ("noise_correlation = 1.0", "from 0 to below 1"),
        ("bow_mm = 500.0", "every mark stays in front of the camera"),
    ] {
        let said = Engine::new(&chapter(fields, ""), Shard::WHOLE).unwrap_err().to_string();
        assert!(said.contains(what), "{said}");
    }
}

fn measured(text: &str, trials: u64) -> Summary {
    let mut spec = Spec::parse(text).unwrap();
    spec.trials.per_cell = trials;
    summarise(&in_memory(spec, text, |_| {}).unwrap())
}

#[test]
fn shared_noise_makes_stated_deviations_too_small_and_a_bow_biases() {
    let of = |text: &str, name: &str| measured(text, 300).cells[0].of(name).unwrap().clone();
    let expected = of(&chapter("", ""), "nees").predicted.unwrap().mean;
    // Stated by white noise: where neighbours share it, what varies slowly over the image is known worse.
    let shared = of(&chapter("noise_correlation = 0.6", ""), "nees").mean.unwrap();
    assert!(shared.low > 2.0 * expected, "{shared:?}");
    let bowed = of(&chapter("bow_mm = 0.5", ""), "k1");
    let (bias, sd) = (bowed.mean.unwrap(), bowed.predicted.unwrap().sd);
    assert!(bias.low > sd || bias.high < -sd, "{bias:?} against {sd}");
}

#[test]
fn the_displacement_over_the_frame_is_what_the_bound_expects() {
    // Little noise, so that the first order holds.
    let text = chapter("", "measure = [\"frame\"]").replace("noise_px = 0.1", "noise_px = 0.02");
    let summary = measured(&text, 400);
    let of = |name: &str| summary.cells[0].of(name).unwrap();
    for name in ["frame-rms", "turned-rms"] {
        let (found, expected) = (of(name), of(name).predicted.unwrap());
        // Five standard errors of a mean of 400, each way; chance 6e-7, and the seed is fixed.
        let off = (found.mean.unwrap().value - expected.mean).abs() / (expected.sd / 20.0);
        assert!(off < 5.0, "{name}: {off} standard errors");
        let Estimated { low, high, .. } = found.ratio_jointly.unwrap();
        assert!(low < 1.0 && high > 1.0 && high - low < 0.6, "{name}: {low} to {high}");
    }
    let rms = |name: &str| of(name).rms.unwrap().value;
    assert!(rms("turned-rms") < rms("frame-rms"), "a rotation is taken out");
    assert!(rms("frame-max") > rms("frame-rms") && rms("turned-max") > rms("turned-rms"));
    assert!(of("frame-max").predicted.is_none(), "theory says nothing of the largest");
}

#[test]
fn one_panel_of_a_figure_is_printed_alone() {
    let folder = scratch("one-panel");
    write_own(&folder);
    let text = chapter("", "measure = [\"frame\"]");
    let noise = "\n[[factor]]\nname = \"noise\"\nset = [\"scene.noise_px\"]\nlevels = [0.01, 0.1, 1.0]\n";
    fs::write(folder.join("noise.toml"), text + noise).unwrap();
    done(&folder, "study run noise.toml --out run");
    let names = done(&folder, "study figure run");
    let names: Vec<&str> = names.lines().collect();
    for name in ["spread/fx", "bias/k2", "means/nees", "means/turned-rms"] {
        assert!(names.contains(&name), "{names:?}");
    }
    let svg = done(&folder, "study figure run --panel spread/fx");
    // Where the noise varies, a spread is drawn over its bound.
    assert!(svg.starts_with("<svg") && svg.contains("sd / bound"), "{svg}");
    let refused = calibench(&folder, "study figure run --panel spread/fz");
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("spread/fx, "));
    done(&folder, "study run own.toml --out own");
    let refused = calibench(&folder, "study figure own");
    assert_eq!(refused.status.code(), Some(2), "no factor of that study is a number");
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_study_names_its_files_from_its_own_folder() {
    let folder = scratch("own-beside");
    write_own(&folder);
    let inputs = Inputs::beside(&folder.join("own.toml"), OWN).unwrap();
    assert_eq!(inputs.hashes().len(), 2);
    assert!(Engine::with_inputs(OWN, &inputs, Shard::WHOLE).is_ok());
    assert!(Inputs::beside(Path::new("nowhere/own.toml"), OWN).is_err());
    assert!(Inputs::beside(Path::new("nowhere/small.toml"), SPEC).unwrap().is_empty());
    fs::remove_dir_all(folder).unwrap();
}

/// Where results would stand beside what a study reads, under whatever name, nothing is run and nothing is
/// replaced.
#[test]
fn results_do_not_go_where_the_study_reads_from() {
    let folder = scratch("own-inputs-kept");
    for (name, out) in [("marks.csv", "."), ("summary.csv", "."), ("in/other.csv", "in")] {
        let own = folder.join(name.replace('/', "-"));
        fs::create_dir_all(own.join("in")).unwrap();
        fs::write(own.join(name), MARKS).unwrap();
        let spec = SPEC.replace(
            "target = { columns = 9, rows = 7, spacing_mm = 10.0 }",
            &format!("target = {{ file = \"{name}\" }}"),
        );
        assert!(spec.contains(name), "{spec}");
        fs::write(own.join("own.toml"), spec).unwrap();
        let refused = calibench(&own, &format!("study run own.toml --out {out}"));
        let said = String::from_utf8_lossy(&refused.stderr).into_owned();
        assert!(
            refused.status.code() == Some(2) && said.contains("choose another folder with --out"),
            "{name}: {said}"
        );
        assert_eq!(fs::read_to_string(own.join(name)).unwrap(), MARKS);
        assert!(!own.join(out).join("manifest.json").exists());
        // A folder of its own, beside or below, is one.
        done(&own, "study run own.toml --out in/run");
    }
    fs::remove_dir_all(folder).unwrap();
}
