//! What does each verb that writes leave where the disk is full or read-only, or where it is killed? Files as
//! they were, or whole ones.
#![cfg(target_os = "linux")]

use crate::failing_disk::{Failing, Fault};
use calibench::calibrate::{Settings, calibrate};
use calibench::io::atomic::{write_atomically_to, write_together_to};
use calibench::io::{CalibrationFields, write_png};
use calibench::raster::Raster;
use calibench::synth::render::nine_dot_stand_in;
use calibench::synth::{Scene, Stream, StreamKey};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Every file below a folder by its path there, locks left out.
type Tree = BTreeMap<String, Vec<u8>>;

/// A verb that writes, run in a folder that is a source tree and beside its input; what it writes lies there.
struct Verb {
    name: &'static str,
    arguments: &'static [&'static str],
}

const VERBS: [Verb; 23] = [
    Verb { name: "board", arguments: &["board", "circles:9x7:10mm:3mm", "--out", "out"] },
    Verb {
        name: "camera",
        arguments: &["calibrate", "../corners.csv", "--image-size", "640x480", "--out", "out"],
    },
    Verb {
        name: "target",
        arguments: &["calibrate", "../corners.csv", "--target", "../target.csv", "--out", "out"],
    },
    Verb { name: "plane", arguments: &["calibrate", "../pairs.csv", "--out", "out"] },
    Verb { name: "ninepoint", arguments: &["ninepoint", "../dots.png", "--out", "out"] },
    Verb {
        name: "undistort",
        arguments: &["undistort", "--camera", "../camera.json", "--mask", "--out", "out", "../photo.png"],
    },
    Verb { name: "convert", arguments: &["convert", "../camera.json", "out/camera.xml"] },
    Verb {
        name: "diff",
        arguments: &["diff", "../camera.json", "../other.json", "--image-size", "640x480", "--out", "out"],
    },
    Verb { name: "noise", arguments: &["noise", "../still.csv", "--out", "out"] },
    Verb { name: "tsai", arguments: &["tsai", "../corners.csv", "--image-size", "640x480", "--out", "out"] },
    Verb { name: "validate", arguments: &["validate", "../known.json", "../later.csv", "--out", "out"] },
    Verb {
        name: "measure",
        arguments: &[
            "measure",
            "../known.json",
            "--view",
            "0",
            "--pixels",
            "200,200,300,250",
            "--out",
            "out",
        ],
    },
    Verb {
        name: "next-pose",
        arguments: &[
            "next-pose",
            "../known.json",
            "--board",
            "circles:9x7:10mm:3mm",
            "--want",
            "fx",
            "--distance",
            "120,150",
            "--out",
            "out",
        ],
    },
    Verb { name: "register", arguments: &["register", "../marks.csv", "../marks.csv", "--out", "out"] },
    Verb {
        name: "hand-eye",
        arguments: &[
            "hand-eye",
            "../robot.csv",
            "../known.json",
            "--robot-sd-mm",
            "0.1",
            "--robot-sd-deg",
            "0.1",
            "--out",
            "out",
        ],
    },
    Verb {
        name: "check-reference",
        arguments: &[
            "check-reference",
            "../history.csv",
            "--reference",
            "25",
            "--sd",
            "0.01",
            "--out",
            "out",
        ],
    },
    Verb {
        name: "gate",
        arguments: &[
            "gate",
            "--samples",
            "1",
            "--record",
            "out",
            "--json",
            "out/report.json",
            "--junit",
            "out/report.xml",
            "--html",
            "out/report.html",
        ],
    },
    Verb { name: "manual", arguments: &["manual", "--out", "out"] },
    Verb { name: "schema", arguments: &["gate", "schema", "out"] },
    Verb { name: "run", arguments: &["run", "line-bending"] },
    Verb { name: "bless", arguments: &["bless", "line-bending"] },
    Verb { name: "claims", arguments: &["claims", "line-bending", "--out", "out/claims.md"] },
    Verb { name: "book", arguments: &["book"] },
];

