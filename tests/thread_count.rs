//! Does the number of threads show in a result? Every bit of a calibration, with one thread and with several.

use calibench::calibrate::{Calibration, Settings, calibrate};
use calibench::synth::{Scene, Stream, StreamKey, Truth, scene};

/// Enough views for the work to be shared out, and not a multiple of a chunk.
const VIEWS: usize = 151;

fn with_threads(count: usize) -> Calibration {
    let key = StreamKey { seed: 7, scenario: "threads", trial: 0, purpose: "noise" };
    let mut stream = Stream::open(StreamKey { purpose: "pose", ..key });
    let mut truth = Truth::example();
    truth.cam_from_target = (0..VIEWS)
        .map(|_| {
            let turn = std::array::from_fn(|_| stream.uniform_in(-30.0, 30.0));
            scene::looking_at_centre(turn, stream.uniform_in(110.0, 160.0))
        })
        .collect();
    let views = Scene::new(truth).unwrap().observe(0.1, &mut Stream::open(key));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build().unwrap();
    pool.install(|| calibrate(&views, &Settings::standard())).unwrap()
}

#[test]
fn one_thread_and_several_give_the_same_bits() {
    let alone = with_threads(1);
    assert!(alone.residuals.len() == VIEWS && alone.rmse_px > 0.0);
    for count in [2, 3, 8] {
        // No number is NaN and no zero is signed by chance: equality is equality of bits.
        assert_eq!(with_threads(count), alone, "{count} threads");
    }
}
