//! Do the motions between stations determine the rotation of a camera? If they are too small, or all about
//! one axis, it is said before anything is solved.

use super::{HandEyeError, Stations, rotation_vector};
use crate::geometry::{Mat3, Pose, Vec3};

/// A pair of motions between two stations, `A X = X B`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    pub first: usize,
    pub second: usize,
    /// `G_j^-1 G_i`: of the gripper, or of the base for a fixed camera.
    pub a: Pose,
    /// `C_j C_i^-1`: of the camera.
    pub b: Pose,
}

/// The motions between all pairs of stations.
pub(super) fn motions(stations: &Stations<'_>) -> Vec<Motion> {
    let count = stations.base_from_gripper.len();
    let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
    pairs
        .map(|(first, second)| Motion {
            first,
            second,
            a: stations.inverse_of_robot(second).compose(&stations.inverse_of_robot(first).inverse()),
            b: stations.cam_from_target[second].compose(&stations.cam_from_target[first].inverse()),
        })
        .collect()
}

/// Beyond this the linearisation behind the covariance is worth nothing, rad.
const MOST_UNCERTAIN_RAD: f64 = 0.05;
/// Angles of robot and camera may differ by this many standard deviations, and by this angle, which covers
/// robots that are less accurate than they repeat, rad.
const ANGLE_DEVIATIONS: f64 = 10.0;
const ANGLE_TOLERANCE_RAD: f64 = 0.05;

/// Refuses motions that leave the rotation of X open.
///
/// From `log A = R_X log B` a turn `d` of `R_X` about an axis `u` changes `log A` by `d u x log A`: over all
/// pairs, which count each station `n / 2` times, the information about it is `sum (|log A|^2 - (u . log
/// A)^2) / (n sigma^2 / 2)`, least for the direction of the largest eigenvalue of `sum log A log A^T`. The
/// other two eigenvalues must not vanish against the noise `sigma` of a relative rotation.
pub(super) fn refuse_undetermined(stations: &Stations<'_>, motions: &[Motion]) -> Result<(), HandEyeError> {
    let sigma = rotation_noise(stations);
    refuse_unequal_angles(motions, sigma)?;
    let turns: Vec<Vec3> = motions.iter().map(|m| rotation_vector(&m.b)).collect();
    let scatter: Mat3 = turns.iter().map(|w| w * w.transpose()).sum();
    let eigen = scatter.symmetric_eigen();
    let axis: Vec3 = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
    let (all, largest) = (eigen.eigenvalues.sum(), eigen.eigenvalues.max());
    let effective = 0.5 * stations.base_from_gripper.len() as f64;
    let uncertain = |information: f64| sigma * (effective / information.max(0.0)).sqrt();
    let degrees = |rad: f64| rad.to_degrees().min(180.0);
    let most = |length: &dyn Fn(&Vec3) -> f64| turns.iter().map(length).fold(0.0, f64::max).to_degrees();
    // Even if the axes were spread as widely as can be, two thirds of the turning would count.
    if uncertain(all * 2.0 / 3.0) > MOST_UNCERTAIN_RAD {
        let uncertain_deg = degrees(uncertain(all * 2.0 / 3.0));
        return Err(HandEyeError::SmallAngles { largest_deg: most(&|w| w.norm()), uncertain_deg });
    }
    if uncertain(all - largest) > MOST_UNCERTAIN_RAD {
        let across_deg = most(&|w| w.cross(&axis).norm());
        return Err(HandEyeError::ParallelAxes {
            across_deg,
            uncertain_deg: degrees(uncertain(all - largest)),
        });
    }
    Ok(())
}

/// Noise of a relative rotation about an axis, rad: twice the mean variance of the robot's and of the
/// camera's rotations.
fn rotation_noise(stations: &Stations<'_>) -> f64 {
    let poses = &stations.covariance.poses;
    let camera: f64 =
        poses.iter().map(|p| p.fixed_view::<3, 3>(0, 0).trace() / 3.0).sum::<f64>() / poses.len() as f64;
    let robot = stations.robot.rotation_rad;
    (2.0 * (camera.max(0.0) + robot * robot)).sqrt()
}

/// `A` and `B` are conjugate, so their angles are equal.
fn refuse_unequal_angles(motions: &[Motion], sigma: f64) -> Result<(), HandEyeError> {
    let angles = |m: &Motion| (rotation_vector(&m.a).norm(), rotation_vector(&m.b).norm());
    let difference = |m: &Motion| {
        let (a, b) = angles(m);
        (a - b).abs()
    };
    let worst = motions.iter().max_by(|m, n| difference(m).total_cmp(&difference(n)));
    match worst.filter(|m| difference(m) > (ANGLE_DEVIATIONS * sigma).max(ANGLE_TOLERANCE_RAD)) {
        None => Ok(()),
        Some(motion) => {
            let (robot, camera) = angles(motion);
            Err(HandEyeError::AnglesDiffer {
                first: motion.first,
                second: motion.second,
                robot_deg: robot.to_degrees(),
                camera_deg: camera.to_degrees(),
            })
        }
    }
}
