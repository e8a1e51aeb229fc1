//! The maximum-likelihood homography of 63 noisy points.
#![allow(missing_docs)]

mod common;

use calibench::geometry::Homography;
use criterion::{Criterion, criterion_group, criterion_main};

fn bench(c: &mut Criterion) {
    let views = common::views(4);
    let view = &views[3];
    c.bench_function("homography/63", |b| b.iter(|| Homography::fit(view.points(), view.pixels())));
}

criterion_group!(benches, bench);
criterion_main!(benches);
