//! Photograph to ordered grid: 63 discs in 640 x 480, and nine dots in a page of 1571 x 1053.
#![allow(missing_docs)]

use calibench::detect::{circle_grid, sparse_dots};
use calibench::synth::Truth;
use calibench::synth::render::{Imaging, nine_dot_stand_in, photograph};
use calibench::synth::scene::looking_at_centre;
use criterion::{Criterion, criterion_group, criterion_main};

fn bench(c: &mut Criterion) {
    let pose = looking_at_centre([20.0, 0.0, 0.0], 120.0);
    let board = Truth::chapter_board();
    let photo =
        photograph(&Truth::chapter_camera(), Truth::CHAPTER_IMAGE, &board, &pose, &Imaging::default())
            .expect("the board lies in front of the camera")
            .image
            .to_u8();
    let nine_dots = nine_dot_stand_in().image.to_u8();
    let mut group = c.benchmark_group("detect");
    group.bench_function("grid_9x7", |b| b.iter(|| circle_grid(&photo, 9, 7)));
    group.bench_function("nine_dots", |b| b.iter(|| sparse_dots(&nine_dots, 3, 3)));
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
