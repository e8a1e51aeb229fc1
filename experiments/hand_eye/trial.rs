//! One trial: stations, photographs and robot poses with noise, what each method makes of them, and the
//! bound.

use super::cases::Case;
use calibench::calibrate::{Covariance, Settings, calibrate};
use calibench::camera::FreeParameters;
use calibench::downstream::{HandEye, HandEyeError, Repeatability, Stations, hand_eye};
use calibench::evaluate::cramer_rao;
use calibench::geometry::{Pose, Vec3, rotation};
use calibench::synth::{Scene, Stream, StreamKey, Truth};
use calibench_hand_eye_gate::stations::{DISTANCE_MM, robot_at, seen};
use calibench_harness::ExperimentError;
use calibench_harness::stats::mean;
use nalgebra::{Matrix6, SMatrix, SVector, Vector6};

/// Names and titles, in the order of [`Trial::errors`].
pub(super) const METHODS: [(&str, &str); 4] = [
    ("most-likely", "most likely"),
    ("park-martin", "Park & Martin 1994"),
    ("tsai-lenz", "Tsai & Lenz 1989"),
    ("shah", "Shah 2013"),
];

/// Views beside those of the stations, of which the robot knows nothing: they make the camera known as well
/// in every cell.
const MORE_VIEWS: usize = 8;
const MORE_TILT_DEG: f64 = 30.0;
/// `X`: some 130 mm in front of the gripper's flange, or a camera beside the robot.
pub(super) fn true_x() -> Pose {
    Pose { rotation: rotation::exp(&Vec3::new(0.4, -1.1, 2.0)), translation: Vec3::new(35.0, -60.0, 120.0) }
}

/// `Y`, the `Z` of `A X = Z B`.
pub(super) fn true_y() -> Pose {
    Pose { rotation: rotation::exp(&Vec3::new(-0.3, 0.2, 1.0)), translation: Vec3::new(600.0, 150.0, 20.0) }
}

/// What is true of a trial.
pub(super) struct Drawn {
    /// Camera, target and poses: of the stations first.
    pub truth: Truth,
    /// The robot's poses, base_from_gripper.
    pub robot: Vec<Pose>,
}

/// Stations of the case.
pub(super) fn draw(case: &Case, seed: u64, trial: u64) -> Drawn {
    let mut stream = Stream::open(StreamKey { seed, scenario: &case.id, trial, purpose: "stations" });
    let turns = case.turns.draw(case.stations, &mut stream);
    let stations = turns.iter().map(|turn| seen(turn, &mut stream)).collect::<Vec<_>>();
    let robot = stations.iter().map(|pose| robot_at(case.set_up, &true_x(), &true_y(), pose)).collect();
    let more = (0..MORE_VIEWS).map(|k| {
        let (sin, cos) = libm::sincos(2.0 * std::f64::consts::PI * k as f64 / MORE_VIEWS as f64);
        Pose {
            rotation: rotation::exp(&(Vec3::new(cos, sin, 0.0) * MORE_TILT_DEG.to_radians())),
            translation: Vec3::new(20.0 * sin, -20.0 * cos, DISTANCE_MM.0),
        }
    });
    let cam_from_target = stations.iter().copied().chain(more).collect();
    Drawn { truth: Truth { cam_from_target, ..Truth::example() }, robot }
}

/// What one trial found.
pub(super) struct Trial {
    /// Step from the true X to each method's.
    pub errors: [Vector6<f64>; 4],
    /// The bound of X.
    pub bound: Matrix6<f64>,
    /// `e^T B^-1 e` of each method.
    over_bound: [f64; 4],
    /// The same of X and Y together, of the most likely ones and of Shah's.
    both_over_bound: [f64; 2],
    /// `e^T P^-1 e` of the most likely X, P as stated.
    nees: f64,
}

impl Trial {
    /// `None` where the stations are refused.
    pub fn new(case: &Case, seed: u64, trial: u64) -> Result<Option<Trial>, ExperimentError> {
        let drawn = draw(case, seed, trial);
        let stream = |purpose| Stream::open(StreamKey { seed, scenario: &case.id, trial, purpose });
        let scene = Scene::new(drawn.truth.clone()).map_err(ExperimentError::at("scene"))?;
        let views = scene.observe(case.noise_px, &mut stream("noise"));
        let settings = Settings::standard().with_image_size(Truth::EXAMPLE_IMAGE);
        let camera = calibrate(&views, &settings).map_err(ExperimentError::at("calibration"))?;
        let said = repeated(&drawn.robot, case.robot, &mut stream("robot"));
        match solve(case, &said, &camera.cam_from_target, &camera.covariance) {
            Ok(found) => Trial::of(&found, &bound(case, &drawn)?).map(Some),
            Err(HandEyeError::SmallAngles { .. } | HandEyeError::ParallelAxes { .. }) => Ok(None),
            Err(error) => Err(ExperimentError::at("hand-eye calibration")(error)),
        }
    }

