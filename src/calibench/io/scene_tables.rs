//! Which marks has the target of a scene, and where is it held? Tables of marks, `X,Y`, and of poses, `x,y,z`
//! and the rotation as `rx,ry,rz` (rotation vector, rad) or `r11,r12,...,r33` (the matrix, row by row). A
//! column `cell` lets one file hold several scenes.
//!
//! A matrix is taken bit for bit, so that poses that were written are read as what they were; a rotation
//! vector is rounded on its way to a matrix. Written are matrices therefore.

use super::table::{Column, Row, TableError, columns, read_table};
use crate::geometry::{Mat3, Pose, Vec2, Vec3, rotation};
use std::fmt::Write;

/// Why a table of marks or poses cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneTableError {
    /// It is no such table.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A mark outside of the plane of the target.
    #[error(
        "{file}:{line}: the mark has Z = {z}: only targets in the plane Z = 0 are calibrated from; `calibench tsai` takes targets in \
         three dimensions"
    )]
    NotPlanar {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// Its Z.
        z: f64,
    },
    /// No rotation, or more than one.
    #[error(
        "{file}:1: the rotation is expected in one form, as rx,ry,rz (rotation vector, rad) or r11,r12,r13,r21,...,r33 (matrix); the header \
         has {found}"
    )]
    Rotation {
        /// The file.
        file: String,
        /// What the header has.
        found: String,
    },
    /// Nine numbers that turn nothing.
    #[error(
        "{file}:{line}: r11 to r33 are no rotation: R R^T differs from the unit matrix by {off:.2e} (at most {most:e}), and the determinant is \
         {determinant:.4}",
        most = MATRIX_TOLERANCE
    )]
    Matrix {
        /// The file.
        file: String,
        /// The line.
        line: u64,
        /// Largest difference of an entry of `R R^T` from that of the unit matrix.
        off: f64,
        /// Its determinant.
        determinant: f64,
    },
    /// Several scenes, and nobody says which.
    #[error(
        "{file}: a column `cell` says that the file is of several scenes: name one, such as cell = {first}"
    )]
    WhichCell {
        /// The file.
        file: String,
        /// The first that it has.
        first: String,
    },
    /// A cell that the file does not have.
    #[error("{file}: no line is of cell {cell}")]
    NoCell {
        /// The file.
        file: String,
        /// As asked.
        cell: usize,
    },
}

/// How far from a rotation a matrix may be: ten printed digits.
const MATRIX_TOLERANCE: f64 = 1e-9;

/// Reads the marks of a target, in the target's unit, in the order of the file; `file` names it in errors. A
/// column Z must hold zeros.
///
/// # Errors
/// See [`SceneTableError`].
///
/// ```
/// use calibench::io::scene_tables::parse_target_marks;
///
/// let marks = parse_target_marks("marks.csv", b"X,Y\n0,0\n12.5,0.02\n", None)?;
/// assert_eq!(marks[1].x, 12.5);
/// # Ok::<(), calibench::io::scene_tables::SceneTableError>(())
/// ```
pub fn parse_target_marks(
    file: &str,
    bytes: &[u8],
    cell: Option<usize>,
) -> Result<Vec<Vec2>, SceneTableError> {
    if !columns(bytes).iter().any(|column| column == "Z") {
        let rows = rows_of(file, bytes, ["X", "Y"], cell)?;
        return Ok(rows.iter().map(|(_, [x, y])| Vec2::new(*x, *y)).collect());
    }
    let flat = |(line, [x, y, z]): (u64, [f64; 3])| match z {
        0.0 => Ok(Vec2::new(x, y)),
        z => Err(SceneTableError::NotPlanar { file: file.into(), line, z }),
    };
    rows_of(file, bytes, ["X", "Y", "Z"], cell)?.into_iter().map(flat).collect()
}

