//! The affine map of nine points: the chapter's nine-point calibration.
#![allow(missing_docs)]

use calibench::geometry::{Affine, Vec2};
use criterion::{Criterion, criterion_group, criterion_main};
use std::hint::black_box;

fn bench(c: &mut Criterion) {
    let world: Vec<Vec2> =
        (0..9).map(|i| Vec2::new(f64::from(i % 3) * 40.0, f64::from(i / 3) * 30.0)).collect();
    let bent = |p: &Vec2| Vec2::new(0.02 * p.x * p.y / 40.0, -0.01 * p.x);
    let pixels: Vec<Vec2> = world.iter().map(|p| p * 8.0 + Vec2::new(600.0, 400.0) + bent(p)).collect();
    c.bench_function("affine/9", |b| b.iter(|| Affine::fit(black_box(&pixels), black_box(&world))));
}

criterion_group!(benches, bench);
criterion_main!(benches);
