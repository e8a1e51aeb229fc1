//! Where does a camera sit on a robot, or beside it? Hand-eye calibration, `A X = X B`.
//!
//! Both set-ups are one equation. In station `i` the robot says `G_i`, the calibration `C_i =
//! cam_from_target`, and
//!
//! ```text
//! G_i X C_i = Y        for all i
//! ```
//!
//! | set-up | `G` | `X` | `Y` |
//! |---|---|---|---|
//! | camera on the gripper, target fixed | base_from_gripper | gripper_from_cam | base_from_target |
//! | camera fixed, target on the gripper | gripper_from_base | base_from_cam | gripper_from_target |
//!
//! Two stations give `A X = X B` with `A = G_j^-1 G_i`, `B = C_j C_i^-1`. With `A = G`, `Z = Y` and `B =
//! C^-1` the equation is that of robot, world, hand and eye, `A X = Z B`: both poses are found.

mod closed_form;
mod motions;
mod refine;
mod robot_world;

use crate::calibrate::Covariance;
use crate::evaluate::distribution::ChiSquare;
use crate::geometry::{Pose, Vec3, rotation};
use nalgebra::{DMatrix, SMatrix};

/// Which of the two moves with the robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum SetUp {
    /// The camera is on the gripper, the target fixed.
    EyeInHand,
    /// The camera is fixed, the target on the gripper.
    EyeToHand,
}

/// What the robot's poses are known to: standard deviations of what it repeats.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Repeatability {
    /// Of each coordinate of the position, in the unit of the robot's poses.
    pub position: f64,
    /// Of the rotation about each axis, rad.
    pub rotation_rad: f64,
}

/// Where the robot was and what the calibration found there, station by station.
#[derive(Debug, Clone, Copy)]
pub struct Stations<'a> {
    /// Which moves.
    pub set_up: SetUp,
    /// The robot's poses, as its controller states them.
    pub base_from_gripper: &'a [Pose],
    /// The calibration's poses, in the same order and unit.
    pub cam_from_target: &'a [Pose],
    /// Joint covariance of camera and poses, one pose a station: errors that all stations share through the
    /// camera are taken into account.
    pub covariance: &'a Covariance,
    /// How well the robot's poses are known.
    pub robot: Repeatability,
}

/// Why there is no hand-eye calibration.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HandEyeError {
    /// Fewer than three stations: two motions about different axes are the least.
    #[error("a hand-eye calibration needs at least {need} stations, got {got}")]
    TooFewStations {
        /// Least number.
        need: usize,
        /// Number given.
        got: usize,
    },
    /// Lists of different length.
    #[error(
        "{robot} poses of the robot, {camera} of the camera and {covariances} covariances: each station needs all three"
    )]
    Lengths {
        /// Poses of the robot.
        robot: usize,
        /// Poses of the camera.
        camera: usize,
        /// Covariances of these.
        covariances: usize,
    },
    /// A number is NaN or infinite.
    #[error("station {station}: a pose is not finite")]
    NotFinite {
        /// Index of the station.
        station: usize,
    },
    /// The repeatability is no standard deviation.
    #[error("the robot's repeatability must be positive and finite, got {position} and {rotation_rad} rad")]
    Repeatability {
        /// Of the position.
        position: f64,
        /// Of the rotation, rad.
        rotation_rad: f64,
    },
    /// Nowhere does the robot turn by enough.
    #[error(
        "the robot turns by {largest_deg:.3} degrees at most, which would leave the rotation of the camera uncertain by {uncertain_deg:.1} degrees: turn it \
         further, by 20 degrees and more"
    )]
    SmallAngles {
        /// Largest rotation between two stations, degrees.
        largest_deg: f64,
        /// Predicted standard deviation of X's rotation, degrees.
        uncertain_deg: f64,
    },
    /// All motions turn about one axis.
    #[error(
        "all rotations have nearly one axis (the largest about any other is {across_deg:.3} degrees), which would leave the rotation about it uncertain \
         by {uncertain_deg:.1} degrees and the position along it unknown: turn the robot about a second axis too"
    )]
    ParallelAxes {
        /// Largest rotation between two stations across the common axis, degrees.
        across_deg: f64,
        /// Predicted standard deviation of X's rotation about the axis, degrees.
        uncertain_deg: f64,
    },
    /// The rotations of robot and camera disagree beyond all errors: the wrong set-up, order or convention.
    #[error(
        "the robot turns by {robot_deg:.3} degrees between stations {first} and {second} where the camera sees {camera_deg:.3}: do the stations belong \
         together, and are the robot's angles in the convention that was named?"
    )]
    AnglesDiffer {
        /// One station.
        first: usize,
        /// The other.
        second: usize,
        /// Angle of the robot's motion, degrees.
        robot_deg: f64,
        /// Angle of the camera's, degrees.
        camera_deg: f64,
    },
    /// A half turn between hand and camera, at which Tsai's parameters have no value.
    #[error("the rotation is a half turn, at which the method of Tsai and Lenz has no solution")]
    HalfTurn,
    /// The normal equations cannot be solved.
    #[error("the stations do not fix the pose: a covariance or the normal equations are singular")]
    Singular,
    /// The refinement did not settle.
    #[error("the refinement did not settle in {iterations} steps")]
    NotConverged {
        /// Steps made.
        iterations: usize,
    },
}