/// Where the marks of the corner files are, as if they had been measured.
fn target() -> String {
    let mut text = "point,X,Y,Z,sd\n".to_string();
    for (point, at) in Scene::example().exact()[0].points().iter().enumerate() {
        writeln!(text, "{point},{},{},0,0.01", at.x, at.y).expect("text grows");
    }
    text
}

/// The input of all verbs, in an empty folder of this test's own.
fn with_input(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("disk")).expect("a folder is made");
    let (corners, later) = (corners(0), corners(4));
    let camera = r#"{"camera": {"fx": 600, "fy": 600, "cx": 326, "cy": 243, "k1": -0.18}}"#;
    let pairs = "point,px,py,X,Y\n0,0,0,0,0\n1,100,0,1,0\n2,0,100,0,1\n3,100,101,1,1\n";
    let other = r#"{"camera": {"fx": 601, "fy": 600, "cx": 325, "cy": 243, "k1": -0.17}}"#;
    fs::write(folder.join("other.json"), other).expect("written");
    fs::write(folder.join("later.csv"), later).expect("written");
    for (name, text) in [("corners.csv", corners.as_str()), ("camera.json", camera), ("pairs.csv", pairs)] {
        fs::write(folder.join(name), text).expect("written");
    }
    fs::write(folder.join("target.csv"), target()).expect("written");
    fs::write(folder.join("marks.csv"), "point,X,Y\na,0,0\nb,10,0\nc,0,10\n").expect("written");
    fs::write(folder.join("history.csv"), "when,value\n1,25.01\n2,24.99\n").expect("written");
    fs::write(folder.join("still.csv"), still()).expect("written");
    write_calibration(&folder);
    let photo = Raster::from_fn(160, 120, |x, y| (x + y) as u8);
    write_png(&folder.join("photo.png"), &photo).expect("written");
    write_png(&folder.join("dots.png"), &nine_dot_stand_in().image.to_u8()).expect("written");
    folder
}

/// Four views, numbered from `first`.
fn corners(first: usize) -> String {
    let mut corners = "view,point,X,Y,u,v\n".to_string();
    for (view, seen) in Scene::example().exact().iter().enumerate() {
        for (point, (at, pixel)) in seen.pairs().enumerate() {
            let view = first + view;
            writeln!(corners, "{view},{point},{},{},{},{}", at.x, at.y, pixel.x, pixel.y)
                .expect("text grows");
        }
    }
    corners
}

/// A view three times, as noise leaves it.
fn still() -> String {
    let mut corners = "view,point,X,Y,u,v\n".to_string();
    for trial in 0..3 {
        let key = StreamKey { seed: 1, scenario: "writers", trial, purpose: "still" };
        let seen = &Scene::example().observe(0.05, &mut Stream::open(key))[0];
        for (point, (at, pixel)) in seen.pairs().enumerate() {
            writeln!(corners, "{trial},{point},{},{},{},{}", at.x, at.y, pixel.x, pixel.y)
                .expect("text grows");
        }
    }
    corners
}

/// A calibration with its joint covariance, and the poses of a robot whose gripper holds the camera.
fn write_calibration(folder: &Path) {
    let scene = Scene::example();
    let key = StreamKey { seed: 1, scenario: "writers", trial: 0, purpose: "noise" };
    let calibration = calibrate(&scene.observe(0.1, &mut Stream::open(key)), &Settings::standard());
    let known = CalibrationFields::of(&calibration.expect("four views").into(), &[], Some((640, 480)));
    fs::write(folder.join("known.json"), known.to_json()).expect("written");
    let mut robot = "view,x,y,z,rx,ry,rz\n".to_string();
    for (view, pose) in scene.truth.cam_from_target.iter().enumerate() {
        let (t, w) = (pose.inverse().translation, -calibench::geometry::rotation::log(&pose.rotation));
        writeln!(robot, "{view},{},{},{},{},{},{}", t.x, t.y, t.z, w.x, w.y, w.z).expect("text grows");
    }
    fs::write(folder.join("robot.csv"), robot).expect("written");
}

