//! Which X and Y are the most likely ones? Gauss-Newton over X, Y and the error of the camera's parameters
//! that all stations share.

use super::{ClosedForms, HandEye, HandEyeError, SetUp, Stations};
use crate::geometry::{Mat3, Pose, Vec3, rotation};
use nalgebra::{DMatrix, DVector, Matrix6, SMatrix, Vector6};

/// Steps; each squares the error, and the start is a fraction of a degree away.
const MOST_STEPS: usize = 50;
/// A step of this part of a standard deviation changes nothing that is shown.
const SMALL_STEP: f64 = 1e-8;
/// Numbers of X and Y.
const POSES: usize = 12;

/// A station's residual and its derivatives.
struct Residual {
    value: Vector6<f64>,
    by_poses: SMatrix<f64, 6, POSES>,
    /// Inverse of its covariance, the shared error of the camera left out.
    information: Matrix6<f64>,
}

pub(super) fn refine(stations: &Stations<'_>, begun: ClosedForms) -> Result<HandEye, HandEyeError> {
    let by_camera = stations.by_camera().ok_or(HandEyeError::Singular)?;
    let ClosedForms { tsai_lenz, park_martin, shah } = begun;
    let (mut x, mut y) = (park_martin, target(stations, &park_martin)?);
    let n = stations.covariance.free.len();
    let mut shared = DVector::zeros(n);
    for iterations in 1..=MOST_STEPS {
        let residuals = residuals(stations, &by_camera, &x, &y)?;
        let (normal, right) = normal_equations(stations, &by_camera, &residuals, &shared)?;
        let factor = normal.cholesky().ok_or(HandEyeError::Singular)?;
        let step = factor.solve(&right);
        x = x.perturbed(&part(&step, 0));
        y = y.perturbed(&part(&step, 6));
        shared += step.rows(POSES, n);
        if step.dot(&right).max(0.0).sqrt() <= SMALL_STEP {
            let at = self::residuals(stations, &by_camera, &x, &y)?;
            let inverse = factor.inverse();
            return Ok(HandEye {
                x,
                y,
                covariance: inverse.fixed_view::<POSES, POSES>(0, 0).into_owned(),
                tsai_lenz,
                park_martin,
                shah,
                chi_squared: cost(stations, &by_camera, &at, &shared)?,
                residuals: at.iter().map(|r| r.value).collect(),
                degrees_of_freedom: 6 * stations.base_from_gripper.len() - POSES,
                iterations,
            });
        }
    }
    Err(HandEyeError::NotConverged { iterations: MOST_STEPS })
}

fn part(step: &DVector<f64>, from: usize) -> Vector6<f64> {
    step.fixed_rows::<6>(from).into_owned()
}

/// `Y`, the mean of `G_i X C_i`.
fn target(stations: &Stations<'_>, x: &Pose) -> Result<Pose, HandEyeError> {
    let count = stations.base_from_gripper.len();
    let each: Vec<Pose> = (0..count)
        .map(|i| stations.inverse_of_robot(i).inverse().compose(x).compose(&stations.cam_from_target[i]))
        .collect();
    let rotation =
        rotation::nearest(&each.iter().map(|pose| pose.rotation).sum()).ok_or(HandEyeError::Singular)?;
    Ok(Pose { rotation, translation: each.iter().map(|pose| pose.translation).sum::<Vec3>() / count as f64 })
}

/// The residuals at X and Y.
fn residuals(
    stations: &Stations<'_>,
    by_camera: &[DMatrix<f64>],
    x: &Pose,
    y: &Pose,
) -> Result<Vec<Residual>, HandEyeError> {
    (0..by_camera.len()).map(|station| residual(stations, &by_camera[station], station, x, y)).collect()
}

