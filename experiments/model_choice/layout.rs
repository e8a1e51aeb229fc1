//! Where is the board held? Layouts from a few marks to thousands, every trial with poses of its own.

use super::truths::Truth;
use calibench::board::Board;
use calibench::camera::{Camera, Imaging, Lens};
use calibench::geometry::{Mat3, Pose, Vec2, Vec3, rotation};
use calibench::synth::Stream;
use std::f64::consts::TAU;

/// How many photographs of what board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// Number of views.
    pub views: usize,
    /// Marks in a row of the board.
    pub columns: usize,
    /// Its rows.
    pub rows: usize,
    /// Trials of a truth, and of one that is slow. A fit takes time in proportion to the marks.
    trials: [u64; 2],
}

/// From the least that anyone calibrates from to what a long session gives.
pub const LAYOUTS: [Layout; 5] = [
    Layout { views: 4, columns: 4, rows: 3, trials: [50, 20] },
    Layout { views: 6, columns: 5, rows: 5, trials: [50, 20] },
    Layout { views: 8, columns: 9, rows: 7, trials: [25, 10] },
    Layout { views: 18, columns: 12, rows: 7, trials: [12, 4] },
    Layout { views: 30, columns: 14, rows: 12, trials: [6, 2] },
];

/// Width of every board, mm.
const WIDTH_MM: f64 = 200.0;
/// Width of the board in the image over the image's height, if it faced the camera in the middle.
const EXTENT: (f64, f64) = (0.35, 0.65);
/// Angle between the board's normal and the ray to its middle, degrees.
const TILT_DEG: (f64, f64) = (5.0, 40.0);
/// Roll about the normal, degrees, either way.
const ROLL_DEG: f64 = 45.0;
/// Draws of a pose until the whole board is seen: the middle of most draws lies too near to the border.
const MOST_DRAWS: usize = 10_000;

impl Layout {
    /// Marks of all views.
    pub fn marks(&self) -> usize {
        self.views * self.columns * self.rows
    }

    /// Trials of a truth.
    pub fn trials(&self, truth: &Truth) -> u64 {
        self.trials[usize::from(truth.is_slow)]
    }

    /// The marks of its board, about its middle, mm.
    pub fn points(&self) -> Vec<Vec2> {
        let spacing = WIDTH_MM / (self.columns - 1) as f64;
        Board::chessboard(self.columns, self.rows, spacing).expect("rows and columns of marks").points()
    }

    /// Poses of a trial, each with all of the board in the image; `None` where no draw is.
    pub fn poses(&self, truth: &Truth, stream: &mut Stream) -> Option<Vec<Pose>> {
        let (camera, points) = (truth.camera(), self.points());
        let sees = sight(&camera, truth.size, &points);
        let mut draws = 0;
        let mut poses = Vec::new();
        while poses.len() < self.views {
            draws += 1;
            if draws > MOST_DRAWS {
                return None;
            }
            poses.extend(draw(&camera, truth.size, stream).filter(&sees));
        }
        Some(poses)
    }
}

/// A fixed number of draws: the board's middle anywhere in the image, its normal tilted from the ray to it in
/// any direction, then rolled.
fn draw(camera: &Camera<Lens>, (width, height): (usize, usize), stream: &mut Stream) -> Option<Pose> {
    let [x, y, extent, direction, tilt, roll] = std::array::from_fn(|_| stream.uniform());
    let between = |(low, high): (f64, f64), share: f64| low + (high - low) * share;
    let ray = camera.ray(&Vec2::new(x * width as f64 - 0.5, y * height as f64 - 0.5)).ok()?;
    let distance = WIDTH_MM * camera.fx / (between(EXTENT, extent) * height as f64);
    let (sin, cos) = libm::sincos(TAU * direction);
    let tilted = rotation::exp(&(Vec3::new(cos, sin, 0.0) * between(TILT_DEG, tilt).to_radians()));
    let rolled = rotation::exp(&(Vec3::z() * (between((-ROLL_DEG, ROLL_DEG), roll)).to_radians()));
    Some(Pose { rotation: towards(&ray) * tilted * rolled, translation: ray * distance })
}

/// The shortest rotation that takes the optical axis to a ray.
fn towards(ray: &Vec3) -> Mat3 {
    let axis = Vec3::z().cross(ray);
    let sin = axis.norm();
    if sin == 0.0 { Mat3::identity() } else { rotation::exp(&(axis * (libm::atan2(sin, ray.z) / sin))) }
}

/// Tells whether all marks of a pose lie in the image, where the lens is one-to-one.
fn sight(camera: &Camera<Lens>, (width, height): (usize, usize), points: &[Vec2]) -> impl Fn(&Pose) -> bool {
    let is_one_to_one = camera.distortion.one_to_one();
    let (right, bottom) = (width as f64 - 0.5, height as f64 - 0.5);
    let inside = move |pixel: Vec2| (-0.5..=right).contains(&pixel.x) && (-0.5..=bottom).contains(&pixel.y);
    let shows = move |point: Vec3| is_one_to_one(&point) && Lens::image(camera, &point).is_some_and(inside);
    move |pose| points.iter().all(|p| shows(pose.apply(&Vec3::new(p.x, p.y, 0.0))))
}

#[cfg(test)]
mod tests {
    use super::super::truths::TRUTHS;
    use super::*;
    use calibench::synth::StreamKey;

    #[test]
    fn a_turned_axis_is_the_ray_beside_and_behind_the_camera_too() {
        for ray in [Vec3::new(0.3, -0.2, 0.9), Vec3::new(0.9, 0.4, -0.3), Vec3::z()] {
            let ray = ray.normalize();
            assert!((towards(&ray) * Vec3::z() - ray).norm() < 1e-14);
        }
    }

    #[test]
    fn every_truth_has_poses_in_every_layout_and_a_trial_its_own() {
        let key = |trial| StreamKey { seed: 1, scenario: "layout", trial, purpose: "pose" };
        for truth in &TRUTHS {
            for layout in LAYOUTS {
                let poses = |trial| layout.poses(truth, &mut Stream::open(key(trial))).unwrap();
                assert_eq!(poses(0).len(), layout.views);
                assert_ne!(poses(0), poses(1));
                let middle = layout.points().iter().sum::<Vec2>();
                assert!(middle.norm() < 1e-9 && layout.points().len() * layout.views == layout.marks());
            }
        }
    }
}
