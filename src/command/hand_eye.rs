//! `calibench hand-eye ROBOT.csv RESULT.json`: where a camera sits on a robot or beside it, with its
//! uncertainty.

use super::Exit;
use super::format::Format;
use super::report::table;
use super::said::{Said, positive, say, written_by};
use calibench::calibrate::Covariance;
use calibench::downstream::{HandEye, Repeatability, SetUp, Stations, hand_eye};
use calibench::geometry::{Pose, Vec3, rotation};
use calibench::io::robot::{RobotFile, read_robot};
use calibench::io::shown::on_one_line;
use calibench::io::{Known, KnownCalibration, ShownPath, read_known, significant};
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub(super) struct Arguments {
    /// Poses of the gripper seen from the robot's base, in the board's unit: view,x,y,z and rx,ry,rz
    /// (rotation vector, rad), qw,qx,qy,qz or roll,pitch,yaw (degrees, Rz(yaw) Ry(pitch) Rx(roll)); views are
    /// named as in the result
    robot: PathBuf,
    /// result.json of `calibench calibrate`
    result: PathBuf,
    /// What moves with the robot: the camera, or the target before a fixed camera
    #[arg(long, value_enum, default_value_t = Moves::EyeInHand)]
    set_up: Moves,
    /// Standard deviation of each coordinate of the robot's position, in mm (the board's unit): what it
    /// repeats
    #[arg(long, value_name = "MM", value_parser = positive)]
    robot_sd_mm: f64,
    /// Standard deviation of the robot's rotation about each axis, degrees
    #[arg(long, value_name = "DEG", value_parser = positive)]
    robot_sd_deg: f64,
    /// Folder for hand-eye.json
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Text for people or JSON for programs
    #[arg(long, value_enum, default_value_t = Format::Text)]
    format: Format,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Moves {
    EyeInHand,
    EyeToHand,
}

impl Moves {
    fn name(self) -> &'static str {
        match self {
            Moves::EyeInHand => "eye-in-hand",
            Moves::EyeToHand => "eye-to-hand",
        }
    }

    /// Names of X and Y.
    fn poses(self) -> [&'static str; 2] {
        match self {
            Moves::EyeInHand => ["gripper_from_cam", "base_from_target"],
            Moves::EyeToHand => ["base_from_cam", "gripper_from_target"],
        }
    }
}