/// Reads poses of a target, target to camera, translations in the target's unit, in the order of the file;
/// `file` names it in errors.
///
/// # Errors
/// See [`SceneTableError`].
///
/// ```
/// use calibench::io::scene_tables::parse_target_poses;
///
/// let poses = parse_target_poses("poses.csv", b"x,y,z,rx,ry,rz\n0,0,120,0.3,0,0\n", None)?;
/// assert!((poses[0].rotation[(2, 2)] - 0.3_f64.cos()).abs() < 1e-15);
/// # Ok::<(), calibench::io::scene_tables::SceneTableError>(())
/// ```
pub fn parse_target_poses(
    file: &str,
    bytes: &[u8],
    cell: Option<usize>,
) -> Result<Vec<Pose>, SceneTableError> {
    let header = columns(bytes);
    let has = |name: &str| header.iter().any(|column| column == name);
    match (has("rx"), has("r11")) {
        (true, false) => {
            let rows = rows_of(file, bytes, ["x", "y", "z", "rx", "ry", "rz"], cell)?;
            let pose = |(_, [x, y, z, a, b, c]): (u64, [f64; 6])| Pose {
                rotation: rotation::exp(&Vec3::new(a, b, c)),
                translation: Vec3::new(x, y, z),
            };
            Ok(rows.into_iter().map(pose).collect())
        }
        (false, true) => {
            rows_of(file, bytes, WITH_MATRIX, cell)?.into_iter().map(|row| by_matrix(file, row)).collect()
        }
        _ => Err(SceneTableError::Rotation { file: file.into(), found: header.join(",") }),
    }
}

/// The columns of a pose that is read as it was written.
const WITH_MATRIX: [&str; 12] =
    ["x", "y", "z", "r11", "r12", "r13", "r21", "r22", "r23", "r31", "r32", "r33"];

fn by_matrix(file: &str, (line, numbers): (u64, [f64; 12])) -> Result<Pose, SceneTableError> {
    let rotation = Mat3::from_row_slice(&numbers[3..]);
    let off = (rotation * rotation.transpose() - Mat3::identity()).amax();
    let determinant = rotation.determinant();
    // Not a number where a product overflows.
    let is_rotation = off <= MATRIX_TOLERANCE && determinant > 0.0;
    match is_rotation {
        true => Ok(Pose { rotation, translation: Vec3::from_row_slice(&numbers[..3]) }),
        false => Err(SceneTableError::Matrix { file: file.into(), line, off, determinant }),
    }
}

/// Line and numbers of the rows of one cell, or of all where the file has no column `cell`.
fn rows_of<const N: usize>(
    file: &str,
    bytes: &[u8],
    names: [&'static str; N],
    cell: Option<usize>,
) -> Result<Vec<(u64, [f64; N])>, SceneTableError> {
    let numbers = names.map(Column::length);
    let Some(cell) = cell else {
        if columns(bytes).iter().any(|column| column == "cell") {
            let rows: Vec<Row<1, N>> = read_table(file, bytes, ["cell"], numbers)?;
            let first = rows.first().map_or_else(String::new, |row| row.names[0].clone());
            return Err(SceneTableError::WhichCell { file: file.into(), first });
        }
        let rows: Vec<Row<0, N>> = read_table(file, bytes, [], numbers)?;
        return Ok(rows.into_iter().map(|row| (row.line, row.numbers)).collect());
    };
    let rows: Vec<Row<1, N>> = read_table(file, bytes, ["cell"], numbers)?;
    let wanted = cell.to_string();
    let own = rows.into_iter().filter(|row| row.names[0] == wanted);
    let own: Vec<(u64, [f64; N])> = own.map(|row| (row.line, row.numbers)).collect();
    if own.is_empty() { Err(SceneTableError::NoCell { file: file.into(), cell }) } else { Ok(own) }
}

/// The marks of several cells, each with all digits: the same bits are read.
pub fn target_marks<'a>(cells: impl IntoIterator<Item = (usize, &'a [Vec2])>) -> String {
    let mut text = String::from("cell,point,X,Y\n");
    for (cell, marks) in cells {
        for (point, mark) in marks.iter().enumerate() {
            writeln!(text, "{cell},{point},{:?},{:?}", mark.x, mark.y)
                .expect("writing to memory cannot fail");
        }
    }
    text
}

