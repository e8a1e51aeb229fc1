//! What is said of input that nobody means well, or that is of another form? What it is and what was likely
//! meant, in words that command no terminal and begin no line of their own.
#![cfg(target_os = "linux")]

use crate::hostile::{CALIBENCH, PATIENCE, limited, refused, within};
use crate::program::{folder, text};
use std::fs;
use std::process::Command;

/// A file that was cut off behind its matrix looks like one of an ideal lens.
#[test]
fn a_lens_that_had_to_be_assumed_is_said_where_errors_are() {
    let folder = folder("assumed-lens");
    let yaml = "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: [600., 0., 320., 0., 600., 240., 0., 0., 1.]\n";
    fs::write(folder.join("cut.yaml"), yaml).expect("written");
    for verb in [["diff", "cut.yaml", "cut.yaml"], ["convert", "cut.yaml", "camera.json"]] {
        let output = limited(&folder, &verb);
        assert_eq!(output.status.code(), Some(0));
        assert!(
            text(&output.stderr).contains("cut.yaml: no distortion coefficients stand in the file"),
            "{verb:?}"
        );
    }
}

/// Whoever sends a file or gives it a name does not colour, move or clear a terminal by the message on it.
#[test]
fn wrong_usage_brings_no_escape_sequence_to_a_terminal() {
    let folder = folder("escapes");
    fs::write(folder.join("board.toml"), "board = \n\u{1b}[2J\u{1b}[31mall held\u{9b}1m = 5\n")
        .expect("written");
    for arguments in
        [["calibrate", "--board", "board.toml"], ["calibrate", "--board", "\u{1b}[2Jchess\u{9b}31m"]]
    {
        // As on a terminal.
        let mut command = Command::new(CALIBENCH);
        command.args(arguments).arg("a.png").env("CLICOLOR_FORCE", "1").current_dir(&folder);
        let output = command.output().expect("the program starts");
        assert_eq!(output.status.code(), Some(2));
        let said = text(&output.stderr);
        assert!(said.starts_with("error: invalid value") && !said.contains(['\u{1b}', '\u{9b}']), "{said:?}");
    }
    // Nor does it begin a line.
    for toml in [
        "board = \"cir\\nerror: all lost:9x7\"\ndrawn_mm = [1, 1]\nmeasured_mm = [1, 1]\n",
        "\"a\\nerror: all lost\" = 1\n",
    ] {
        fs::write(folder.join("board.toml"), toml).expect("written");
        let said = text(&within(PATIENCE, &folder, &["calibrate", "--board", "board.toml", "a.png"]).stderr);
        assert!(said.contains("\\u000aerror: all lost") && !said.contains("\nerror: all lost"), "{said}");
    }
    let named = r#"{"name": "a\nerror: all lost", "camera": {"fx": 600, "fy": 600, "cx": 320, "cy": 240}, "image_size": [640, 480]}"#;
    fs::write(folder.join("named.json"), named).expect("written");
    let said = text(&limited(&folder, &["convert", "named.json", "out.yaml", "--to", "kalibr"]).stdout);
    assert!(said.contains("\\u000aerror: all lost") && !said.contains("\nerror: all lost"), "{said}");
}

#[test]
fn what_is_likely_meant_is_said_of_tables_of_another_form() {
    let folder = folder("other-tables");
    let swapped: String = (0..6).map(|i| format!("mark,{i},0,0,{i},5\n")).collect();
    let header = "view,point,X,Y,u,v\n";
    let utf_16: Vec<u8> = "\u{feff}view,point".encode_utf16().flat_map(u16::to_le_bytes).collect();
    let marks = |sigma: &str| format!("view,point,X,Y,u,v,sigma_px\na,0,0,0,1,1,1\na,1,1,0,1,1,{sigma}\n");
    let cases: [(Vec<u8>, &str); 7] = [
        (format!("{header}{swapped}").into(), "are the columns view and point swapped?"),
        (utf_16, "the text is UTF-16: save it as UTF-8"),
        (
            format!("{header}a,0,0,0,371,2,5\n").into(),
            "7 fields where the header has 6: a comma is no decimal point",
        ),
        (
            format!("{header}a,0,0,0,\"371,2\",5\n").into(),
            "'371,2' is not a number: a comma is no decimal point",
        ),
        // A mark of an unfinished file: what stands behind it is missing, whatever the number says.
        (
            format!("{header}a,\"0\"\"\",0,0,371,2\n\nb,0,0,0,371,\"2\n").into(),
            "c.csv:4: a quotation mark stands open where the table ends",
        ),
        (marks("1e-300").into(), "c.csv:3: column 'sigma_px': 1e-300 is not within 1e-9 to 1e9"),
        (marks("1e20").replace("sigma_px", "weight").into(), "c.csv:3: column 'weight': 1e20 is not within"),
    ];
    for (table, words) in cases {
        fs::write(folder.join("c.csv"), table).expect("written");
        refused(&folder, &["calibrate", "c.csv"], &[words]);
    }
}

