//! A trial of a study: four views of 63 points drawn, calibrated with covariance, and recorded; on one core,
//! in memory and in a folder with its checkpoints. Then the memory that ten thousand trials take beyond what
//! the first thousand took.
#![allow(missing_docs)]

use calibench_harness::Build;
use calibench_harness::resources::peak_memory_mib;
use calibench_study::{Engine, Folder, Manifest, Shard, Spec, in_memory};
use criterion::{Criterion, Throughput, criterion_group};
use std::sync::atomic::AtomicBool;

const STUDY: &str = include_str!("../studies/four-pose.toml");
/// One batch.
const TRIALS: u64 = 500;

fn spec(trials: u64) -> Spec {
    let mut spec = Spec::parse(STUDY).expect("a study that ships");
    spec.trials.per_cell = trials;
    spec
}

fn to_folder() -> u64 {
    let path = std::env::temp_dir().join(format!("calibench-bench-{}", std::process::id()));
    let mut engine = Engine::of(spec(TRIALS), STUDY, Shard::WHOLE).expect("a study that ships");
    let manifest = Manifest::new(&engine.spec, Shard::WHOLE, &Build::default());
    let folder = Folder::create(&path, STUDY, &manifest).expect("a new folder");
    folder.run(&mut engine, &AtomicBool::new(false), |_| {}).expect("the disk takes a batch");
    drop(folder);
    std::fs::remove_dir_all(path).expect("the folder is ours");
    engine.trials()
}

fn bench(c: &mut Criterion) {
    let one_core = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let mut group = c.benchmark_group("study");
    group.throughput(Throughput::Elements(TRIALS)).sample_size(10);
    group.bench_function("four_views_in_memory", |b| {
        b.iter(|| one_core.install(|| in_memory(spec(TRIALS), STUDY, |_| {})));
    });
    group.bench_function("four_views_to_folder", |b| b.iter(|| one_core.install(to_folder)));
    group.finish();
}

/// Counts and sums, whatever the number of trials: what grows is a bug.
fn memory() {
    let after = |trials: u64| {
        in_memory(spec(trials), STUDY, |_| {}).expect("a study that ships");
        peak_memory_mib()
    };
    if let (Some(few), Some(many)) = (after(1_000), after(10_000)) {
        eprintln!("peak memory after 1000 trials {few:.1} MiB, after 10000 more {many:.1} MiB");
    }
}

criterion_group!(benches, bench);

fn main() {
    benches();
    Criterion::default().configure_from_args().final_summary();
    memory();
}
