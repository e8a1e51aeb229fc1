//! What does the command do with input that nobody means well? It says what is wrong, in time and in little
//! memory, and loses nothing.
#![cfg(target_os = "linux")]

use crate::program::{folder, text};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

const CALIBENCH: &str = env!("CARGO_BIN_EXE_calibench");

/// Address space that a run may take: threads reserve much and use little.
const ADDRESS_SPACE_KIB: u64 = 4 << 20;
/// Time within which a refusal must come. It takes a few milliseconds; this is for a machine with other work.
const PATIENCE: Duration = Duration::from_secs(20);
/// The same for a small study, which takes a second of work.
const PATIENCE_FOR_WORK: Duration = Duration::from_secs(300);

/// Runs the command with little memory, to its end.
fn limited(folder: &Path, arguments: &[&str]) -> Output {
    within(PATIENCE_FOR_WORK, folder, arguments)
}

/// Runs the command with little memory and little time.
fn within(patience: Duration, folder: &Path, arguments: &[&str]) -> Output {
    let script =
        format!("ulimit -v {ADDRESS_SPACE_KIB}; exec timeout -s KILL {} \"$0\" \"$@\"", patience.as_secs());
    let started = Instant::now();
    let output = Command::new("sh")
        .args(["-c", &script, CALIBENCH])
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .expect("the program starts");
    assert!(started.elapsed() < patience, "{arguments:?} took {:?}", started.elapsed());
    output
}

/// Ends with 2, and says all of `words`.
fn refused(folder: &Path, arguments: &[&str], words: &[&str]) {
    let output = within(PATIENCE, folder, arguments);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    for word in words {
        assert!(said.contains(word), "{arguments:?} does not say `{word}`: {said}");
    }
    assert!(!said.contains("panicked"), "{said}");
}

#[test]
fn sizes_beyond_their_limits_are_refused_at_once_with_what_they_would_need() {
    let folder = folder("sizes");
    let change = |name: &str, from: &str, to: &str| {
        let spec = crate::study::SPEC.replace(from, to);
        assert_ne!(spec, crate::study::SPEC, "{from}");
        fs::write(folder.join(name), spec).expect("a study is written");
    };
    let levels = |count: usize| (1..=count).map(|i| format!("{i}.0")).collect::<Vec<_>>().join(", ");
    let factors: String = ["spacing", "outlier"]
        .iter()
        .zip(["scene.target.spacing_mm", "scene.outlier_px"])
        .map(|(name, path)| {
            format!("[[factor]]\nname = \"{name}\"\nset = [\"{path}\"]\nlevels = [{}]\n", levels(50_000))
        })
        .collect();
    let cases: [(&str, &str, &str, &[&str]); 8] = [
        (
            "batch",
            "per_cell = 45\nbatch = 10",
            "per_cell = 9000000000\nbatch = 9000000000",
            &["9000000000 trials a batch", "limit"],
        ),
        (
            "trials",
            "per_cell = 45",
            "per_cell = 9223372036854775807",
            &["18446744073709551614 trials in all cells", "limit"],
        ),
        ("columns", "columns = 9", "columns = 1000000000", &["1000000000 x 7", "1000000"]),
        ("marks", "columns = 9, rows = 7", "columns = 20000, rows = 20000", &["20000 x 20000", "1000000"]),
        ("views", "views = 3,", "views = 1000000000,", &["63000000000 points a trial", "limit"]),
        (
            "level",
            "set = [\"scene.noise_px\"]\nlevels = [0.1, 0.3]",
            "set = [\"scene.poses.views\"]\nlevels = [3, 1000000000]",
            &["63000000000 points a trial", "limit"],
        ),
        ("cells", "[[factor]]", &format!("{factors}[[factor]]"), &["5000000000 cells", "limit"]),
        ("image", "image = [640, 480]", "image = [640, 9000000000]", &["9000000000", "1048576"]),
    ];
    for (name, from, to, words) in cases {
        change(name, from, to);
        refused(&folder, &["study", "run", name, "--out", "out"], words);
        assert!(!folder.join("out").exists(), "{name}: nothing is begun");
    }
    for board in ["circles:99999999999x9:1", "dots:100000x100000:1", "circles:18446744073709551615x2:1"] {
        refused(&folder, &["calibrate", "--board", board, "none.png"], &["1000000"]);
    }
    fs::write(folder.join("plan.toml"), crate::study::SPEC).expect("a study is written");
    let plan = ["study", "plan", "plan.toml", "--want", "fx=1"];
    refused(&folder, &[&plan[..], &["--most-views", "1000000000"]].concat(), &["63000000000 points a trial"]);
    refused(&folder, &["study", "measure", "plan.toml", "--trials", "18446744073709551615"], &["limit"]);
    refused(&folder, &["study", "run", "plan.toml", "--shard", "0/1000000000000"], &["1000000"]);
    refused(&folder, &["gate", "--samples", "1000000000000"], &["100000"]);
    refused(&folder, &["gate", "--jobs", "1000000000", "--solver", "true"], &["1024"]);
    refused(&folder, &["gate", "--timeout", "1e300", "--solver", "true"], &["a day"]);
    let many = ["ninepoint", "none.png", "--columns", "4294967296", "--rows", "4294967296"];
    refused(&folder, &many, &["1000000"]);
}

/// The small study with one set of poses for all trials, which begins at once.
fn fixed_poses() -> String {
    crate::study::SPEC.replace(", redraw = true", "")
}

