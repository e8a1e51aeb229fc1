//! Is every experiment unchanged, correct, and true to the book? The same comparison as `calibench check`.

use calibench_experiments::{EXPERIMENTS, HEAVY};
use calibench_harness::verdict::Verdict;
use calibench_harness::{Context, Experiment, Record, golden, published};
use insta::comparator::Comparator;
use insta::{Settings, Snapshot};
use std::sync::LazyLock;

/// Compares snapshots number by number, each within the band that stands in the golden one.
#[derive(Clone)]
struct WithinBands;

impl Comparator for WithinBands {
    fn matches(&self, reference: &Snapshot, test: &Snapshot) -> bool {
        let (Some(reference), Some(test)) = (reference.as_text(), test.as_text()) else { return false };
        golden::compare(&reference.to_string(), &test.to_string()).held()
    }

    fn dyn_clone(&self) -> Box<dyn Comparator> {
        Box::new(self.clone())
    }
}

/// Those that are heavy, or the others, run with five threads.
fn records(heavy: bool) -> Vec<Record> {
    let run = |e: &Experiment| e.execute(&Context::of(e)).unwrap_or_else(|error| panic!("{}: {error}", e.id));
    let chosen = || EXPERIMENTS.iter().filter(|e| HEAVY.contains(&e.id) == heavy).map(run).collect();
    rayon::ThreadPoolBuilder::new().num_threads(5).build().expect("a thread pool starts").install(chosen)
}

/// Run once for all tests that only look at them.
static RECORDS: LazyLock<Vec<Record>> = LazyLock::new(|| records(false));

#[test]
fn every_number_lies_in_the_band_of_its_golden_snapshot() {
    compare_with_snapshots(&RECORDS);
}

fn compare_with_snapshots(records: &[Record]) {
    let mut settings = Settings::clone_current();
    settings.set_snapshot_path("../golden");
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.set_comparator(Box::new(WithinBands));
    settings.bind(|| {
        for record in records {
            insta::assert_snapshot!(record.experiment(), golden::snapshot(record));
        }
    });
}

#[test]
fn every_claim_and_every_published_value_holds() {
    refuse_deviations(&RECORDS);
}

fn refuse_deviations(records: &[Record]) {
    let deviations: Vec<String> =
        records.iter().flat_map(|record| Verdict::of(record, None, false).deviations).collect();
    assert!(deviations.is_empty(), "{}", deviations.join("\n"));
}

#[test]
#[ignore = "runs the heavy experiments unoptimised: `cargo test --test all -- --ignored heavy`, as `.ci/run all` does"]
fn heavy_experiments_hold_too() {
    let records = records(true);
    assert_eq!(records.len(), HEAVY.len());
    compare_with_snapshots(&records);
    refuse_deviations(&records);
    refuse_other_bits(&records);
}

#[test]
fn every_published_value_that_can_be_judged_is_reconciled_exactly_once() {
    let reconciliations = RECORDS.iter().flat_map(|record| record.reconciliations());
    let mut reconciled: Vec<&str> = reconciliations.map(|r| r.entry.id.as_str()).collect();
    let published = published::chapter().expect("golden/published.toml is well formed");
    let judged = published.iter().filter(|entry| entry.kind != published::Kind::CannotBeJudged);
    let mut listed: Vec<&str> = judged.map(|entry| entry.id.as_str()).collect();
    reconciled.sort_unstable();
    listed.sort_unstable();
    assert_eq!(reconciled, listed);
}

#[test]
#[ignore = "runs every experiment once more: `cargo test --test all -- --ignored another_seed`, as `.ci/run all` does"]
fn claims_and_published_values_hold_for_another_seed_too() {
    for experiment in EXPERIMENTS {
        let context = Context::of(experiment).with_seed(experiment.seed + 1);
        let record =
            experiment.execute(&context).unwrap_or_else(|error| panic!("{}: {error}", experiment.id));
        let verdict = Verdict::of(&record, None, false);
        assert!(verdict.held(), "{}: {}", experiment.id, verdict.deviations.join("\n"));
    }
}

/// The golden snapshots were blessed with the threads of some machine, and every other run compares with the
/// same bits: `.ci/run` those of one and of two threads in release, `.ci/reproducible` those of other
/// processors.
#[test]
fn five_threads_give_the_bits_of_the_golden_snapshots() {
    refuse_other_bits(&RECORDS);
}

fn refuse_other_bits(records: &[Record]) {
    let committed = |id: &str| {
        let path = format!("{}/golden/{id}.snap", env!("CARGO_MANIFEST_DIR"));
        std::fs::read_to_string(path).expect("a committed snapshot")
    };
    for record in records {
        let file = committed(record.experiment());
        let comparison = golden::compare(golden::contents(&file), &golden::snapshot(record));
        assert!(comparison.drift.is_empty(), "{}: {}", record.experiment(), comparison.drift.join("\n"));
    }
}
