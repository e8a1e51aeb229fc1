//! How does a step become a new state? Straight, or along the curve on which the images stay what they are.
//!
//! Where the data say little about the focal length, camera and poses move together on a long curve: `f` and
//! the distance grow alike, the tilt with them, `k1` with their square. A straight step leaves the curve at
//! once, and the search creeps. The relaxed model tells what the points fix: `f / t_z`, `t_x / t_z`, `r_31 /
//! t_z`, `k1 / f^2`. A step is therefore taken straight in those, which is the same to first order, so that
//! only the path to a minimum changes and never the minimum.

use super::minimise::State;
use super::system::Step;
use super::tie::tied;
use crate::camera::{BrownConrady, Camera, FreeParameters, Parameter};
use crate::geometry::{Mat3, Pose, Vec3};
use nalgebra::SVector;

/// The state a step leads to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Retraction {
    /// `parameter + step`, `exp(delta) R`, `t + step`: the shortest code, and as good where steps are small.
    Straight,
    /// Straight in what the points fix.
    Curved,
}

impl Retraction {
    /// Moves `from` by `step` into `to`; `fy_per_fx` ties the focal lengths.
    pub fn apply(
        self,
        from: &State,
        free: FreeParameters,
        fy_per_fx: Option<f64>,
        step: &Step,
        to: &mut State,
    ) {
        let intrinsics = step.intrinsics.as_slice();
        let poses = to.cam_from_target.iter_mut().zip(&from.cam_from_target).zip(&step.poses);
        match self {
            Retraction::Straight => {
                to.camera = tied(from.camera.stepped(free, intrinsics), fy_per_fx);
                for ((to, from), delta) in poses {
                    *to = from.perturbed(delta);
                }
            }
            Retraction::Curved => {
                to.camera = curved_camera(&from.camera, free, fy_per_fx, intrinsics);
                let straight = tied(from.camera.stepped(free, intrinsics), fy_per_fx);
                let rate = |old: f64, new: f64| ((new - old) / old).clamp(-LARGEST_LOG, LARGEST_LOG);
                let rates = [rate(from.camera.fx, straight.fx), rate(from.camera.fy, straight.fy)];
                for ((to, from), delta) in poses {
                    *to = curved_pose(from, delta, rates);
                }
            }
        }
    }
}

/// A change of logarithm beyond this is no small step any more: a factor of 20.
const LARGEST_LOG: f64 = 3.0;

/// `f exp(df / f)`, and coefficients straight in `k1 / f^2`, `k2 / f^4`, `k3 / f^6`, `p / f`. Held parameters
/// stay.
fn curved_camera(camera: &Camera, free: FreeParameters, fy_per_fx: Option<f64>, step: &[f64]) -> Camera {
    let straight = tied(camera.stepped(free, step), fy_per_fx);
    let grown = |old: f64, new: f64| old * libm::exp(((new - old) / old).clamp(-LARGEST_LOG, LARGEST_LOG));
    let (fx, fy) = (grown(camera.fx, straight.fx), grown(camera.fy, straight.fy));
    let rate = if free.contains(Parameter::Fx) {
        (straight.fx - camera.fx) / camera.fx
    } else if free.contains(Parameter::Fy) {
        (straight.fy - camera.fy) / camera.fy
    } else {
        0.0
    };
    let s = libm::exp(rate.clamp(-LARGEST_LOG, LARGEST_LOG));
    let (old, new) = (&camera.distortion, &straight.distortion);
    let along = |parameter: Parameter, power: i32, old: f64, new: f64| {
        if !free.contains(parameter) {
            return old;
        }
        let scale = (0..power).fold(1.0, |product, _| product * s);
        scale * (new - f64::from(power) * rate * old)
    };
    let distortion = BrownConrady {
        k1: along(Parameter::K1, 2, old.k1, new.k1),
        k2: along(Parameter::K2, 4, old.k2, new.k2),
        p1: along(Parameter::P1, 1, old.p1, new.p1),
        p2: along(Parameter::P2, 1, old.p2, new.p2),
        k3: along(Parameter::K3, 6, old.k3, new.k3),
    };
    tied(Camera { fx, fy, ..straight }.with_distortion(distortion), fy_per_fx)
}