    fn of(found: &HandEye, bound: &SMatrix<f64, 12, 12>) -> Result<Trial, ExperimentError> {
        let tsai_lenz = found.tsai_lenz.ok_or_else(|| ExperimentError::Input("a half turn".to_string()))?;
        let methods = [found.x, found.park_martin, tsai_lenz, found.shah[0]];
        let errors = methods.map(|x| true_x().step_to(&x));
        let of_x: Matrix6<f64> = bound.fixed_view::<6, 6>(0, 0).into_owned();
        let inverse = inverse(&of_x)?;
        let of_both = inverse_12(bound)?;
        let both = |x: &Pose, y: &Pose| {
            let (x, y) = (true_x().step_to(x), true_y().step_to(y));
            let step = SVector::<f64, 12>::from_fn(|i, _| if i < 6 { x[i] } else { y[i - 6] });
            step.dot(&(of_both * step))
        };
        Ok(Trial {
            errors,
            bound: of_x,
            over_bound: errors.map(|e| e.dot(&(inverse * e))),
            both_over_bound: [both(&found.x, &found.y), both(&found.shah[0], &found.shah[1])],
            nees: errors[0].dot(&(self::inverse(&found.x_covariance())? * errors[0])),
        })
    }
}

fn inverse(matrix: &Matrix6<f64>) -> Result<Matrix6<f64>, ExperimentError> {
    let inverse = matrix.cholesky().map(|factor| factor.inverse());
    inverse.ok_or_else(|| ExperimentError::Input("the bound is singular".to_string()))
}

fn inverse_12(matrix: &SMatrix<f64, 12, 12>) -> Result<SMatrix<f64, 12, 12>, ExperimentError> {
    let inverse = matrix.cholesky().map(|factor| factor.inverse());
    inverse.ok_or_else(|| ExperimentError::Input("the bound of both is singular".to_string()))
}

/// The poses as the robot says them.
fn repeated(robot: &[Pose], repeats: Repeatability, stream: &mut Stream) -> Vec<Pose> {
    let Repeatability { position, rotation_rad } = repeats;
    let mut error = || Vector6::from_fn(|i, _| stream.normal() * if i < 3 { rotation_rad } else { position });
    robot.iter().map(|pose| pose.perturbed(&error())).collect()
}

/// The stations' part of a calibration, against the robot.
fn solve(
    case: &Case,
    robot: &[Pose],
    cam_from_target: &[Pose],
    covariance: &Covariance,
) -> Result<HandEye, HandEyeError> {
    let n = robot.len();
    let covariance = covariance.of_views(0..n);
    hand_eye(&Stations {
        set_up: case.set_up,
        base_from_gripper: robot,
        cam_from_target: &cam_from_target[..n],
        covariance: &covariance,
        robot: case.robot,
    })
}

/// The Cramer-Rao bound of X and Y: the covariance at the truth, where the camera's own is its bound.
pub(super) fn bound(case: &Case, drawn: &Drawn) -> Result<SMatrix<f64, 12, 12>, ExperimentError> {
    let camera = cramer_rao(&drawn.truth, FreeParameters::STANDARD, case.noise_px)
        .map_err(ExperimentError::at("Cramer-Rao bound of the camera"))?;
    let exact = solve(case, &drawn.robot, &drawn.truth.cam_from_target, &camera);
    exact.map(|found| found.covariance).map_err(ExperimentError::at("Cramer-Rao bound of the mounting"))
}

/// The bound of X of one drawn set of stations.
pub(super) fn bound_of_set(case: &Case, seed: u64, set: u64) -> Result<Matrix6<f64>, ExperimentError> {
    Ok(bound(case, &draw(case, seed, set))?.fixed_view::<6, 6>(0, 0).into_owned())
}

/// The trials of a case that were not refused.
pub(super) struct Cell {
    pub case: Case,
    pub trials: Vec<Trial>,
}

impl Cell {
    fn mean(&self, of: impl Fn(&Trial) -> f64) -> f64 {
        mean(&self.trials.iter().map(of).collect::<Vec<_>>())
    }

    /// Root mean square of a method's error of the rotation, degrees.
    pub fn error_deg(&self, method: usize) -> f64 {
        self.mean(|t| t.errors[method].fixed_rows::<3>(0).norm_squared()).sqrt().to_degrees()
    }

    /// Root mean square of a method's error of the translation, mm.
    pub fn error_mm(&self, method: usize) -> f64 {
        self.mean(|t| t.errors[method].fixed_rows::<3>(3).norm_squared()).sqrt()
    }

    /// Least root mean square error of the rotation, degrees.
    pub fn bound_deg(&self) -> f64 {
        self.mean(|t| t.bound.fixed_view::<3, 3>(0, 0).trace()).sqrt().to_degrees()
    }

    /// Least root mean square error of the translation, mm.
    pub fn bound_mm(&self) -> f64 {
        self.mean(|t| t.bound.fixed_view::<3, 3>(3, 3).trace()).sqrt()
    }

    /// `sqrt(mean(e^T B^-1 e) / 6)`: 1 for errors as large as the bound.
    pub fn over_bound(&self, method: usize) -> f64 {
        (self.mean(|t| t.over_bound[method]) / 6.0).sqrt()
    }

    /// The same of the most likely X and Y.
    pub fn both_over_bound(&self) -> f64 {
        (self.mean(|t| t.both_over_bound[0]) / 12.0).sqrt()
    }

    /// The same of Shah's.
    pub fn shah_over_bound(&self) -> f64 {
        (self.mean(|t| t.both_over_bound[1]) / 12.0).sqrt()
    }

    /// Mean of `e^T P^-1 e`, 6 if the stated covariance is true.
    pub fn nees(&self) -> f64 {
        self.mean(|t| t.nees)
    }
}
