//! How do arrays of NumPy become points, and points arrays?

use calibench::geometry::{Mat3, Pose, Vec2, Vec3};
use nalgebra::DMatrix;
use numpy::{
    AllowTypeChange, PyArray1, PyArray2, PyArray3, PyArrayLikeDyn, PyArrayMethods, PyReadonlyArrayDyn,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// An array of shape (N,).
pub(crate) type Vector<'py> = Bound<'py, PyArray1<f64>>;
/// An array of shape (N, C).
pub(crate) type Matrix<'py> = Bound<'py, PyArray2<f64>>;

/// Numbers row by row, and how many columns there are.
pub(crate) struct Rows {
    numbers: Vec<f64>,
    columns: usize,
}

impl Rows {
    /// Reads an array of shape (N, C), or (N, 1, C) as some detectors give it.
    pub(crate) fn of(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Rows> {
        let array: PyArrayLikeDyn<'_, f64, AllowTypeChange> = value.extract().map_err(|_| {
            PyValueError::new_err(format!("{what}: expected an array of numbers of shape (N, 2)"))
        })?;
        Rows::of_array(&array, what)
    }

    fn of_array(array: &PyReadonlyArrayDyn<'_, f64>, what: &str) -> PyResult<Rows> {
        let columns = match *array.shape() {
            [_, columns] | [_, 1, columns] => columns,
            _ => return Err(shape_error(what, array.shape(), "(N, 2)")),
        };
        Ok(Rows { numbers: numbers(array), columns })
    }

    /// Points of the plane. A third column must be 0 everywhere: target points lie in Z = 0.
    pub(crate) fn plane(self, what: &str) -> PyResult<Vec<Vec2>> {
        match self.columns {
            2 => Ok(self.numbers.chunks_exact(2).map(|row| Vec2::new(row[0], row[1])).collect()),
            3 => self.flat(what),
            columns => Err(PyValueError::new_err(format!("{what}: expected 2 columns, got {columns}"))),
        }
    }

    fn flat(self, what: &str) -> PyResult<Vec<Vec2>> {
        let rows = self.numbers.chunks_exact(3);
        if let Some((index, row)) = rows.clone().enumerate().find(|(_, row)| row[2] != 0.0) {
            let z = row[2];
            return Err(PyValueError::new_err(format!(
                "{what}: point {index} has Z = {z}: points of a target lie in Z = 0"
            )));
        }
        Ok(rows.map(|row| Vec2::new(row[0], row[1])).collect())
    }

    /// Points of space; of two columns those with Z = 0.
    pub(crate) fn space(self, what: &str) -> PyResult<Vec<Vec3>> {
        match self.columns {
            2 => Ok(self.numbers.chunks_exact(2).map(|row| Vec3::new(row[0], row[1], 0.0)).collect()),
            3 => Ok(self.numbers.chunks_exact(3).map(|row| Vec3::new(row[0], row[1], row[2])).collect()),
            columns => Err(PyValueError::new_err(format!("{what}: expected 2 or 3 columns, got {columns}"))),
        }
    }
}

/// Row by row: an array in Fortran's order is contiguous too, and its slice would be column by column.
fn numbers(array: &PyReadonlyArrayDyn<'_, f64>) -> Vec<f64> {
    match array.as_slice() {
        Ok(slice) if array.is_c_contiguous() => slice.to_vec(),
        _ => array.as_array().iter().copied().collect(),
    }
}

fn shape_error(what: &str, shape: &[usize], wanted: &str) -> PyErr {
    PyValueError::new_err(format!("{what}: expected shape {wanted}, got {shape:?}"))
}

