//! What does a study lose when everything that can fail does? At every write, by kill -9 at any moment, on a
//! full disk, with a rival.

use crate::failing_disk::{Failing, Fault};
use crate::study::{assert_same, scratch};
use calibench::io::files::{Disk, Files};
use calibench::synth::{Stream, StreamKey};
use calibench_study::{
    Engine, Folder, FolderError, Manifest, Outcome, RunError, Shard, TrialFile, finish, merge_on,
};
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

/// Two cells, three batches each, one set of poses: many runs take little time.
fn spec() -> String {
    crate::study::SPEC
        .replace(", redraw = true", "")
        .replace("per_cell = 45", "per_cell = 10")
        .replace("batch = 10", "batch = 4")
}

const BATCH: u64 = 4;

/// Begins the run, or goes on where it is, through the given operations; trials that were told of.
fn go_on(files: Arc<dyn Files>, path: &Path, manifest: &Manifest, told: &mut u64) -> Result<(), RunError> {
    let folder = match path.join("manifest.json").exists() {
        true => Folder::open_on(files, path)?,
        false => Folder::create_on(files, path, &spec(), manifest)?,
    };
    folder.check(manifest)?;
    let mut engine = Engine::new(&folder.read("spec.toml")?, Shard::WHOLE)?;
    let outcome =
        folder.run(&mut engine, &AtomicBool::new(false), |pace| *told = pace.before + pace.trials)?;
    assert_eq!(outcome, Outcome::Complete);
    finish(&folder, &engine)?;
    Ok(())
}

/// Batches of the study above.
const BATCHES: u64 = 6;

/// Batches that the checkpoint vouches for. A complete run whose trials were put into another file has none:
/// its manifest vouches for all.
fn kept(path: &Path) -> u64 {
    let of = |name: &str| -> serde_json::Value {
        serde_json::from_str(&fs::read_to_string(path.join(name)).unwrap_or_default()).unwrap_or_default()
    };
    let all = of("manifest.json")["complete"] == true;
    of("checkpoint.json")["batches"].as_u64().unwrap_or(if all { BATCHES } else { 0 })
}

#[test]
fn a_run_that_fails_at_any_operation_loses_its_last_batch_at_most_and_ends_in_the_same_bytes() {
    fail_at_every_operation(TrialFile::Csv);
}

#[cfg(feature = "parquet")]
#[test]
fn so_does_one_whose_trials_become_a_parquet_file() {
    fail_at_every_operation(TrialFile::Parquet);
}

fn fail_at_every_operation(trials: TrialFile) {
    let whole = scratch(&format!("faults-whole-{trials}"));
    crate::study::run(&whole, &spec(), Shard::WHOLE, trials);
    let engine = Engine::new(&spec(), Shard::WHOLE).unwrap();
    let manifest =
        Manifest::new(&engine.spec, Shard::WHOLE, &calibench_experiments::build()).with_trials(trials);
    for fault in [Fault::Killed, Fault::Full] {
        let mut operation = 0;
        loop {
            let path = scratch(&format!("faults-{trials}"));
            let (failing, mut told) = (Failing::at(operation, fault), 0);
            let ended = go_on(failing.clone(), &path, &manifest, &mut told);
            if ended.is_ok() && !failing.has_failed() {
                fs::remove_dir_all(path).unwrap();
                break;
            }
            // On a full disk what follows the last write may well succeed.
            assert!(
                ended.is_err() || fault == Fault::Full,
                "operation {operation} failed and nobody said so"
            );
            assert!(kept(&path) * BATCH >= told.saturating_sub(BATCH), "{fault:?} at {operation}");
            go_on(Arc::new(Disk), &path, &manifest, &mut told).unwrap();
            assert_same(&whole, &path);
            let leftover = fs::read_dir(&path)
                .unwrap()
                .flatten()
                .any(|entry| entry.file_name().to_string_lossy().ends_with(".tmp"));
            assert!(!leftover, "{fault:?} at {operation}");
            fs::remove_dir_all(path).unwrap();
            operation += 1;
        }
        assert!(operation > 40, "{fault:?}: {operation} operations are too few to be all");
    }
    fs::remove_dir_all(whole).unwrap();
}