/// A hand-eye calibration.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct HandEye {
    /// `X`: gripper_from_cam, or base_from_cam for a fixed camera.
    pub x: Pose,
    /// `Y`: base_from_target, or gripper_from_target for a fixed camera.
    pub y: Pose,
    /// Covariance of X and Y, six each: rotation (left perturbation, rad), then translation.
    pub covariance: SMatrix<f64, 12, 12>,
    /// X by Tsai & Lenz 1989; `None` for a half turn, where their parameters have no value.
    pub tsai_lenz: Option<Pose>,
    /// X by Park & Martin 1994.
    pub park_martin: Pose,
    /// X and Y by Shah 2013.
    pub shah: [Pose; 2],
    /// Predicted less measured `cam_from_target`, station by station: rotation in rad, then translation.
    pub residuals: Vec<SMatrix<f64, 6, 1>>,
    /// Sum of the squared residuals over their covariances.
    pub chi_squared: f64,
    /// `6 n - 12`.
    pub degrees_of_freedom: usize,
    /// Steps of the refinement.
    pub iterations: usize,
}

impl HandEye {
    /// Covariance of X: rotation (left perturbation, rad), then translation.
    pub fn x_covariance(&self) -> SMatrix<f64, 6, 6> {
        self.covariance.fixed_view::<6, 6>(0, 0).into_owned()
    }

    /// Probability of residuals as large or larger if the stated errors of robot and camera are right.
    pub fn p_value(&self) -> f64 {
        ChiSquare::new(self.degrees_of_freedom).survival(self.chi_squared)
    }

    /// By how much the residuals exceed the stated errors: `sqrt(chi-squared / degrees of freedom)` (Birge
    /// 1932).
    pub fn excess(&self) -> f64 {
        (self.chi_squared / self.degrees_of_freedom as f64).sqrt()
    }
}