#[test]
fn a_study_of_a_million_million_trials_begins_at_once_and_hears_an_interrupt() {
    let folder = folder("long-study");
    let spec = fixed_poses().replace("per_cell = 45\nbatch = 10", "per_cell = 100000000000000\nbatch = 7");
    fs::write(folder.join("spec.toml"), &spec).expect("a study is written");
    // A part of many: batches of other parts are passed over without being looked at.
    for shard in ["0/1", "999999/1000000"] {
        let _ = fs::remove_dir_all(folder.join("out"));
        let child = Command::new(CALIBENCH)
            .args(["study", "run", "spec.toml", "--out", "out", "--shard", shard])
            .current_dir(&folder)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let started = Instant::now();
        let trials = || fs::read_to_string(folder.join("out/trials.csv")).unwrap_or_default().lines().count();
        while trials() < 8 && started.elapsed() < PATIENCE_FOR_WORK {
            std::thread::sleep(Duration::from_millis(5));
        }
        let killed = Command::new("kill").args(["-TERM", &child.id().to_string()]).status().expect("kill");
        assert!(killed.success() && trials() >= 8, "no trials after {:?}", started.elapsed());
        let ended = child.wait_with_output().expect("it ends");
        let said = text(&ended.stderr);
        assert_eq!(ended.status.code(), Some(3), "{shard}: {said}");
        assert_eq!(said.contains("take one core"), shard == "0/1", "{shard}: {said}");
    }
}

#[test]
fn more_threads_than_any_machine_has_are_refused() {
    let folder = folder("threads");
    refused(&folder, &["--threads", "100000000", "list"], &["100000000", "1024"]);
    let output = Command::new(CALIBENCH)
        .arg("list")
        .env("RAYON_NUM_THREADS", "100000000")
        .output()
        .expect("the program starts");
    assert_eq!(output.status.code(), Some(2), "{}", text(&output.stderr));
}

/// The chapter's corners, exact, as a corner file: four views of 640 x 480 px.
fn corner_file() -> String {
    let scene = calibench::synth::Scene::example();
    let mut text = "view,point,X,Y,u,v\n".to_string();
    for (view, seen) in scene.exact().iter().enumerate() {
        for (point, (at, pixel)) in seen.pairs().enumerate() {
            text.push_str(&format!("{view},{point},{},{},{},{}\n", at.x, at.y, pixel.x, pixel.y));
        }
    }
    text
}

/// Its marks, measured.
fn target_file() -> String {
    let views = calibench::synth::Scene::example().exact();
    let marks = views[0].pairs().enumerate().map(|(i, (at, _))| format!("{i},{},{},0,0.01\n", at.x, at.y));
    "point,X,Y,Z,sd\n".to_string() + &marks.collect::<String>()
}

const PAIRS: &str = "point,px,py,X,Y\n0,0,0,0,0\n1,100,0,1,0\n2,0,100,0,1\n3,100,101,1,1\n";

#[test]
fn a_photograph_that_needs_more_memory_than_there_is_is_refused_before_it_is_decoded() {
    let folder = folder("memory");
    // 14000 x 14000 px of 16 bits, of which the file has none.
    fs::write(folder.join("large.pgm"), "P5\n14000 14000\n65535\n").expect("written");
    let camera = r#"{"camera": {"fx": 600, "fy": 600, "cx": 320, "cy": 240}}"#;
    fs::write(folder.join("camera.json"), camera).expect("written");
    let need = ["large.pgm: needs some 3136000000 bytes of memory", "limit is 2147483648", "--memory"];
    refused(&folder, &["calibrate", "--board", "dots:3x3:1", "large.pgm"], &need);
    refused(&folder, &["ninepoint", "large.pgm"], &need);
    let more = ["large.pgm: needs some 7840000000 bytes of memory", "--memory"];
    refused(&folder, &["undistort", "--camera", "camera.json", "--out", "o", "large.pgm"], &more);
    // With the memory it asks for, the file is found to be cut off.
    refused(&folder, &["ninepoint", "--memory", "8GiB", "large.pgm"], &["broken image"]);
    refused(&folder, &["ninepoint", "--memory", "much", "large.pgm"], &["2GiB"]);
}

#[test]
fn marks_outside_of_the_image_are_refused_and_swapped_sides_are_named() {
    let folder = folder("image-size");
    fs::write(folder.join("c.csv"), corner_file()).expect("written");
    let with = |size: &'static str| ["calibrate", "c.csv", "--image-size", size];
    assert_eq!(limited(&folder, &with("640x480")).status.code(), Some(0));
    refused(&folder, &with("480x640"), &["outside", "640x480", "swapped"]);
    refused(&folder, &with("10x10"), &["lie outside of the image of 10 x 10 px"]);
    refused(&folder, &with("18446744073709551615x18446744073709551615"), &["1048576"]);
    refused(&folder, &with("36893488147419103232x480"), &["expected WIDTHxHEIGHT"]);
}

#[test]
fn marks_and_pictures_of_an_earlier_run_beside_a_result_are_named() {
    let folder = folder("earlier-run");
    fs::write(folder.join("c.csv"), corner_file()).expect("written");
    fs::create_dir_all(folder.join("o/overlay")).expect("made");
    let run = || limited(&folder, &["calibrate", "c.csv", "--out", "o"]);
    let alone = run();
    assert_eq!(alone.status.code(), Some(0), "{}", text(&alone.stderr));
    assert!(!text(&alone.stderr).contains("earlier run"), "{}", text(&alone.stderr));
    for file in ["o/corners.csv", "o/overlay/001-a.png"] {
        fs::write(folder.join(file), "").expect("written");
    }
    let said = text(&run().stderr);
    for file in ["corners.csv", "001-a.png"] {
        assert!(said.contains(&format!("{file} is of an earlier run")), "{said}");
    }
}

