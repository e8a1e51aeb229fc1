//! Is there a second double sphere that makes the same picture?
//!
//! With `alpha = 0` the radius of a ray is `f |(X, Y)| / (xi d + Z)`, with `xi = 0` it is `f |(X, Y)| /
//! (alpha d + (1 - alpha) Z)`, `d` being the distance: the first is the second at `alpha' = xi / (1 + xi)`
//! and `f' = f / (1 + xi)`, ray by ray. Beside one of the two a search ends in a minimum whose deviations
//! know nothing of the other, and to that one no descent leads: at `xi = 0` the derivatives by `f`, `xi` and
//! `alpha` span two directions. There the deviations have no bound either, and do not say that the other is
//! another camera: those at a coefficient held at 0 do.

use super::super::intervals::Profiled;
use super::super::minimise::{Minimum, descend};
use super::super::noise::Noise;
use super::super::rival::{RIVALS, Rival, SAME};
use super::WIDTH;
use super::problem::{Problem, State};
use crate::calibrate::Warning;
use crate::camera::{Camera, Lens, Parameter};
use nalgebra::DMatrix;

/// A coefficient within this many standard deviations of 0 may be 0: at so many the cost rises by as many
/// variances as a rival's may.
const MAY_BE_ZERO: f64 = 4.0;