/// What makes a folder a source tree, with a golden number that has moved and a book of one page, and `old`
/// in place of every file of `whole`.
fn fill(disk: &Path, whole: &Tree) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for name in
        ["style/book.css", "style/search.js", "style/CalibenchMath.woff2", "style/CalibenchMath-LICENSE.txt"]
    {
        fs::create_dir_all(disk.join("book/style")).expect("a folder is made");
        fs::copy(root.join("book").join(name), disk.join("book").join(name)).expect("copied");
    }
    fs::create_dir_all(disk.join("book/text")).expect("a folder is made");
    for (name, text) in [
        ("text/SUMMARY.md", "- [Lines](lines.md)\n"),
        ("text/lines.md", "# Lines\n\n{{figure line-bending.grids}}\n"),
        ("references.toml", "reference = []\n"),
        ("contradictions.toml", "contradiction = []\n"),
        ("items.toml", "item = []\n"),
    ] {
        fs::write(disk.join("book").join(name), text).expect("written");
    }
    let golden = root.join("golden");
    fs::create_dir_all(disk.join("golden")).expect("a folder is made");
    fs::copy(golden.join("published.toml"), disk.join("golden/published.toml")).expect("copied");
    let snapshot = fs::read_to_string(golden.join("line-bending.snap")).expect("a snapshot");
    let moved = snapshot.replace("number | max-deviation | 4.6", "number | max-deviation | 4.5");
    assert_ne!(snapshot, moved);
    fs::write(disk.join("golden/line-bending.snap"), moved).expect("written");
    for name in whole.keys().filter(|name| !name.starts_with("golden/") && !name.starts_with("book/")) {
        let path = disk.join(name);
        fs::create_dir_all(path.parent().expect("it lies in a folder")).expect("a folder is made");
        fs::write(path, "old").expect("written");
    }
}

/// A folder with answers takes no others: who records again moves them away.
fn move_answers_away(disk: &Path) {
    let _ = fs::remove_file(disk.join("out/answers.jsonl"));
}

fn read(folder: &Path) -> Tree {
    let mut tree = Tree::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).expect("a folder").flatten() {
            if entry.path().is_dir() {
                folders.push(entry.path());
            } else {
                let name = entry.path().strip_prefix(folder).expect("below").to_string_lossy().into_owned();
                if !name.ends_with(".lock") {
                    tree.insert(name, fs::read(entry.path()).expect("a file"));
                }
            }
        }
    }
    // Between two renames the old book has another name, by which the next build finds it.
    if !tree.keys().any(|name| name.starts_with("out/book/")) {
        tree = tree
            .into_iter()
            .map(|(name, bytes)| (name.replace("out/.book.old/", "out/book/"), bytes))
            .collect();
    }
    tree
}

/// Whether a file is one that a killed verb had not put in its place, or a book that it had already replaced.
fn is_left_over(name: &str) -> bool {
    name.ends_with(".tmp") || name.starts_with("out/.book.")
}

fn command(verb: &Verb, disk: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.args(verb.arguments).current_dir(disk).stdin(Stdio::null());
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    // What a killed verb leaves among the system's temporary files goes with the test's own.
    command.env("TMPDIR", disk.parent().expect("it lies in the test's folder"));
    command
}

fn run(verb: &Verb, disk: &Path) -> Output {
    command(verb, disk).output().expect("the program starts")
}