#[test]
fn options_that_contradict_each_other_or_the_input_are_refused() {
    let folder = folder("contradictions");
    fs::write(folder.join("c.csv"), corner_file()).expect("written");
    fs::write(folder.join("p.csv"), PAIRS).expect("written");
    let calibrate = |rest: &[&'static str]| [&["calibrate"], rest].concat();
    let fine: [&[&str]; 4] = [
        &["c.csv", "--fix", "k2=0.05"],
        &["c.csv", "--tie", "fy=fx", "--prior", "k1=-0.18+-0.01"],
        &["c.csv", "--free", "fx,fy", "--fix", "k1=0", "--image-size", "640x480"],
        &["p.csv"],
    ];
    for rest in fine {
        let output = limited(&folder, &calibrate(rest));
        assert_eq!(output.status.code(), Some(0), "{rest:?}: {}", text(&output.stderr));
    }
    let wrong: [(&[&str], &str); 20] = [
        (&["c.csv", "--free", "fx,fy", "--fix", "fx=600"], "fx is in --free and in --fix"),
        (&["c.csv", "--fix", "fx=600", "--fix", "fx=700"], "--fix gives fx more than once"),
        (&["c.csv", "--mode", "tilted"], "--mode is for point pairs"),
        (&["--board", "dots:3x3:1", "a.png", "--mode", "planar"], "--mode is for point pairs"),
        (&["p.csv", "--free", "fx"], "--free is for a camera"),
        (&["p.csv", "--fix", "fx=600"], "--fix is for a camera"),
        (&["p.csv", "--tie", "fy=fx"], "--tie is for a camera"),
        (&["p.csv", "--prior", "k1=0+-1"], "--prior is for a camera"),
        (&["c.csv", "--fix", "k1=0", "--prior", "k1=0+-1"], "k1 is in --prior and in --fix"),
        (&["c.csv", "--prior", "k1=0+-1", "--prior", "k1=0+-2"], "--prior gives k1 more than once"),
        (&["c.csv", "--prior", "fy=600+-1", "--tie", "fy=fx"], "fy is in --prior and in --tie"),
        (&["c.csv", "--free", "fx,fy", "--tie", "fy=fx"], "fy is in --free and in --tie"),
        (&["c.csv", "--fix", "fy=600", "--tie", "fy=fx"], "fy is in --fix and in --tie"),
        (&["c.csv", "--prior", "k1=0+-0"], "is no prior"),
        (&["c.csv", "--free", "fx,fy,fx"], "fx is named twice"),
        (&["c.csv", "--model", "double-sphere", "--fix", "alpha=7"], "alpha lies between 0 and 1"),
        (&["c.csv", "--loss", "cauchy:1e300"], "from 1e-9 to 1e9 px"),
        (&["p.csv", "--image-size", "640x480"], "--image-size is for a camera"),
        (&["p.csv", "--loss", "huber:1"], "--loss is for a camera"),
        (&["p.csv", "--reject-views", "3"], "--reject-views is for a camera"),
    ];
    for (rest, word) in wrong {
        refused(&folder, &calibrate(rest), &[word]);
    }
    refused(&folder, &["gate", "--record", "r", "--against", "builtin"], &["cannot be used with"]);
    refused(&folder, &["gate", "--models", "division,division"], &["names division twice"]);
    let scenes = ["gate", "--scene", "four-pose", "--scene", "four-pose"];
    refused(&folder, &scenes, &["names four-pose twice"]);
    let levels = crate::study::SPEC.replace("levels = [0.1, 0.3]", "levels = [0.1, 0.3, 0.1]");
    fs::write(folder.join("levels.toml"), levels).expect("written");
    refused(&folder, &["study", "run", "levels.toml"], &["level 0.1 is named twice"]);
}

#[test]
fn a_pipe_blocks_nobody_and_headers_are_read_as_csv_has_them() {
    let folder = folder("inputs");
    let made = Command::new("mkfifo").arg(folder.join("pipe")).status().expect("mkfifo");
    assert!(made.success());
    fs::write(folder.join("camera.json"), r#"{"camera": {"fx": 600, "fy": 600, "cx": 320, "cy": 240}}"#)
        .expect("written");
    refused(&folder, &["calibrate", "pipe"], &["pipe", "not a regular file", "name it -"]);
    refused(&folder, &["calibrate", "--board", "dots:3x3:1", "pipe"], &["not a regular file"]);
    refused(&folder, &["ninepoint", "pipe"], &["not a regular file"]);
    refused(&folder, &["undistort", "--camera", "pipe", "--out", "o", "a.png"], &["not a regular file"]);
    refused(
        &folder,
        &["undistort", "--camera", "camera.json", "--out", "o", "pipe"],
        &["not a regular file"],
    );
    refused(&folder, &["study", "run", "pipe"], &["not a regular file"]);
    refused(&folder, &["calibrate", "/dev/zero"], &["not a regular file"]);
    refused(&folder, &["calibrate", "."], &["a folder"]);
    let quoted = PAIRS.replacen("point,px,py,X,Y", "\"point\",\"px\",\"py\",\"X\",\"Y\"", 1);
    // `px` comes first, behind the mark.
    let marked = "\u{feff}px,point,py,X,Y\n0,0,0,0,0\n100,1,0,1,0\n0,2,100,0,1\n100,3,101,1,1\n".to_string();
    for (name, pairs) in [("quoted", quoted), ("marked", marked)] {
        fs::write(folder.join(name), pairs).expect("written");
        let output = limited(&folder, &["calibrate", name]);
        assert!(text(&output.stdout).contains("world from pixel"), "{name}: {}", text(&output.stderr));
    }
    let mut child = Command::new(CALIBENCH)
        .args(["calibrate", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut input = child.stdin.take().expect("a pipe");
    std::io::Write::write_all(&mut input, PAIRS.as_bytes()).expect("it reads");
    drop(input);
    let output = child.wait_with_output().expect("it ends");
    assert!(text(&output.stdout).contains("world from pixel"), "{output:?}");
}

#[test]
fn a_pipe_in_the_place_of_a_table_or_of_a_record_blocks_nobody() {
    let folder = folder("pipes-for-tables");
    let pipe = |name: &str| {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().expect("it lies in a folder")).expect("a folder is made");
        assert!(Command::new("mkfifo").arg(path).status().expect("mkfifo").success());
    };
    for name in ["faults.csv", "golden/line-bending.snap", "reference/SHA256SUMS"] {
        pipe(name);
    }
    refused(&folder, &["gate", "--power-table", "."], &["faults.csv", "not a regular file"]);
    refused(&folder, &["gate", "--digits-table", "faults.csv"], &["faults.csv", "not a regular file"]);
    refused(&folder, &["run", "nine-point", "--image", "faults.csv"], &["faults.csv", "not a regular file"]);
    // A source tree whose files are pipes: there is no snapshot, and there are no certified problems.
    fs::write(folder.join("golden/published.toml"), "").expect("written");
    refused(&folder, &["gate", "--certified"], &["SHA256SUMS", "not a regular file"]);
    let checked = within(PATIENCE_FOR_WORK, &folder, &["check", "line-bending"]);
    assert!(checked.status.code().is_some_and(|code| code > 0), "{}", text(&checked.stdout));
}

#[test]
fn a_pipe_in_a_run_folder_blocks_nobody() {
    let folder = folder("run-folder-pipes");
    fs::write(folder.join("spec.toml"), fixed_poses()).expect("written");
    for name in ["trials.csv", ".lock", "checkpoint.json", "manifest.json", "spec.toml"] {
        let _ = fs::remove_dir_all(folder.join("r"));
        assert_eq!(limited(&folder, &["study", "run", "spec.toml", "--out", "r"]).status.code(), Some(0));
        let pipe = folder.join("r").join(name);
        fs::remove_file(&pipe).expect("removed");
        assert!(Command::new("mkfifo").arg(&pipe).status().expect("mkfifo").success());
        // A folder whose manifest is no file holds no run.
        let word = if name == "manifest.json" { "holds no run" } else { "not a regular file" };
        for verb in [
            &["study", "resume", "r"][..],
            &["study", "merge", "r", "--out", "w"],
            &["study", "compare", "r", "r"],
        ] {
            let output = within(PATIENCE, &folder, verb);
            let said = text(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{name}: {verb:?}: {said}");
            assert!(verb[1] != "resume" || said.contains(word), "{name}: {said}");
        }
    }
}

/// Peak resident memory of a run, KiB, while it was watched.
fn peak_kib(child: &mut std::process::Child) -> u64 {
    let path = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    while child.try_wait().expect("it is ours").is_none() {
        let status = fs::read_to_string(&path).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        peak = peak.max(line.and_then(|l| l.split_whitespace().next()?.parse().ok()).unwrap_or(0));
        std::thread::sleep(Duration::from_millis(20));
    }
    peak
}

#[test]
fn a_solver_that_writes_without_end_is_a_finding_and_takes_no_memory() {
    // Without a newline, and line after line.
    for (solver, finding) in [
        ("cat /dev/zero", "a line of more than 1048576 bytes"),
        ("yes '{\"id\": \"another\", \"status\": \"refused\"}'", "1000 lines and no answer among them"),
    ] {
        let mut gate = Command::new(CALIBENCH)
            .args(["gate", "--samples", "1", "--timeout", "20", "--solver", solver])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts");
        let peak = peak_kib(&mut gate);
        let output = gate.wait_with_output().expect("it ends");
        assert_eq!(output.status.code(), Some(1), "{}", text(&output.stderr));
        assert!(text(&output.stderr).contains(finding), "{solver}: {}", text(&output.stderr));
        // The gate itself takes some 30 MB, lines that are read ahead 16 MB at most.
        assert!(peak < 200 * 1024, "{solver}: {peak} KiB");
    }
}

/// Whether a process runs; one that has ended and was not waited for does not.
fn runs(id: &str) -> bool {
    let stat = fs::read_to_string(format!("/proc/{}/stat", id.trim())).unwrap_or_default();
    stat.rsplit_once(')').is_some_and(|(_, rest)| !rest.trim_start().starts_with('Z'))
}

#[test]
fn what_a_solver_started_in_sessions_of_its_own_ends_with_the_gate() {
    let folder = folder("sessions");
    // One leaves the process group, one its parent too, one also clears its environment.
    let solver = "setsid sh -c 'echo $$ > a; exec sleep 1000' & \
         (setsid sh -c 'echo $$ > b; exec sleep 1000' &) ; \
         (env -i PATH=\"$PATH\" setsid sh -c 'echo $$ > c; exec sleep 1000' &) ; \
         while [ ! -s a ] || [ ! -s b ] || [ ! -s c ]; do sleep 0.05; done; exit 1";
    // What they started holds the solver's pipes open, so each start lasts until its time is over.
    let gate = Command::new(CALIBENCH)
        .args(["gate", "--samples", "1", "--timeout", "3", "--solver", solver])
        .current_dir(&folder)
        .output()
        .expect("the program starts");
    assert_eq!(gate.status.code(), Some(1), "{}", text(&gate.stderr));
    for name in ["a", "b", "c"] {
        let id = fs::read_to_string(folder.join(name)).expect("it started");
        assert!(!runs(&id), "{name} still runs");
    }
}

#[test]
fn what_a_solver_says_cannot_command_the_terminal() {
    let solver = "printf '\\033]0;owned\\007\\033[2J\\n'; printf '\\033[31mred' >&2; sleep 0.1; exit 1";
    let gate = Command::new(CALIBENCH)
        .args(["gate", "--samples", "1", "--solver", solver])
        .output()
        .expect("the program starts");
    for stream in [&gate.stdout, &gate.stderr] {
        assert!(!stream.contains(&0x1b) && !stream.contains(&0x07), "{}", text(stream));
    }
    assert!(text(&gate.stderr).contains("\\u001b"), "{}", text(&gate.stderr));
}

#[test]
fn a_recorded_run_is_judged_like_any_other_and_keeps_answers_that_failed() {
    let folder = folder("record");
    // This solver answers one problem and ends: the rest is broken.
    let solver = "read line; echo 'no answer'; exit 1";
    let gate = |rest: &[&str]| {
        let arguments = [&["gate", "--samples", "2", "--timeout", "5"][..], rest].concat();
        Command::new(CALIBENCH).args(arguments).current_dir(&folder).output().expect("the program starts")
    };
    let recorded = gate(&["--solver", solver, "--record", "r", "--json", "recorded.json"]);
    assert_eq!(recorded.status.code(), Some(1), "{}", text(&recorded.stderr));
    assert!(text(&recorded.stdout).contains("NOT TRUSTED"), "{}", text(&recorded.stdout));
    let lines =
        |name: &str| fs::read_to_string(folder.join("r").join(name)).expect("written").lines().count();
    assert_eq!(lines("answers.jsonl"), lines("problems.jsonl"), "every problem has a line");
    let again = gate(&["--judge", "r", "--json", "judged.json"]);
    assert_eq!(again.status.code(), Some(1), "{}", text(&again.stderr));
    let verdicts = |name: &str| -> Vec<serde_json::Value> {
        let report = fs::read_to_string(folder.join(name)).expect("written");
        let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
        let checks = report["checks"].as_array().expect("checks").iter();
        checks.map(|c| serde_json::json!([c["property"], c["scenario"], c["verdict"]])).collect()
    };
    assert_eq!(verdicts("recorded.json"), verdicts("judged.json"));
    for verb in ["--record", "--export"] {
        refused(&folder, &["gate", "--samples", "1", verb, "r"], &["r holds answers already"]);
    }
}

#[test]
fn a_folder_that_is_named_twice_has_a_message_of_its_own() {
    let folder = folder("twice");
    fs::write(folder.join("spec.toml"), fixed_poses()).expect("written");
    for shard in ["0/2", "1/2"] {
        let out = format!("p{}", &shard[..1]);
        let run = limited(&folder, &["study", "run", "spec.toml", "--shard", shard, "--out", &out]);
        assert_eq!(run.status.code(), Some(0), "{}", text(&run.stderr));
    }
    refused(&folder, &["study", "merge", "p0", "p1", "./p1", "--out", "w"], &["./p1 is named twice"]);
    refused(&folder, &["study", "merge", "p0", "p1", "--out", "p1"], &["p1 is one of the parts"]);
    refused(&folder, &["study", "compare", "p0", "./p0"], &["named twice"]);
}

#[test]
fn what_a_killed_write_left_is_removed_when_the_run_goes_on() {
    let folder = folder("leftovers");
    fs::write(folder.join("spec.toml"), fixed_poses()).expect("written");
    assert_eq!(limited(&folder, &["study", "run", "spec.toml", "--out", "r"]).status.code(), Some(0));
    let left =
        [".checkpoint.json.4242.7.tmp", "figures/.spread.svg.4242.9.tmp"].map(|n| folder.join("r").join(n));
    left.iter().for_each(|path| fs::write(path, "half").expect("written"));
    assert_eq!(limited(&folder, &["study", "resume", "r"]).status.code(), Some(0));
    left.iter().for_each(|path| assert!(!path.exists(), "{} is still there", path.display()));
}

/// A file system of 64 kB, or `None` where this user may not mount one.
fn small_disk(folder: &Path) -> Option<PathBuf> {
    let disk = folder.join("disk");
    fs::create_dir_all(&disk).expect("a folder is made");
    let mount =
        Command::new("mount").args(["-t", "tmpfs", "-o", "size=64k", "calibench"]).arg(&disk).output();
    mount.ok()?.status.success().then_some(disk)
}

#[test]
fn a_full_disk_is_not_wrong_usage_and_its_file_is_named_once() {
    let folder = folder("full-disk");
    let Some(disk) = small_disk(&folder) else {
        eprintln!("skipped: this user may not mount a small file system");
        return;
    };
    fs::write(disk.join("fill"), vec![0; 60_000]).expect("the disk takes so much");
    fs::write(folder.join("c.csv"), corner_file()).expect("written");
    fs::write(folder.join("spec.toml"), fixed_poses()).expect("written");
    let cases: [&[&str]; 2] =
        [&["calibrate", "c.csv", "--out", "disk/out"], &["study", "run", "spec.toml", "--out", "disk/run"]];
    let outputs = cases.map(|arguments| limited(&folder, arguments));
    let unmounted = Command::new("umount").arg(&disk).status().expect("umount");
    assert!(unmounted.success());
    for output in outputs {
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{said}");
        assert_eq!(said.matches("disk/").count(), 1, "the path stands once: {said}");
    }
}

#[test]
fn a_device_or_pipe_in_the_place_of_a_report_is_left_as_it_is() {
    let folder = folder("no-file");
    assert!(Command::new("mkfifo").arg(folder.join("pipe")).status().expect("mkfifo runs").success());
    for place in ["/dev/null", "/dev/full", "pipe"] {
        let output = within(PATIENCE, &folder, &["gate", "--samples", "1", "--json", place]);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{place}: {said}");
        assert!(said.contains("no file: name another"), "{place}: {said}");
        assert!(!folder.join(place).metadata().expect("it is there").is_file(), "{place}");
    }
}

#[test]
fn a_run_never_writes_through_a_link() {
    let folder = folder("links");
    fs::write(folder.join("study.toml"), fixed_poses()).expect("written");
    let run = limited(&folder, &["study", "run", "study.toml", "--out", "run"]);
    assert_eq!(run.status.code(), Some(0), "{}", text(&run.stderr));
    fs::write(folder.join("mine"), "do not touch").expect("written");
    for name in ["trials.csv", "checkpoint.json"] {
        fs::remove_file(folder.join("run").join(name)).expect("removed");
    }
    std::os::unix::fs::symlink("../mine", folder.join("run/trials.csv")).expect("linked");
    refused(&folder, &["study", "resume", "run"], &["trials.csv is a link"]);
    assert_eq!(fs::read(folder.join("mine")).expect("read"), b"do not touch");
}

#[test]
fn noise_beyond_numbers_is_refused_before_the_first_trial() {
    let folder = folder("noise");
    let study = fixed_poses().replace("levels = [0.1, 0.3]", "levels = [0.1, 1e308]");
    assert!(study.contains("1e308"));
    fs::write(folder.join("study.toml"), study).expect("written");
    refused(&folder, &["study", "run", "study.toml", "--out", "run"], &["noise_px", "below 1e6"]);
    assert!(!folder.join("run").exists());
}

#[test]
fn a_camera_is_not_overwritten_by_that_of_the_output() {
    let folder = folder("own-camera");
    fs::write(
        folder.join("camera-8x8.json"),
        r#"{"camera": {"fx": 9, "fy": 9, "cx": 4, "cy": 4, "k1": -0.1}}"#,
    )
    .expect("written");
    let arguments = ["undistort", "--camera", "camera-8x8.json", "--out", ".", "photo.png"];
    refused(&folder, &arguments, &["camera-8x8.json", "choose another folder"]);
}

/// Whatever a verb is given to read, under the very name of something that it writes, is as it was.
#[test]
fn no_verb_replaces_what_it_was_given_to_read() {
    let folder = folder("given");
    fs::write(folder.join("c.csv"), corner_file()).expect("written");
    assert_eq!(limited(&folder, &["calibrate", "c.csv", "--out", "run"]).status.code(), Some(0));
    let result = fs::read_to_string(folder.join("run/result.json")).expect("a result");
    let of_target = target_file();
    let history = "when,value\n1,10\n2,10.1\n3,9.9\n";
    let cases: [(&str, &str, &str, &[&str]); 8] = [
        ("calibrate", "result.json", &corner_file(), &["calibrate", "calibrate/result.json"]),
        ("target", "marks.csv", &of_target, &["calibrate", "c.csv", "--target", "target/marks.csv"]),
        ("validate", "validation.json", &result, &["validate", "validate/validation.json", "c.csv"]),
        (
            "diff",
            "difference.json",
            &result,
            &["diff", "run/result.json", "diff/difference.json", "--image-size", "640x480"],
        ),
        ("tsai", "tsai.json", &corner_file(), &["tsai", "tsai/tsai.json", "--image-size", "640x480"]),
        (
            "register",
            "registration.json",
            "point,X,Y\n1,0,0\n2,10,0\n3,0,10\n4,10,10\n",
            &["register", "register/registration.json", "register/registration.json"],
        ),
        (
            "check",
            "check.json",
            history,
            &["check-reference", "check/check.json", "--reference", "10", "--sd", "0.1"],
        ),
        (
            "add",
            "check.json",
            history,
            &["check-reference", "add/check.json", "--reference", "10", "--sd", "0.1", "--add", "10"],
        ),
    ];
    for (name, file, text_of_it, arguments) in cases {
        let own = folder.join(name);
        fs::create_dir_all(&own).expect("made");
        fs::write(own.join(file), text_of_it).expect("written");
        let output = limited(&folder, &[arguments, &["--out", name]].concat());
        let left = fs::read_to_string(own.join(file)).expect("it is still there");
        // The verb that adds to a history does that, and no more.
        assert!(left.starts_with(text_of_it), "{name}: {left}");
        let said = text(&output.stderr);
        assert!(output.status.code() == Some(3) && said.contains("given to read"), "{name}: {said}");
    }
}

#[test]
fn options_of_the_gate_that_would_be_ignored_are_refused() {
    let folder = folder("ignored-options");
    for arguments in [
        &["gate", "--certified", "--json", "report.json"][..],
        &["gate", "--certified", "--samples", "3"],
        &["gate", "--samples", "2", "--size", "thorough"],
        &["gate", "--timeout", "nan"],
        &["gate", "--jobs", "0"],
        &["gate", "--certified", "--least-digits", "nan"],
        &["gate", "--schema", "a", "--export", "b"],
        &["gate", "--export", "b", "--json", "report.json"],
    ] {
        refused(&folder, arguments, &[]);
    }
}

/// Runs the command by a line of the shell, in which `"$0"` is the program.
fn by_shell(folder: &Path, line: &str) -> Output {
    let mut shell = Command::new("sh");
    shell.args(["-c", line, CALIBENCH]).current_dir(folder).stdin(Stdio::null());
    shell.output().expect("the shell starts")
}

#[test]
fn a_standard_output_that_was_closed_before_the_start_ends_with_three_and_a_sentence() {
    let folder = folder("closed-output");
    for arguments in ["list", "--help", "study --help", "gate --planted list"] {
        let output = by_shell(&folder, &format!("exec \"$0\" {arguments} >&-"));
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{arguments}: {said}");
        assert!(said.contains("standard output") && said.contains("closed"), "{arguments}: {said}");
    }
    // Nothing was to be printed, or nobody wants to read it.
    for line in [
        "exec \"$0\" gate --schema out >&-",
        "exec \"$0\" list > /dev/null",
        "exec \"$0\" list <&- > /dev/null 2>&-",
    ] {
        let output = by_shell(&folder, line);
        assert_eq!(output.status.code(), Some(0), "{line}: {}", text(&output.stderr));
    }
    // A program in front of ours may well open it for both reading and writing.
    let output = by_shell(&folder, "exec \"$0\" list 1<> /dev/null");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
}

#[test]
fn a_file_larger_than_the_shell_allows_is_an_error_and_nothing_is_left_of_it() {
    let folder = folder("file-limit");
    fs::write(folder.join("c.csv"), corner_file()).expect("written");
    fs::write(folder.join("spec.toml"), fixed_poses()).expect("written");
    for line in ["calibrate c.csv --out out", "study run spec.toml --out run"] {
        // Blocks of 512 bytes: too few for report and trials.
        let output = by_shell(&folder, &format!("ulimit -f 4; exec \"$0\" {line}"));
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{line}: {:?} {said}", output.status);
        assert!(said.contains("too large"), "{line}: {said}");
    }
    let left = |name: &str| {
        let entries = fs::read_dir(folder.join(name)).expect("a folder").flatten();
        entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect::<Vec<_>>()
    };
    assert!(left("out").is_empty(), "{:?}", left("out"));
    assert!(!left("run").iter().any(|name| name.ends_with(".tmp")), "{:?}", left("run"));
    let resumed = limited(&folder, &["study", "resume", "run"]);
    assert_eq!(resumed.status.code(), Some(0), "{}", text(&resumed.stderr));
}

#[test]
fn a_table_that_may_have_been_cut_inside_its_last_number_is_used_with_a_warning() {
    let folder = folder("unended");
    let corners = corner_file();
    fs::write(folder.join("c.csv"), corners.trim_end()).expect("written");
    fs::write(folder.join("whole.csv"), &corners).expect("written");
    fs::write(folder.join("p.csv"), PAIRS.trim_end()).expect("written");
    let line = format!("c.csv:{}: this last line has no end", corners.lines().count());
    let said = |arguments: &[&str]| {
        let output = limited(&folder, arguments);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", text(&output.stderr));
        text(&output.stdout) + &text(&output.stderr)
    };
    assert!(said(&["calibrate", "c.csv"]).contains(&line));
    assert!(said(&["calibrate", "c.csv", "--format", "json"]).contains(&line));
    assert!(said(&["calibrate", "p.csv"]).contains("p.csv:5: this last line has no end"));
    let convert = ["convert", "c.csv", "c.vnl", "--board", "chess:9x7:10mm"];
    assert!(said(&convert).contains(&line));
    assert!(!said(&["calibrate", "whole.csv"]).contains("has no end"));
}

#[test]
fn a_line_break_in_a_name_begins_no_line_of_a_message() {
    let folder = folder("line-breaks");
    let name = "a\nall held";
    for arguments in [
        &["calibrate", name][..],
        &["calibrate", "--board", "dots:3x3:1", name],
        &["ninepoint", name],
        &["undistort", "--camera", name, "--out", "o", "b.png"],
        &["convert", name, "b.yaml"],
        &["diff", name, name],
        &["study", "run", name],
        &["study", "resume", name],
        &["study", "merge", name, "--out", "w"],
        &["gate", "--judge", name],
        &["gate", "--power-table", name],
        &["run", "nine-point", "--image", name],
    ] {
        let output = within(PATIENCE, &folder, arguments);
        let said = text(&output.stdout) + &text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
        assert!(said.contains("a\\u000aall held"), "{arguments:?}: {said}");
        assert!(!said.lines().any(|line| line.starts_with("all held")), "{arguments:?}: {said}");
    }
    // The fields of a table and of a study may have one too.
    let field = PAIRS.replacen("0,0,0,0,0", "0,\"1\nall held\",0,0,0", 1);
    fs::write(folder.join("p.csv"), field).expect("written");
    refused(&folder, &["calibrate", "p.csv"], &["'1\\u000aall held' is not a number"]);
    let factor = "name = \"noise\"\nunit";
    let study = |name: &str| fixed_poses().replace(factor, &format!("name = \"{name}\"\nunit"));
    fs::write(folder.join("named.toml"), study("a\\nall held")).expect("written");
    fs::write(folder.join("wrong.toml"), study("noise\"\n\"a\\nall held\" = \"")).expect("written");
    refused(&folder, &["study", "run", "wrong.toml"], &["a\\u000aall held"]);
    let views = corner_file().replace("\n0,", "\n\"a\nall held\",");
    fs::write(folder.join("c.csv"), views).expect("written");
    for arguments in [&["calibrate", "c.csv"][..], &["study", "run", "named.toml", "--out", "run"]] {
        let output = limited(&folder, arguments);
        let said = text(&output.stdout) + &text(&output.stderr);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {said}");
        assert!(said.contains("a\\u000aall held"), "{arguments:?}: {said}");
        assert!(!said.lines().any(|line| line.trim().starts_with("all held")), "{arguments:?}: {said}");
    }
}

#[test]
fn pixels_and_lengths_beyond_all_sense_are_refused_and_drop_no_view() {
    let folder = folder("far-away");
    let corners = corner_file();
    let last = corners.lines().last().expect("a line");
    let fields: Vec<&str> = last.split(',').collect();
    for (column, value) in [(2, "1e300"), (3, "-1e31"), (4, "1e300"), (5, "-1e7")] {
        let mut fields = fields.clone();
        fields[column] = value;
        fs::write(folder.join("c.csv"), corners.replace(last, &fields.join(","))).expect("written");
        refused(
            &folder,
            &["calibrate", "c.csv"],
            &[&format!("c.csv:{}", corners.lines().count()), value, "beyond"],
        );
    }
}

#[test]
fn a_study_with_a_field_that_would_be_lost_is_refused_by_the_name_of_the_field() {
    let folder = folder("study-fields");
    let again = "[[factor]]\nname = \"again\"\nset = [\"scene.noise_px\"]\nlevels = [0.2, 0.4]\n\n[[factor]]";
    let around = "[[factor]]\nname = \"views\"\nset = [\"scene.poses.views\"]\nlevels = [3, 4]\n\n[[factor]]\nname = \"poses\"\nset = [\"scene.poses\"]\n\
         levels = [{ kind = \"chapter\" }]\n\n[[factor]]";
    let estimator = |fields: &str| format!("[estimator]\n{fields}\n\n[trials]");
    let cases: [(&str, String, &[&str]); 10] = [
        ("[[factor]]", again.to_string(), &["scene.noise_px", "`again`", "`noise`", "set each field once"]),
        ("[[factor]]", around.to_string(), &["scene.poses.views", "`views`", "`poses`"]),
        ("[trials]", estimator("free = [\"fx\", \"fx\"]"), &["`fx` stands twice"]),
        ("[trials]", estimator("hold = { k2 = nan }"), &["`k2` is held at NaN"]),
        ("[trials]", estimator("hold = { k2 = inf }"), &["`k2` is held at inf"]),
        ("[trials]", estimator("loss = { kind = \"huber\", delta_px = nan }"), &["delta_px", "positive"]),
        ("[640, 480]", "[640, 480, 3]".to_string(), &["3 values in a list that has 2"]),
        ("[640, 480]", "[640]".to_string(), &["1 values in a list that has 2"]),
        ("redraw = true", "roll_deg = nan".to_string(), &["roll_deg", "finite"]),
        (
            "noise_px = 0.1\n",
            "noise_px = 0.1\nlength = { centre_mm = [nan, 0, 300], length_mm = 10 }\n".to_string(),
            &["scene.length.centre_mm", "finite"],
        ),
    ];
    for (from, to, words) in cases {
        let spec = crate::study::SPEC.replacen(from, &to, 1);
        assert_ne!(spec, crate::study::SPEC, "{from}");
        fs::write(folder.join("spec.toml"), spec).expect("written");
        refused(&folder, &["study", "run", "spec.toml", "--out", "out"], words);
        assert!(!folder.join("out").exists(), "{to}: nothing is begun");
    }
}

#[test]
fn a_plan_for_what_is_no_number_and_a_run_without_its_study_are_wrong_usage() {
    let folder = folder("no-number");
    fs::write(folder.join("spec.toml"), fixed_poses()).expect("written");
    let plan = ["study", "plan", "spec.toml", "--want"];
    let with = |rest: &[&'static str]| [&plan[..], rest].concat();
    refused(&folder, &with(&["fx=nan"]), &["NaN", "positive"]);
    refused(&folder, &with(&["fx=1", "--tilt", "nan"]), &["tilt_deg is NaN"]);
    refused(&folder, &with(&["fx=1", "--coverage", "0.5,nan"]), &["coverage is NaN"]);
    refused(&folder, &with(&["fx=1", "--distance", "nan"]), &["distance_mm is NaN"]);
    refused(&folder, &with(&["length=1", "--at", "0,0,300", "--length", "nan"]), &["length_mm is NaN"]);
    refused(&folder, &with(&["length=1", "--at", "nan,0,300", "--length", "10"]), &["centre_mm is NaN"]);
    assert_eq!(limited(&folder, &["study", "run", "spec.toml", "--out", "run"]).status.code(), Some(0));
    fs::remove_file(folder.join("run/spec.toml")).expect("removed");
    refused(&folder, &["study", "resume", "run"], &["run/spec.toml"]);
    refused(&folder, &["study", "merge", "run", "--out", "whole"], &["run/spec.toml"]);
}

#[test]
fn a_study_of_which_every_trial_is_refused_says_so_and_deviates() {
    let folder = folder("all-refused");
    // Views that face the camera determine no focal length.
    let poses = "poses = { kind = \"spread\", views = 3, tilt_deg = 0, coverage = 0.5, distance_mm = 150.0 }";
    let spec: Vec<&str> =
        crate::study::SPEC.lines().map(|line| if line.starts_with("poses") { poses } else { line }).collect();
    fs::write(folder.join("spec.toml"), spec.join("\n")).expect("written");
    let run = limited(&folder, &["study", "run", "spec.toml", "--out", "run"]);
    let said = text(&run.stderr);
    assert_eq!(run.status.code(), Some(1), "{said}");
    assert!(said.contains("NOTHING MEASURED: not one of the 90 trials of this study converged"), "{said}");
    assert!(folder.join("run/report.html").exists());
    // What one part holds is not all.
    let part = limited(&folder, &["study", "run", "spec.toml", "--shard", "0/2", "--out", "part"]);
    let said = text(&part.stderr);
    assert_eq!(part.status.code(), Some(0), "{said}");
    assert!(said.contains("NOTHING MEASURED"), "{said}");
}

#[test]
fn two_reports_in_one_file_and_a_reference_that_is_not_there_are_refused() {
    let folder = folder("gate-names");
    fs::create_dir_all(folder.join("sub")).expect("a folder is made");
    for (one, other) in [("r", "r"), ("r", "./r"), ("r", "sub/../r")] {
        let arguments = ["gate", "--samples", "1", "--json", one, "--html", other];
        refused(&folder, &arguments, &["--json and --html name one file", "/r"]);
        assert!(!folder.join("r").exists());
    }
    for reference in ["recorded/run", "./recorded", "recorded-last-week", "sub/"] {
        refused(
            &folder,
            &["gate", "--samples", "1", "--against", reference],
            &[reference, "calibench gate --record"],
        );
    }
    let against = limited(&folder, &["gate", "--samples", "1", "--against", "exit 1"]);
    assert!(against.status.code().is_some_and(|code| code < 2), "{}", text(&against.stderr));
}

/// Processes whose command names `word`.
fn named(word: &str) -> Vec<String> {
    let ids = fs::read_dir("/proc").into_iter().flatten().flatten();
    let ids = ids.filter_map(|entry| entry.file_name().into_string().ok());
    ids.filter(|id| {
        let command = fs::read(format!("/proc/{id}/cmdline")).unwrap_or_default();
        text(&command).contains(word) && runs(id)
    })
    .collect()
}

#[test]
fn a_solver_that_starts_itself_anew_all_the_time_ends_with_the_gate() {
    let folder = folder("respawn");
    let (script, stop) = (folder.join("calibench-respawns.sh"), folder.join("stop"));
    // In a session of its own each time, and without its environment. The file ends it where this test fails.
    let text_of = "[ -e stop ] && exit\necho $$ >> lives\nsleep 0.002\nenv -i PATH=\"$PATH\" setsid sh \"$0\" < /dev/null > /dev/null 2>&1 &\n";
    fs::write(&script, text_of).expect("written");
    let name = script.to_str().expect("a plain path");
    for _ in 0..5 {
        let solver = format!("sh {name}; while [ $(wc -l < lives) -lt 5 ]; do sleep 0.01; done; exit 1");
        let gate = Command::new(CALIBENCH)
            .args(["gate", "--samples", "1", "--timeout", "3", "--solver", &solver])
            .current_dir(&folder)
            .output()
            .expect("the program starts");
        std::thread::sleep(Duration::from_millis(100));
        let left = named(name);
        if !left.is_empty() {
            fs::write(&stop, "").expect("written");
        }
        assert_eq!(gate.status.code(), Some(1), "{}", text(&gate.stderr));
        assert!(left.is_empty(), "{left:?} still run");
        fs::remove_file(folder.join("lives")).expect("it lived");
    }
}