#[test]
fn a_merge_that_fails_at_any_operation_leaves_no_run_or_a_whole_one() {
    let [whole, one, two, merged] =
        ["merge-whole", "merge-0", "merge-1", "merge-out"].map(|name| scratch(&format!("faults-{name}")));
    crate::study::run(&whole, &spec(), Shard::WHOLE, TrialFile::Csv);
    for (index, path) in [&one, &two].into_iter().enumerate() {
        crate::study::run(path, &spec(), Shard { index: index as u64, count: 2 }, TrialFile::Csv);
    }
    let parts = [one.clone(), two.clone()];
    let build = calibench_experiments::build();
    for fault in [Fault::Killed, Fault::Full] {
        let mut operation = 0;
        loop {
            let _ = fs::remove_dir_all(&merged);
            let failing = Failing::at(operation, fault);
            let ended = merge_on(failing.clone(), &parts, &merged, None, &build);
            if !failing.has_failed() {
                break;
            }
            // On a full disk what follows the last write may well succeed.
            assert!(
                ended.is_err() || fault == Fault::Full,
                "operation {operation} failed and nobody said so"
            );
            drop(ended);
            let there = |name: &str| merged.join(name).exists();
            if there("trials.csv") {
                let bytes = |of: &Path| fs::read(of.join("trials.csv")).unwrap();
                assert!(bytes(&merged) == bytes(&whole), "{fault:?} at {operation}: a part of the trials");
            }
            assert!(!there("manifest.json") || there("checkpoint.json"), "{fault:?} at {operation}");
            if fault == Fault::Full && !there("manifest.json") {
                assert!(!there("trials.csv"), "at {operation}: trials are left on a full disk");
                let (folder, engine) = merge_on(Arc::new(Disk), &parts, &merged, None, &build).unwrap();
                finish(&folder, &engine).unwrap();
                drop(folder);
                assert_same(&whole, &merged);
            }
            operation += 1;
        }
        assert!(operation > 12, "{fault:?}: {operation} operations are too few to be all");
    }
    [whole, one, two, merged].into_iter().for_each(|path| fs::remove_dir_all(path).unwrap());
}