/// The files of a run that nothing disturbed, and how long it took.
fn undisturbed(verb: &Verb, folder: &Path) -> (Tree, Duration) {
    let disk = folder.join("undisturbed");
    let _ = fs::remove_dir_all(&disk);
    fill(&disk, &Tree::new());
    let begun = Instant::now();
    let output = run(verb, &disk);
    let took = begun.elapsed();
    // `run` finds the number that has moved, `book` figures that no page shows.
    let expected = if ["run", "book"].contains(&verb.name) { 1 } else { 0 };
    assert_eq!(output.status.code(), Some(expected), "{}: {}", verb.name, said(&output));
    (read(&disk), took)
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// What a report says but for its numbers: it tells how long problems took, a table of claims how long each.
fn without_numbers(bytes: &[u8]) -> Vec<u8> {
    bytes.iter().copied().filter(|byte| !byte.is_ascii_digit() && !b".-e".contains(byte)).collect()
}

/// Whether a file of that name says the same in both.
fn same(name: &str, one: &Tree, other: &Tree) -> bool {
    match (one.get(name), other.get(name)) {
        (Some(a), Some(b)) if name.starts_with("out/report.") || name == "out/claims.md" => {
            without_numbers(a) == without_numbers(b)
        }
        (a, b) => a == b,
    }
}

fn assert_same(verb: &Verb, found: &Tree, whole: &Tree) {
    let names = |tree: &Tree| tree.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(found), names(whole), "{}", verb.name);
    for name in whole.keys() {
        assert!(same(name, found, whole), "{}: {name}", verb.name);
    }
}

/// Every file is what it was or what it should become; temporary ones only where they are allowed.
fn assert_old_or_whole(verb: &Verb, found: &Tree, old: &Tree, whole: &Tree, temporary: bool) {
    for name in found.keys() {
        let known = [old, whole].iter().any(|tree| same(name, found, tree));
        assert!(known || (is_left_over(name) && temporary), "{}: {name} is neither old nor whole", verb.name);
    }
    for name in old.keys() {
        assert!(found.contains_key(name), "{}: {name} is gone", verb.name);
    }
}

/// A result that is new stands among files that are all new.
fn assert_result_is_last(verb: &Verb, found: &Tree, whole: &Tree) {
    let result = "out/result.json";
    if verb.name == "camera" && found.get(result) == whole.get(result) {
        for name in whole.keys() {
            assert!(same(name, found, whole), "{name} is older than {result}");
        }
    }
}

#[test]
fn a_file_is_old_or_whole_whichever_operation_fails() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("writers-operations");
    let _ = fs::remove_dir_all(&folder);
    let path = folder.join("deep/result.json");
    for fault in [Fault::Killed, Fault::Full] {
        for old in [None, Some("old")] {
            let mut operation = 0;
            loop {
                let _ = fs::remove_dir_all(&folder);
                if let Some(old) = old {
                    fs::create_dir_all(path.parent().expect("a folder")).expect("a folder is made");
                    fs::write(&path, old).expect("written");
                }
                let failing = Failing::at(operation, fault);
                let written = write_atomically_to(failing.as_ref(), &path, b"whole");
                let found = fs::read_to_string(&path).ok();
                if !failing.has_failed() {
                    assert_eq!(found.as_deref(), Some("whole"));
                    break;
                }
                let expected = if written.is_ok() { Some("whole") } else { old };
                assert_eq!(found.as_deref(), expected, "{fault:?} at {operation}");
                // The next write goes through, and nothing else is left.
                let expected = Tree::from([("deep/result.json".to_string(), b"next".to_vec())]);
                let write = || calibench::io::write_atomically(&path, b"next").expect("written");
                assert_eq!(left_by_next(&folder, &expected, write), expected);
                operation += 1;
            }
            assert!(operation >= 4, "folder, write, sync, rename: {operation}");
        }
    }
    fs::remove_dir_all(folder).expect("removed");
}

