//! The chapter's board photographed with exact area sampling, sharp and blurred.
#![allow(missing_docs)]

use calibench::synth::Truth;
use calibench::synth::render::{Imaging, photograph};
use calibench::synth::scene::looking_at_centre;
use criterion::{Criterion, criterion_group, criterion_main};

fn bench(c: &mut Criterion) {
    let (camera, board) = (Truth::example_camera(), Truth::example_board());
    let pose = looking_at_centre([20.0, 0.0, 0.0], 120.0);
    let mut group = c.benchmark_group("render");
    group.sample_size(20);
    for (name, blur_px) in [("sharp", 0.0), ("blurred", 0.7)] {
        let imaging = Imaging { blur_px, ..Imaging::default() };
        group.bench_function(name, |b| {
            b.iter(|| photograph(&camera, Truth::EXAMPLE_IMAGE, &board, &pose, &imaging));
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
