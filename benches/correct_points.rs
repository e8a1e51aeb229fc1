//! A million pixels corrected for the chapter's lens, at once and one by one.
#![allow(missing_docs)]

use calibench::camera::{BrownConrady, Camera};
use calibench::geometry::Vec2;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

fn bench(c: &mut Criterion) {
    let camera =
        Camera::pinhole(600.0, 600.0, 326.0, 243.0).with_distortion(BrownConrady::radial(-0.18, 0.05));
    let pixels: Vec<Vec2> =
        (0..1_000_000).map(|i| Vec2::new(f64::from(i % 1000) * 0.64, f64::from(i / 1000) * 0.48)).collect();
    let mut group = c.benchmark_group("correct_points");
    group.throughput(Throughput::Elements(pixels.len() as u64)).sample_size(20);
    group.bench_function("at_once", |b| b.iter(|| camera.correct_pixels(&pixels)));
    group.bench_function("one_by_one", |b| {
        b.iter(|| pixels.iter().map(|p| camera.correct_pixel(p)).collect::<Result<Vec<_>, _>>());
    });
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