/// What stands in the folder after the next write, or after a later one: a program that another test is
/// starting at this moment holds the locks of all open files until it has begun, and what somebody may still
/// be writing is left alone.
fn left_by_next(folder: &Path, expected: &Tree, write: impl Fn()) -> Tree {
    let started = Instant::now();
    loop {
        write();
        let left = read(folder);
        if left == *expected || started.elapsed() > Duration::from_secs(5) {
            return left;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn files_that_belong_together_are_all_new_where_the_last_is_new_whichever_operation_fails() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("writers-together");
    let names = ["figure.svg", "deep/report.html", "result.json"];
    let contents = |text: &str| names.map(|name| (folder.join(name), text.as_bytes().to_vec()));
    for fault in [Fault::Killed, Fault::Full] {
        let mut operation = 0;
        loop {
            let _ = fs::remove_dir_all(&folder);
            calibench::io::write_together(&contents("old")).expect("written");
            let failing = Failing::at(operation, fault);
            let written = write_together_to(failing.as_ref(), &contents("whole"));
            let found = names.map(|name| fs::read_to_string(folder.join(name)).expect("a file"));
            if !failing.has_failed() {
                assert_eq!(found, ["whole"; 3]);
                break;
            }
            assert!(found.iter().all(|text| text == "old" || text == "whole"), "{found:?}");
            assert!(found[2] == "old" || found == ["whole"; 3], "{fault:?} at {operation}: {found:?}");
            if fault == Fault::Full {
                // What needs no room goes on: all files were on the disk, or none is put in its place.
                assert_eq!(found, [if written.is_ok() { "whole" } else { "old" }; 3], "at {operation}");
            }
            let expected = Tree::from(names.map(|name| (name.to_string(), b"next".to_vec())));
            let write = || calibench::io::write_together(&contents("next")).expect("written");
            assert_eq!(left_by_next(&folder, &expected, write), expected);
            operation += 1;
        }
        assert!(operation >= 12, "folder, write, sync, rename of three files: {operation}");
    }
    fs::remove_dir_all(folder).expect("removed");
}

/// Size of a page of a file system in memory.
const PAGE: usize = 4096;
/// Sizes of the disk that are tried for each verb, from one without room to one with enough.
const SIZES: usize = 12;

/// What a tree takes on such a disk.
fn room(tree: &Tree) -> usize {
    tree.values().map(|bytes| bytes.len().div_ceil(PAGE) * PAGE).sum()
}

/// Mounts a file system in memory; whether that went well.
pub fn mount(disk: &Path, options: &str) -> bool {
    let mut mount = Command::new("mount");
    mount.args(["-t", "tmpfs", "-o", options, "calibench"]).arg(disk);
    mount.output().is_ok_and(|output| output.status.success())
}

/// Runs `work` on a disk of its own, which goes however that ends.
pub fn on_disk(disk: &Path, options: &str, work: impl FnOnce()) {
    struct Mounted<'a>(&'a Path);
    impl Drop for Mounted<'_> {
        fn drop(&mut self) {
            let _ = Command::new("umount").arg("-l").arg(self.0).status();
        }
    }
    assert!(mount(disk, options), "{options}");
    let _mounted = Mounted(disk);
    work();
}

#[test]
#[cfg_attr(not(calibench_mounts), ignore = "needs the right to mount a file system (Linux)")]
fn a_full_disk_ends_with_three_and_leaves_old_files_or_whole_ones() {
    let folder = with_input("writers-full");
    let disk = folder.join("disk");
    for verb in &VERBS {
        let whole = undisturbed(verb, &folder).0;
        let (mut refused, mut held) = (0, 0);
        let filled = folder.join("filled");
        let _ = fs::remove_dir_all(&filled);
        fill(&filled, &whole);
        // Old files and new ones at most, for a moment both; a page more would hide the first fault.
        let (least, most) = (room(&read(&filled)), room(&read(&filled)) + 2 * room(&whole));
        for step in 0..SIZES {
            let size = least + (most - least) * step / (SIZES - 1);
            on_disk(&disk, &format!("size={size}"), || {
                fill(&disk, &whole);
                move_answers_away(&disk);
                let old = read(&disk);
                let output = run(verb, &disk);
                assert_old_or_whole(verb, &read(&disk), &old, &whole, false);
                match output.status.code() {
                    Some(3) => {
                        refused += 1;
                        // Its files are put in their places together.
                        assert!(verb.name != "camera" || read(&disk) == old, "some files of camera are new");
                    }
                    Some(0 | 1) => held += 1,
                    code => panic!("{} ended with {code:?}: {}", verb.name, said(&output)),
                }
                if output.status.code() == Some(3) {
                    assert_named_once(verb, &said(&output), &whole);
                } else {
                    assert_same(verb, &read(&disk), &whole);
                }
            });
        }
        assert!(refused > 0 && held > 0, "{}: {refused} refused, {held} held", verb.name);
    }
    fs::remove_dir_all(folder).expect("removed");
}

