//! What is varied? The number of stations, their axes and angles, the noise of camera and robot, and designs.

use calibench::downstream::{Repeatability, SetUp};
use calibench_hand_eye_gate::stations::Turns;

/// One cell: stations of one kind, with one noise.
#[derive(Debug, Clone)]
pub(super) struct Case {
    /// Its name, in numbers and random streams.
    pub id: String,
    /// What it is, in words.
    pub what: String,
    /// What its sweep varies.
    pub level: f64,
    pub set_up: SetUp,
    pub stations: usize,
    pub turns: Turns,
    pub noise_px: f64,
    pub robot: Repeatability,
}

/// Cells along one quantity.
pub(super) struct Sweep {
    pub id: &'static str,
    /// What is varied, with its unit.
    pub axis: &'static str,
    pub title: &'static str,
    pub cases: Vec<Case>,
}

const STATIONS: [usize; 5] = [4, 6, 12, 24, 48];
const CONES_DEG: [f64; 4] = [10.0, 20.0, 40.0, 90.0];
const ANGLES_DEG: [f64; 4] = [5.0, 10.0, 20.0, 40.0];
const NOISES_PX: [f64; 3] = [0.02, 0.1, 0.5];
/// Factors of [`ROBOT`].
const ROBOTS: [f64; 3] = [0.2, 1.0, 5.0];
/// Six stations, chosen in four ways.
pub(super) const DESIGNS: [(&str, &str, Turns); 4] = [
    ("at-random", "axes and angles at random", Turns::Drawn { cone_deg: 90.0, largest_deg: 30.0 }),
    ("largest", "axes at random, largest angle", Turns::Largest { largest_deg: 30.0 }),
    ("three-axes", "both ways about three axes", Turns::ThreeAxes { largest_deg: 30.0 }),
    ("tilts", "tilts in six directions", Turns::Tilts { largest_deg: 30.0 }),
];
const DESIGNED: usize = 6;
/// What an industrial robot repeats: 0.05 mm and 0.02 degrees.
const ROBOT: Repeatability =
    Repeatability { position: 0.05, rotation_rad: 0.02 * std::f64::consts::PI / 180.0 };

impl Case {
    /// Twelve stations turned by up to 30 degrees about any axis, 0.1 px, the camera on the gripper.
    pub fn base(id: impl Into<String>) -> Case {
        Case {
            id: id.into(),
            what: "camera on the gripper".to_string(),
            level: 0.0,
            set_up: SetUp::EyeInHand,
            stations: 12,
            turns: Turns::Drawn { cone_deg: 90.0, largest_deg: 30.0 },
            noise_px: 0.1,
            robot: ROBOT,
        }
    }

    /// The same about one axis, which leaves X open.
    pub fn one_axis() -> Case {
        Case { turns: Turns::Drawn { cone_deg: 0.0, largest_deg: 30.0 }, ..Case::base("one-axis") }
    }

    /// Twelve stations turned by up to an angle: the same draws for every angle.
    pub fn of_angle(largest_deg: f64) -> Case {
        Case { turns: Turns::Drawn { cone_deg: 90.0, largest_deg }, ..Case::base("scaled") }
    }

    /// The same with a robot that says nothing of its position: it repeats a metre.
    pub fn of_turns_alone(largest_deg: f64) -> Case {
        let case = Case::of_angle(largest_deg);
        Case { robot: Repeatability { position: 1000.0, ..case.robot }, ..case }
    }

    /// With a fixed camera and the target on the gripper.
    pub fn with_fixed_camera(self) -> Case {
        Case { set_up: SetUp::EyeToHand, what: "target on the gripper".to_string(), ..self }
    }

    fn at(id: String, level: f64, what: String) -> Case {
        Case { level, what, ..Case::base(id) }
    }
}

/// All that is varied.
pub(super) fn sweeps() -> Vec<Sweep> {
    let drawn = |cone_deg, largest_deg| Turns::Drawn { cone_deg, largest_deg };
    let stations = STATIONS.map(|n| Case {
        stations: n,
        ..Case::at(format!("stations-{n}"), n as f64, format!("{n} stations"))
    });
    let cones = CONES_DEG.map(|c| Case {
        turns: drawn(c, 30.0),
        ..Case::at(format!("cone-{c}"), c, format!("axes within {c} deg of one axis"))
    });
    let angles = ANGLES_DEG.map(|a| Case {
        turns: drawn(90.0, a),
        ..Case::at(format!("angle-{a}"), a, format!("turned by up to {a} deg"))
    });
    let noises = NOISES_PX
        .map(|px| Case { noise_px: px, ..Case::at(format!("noise-{px}"), px, format!("noise of {px} px")) });
    let robots = ROBOTS.map(|factor| Case {
        robot: Repeatability { position: factor * ROBOT.position, rotation_rad: factor * ROBOT.rotation_rad },
        ..Case::at(
            format!("robot-{factor}"),
            factor * ROBOT.position,
            format!("robot that repeats {factor} times 0.05 mm and 0.02 deg"),
        )
    });
    let designs = DESIGNS.iter().zip(1..).map(|((id, what, turns), level)| Case {
        turns: *turns,
        stations: DESIGNED,
        ..Case::at((*id).to_string(), f64::from(level), format!("six stations, {what}"))
    });
    let set_ups = [Case::base("in-hand"), Case { level: 1.0, ..Case::base("to-hand").with_fixed_camera() }];
    vec![
        Sweep { id: "stations", axis: "stations", title: "Number of stations", cases: stations.to_vec() },
        Sweep { id: "cone", axis: "axes within (deg)", title: "Spread of the axes", cases: cones.to_vec() },
        Sweep {
            id: "angle",
            axis: "largest angle (deg)",
            title: "Angle of the turns",
            cases: angles.to_vec(),
        },
        Sweep { id: "noise", axis: "noise (px)", title: "Noise of the camera", cases: noises.to_vec() },
        Sweep {
            id: "robot",
            axis: "repeatability (mm)",
            title: "Noise of the robot",
            cases: robots.to_vec(),
        },
        Sweep { id: "designs", axis: "design", title: "Six stations", cases: designs.collect() },
        Sweep { id: "set-ups", axis: "set-up", title: "Set-up", cases: set_ups.to_vec() },
    ]
}