#[test]
fn options_say_what_they_expect_in_place_of_a_negative_number() {
    let folder = folder("negative");
    refused(
        &folder,
        &["diff", "a.json", "b.json", "--at", "-5"],
        &["'--at <MM>': expected a distance in mm, above 0"],
    );
    refused(
        &folder,
        &["next-pose", "a.json", "--want", "fx", "--distance", "-5,10"],
        &["invalid value '-5,10'", "a number above 0"],
    );
    let threads = ["study", "run", "s.toml", "--threads"];
    for no_number in ["-1", "1e3", "18446744073709551616"] {
        let words = format!("invalid value '{no_number}'");
        let told = [words.as_str(), "expected a whole number of 0 or more, below 2^64"];
        refused(&folder, &[&threads[..], &[no_number]].concat(), &told);
    }
    refused(&folder, &["gate", "--seed", "-1"], &["invalid value '-1'", "expected a whole number"]);
    refused(
        &folder,
        &["convert", "a.json", "/dev/null", "--to", "ros"],
        &["/dev/null", "name another place"],
    );
    refused(&folder, &["calibrate", "--board", "chess:9x6:-1", "a.png"], &["do not make a board"]);
}

/// Nothing is told of a camera from numbers that only a slip has.
#[test]
fn numbers_of_no_camera_are_refused_where_they_are_given() {
    let folder = folder("no-camera");
    let calibrate = |rest: [&'static str; 2]| [&["calibrate", "c.csv"][..], &rest].concat();
    refused(&folder, &calibrate(["--fix", "k1=1e300"]), &["k1 = 1e300, and at most 1e30"]);
    refused(&folder, &calibrate(["--fix", "fx=nan"]), &["fx = NaN px, and focal lengths are"]);
    refused(&folder, &calibrate(["--prior", "fx=-600+-1"]), &["fx = -6e2 px, and focal lengths are"]);
    refused(&folder, &calibrate(["--tie", "fy/fx=1e300"]), &["a ratio from 0.01 to 100"]);
    refused(&folder, &calibrate(["--sigma", "1e-300"]), &["a number of pixels from 1e-9 to 1e9"]);
    refused(
        &folder,
        &["tsai", "c.csv", "--image-size", "9x9", "--aspect", "1e300"],
        &["0.01 to 100, or free"],
    );
    let next = ["next-pose", "a.json", "--board", "chess:9x6:1mm", "--want", "fx", "--mark-sd", "1e-300"];
    refused(&folder, &next, &["a number of pixels from 1e-9 to 1e9"]);
    fs::write(folder.join("c.csv"), "view,point,u,v\n0,a,1,1\n").expect("written");
    fs::write(folder.join("t.csv"), "point,X,Y,Z,sd\na,0,0,0,0.01\nb,0,1,0,1e-300\n").expect("written");
    refused(
        &folder,
        &["calibrate", "c.csv", "--target", "t.csv"],
        &["t.csv:3: a standard deviation of 1e-300, and the least is 1e-15: give 0 where the mark is exact"],
    );
}

/// Programs of Windows begin text with a mark that is none of it.
#[test]
fn a_byte_order_mark_belongs_to_no_text() {
    let folder = folder("byte-order-mark");
    let camera = r#"{"camera": {"fx": 600, "fy": 600, "cx": 320, "cy": 240}, "image_size": [640, 480]}"#;
    fs::write(folder.join("plain.json"), camera).expect("written");
    fs::write(folder.join("marked.json"), format!("\u{feff}{camera}")).expect("written");
    let diff = limited(&folder, &["diff", "plain.json", "marked.json"]);
    assert_eq!(diff.status.code(), Some(0), "{}", text(&diff.stderr));
    assert_eq!(limited(&folder, &["gate", "--samples", "1", "--record", "g"]).status.code(), Some(0));
    let answers = folder.join("g/answers.jsonl");
    let given = fs::read_to_string(&answers).expect("recorded");
    fs::write(&answers, format!("\u{feff}{given}")).expect("written");
    let judged = limited(&folder, &["gate", "judge", "g"]);
    assert_eq!(judged.status.code(), Some(0), "{}", text(&judged.stdout));
}

#[test]
fn parts_whose_checkpoint_counts_wrongly_make_no_whole() {
    let folder = folder("miscounted");
    fs::write(folder.join("spec.toml"), crate::hostile::fixed_poses()).expect("written");
    assert_eq!(limited(&folder, &["study", "run", "spec.toml", "--out", "run"]).status.code(), Some(0));
    let checkpoint = folder.join("run/checkpoint.json");
    let kept = fs::read_to_string(&checkpoint).expect("written");
    let counted: serde_json::Value = serde_json::from_str(&kept).expect("JSON");
    let batches = counted["batches"].as_u64().expect("a number");
    let other = kept.replace(&format!("\"batches\":{batches}"), &format!("\"batches\":{}", batches + 1));
    assert_ne!(other, kept);
    fs::write(&checkpoint, other).expect("written");
    let words = format!("it counts {} batches, and trials.csv holds {batches}", batches + 1);
    for verb in [["study", "merge", "run", "--out", "whole"], ["study", "resume", "run", "--format", "json"]]
    {
        let output = limited(&folder, &verb);
        assert!(
            output.status.code() == Some(2) && text(&output.stderr).contains(&words),
            "{verb:?}: {}",
            text(&output.stderr)
        );
    }
    assert!(!folder.join("whole/trials.csv").exists());
}

/// Counts that no file of TOML can keep, and texts that no figure can.
#[test]
fn a_study_with_numbers_or_texts_that_cannot_be_kept_is_refused() {
    let folder = folder("unkept");
    let spec = crate::hostile::fixed_poses();
    for (from, to, words) in [
        ("image = [640, 480]", "image = [9223372036854775808, 480]", "beyond 9223372036854775807"),
        ("image = [640, 480]", "image = [18446744073709551615, 480]", "beyond 9223372036854775807"),
        ("question = \"", "question = \"a\\u001B[31m", "holds a control character"),
    ] {
        let changed = spec.replace(from, to);
        assert_ne!(changed, spec, "{from}");
        fs::write(folder.join("s.toml"), changed).expect("written");
        refused(&folder, &["study", "run", "s.toml", "--out", "r"], &[words]);
    }
}

/// Hours of a slow solver are not lost for a name that was wrong.
#[test]
fn answers_are_kept_where_the_report_cannot_be_written() {
    let folder = folder("kept-answers");
    // While it is asked, a folder appears where the report was to be.
    let solver = "mkdir -p report.json; cat";
    let gate = ["gate", "--solver", solver, "--scene", "four-pose", "--samples", "1", "--record", "g"];
    let reports = ["--json", "report.json", "--html", "report.html"];
    let output = limited(&folder, &[&gate[..], &reports].concat());
    assert_eq!(output.status.code(), Some(3), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("report.json") && !output.stdout.is_empty());
    assert!(folder.join("g/answers.jsonl").is_file() && folder.join("report.html").is_file());
    let judged = limited(&folder, &["gate", "judge", "g"]);
    assert_eq!(judged.status.code(), Some(1), "{}", text(&judged.stdout));
    // Nor is a report asked for where there is none.
    refused(&folder, &["gate", "faults", "--json", "r.json"], &["unexpected argument '--json'"]);
    refused(&folder, &["gate", "power", "p", "--json", "r.json"], &["unexpected argument '--json'"]);
}