/// `t_z exp(dt_z / t_z)`, and straight in `fx t_x / t_z`, `fy t_y / t_z`, `r_31 / t_z`, `r_32 / t_z`; the
/// focal lengths change by the logarithms `focal`.
fn curved_pose(pose: &Pose, delta: &SVector<f64, 6>, focal: [f64; 2]) -> Pose {
    let straight = pose.perturbed(delta);
    let t = &pose.translation;
    let rate = delta[5] / t.z;
    if t.z <= 0.0 || rate.abs() > LARGEST_LOG {
        return straight;
    }
    let s = libm::exp(rate);
    let z = t.z * s;
    // f x = f t_x / t_z changes by f (dx + x df / f) with dx = (dt_x - t_x dt_z / t_z) / t_z; over the new f,
    // times the new t_z.
    let across =
        |own: f64, step: f64, focal: f64| (own * (1.0 + focal - rate) + step) / t.z * libm::exp(-focal) * z;
    let translation = Vec3::new(across(t.x, delta[3], focal[0]), across(t.y, delta[4], focal[1]), z);
    // The third row of R: the optical axis in the target's frame. d r3 = (delta x R) row 3.
    let r = &pose.rotation;
    let row = |column: usize| {
        let change = delta[0] * r[(1, column)] - delta[1] * r[(0, column)];
        s * (r[(2, column)] * (1.0 - rate) + change)
    };
    Pose { rotation: with_axis(&straight.rotation, row(0), row(1)), translation }
}

/// The rotation turned, the shortest way, so that the optical axis has the components `a`, `b` along the
/// target's axes; unchanged where there is no such direction.
fn with_axis(rotation: &Mat3, a: f64, b: f64) -> Mat3 {
    let in_plane = a * a + b * b;
    if in_plane >= 1.0 {
        return *rotation;
    }
    let wanted = Vec3::new(a, b, (1.0 - in_plane).sqrt() * rotation[(2, 2)].signum());
    let reached: Vec3 = rotation.row(2).transpose();
    rotation * between(&wanted, &reached)
}

/// The state with the focal lengths that are free `s` times as long, and all that follows them: distances,
/// tilts, coefficients. Its images agree to second order in the tilts.
pub(super) fn scaled(state: &State, free: FreeParameters, fy_per_fx: Option<f64>, s: f64) -> State {
    let powers = [
        (Parameter::Fx, 1),
        (Parameter::Fy, 1),
        (Parameter::K1, 2),
        (Parameter::K2, 4),
        (Parameter::P1, 1),
        (Parameter::P2, 1),
        (Parameter::K3, 6),
    ];
    let moved =
        powers.into_iter().filter(|&(p, _)| free.contains(p)).fold(state.camera, |camera, (p, power)| {
            camera.with(p, (0..power).fold(camera.get(p), |value, _| value * s))
        });
    let pose = |pose: &Pose| {
        let (r, t) = (&pose.rotation, &pose.translation);
        Pose {
            rotation: with_axis(r, s * r[(2, 0)], s * r[(2, 1)]),
            translation: Vec3::new(t.x, t.y, s * t.z),
        }
    };
    State {
        camera: tied(moved, fy_per_fx),
        cam_from_target: state.cam_from_target.iter().map(pose).collect(),
    }
}

