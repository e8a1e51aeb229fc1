//! What the tests of studies share: a small study, its runs, and their comparison byte by byte.

use calibench_experiments::build;
use calibench_study::{Engine, Folder, Manifest, Outcome, Shard, TrialFile, finish};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// Two cells of different noise, 5 batches each; the last is short.
pub const SPEC: &str = r#"
name = "small"
question = "Does nothing but the seed decide?"
seed = 11

[scene]
image = [640, 480]
camera = { fx = 600.0, fy = 600.0, cx = 326.0, cy = 243.0, k1 = -0.18, k2 = 0.05 }
target = { columns = 9, rows = 7, spacing_mm = 10.0 }
poses = { kind = "random", views = 3, tilt_deg = 35.0, tilt_min_deg = 10.0, coverage = 0.5, distance_mm = 150.0, redraw = true }
noise_px = 0.1

[trials]
per_cell = 45
batch = 10

[[factor]]
name = "noise"
unit = "px"
set = ["scene.noise_px"]
levels = [0.1, 0.3]
"#;

/// A folder of this process that does not exist.
pub fn scratch(name: &str) -> PathBuf {
    let path = std::env::temp_dir().join(format!("calibench-study-{}-{name}", std::process::id()));
    let _ = fs::remove_dir_all(&path);
    path
}

pub fn begin(path: &Path, text: &str, shard: Shard, trials: TrialFile) -> (Folder, Engine) {
    let engine = Engine::new(text, shard).unwrap();
    let manifest = Manifest::new(&engine.spec, shard, &build()).with_trials(trials);
    (Folder::create(path, text, &manifest).unwrap(), engine)
}

/// Runs to the end.
pub fn run(path: &Path, text: &str, shard: Shard, trials: TrialFile) {
    let (folder, mut engine) = begin(path, text, shard, trials);
    let outcome = folder.run(&mut engine, &AtomicBool::new(false), |_| {}).unwrap();
    assert_eq!(outcome, Outcome::Complete);
    finish(&folder, &engine).unwrap();
}

/// Continues a run to its end.
pub fn resume(path: &Path) {
    let folder = Folder::open(path).unwrap();
    let shard = folder.shard().unwrap();
    let mut engine = Engine::new(&folder.read("spec.toml").unwrap(), shard).unwrap();
    folder.check(&Manifest::new(&engine.spec, shard, &build())).unwrap();
    folder.run(&mut engine, &AtomicBool::new(false), |_| {}).unwrap();
    finish(&folder, &engine).unwrap();
}

/// Every file with its bytes.
pub fn contents(path: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![path.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).unwrap() {
            let entry = entry.unwrap().path();
            if entry.is_dir() {
                folders.push(entry);
            } else {
                let name = entry.strip_prefix(path).unwrap().display().to_string();
                found.insert(name, fs::read(&entry).unwrap());
            }
        }
    }
    found
}

/// Same files, same bytes.
pub fn assert_same(a: &Path, b: &Path) {
    let (a, b) = (contents(a), contents(b));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, bytes) in &a {
        assert!(bytes == &b[name], "{name} differs");
    }
    for name in ["summary.csv", "outcomes.csv", "correlations.csv", "report.html", "manifest.json"] {
        assert!(a[name].len() > 100, "{name} is empty");
    }
    let trials = a.keys().filter(|name| name.starts_with("trials."));
    assert_eq!(
        trials.map(|name| a[name].len() > 1000).collect::<Vec<_>>(),
        [true],
        "one file holds the trials"
    );
}
