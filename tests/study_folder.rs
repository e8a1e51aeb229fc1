//! Do threads, parts and interruptions leave every byte of a study where it was, and is a changed study
//! refused?

use crate::study::{SPEC, assert_same, resume, scratch};
use calibench_experiments::build;
use calibench_study::{
    Engine, Folder, FolderError, Interruption, Manifest, MergeError, Outcome, Shard, TrialFile, finish, merge,
};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};

/// A run whose trials stand in CSV.
fn run(path: &Path, text: &str, shard: Shard) {
    crate::study::run(path, text, shard, TrialFile::Csv);
}

fn begin(path: &Path, text: &str, shard: Shard) -> (Folder, Engine) {
    crate::study::begin(path, text, shard, TrialFile::Csv)
}

#[test]
fn the_number_of_threads_moves_no_byte() {
    let reference = scratch("threads-1");
    let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    pool(1).install(|| run(&reference, SPEC, Shard::WHOLE));
    for threads in [2, 5] {
        let other = scratch("threads-n");
        pool(threads).install(|| run(&other, SPEC, Shard::WHOLE));
        assert_same(&reference, &other);
        fs::remove_dir_all(other).unwrap();
    }
    fs::remove_dir_all(reference).unwrap();
}

/// With a precision, cells end at different trials, and shards hold whole cells.
fn with_precision() -> String {
    let precision = "batch = 10\nprecision = { quantity = \"fx\", relative_half_width = 0.33 }";
    SPEC.replace("batch = 10", precision).replace("per_cell = 45", "per_cell = 200")
}

#[test]
fn parts_join_to_the_bytes_of_the_whole() {
    for (kind, text) in [("count", SPEC.to_string()), ("precision", with_precision())] {
        let whole = scratch(&format!("whole-{kind}"));
        run(&whole, &text, Shard::WHOLE);
        for count in [2, 3] {
            let parts: Vec<PathBuf> =
                (0..count).map(|i| scratch(&format!("{kind}-part-{i}-of-{count}"))).collect();
            for (index, part) in parts.iter().enumerate() {
                run(part, &text, Shard { index: index as u64, count });
            }
            let joined = scratch(&format!("{kind}-joined-{count}"));
            // The order in which parts are named does not matter.
            let named: Vec<PathBuf> = parts.iter().rev().cloned().collect();
            let (folder, engine) = merge(&named, &joined, None, &build()).unwrap();
            finish(&folder, &engine).unwrap();
            assert_same(&whole, &joined);
            parts.iter().chain([&joined]).for_each(|p| fs::remove_dir_all(p).unwrap());
        }
        fs::remove_dir_all(whole).unwrap();
    }
}

#[test]
fn a_precision_ends_cells_at_a_batch_and_before_the_most() {
    let path = scratch("precise");
    run(&path, &with_precision(), Shard::WHOLE);
    let trials = fs::read_to_string(path.join("trials.csv")).unwrap();
    for cell in ["0,", "1,"] {
        let count = trials.lines().filter(|l| l.starts_with(cell)).count();
        // Half-width 0.33 of sd needs about 1.96 / sqrt(2 n) = 0.33, n = 18, for normal errors.
        assert!(count % 10 == 0 && (20..200).contains(&count), "{count}");
    }
    fs::remove_dir_all(path).unwrap();
}

