//! From raw points to a camera with closed-form start and full covariance: 63 points a view, six intrinsics free.
#![allow(missing_docs)]

mod common;

use calibench::calibrate::{Settings, calibrate};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("calibrate");
    for count in [4, 20, 100, 500, 2000] {
        let views = common::views(count);
        group.throughput(Throughput::Elements(count as u64)).sample_size(if count < 500 { 100 } else { 20 });
        group.bench_with_input(BenchmarkId::from_parameter(count), &views, |b, views| {
            b.iter(|| calibrate(views, &Settings::chapter()));
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
