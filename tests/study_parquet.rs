//! Do trials in Parquet say what those in CSV say, and survive interruptions, shards and merges as they do?
#![cfg(feature = "parquet")]

use crate::study::{SPEC, assert_same, begin, resume, run, scratch};
use calibench_experiments::build;
use calibench_study::{Engine, Folder, Shard, TrialFile, finish, merge};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::{Field, Row};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Two models, of which one has no k2, and two tilts, of which one is refused: missing values of both kinds.
fn with_gaps() -> String {
    let factors = r#"
[[factor]]
name = "tilt"
set = ["scene.poses.tilt_min_deg", "scene.poses.tilt_deg"]
levels = [[0.0, 0.0], [10.0, 30.0]]

[[factor]]
name = "model"
set = ["estimator.free"]
levels = [["fx", "fy", "cx", "cy", "k1"], ["fx", "fy", "cx", "cy", "k1", "k2"]]
"#;
    let head = SPEC.split("[[factor]]").next().unwrap();
    format!("{}{factors}", head.replace("per_cell = 45", "per_cell = 12"))
}

/// As a line of `trials.csv` has it.
fn text(field: &Field) -> String {
    match field {
        Field::Null => String::new(),
        Field::Long(n) => n.to_string(),
        Field::Double(x) => format!("{x:?}"),
        Field::Str(word) => word.clone(),
        other => panic!("no trial holds {other:?}"),
    }
}

/// Header and lines, as CSV would have them.
fn lines(path: &Path) -> Vec<String> {
    let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
    let columns = reader.metadata().file_metadata().schema_descr().columns().to_vec();
    let header: Vec<String> = columns.iter().map(|c| c.name().to_string()).collect();
    let line = |row: Row| row.get_column_iter().map(|(_, f)| text(f)).collect::<Vec<_>>().join(",");
    let rows = reader.get_row_iter(None).unwrap().map(|row| line(row.unwrap()));
    std::iter::once(header.join(",")).chain(rows).collect()
}

#[test]
fn parquet_holds_what_csv_holds_digit_for_digit() {
    let (csv, packed) = (scratch("pq-csv"), scratch("pq-packed"));
    run(&csv, &with_gaps(), Shard::WHOLE, TrialFile::Csv);
    run(&packed, &with_gaps(), Shard::WHOLE, TrialFile::Parquet);
    let expected = fs::read_to_string(csv.join("trials.csv")).unwrap();
    assert_eq!(lines(&packed.join("trials.parquet")), expected.lines().collect::<Vec<_>>());
    assert!(expected.contains("refused-not-identifiable") && expected.contains(",converged,"));
    assert!(expected.lines().any(|l| l.contains(",converged,") && l.contains(",,")), "a model without k2");
    assert!(!packed.join("trials.csv").exists() && !packed.join("checkpoint.json").exists());
    for name in ["summary.csv", "outcomes.csv", "correlations.csv", "figures/spread.svg"] {
        assert_eq!(fs::read(csv.join(name)).ok(), fs::read(packed.join(name)).ok(), "{name}");
    }
    [csv, packed].iter().for_each(|p| fs::remove_dir_all(p).unwrap());
}

#[test]
fn parts_in_parquet_join_to_the_bytes_of_the_whole() {
    let whole = scratch("pq-whole");
    run(&whole, SPEC, Shard::WHOLE, TrialFile::Parquet);
    let parts: Vec<PathBuf> = (0..3).map(|i| scratch(&format!("pq-part-{i}"))).collect();
    for (index, part) in parts.iter().enumerate() {
        run(part, SPEC, Shard { index: index as u64, count: 3 }, TrialFile::Parquet);
    }
    let joined = scratch("pq-joined");
    let (folder, engine) = merge(&parts, &joined, None, &build()).unwrap();
    finish(&folder, &engine).unwrap();
    drop(folder);
    assert_same(&whole, &joined);
    parts.iter().chain([&whole, &joined]).for_each(|p| fs::remove_dir_all(p).unwrap());
}

#[test]
fn a_run_is_put_into_the_other_file_and_back() {
    let (csv, packed, back) = (scratch("pq-there"), scratch("pq-over"), scratch("pq-back"));
    run(&csv, SPEC, Shard::WHOLE, TrialFile::Csv);
    for (from, to, trials) in [(&csv, &packed, TrialFile::Parquet), (&packed, &back, TrialFile::Csv)] {
        let (folder, engine) = merge(std::slice::from_ref(from), to, Some(trials), &build()).unwrap();
        finish(&folder, &engine).unwrap();
    }
    assert!(packed.join("trials.parquet").is_file());
    assert_same(&csv, &back);
    [csv, packed, back].iter().for_each(|p| fs::remove_dir_all(p).unwrap());
}

