//! Which of its two tilts does a plane have? The other pose that explains an image of a plane nearly as well.
//!
//! Seen from far away a plane and its mirror image with respect to the line of sight look the same; only
//! perspective tells them apart, by `g w^2 / f` px at the edge of a target of half-width `w` px and slope `g`
//! (Schweighofer & Pinz 2006; Collins & Bartoli 2014). A search that starts in the wrong one stays there.

use super::minimise::{Problem, State, rounding_cost};
use super::normal::Observations;
use super::prior::Priors;
use crate::camera::FreeParameters;
use crate::geometry::{Mat3, Pose, Vec3};

/// The pose whose plane is mirrored about the line of sight to the target's origin: `R' = Q^T D Q R D` with
/// `D = diag(1, 1, -1)` and `Q` the rotation that takes the line of sight to the optical axis. Its image
/// agrees to first order in size over distance.
pub(crate) fn mirrored(pose: &Pose) -> Pose {
    let sight = pose.translation.normalize();
    let about = to_axis(&sight);
    let flip = Mat3::from_diagonal(&Vec3::new(1.0, 1.0, -1.0));
    let rotation = about.transpose() * flip * about * pose.rotation * flip;
    Pose { rotation, translation: pose.translation }
}

/// The shortest rotation that takes a unit vector with positive z to the z axis.
fn to_axis(v: &Vec3) -> Mat3 {
    let (a, b, c) = (v.x, v.y, v.z);
    let k = 1.0 / (1.0 + c.max(-0.999));
    Mat3::new(1.0 - k * a * a, -k * a * b, -a, -k * a * b, 1.0 - k * b * b, -b, a, b, c)
}

/// Angle between the planes of two poses, rad.
pub(super) fn angle_between(a: &Pose, b: &Pose) -> f64 {
    let (a, b) = (a.rotation.column(2).into_owned(), b.rotation.column(2).into_owned());
    libm::atan2(a.cross(&b).norm(), a.dot(&b))
}

/// If turning a plane to its other tilt raises the cost by more variances than this, the other tilt cannot
/// explain the view.
const TELLING: f64 = 400.0;
/// If the shortening of a plane by its tilt is worth fewer variances than this, it might as well have none,
/// and both tilts are one.
const TILTED: f64 = 4.0;
/// Mean square of the perspective of a unit tilt over a square of half-width 1, less what a pose can follow:
/// `x^2` less its best line has 4/45, and as much of `x y` is left.
const CURVED: f64 = 0.16;
/// Mean square of a unit shortening over the same square, less a change of distance: half of 1/3.
const SHORTENED: f64 = 0.17;

/// Whether the mirrored pose might explain a view of noise `noise_px` as well: its tilt shows, and
/// perspective hardly tells its sign.
pub(super) fn is_doubtful(pose: &Pose, observations: &Observations, focal: f64, noise_px: f64) -> bool {
    let normal = pose.rotation.column(2).into_owned();
    let sight = pose.translation.normalize();
    let (low, high) = observations.to_box();
    let half_width = 0.25 * (high - low).sum();
    let cosine = normal.dot(&sight).abs().max(1e-3);
    let slope = normal.cross(&sight).norm() / cosine;
    let variances = |mean_square: f64, shift_px: f64| {
        let shift = shift_px / noise_px;
        mean_square * observations.len() as f64 * shift * shift
    };
    let perspective = variances(CURVED, 2.0 * slope * half_width * half_width / focal);
    let shortening = variances(SHORTENED, half_width * (1.0 - cosine));
    perspective < TELLING && shortening > TILTED
}

/// Steps of the pose of one view alone.
const RESECTION_ITERATIONS: usize = 30;

/// The pose of a view refined alone, the camera held, and its cost.
pub(super) fn resected(problem: &Problem<'_>, state: &State, view: usize, start: Pose) -> (Pose, f64) {
    let alone = Problem {
        free: FreeParameters::NONE,
        priors: Priors::NONE,
        observations: &problem.observations[view..=view],
        max_iterations: RESECTION_ITERATIONS,
        rounding_cost: rounding_cost(&problem.observations[view..=view]),
        ..*problem
    };
    let minimum = alone.minimise(State { camera: state.camera, cam_from_target: vec![start] });
    (minimum.state.cam_from_target[0], minimum.system.cost)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec2;
    use crate::geometry::rotation;

    #[test]
    fn a_mirrored_pose_is_a_rotation_whose_image_agrees_from_far_away() {
        let pose = Pose {
            rotation: rotation::from_xyz_rad(0.3, -0.4, 0.2),
            translation: Vec3::new(30.0, -20.0, 100.0),
        };
        let other = mirrored(&pose);
        assert!((other.rotation.transpose() * other.rotation - Mat3::identity()).norm() < 1e-14);
        assert!((other.rotation.determinant() - 1.0).abs() < 1e-14);
        assert!((mirrored(&other).rotation - pose.rotation).norm() < 1e-14);
        // Points a thousand times nearer to each other than to the camera: the images agree to second order.
        let image = |p: &Pose, x: f64, y: f64| {
            let c = p.apply(&Vec3::new(x, y, 0.0));
            (c.x / c.z, c.y / c.z)
        };
        for (x, y) in [(0.1, 0.0), (0.0, 0.1), (-0.07, 0.05)] {
            let (a, b) = (image(&pose, x, y), image(&other, x, y));
            let (o, first) = (image(&pose, 0.0, 0.0), libm::hypot(a.0 - b.0, a.1 - b.1));
            assert!(first < 0.01 * libm::hypot(a.0 - o.0, a.1 - o.1), "{first}");
        }
    }

    #[test]
    fn planes_differ_by_the_angle_of_their_normals_however_they_are_rolled() {
        let pose = |tilt: f64, roll: f64| Pose {
            rotation: rotation::from_xyz_rad(tilt, 0.0, 0.0) * rotation::from_xyz_rad(0.0, 0.0, roll),
            translation: Vec3::new(3.0, -2.0, 100.0),
        };
        for turn in [0.0, 0.3, 2.0, 3.1] {
            assert!((angle_between(&pose(0.1, 0.7), &pose(0.1 + turn, -1.2)) - turn).abs() < 1e-14);
        }
    }

    #[test]
    fn a_tilt_is_doubtful_where_it_shows_and_perspective_hardly_tells_its_sign() {
        // 100 marks over a square of half-width 50 px, seen with 1000 px and noise of 0.1 px.
        let pair = |i: u32| (Vec2::zeros(), Vec2::new(f64::from(i % 10), f64::from(i / 10)) * (100.0 / 9.0));
        let observations = Observations::new((0..100).map(pair));
        let is_doubtful = |tilt: f64| {
            let pose = Pose {
                rotation: rotation::from_xyz_rad(tilt, 0.0, 0.2),
                translation: Vec3::new(0.0, 0.0, 500.0),
            };
            is_doubtful(&pose, &observations, 1000.0, 0.1)
        };
        // Shorter by 50 (1 - cos) px: 0.17 * 100 * (500 (1 - cos))^2 is 4 at cos = 0.99903, a tilt of 0.0441.
        assert!(!is_doubtful(0.042) && is_doubtful(0.046));
        // Perspective of 2 tan * 50^2 / 1000 px: 0.16 * 100 * (50 tan)^2 is 400 at tan = 0.1.
        assert!(is_doubtful(libm::atan(0.098)) && !is_doubtful(libm::atan(0.102)));
    }
}