/// Calibrates a camera against a robot: closed forms of Tsai & Lenz 1989 and Park & Martin 1994 for `A X = X
/// B`, of Shah 2013 for `A X = Z B`, then the most likely X and Y under the errors of both sides.
///
/// The refinement minimises `sum r_i^T S_i^-1 r_i`, `r_i` the step from the measured `C_i` to the predicted
/// `X^-1 G_i^-1 Y`. A measured pose errs by `K_i d + e_i`: `d` is the error of the camera's parameters, the
/// same in all stations, with the covariance `P` of the calibration and `K_i = cross_i^T P^-1`; `e_i` is what
/// is left, with the covariance `P_i - K_i cross_i`. The robot's error is carried to `r_i` by its Jacobian.
/// X, Y and `d` are estimated together by Gauss-Newton steps; the covariance is the inverse of the normal
/// matrix.
///
/// # Errors
/// See [`HandEyeError`].
///
/// ```
/// use calibench::calibrate::{Settings, calibrate};
/// use calibench::downstream::{Repeatability, SetUp, Stations, hand_eye};
/// use calibench::geometry::{Pose, Vec3, rotation};
/// use calibench::synth::{Scene, Stream, StreamKey};
///
/// // Four stations: what the camera saw, and where the robot said that it was.
/// let scene = Scene::example();
/// let mut stream = Stream::open(StreamKey { seed: 1, scenario: "hand-eye", trial: 0, purpose: "noise" });
/// let calibration = calibrate(&scene.observe(0.1, &mut stream), &Settings::standard())?;
/// let pose = |turn: Vec3, translation: Vec3| Pose { rotation: rotation::exp(&turn), translation };
/// let gripper_from_cam = pose(Vec3::new(0.1, -0.2, 1.5), Vec3::new(20.0, -30.0, 60.0));
/// let base_from_target = pose(Vec3::new(0.0, 0.0, 0.4), Vec3::new(500.0, 100.0, 0.0));
/// // base_from_target = base_from_gripper gripper_from_cam cam_from_target in every station.
/// let of_station = |cam_from_target: &Pose| {
///     base_from_target.compose(&gripper_from_cam.compose(cam_from_target).inverse())
/// };
/// let base_from_gripper: Vec<Pose> = scene.truth.cam_from_target.iter().map(of_station).collect();
///
/// let found = hand_eye(&Stations {
///     set_up: SetUp::EyeInHand,
///     base_from_gripper: &base_from_gripper,
///     cam_from_target: &calibration.cam_from_target,
///     covariance: &calibration.covariance,
///     robot: Repeatability { position: 0.02, rotation_rad: 1e-4 },
/// })?;
/// let error = found.x.translation - gripper_from_cam.translation;
/// // Within four standard deviations on each axis.
/// let deviation = |axis: usize| found.x_covariance()[(3 + axis, 3 + axis)].sqrt();
/// assert!((0..3).all(|axis| error[axis].abs() < 4.0 * deviation(axis)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn hand_eye(stations: &Stations<'_>) -> Result<HandEye, HandEyeError> {
    checked(stations)?;
    let motions = motions::motions(stations);
    motions::refuse_undetermined(stations, &motions)?;
    let park_martin = closed_form::park_martin(&motions)?;
    let tsai_lenz = match closed_form::tsai_lenz(&motions) {
        Ok(pose) => Some(pose),
        Err(HandEyeError::HalfTurn) => None,
        Err(error) => return Err(error),
    };
    let shah = robot_world::shah(stations)?;
    refine::refine(stations, ClosedForms { tsai_lenz, park_martin, shah })
}

/// What the refinement starts from, and what it is held against.
struct ClosedForms {
    tsai_lenz: Option<Pose>,
    park_martin: Pose,
    shah: [Pose; 2],
}

const LEAST_STATIONS: usize = 3;

fn checked(stations: &Stations<'_>) -> Result<(), HandEyeError> {
    let (robot, camera) = (stations.base_from_gripper.len(), stations.cam_from_target.len());
    let covariances = stations.covariance.poses.len().min(stations.covariance.cross.len());
    if robot != camera || camera != covariances {
        return Err(HandEyeError::Lengths { robot, camera, covariances });
    }
    if robot < LEAST_STATIONS {
        return Err(HandEyeError::TooFewStations { need: LEAST_STATIONS, got: robot });
    }
    let poses = stations.base_from_gripper.iter().zip(stations.cam_from_target);
    if let Some(station) = poses.into_iter().position(|(g, c)| !(g.is_finite() && c.is_finite())) {
        return Err(HandEyeError::NotFinite { station });
    }
    let Repeatability { position, rotation_rad } = stations.robot;
    let is_deviation = |x: f64| x.is_finite() && x > 0.0;
    if !(is_deviation(position) && is_deviation(rotation_rad)) {
        return Err(HandEyeError::Repeatability { position, rotation_rad });
    }
    Ok(())
}