/// The shortest rotation that takes unit vector `from` to unit vector `to`; none where they are opposite.
fn between(from: &Vec3, to: &Vec3) -> Mat3 {
    let (axis, cosine) = (from.cross(to), from.dot(to));
    if cosine <= -0.999 {
        return Mat3::identity();
    }
    let k = crate::geometry::rotation::skew(&axis);
    Mat3::identity() + k + k * k / (1.0 + cosine)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation;

    #[test]
    fn both_ways_agree_to_first_order_and_keep_a_rotation() {
        let camera = Camera::pinhole(600.0, 610.0, 320.0, 240.0).with_distortion(BrownConrady {
            k1: -0.2,
            k2: 0.1,
            p1: 1e-3,
            p2: -2e-3,
            k3: 0.03,
        });
        let pose = Pose {
            rotation: rotation::from_xyz_rad(0.3, -0.4, 0.2),
            translation: Vec3::new(3.0, -2.0, 12.0),
        };
        let free = FreeParameters::of(&Parameter::ALL);
        let unit = [30.0, 20.0, 5.0, -4.0, 0.5, 0.1, -0.1, 1e-3, 1e-3, 0.05];
        let turn = SVector::<f64, 6>::from([0.2, -0.1, 0.3, 0.5, 0.4, 2.0]);
        let apart = |h: f64| {
            let step = unit.map(|x| h * x);
            let (a, b) = (camera.stepped(free, &step), curved_camera(&camera, free, None, &step));
            let cameras: f64 = a
                .parameters()
                .iter()
                .zip(b.parameters())
                .zip(unit)
                .map(|((a, b), u)| ((a - b) / u).abs())
                .sum();
            let (p, q) = (pose.perturbed(&(turn * h)), curved_pose(&pose, &(turn * h), [0.05 * h, 0.03 * h]));
            assert!((q.rotation.transpose() * q.rotation - Mat3::identity()).norm() < 1e-13);
            cameras + (p.rotation - q.rotation).norm() + (p.translation - q.translation).norm()
        };
        // Second order: a tenth of the step leaves a hundredth of the difference.
        let ratio = apart(1e-2) / apart(1e-3);
        assert!((80.0..125.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn a_scaled_states_images_agree_to_second_order_in_the_tilts() {
        let distortion = BrownConrady { k1: -0.2, k2: 0.1, p1: 1e-3, p2: -2e-3, k3: 0.03 };
        let camera = Camera::pinhole(600.0, 610.0, 320.0, 240.0).with_distortion(distortion);
        let free = FreeParameters::of(&Parameter::ALL);
        let apart = |tilt: f64| {
            let rotation = rotation::from_xyz_rad(tilt, -1.5 * tilt, 0.2);
            let pose = Pose { rotation, translation: Vec3::new(0.3, -0.2, 4.0) };
            let state = State { camera, cam_from_target: vec![pose] };
            let longer = scaled(&state, free, None, 1.3);
            assert_eq!((longer.camera.fx, longer.camera.fy), (780.0, 793.0));
            let image = |state: &State, x: f64, y: f64| {
                state.camera.project(&state.cam_from_target[0].apply(&Vec3::new(x, y, 0.0))).unwrap()
            };
            let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)];
            corners.map(|(x, y)| (image(&state, x, y) - image(&longer, x, y)).norm()).iter().sum::<f64>()
        };
        let ratio = apart(0.05) / apart(0.005);
        assert!((80.0..125.0).contains(&ratio), "{ratio}");
    }

    #[test]
    fn steps_of_both_ways_agree_to_first_order_whichever_focal_length_is_free() {
        use Parameter::{Cx, Fx, Fy, K1, P1};
        let distortion = BrownConrady { k1: -0.2, k2: 0.1, p1: 1e-3, p2: -2e-3, k3: 0.03 };
        let camera = Camera::pinhole(600.0, 610.0, 320.0, 240.0).with_distortion(distortion);
        let pose = Pose {
            rotation: rotation::from_xyz_rad(0.3, -0.4, 0.2),
            translation: Vec3::new(3.0, -2.0, 12.0),
        };
        let state = State { camera, cam_from_target: vec![pose] };
        let turn = SVector::<f64, 6>::from([0.2, -0.1, 0.3, 0.5, 0.4, 2.0]);
        for list in
            [vec![(Fx, 30.0), (Fy, 20.0), (Cx, 5.0), (P1, 1e-3)], vec![(Fy, 20.0), (Cx, 5.0), (K1, 0.1)]]
        {
            let free = list.iter().fold(FreeParameters::NONE, |free, (p, _)| free.with(*p));
            let apart = |h: f64| {
                let intrinsics = SVector::from_fn(|i, _| list.get(i).map_or(0.0, |(_, unit)| h * unit));
                let step = Step::along(intrinsics, vec![h * turn]);
                let [a, b] = [Retraction::Straight, Retraction::Curved].map(|way| {
                    let mut to = state.clone();
                    way.apply(&state, free, None, &step, &mut to);
                    to
                });
                let cameras =
                    |&(p, unit): &(Parameter, f64)| ((a.camera.get(p) - b.camera.get(p)) / unit).abs();
                let (p, q) = (a.cam_from_target[0], b.cam_from_target[0]);
                list.iter().map(cameras).sum::<f64>()
                    + (p.rotation - q.rotation).norm()
                    + (p.translation - q.translation).norm()
            };
            let ratio = apart(1e-2) / apart(1e-3);
            assert!((80.0..125.0).contains(&ratio), "{ratio}");
        }
    }
}
