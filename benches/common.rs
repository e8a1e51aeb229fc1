//! The problem that the benches share: the chapter's camera and target, seen from many sides.

use calibench::synth::{Scene, Stream, StreamKey, Truth, scene};
use calibench::target::View;

/// `views` noisy views of 63 points: the chapter's four, or random tilts up to 30 degrees at 110 to 160 mm.
pub fn views(views: usize) -> Vec<View> {
    let key = StreamKey { seed: 1, scenario: "bench", trial: 0, purpose: "noise" };
    let mut truth = Truth::chapter();
    if views > 4 {
        let mut stream = Stream::open(StreamKey { purpose: "pose", ..key });
        truth.cam_from_target = (0..views)
            .map(|_| {
                let turn = std::array::from_fn(|_| stream.uniform_in(-30.0, 30.0));
                scene::looking_at_centre(turn, stream.uniform_in(110.0, 160.0))
            })
            .collect();
    }
    let scene = Scene::new(truth).expect("every view lies in front of the camera");
    scene.observe(0.1, &mut Stream::open(key))
}