#[test]
fn a_stop_anywhere_is_continued_to_the_same_bytes() {
    let whole = scratch("pq-unstopped");
    run(&whole, SPEC, Shard::WHOLE, TrialFile::Parquet);
    for batches in [1, 9] {
        let path = scratch("pq-stopped");
        let (folder, mut engine) = begin(&path, SPEC, Shard::WHOLE, TrialFile::Parquet);
        let (stop, mut done) = (AtomicBool::new(false), 0);
        let tell = |_: &_| {
            done += 1;
            stop.store(done == batches, Ordering::Relaxed);
        };
        folder.run(&mut engine, &stop, tell).unwrap();
        drop(folder);
        resume(&path);
        assert_same(&whole, &path);
        // A run that is complete stays as it is.
        resume(&path);
        assert_same(&whole, &path);
        fs::remove_dir_all(path).unwrap();
    }
    // Killed while the file was put together: half of it, beside the log that it was made of.
    let path = scratch("pq-torn");
    let (folder, mut engine) = begin(&path, SPEC, Shard::WHOLE, TrialFile::Parquet);
    folder.run(&mut engine, &AtomicBool::new(false), |_| {}).unwrap();
    fs::write(path.join(".trials.parquet"), b"PAR1 torn").unwrap();
    drop(folder);
    resume(&path);
    assert_same(&whole, &path);
    [path, whole].iter().for_each(|p| fs::remove_dir_all(p).unwrap());
}

#[test]
fn a_file_that_was_changed_is_refused() {
    let path = scratch("pq-changed");
    run(&path, SPEC, Shard::WHOLE, TrialFile::Parquet);
    let trials = path.join("trials.parquet");
    let mut bytes = fs::read(&trials).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&trials, bytes).unwrap();
    let error =
        merge(std::slice::from_ref(&path), &scratch("pq-refused"), None, &build()).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("SHA-256 has changed"), "{error}");
    fs::remove_file(&trials).unwrap();
    let folder = Folder::open(&path).unwrap();
    let mut engine = Engine::new(SPEC, Shard::WHOLE).unwrap();
    let error = folder.run(&mut engine, &AtomicBool::new(false), |_| {}).unwrap_err();
    assert!(error.to_string().contains("trials.parquet"), "{error}");
    drop(folder);
    fs::remove_dir_all(path).unwrap();
}

#[cfg(target_os = "linux")]
#[test]
#[cfg_attr(not(calibench_mounts), ignore = "needs the right to mount a file system (Linux)")]
fn a_full_disk_ends_with_three_and_the_run_goes_on_to_the_same_file() {
    use crate::writers::{mount, on_disk};
    use std::process::Command;

    let folder = scratch("pq-full");
    let disk = folder.join("disk");
    fs::create_dir_all(&disk).unwrap();
    fs::write(folder.join("spec.toml"), SPEC).unwrap();
    let command = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_calibench")).args(arguments).current_dir(&folder).output().unwrap()
    };
    let run = |out: &str| command(&["study", "run", "spec.toml", "--trials", "parquet", "--out", out]);
    assert_eq!(run("whole").status.code(), Some(0));
    let (mut refused, mut held) = (0, 0);
    for kib in (12..=612).step_by(40) {
        on_disk(&disk, &format!("size={kib}k"), || {
            let first = run("disk/run");
            let said = String::from_utf8_lossy(&first.stderr);
            assert!(matches!(first.status.code(), Some(0 | 3)), "{kib} kB: {said}");
            assert!(said.matches("disk/run").count() <= 1, "{kib} kB: {said}");
            refused += usize::from(first.status.code() == Some(3));
            held += usize::from(first.status.code() == Some(0));
            assert!(mount(&disk, "remount,size=16m"));
            let again = match disk.join("run/manifest.json").exists() {
                true => command(&["study", "resume", "disk/run"]),
                false => run("disk/run"),
            };
            assert_eq!(again.status.code(), Some(0), "{kib} kB: {}", String::from_utf8_lossy(&again.stderr));
            assert_same(&folder.join("whole"), &disk.join("run"));
        });
    }
    assert!(refused > 3 && held > 0, "{refused} refused, {held} held");
    fs::remove_dir_all(folder).unwrap();
}