/// Points of the plane, shape (N, 2).
pub(crate) fn plane_points(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<Vec2>> {
    Rows::of(value, what)?.plane(what)
}

/// One array a view: of an array of three dimensions its first, else of each item of a sequence.
pub(crate) fn views_of_points(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<Vec<Vec2>>> {
    if let Ok(array) = value.extract::<PyReadonlyArrayDyn<'_, f64>>() {
        if let [views, points, 2] = *array.shape() {
            let all = numbers(&array);
            let view = |v: usize| all[2 * points * v..][..2 * points].chunks_exact(2);
            return Ok((0..views).map(|v| view(v).map(|p| Vec2::new(p[0], p[1])).collect()).collect());
        }
        return Err(shape_error(what, array.shape(), "(V, N, 2), or a list of one array a view"));
    }
    value.try_iter()?.enumerate().map(|(i, view)| plane_points(&view?, &format!("{what}[{i}]"))).collect()
}

/// Whether these are the points of one board, which all views share: an array of two dimensions.
pub(crate) fn is_shared(value: &Bound<'_, PyAny>) -> bool {
    value.extract::<PyReadonlyArrayDyn<'_, f64>>().is_ok_and(|array| array.ndim() == 2)
}

/// Three numbers.
pub(crate) fn vector(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec3> {
    let array: PyArrayLikeDyn<'_, f64, AllowTypeChange> = value.extract()?;
    match numbers(&array)[..] {
        [x, y, z] => Ok(Vec3::new(x, y, z)),
        _ => Err(shape_error(what, array.shape(), "(3,)")),
    }
}

/// How far `R^T R` may be from the identity: matrices that came through single precision are accepted.
const ORTHOGONAL: f64 = 1e-5;

/// A proper rotation, shape (3, 3).
pub(crate) fn rotation(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Mat3> {
    let array: PyArrayLikeDyn<'_, f64, AllowTypeChange> = value.extract()?;
    if *array.shape() != [3, 3] {
        return Err(shape_error(what, array.shape(), "(3, 3)"));
    }
    let matrix = Mat3::from_row_slice(&numbers(&array));
    let off = (matrix.transpose() * matrix - Mat3::identity()).norm();
    match off <= ORTHOGONAL && matrix.determinant() > 0.0 {
        true => Ok(matrix),
        false => Err(PyValueError::new_err(format!(
            "{what}: no rotation: |R^T R - 1| = {off:.2e}, det R = {:.3}",
            matrix.determinant()
        ))),
    }
}

/// A pose of a rotation and a translation.
pub(crate) fn pose(rotation_matrix: &Bound<'_, PyAny>, translation: &Bound<'_, PyAny>) -> PyResult<Pose> {
    Ok(Pose {
        rotation: rotation(rotation_matrix, "rotation")?,
        translation: vector(translation, "translation")?,
    })
}

/// An array of shape (N, 2).
pub(crate) fn of_plane<'py>(py: Python<'py>, points: &[Vec2]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let numbers: Vec<f64> = points.iter().flat_map(|p| [p.x, p.y]).collect();
    shaped(py, numbers, points.len(), 2)
}

/// An array of shape (N, 3).
pub(crate) fn of_space<'py>(py: Python<'py>, points: &[Vec3]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let numbers: Vec<f64> = points.iter().flat_map(|p| [p.x, p.y, p.z]).collect();
    shaped(py, numbers, points.len(), 3)
}

/// An array of shape (rows, columns) of numbers row by row.
pub(crate) fn shaped(
    py: Python<'_>,
    numbers: Vec<f64>,
    rows: usize,
    columns: usize,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    PyArray1::from_vec(py, numbers).reshape([rows, columns])
}

/// A matrix.
pub(crate) fn of_matrix<'py>(py: Python<'py>, matrix: &DMatrix<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let numbers = matrix.row_iter().flat_map(|row| row.iter().copied().collect::<Vec<f64>>()).collect();
    shaped(py, numbers, matrix.nrows(), matrix.ncols())
}

/// Matrices of one shape, one after another: shape (count, rows, columns).
pub(crate) fn stacked<'py>(
    py: Python<'py>,
    count: usize,
    (rows, columns): (usize, usize),
    entry: impl Fn(usize, usize, usize) -> f64,
) -> PyResult<Bound<'py, PyArray3<f64>>> {
    let mut numbers = Vec::with_capacity(count * rows * columns);
    for k in 0..count {
        for i in 0..rows {
            numbers.extend((0..columns).map(|j| entry(k, i, j)));
        }
    }
    PyArray1::from_vec(py, numbers).reshape([count, rows, columns])
}

/// Rotations of poses, shape (V, 3, 3).
pub(crate) fn of_rotations<'py>(py: Python<'py>, poses: &[Pose]) -> PyResult<Bound<'py, PyArray3<f64>>> {
    stacked(py, poses.len(), (3, 3), |v, i, j| poses[v].rotation[(i, j)])
}

/// Translations of poses, shape (V, 3).
pub(crate) fn of_translations<'py>(py: Python<'py>, poses: &[Pose]) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let translations: Vec<Vec3> = poses.iter().map(|pose| pose.translation).collect();
    of_space(py, &translations)
}