/// The poses of several cells, each with all digits: the same bits are read.
pub fn target_poses<'a>(cells: impl IntoIterator<Item = (usize, &'a [Pose])>) -> String {
    let mut text = format!("cell,view,{}\n", WITH_MATRIX.join(","));
    for (cell, poses) in cells {
        for (view, Pose { rotation, translation }) in poses.iter().enumerate() {
            // The transposed matrix column by column is the matrix row by row.
            let by_rows = rotation.transpose();
            write!(text, "{cell},{view}").expect("writing to memory cannot fail");
            for number in translation.iter().chain(by_rows.iter()) {
                write!(text, ",{number:?}").expect("writing to memory cannot fail");
            }
            text.push('\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn poses(text: &str, cell: Option<usize>) -> Result<Vec<Pose>, String> {
        parse_target_poses("p.csv", text.as_bytes(), cell).map_err(|error| error.to_string())
    }

    fn marks(text: &str, cell: Option<usize>) -> Result<Vec<Vec2>, String> {
        parse_target_marks("m.csv", text.as_bytes(), cell).map_err(|error| error.to_string())
    }

    #[test]
    fn what_is_written_is_read_bit_for_bit() {
        let pose = |a: f64| Pose {
            rotation: rotation::exp(&Vec3::new(a, 1.0 / 3.0, -a * a)),
            translation: Vec3::new(-0.0, 1e-300, 120.0 / 7.0),
        };
        let (first, second) = ([pose(0.1)], [pose(0.7), pose(3.0)]);
        let text = target_poses([(0, &first[..]), (3, &second[..])]);
        assert_eq!(poses(&text, Some(3)).unwrap(), second);
        let back = poses(&text, Some(0)).unwrap();
        assert_eq!(back, first);
        assert_eq!(back[0].translation.x.to_bits(), (-0.0_f64).to_bits());
        let seen = [Vec2::new(0.1, -1.0 / 3.0), Vec2::new(1e22, 5e-324)];
        assert_eq!(marks(&target_marks([(2, &seen[..])]), Some(2)).unwrap(), seen);
    }

    #[test]
    fn both_forms_of_a_rotation_are_one_pose() {
        let vector = poses("z,y,x,rz,ry,rx\n3,2,1,0,0,0.3\n", None).unwrap()[0];
        let (c, s) = (libm::cos(0.3), libm::sin(0.3));
        let matrix =
            format!("x,y,z,r11,r12,r13,r21,r22,r23,r31,r32,r33\n1,2,3,1,0,0,0,{c},{},0,{s},{c}\n", -s);
        let matrix = poses(&matrix, None).unwrap()[0];
        assert!(
            (vector.rotation - matrix.rotation).norm() < 1e-15 && vector.translation == matrix.translation
        );
    }

    #[test]
    fn what_cannot_be_used_is_refused_with_its_place() {
        assert_eq!(marks("X,Y,Z\n1,2,0\n1,3,-0.0\n", None).unwrap().len(), 2);
        let refused = |said: Result<Vec<Vec2>, String>, what: &str| {
            let said = said.unwrap_err();
            assert!(said.contains(what), "{said}");
        };
        refused(marks("X,Y,Z\n1,2,0\n1,3,2.5\n", None), "m.csv:3: the mark has Z = 2.5");
        refused(marks("X\n1\n", None), "column 'Y' is missing");
        refused(marks("X,Y\n1,2\n1,2,3\n", None), "m.csv:3: 3 fields where the header has 2");
        refused(marks("cell,X,Y\n4,1,2\n", None), "name one, such as cell = 4");
        refused(marks("cell,X,Y\n4,1,2\n", Some(1)), "no line is of cell 1");
        refused(marks("X,Y\n1,2\n", Some(1)), "column 'cell' is missing");
        let refused = |text: &str, what: &str| {
            let said = poses(text, None).unwrap_err();
            assert!(said.contains(what), "{said}");
        };
        refused("x,y,z\n1,2,3\n", "the header has x,y,z");
        refused("x,y,z,rx,ry,rz,r11\n1,2,3,0,0,0,1\n", "in one form");
        let mirror = "x,y,z,r11,r12,r13,r21,r22,r23,r31,r32,r33\n0,0,1,1,0,0,0,1,0,0,0,-1\n";
        refused(mirror, "p.csv:2: r11 to r33 are no rotation");
        refused(&mirror.replace(",-1\n", ",1.001\n"), "by 2.00e-3");
    }
}