impl From<Moves> for SetUp {
    fn from(moves: Moves) -> SetUp {
        match moves {
            Moves::EyeInHand => SetUp::EyeInHand,
            Moves::EyeToHand => SetUp::EyeToHand,
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> Exit {
    let found = found(arguments);
    let said = found.map(|found| Said { text: found.text(arguments), json: found.json(arguments) });
    say(said, arguments.out.as_deref(), "hand-eye.json", arguments.format)
}

/// The calibration, and the stations it rests on.
struct Found {
    stations: Vec<String>,
    /// Views that stand in one of the files only.
    alone: Vec<String>,
    result: HandEye,
}

fn found(arguments: &Arguments) -> Result<Found, String> {
    let robot = read_robot(&arguments.robot).map_err(|error| error.to_string())?;
    let Known::Camera(known) = read_known(&arguments.result).map_err(|error| error.to_string())? else {
        return Err(format!("{}: the map of a plane has no poses", arguments.result.display()));
    };
    let (stations, covariance) = shared(&robot, &known);
    let of_robot: Vec<Pose> = stations.iter().map(|s| robot.base_from_gripper[s.in_robot]).collect();
    let of_camera: Vec<Pose> = stations.iter().map(|s| known.cam_from_target[s.in_result]).collect();
    let names: Vec<String> = stations.iter().map(|s| robot.views[s.in_robot].clone()).collect();
    let both: BTreeSet<&String> = names.iter().collect();
    let missing = |views: &[String], file: &PathBuf| -> Vec<String> {
        let only = views.iter().filter(|view| !both.contains(view));
        only.map(|view| format!("{} of {}", on_one_line(view), file.shown())).collect()
    };
    let alone = [missing(&robot.views, &arguments.robot), missing(&known.views, &arguments.result)].concat();
    let result = hand_eye(&Stations {
        set_up: arguments.set_up.into(),
        base_from_gripper: &of_robot,
        cam_from_target: &of_camera,
        covariance: &covariance,
        robot: Repeatability {
            position: arguments.robot_sd_mm,
            rotation_rad: arguments.robot_sd_deg.to_radians(),
        },
    })
    .map_err(|error| {
        let of = format!("stations count from 0 in the order of {}", arguments.robot.display());
        let left = if alone.is_empty() {
            String::new()
        } else {
            format!("; without a partner: {}", alone.join(", "))
        };
        format!("{error} ({of}{left})")
    })?;
    Ok(Found { stations: names, alone, result })
}

/// A view that both files have.
struct Station {
    in_robot: usize,
    in_result: usize,
}

/// The views of both files in the order of the robot's, with their part of the covariance.
fn shared(robot: &RobotFile, known: &KnownCalibration) -> (Vec<Station>, Covariance) {
    let place: std::collections::BTreeMap<&String, usize> = known.views.iter().zip(0..).collect();
    let both = robot
        .views
        .iter()
        .enumerate()
        .filter_map(|(in_robot, view)| Some(Station { in_robot, in_result: *place.get(view)? }));
    let stations: Vec<Station> = both.collect();
    let covariance = known.covariance.of_views(stations.iter().map(|s| s.in_result));
    (stations, covariance)
}

/// Below this probability the stated errors do not explain the residuals.
const DOUBTFUL: f64 = 1e-3;

impl Found {
    fn text(&self, arguments: &Arguments) -> String {
        let result = &self.result;
        let [x, y] = arguments.set_up.poses();
        let deviation = |i: usize| result.covariance[(i, i)].sqrt();
        let mut rows = table(&["pose", "", "x", "y", "z"]);
        for (name, pose, from) in [(x, &result.x, 0), (y, &result.y, 6)] {
            let turn = rotation::log(&pose.rotation).map(f64::to_degrees);
            let three = |of: &dyn Fn(usize) -> String| [of(0), of(1), of(2)];
            let [a, b, c] = three(&|i| format!("{:.4}", pose.translation[i]));
            rows.add_row([name.to_string(), "translation".into(), a, b, c]);
            let [a, b, c] = three(&|i| significant(deviation(from + 3 + i), 2));
            rows.add_row([String::new(), "standard deviation".into(), a, b, c]);
            let [a, b, c] = three(&|i| format!("{:.5}", turn[i]));
            rows.add_row([String::new(), "rotation vector (degrees)".into(), a, b, c]);
            let [a, b, c] = three(&|i| significant(deviation(from + i).to_degrees(), 2));
            rows.add_row([String::new(), "standard deviation".into(), a, b, c]);
        }
        let mut text = format!(
            "{} stations, {}\n\n{}\n\n",
            self.stations.len(),
            arguments.set_up.name(),
            rows.trim_fmt()
        );
        // Writing to a string cannot fail, here and below.
        let _ = writeln!(
            text,
            "chi-squared {} on {} degrees of freedom (p = {})",
            significant(result.chi_squared, 4),
            result.degrees_of_freedom,
            significant(result.p_value(), 2)
        );
        text += &self.methods_text();
        if result.p_value() < DOUBTFUL {
            let _ = writeln!(
                text,
                "warning: residuals are {} times what was stated, and so may the standard deviations be: the robot is less accurate than it repeats, or \
                 a station is wrong (the worst is {})",
                significant(result.excess(), 3),
                self.worst()
            );
        }
        if !self.alone.is_empty() {
            let _ = writeln!(text, "left out, without a partner: {}", self.alone.join(", "));
        }
        text
    }

    fn methods_text(&self) -> String {
        let result = &self.result;
        let line = |name: &str, pose: &Pose| {
            let step = result.x.step_to(pose);
            let turn = Vec3::new(step[0], step[1], step[2]).norm().to_degrees();
            let shift = Vec3::new(step[3], step[4], step[5]).norm();
            format!("{name} differs by {} degrees and {}\n", significant(turn, 2), significant(shift, 2))
        };
        let tsai_lenz = match &result.tsai_lenz {
            Some(pose) => line("Tsai & Lenz 1989", pose),
            None => "Tsai & Lenz 1989 has no solution: the rotation is a half turn\n".to_string(),
        };
        tsai_lenz + &line("Park & Martin 1994", &result.park_martin) + &line("Shah 2013", &result.shah[0])
    }

    /// The station with the largest residual, its rotation counted in the robot's standard deviations.
    fn worst(&self) -> &str {
        let size = |i: &usize| {
            let r = &self.result.residuals[*i];
            (r.fixed_rows::<3>(3).norm(), r.fixed_rows::<3>(0).norm())
        };
        let worst = (0..self.stations.len()).max_by(|i, j| size(i).0.total_cmp(&size(j).0));
        worst.map_or("", |i| self.stations[i].as_str())
    }

    fn json(&self, arguments: &Arguments) -> Value {
        let result = &self.result;
        let vector = |v: &Vec3| [v.x, v.y, v.z];
        let pose = |pose: &Pose| {
            let r = &pose.rotation;
            json!({
                "rotation_vector_rad": vector(&rotation::log(r)),
                "translation": vector(&pose.translation),
                "rotation": (0..3).map(|i| [r[(i, 0)], r[(i, 1)], r[(i, 2)]]).collect::<Vec<_>>(),
            })
        };
        let deviations: Vec<f64> = (0..12).map(|i| result.covariance[(i, i)].sqrt()).collect();
        let covariance: Vec<Vec<f64>> =
            result.covariance.row_iter().map(|row| row.iter().copied().collect()).collect();
        let [x, y] = arguments.set_up.poses();
        let stations = self.stations.iter().zip(&result.residuals);
        json!({
            "written_by": written_by(),
            "robot": arguments.robot.display().to_string(),
            "result": arguments.result.display().to_string(),
            "set_up": arguments.set_up.name(),
            "robot_sd_mm": arguments.robot_sd_mm,
            "robot_sd_deg": arguments.robot_sd_deg,
            x: pose(&result.x),
            y: pose(&result.y),
            "order": "rotation of X (left perturbation, rad), translation of X, rotation of Y, translation of Y",
            "standard_deviations": deviations,
            "covariance": covariance,
            "tsai_lenz": result.tsai_lenz.as_ref().map(pose),
            "park_martin": pose(&result.park_martin),
            "shah": { x: pose(&result.shah[0]), y: pose(&result.shah[1]) },
            "chi_squared": result.chi_squared,
            "degrees_of_freedom": result.degrees_of_freedom,
            "p_value": result.p_value(),
            "iterations": result.iterations,
            "stations": stations.map(|(view, r)| json!({
                "view": view, "residual": r.iter().copied().collect::<Vec<f64>>(),
            })).collect::<Vec<_>>(),
            "left_out": self.alone,
        })
    }
}
