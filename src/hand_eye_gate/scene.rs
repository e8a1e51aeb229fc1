//! In which scenes is a solver tried? Each is one set of stations of known truth; every sample has errors of
//! its own.

use super::protocol::{Problem, RobotNoise, Which, rows};
use super::stations::{Turns, robot_at, seen};
use calibench::geometry::{Pose, Vec3, rotation};
use calibench::synth::{Stream, StreamKey};
use nalgebra::{Matrix6, Vector6};

/// What is asked of the answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Demand {
    /// Errors as small as the bound, and what is stated true.
    Law,
    /// No X: the motions leave it open.
    Refusal,
}

/// Stations of known truth, and the noise.
#[derive(Debug, Clone)]
pub struct Scene {
    /// Its name.
    pub id: &'static str,
    /// What it is, for people.
    pub about: &'static str,
    /// What is asked of the answers.
    pub demand: Demand,
    set_up: Which,
    x: Pose,
    turns: Turns,
    stations: usize,
    /// Factors of [`ROBOT`] and [`CAMERA`].
    noise: [f64; 2],
}

/// What an industrial robot repeats: 0.02 degrees and 0.05 mm.
const ROBOT: RobotNoise = RobotNoise { rotation_rad: 3.5e-4, position: 0.05 };
/// Standard deviations of a pose of the camera, about and along its axes: a board of 63 points at 230 mm, 0.1
/// px.
const CAMERA: [f64; 6] = [4e-4, 4e-4, 1e-4, 0.02, 0.02, 0.08];

fn mounting(turn: Vec3) -> Pose {
    Pose { rotation: rotation::exp(&turn), translation: Vec3::new(35.0, -60.0, 120.0) }
}

fn true_y() -> Pose {
    Pose { rotation: rotation::exp(&Vec3::new(-0.3, 0.2, 1.0)), translation: Vec3::new(600.0, 150.0, 20.0) }
}

/// All scenes: those that obey the law first.
pub fn scenes() -> Vec<Scene> {
    let base = Scene {
        id: "twelve",
        about: "twelve stations turned by up to 30 degrees about any axis, camera on the gripper",
        demand: Demand::Law,
        set_up: Which::EyeInHand,
        x: mounting(Vec3::new(0.4, -1.1, 2.0)),
        turns: Turns::Drawn { cone_deg: 90.0, largest_deg: 30.0 },
        stations: 12,
        noise: [1.0, 1.0],
    };
    let drawn = |cone_deg, largest_deg| Turns::Drawn { cone_deg, largest_deg };
    let law = |id, about, change: &dyn Fn(&mut Scene)| {
        let mut scene = Scene { id, about, ..base.clone() };
        change(&mut scene);
        scene
    };
    let refusal = |id, about, turns, stations| Scene {
        id,
        about,
        demand: Demand::Refusal,
        turns,
        stations,
        ..base.clone()
    };
    vec![
        base.clone(),
        law("few", "four stations, turned by 30 degrees", &|s| {
            (s.stations, s.turns) = (4, Turns::Largest { largest_deg: 30.0 });
        }),
        law("near-parallel", "axes within 6 degrees of one", &|s| s.turns = drawn(6.0, 30.0)),
        law("small-angles", "turned by up to 4 degrees", &|s| s.turns = drawn(90.0, 4.0)),
        law("to-hand", "camera fixed, target on the gripper", &|s| s.set_up = Which::EyeToHand),
        law("half-turn", "the camera turned by half a turn on the gripper", &|s| {
            s.x = mounting(Vec3::new(1.0, 2.0, -0.5).normalize() * std::f64::consts::PI);
        }),
        law("good-camera", "the robot errs, the camera hardly", &|s| s.noise = [1.0, 0.01]),
        law("good-robot", "the camera errs, the robot hardly", &|s| s.noise = [0.01, 1.0]),
        refusal("one-axis", "all turns about one axis", drawn(0.0, 30.0), 12),
        refusal("no-turns", "the robot only shifts", drawn(90.0, 0.0), 12),
        refusal("two-stations", "a single motion", Turns::Largest { largest_deg: 30.0 }, 2),
    ]
}

impl Scene {
    /// The true X.
    pub fn x(&self) -> Pose {
        self.x
    }

    fn robot(&self) -> RobotNoise {
        RobotNoise {
            rotation_rad: self.noise[0] * ROBOT.rotation_rad,
            position: self.noise[0] * ROBOT.position,
        }
    }

    fn camera(&self) -> Vector6<f64> {
        Vector6::from(CAMERA) * self.noise[1]
    }

    /// Poses without errors. They are the same for every seed: a seed draws errors only.
    pub fn exact(&self) -> Problem {
        let mut stream =
            Stream::open(StreamKey { seed: 1, scenario: self.id, trial: 0, purpose: "hand-eye stations" });
        let camera: Vec<Pose> =
            self.turns.draw(self.stations, &mut stream).iter().map(|turn| seen(turn, &mut stream)).collect();
        let robot: Vec<Pose> =
            camera.iter().map(|c| robot_at(self.set_up.into(), &self.x, &true_y(), c)).collect();
        self.problem(format!("{}-exact", self.id), &robot, &camera)
    }

    /// One sample: errors on both sides.
    pub fn sample(&self, exact: &Problem, seed: u64, trial: u64) -> Problem {
        let mut stream =
            Stream::open(StreamKey { seed, scenario: self.id, trial, purpose: "hand-eye errors" });
        let RobotNoise { rotation_rad, position } = self.robot();
        let of_robot = Vector6::from_fn(|i, _| if i < 3 { rotation_rad } else { position });
        let of_camera = self.camera();
        let mut erring =
            |pose: Pose, sd: &Vector6<f64>| pose.perturbed(&sd.map(|deviation| deviation * stream.normal()));
        let robot: Vec<Pose> =
            exact.base_from_gripper.iter().map(|pose| erring(pose.pose(), &of_robot)).collect();
        let camera: Vec<Pose> =
            exact.cam_from_target.iter().map(|pose| erring(pose.pose(), &of_camera)).collect();
        self.problem(format!("{}-{trial}", self.id), &robot, &camera)
    }

    fn problem(&self, id: String, robot: &[Pose], camera: &[Pose]) -> Problem {
        let deviations = self.camera();
        let covariance = Matrix6::from_diagonal(&deviations.component_mul(&deviations));
        let by_rows = [0, 1, 2, 3, 4, 5].map(|i| [0, 1, 2, 3, 4, 5].map(|j| covariance[(i, j)]));
        Problem {
            id,
            set_up: self.set_up,
            base_from_gripper: robot.iter().map(rows).collect(),
            cam_from_target: camera.iter().map(rows).collect(),
            robot: self.robot(),
            cam_covariances: vec![by_rows; camera.len()],
        }
    }
}