#[test]
fn progress_counts_to_what_there_will_be_and_names_the_worst_cell() {
    let path = scratch("pace");
    // The first cell's views face the camera: nothing converges there.
    let text = with_precision()
        .replace("name = \"noise\"", "name = \"tilt\"")
        .replace(
            "set = [\"scene.noise_px\"]",
            "set = [\"scene.poses.tilt_min_deg\", \"scene.poses.tilt_deg\"]",
        )
        .replace("levels = [0.1, 0.3]", "levels = [[0.0, 0.0], [10.0, 35.0]]");
    let (folder, mut engine) = begin(&path, &text, Shard::WHOLE);
    let mut paces = Vec::new();
    folder.run(&mut engine, &AtomicBool::new(false), |pace| paces.push(pace.clone())).unwrap();
    let last = paces.last().unwrap();
    assert_eq!((last.trials, last.expected), (engine.trials(), engine.trials()));
    assert!(
        last.expected > 200 && last.expected < 400,
        "one cell takes its 200, the other ends early: {last:?}"
    );
    for pace in &paces[1..] {
        let worst = pace.worst.as_ref().unwrap();
        assert_eq!((worst.quantity, worst.relative_half_width), ("fx", None), "{worst:?}");
        assert!(worst.cell.starts_with("tilt = [0"), "{worst:?}");
    }
    drop(folder);
    fs::remove_dir_all(path).unwrap();
}

#[test]
fn parts_that_make_no_whole_are_refused() {
    let paths = [scratch("a"), scratch("b"), scratch("c"), scratch("other")];
    for (index, path) in paths[..2].iter().enumerate() {
        run(path, SPEC, Shard { index: index as u64, count: 3 });
    }
    let refuse = |parts: &[&PathBuf]| {
        let out = scratch("refused");
        let error = merge(&parts.iter().map(|p| p.to_path_buf()).collect::<Vec<_>>(), &out, None, &build())
            .map(|_| ())
            .unwrap_err();
        assert!(!out.exists(), "nothing is written for parts that are refused");
        error
    };
    let error = refuse(&[&paths[0], &paths[1]]);
    assert!(matches!(&error, MergeError::Parts { missing, .. } if missing == "2/3"), "{error}");
    let (folder, _) = begin(&paths[2], SPEC, Shard { index: 2, count: 3 });
    drop(folder);
    let error = refuse(&[&paths[0], &paths[1], &paths[2]]);
    assert!(matches!(&error, MergeError::Incomplete { shard, .. } if shard == "2/3"), "{error}");
    run(&paths[3], &SPEC.replace("seed = 11", "seed = 12"), Shard { index: 2, count: 3 });
    let error = refuse(&[&paths[0], &paths[1], &paths[3]]);
    assert!(error.to_string().contains("spec.seed: was 11, is 12"), "{error}");
    let manifest = paths[1].join("manifest.json");
    let text = fs::read_to_string(&manifest).unwrap();
    fs::write(&manifest, text.replace("\"behaviour\": \"", "\"behaviour\": \"0")).unwrap();
    let error = refuse(&[&paths[0], &paths[1], &paths[3]]);
    assert!(error.to_string().contains("code.behaviour"), "{error}");
    let twice = refuse(&[&paths[0], &paths[0]]);
    assert!(matches!(twice, MergeError::NamedTwice(_)), "{twice}");
    paths.iter().for_each(|p| fs::remove_dir_all(p).unwrap());
}

#[test]
fn a_stop_after_any_batch_is_continued_to_the_same_bytes() {
    let whole = scratch("unstopped");
    run(&whole, SPEC, Shard::WHOLE);
    for batches in [1, 4, 9] {
        let path = scratch("stopped");
        let (folder, mut engine) = begin(&path, SPEC, Shard::WHOLE);
        let stop: Interruption = AtomicBool::new(false);
        let mut done = 0;
        let outcome = folder.run(&mut engine, &stop, |_| {
            done += 1;
            stop.store(done == batches, Ordering::Relaxed);
        });
        assert_eq!(outcome.unwrap(), Outcome::Interrupted);
        drop(folder);
        resume(&path);
        assert_same(&whole, &path);
        fs::remove_dir_all(path).unwrap();
    }
    fs::remove_dir_all(whole).unwrap();
}