fn command(arguments: &[&str], folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.args(arguments).current_dir(folder).stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

/// Times that a run is killed.
const KILLS: u64 = 200;

#[test]
fn a_run_that_is_killed_two_hundred_times_ends_in_the_same_bytes() {
    let folder = scratch("kills");
    fs::create_dir_all(&folder).unwrap();
    let long = crate::study::SPEC
        .replace(", redraw = true", "")
        .replace("per_cell = 45", "per_cell = 4000")
        .replace("batch = 10", "batch = 5");
    fs::write(folder.join("spec.toml"), long).unwrap();
    let run = |arguments: &[&str]| command(arguments, &folder).spawn().unwrap();
    let ended = |child: Child| child.wait_with_output().unwrap();
    let checkpoint = |name: &str| fs::read(folder.join(name).join("checkpoint.json")).unwrap_or_default();
    // Waits until the run has kept one more batch, or has ended: a busy machine takes its time to begin.
    let kept_more = |child: &mut Child, name: &str| {
        let before = checkpoint(name);
        while checkpoint(name) == before && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_micros(200));
        }
    };
    let (start, mut whole) = (Instant::now(), run(&["study", "run", "spec.toml", "--out", "whole"]));
    kept_more(&mut whole, "whole");
    let beginning = start.elapsed();
    assert!(ended(whole).status.success());
    let mut moments = Stream::open(StreamKey { seed: 1, scenario: "kills", trial: 0, purpose: "moment" });
    let killed = folder.join("killed");
    let (mut kills, mut ends) = (0, 0);
    while kills < KILLS {
        let mut child = run(if killed.join("manifest.json").exists() {
            &["study", "resume", "killed"]
        } else {
            &["study", "run", "spec.toml", "--out", "killed"]
        });
        // Each second one while it begins, before the first write and after; the others among their batches.
        let within = if kills % 2 == 0 { beginning } else { Duration::from_millis(5) };
        if kills % 2 == 1 {
            kept_more(&mut child, "killed");
        }
        std::thread::sleep(within.mul_f64(moments.uniform()));
        // SIGKILL: no handler runs. It fails where the run has ended.
        let _ = child.kill();
        let output = ended(child);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.code().is_none_or(|code| code == 0), "{said}");
        if output.status.code().is_none() {
            kills += 1;
            continue;
        }
        // Where the machine is busy a run may be done before it is killed: it is a whole one, and the next
        // begins anew.
        assert_same(&folder.join("whole"), &killed);
        fs::remove_dir_all(&killed).unwrap();
        ends += 1;
        assert!(ends < KILLS, "{kills} of {KILLS} were killed, and {ends} ended: the run is too short");
    }
    let last = ended(run(&["study", "resume", "killed"]));
    assert!(last.status.success(), "{}", String::from_utf8_lossy(&last.stderr));
    assert_same(&folder.join("whole"), &killed);
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn of_two_runs_at_once_in_one_folder_one_is_refused_and_the_other_is_whole() {
    let folder = scratch("rivals");
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("spec.toml"), spec()).unwrap();
    let whole = folder.join("whole");
    crate::study::run(&whole, &spec(), Shard::WHOLE, TrialFile::Csv);
    let rival = || command(&["study", "run", "spec.toml", "--out", "one"], &folder).spawn().unwrap();
    let outputs = [rival(), rival()].map(|child| child.wait_with_output().unwrap());
    let held = outputs.iter().filter(|output| output.status.success()).count();
    assert_eq!(held, 1, "{outputs:?}");
    let refused = outputs.iter().find(|output| !output.status.success()).unwrap();
    let said = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2), "{said}");
    assert!(said.contains("in use by another run") || said.contains("holds a run already"), "{said}");
    // The manifest of a command names the commit, which a run in a test does not.
    for name in ["trials.csv", "summary.csv", "outcomes.csv", "correlations.csv", "checkpoint.json"] {
        let bytes = |of: &Path| fs::read(of.join(name)).unwrap();
        assert!(bytes(&whole) == bytes(&folder.join("one")), "{name} differs");
    }
    fs::remove_dir_all(folder).unwrap();
}

#[cfg(target_os = "linux")]
#[test]
#[cfg_attr(not(calibench_mounts), ignore = "needs the right to mount a file system (Linux)")]
fn a_disk_that_became_read_only_ends_with_three_and_the_run_goes_on_later() {
    let folder = scratch("read-only");
    let disk = folder.join("disk");
    fs::create_dir_all(&disk).unwrap();
    let mount = |options: &str| {
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", options, "calibench"]).arg(&disk);
        mount.output().is_ok_and(|output| output.status.success())
    };
    assert!(mount("size=4m"));
    let engine = Engine::new(&spec(), Shard::WHOLE).unwrap();
    let manifest = Manifest::new(&engine.spec, Shard::WHOLE, &calibench_experiments::build());
    drop(Folder::create(&disk.join("run"), &spec(), &manifest).unwrap());
    let resume = || command(&["study", "resume", "disk/run"], &folder).output().unwrap();
    let outputs = (mount("remount,ro"), resume(), mount("remount,rw"), resume());
    let same = kept(&disk.join("run"));
    assert!(Command::new("umount").arg(&disk).status().unwrap().success());
    let (read_only, first, writable, second) = outputs;
    assert!(read_only && writable);
    let said = String::from_utf8_lossy(&first.stderr);
    assert_eq!(first.status.code(), Some(3), "{said}");
    assert_eq!(said.matches("disk/run").count(), 1, "{said}");
    assert_eq!(second.status.code(), Some(0), "{}", String::from_utf8_lossy(&second.stderr));
    assert_eq!(same, BATCHES);
    fs::remove_dir_all(folder).unwrap();
}

/// What time it is, and how much has passed, as a clock says that jumps by up to a year, forward or back,
/// whenever it is asked.
const JUMPING_CLOCK: &str = "
#include <time.h>
int clock_gettime(clockid_t clock, struct timespec *now) {
    static __thread unsigned long long state = 1;
    state = state * 6364136223846793005ull + 1442695040888963407ull;
    now->tv_sec = 1000000000 + (state >> 39);
    now->tv_nsec = (state >> 10) % 1000000000;
    return 0;
}
";