/// The step from the measured pose `C` to the predicted one, `P = X^-1 G^-1 Y`.
///
/// With the perturbation of [`Pose::perturbed`], a turn `d` and a shift `s` of Y move P by `(Q d, Q s)`, `Q`
/// the rotation of `X^-1 G^-1`; of X by `-(R_X^T d)` and `R_X^T (skew(q) d - s)`, `q = (G^-1 Y).t - t_X`. The
/// robot's error does the same one place further inside.
fn residual(
    stations: &Stations<'_>,
    by_camera: &DMatrix<f64>,
    station: usize,
    x: &Pose,
    y: &Pose,
) -> Result<Residual, HandEyeError> {
    let robot = &stations.base_from_gripper[station];
    let seen_from_x = stations.inverse_of_robot(station).compose(y);
    let predicted = x.inverse().compose(&seen_from_x);
    let value = stations.cam_from_target[station].step_to(&predicted);
    let back = x.rotation.transpose();
    let outward = back * stations.inverse_of_robot(station).rotation;
    let lever = seen_from_x.translation - x.translation;
    // d log(exp(d) R) at the rotation's residual: J^-1 of SO(3) to first order.
    let turned = Vec3::new(value[0], value[1], value[2]);
    let curve = Mat3::identity() - rotation::skew(&turned) * 0.5;
    let by_x = blocks(&(curve * -back), &(back * rotation::skew(&lever)), &-back);
    let by_y = blocks(&(curve * outward), &Mat3::zeros(), &outward);
    let by_robot = match stations.set_up {
        SetUp::EyeInHand => {
            let arm = y.translation - robot.translation;
            blocks(&(curve * -outward), &(outward * rotation::skew(&arm)), &-outward)
        }
        SetUp::EyeToHand => {
            let arm = robot.rotation * y.translation;
            blocks(&(curve * back), &(back * -rotation::skew(&arm)), &back)
        }
    };
    let mut by_poses = SMatrix::<f64, 6, POSES>::zeros();
    by_poses.fixed_columns_mut::<6>(0).copy_from(&by_x);
    by_poses.fixed_columns_mut::<6>(6).copy_from(&by_y);
    let cross = &stations.covariance.cross[station];
    let shared = by_camera * cross;
    let alone = stations.covariance.poses[station] - shared.fixed_rows::<6>(0);
    let spread = alone + by_robot * robot_covariance(stations) * by_robot.transpose();
    let information = spread.try_inverse().ok_or(HandEyeError::Singular)?;
    Ok(Residual { value, by_poses, information })
}

/// `[[turn by turn, 0], [shift by turn, shift by shift]]`.
fn blocks(turn_by_turn: &Mat3, shift_by_turn: &Mat3, shift_by_shift: &Mat3) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(turn_by_turn);
    matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(shift_by_turn);
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(shift_by_shift);
    matrix
}

fn robot_covariance(stations: &Stations<'_>) -> Matrix6<f64> {
    let (turn, shift) = (stations.robot.rotation_rad, stations.robot.position);
    let deviations = Vector6::new(turn, turn, turn, shift, shift, shift);
    Matrix6::from_diagonal(&deviations.component_mul(&deviations))
}

/// Residuals with the shared error of the camera taken out: `r + K d`.
fn whole(residual: &Residual, by_camera: &DMatrix<f64>, shared: &DVector<f64>) -> Vector6<f64> {
    let moved = by_camera * shared;
    residual.value + moved.fixed_rows::<6>(0)
}

/// Normal matrix and right side of X, Y and the shared error, whose prior is the calibration's covariance.
fn normal_equations(
    stations: &Stations<'_>,
    by_camera: &[DMatrix<f64>],
    residuals: &[Residual],
    shared: &DVector<f64>,
) -> Result<(DMatrix<f64>, DVector<f64>), HandEyeError> {
    let n = shared.len();
    let mut normal = DMatrix::zeros(POSES + n, POSES + n);
    let mut right = DVector::zeros(POSES + n);
    let prior = prior(stations)?;
    normal.view_mut((POSES, POSES), (n, n)).copy_from(&prior);
    right.rows_mut(POSES, n).copy_from(&-(prior * shared));
    for (residual, k) in residuals.iter().zip(by_camera) {
        let entry =
            |i: usize, j: usize| if j < POSES { residual.by_poses[(i, j)] } else { k[(i, j - POSES)] };
        let jacobian = DMatrix::from_fn(6, POSES + n, entry);
        let weighted = jacobian.transpose() * residual.information;
        normal += &weighted * &jacobian;
        right -= weighted * whole(residual, k, shared);
    }
    Ok((normal, right))
}

/// Inverse of the covariance of the camera's parameters.
fn prior(stations: &Stations<'_>) -> Result<DMatrix<f64>, HandEyeError> {
    let covariance = &stations.covariance.intrinsics;
    if covariance.is_empty() {
        return Ok(covariance.clone());
    }
    Ok(covariance.clone().cholesky().ok_or(HandEyeError::Singular)?.inverse())
}

/// The cost: residuals and shared error over their covariances.
fn cost(
    stations: &Stations<'_>,
    by_camera: &[DMatrix<f64>],
    residuals: &[Residual],
    shared: &DVector<f64>,
) -> Result<f64, HandEyeError> {
    let of_shared = shared.dot(&(prior(stations)? * shared));
    let of_station = |(r, k): (&Residual, &DMatrix<f64>)| {
        let value = whole(r, k, shared);
        value.dot(&(r.information * value))
    };
    Ok(of_shared + residuals.iter().zip(by_camera).map(of_station).sum::<f64>())
}
