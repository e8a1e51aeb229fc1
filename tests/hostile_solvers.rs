//! What does the gate do with solvers that mean no good? Those that write without end, start others, or
//! command the terminal.
#![cfg(target_os = "linux")]

use crate::hostile::{CALIBENCH, refused};
use crate::program::{folder, text};
use std::fs;
use std::process::{Command, Stdio};
use std::time::Duration;

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
        let arguments = [&["gate"][..], rest].concat();
        Command::new(CALIBENCH).args(arguments).current_dir(&folder).output().expect("the program starts")
    };
    let asked = ["--samples", "2", "--timeout", "5", "--solver", solver];
    let recorded = gate(&[&asked[..], &["--record", "r", "--json", "recorded.json"]].concat());
    assert_eq!(recorded.status.code(), Some(1), "{}", text(&recorded.stderr));
    assert!(text(&recorded.stdout).contains("NOT TRUSTED"), "{}", text(&recorded.stdout));
    let lines =
        |name: &str| fs::read_to_string(folder.join("r").join(name)).expect("written").lines().count();
    assert_eq!(lines("answers.jsonl"), lines("problems.jsonl"), "every problem has a line");
    let again = gate(&["judge", "r", "--json", "judged.json"]);
    assert_eq!(again.status.code(), Some(1), "{}", text(&again.stderr));
    let verdicts = |name: &str| -> Vec<serde_json::Value> {
        let report = fs::read_to_string(folder.join(name)).expect("written");
        let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
        let checks = report["checks"].as_array().expect("checks").iter();
        checks.map(|c| serde_json::json!([c["property"], c["scenario"], c["verdict"]])).collect()
    };
    assert_eq!(verdicts("recorded.json"), verdicts("judged.json"));
    for written in [["gate", "--record", "r", "--samples", "1"], ["gate", "export", "r", "--samples", "1"]] {
        refused(&folder, &written, &["r holds answers already"]);
    }
}

#[test]
fn options_of_the_gate_that_would_be_ignored_are_refused() {
    let folder = folder("ignored-options");
    for arguments in [
        &["gate", "certified", "--json", "report.json"][..],
        &["gate", "certified", "--samples", "3"],
        &["gate", "--samples", "2", "--size", "thorough"],
        &["gate", "--against", "builtin", "--junit", "report.xml"],
        &["gate", "--against", "builtin", "--html", "report.html"],
        &["gate", "judge", "r", "--scene", "four-pose"],
        &["gate", "hand-eye", "--accept", "unbiased"],
        &["gate", "detector", "--jobs", "2"],
        &["gate", "--timeout", "nan"],
        &["gate", "--jobs", "0"],
        &["gate", "certified", "--least-digits", "nan"],
        &["gate", "--samples", "1", "export", "b"],
        &["gate", "export", "b", "--json", "report.json"],
    ] {
        refused(&folder, arguments, &[]);
    }
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