/// Makes the clock a library that takes the place of the system's.
#[cfg(target_os = "linux")]
fn make_clock(library: &Path) {
    let mut compiler = Command::new("cc");
    compiler.args(["-x", "c", "-shared", "-fPIC", "-o"]).arg(library).arg("-").stdin(Stdio::piped());
    let mut compiler = compiler.spawn().unwrap();
    compiler.stdin.take().unwrap().write_all(JUMPING_CLOCK.as_bytes()).unwrap();
    assert!(compiler.wait().unwrap().success());
}

#[cfg(target_os = "linux")]
#[test]
#[cfg_attr(not(calibench_cc), ignore = "needs a C compiler, cc")]
fn a_clock_that_jumps_while_a_study_runs_stops_and_goes_on_changes_no_byte() {
    let folder = scratch("clock");
    fs::create_dir_all(&folder).unwrap();
    let library = folder.join("clock.so");
    make_clock(&library);
    let long = crate::study::SPEC.replace(", redraw = true", "").replace("per_cell = 45", "per_cell = 2000");
    fs::write(folder.join("spec.toml"), long).unwrap();
    let whole = command(&["study", "run", "spec.toml", "--out", "whole"], &folder).output().unwrap();
    assert!(whole.status.success());
    let jumping = |arguments: &[&str]| {
        let mut command = command(arguments, &folder);
        command.env("LD_PRELOAD", &library).stdout(Stdio::piped()).spawn().unwrap()
    };
    let mut stopped = 0;
    for arguments in [&["study", "run", "spec.toml", "--out", "jumped"][..]]
        .into_iter()
        .chain([&["study", "resume", "jumped"][..]; 4])
    {
        let manifest = folder.join("jumped/manifest.json");
        let goes_on = manifest.exists();
        let mut child = jumping(arguments);
        // A run has begun once its folder says what it is, which on a busy machine may be soon or late; how
        // far one that goes on has come nothing says.
        while !manifest.exists() && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(1));
        }
        std::thread::sleep(Duration::from_millis(if goes_on { 60 } else { 0 }));
        let interrupted = Command::new("kill").args(["-INT", &child.id().to_string()]).output().unwrap();
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        // Before its handler stands, an interrupt ends it at once.
        assert!(matches!(output.status.code(), None | Some(0 | 3)), "{said}");
        assert!(!said.contains("panicked"), "{said}");
        stopped += usize::from(interrupted.status.success() && !output.status.success());
        if !folder.join("jumped/manifest.json").exists() {
            break;
        }
    }
    let again = folder.join("jumped/manifest.json").exists();
    let last: &[&str] = if again {
        &["study", "resume", "jumped"]
    } else {
        &["study", "run", "spec.toml", "--out", "jumped"]
    };
    let output = jumping(last).wait_with_output().unwrap();
    let said =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert!(output.status.success(), "{said}");
    assert!(!said.contains("NaN") && !said.contains("inf"), "{said}");
    assert!(stopped > 0, "it was never stopped");
    assert_same(&folder.join("whole"), &folder.join("jumped"));
    // The clock did jump: a measurement by it takes no time, or more than anybody has.
    let output = jumping(&["study", "measure", "spec.toml", "--trials", "2"]).wait_with_output().unwrap();
    let said =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert!(matches!(output.status.code(), Some(0 | 2)), "{said}");
    let seconds = said.split(" cells: ").nth(1).and_then(|rest| rest.split(' ').next()?.parse::<f64>().ok());
    assert!(said.contains("took no time") || seconds.is_some_and(|seconds| seconds > 1e4), "{said}");
    fs::remove_dir_all(folder).unwrap();
}

#[test]
fn a_folder_that_is_in_use_is_refused_through_any_operations() {
    let path = scratch("in-use");
    let engine = Engine::new(&spec(), Shard::WHOLE).unwrap();
    let manifest = Manifest::new(&engine.spec, Shard::WHOLE, &calibench_experiments::build());
    let held = Folder::create(&path, &spec(), &manifest).unwrap();
    assert!(matches!(Folder::open(&path), Err(FolderError::InUse(_))));
    drop(held);
    fs::remove_dir_all(path).unwrap();
}