/// The second camera if it explains the marks nearly as well and has another focal length; alpha or xi of the
/// minimum may be 0 then, and both are free, as the focal length is. `unit` is the covariance of the free
/// parameters for unit noise.
pub(super) fn counterpart(
    problem: &Problem<'_>,
    minimum: &Minimum<State, WIDTH>,
    unit: &DMatrix<f64>,
    noise: Noise,
) -> Option<(Rival, Camera<Lens>)> {
    use Parameter::{Alpha, Fx, Xi};
    if ![Fx, Xi, Alpha].into_iter().all(|parameter| problem.free.contains(parameter)) {
        return None;
    }
    let distance_from_zero = |parameter| {
        let row = problem.free.position(parameter)?;
        Some(minimum.state.camera.value(parameter)?.abs() / deviation(unit, row, noise))
    };
    let nearest = [Alpha, Xi]
        .into_iter()
        .filter_map(|parameter| Some((parameter, distance_from_zero(parameter)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1));
    let (zero, _) = nearest.filter(|(_, deviations)| *deviations < MAY_BE_ZERO)?;
    let held = problem.holding(zero);
    let there = descend(&held, held.with_value(minimum.state.clone(), zero, 0.0));
    let focal_length = held.free.position(Fx)?;
    let unit = there.system.reduction()?.intrinsics_covariance()?;
    let state = State { camera: same_picture(&there.state.camera)?, ..there.state };
    let apart = (state.camera.fx - there.state.camera.fx).abs() / deviation(&unit, focal_length, noise);
    // Priors tell the two apart, pixels do not.
    let excess = (problem.cost(&state) - minimum.system.cost) / noise.rise;
    let rival = Rival { parameter: Fx, value: state.camera.fx, excess };
    (excess < RIVALS && apart > SAME).then_some((rival, state.camera))
}

/// Standard deviation of a shared unknown.
fn deviation(unit: &DMatrix<f64>, row: usize, noise: Noise) -> f64 {
    noise.scale() * unit[(row, row)].sqrt()
}

/// The other double sphere with the picture of one whose alpha or xi is 0; none where it lies out of the
/// range for which the model is defined.
fn same_picture(camera: &Camera<Lens>) -> Option<Camera<Lens>> {
    use Parameter::{Alpha, Xi};
    let (xi, alpha) = (camera.value(Xi)?, camera.value(Alpha)?);
    let (xi, alpha, factor) = match (xi == 0.0, alpha == 0.0) {
        (false, true) => (0.0, xi / (1.0 + xi), 1.0 / (1.0 + xi)),
        (true, false) => (alpha / (1.0 - alpha), 0.0, 1.0 / (1.0 - alpha)),
        _ => return None,
    };
    let mut other = camera.with_value(Xi, xi)?.with_value(Alpha, alpha)?;
    (other.fx, other.fy, other.skew) = (factor * camera.fx, factor * camera.fy, factor * camera.skew);
    (!Warning::is_outside_range(&other)).then_some(other)
}

#[cfg(test)]
mod tests {
    use super::super::{fixture, marks, shape};
    use super::*;
    use crate::board::View;
    use crate::calibrate::target_frame::TargetFrames;
    use crate::camera::FreeParameters;
    use crate::camera::Model;
    use crate::geometry::Vec3;
    use crate::geometry::{Pose, Vec2, rotation};

    #[test]
    fn both_cameras_make_the_same_picture() {
        let camera = |f: f64, xi, alpha| {
            Camera::with_lens(f, 1.1 * f, 320.0, 240.0, Lens::ideal(Model::DoubleSphere))
                .with_value(Parameter::Xi, xi)
                .and_then(|camera| camera.with_value(Parameter::Alpha, alpha))
                .unwrap()
        };
        for first in [camera(400.0, 0.6, 0.0), camera(300.0, 0.0, 0.3)] {
            let second = same_picture(&first).unwrap();
            assert!((second.fx / first.fx - 1.0).abs() > 0.3);
            for point in [Vec3::new(0.3, -0.2, 1.0), Vec3::new(-2.0, 1.0, 0.5), Vec3::new(0.0, 0.0, 3.0)] {
                let pixels = [first, second].map(|camera| camera.pixel(&point).unwrap());
                assert!((pixels[1] - pixels[0]).norm() < 1e-10, "{pixels:?}");
            }
            let back = same_picture(&second).unwrap();
            assert!((back.fx / first.fx - 1.0).abs() < 1e-14);
        }
        // alpha above 1/2 would need an xi above 1, and an xi below 0 a negative alpha.
        assert!(same_picture(&camera(300.0, 0.0, 0.6)).is_none());
        assert!(same_picture(&camera(300.0, -0.2, 0.0)).is_none());
        assert!(same_picture(&camera(300.0, -0.2, 0.5)).is_none());
    }

    #[test]
    fn the_second_camera_costs_what_the_first_does_at_a_coefficient_of_none() {
        use Parameter::{Alpha, Cx, Cy, Fx, Fy, Xi};
        let lens = Lens::ideal(Model::DoubleSphere).with(Xi, 0.4).unwrap();
        let camera = Camera::with_lens(230.0, 230.0, 326.0, 243.0, lens.with(Alpha, 0.0).unwrap());
        let pose = |k: i32| Pose {
            rotation: rotation::from_xyz_rad(
                0.7 * libm::sin(f64::from(2 * k)),
                0.7 * libm::cos(f64::from(3 * k)),
                0.8 * f64::from(k),
            ),
            translation: Vec3::new(6.0 * (f64::from(k % 3) - 1.0), 6.0 * (f64::from(k % 4) - 1.5), 38.0),
        };
        let points: Vec<Vec2> =
            (0..35).map(|i| Vec2::new(f64::from(i % 7) - 3.0, f64::from(i / 7) - 2.0) * 12.0).collect();
        let mut count = 0.0;
        let mut noise = || {
            count += 1.0;
            0.1 * std::f64::consts::SQRT_2 * libm::sin(0.7 * count * count)
        };
        let mut seen = |pose: &Pose| {
            let mut pixel = |p: &Vec2| {
                camera.pixel(&pose.apply(&Vec3::new(p.x, p.y, 0.0))).unwrap() + Vec2::new(noise(), noise())
            };
            View::new(points.clone(), points.iter().map(&mut pixel).collect()).unwrap()
        };
        let poses: Vec<Pose> = (0..10).map(pose).collect();
        let views: Vec<View> = poses.iter().map(&mut seen).collect();
        let frames = TargetFrames::of(&views);
        let listed = marks::of_views(&views, &frames, &shape::region(&views));
        let problem = fixture::problem(&listed, FreeParameters::of(&[Fx, Fy, Cx, Cy, Xi, Alpha]));
        let poses = poses.iter().enumerate();
        let cam_from_target = poses.map(|(view, pose)| frames.at(view).of_pose(pose)).collect();
        let minimum = descend(&problem, State { camera, cam_from_target, shape: [0.0; 3] });
        let unit = minimum.system.reduction().unwrap().intrinsics_covariance().unwrap();
        let noise = Noise::of_squares(0.01);
        let (rival, second) = counterpart(&problem, &minimum, &unit, noise).unwrap();
        // Of the same picture with f / (1 + xi), as alpha is 0.
        assert!(
            (second.fx / (230.0 / 1.4) - 1.0).abs() < 0.05 && second.value(Xi) == Some(0.0),
            "{second:?}"
        );
        let held = problem.holding(Alpha);
        let there = descend(&held, held.with_value(minimum.state.clone(), Alpha, 0.0));
        let expected = (there.system.cost - minimum.system.cost) / 0.01;
        assert!((rival.excess - expected).abs() < 1e-6 && rival.value == second.fx, "{rival:?} {expected}");
    }
}