/// Every line names one of the files, and once; pages of a book that is not yet in its place by where they
/// are.
fn assert_named_once(verb: &Verb, said: &str, whole: &Tree) {
    let names: Vec<&str> = whole.keys().map(String::as_str).chain(["out/book"]).collect();
    for line in said.replace("out/.book.new/", "out/book/").lines() {
        // The name of one may be the end of another's.
        let named = names.iter().filter(|name| line.contains(**name)).max_by_key(|name| name.len());
        let rest = line.replacen(named.unwrap_or_else(|| panic!("{}: {line}", verb.name)), "", 1);
        assert!(!names.iter().any(|name| rest.contains(name)), "{}: {line}", verb.name);
    }
}

#[test]
#[cfg_attr(not(calibench_mounts), ignore = "needs the right to mount a file system (Linux)")]
fn a_read_only_disk_ends_with_three_and_changes_nothing() {
    let folder = with_input("writers-read-only");
    let disk = folder.join("disk");
    for verb in &VERBS {
        let whole = undisturbed(verb, &folder).0;
        on_disk(&disk, "size=16m", || {
            fill(&disk, &whole);
            move_answers_away(&disk);
            let old = read(&disk);
            assert!(mount(&disk, "remount,ro"));
            let output = run(verb, &disk);
            assert_eq!(output.status.code(), Some(3), "{}: {}", verb.name, said(&output));
            assert_named_once(verb, &said(&output), &whole);
            assert_eq!(read(&disk), old, "{}", verb.name);
        });
    }
    fs::remove_dir_all(folder).expect("removed");
}

/// Times that each verb is killed.
const KILLS: usize = 25;

#[test]
fn a_verb_that_is_killed_at_any_moment_leaves_old_files_or_whole_ones_and_the_next_run_nothing_else() {
    let folder = with_input("writers-killed");
    let disk = folder.join("disk");
    let mut moments = Stream::open(StreamKey { seed: 1, scenario: "writers", trial: 0, purpose: "moment" });
    let mut killed = 0;
    for verb in &VERBS {
        let (whole, took) = undisturbed(verb, &folder);
        fs::remove_dir_all(&disk).expect("removed");
        fill(&disk, &whole);
        move_answers_away(&disk);
        let old = read(&disk);
        for _ in 0..KILLS {
            move_answers_away(&disk);
            let mut child = command(verb, &disk).spawn().expect("the program starts");
            std::thread::sleep(took.mul_f64(moments.uniform()));
            // SIGKILL: no handler runs. It fails where the run has ended.
            let _ = child.kill();
            let output = child.wait_with_output().expect("it ends");
            killed += usize::from(output.status.code().is_none());
            let found = read(&disk);
            assert_old_or_whole(verb, &found, &old, &whole, true);
            assert_result_is_last(verb, &found, &whole);
        }
        move_answers_away(&disk);
        assert!(run(verb, &disk).status.code().is_some_and(|code| code < 2), "{}", verb.name);
        // Also what the killed runs had left is gone.
        assert_same(verb, &read(&disk), &whole);
    }
    assert!(killed > KILLS * VERBS.len() / 4, "{killed} were killed before they had ended: too few");
    fs::remove_dir_all(folder).expect("removed");
}