#[test]
fn a_changed_study_or_code_is_refused_by_name() {
    let path = scratch("changed");
    let (folder, engine) = begin(&path, SPEC, Shard::WHOLE);
    let louder = Engine::new(&SPEC.replace("noise_px = 0.1", "noise_px = 0.2"), Shard::WHOLE).unwrap();
    let error = folder.check(&Manifest::new(&louder.spec, Shard::WHOLE, &build())).unwrap_err().to_string();
    assert!(error.contains("spec.scene.noise_px: was 0.1, is 0.2"), "{error}");
    let mut other_code = Manifest::new(&engine.spec, Shard::WHOLE, &build());
    other_code.code.behaviour = "another".to_string();
    let error = folder.check(&other_code).unwrap_err().to_string();
    assert!(error.contains("code.behaviour"), "{error}");
    // Layout and comments are not the study.
    let same = Engine::new(&format!("# a remark\n{SPEC}"), Shard::WHOLE).unwrap();
    assert!(folder.check(&Manifest::new(&same.spec, Shard::WHOLE, &build())).is_ok());
    drop(folder);
    fs::remove_dir_all(path).unwrap();
}

#[test]
fn a_damaged_or_occupied_folder_is_refused() {
    let path = scratch("damaged");
    run(&path, SPEC, Shard::WHOLE);
    let trials = path.join("trials.csv");
    let good = fs::read_to_string(&trials).unwrap();
    let refuse = |text: &str| {
        fs::write(&trials, text).unwrap();
        let folder = Folder::open(&path).unwrap();
        let mut engine = Engine::new(SPEC, Shard::WHOLE).unwrap();
        folder.run(&mut engine, &AtomicBool::new(false), |_| {}).unwrap_err().to_string()
    };
    assert!(refuse(&good[..good.len() / 2]).contains("the checkpoint counts"));
    let digit = good.rfind(|c: char| c.is_ascii_digit()).unwrap();
    let mut flipped = good.clone().into_bytes();
    flipped[digit] = if flipped[digit] == b'1' { b'2' } else { b'1' };
    assert!(refuse(std::str::from_utf8(&flipped).unwrap()).contains("SHA-256"));
    let held = Folder::open(&path).unwrap();
    assert!(matches!(Folder::open(&path), Err(FolderError::InUse(_))));
    assert!(matches!(Folder::open_to_read(&path), Err(FolderError::InUse(_))));
    drop(held);
    // Readers do not wait for each other, and a run waits for them; a folder that was copied has no lock.
    let readers = [Folder::open_to_read(&path).unwrap(), Folder::open_to_read(&path).unwrap()];
    assert!(matches!(Folder::open(&path), Err(FolderError::InUse(_))));
    drop(readers);
    fs::remove_file(path.join(".lock")).unwrap();
    drop(Folder::open_to_read(&path).unwrap());
    let engine = Engine::new(SPEC, Shard::WHOLE).unwrap();
    let again = Folder::create(&path, SPEC, &Manifest::new(&engine.spec, Shard::WHOLE, &build()));
    assert!(matches!(again, Err(FolderError::Taken(_))));
    fs::remove_dir_all(path).unwrap();
}

#[test]
fn trials_of_another_run_are_refused_by_name_and_never_taken_over() {
    let (quiet, loud) = (scratch("foreign-quiet"), scratch("foreign-loud"));
    run(&quiet, SPEC, Shard::WHOLE);
    let louder = SPEC.replace("seed = 11", "seed = 12").replace("[0.1, 0.3]", "[1.0, 3.0]");
    let engine = Engine::new(&louder, Shard::WHOLE).unwrap();
    let manifest = Manifest::new(&engine.spec, Shard::WHOLE, &build());
    // Trials whose manifest is gone: neither a run nor a merge begins on top of them.
    fs::remove_file(quiet.join("manifest.json")).unwrap();
    let error = Folder::create(&quiet, &louder, &manifest).unwrap_err();
    assert!(matches!(error, FolderError::Leftover { found: "checkpoint.json", .. }), "{error}");
    run(&loud, &louder, Shard::WHOLE);
    let error = merge(std::slice::from_ref(&loud), &quiet, None, &build()).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("checkpoint.json"), "{error}");
    // Trials and checkpoint that were put under the manifest of another run.
    for name in ["trials.csv", "checkpoint.json"] {
        fs::copy(quiet.join(name), loud.join(name)).unwrap();
    }
    let folder = Folder::open(&loud).unwrap();
    let mut engine = Engine::new(&louder, Shard::WHOLE).unwrap();
    let error = folder.run(&mut engine, &AtomicBool::new(false), |_| {}).unwrap_err();
    assert!(error.to_string().contains("another study, part or version of the code"), "{error}");
    assert_eq!(engine.trials(), 0);
    drop(folder);
    [quiet, loud].iter().for_each(|p| fs::remove_dir_all(p).unwrap());
}

