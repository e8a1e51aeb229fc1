//! Every row of the speed tables on the clock: `cargo bench --package calibench-benches --bench rows --
//! calibrate`.
#![allow(missing_docs)]

mod common;
mod works;

use criterion::{Criterion, criterion_group, criterion_main};
use std::time::Instant;

fn bench(c: &mut Criterion) {
    for row in works::rows() {
        // Made when first asked for, so that a filter saves making the others.
        let mut work = None;
        c.bench_function(&row, |b| {
            let work = work.get_or_insert_with(|| works::named(&row).expect("a row of the list"));
            b.iter_custom(|times| {
                let start = Instant::now();
                work.repeat(times as usize);
                start.elapsed()
            });
        });
    }
}

criterion_group!(benches, bench);
criterion_main!(benches);
