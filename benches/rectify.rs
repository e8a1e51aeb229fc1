//! Photographs of the chapter's lens made straight: by a table made before, and without one.
#![allow(missing_docs)]

use calibench::camera::{BrownConrady, Camera};
use calibench::raster::Raster;
use calibench::rectify::{RectifyMap, rectify_image};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

/// The chapter's camera, its image scaled to another width.
fn camera(width: usize) -> Camera {
    let scale = width as f64 / 640.0;
    Camera::pinhole(600.0 * scale, 600.0 * scale, 326.0 * scale, 243.0 * scale)
        .with_distortion(BrownConrady::radial(-0.18, 0.05))
}

fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("rectify");
    for size in [(640, 480), (4000, 3000)] {
        let camera = camera(size.0);
        let output = camera.with_distortion(BrownConrady::default());
        let photo = Raster::from_fn(size.0, size.1, |x, y| ((x * 7 + y * 13 + x * y / 64) % 256) as u8);
        let map = RectifyMap::between(&camera, size, &output, size).expect("a size that can be interpolated");
        let name = format!("{}x{}", size.0, size.1);
        group.throughput(Throughput::Elements((size.0 * size.1) as u64));
        group.sample_size(if size.0 > 1000 { 20 } else { 100 });
        group.bench_function(BenchmarkId::new("cached", &name), |b| b.iter(|| map.apply(&photo, 0)));
        group.bench_function(BenchmarkId::new("direct", &name), |b| {
            b.iter(|| rectify_image(&photo, &camera, &output, size, 0));
        });
        group.bench_function(BenchmarkId::new("table", &name), |b| {
            b.iter(|| RectifyMap::between(&camera, size, &output, size));
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