#[test]
fn of_two_paired_runs_the_quieter_is_found_better_and_a_copy_is_not() {
    use calibench_study::compare::{CompareError, Verdict, compare};
    let paths = [scratch("loud"), scratch("copy"), scratch("quiet"), scratch("unpaired")];
    run(&paths[0], SPEC, Shard::WHOLE);
    run(&paths[1], SPEC, Shard::WHOLE);
    run(&paths[2], &SPEC.replace("levels = [0.1, 0.3]", "levels = [0.05, 0.15]"), Shard::WHOLE);
    run(&paths[3], &SPEC.replace("seed = 11", "seed = 12"), Shard::WHOLE);
    let same = compare(&paths[0], &paths[1]).unwrap();
    assert_eq!(same.effects.len(), 14, "six parameters and the depth in two cells");
    assert!(same.effects.iter().all(|e| e.verdict == Verdict::Alike && e.ratio.value == 1.0));
    let quieter = compare(&paths[0], &paths[2]).unwrap();
    for e in &quieter.effects {
        // To first order half the noise halves every error, trial by trial; what is left is of second order,
        // a few percent at 0.3 px.
        assert!(e.verdict == Verdict::SecondBetter && (e.ratio.value - 0.5).abs() < 0.05, "{e:?}");
    }
    let error = compare(&paths[0], &paths[3]).unwrap_err();
    assert!(matches!(error, CompareError::NotPaired { what: "seed", .. }), "{error}");
    paths.iter().for_each(|p| fs::remove_dir_all(p).unwrap());
}

#[test]
fn levels_of_a_factor_are_paired_within_a_run() {
    use calibench_study::compare::{CompareError, Verdict, compare_levels};
    let (path, alone) = (scratch("levels"), scratch("levels-alone"));
    let loss = "[[factor]]\nname = \"loss\"\nset = [\"estimator.loss\"]\nlevels = [{ kind = \"squares\" }, { kind = \"huber\", delta_px = 9.0 }]\n";
    let text = format!("{SPEC}\n{loss}");
    run(&path, &text, Shard::WHOLE);
    let noise = compare_levels(&path, "noise").unwrap();
    assert_eq!(noise.effects.len(), 14, "the louder of two noises, with two losses, seven errors each");
    for e in &noise.effects {
        // To first order three times the noise is three times the error; the second order is a few percent at
        // 0.3 px.
        assert!(e.verdict == Verdict::FirstBetter && (e.ratio.value - 3.0).abs() < 0.3, "{e:?}");
    }
    let losses = compare_levels(&path, "loss").unwrap();
    // Huber's loss beyond all residuals is least squares.
    assert!(losses.effects.iter().all(|e| e.verdict == Verdict::Alike && (e.ratio.value - 1.0).abs() < 1e-6));
    let error = compare_levels(&path, "lens").unwrap_err();
    assert!(matches!(&error, CompareError::Factor { known, .. } if known == "noise, loss"), "{error}");
    run(&alone, &text.replace("seed = 11", "seed = 11\ncommon_random_numbers = false"), Shard::WHOLE);
    assert!(matches!(compare_levels(&alone, "loss"), Err(CompareError::NotCommon { .. })));
    [path, alone].iter().for_each(|p| fs::remove_dir_all(p).unwrap());
}

/// Long enough to be killed on the way, on a fast machine too.
fn long_spec() -> String {
    SPEC.replace("per_cell = 45", "per_cell = 600").replace("batch = 10", "batch = 25")
}

fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_calibench"));
    command.args(arguments).stdout(Stdio::null()).stderr(Stdio::null());
    command
}

#[test]
fn a_killed_run_is_resumed_to_the_bytes_of_an_undisturbed_one() {
    let folder = scratch("kill");
    fs::create_dir_all(&folder).unwrap();
    let spec = folder.join("spec.toml");
    fs::write(&spec, long_spec()).unwrap();
    let path = |name: &str| folder.join(name).display().to_string();
    let (whole, killed) = (path("whole"), path("killed"));
    assert!(command(&["study", "run", &path("spec.toml"), "--out", &whole]).status().unwrap().success());

    let mut child = command(&["study", "run", &path("spec.toml"), "--out", &killed]).spawn().unwrap();
    let checkpoint = Path::new(&killed).join("checkpoint.json");
    let batches = || -> u64 {
        let text = fs::read_to_string(&checkpoint).unwrap_or_default();
        text.split("\"batches\":").nth(1).and_then(|t| t.split(',').next()?.parse().ok()).unwrap_or(0)
    };
    while batches() < 3 && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    // SIGKILL: no handler runs.
    child.kill().unwrap();
    let status = child.wait().unwrap();
    assert!(!status.success(), "the run ended before it could be killed");
    let kept = batches();
    assert!(kept >= 3);
    // A torn line at the end, as a crash in the middle of a write leaves it.
    let mut file = fs::OpenOptions::new().append(true).open(Path::new(&killed).join("trials.csv")).unwrap();
    std::io::Write::write_all(&mut file, b"0,12345,conv").unwrap();
    assert!(command(&["study", "resume", &killed]).status().unwrap().success());
    assert_same(Path::new(&whole), Path::new(&killed));
    fs::remove_dir_all(folder).unwrap();
}

#[cfg(unix)]
#[test]
fn an_interrupt_finishes_the_batch_and_says_how_to_go_on() {
    let folder = scratch("interrupt");
    fs::create_dir_all(&folder).unwrap();
    let spec = folder.join("spec.toml");
    fs::write(&spec, long_spec()).unwrap();
    let out = folder.join("run");
    let mut child = Command::new(env!("CARGO_BIN_EXE_calibench"))
        .args(["study", "run", &spec.display().to_string(), "--out", &out.display().to_string()])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while !out.join("checkpoint.json").exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let interrupted = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(interrupted.success());
    let output = child.wait_with_output().unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(3), "{message}");
    assert!(message.contains("calibench study resume"), "{message}");
    assert!(command(&["study", "resume", &out.display().to_string()]).status().unwrap().success());
    fs::remove_dir_all(folder).unwrap();
}

#[cfg(not(feature = "parquet"))]
#[test]
fn without_the_feature_parquet_is_refused_by_name() {
    let folder = scratch("no-parquet");
    fs::create_dir_all(&folder).unwrap();
    let spec = folder.join("spec.toml");
    fs::write(&spec, SPEC).unwrap();
    let out = folder.join("run");
    let output = Command::new(env!("CARGO_BIN_EXE_calibench"))
        .args(["study", "run", &spec.display().to_string(), "--trials", "parquet"])
        .args(["--out", &out.display().to_string()])
        .output()
        .unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("--features parquet"), "{message}");
    assert!(!out.exists(), "nothing is begun that cannot be ended");
    // The run of another program, which has the feature.
    run(&out, SPEC, Shard::WHOLE);
    let manifest = fs::read_to_string(out.join("manifest.json")).unwrap();
    fs::write(out.join("manifest.json"), manifest.replace("\"trials\": \"csv\"", "\"trials\": \"parquet\""))
        .unwrap();
    let error = merge(&[out], &folder.join("whole"), None, &build()).map(|_| ()).unwrap_err();
    assert!(
        matches!(&error, MergeError::Run(calibench_study::RunError::Folder(FolderError::NoParquet(_)))),
        "{error}"
    );
    fs::remove_dir_all(folder).unwrap();
}
