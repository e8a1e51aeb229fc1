//! The problem that the benches share: the chapter's camera and target, seen from many sides.
#![allow(dead_code, reason = "every program of this folder takes what it needs")]

use calibench::board::View;
use calibench::geometry::Pose;
use calibench::synth::{Scene, Stream, StreamKey, Truth, scene};

const KEY: StreamKey = StreamKey { seed: 1, scenario: "bench", trial: 0, purpose: "noise" };

/// The chapter's four poses, or random tilts up to 30 degrees at 110 to 160 mm.
pub fn poses(views: usize) -> Vec<Pose> {
    if views <= 4 {
        return Truth::example_poses();
    }
    let mut stream = Stream::open(StreamKey { purpose: "pose", ..KEY });
    (0..views)
        .map(|_| {
            let turn = std::array::from_fn(|_| stream.uniform_in(-30.0, 30.0));
            scene::looking_at_centre(turn, stream.uniform_in(110.0, 160.0))
        })
        .collect()
}

/// `views` noisy views of 63 points.
pub fn views(views: usize) -> Vec<View> {
    observed(poses(views))
}

/// Three views of a target that faces the camera: they determine no focal length.
pub fn facing_views() -> Vec<View> {
    observed([110.0, 130.0, 150.0].map(|distance| scene::looking_at_centre([0.0; 3], distance)).to_vec())
}

fn observed(cam_from_target: Vec<Pose>) -> Vec<View> {
    let truth = Truth { cam_from_target, ..Truth::example() };
    let scene = Scene::new(truth).expect("every view lies in front of the camera");
    scene.observe(0.1, &mut Stream::open(KEY))
}
