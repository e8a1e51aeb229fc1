//! Where was the robot? Pose files: `view,x,y,z` and the rotation as `rx,ry,rz` (rotation vector, rad),
//! `qw,qx,qy,qz` (quaternion) or `roll,pitch,yaw` (degrees, `Rz(yaw) Ry(pitch) Rx(roll)`), one line a view.

use super::lines::open;
use super::table::{Column, Row, TableError, columns, read_table};
use crate::geometry::{Mat3, Pose, Vec3, rotation};
use std::collections::BTreeMap;
use std::path::Path;

/// The poses of a file by the view that was taken there, in its order: base_from_gripper.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RobotFile {
    /// Name of each view.
    pub views: Vec<String>,
    /// Where the gripper was, as seen from the robot's base.
    pub base_from_gripper: Vec<Pose>,
}

/// Why a file of robot poses cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RobotError {
    /// It is no such table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// No rotation, or more than one.
    #[error(
        "{file}:1: the rotation is expected in one form, as rx,ry,rz (rotation vector, rad), qw,qx,qy,qz or roll,pitch,yaw (degrees); the header has {found}"
    )]
    Rotation {
        /// The file.
        file: String,
        /// What the header has.
        found: String,
    },
    /// A quaternion that is far from a unit one.
    #[error("{file}:{line}: the quaternion has length {length:.4}, not 1")]
    Quaternion {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// Its length.
        length: f64,
    },
}

/// Reads a file of robot poses.
///
/// # Errors
/// See [`RobotError`].
pub fn read_robot(path: &Path) -> Result<RobotFile, RobotError> {
    let (file, bytes) = open(path)?;
    parse_robot(&file, &bytes)
}

/// Reads robot poses from bytes; `file` names them in errors.
///
/// # Errors
/// See [`RobotError`].
///
/// ```
/// use calibench::io::robot::parse_robot;
///
/// let robot = parse_robot("robot.csv", b"view,x,y,z,roll,pitch,yaw\n0,400,0,300,180,0,90\n")?;
/// assert_eq!(robot.base_from_gripper[0].translation.z, 300.0);
/// # Ok::<(), calibench::io::robot::RobotError>(())
/// ```
pub fn parse_robot(file: &str, bytes: &[u8]) -> Result<RobotFile, RobotError> {
    let header = columns(bytes);
    let has = |name: &str| header.iter().any(|column| column == name);
    let vector = |[x, y, z]: [f64; 3]| rotation::exp(&Vec3::new(x, y, z));
    let angles = |degrees: [f64; 3]| {
        let [roll, pitch, yaw] = degrees.map(f64::to_radians);
        rotation::from_xyz_rad(roll, pitch, yaw)
    };
    let rows = match (has("rx"), has("qw"), has("roll")) {
        (true, false, false) => turned(file, bytes, ["x", "y", "z", "rx", "ry", "rz"], vector)?,
        (false, false, true) => turned(file, bytes, ["x", "y", "z", "roll", "pitch", "yaw"], angles)?,
        (false, true, false) => by_quaternion(file, bytes)?,
        _ => return Err(RobotError::Rotation { file: file.into(), found: header.join(",") }),
    };
    let (mut robot, mut first_line) = (RobotFile::default(), BTreeMap::new());
    for (line, view, pose) in rows {
        if let Some(first) = first_line.insert(view.clone(), line) {
            let place = "of the list".to_string();
            let repeated = TableError::RepeatedPoint { file: file.into(), line, point: view, place, first };
            return Err(repeated.into());
        }
        robot.views.push(view);
        robot.base_from_gripper.push(pose);
    }
    Ok(robot)
}

/// Line, view and pose.
type Station = (u64, String, Pose);

fn turned(
    file: &str,
    bytes: &[u8],
    columns: [&'static str; 6],
    rotation: impl Fn([f64; 3]) -> Mat3,
) -> Result<Vec<Station>, TableError> {
    let pose = |Row { line, names: [view], numbers: [x, y, z, a, b, c] }: Row<1, 6>| {
        (line, view, Pose { rotation: rotation([a, b, c]), translation: Vec3::new(x, y, z) })
    };
    Ok(read_table(file, bytes, ["view"], columns.map(Column::length))?.into_iter().map(pose).collect())
}

/// Controllers print four to six digits: a length that is further off is another error.
const UNIT_TOLERANCE: f64 = 1e-3;

fn by_quaternion(file: &str, bytes: &[u8]) -> Result<Vec<Station>, RobotError> {
    let rows =
        read_table(file, bytes, ["view"], ["x", "y", "z", "qw", "qx", "qy", "qz"].map(Column::length))?;
    let pose = |Row { line, names: [view], numbers: [x, y, z, w, i, j, k] }: Row<1, 7>| {
        let imaginary = Vec3::new(i, j, k);
        let length = libm::hypot(w, imaginary.norm());
        if (length - 1.0).abs() > UNIT_TOLERANCE {
            return Err(RobotError::Quaternion { file: file.into(), line, length });
        }
        let sine = imaginary.norm();
        let turn = if sine > 0.0 { imaginary * (2.0 * libm::atan2(sine, w) / sine) } else { Vec3::zeros() };
        Ok((line, view, Pose { rotation: rotation::exp(&turn), translation: Vec3::new(x, y, z) }))
    };
    rows.into_iter().map(pose).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_rotation_in_three_forms_is_one_pose() {
        let read = |text: &str| parse_robot("r.csv", text.as_bytes()).unwrap().base_from_gripper[0];
        // Ry(90) Rx(90) turns x, y, z into -z, x, -y: 120 degrees about (1, 1, -1).
        let angles = read("view,x,y,z,roll,pitch,yaw\na,1,2,3,90,90,0\n");
        let third = 2.0 * std::f64::consts::PI / 3.0 / 3.0_f64.sqrt();
        let vector = read(&format!("view,x,y,z,rx,ry,rz\na,1,2,3,{third},{third},{}\n", -third));
        let quaternion = read("qw,qx,qy,qz,view,x,y,z\n-0.5,-0.5,-0.5,0.5,a,1,2,3\n");
        for other in [vector, quaternion] {
            assert!(
                (angles.rotation - other.rotation).norm() < 1e-15 && angles.translation == other.translation
            );
        }
    }

    #[test]
    fn rotations_that_are_none_are_refused() {
        let fail = |text: &str| parse_robot("r.csv", text.as_bytes()).unwrap_err().to_string();
        assert!(fail("view,x,y,z\na,1,2,3\n").contains("the header has view,x,y,z"));
        assert!(fail("view,x,y,z,rx,ry,rz,roll,pitch,yaw\na,1,2,3,0,0,0,0,0,0\n").contains("in one form"));
        assert_eq!(
            fail("view,x,y,z,qw,qx,qy,qz\na,1,2,3,1,1,0,0\n"),
            "r.csv:2: the quaternion has length 1.4142, not 1"
        );
        assert!(fail("view,x,y,z,rx,ry,rz\na,1,2,3,0,0,0\na,1,2,3,0,0,0\n").contains("line 2 already"));
    }
}
