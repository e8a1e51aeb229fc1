//! Does the command end as it says it does? Exit codes, files and streams of `calibench` and of an
//! experiment's own binary.

use crate::program::folder;
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

const CALIBENCH: &str = env!("CARGO_BIN_EXE_calibench");
const LINE_BENDING: &str = env!("CARGO_BIN_EXE_line-bending");

fn run(program: &str, folder: &Path, arguments: &[&str]) -> Output {
    Command::new(program).args(arguments).current_dir(folder).output().expect("the program starts")
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn check_holds_and_says_so_in_json() {
    let output = run(CALIBENCH, root(), &["check", "line-bending", "interface", "--format", "json"]);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("standard output is JSON");
    assert_eq!(output.status.code(), Some(0), "{report:#}");
    assert_eq!(report["outcome"], "held");
    let checked = report["experiments"].as_array().expect("a list");
    assert_eq!([&checked[0]["experiment"], &checked[1]["experiment"]], ["line-bending", "interface"]);
}

#[test]
fn wrong_usage_ends_with_two_and_names_what_there_is() {
    let unknown = run(CALIBENCH, root(), &["run", "no-such-experiment"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(text(&unknown.stderr).contains("line-bending"));
    assert_eq!(run(CALIBENCH, root(), &["--no-such-option"]).status.code(), Some(2));
    assert_eq!(run(CALIBENCH, root(), &["check", "--threads", "0"]).status.code(), Some(2));
    let image = run(LINE_BENDING, root(), &["--image", "photo.png"]);
    assert_eq!(image.status.code(), Some(2));
    assert!(text(&image.stderr).contains("takes no image"));
}

#[test]
fn outside_the_source_tree_everything_works_but_bless() {
    let away = std::env::temp_dir().join(format!("calibench-away-{}", std::process::id()));
    fs::create_dir_all(&away).expect("a folder is made");
    let check = run(CALIBENCH, &away, &["check", "line-bending", "certified-digits"]);
    assert_eq!(check.status.code(), Some(0), "{}{}", text(&check.stdout), text(&check.stderr));
    assert_eq!(fs::read_dir(&away).expect("the folder is there").count(), 0, "check writes nothing");
    let ran = run(CALIBENCH, &away, &["run", "line-bending"]);
    assert_eq!(ran.status.code(), Some(0), "{}{}", text(&ran.stdout), text(&ran.stderr));
    assert!(away.join("out/line-bending/record.json").is_file());
    let bless = run(CALIBENCH, &away, &["bless", "line-bending"]);
    assert_eq!(bless.status.code(), Some(2));
    assert!(text(&bless.stderr).contains("source tree"));
    fs::remove_dir_all(&away).expect("the folder is removed");
}

#[test]
fn help_and_list_read_well() {
    let help = run(CALIBENCH, root(), &["--help"]);
    assert_eq!(help.status.code(), Some(0));
    assert!(text(&help.stdout).contains("Exit codes: 0 all held"));
    assert!(text(&run(CALIBENCH, root(), &["list", "--names"]).stdout).lines().any(|l| l == "line-bending"));
}

#[test]
fn an_own_binary_writes_where_it_is_told_and_skips_golden_for_another_seed() {
    let out = folder("own-binary");
    let output = run(LINE_BENDING, root(), &["--seed", "7", "--out", &out.to_string_lossy()]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("golden values not compared"));
    let record = fs::read_to_string(out.join("line-bending/record.json")).expect("a record is written");
    let record: serde_json::Value = serde_json::from_str(&record).expect("the record is JSON");
    assert_eq!(record["provenance"]["seed"], 7);
    assert!(out.join("line-bending/deviation.csv").is_file());
    assert!(out.join("line-bending/figures/grids.svg").is_file());
}

#[test]
fn a_place_that_cannot_be_written_ends_with_three() {
    let file = folder("no-place").join("file");
    fs::write(&file, "").expect("a file is written");
    let output = run(LINE_BENDING, root(), &["--out", &file.to_string_lossy()]);
    assert_eq!(output.status.code(), Some(3));
    assert!(text(&output.stderr).contains("cannot write"));
}

#[test]
fn a_reader_that_goes_away_is_no_error() {
    let mut child = Command::new(CALIBENCH)
        .arg("list")
        .current_dir(root())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("the program ends");
    assert_eq!((output.status.code(), text(&output.stderr).as_str()), (Some(0), ""));
}

#[cfg(target_os = "linux")]
#[test]
fn output_that_could_not_be_written_ends_with_three_and_a_sentence() {
    let study = root().join("studies/noise.toml");
    let study = study.to_str().expect("the path is text");
    let verbs: [&[&str]; 6] = [
        &["list"],
        &["--help"],
        &["gate", "faults"],
        &["gate", "--samples", "1"],
        &["study", "plan", study, "--want", "fx=5", "--confirm", "10"],
        &["study", "measure", study, "--trials", "10"],
    ];
    for verb in verbs {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
        let output = Command::new(CALIBENCH)
            .args(verb)
            .current_dir(root())
            .stdout(full)
            .stderr(Stdio::piped())
            .output()
            .expect("the program starts");
        assert_eq!(output.status.code(), Some(3), "{verb:?}: {}", text(&output.stderr));
        assert!(text(&output.stderr).contains("standard output could not be written"), "{verb:?}");
    }
}

/// A copy of the golden files in which one number has moved: the tree that `check` must refuse.
#[test]
fn a_number_that_moved_ends_with_one_and_is_named() {
    let tree = folder("moved");
    fs::create_dir_all(tree.join("golden")).expect("a folder is made");
    fs::copy(root().join("golden/published.toml"), tree.join("golden/published.toml")).expect("copied");
    let golden = fs::read_to_string(root().join("golden/line-bending.snap")).expect("a snapshot");
    let moved = golden.replace("number | max-deviation | 4.6", "number | max-deviation | 4.5");
    assert_ne!(golden, moved);
    fs::write(tree.join("golden/line-bending.snap"), moved).expect("written");
    let output = run(LINE_BENDING, &tree, &[]);
    assert_eq!(output.status.code(), Some(1));
    assert!(text(&output.stdout).contains("number max-deviation"), "{}", text(&output.stdout));
    assert!(tree.join("figures/line-bending/grids.svg").is_file(), "the locked run draws the tree's figures");
}

/// A program's origin is that of its build, wherever it runs: neither the commit of the folder around it nor
/// none.
#[test]
fn a_record_names_the_build_and_not_the_repository_around_it() {
    let folder = folder("another-repository");
    let git = |arguments: &[&str]| {
        let author = ["-c", "user.name=calibench", "-c", "user.email=calibench@example.org"];
        let run = Command::new("git").current_dir(&folder).args(author).args(arguments).output();
        run.is_ok_and(|output| output.status.success())
    };
    // Without git the folder is none of a repository, which must make no difference either.
    let _ = git(&["init", "--quiet"])
        && git(&["commit", "--quiet", "--allow-empty", "--message", "another project"]);
    // What makes a folder the project's to the program.
    fs::create_dir(folder.join("golden")).expect("a folder is made");
    fs::write(folder.join("golden/published.toml"), "").expect("a file is written");
    let output = run(LINE_BENDING, &folder, &["--seed", "7", "--out", "out"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let record = fs::read(folder.join("out/line-bending/record.json")).expect("a record");
    let record: serde_json::Value = serde_json::from_slice(&record).expect("JSON");
    let build = calibench_experiments::build();
    let stated = |key: &str| record["provenance"][key].clone();
    assert_eq!(stated("commit"), serde_json::json!(build.commit.as_ref().map(|c| &c.hash)));
    assert_eq!(stated("dirty"), serde_json::json!(build.commit.as_ref().map(|c| c.dirty)));
    assert_eq!(stated("crates"), serde_json::json!(build.crates));
}
