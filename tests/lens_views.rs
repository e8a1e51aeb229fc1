//! Views of one board from many sides, for the tests of other lenses than Brown-Conrady's.

use calibench::board::View;
use calibench::camera::{Camera, Lens};
use calibench::geometry::{Pose, Vec2, Vec3, rotation};
use calibench::synth::{Stream, StreamKey};

/// 9 x 7 marks, 10 apart.
pub fn board() -> Vec<Vec2> {
    (0..63).map(|i| Vec2::new(10.0 * f64::from(i % 9), 10.0 * f64::from(i / 9))).collect()
}

/// Poses around that board, tilted by 14 to 31 degrees; `offset` is how far from the axis it goes, in parts
/// of the distance.
pub fn poses(count: u32, distance: f64, offset: [f64; 2]) -> Vec<Pose> {
    (0..count)
        .map(|k| {
            let turn = f64::from(k);
            let tilt = 0.25 + 0.1 * f64::from(k % 4);
            Pose {
                rotation: rotation::from_xyz_rad(tilt * libm::sin(turn), tilt * libm::cos(turn), 0.4 * turn),
                translation: Vec3::new(
                    offset[0] * distance * libm::cos(2.4 * turn) - 30.0,
                    offset[1] * distance * libm::sin(2.4 * turn) - 25.0,
                    distance * (1.0 + 0.1 * f64::from(k % 3)),
                ),
            }
        })
        .collect()
}

/// What the camera sees of some marks in each view, with noise of 0.1 px; the board is twisted by `twist` at
/// its corners.
pub fn seen(
    camera: &Camera<Lens>,
    poses: &[Pose],
    marks: impl Fn(usize) -> Vec<Vec2>,
    twist: f64,
) -> Vec<View> {
    let mut stream = Stream::open(StreamKey { seed: 11, scenario: "hard-lens", trial: 0, purpose: "noise" });
    let view = |(k, pose): (usize, &Pose)| {
        let pairs = marks(k).into_iter().filter_map(|p| {
            let height = twist * (p.x / 40.0 - 1.0) * (p.y / 30.0 - 1.0);
            Some((p, camera.pixel(&pose.apply(&Vec3::new(p.x, p.y, height)))?))
        });
        let (points, pixels): (Vec<Vec2>, Vec<Vec2>) = pairs.unzip();
        let noisy = pixels.iter().map(|p| p + 0.1 * Vec2::new(stream.normal(), stream.normal())).collect();
        View::new(points, noisy).unwrap()
    };
    poses.iter().enumerate().map(view).collect()
}
