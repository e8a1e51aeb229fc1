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
    seen_through(&Camera::with_lens(600.0, 600.0, 320.0, 240.0, lens), poses(views))
}

/// Views through a wide lens of a model, with noise of 0.1 px: a fisheye, or the rational model with all its
/// coefficients. The poses are those above at a third of their distance: marks lie up to 65 degrees from the
/// axis and more, and tell k1 of the rational model to 0.15 from four views. At half the distance they tell
/// it to 30, which is nothing.
pub fn wide_views(model: Model, views: usize) -> Vec<View> {
    let (focal, coefficients): (f64, &[f64]) = match model {
        Model::KannalaBrandt => (230.0, &[0.02, -0.01, 0.004, -0.0015]),
        _ => (250.0, &[0.2, 0.3, 0.0006, -0.0009, 0.02, 0.5, 0.4, 0.1]),
    };
    let lens = Lens::new(model, coefficients).expect("as many coefficients as the model has");
    let near = |pose: Pose| Pose { translation: 0.35 * pose.translation, ..pose };
    seen_through(
        &Camera::with_lens(focal, focal, 326.0, 243.0, lens),
        poses(views).into_iter().map(near).collect(),
    )
}

fn seen_through(camera: &Camera<Lens>, poses: Vec<Pose>) -> Vec<View> {
    let points = Truth::example_board().points();
    let mut noise = Stream::open(KEY);
    let view = |pose: Pose| {
        let mut seen = |p: &Vec2| {
            let pixel = camera.pixel(&pose.apply(&Vec3::new(p.x, p.y, 0.0))).expect("the lens sees it");
            pixel + 0.1 * Vec2::new(noise.normal(), noise.normal())
        };
        let pixels = points.iter().map(&mut seen).collect();
        View::new(points.clone(), pixels).expect("as many pixels as points")
    };
    poses.into_iter().map(view).collect()
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