impl Stations<'_> {
    /// `G_i^-1`.
    fn inverse_of_robot(&self, station: usize) -> Pose {
        let pose = &self.base_from_gripper[station];
        match self.set_up {
            SetUp::EyeInHand => pose.inverse(),
            SetUp::EyeToHand => *pose,
        }
    }

    /// `K_i`, 6 x n: how the measured pose of a station moves with an error of the camera's parameters.
    /// `None` if their covariance is singular.
    fn by_camera(&self) -> Option<Vec<DMatrix<f64>>> {
        let n = self.covariance.free.len();
        if n == 0 {
            return Some(vec![DMatrix::zeros(6, 0); self.covariance.cross.len()]);
        }
        let factor = self.covariance.intrinsics.clone().cholesky()?;
        let of = |cross: &nalgebra::MatrixXx6<f64>| {
            let solved = factor.solve(cross);
            DMatrix::from_fn(6, n, |i, j| solved[(j, i)])
        };
        Some(self.covariance.cross.iter().map(of).collect())
    }
}

/// Angle and axis of a rotation as one vector, rad.
fn rotation_vector(pose: &Pose) -> Vec3 {
    rotation::log(&pose.rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{FreeParameters, Parameter};
    use crate::synth::{Stream, StreamKey};
    use nalgebra::{DVector, Matrix6, MatrixXx6, Vector6};

    const SET_UPS: [SetUp; 2] = [SetUp::EyeInHand, SetUp::EyeToHand];
    const ROBOT: Repeatability = Repeatability { position: 0.05, rotation_rad: 2e-4 };

    fn pose(turn: [f64; 3], shift: [f64; 3]) -> Pose {
        Pose { rotation: rotation::exp(&Vec3::from(turn)), translation: Vec3::from(shift) }
    }

    fn true_x() -> Pose {
        pose([0.4, -1.1, 2.0], [35.0, -60.0, 120.0])
    }

    fn true_y() -> Pose {
        pose([-0.3, 0.2, 1.0], [600.0, 150.0, 20.0])
    }

    /// A covariance that all stations share a part of: errors of two parameters of the camera move each pose.
    fn covariance(stations: usize, size: f64) -> Covariance {
        let intrinsics = DMatrix::from_row_slice(2, 2, &[0.5, 0.1, 0.1, 0.3]) * (size * size);
        let by_camera = |i: usize| {
            DMatrix::from_fn(6, 2, |row, column| {
                let unit = if row < 3 { 5e-4 } else { 0.2 };
                unit * libm::sin(1.0 + (3 * row + 5 * column) as f64 + 0.2 * i as f64)
            })
        };
        let alone = Vector6::new(2e-4, 3e-4, 1e-4, 0.02, 0.03, 0.08) * size;
        let (mut poses, mut cross) = (Vec::new(), Vec::new());
        for i in 0..stations {
            let k = by_camera(i);
            let shared = &k * &intrinsics * k.transpose();
            let own = Matrix6::from_diagonal(&alone.component_mul(&alone));
            poses.push(own + shared.fixed_view::<6, 6>(0, 0));
            let block = &intrinsics * k.transpose();
            cross.push(MatrixXx6::from_fn(2, |row, column| block[(row, column)]));
        }
        let free = FreeParameters::of(&[Parameter::Fx, Parameter::Cx]);
        Covariance { free, fy_per_fx: None, intrinsics, poses, cross }
    }

    /// Robot poses that turn about the axes of `turns`, and what a camera without errors sees there.
    fn exact(set_up: SetUp, x: &Pose, turns: &[[f64; 3]]) -> (Vec<Pose>, Vec<Pose>) {
        let robot: Vec<Pose> = turns
            .iter()
            .enumerate()
            .map(|(i, turn)| {
                let i = i as f64;
                pose(*turn, [300.0 + 40.0 * libm::sin(i), 70.0 * libm::cos(2.0 * i), 400.0 - 15.0 * i])
            })
            .collect();
        let camera = robot.iter().map(|w| seen(set_up, w, x, &true_y())).collect();
        (robot, camera)
    }

    /// `X^-1 G^-1 Y`.
    fn seen(set_up: SetUp, robot: &Pose, x: &Pose, y: &Pose) -> Pose {
        let inverse = if set_up == SetUp::EyeInHand { robot.inverse() } else { *robot };
        x.inverse().compose(&inverse.compose(y))
    }

    /// Twelve stations, turned by some 30 degrees about different axes.
    fn wide() -> Vec<[f64; 3]> {
        (0..12)
            .map(f64::from)
            .map(|i| [0.5 * libm::sin(i), 0.5 * libm::cos(1.7 * i), 0.3 * libm::sin(2.3 * i)])
            .collect()
    }

    fn solved(
        set_up: SetUp,
        robot: &[Pose],
        camera: &[Pose],
        covariance: &Covariance,
    ) -> Result<HandEye, HandEyeError> {
        hand_eye(&Stations {
            set_up,
            base_from_gripper: robot,
            cam_from_target: camera,
            covariance,
            robot: ROBOT,
        })
    }

    fn distance(a: &Pose, b: &Pose) -> f64 {
        (a.rotation - b.rotation).norm() + (a.translation - b.translation).norm() / 1000.0
    }

    #[test]
    fn poses_without_errors_give_x_by_every_method() {
        for set_up in SET_UPS {
            let (robot, camera) = exact(set_up, &true_x(), &wide());
            let found = solved(set_up, &robot, &camera, &covariance(12, 1.0)).unwrap();
            // Some thirty roundings of coordinates of 1000 and of rotations, over turns of half a radian.
            for x in [found.x, found.park_martin, found.tsai_lenz.unwrap(), found.shah[0]] {
                assert!(distance(&x, &true_x()) < 1e-12, "{set_up:?}: {x:?}");
            }
            for y in [found.y, found.shah[1]] {
                assert!(distance(&y, &true_y()) < 1e-12, "{set_up:?}: {y:?}");
            }
            assert!(found.chi_squared < 1e-12);
        }
    }

    #[test]
    fn a_half_turn_has_no_tsai_lenz_and_is_found_all_the_same() {
        let x = Pose {
            rotation: rotation::exp(&(Vec3::new(1.0, 2.0, -0.5).normalize() * std::f64::consts::PI)),
            ..true_x()
        };
        let (robot, camera) = exact(SetUp::EyeInHand, &x, &wide());
        let found = solved(SetUp::EyeInHand, &robot, &camera, &covariance(12, 1.0)).unwrap();
        assert_eq!(found.tsai_lenz, None);
        assert!(distance(&found.x, &x) < 1e-12 && distance(&found.shah[0], &x) < 1e-12);
    }

    #[test]
    fn the_stated_covariance_is_that_of_the_draws() {
        const DRAWS: u64 = 600;
        let known = covariance(12, 1.0);
        let root = known.intrinsics.clone().cholesky().unwrap().unpack();
        for set_up in SET_UPS {
            let (robot, camera) = exact(set_up, &true_x(), &wide());
            let (mut nees, mut squares, mut without) = (0.0, 0.0, 0.0);
            for trial in 0..DRAWS {
                let mut stream =
                    Stream::open(StreamKey { seed: 41, scenario: "hand-eye", trial, purpose: "errors" });
                let shared = &root * DVector::from_fn(2, |_, _| stream.normal());
                let mut drawn = |deviations: Vector6<f64>| deviations.map(|d| d * stream.normal());
                let turn = ROBOT.rotation_rad;
                let of_robot = Vector6::new(turn, turn, turn, 0.05, 0.05, 0.05);
                let said: Vec<Pose> = robot.iter().map(|w| w.perturbed(&drawn(of_robot))).collect();
                let stations = Stations {
                    set_up,
                    base_from_gripper: &said,
                    cam_from_target: &camera,
                    covariance: &known,
                    robot: ROBOT,
                };
                let by_camera = stations.by_camera().unwrap();
                let alone = Vector6::new(2e-4, 3e-4, 1e-4, 0.02, 0.03, 0.08);
                let seen: Vec<Pose> = camera
                    .iter()
                    .zip(&by_camera)
                    .map(|(c, k)| c.perturbed(&(drawn(alone) + (k * &shared).fixed_rows::<6>(0))))
                    .collect();
                let found = hand_eye(&Stations { cam_from_target: &seen, ..stations }).unwrap();
                let error = found.x.step_to(&true_x());
                let of = |found: &HandEye| error.dot(&(found.x_covariance().try_inverse().unwrap() * error));
                nees += of(&found) / DRAWS as f64;
                squares += found.chi_squared / DRAWS as f64;
                // The same stations as if every pose erred by itself.
                let apart = Covariance { cross: vec![MatrixXx6::zeros(2); 12], ..known.clone() };
                let alone = solved(set_up, &said, &seen, &apart).unwrap();
                let error = alone.x.step_to(&true_x());
                without += error.dot(&(alone.x_covariance().try_inverse().unwrap() * error)) / DRAWS as f64;
            }
            // Chi-squared of 6 and of 60; 3.9 standard deviations of the mean are left by one in ten
            // thousand.
            let near = |mean: f64, d: f64| (mean - d).abs() < 3.9 * (2.0 * d / DRAWS as f64).sqrt();
            assert!(near(nees, 6.0), "{set_up:?}: {nees} of 6");
            assert!(near(squares, 60.0), "{set_up:?}: {squares} of 60");
            // What the shared error is worth: left out, the covariance is wrong.
            assert!(!near(without, 6.0), "{set_up:?}: {without}");
        }
    }

    #[test]
    fn motions_that_leave_the_rotation_open_are_refused_by_name() {
        let fail = |turns: &[[f64; 3]]| {
            let (robot, camera) = exact(SetUp::EyeInHand, &true_x(), turns);
            solved(SetUp::EyeInHand, &robot, &camera, &covariance(turns.len(), 1.0))
                .map(|found| found.x)
                .unwrap_err()
        };
        let along = |size: f64| (0..8).map(|i| [0.0, 0.0, size * f64::from(i)]).collect::<Vec<_>>();
        assert!(
            matches!(fail(&along(0.2)), HandEyeError::ParallelAxes { across_deg, .. } if across_deg < 0.01)
        );
        assert!(
            matches!(fail(&along(5e-4)), HandEyeError::SmallAngles { largest_deg, .. } if largest_deg < 0.3)
        );
        assert!(matches!(fail(&wide()[..2]), HandEyeError::TooFewStations { need: 3, got: 2 }));
        let still = vec![[0.1, 0.2, 0.3]; 6];
        assert!(matches!(fail(&still), HandEyeError::SmallAngles { .. }));
    }

    #[test]
    fn stations_that_do_not_belong_together_are_refused() {
        let (robot, mut camera) = exact(SetUp::EyeInHand, &true_x(), &wide());
        let known = covariance(12, 1.0);
        camera.swap(2, 7);
        let swapped = solved(SetUp::EyeInHand, &robot, &camera, &known);
        assert!(matches!(swapped, Err(HandEyeError::AnglesDiffer { .. })), "{swapped:?}");
        let short = solved(SetUp::EyeInHand, &robot[..11], &camera, &known);
        assert_eq!(short, Err(HandEyeError::Lengths { robot: 11, camera: 12, covariances: 12 }));
        camera[3].translation.x = f64::NAN;
        let broken = solved(SetUp::EyeInHand, &robot, &camera, &known);
        assert_eq!(broken, Err(HandEyeError::NotFinite { station: 3 }));
        let none = Repeatability { position: 0.0, rotation_rad: 1e-4 };
        let exact = Stations {
            set_up: SetUp::EyeInHand,
            base_from_gripper: &robot,
            cam_from_target: &robot,
            covariance: &known,
            robot: none,
        };
        assert!(matches!(hand_eye(&exact), Err(HandEyeError::Repeatability { .. })));
    }
}
