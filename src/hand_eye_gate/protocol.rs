//! What is asked, and what is answered? One JSON object a line; `adapters/HAND-EYE-PROTOCOL.md` says it in
//! words.

use calibench::calibrate::Covariance;
use calibench::camera::FreeParameters;
use calibench::downstream::{HandEye, HandEyeError, Repeatability, SetUp, Stations, hand_eye};
use calibench::geometry::Pose;
pub use calibench_gate::protocol::{AnswerPose as PoseRows, Status};
use nalgebra::{DMatrix, Matrix6, MatrixXx6};
use serde::{Deserialize, Serialize};

/// A problem: a line on the solver's standard input.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Problem {
    /// The answer repeats it.
    pub id: String,
    /// `eye-in-hand` or `eye-to-hand`.
    pub set_up: Which,
    /// The robot's poses, as its controller states them.
    pub base_from_gripper: Vec<PoseRows>,
    /// The calibration's poses, in the same order and unit.
    pub cam_from_target: Vec<PoseRows>,
    /// Standard deviations of the robot's poses.
    pub robot: RobotNoise,
    /// Covariance of each pose of the camera: turn from the left (rad), then translation.
    pub cam_covariances: Vec<[[f64; 6]; 6]>,
}

/// Which moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Which {
    /// The camera is on the gripper.
    EyeInHand,
    /// The target is on the gripper.
    EyeToHand,
}

impl From<Which> for SetUp {
    fn from(which: Which) -> SetUp {
        match which {
            Which::EyeInHand => SetUp::EyeInHand,
            Which::EyeToHand => SetUp::EyeToHand,
        }
    }
}

/// What a robot repeats.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RobotNoise {
    /// Of the rotation about each axis, from the left, rad.
    pub rotation_rad: f64,
    /// Of each coordinate of the position.
    pub position: f64,
}

/// An answer: a line on the solver's standard output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The problem's.
    pub id: String,
    /// What became of it.
    pub status: Status,
    /// gripper_from_cam, or base_from_cam for a fixed camera; needed with `ok`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub x: Option<PoseRows>,
    /// Covariance of X, if it is stated: turn from the left (rad), then translation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<Vec<Vec<f64>>>,
    /// Why there is no X.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub message: Option<String>,
}

/// A pose by rows.
pub fn rows(pose: &Pose) -> PoseRows {
    let r = &pose.rotation;
    PoseRows {
        rotation: [0, 1, 2].map(|i| [r[(i, 0)], r[(i, 1)], r[(i, 2)]]),
        translation: [pose.translation.x, pose.translation.y, pose.translation.z],
    }
}

/// A covariance by rows.
pub fn rows_of(matrix: &Matrix6<f64>) -> Vec<Vec<f64>> {
    matrix.row_iter().map(|row| row.iter().copied().collect()).collect()
}

impl Problem {
    /// The most likely X with this library.
    ///
    /// # Errors
    /// See [`HandEyeError`].
    pub fn solve(&self) -> Result<HandEye, HandEyeError> {
        let poses = |list: &[PoseRows]| -> Vec<Pose> { list.iter().map(PoseRows::pose).collect() };
        let covariance = |rows: &[[f64; 6]; 6]| Matrix6::from_fn(|i, j| rows[i][j]);
        let cross = self.cam_covariances.iter().map(|_| MatrixXx6::zeros(0)).collect();
        hand_eye(&Stations {
            set_up: self.set_up.into(),
            base_from_gripper: &poses(&self.base_from_gripper),
            cam_from_target: &poses(&self.cam_from_target),
            covariance: &Covariance::untied(
                FreeParameters::of(&[]),
                DMatrix::zeros(0, 0),
                self.cam_covariances.iter().map(covariance).collect(),
                cross,
            ),
            robot: Repeatability { position: self.robot.position, rotation_rad: self.robot.rotation_rad },
        })
    }
}

impl Answer {
    /// X, if it is a pose: finite, its rotation one to rounding.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn pose(&self) -> Result<Pose, String> {
        /// Adapters print what their libraries computed, some in single precision.
        const ORTHOGONAL: f64 = 1e-5;
        let pose = self.x.as_ref().ok_or("`ok` without x")?.pose();
        if !pose.is_finite() {
            return Err("x is not finite".to_string());
        }
        let r = &pose.rotation;
        if (r.transpose() * r - calibench::geometry::Mat3::identity()).norm() > ORTHOGONAL
            || r.determinant() < 0.0
        {
            return Err("the rotation of x is none".to_string());
        }
        Ok(pose)
    }

    /// The stated covariance, symmetric and positive definite.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn covariance(&self) -> Option<Result<Matrix6<f64>, String>> {
        let rows = self.covariance.as_ref()?;
        if rows.len() != 6 || rows.iter().any(|row| row.len() != 6) {
            return Some(Err("the covariance is no matrix of 6 by 6".to_string()));
        }
        let matrix = Matrix6::from_fn(|i, j| rows[i][j]);
        let scale = |i: usize, j: usize| (matrix[(i, i)] * matrix[(j, j)]).sqrt();
        let is_symmetric =
            (0..6).all(|i| (0..i).all(|j| (matrix[(i, j)] - matrix[(j, i)]).abs() <= 1e-9 * scale(i, j)));
        if !is_symmetric || matrix.cholesky().is_none() {
            return Some(Err("the covariance is not symmetric and positive definite".to_string()));
        }
        Some(Ok(matrix))
    }
}
