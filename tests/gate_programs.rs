//! How does the gate hold programs that hang, crash, babble or greet? It asks them while that makes sense,
//! and leaves none behind.
#![cfg(unix)]

use crate::gate::{CALIBENCH, folder, gate, problems};
use calibench::camera::Model;
use calibench_gate::accept::{Breakage, Outcome};
use calibench_gate::{Process, Solver};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

fn breakages(command: &str, seconds: f64, count: usize) -> Vec<Breakage> {
    let process = Process::new(command, Duration::from_secs_f64(seconds), 1);
    let replies = process.ask_all(&problems(count));
    let broken = |outcome| match outcome {
        Outcome::Broken(breakage) => breakage,
        other => panic!("{command}: {other:?}"),
    };
    replies.into_iter().map(|reply| broken(reply.outcome)).collect()
}

#[test]
fn a_program_that_hangs_is_ended_and_at_last_not_asked_any_more() {
    let started = Instant::now();
    let seen = breakages("sleep 1000", 0.2, 5);
    assert!(seen[..3].iter().all(|b| matches!(b, Breakage::Timeout { .. })), "{seen:?}");
    assert!(seen[3..].iter().all(|b| matches!(b, Breakage::NotAsked(_))), "{seen:?}");
    // Three times 0.2 s; the rest is for a busy machine.
    assert!(started.elapsed() < Duration::from_secs(30));
}

#[test]
fn a_judged_program_is_stopped_by_another_thread_and_no_other_with_it() {
    let start = |command| Process::new(command, Duration::from_secs(600), 2);
    let (stopped, other) = (start("sleep 1000"), start("sleep 1001"));
    let begun = Instant::now();
    std::thread::scope(|scope| {
        let asked = scope.spawn(|| stopped.ask_all(&problems(6)));
        let goes_on = scope.spawn(|| other.ask_all(&problems(2)));
        std::thread::sleep(Duration::from_millis(300));
        stopped.stop();
        let replies = asked.join().expect("no panic");
        assert_eq!(replies.len(), 6);
        assert!(replies.iter().all(|reply| matches!(
            &reply.outcome,
            Outcome::Broken(Breakage::Crashed { .. } | Breakage::NotAsked(_))
        )));
        assert!(!goes_on.is_finished(), "the other program was ended too");
        other.stop();
        goes_on.join().expect("no panic");
    });
    assert!(
        stopped
            .ask_all(&problems(1))
            .iter()
            .all(|reply| matches!(reply.outcome, Outcome::Broken(Breakage::NotAsked(_))))
    );
    // 600 s are allowed a problem.
    assert!(begun.elapsed() < Duration::from_secs(120));
}

