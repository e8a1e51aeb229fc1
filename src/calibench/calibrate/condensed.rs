//! Which focal lengths and tilts agree with the homographies? The relaxed model in place of the points.
//!
//! At the relaxed minimum a view says of its homography `h` what all of its points say: `(h - h0)^T C (h -
//! h0)`. A pose and a focal length predict `h`, so that a hypothesis costs a few small products instead of a
//! pass over the points, and tens of focal lengths with both tilts of every plane can be tried.

use super::closed_form::pose_from_homography;
use super::relaxed::{Entries, EntriesBlock, Relaxed, matrix};
use super::tilt::mirrored;
use crate::camera::Camera;
use crate::geometry::{Homography, Mat3, Pose};
use nalgebra::{SMatrix, Vector6};

/// The poses of all views with one camera, and what they cost.
#[derive(Debug, Clone)]
pub(super) struct Hypothesis {
    /// In units of the gauge focal length, about the lens's centre.
    pub camera: Camera,
    pub poses: Vec<Pose>,
    pub cost: f64,
}

/// Steps of a pose: each start is next to its answer or not worth following.
const STEPS: usize = 6;

/// The best pose of every view for a pinhole camera in units of the gauge, the better tilt for each. `None`
/// where a view has no pose in front of the camera.
pub(super) fn hypothesis(relaxed: &Relaxed, camera: &Camera) -> Option<Hypothesis> {
    let mut poses = Vec::with_capacity(relaxed.homographies.len());
    let mut total = 0.0;
    for (h, information) in relaxed.homographies.iter().zip(&relaxed.information) {
        let start = pose_from_homography(camera, &Homography(matrix(h)))?;
        let first = refined(camera, start, h, information);
        let second = refined(camera, mirrored(&first.0), h, information);
        let (pose, cost) = if second.1 < first.1 { second } else { first };
        poses.push(pose);
        total += cost;
    }
    total.is_finite().then_some(Hypothesis { camera: *camera, poses, cost: total })
}

/// `h` of a pose: `K [r1 r2 t] / t_z`.
fn predicted(k: &Mat3, pose: &Pose) -> Entries {
    let m = k * columns(pose) / pose.translation.z;
    Entries::from_fn(|i, _| m[(i / 3, i % 3)])
}

/// `[r1 r2 t]`.
fn columns(pose: &Pose) -> Mat3 {
    Mat3::from_columns(&[pose.rotation.column(0).into(), pose.rotation.column(1).into(), pose.translation])
}

/// Derivative of [`predicted`] by the pose's step.
fn derivative(k: &Mat3, pose: &Pose) -> SMatrix<f64, 8, 6> {
    let h = predicted(k, pose);
    let m = columns(pose);
    let scale = 1.0 / pose.translation.z;
    let mut j = SMatrix::<f64, 8, 6>::zeros();
    for unknown in 0..6 {
        let mut moved = Mat3::zeros();
        if unknown < 3 {
            // d r = e x r, for the two columns of the rotation.
            let (a, b) = ((unknown + 1) % 3, (unknown + 2) % 3);
            for column in 0..2 {
                moved[(a, column)] = -m[(b, column)];
                moved[(b, column)] = m[(a, column)];
            }
        } else {
            moved[(unknown - 3, 2)] = 1.0;
        }
        let moved = k * moved * scale;
        for i in 0..8 {
            let by_depth = if unknown == 5 { h[i] * scale } else { 0.0 };
            j[(i, unknown)] = moved[(i / 3, i % 3)] - by_depth;
        }
    }
    j
}

/// Levenberg-Marquardt on the quadratic form.
fn refined(camera: &Camera, start: Pose, h0: &Entries, information: &EntriesBlock) -> (Pose, f64) {
    let k = camera.k();
    let cost_of = |pose: &Pose| {
        let d = predicted(&k, pose) - h0;
        if pose.translation.z > 0.0 { d.dot(&(information * d)) } else { f64::INFINITY }
    };
    let (mut pose, mut cost) = (start, cost_of(&start));
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        let j = derivative(&k, &pose);
        let weighted = information * j;
        let mut normal = j.transpose() * weighted;
        let gradient: Vector6<f64> = weighted.transpose() * (predicted(&k, &pose) - h0);
        for i in 0..6 {
            normal[(i, i)] *= 1.0 + damping;
        }
        let Some(factor) = normal.cholesky() else { break };
        let trial = pose.perturbed(&factor.solve(&-gradient));
        let trial_cost = cost_of(&trial);
        if trial_cost < cost {
            (pose, cost, damping) = (trial, trial_cost, damping * 0.1);
        } else {
            damping *= 10.0;
        }
    }
    (pose, cost)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Vec3, rotation};

    #[test]
    fn derivatives_agree_with_central_differences() {
        let k = Camera { skew: 0.1, ..Camera::pinhole(1.3, 1.2, 0.2, -0.1) }.k();
        let pose =
            Pose { rotation: rotation::from_xyz_rad(0.3, -0.4, 0.2), translation: Vec3::new(0.3, -0.2, 4.0) };
        let j = derivative(&k, &pose);
        for i in 0..6 {
            let step = Vector6::ith(i, 1e-6);
            let difference =
                (predicted(&k, &pose.perturbed(&step)) - predicted(&k, &pose.perturbed(&-step))) / 2e-6;
            assert!((difference - j.column(i)).norm() < 1e-8, "{i}");
        }
    }

    #[test]
    fn a_pose_is_refined_to_the_one_of_the_homography() {
        let camera = Camera { skew: 0.1, ..Camera::pinhole(1.3, 1.2, 0.2, -0.1) };
        let pose =
            Pose { rotation: rotation::from_xyz_rad(0.3, -0.4, 0.2), translation: Vec3::new(0.3, -0.2, 4.0) };
        let h = predicted(&camera.k(), &pose);
        let start = pose.perturbed(&Vector6::new(0.02, -0.01, 0.03, 0.05, -0.04, 0.1));
        let (found, cost) = refined(&camera, start, &h, &EntriesBlock::identity());
        assert!(cost < 1e-12, "{cost}");
        assert!(
            (found.rotation - pose.rotation).norm() < 1e-5
                && (found.translation - pose.translation).norm() < 1e-4
        );
    }
}
