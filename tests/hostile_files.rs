//! What becomes of files in the hands of nobody who means well? Pipes, links, full disks, closed outputs:
//! nothing waits for ever, nothing is lost.
#![cfg(target_os = "linux")]

use crate::hostile::{
    CALIBENCH, PAIRS, PATIENCE, PATIENCE_FOR_WORK, corner_file, fixed_poses, limited, refused, target_file,
    within,
};
use crate::program::{folder, text};
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

#[test]
fn marks_and_pictures_of_an_earlier_run_beside_a_result_are_named() {
    let folder = folder("earlier-run");
    fs::write(folder.join("c.csv"), corner_file()).expect("written");
    fs::create_dir_all(folder.join("o/overlay")).expect("made");
    let run = || limited(&folder, &["calibrate", "c.csv", "--out", "o"]);
    let alone = run();
    assert_eq!(alone.status.code(), Some(0), "{}", text(&alone.stderr));
    assert!(!text(&alone.stderr).contains("earlier run"), "{}", text(&alone.stderr));
    // Its own input is of this result, wherever it lies.
    fs::create_dir_all(folder.join("own")).expect("made");
    fs::write(folder.join("own/corners.csv"), corner_file()).expect("written");
    let own = limited(&folder, &["calibrate", "own/corners.csv", "--out", "own"]);
    assert!(own.status.code() == Some(0) && !text(&own.stderr).contains("earlier"), "{}", text(&own.stderr));
    for file in ["o/corners.csv", "o/overlay/001-a.png"] {
        fs::write(folder.join(file), "").expect("written");
    }
    let said = text(&run().stderr);
    for file in ["corners.csv", "001-a.png"] {
        assert!(said.contains(&format!("{file} is of an earlier run")), "{said}");
    }
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

/// What is no table is quoted in a few words, however long its first line, its names and its numbers.
#[test]
fn megabytes_without_a_comma_or_a_line_end_are_told_in_a_sentence() {
    let folder = folder("no-table");
    let long = "7x".repeat(250_000);
    let files = [
        ("nul", "\0".repeat(4_000_000), "nul:1: a line of more than 1048576 bytes"),
        ("header", "\0".repeat(500_000), "is missing: the header is"),
        (
            "line",
            format!("view,point,X,Y,u,v\na,1,0,0,3,4\na,2,{},2,3,4\n", long.repeat(4)),
            "line:3: a line of more than",
        ),
        ("name", format!("view,point,X,Y,u,v\n{long},1,0,0,3,4\n"), "is longer than 4096 bytes"),
        ("number", format!("view,point,X,Y,u,v\na,1,{long},2,3,4\n"), "is not a number"),
    ];
    for (name, content, expected) in files {
        fs::write(folder.join(name), content).expect("written");
        let output = limited(&folder, &["calibrate", name, "--image-size", "640x480"]);
        let said = text(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains(expected), "{name}: {}", said.len());
        assert!(said.len() < 2500, "{name}: {} bytes", said.len());
    }
}

/// Linux calls it a regular file, and reading it waits for the next message of the system, where this user
/// may read it at all.
#[test]
fn a_file_of_the_system_that_waits_for_its_next_line_blocks_nobody() {
    let folder = folder("waiting");
    let name = "/proc/kmsg";
    fs::write(folder.join("camera.json"), r#"{"camera": {"fx": 600, "fy": 600, "cx": 320, "cy": 240}}"#)
        .expect("written");
    for arguments in [
        &["calibrate", name][..],
        &["calibrate", "--board", "dots:3x3:1", name],
        &["undistort", "--camera", name, "--out", "o", "a.png"],
        &["convert", name, "o.xml"],
        &["study", "run", name],
        &["gate", "--allow", name],
    ] {
        refused(&folder, arguments, &[name]);
    }
}

#[test]
fn a_pipe_in_the_place_of_a_boards_file_blocks_nobody_and_is_left_as_it_is() {
    let folder = folder("board-pipe");
    assert!(Command::new("mkfifo").arg(folder.join("board.toml")).status().expect("mkfifo").success());
    let output = within(PATIENCE, &folder, &["board", "circles:9x7:10mm:3mm", "--out", "."]);
    let said = text(&output.stderr);
    assert!(output.status.code() == Some(3) && said.contains("board.toml"), "{:?} {said}", output.status);
    assert!(!folder.join("board.pdf").exists(), "half of what belongs together");
}

#[test]
fn nothing_is_written_to_a_file_of_the_name_of_standard_output() {
    let folder = folder("standard-output");
    fs::write(folder.join("camera.json"), r#"{"camera": {"fx": 600, "fy": 600, "cx": 320, "cy": 240}}"#)
        .expect("written");
    let output = "- is no file to write";
    refused(&folder, &["convert", "camera.json", "-", "--to", "opencv-yaml"], &[output]);
    refused(&folder, &["convert", "chess:9x6:25mm", "-"], &[output]);
    refused(&folder, &["gate", "--samples", "1", "--json", "-"], &[output]);
    assert!(!folder.join("-").exists());
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
    refused(&folder, &["gate", "power-table", "."], &["faults.csv", "not a regular file"]);
    refused(&folder, &["gate", "digits-table", "faults.csv"], &["faults.csv", "not a regular file"]);
    refused(&folder, &["run", "nine-point", "--image", "faults.csv"], &["faults.csv", "not a regular file"]);
    // A source tree whose files are pipes: there is no snapshot, and there are no certified problems.
    fs::write(folder.join("golden/published.toml"), "").expect("written");
    refused(&folder, &["gate", "certified"], &["SHA256SUMS", "not a regular file"]);
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
        let word = if name == "manifest.json" { "holds no run" } else { "a pipe or a device" };
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

#[test]
#[cfg_attr(not(calibench_mounts), ignore = "needs the right to mount a file system (Linux)")]
fn a_full_disk_is_not_wrong_usage_and_its_file_is_named_once() {
    let folder = folder("full-disk");
    let disk = folder.join("disk");
    fs::create_dir_all(&disk).expect("a folder is made");
    assert!(crate::writers::mount(&disk, "size=64k"));
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

/// The answers that are judged are no place for a report on them.
#[test]
fn no_report_replaces_the_answers_that_it_is_of() {
    let folder = folder("judged");
    let recorded = limited(
        &folder,
        &["gate", "--scene", "few-points", "--models", "brown-conrady", "--samples", "3", "--record", "rec"],
    );
    assert!(folder.join("rec/answers.jsonl").exists(), "{}", text(&recorded.stderr));
    for (option, file) in
        [("--json", "answers.jsonl"), ("--json", "manifest.json"), ("--html", "problems.jsonl")]
    {
        let before = fs::read(folder.join("rec").join(file)).expect("it is there");
        let output = limited(&folder, &["gate", "judge", "rec", option, &format!("rec/{file}")]);
        let said = text(&output.stderr);
        assert!(output.status.code() == Some(3) && said.contains("given to read"), "{file}: {said}");
        assert!(fs::read(folder.join("rec").join(file)).expect("it is there") == before, "{file}");
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
    for arguments in ["list", "--help", "study --help", "gate faults"] {
        let output = by_shell(&folder, &format!("exec \"$0\" {arguments} >&-"));
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(3), "{arguments}: {said}");
        assert!(said.contains("standard output") && said.contains("closed"), "{arguments}: {said}");
    }
    // Nothing was to be printed, or nobody wants to read it.
    for line in [
        "exec \"$0\" gate schema out >&-",
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
        &["explain", name],
        &["gate", "judge", name],
        &["gate", "power-table", name],
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