#[test]
fn an_interrupted_gate_leaves_no_program_behind() {
    let out = folder("gate-interrupted");
    std::fs::create_dir_all(&out).expect("a folder");
    let id_file = out.join("id");
    let solver = format!("echo $$ > {}; sleep 1000", id_file.display());
    let gate = Command::new(CALIBENCH).args(["gate", "--solver", &solver]).stderr(Stdio::null()).spawn();
    let mut gate = gate.expect("the program starts");
    let patience = Instant::now() + Duration::from_secs(60);
    let id = loop {
        let id = std::fs::read_to_string(&id_file).unwrap_or_default().trim().to_string();
        if !id.is_empty() {
            break id;
        }
        assert!(Instant::now() < patience, "the solver was never started");
        std::thread::sleep(Duration::from_millis(20));
    };
    let signal = |name: &str, id: &str| Command::new("kill").args([name, id]).stderr(Stdio::null()).status();
    assert!(signal("-INT", &gate.id().to_string()).expect("kill runs").success());
    assert_eq!(gate.wait().expect("it ends").code(), Some(3));
    // Ended, and perhaps not yet collected by the system.
    let runs = |id: &str| {
        std::fs::read_to_string(format!("/proc/{id}/stat")).is_ok_and(|text| !text.contains(") Z "))
    };
    while runs(&id) {
        assert!(Instant::now() < patience, "process {id} still runs");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// What an interrupt ended broke no rule: nothing is said of the solver, and the code is that of an
/// interrupt.
#[test]
fn an_interrupted_gate_blames_nobody() {
    for verb in ["hand-eye", "detector"] {
        let out = folder(&format!("gate-blames-{verb}"));
        std::fs::create_dir_all(&out).expect("a folder");
        let id_file = out.join("id");
        let solver = format!("echo $$ > {}; exec sleep 1000", id_file.display());
        let gate = Command::new(CALIBENCH)
            .args(["gate", verb, "--solver", &solver])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let gate = gate.expect("the program starts");
        let patience = Instant::now() + Duration::from_secs(120);
        while std::fs::read_to_string(&id_file).unwrap_or_default().trim().is_empty() {
            assert!(Instant::now() < patience, "the solver was never started");
            std::thread::sleep(Duration::from_millis(20));
        }
        let told = Command::new("kill").args(["-INT", &gate.id().to_string()]).status();
        assert!(told.expect("kill runs").success());
        let output = gate.wait_with_output().expect("it ends");
        let text = String::from_utf8_lossy(&output.stdout);
        assert_eq!((output.status.code(), text.as_ref()), (Some(3), ""), "{verb}");
    }
}

#[test]
fn a_program_that_crashes_is_quoted() {
    let seen = breakages("echo out of memory >&2; exit 7", 20.0, 1);
    assert!(
        matches!(&seen[0], Breakage::Crashed { how, stderr } if how.contains('7') && stderr == "out of memory"),
        "{seen:?}"
    );
    let missing = breakages("/no/such/program", 20.0, 1);
    assert!(matches!(&missing[0], Breakage::Crashed { .. }), "{missing:?}");
}

#[test]
fn a_program_that_breaks_on_bad_input_is_asked_again() {
    // Answers the first problem of every start, then ends: no two answers in a row, and yet it is never given
    // up.
    let once =
        r#"read line; printf '%s\n' "$line" | sed 's/^{"id":"\([^"]*\)".*/{"id":"\1","status":"refused"}/'"#;
    let process = Process::new(once, Duration::from_secs(20), 1);
    let replies = process.ask_all(&problems(9));
    let crashed = |outcome: &Outcome| matches!(outcome, Outcome::Broken(Breakage::Crashed { .. }));
    let refused = |outcome: &Outcome| matches!(outcome, Outcome::Refused(_));
    assert!(refused(&replies[0].outcome), "{replies:?}");
    assert!(replies.iter().all(|r| crashed(&r.outcome) || refused(&r.outcome)), "{replies:?}");
}

/// A program that says `greeting`, does nothing for `seconds`, and then refuses whatever it is asked.
pub fn greets_and_refuses(greeting: &str, seconds: f64) -> String {
    let refuses = r#"sed -u 's/^{"id":"\([^"]*\)".*/{"id":"\1","status":"refused"}/'"#;
    format!("echo '{greeting}'; sleep {seconds}; {refuses}")
}

#[test]
fn a_program_that_announces_its_warm_up_is_given_it() {
    let answers = |greeting: &str| {
        let process = Process::new(&greets_and_refuses(greeting, 1.5), Duration::from_millis(500), 1);
        let replies = process.ask_all(&problems(2));
        replies.iter().all(|reply| matches!(reply.outcome, Outcome::Refused(_)))
    };
    assert!(answers(r#"{"protocol": 2, "warm_up_seconds": 60}"#));
    assert!(!answers(r#"{"protocol": 2}"#));
    assert!(!answers("warming up for 60 seconds"));
}

#[test]
fn a_program_is_asked_what_it_says_it_knows() {
    let known = |greeting: &str| {
        Process::new(&greets_and_refuses(greeting, 0.0), Duration::from_secs(20), 1).models()
    };
    assert_eq!(known(r#"{"protocol": 2, "models": ["kannala-brandt", "splined"]}"#), [Model::KannalaBrandt]);
    assert_eq!(known(r#"{"protocol": 2}"#), [Model::BrownConrady]);
    let malformed = breakages(&greets_and_refuses(r#"{"protocol": 2, "models": "rational"}"#, 0.0), 20.0, 1);
    assert!(
        matches!(&malformed[0], Breakage::Garbage { reason, .. } if reason.contains("greeting is malformed")),
        "{malformed:?}"
    );
    assert_eq!(Process::new("exit 1", Duration::from_secs(20), 1).models(), [Model::BrownConrady]);
    // Who names nothing that can be asked is not trusted for it.
    let nothing = gate(&["--solver", &greets_and_refuses(r#"{"protocol": 2, "models": ["Division"]}"#, 0.0)]);
    assert_eq!(nothing.status.code(), Some(1));
    assert!(
        String::from_utf8_lossy(&nothing.stderr)
            .contains("NOT TRUSTED: the program's greeting names no lens")
    );
    let greeting = r#"{"protocol": 2, "models": ["division"]}"#;
    let output = gate(&["--samples", "1", "--solver", &greets_and_refuses(greeting, 0.0)]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.contains("lens models: division\n"), "{text}");
    assert!(text.lines().all(|line| !line.starts_with("bad-input")), "{text}");
}

#[test]
fn how_a_program_ends_and_its_memory_are_reported_and_no_finding() {
    let refuses = r#"sed -u 's/^{"id":"\([^"]*\)".*/{"id":"\1","status":"refused"}/'"#;
    let end = |command: String| {
        let process = Process::new(&command, Duration::from_secs(20), 2);
        assert_eq!(process.ask_all(&problems(4)).len(), 4);
        let ends = process.finish();
        // Both copies have been asked, or the first was so quick that it took all.
        assert!((1..=2).contains(&ends.len()), "{command}: {ends:?}");
        assert!(process.finish().is_empty());
        ends[0]
    };
    let good = end(refuses.to_string());
    assert_eq!((good.by_itself, good.exit_code, good.signal), (true, Some(0), None));
    let late = end(format!("{refuses}; exit 7"));
    assert_eq!((late.by_itself, late.exit_code, late.how().as_str()), (true, Some(7), "exit code 7"));
    let killed = end(format!("{refuses}; kill -9 $$"));
    assert_eq!((killed.by_itself, killed.exit_code, killed.signal), (true, None, Some(9)));
    assert_eq!(good.answers_unasked + late.answers_unasked + killed.answers_unasked, 0);
    let more = end(format!("{refuses}; echo 'farewell'; echo '{{\"id\":\"x\"}}'; echo '{{}}'"));
    assert_eq!(
        (more.answers_unasked, more.how().as_str()),
        (2, "exit code 0 after 2 answers that nobody asked for")
    );
    let stays = end(format!("{refuses}; sleep 1000"));
    assert_eq!((stays.by_itself, stays.how().as_str()), (false, "did not end with its input"));
    // The shell itself is small; what it started counts too: here a process that holds 60 MB.
    let holds = end(format!("x=$(head -c 60000000 /dev/zero | tr '\\0' x); {refuses}"));
    if cfg!(target_os = "linux") {
        let (small, large) =
            (good.peak_memory_bytes.expect("known"), holds.peak_memory_bytes.expect("known"));
        assert!((100_000..50_000_000).contains(&small) && large > 60_000_000, "{small} {large}");
    } else {
        assert_eq!(good.peak_memory_bytes, None);
    }
    // A program that answered everything is not held to its exit code.
    let json = folder("gate-ends").join("report.json");
    std::fs::create_dir_all(json.parent().expect("a folder")).expect("made");
    let path = json.to_string_lossy().into_owned();
    let solver = format!("{refuses}; exit 7");
    let one = ["--samples", "1", "--scene", "no-views", "--models", "brown-conrady"];
    let output = gate(&[&one[..], &["--solver", &solver, "--json", &path]].concat());
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(0), "{text}");
    assert!(text.lines().next().expect("a line").contains(" s; exit code 7, peak memory "), "{text}");
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(&json).expect("written")).expect("JSON");
    assert_eq!((&report["program_ends"][0]["exit_code"], &report["verdict"]), (&7.into(), &"held".into()));
    // Our own solver is no program.
    let ours = gate(&["--samples", "1", "--scene", "no-views", "--format", "json"]);
    let report: serde_json::Value = serde_json::from_slice(&ours.stdout).expect("JSON");
    assert!(report["program_ends"].is_null() && report["verdict"] == "held");
}

#[test]
fn garbage_foreign_ids_and_nan_are_named() {
    let babble = breakages("while read line; do echo hello; done", 0.3, 1);
    assert!(matches!(&babble[0], Breakage::Garbage { line, .. } if line == "hello"), "{babble:?}");
    let foreign = breakages(r#"while read line; do echo '{"id":"x","status":"refused"}'; done"#, 0.3, 1);
    assert_eq!(foreign[0], Breakage::WrongId { got: "x".into() });
    let id = problems(1)[0].id.clone();
    let nan =
        breakages(&format!(r#"while read line; do echo '{{"id": "{id}", "rmse": NaN}}'; done"#), 20.0, 1);
    assert!(matches!(nan[0], Breakage::BadNumber { .. }), "{nan:?}");
}

#[test]
fn a_program_is_kept_alive_and_judged_without_a_crash_of_ours() {
    let refuses = r#"sed -u 's/^{"id":"\([^"]*\)".*/{"id":"\1","status":"refused","message":"never"}/'"#;
    let output = gate(&["--samples", "1", "--solver", refuses]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.contains("NOT TRUSTED"), "{text}");
    assert!(text.lines().any(|l| l.starts_with("exactness") && l.contains("FAILED")), "{text}");
    assert!(text.lines().any(|l| l.starts_with("protocol") && l.contains("held")), "{text}");
}
