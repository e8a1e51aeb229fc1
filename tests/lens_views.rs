//! Views of one board from many sides, for the tests of other lenses than Brown-Conrady's.

use calibench::geometry::{Pose, Vec2, Vec3, rotation};

/// 9 x 7 marks, 10 apart.
pub fn board() -> Vec<Vec2> {
    (0..63).map(|i| Vec2::new(10.0 * f64::from(i % 9), 10.0 * f64::from(i / 9))).collect()
}

/// Poses around that board, tilted by 14 to 31 degrees; `offset` is how far from the axis it goes, in parts of the distance.
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
