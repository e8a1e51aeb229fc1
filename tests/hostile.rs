//! What does the command do with input that nobody means well? It says what is wrong, in time and in little
//! memory, and loses nothing.
#![cfg(target_os = "linux")]

use crate::program::{folder, text};
use std::fs;
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

pub const CALIBENCH: &str = env!("CARGO_BIN_EXE_calibench");

/// Address space that a run may take: threads reserve much and use little.
const ADDRESS_SPACE_KIB: u64 = 4 << 20;
/// Time within which a refusal must come. It takes a few milliseconds; this is for a machine with other work.
pub const PATIENCE: Duration = Duration::from_secs(20);
/// The same for a small study, which takes a second of work.
pub const PATIENCE_FOR_WORK: Duration = Duration::from_secs(300);

/// Runs the command with little memory, to its end.
pub fn limited(folder: &Path, arguments: &[&str]) -> Output {
    within(PATIENCE_FOR_WORK, folder, arguments)
}

/// Runs the command with little memory and little time.
pub fn within(patience: Duration, folder: &Path, arguments: &[&str]) -> Output {
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
pub fn refused(folder: &Path, arguments: &[&str], words: &[&str]) {
    let output = within(PATIENCE, folder, arguments);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    for word in words {
        assert!(said.contains(word), "{arguments:?} does not say `{word}`: {said}");
    }
    assert!(!said.contains("panicked"), "{said}");
}

#[test]
fn a_program_that_is_not_there_is_refused_before_it_is_asked() {
    let folder = folder("no-program");
    for gate in [&["gate"][..], &["gate", "certified"], &["gate", "detector"], &["gate", "hand-eye"]] {
        for name in ["/nonexistent", "no-such-program", "./none.py"] {
            refused(&folder, &[gate, &["--solver", name]].concat(), &[name, "no such program"]);
        }
    }
    std::fs::write(folder.join("plan.toml"), crate::study::SPEC).unwrap();
    refused(
        &folder,
        &["study", "run", "plan.toml", "--solver", "/nonexistent", "--out", "run"],
        &["no such program"],
    );
}

#[test]
fn json_that_is_no_camera_is_refused_in_words_of_cameras() {
    let folder = folder("no-camera");
    for text in ["[]", "3", "\"camera\"", "null"] {
        std::fs::write(folder.join("camera.json"), text).unwrap();
        refused(&folder, &["diff", "camera.json", "camera.json"], &["an object with `camera`"]);
    }
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
    let most = u64::MAX.to_string();
    refused(&folder, &[&plan[..], &["--most-views", &most]].concat(), &["--most-views 18446744073709551615"]);
    refused(&folder, &["study", "measure", "plan.toml", "--trials", "18446744073709551615"], &["limit"]);
    refused(&folder, &["study", "run", "plan.toml", "--shard", "0/1000000000000"], &["1000000"]);
    refused(&folder, &["gate", "--samples", "1000000000000"], &["100000"]);
    refused(&folder, &["gate", "--jobs", "1000000000", "--solver", "true"], &["1024"]);
    refused(&folder, &["gate", "--timeout", "1e300", "--solver", "true"], &["a day"]);
    let many = ["ninepoint", "none.png", "--columns", "4294967296", "--rows", "4294967296"];
    refused(&folder, &many, &["1000000"]);
}

/// The small study with one set of poses for all trials, which begins at once.
pub fn fixed_poses() -> String {
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
pub fn corner_file() -> String {
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
pub fn target_file() -> String {
    let views = calibench::synth::Scene::example().exact();
    let marks = views[0].pairs().enumerate().map(|(i, (at, _))| format!("{i},{},{},0,0.01\n", at.x, at.y));
    "point,X,Y,Z,sd\n".to_string() + &marks.collect::<String>()
}

pub const PAIRS: &str = "point,px,py,X,Y\n0,0,0,0,0\n1,100,0,1,0\n2,0,100,0,1\n3,100,101,1,1\n";

#[test]
fn a_photograph_that_needs_more_memory_than_there_is_is_refused_before_it_is_decoded() {
    let folder = folder("memory");
    // 14000 x 14000 px of 16 bits, of which the file has none.
    fs::write(folder.join("large.pgm"), "P5\n14000 14000\n65535\n").expect("written");
    let camera = r#"{"camera": {"fx": 600, "fy": 600, "cx": 320, "cy": 240}}"#;
    fs::write(folder.join("camera.json"), camera).expect("written");
    let need = ["large.pgm: needs some 3144388608 bytes of memory", "limit is 2147483648", "--memory"];
    refused(&folder, &["calibrate", "--board", "dots:3x3:1", "large.pgm"], &need);
    refused(&folder, &["ninepoint", "large.pgm"], &need);
    let run = ["run", "nine-point", "--image", "large.pgm", "--out", "o"];
    refused(&folder, &run, &["large.pgm: needs some 3144388608 bytes of memory", "fewer pixels"]);
    let more = ["large.pgm: needs some 7848388608 bytes of memory", "--memory"];
    refused(&folder, &["undistort", "--camera", "camera.json", "--out", "o", "large.pgm"], &more);
    // With the memory it asks for, the file is found to be cut off.
    refused(&folder, &["ninepoint", "--memory", "8GiB", "large.pgm"], &["broken image"]);
    refused(&folder, &["ninepoint", "--memory", "much", "large.pgm"], &["2GiB"]);
}

#[test]
fn a_jpeg_that_is_long_for_its_image_is_refused_before_it_is_read() {
    let folder = folder("long-jpeg");
    // 8 x 8 px of one component, a scan of as many zeros as fill the file, and the end.
    let head = b"\xff\xd8\xff\xc0\0\x0b\x08\0\x08\0\x08\x01\x01\x11\0\xff\xda\0\x08\x01\x01\0\0\x3f\0";
    let mut file = fs::File::create(folder.join("long.jpg")).expect("made");
    file.write_all(head).expect("written");
    file.seek(SeekFrom::Start(599_999_998)).expect("sought");
    file.write_all(b"\xff\xd9and what follows").expect("written");
    let need = ["long.jpg: needs some 1200000896 bytes of memory", "limit is 1000000000", "--memory"];
    refused(&folder, &["ninepoint", "--memory", "1GB", "long.jpg"], &need);
    refused(&folder, &["calibrate", "--board", "dots:3x3:1", "--memory", "1GB", "long.jpg"], &need);
}

#[test]
fn a_photograph_of_another_size_than_the_cameras_is_refused_before_it_is_decoded() {
    let folder = folder("other-size");
    // The file has none of its pixels: whoever decodes it finds it broken.
    fs::write(folder.join("photo.pgm"), "P5\n64 48\n255\n").expect("written");
    let camera = r#"{"camera": {"fx": 600, "fy": 600, "cx": 320, "cy": 240}, "image_size": [640, 480]}"#;
    fs::write(folder.join("camera.json"), camera).expect("written");
    refused(
        &folder,
        &["undistort", "--camera", "camera.json", "--out", "o", "photo.pgm"],
        &["photo.pgm: 64 x 48 px, but camera.json is of 640 x 480 px images"],
    );
}

#[test]
fn a_length_comes_where_the_noise_has_hardly_a_part_and_numbers_without_end_are_refused() {
    let folder = folder("numbers-without-end");
    fs::write(folder.join("c.csv"), corner_file()).expect("written");
    let made = limited(&folder, &["calibrate", "c.csv", "--image-size", "640x480", "--out", "run"]);
    assert_eq!(made.status.code(), Some(0), "{}", text(&made.stderr));
    let measure = ["measure", "run/result.json", "--view", "0", "--pixels", "200,200,300,250", "--mark-sd"];
    // Effective degrees of freedom without end, of which Student's quantile never came.
    for deviation in ["1e-9", "0.1", "1e30"] {
        let output = within(PATIENCE, &folder, &[&measure[..], &[deviation]].concat());
        assert_eq!(output.status.code(), Some(0), "{deviation}: {}", text(&output.stderr));
        assert!(text(&output.stdout).contains("interval of 95 %"), "{}", text(&output.stdout));
    }
    fs::write(folder.join("m.csv"), "point,X,Y\n1,0,0\n2,10,0\n3,0,10\n4,10,10\n").expect("written");
    fs::write(folder.join("h.csv"), "when,value\n1,10\n2,10.1\n").expect("written");
    let check = ["check-reference", "h.csv", "--reference", "10", "--sd"];
    refused(&folder, &["register", "m.csv", "m.csv", "--at", "1e308,0"], &["1e30"]);
    refused(&folder, &[&check[..], &["1e308"]].concat(), &["1e30"]);
    refused(&folder, &["check-reference", "h.csv", "--sd", "1", "--reference", "-1e308"], &["1e30"]);
}

/// A slip in one line of a file that says where each mark is again and again.
#[test]
fn a_mark_that_one_view_has_at_another_place_than_all_others_is_named() {
    let folder = folder("misplaced");
    let corners = corner_file();
    let (number, line) = corners.lines().enumerate().nth(200).expect("a line");
    let fields: Vec<&str> = line.split(',').collect();
    let x: f64 = fields[2].parse().expect("a number");
    let with = |x: f64| {
        let moved = [fields[0], fields[1], &x.to_string(), fields[3], fields[4], fields[5]].join(",");
        fs::write(folder.join("c.csv"), corners.replace(line, &moved)).expect("written");
        let output = limited(&folder, &["calibrate", "c.csv"]);
        assert_eq!(output.status.code().map(|code| code == 2), Some(false), "{}", text(&output.stderr));
        text(&output.stdout) + &text(&output.stderr)
    };
    let place = format!("c.csv:{}: point", number + 1);
    let said = with(x + 2.5);
    let sentence = format!("{place} '{}' of view '{}' is at ({}, ", fields[1], fields[0], x + 2.5);
    assert!(said.contains(&sentence) && said.contains("in all 3 other views"), "{said}");
    assert!(!with(x).contains(&place), "{}", with(x));
}

#[test]
fn names_of_many_marks_are_compared_in_their_order_and_not_each_with_all() {
    let folder = folder("many-names");
    let marks: String = (0..150_000).map(|i| format!("mark{i},{},{}\n", i % 400, i / 400)).collect();
    fs::write(folder.join("m.csv"), format!("point,X,Y\n{marks}")).expect("written");
    let started = Instant::now();
    let output = limited(&folder, &["register", "m.csv", "m.csv", "--format", "json", "--out", "o"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(started.elapsed() < PATIENCE, "{:?}", started.elapsed());
}

#[test]
fn marks_outside_of_the_image_are_refused_and_swapped_sides_are_named() {
    let folder = folder("image-size");
    fs::write(folder.join("c.csv"), corner_file()).expect("written");
    let with = |size: &'static str| ["calibrate", "c.csv", "--image-size", size];
    assert_eq!(limited(&folder, &with("640x480")).status.code(), Some(0));
    refused(&folder, &with("480x640"), &["outside", "640x480", "swapped"]);
    refused(&folder, &with("10x10"), &["lie outside of the image of 10 x 10 px"]);
    // So do the other verbs that are told a size.
    let solid = corner_file().replace("X,Y,u,v", "X,Y,Z,u,v");
    let solid: Vec<String> = solid
        .lines()
        .enumerate()
        .map(|(i, line)| {
            let mut fields: Vec<&str> = line.split(',').collect();
            if i > 0 {
                fields.insert(4, "0");
            }
            fields.join(",")
        })
        .collect();
    fs::write(folder.join("z.csv"), solid.join("\n") + "\n").expect("written");
    refused(&folder, &["tsai", "z.csv", "--image-size", "480x640"], &["outside", "640x480", "swapped"]);
    refused(&folder, &["noise", "c.csv", "--image-size", "480x640"], &["outside", "640x480", "swapped"]);
    refused(&folder, &with("18446744073709551615x18446744073709551615"), &["1048576"]);
    refused(&folder, &with("36893488147419103232x480"), &["expected WIDTHxHEIGHT"]);
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
fn noise_beyond_numbers_is_refused_before_the_first_trial() {
    let folder = folder("noise");
    let study = fixed_poses().replace("levels = [0.1, 0.3]", "levels = [0.1, 1e308]");
    assert!(study.contains("1e308"));
    fs::write(folder.join("study.toml"), study).expect("written");
    refused(&folder, &["study", "run", "study.toml", "--out", "run"], &["noise_px", "below 1e6"]);
    assert!(!folder.join("run").exists());
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

/// A quotation mark that stands open makes one field of all that follows it; blank lines, however many, are
/// harmless.
#[test]
fn an_open_quotation_mark_is_refused_before_the_rest_is_kept() {
    let folder = folder("open-quote");
    for (name, begins) in [("row.csv", "view,point,X,Y,u,v\n0,\""), ("header.csv", "view,\"point\n")] {
        fs::write(folder.join(name), [begins, &"1,2\n".repeat(600_000)].concat()).expect("written");
        refused(&folder, &["calibrate", name], &[name, "quotation mark stands open"]);
    }
    let blank = "\r\n".repeat(800_000);
    let table = [&blank, "view,point,X,Y,u,v\n", &blank, "0,0,1,1,5,x\n"].concat();
    fs::write(folder.join("blank.csv"), table).expect("written");
    refused(&folder, &["calibrate", "blank.csv"], &["blank.csv:1600002", "'x'"]);
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
    let manifest = fs::read(folder.join("run/manifest.json")).expect("written");
    fs::write(folder.join("run/manifest.json"), b"\xff\xfe").expect("written");
    refused(&folder, &["study", "resume", "run"], &["run/manifest.json is damaged", "begin again"]);
    fs::write(folder.join("run/manifest.json"), manifest).expect("written");
    let [trials, away] = ["run/trials.csv", "run/away"].map(|name| folder.join(name));
    fs::rename(&trials, &away).expect("moved");
    refused(&folder, &["study", "merge", "run", "--out", "whole"], &["run/trials.csv"]);
    fs::rename(&away, &trials).expect("moved");
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

/// Numbers with which nothing can be calculated end neither as NaN nor as a picture.
#[test]
fn a_camera_whose_numbers_overflow_is_no_camera_in_any_verb() {
    let folder = folder("absurd-camera");
    let camera = |fx: &str, cx: &str, k1: &str| {
        format!(
            "{{\"camera\": {{\"fx\": {fx}, \"fy\": 600, \"cx\": {cx}, \"cy\": 240, \"k1\": {k1}}}, \"image_size\": [640, 480]}}"
        )
    };
    fs::write(folder.join("fine.json"), camera("600", "320", "0")).expect("written");
    for (fx, cx, k1) in
        [("600", "1e308", "0"), ("600", "320", "-1e308"), ("1e-308", "320", "0"), ("1e308", "320", "0")]
    {
        fs::write(folder.join("absurd.json"), camera(fx, cx, k1)).expect("written");
        let words = ["absurd.json: ", "e308"].map(|word| if fx == "1e-308" { "e-" } else { word });
        refused(&folder, &["diff", "fine.json", "absurd.json"], &words);
        refused(&folder, &["undistort", "--camera", "absurd.json", "photo.png", "--out", "out"], &words);
        refused(&folder, &["convert", "absurd.json", "out.yaml", "--to", "ros"], &words);
    }
    let beyond = r#"{"camera": {"model": "double-sphere", "fx": 300, "fy": 300, "cx": 320, "cy": 240, "xi": 0, "alpha": 1.1}, "image_size": [640, 480]}"#;
    fs::write(folder.join("beyond.json"), beyond).expect("written");
    refused(
        &folder,
        &["convert", "beyond.json", "out.yaml", "--to", "kalibr"],
        &["alpha = 1.1", "from 0 to 1"],
    );
    let yaml =
        "%YAML:1.0\n---\ncamera_matrix: [600., 0., 1e300, 0., 600., 240., 0., 0., 1.]\nD: [0., 0., 0., 0.]\n";
    fs::write(folder.join("far.yaml"), yaml).expect("written");
    refused(&folder, &["convert", "far.yaml", "out.txt", "--to", "colmap"], &["far.yaml: cx = 1e300"]);
}

/// What is computed from numbers within all limits may be beyond numbers all the same: it is refused, and not
/// told as NaN.
#[test]
fn a_length_beyond_numbers_and_one_of_no_place_are_refused() {
    let folder = folder("no-length");
    fs::write(folder.join("c.csv"), corner_file()).expect("written");
    let calibrated = limited(&folder, &["calibrate", "c.csv", "--image-size", "640x480", "--out", "r"]);
    assert_eq!(calibrated.status.code(), Some(0));
    let measure =
        |rest: &[&'static str]| [&["measure", "r/result.json", "--pixels", "200,200,300,250"], rest].concat();
    let cases: [(&[&str], &str); 5] = [
        (&["--pose", "0,0,0,0,0,100", "--mark-sd", "1e300"], "a number from 0 to 1e30"),
        (&["--pose", "0,0,0,0,0,1e150"], "6 numbers of at most 1e30"),
        (&["--pose", "0,0,0,0,0,100", "--pose-sd", "1e200,0,0,0,0,0"], "6 numbers from 0 to 1e30"),
        (&["--pose", "0,0,0,0,0,100", "--pose-sd", "-1,0,0,0,0,0"], "6 numbers from 0 to 1e30"),
        (&["--pose", "1.5707963267948966,0,0,0,0,100"], "the plane goes through the camera's centre"),
    ];
    for (rest, word) in cases {
        refused(&folder, &measure(rest), &[word]);
    }
    // Some materials shrink when they are heated.
    let shrinks = measure(&["--pose", "0,0,0,0,0,100", "--temperature-sd", "2", "--expansion", "-1e-6"]);
    assert_eq!(limited(&folder, &shrinks).status.code(), Some(0));
    let history = format!("when,value\n{}", "a,25\n".repeat(100_001));
    fs::write(folder.join("history.csv"), history).expect("written");
    let check = ["check-reference", "history.csv", "--reference", "25", "--sd", "0.1"];
    refused(&folder, &check, &["100001 checks, and the limit is 100000"]);
}
