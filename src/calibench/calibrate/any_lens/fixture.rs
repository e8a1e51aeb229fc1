//! Views through fisheyes, for the tests.

use super::super::Loss;
use super::super::minimise::{Minimum, RELATIVE_GAIN, descend};
use super::super::noise::Noise;
use super::super::target_frame::TargetFrames;
use super::marks::Marks;
use super::problem::{Problem, State};
use super::{WIDTH, marks, shape};
use crate::board::View;
use crate::camera::{Camera, FreeParameters, Lens, Model, Parameter};
use crate::geometry::{Pose, Vec2, Vec3, rotation};

/// What is free in these tests.
pub(super) const FREE: [Parameter; 6] =
    [Parameter::Fx, Parameter::Fy, Parameter::Cx, Parameter::Cy, Parameter::K1, Parameter::K2];

pub(super) fn truth() -> (Camera<Lens>, Vec<Pose>) {
    let lens = Lens::new(Model::KannalaBrandt, &[-0.03, 0.004, 0.0, 0.0]).unwrap();
    let turns = [[0.4, 0.0, 0.1], [0.0, -0.4, 0.0], [-0.3, 0.25, 0.4], [0.3, 0.3, 1.0], [-0.4, -0.3, 2.0]];
    let poses = turns.map(|[x, y, z]| Pose {
        rotation: rotation::from_xyz_rad(x, y, z),
        translation: Vec3::new(2.0, -3.0, 60.0),
    });
    (Camera::with_lens(600.0, 610.0, 320.0, 240.0, lens), poses.to_vec())
}

/// Noise of [`wide_views`], px.
pub(super) const WIDE_NOISE_PX: f64 = 0.003;

/// Twenty views from near by, marks up to 60 degrees from the axis: the certificate of a pinhole with k1 and
/// k2 fails.
pub(super) fn wide_views() -> Vec<View> {
    wide_views_of_a_bowed_board(0.0)
}

/// The same of a board whose middle lies higher than its edges in x, by this part of the target's unit.
pub(super) fn wide_views_of_a_bowed_board(bow: f64) -> Vec<View> {
    let lens = Lens::new(Model::KannalaBrandt, &[0.02, -0.01, 0.004, -0.0015]).unwrap();
    let pose = |k: i32| Pose {
        rotation: rotation::from_xyz_rad(
            0.7 * libm::sin(f64::from(2 * k)),
            0.7 * libm::cos(f64::from(3 * k)),
            0.8 * f64::from(k),
        ),
        translation: Vec3::new(6.0 * (f64::from(k % 3) - 1.0), 6.0 * (f64::from(k % 4) - 1.5), 38.0),
    };
    seen(
        &Camera::with_lens(230.0, 230.0, 326.0, 243.0, lens),
        &(0..20).map(pose).collect::<Vec<_>>(),
        WIDE_NOISE_PX,
        bow,
    )
}

/// Five views without noise.
pub(super) fn exact_views() -> Vec<View> {
    let (camera, poses) = truth();
    seen(&camera, &poses, 0.0, 0.0)
}

/// What the camera sees of five rows of seven marks.
fn seen(camera: &Camera<Lens>, poses: &[Pose], noise_px: f64, bow: f64) -> Vec<View> {
    let points: Vec<Vec2> =
        (0..35).map(|i| Vec2::new(f64::from(i % 7) - 3.0, f64::from(i / 7) - 2.0) * 12.0).collect();
    // Deviations that have nothing in common: the phases are those of a chirp.
    let mut count = 0.0;
    let mut noise = || {
        count += 1.0;
        noise_px * std::f64::consts::SQRT_2 * libm::sin(0.7 * count * count)
    };
    let mut seen = |pose: &Pose| {
        let mut pixel = |p: &Vec2| {
            let height = bow * (1.0 - (p.x / 36.0) * (p.x / 36.0));
            let pixel = camera.pixel(&pose.apply(&Vec3::new(p.x, p.y, height))).unwrap();
            pixel + Vec2::new(noise(), noise())
        };
        View::new(points.clone(), points.iter().map(&mut pixel).collect()).unwrap()
    };
    poses.iter().map(&mut seen).collect()
}

/// Least squares with nothing known beforehand.
pub(super) fn problem(views: &[Marks], free: FreeParameters) -> Problem<'_> {
    Problem {
        views,
        free,
        held: FreeParameters::NONE,
        fy_per_fx: None,
        priors: &[],
        noise: Noise::of_squares(0.01),
        bend: None,
        loss: Loss::Squares,
        max_iterations: 200,
        relative_gain: RELATIVE_GAIN,
        rounding_cost: 0.0,
        is_certifiable: true,
    }
}

/// What `then` makes of the minimum that is met from the truth with these parameters free and fx times a
/// factor.
pub(super) fn at_minimum<T>(
    free: FreeParameters,
    factor: f64,
    then: impl Fn(&Problem<'_>, &Minimum<State, WIDTH>) -> T,
) -> T {
    let (camera, poses) = truth();
    let views = seen(&camera, &poses, 0.1, 0.0);
    let frames = TargetFrames::of(&views);
    let listed = marks::of_views(&views, &frames, &shape::region(&views));
    let problem = problem(&listed, free);
    let poses = poses.iter().enumerate();
    let cam_from_target = poses.map(|(view, pose)| frames.at(view).of_pose(pose)).collect();
    let camera = Camera { fx: factor * camera.fx, fy: factor * camera.fy, ..camera };
    then(&problem, &descend(&problem, State { camera, cam_from_target, shape: [0.0; 3] }))
}
