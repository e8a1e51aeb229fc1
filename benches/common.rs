//! The problem that the benches share: the chapter's camera and target, seen from many sides.
#![allow(dead_code, reason = "every program of this folder takes what it needs")]

use calibench::board::View;
use calibench::camera::{Camera, Lens, Model};
use calibench::geometry::{Pose, Vec2, Vec3};
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

/// The same through a fisheye, with noise of 0.1 px.
pub fn fisheye_views(views: usize) -> Vec<View> {
    let lens = Lens::new(Model::KannalaBrandt, &[-0.03, 0.004, 0.0, 0.0]).expect("four coefficients");
    let camera = Camera::with_lens(600.0, 600.0, 320.0, 240.0, lens);
    let points = Truth::example_board().points();
    let mut noise = Stream::open(KEY);
    let view = |pose: Pose| {
        let mut seen = |p: &Vec2| {
            let pixel = camera.pixel(&pose.apply(&Vec3::new(p.x, p.y, 0.0))).expect("a fisheye sees it");
            pixel + 0.1 * Vec2::new(noise.normal(), noise.normal())
        };
        let pixels = points.iter().map(&mut seen).collect();
        View::new(points.clone(), pixels).expect("as many pixels as points")
    };
    poses(views).into_iter().map(view).collect()
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
