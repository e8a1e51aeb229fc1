//! How do arrays of NumPy become points, and points arrays?

use crate::errors;
use calibench::geometry::{Mat3, Pose, Vec2, Vec3};
use nalgebra::DMatrix;
use numpy::{
    PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};

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
        let array = floats(value, what)?;
        let columns = match *array.shape() {
            [_, columns] | [_, 1, columns] => columns,
            _ => return Err(shape_error(value.py(), what, array.shape(), "(N, 2)")),
        };
        Ok(Rows { numbers: numbers(&array), columns })
    }

    /// Points of the plane. A third column must be 0 everywhere: target points lie in Z = 0.
    fn plane(self, py: Python<'_>, what: &str) -> PyResult<Vec<Vec2>> {
        match self.columns {
            2 => Ok(self.numbers.chunks_exact(2).map(|row| Vec2::new(row[0], row[1])).collect()),
            3 => self.flat(py, what),
            columns => Err(columns_error(py, what, "2", columns)),
        }
    }

    fn flat(self, py: Python<'_>, what: &str) -> PyResult<Vec<Vec2>> {
        let rows = self.numbers.chunks_exact(3);
        if let Some((index, row)) = rows.clone().enumerate().find(|(_, row)| row[2] != 0.0) {
            let z = row[2];
            let text = format!("{what}: point {index} has Z = {z}: points of a target lie in Z = 0");
            return Err(refused(py, "NotFlat", what, text));
        }
        Ok(rows.map(|row| Vec2::new(row[0], row[1])).collect())
    }

    /// Points of space; of two columns those with Z = 0.
    pub(crate) fn space(self, py: Python<'_>, what: &str) -> PyResult<Vec<Vec3>> {
        match self.columns {
            2 => Ok(self.numbers.chunks_exact(2).map(|row| Vec3::new(row[0], row[1], 0.0)).collect()),
            3 => Ok(self.numbers.chunks_exact(3).map(|row| Vec3::new(row[0], row[1], row[2])).collect()),
            columns => Err(columns_error(py, what, "2 or 3", columns)),
        }
    }
}

/// An array in double precision of whatever NumPy reads as numbers: lists, arrays of any precision and order of bytes, and what gives itself as
/// an array. Masked and complex numbers are refused: neither has a place in a calculation without its mask or imaginary part.
pub(crate) fn floats<'py>(value: &Bound<'py, PyAny>, what: &str) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    if value.is_exact_instance_of::<PyUntypedArray>()
        && let Ok(array) = value.extract::<PyReadonlyArrayDyn<'py, f64>>()
    {
        return Ok(array);
    }
    let array = as_array(value, what)?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    match kind.as_str() {
        "b" | "i" | "u" | "f" => {
            Ok(array.call_method1("astype", ("float64",))?.extract::<PyReadonlyArrayDyn<'py, f64>>()?)
        }
        "c" => {
            let text = format!("{what}: complex numbers: take their real parts, if these are what is meant");
            Err(refused(value.py(), "Complex", what, text))
        }
        _ => {
            let text =
                format!("{what}: expected an array of numbers, got {}", array.getattr("dtype")?.repr()?);
            Err(refused(value.py(), "NotNumbers", what, text))
        }
    }
}

/// What NumPy makes of a value. Masked arrays are refused.
fn as_array<'py>(value: &Bound<'py, PyAny>, what: &str) -> PyResult<Bound<'py, PyAny>> {
    let py = value.py();
    refuse_masked(value, what)?;
    let array = py.import("numpy")?.call_method1("asarray", (value,));
    array.map_err(|e| {
        refused(py, "NotNumbers", what, format!("{what}: expected an array of numbers: {}", e.value(py)))
    })
}

/// Refuses a masked array, and a list that has one: what is masked would be taken for measured.
pub(crate) fn refuse_masked(value: &Bound<'_, PyAny>, what: &str) -> PyResult<()> {
    let masked = value.py().import("numpy.ma")?.getattr("MaskedArray")?;
    let found = match is_sequence(value) {
        true => {
            value.try_iter()?.any(|item| item.and_then(|item| item.is_instance(&masked)).unwrap_or(false))
        }
        false => value.is_instance(&masked)?,
    };
    if !found {
        return Ok(());
    }
    let text = format!(
        "{what}: a masked array: fill what is masked with its `filled`, or leave the masked rows out"
    );
    Err(refused(value.py(), "Masked", what, text))
}

/// A list or a tuple, whose items are looked at one by one.
fn is_sequence(value: &Bound<'_, PyAny>) -> bool {
    value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>()
}

/// Row by row: an array in Fortran's order is contiguous too, and its slice would be column by column.
fn numbers(array: &PyReadonlyArrayDyn<'_, f64>) -> Vec<f64> {
    match array.as_slice() {
        Ok(slice) if array.is_c_contiguous() => slice.to_vec(),
        _ => array.as_array().iter().copied().collect(),
    }
}

fn refused(py: Python<'_>, kind: &str, what: &str, text: String) -> PyErr {
    errors::numbered(py, "ArrayError", kind, text, |numbers| numbers.set_item("argument", what))
}

fn shape_error(py: Python<'_>, what: &str, shape: &[usize], wanted: &str) -> PyErr {
    let text = format!("{what}: expected shape {wanted}, got {shape:?}");
    errors::numbered(py, "ArrayError", "Shape", text, |numbers| {
        numbers.set_item("argument", what)?;
        numbers.set_item("expected", wanted)?;
        numbers.set_item("got", PyTuple::new(py, shape)?)
    })
}

fn columns_error(py: Python<'_>, what: &str, wanted: &str, got: usize) -> PyErr {
    let text = format!("{what}: expected {wanted} columns, got {got}");
    errors::numbered(py, "ArrayError", "Columns", text, |numbers| {
        numbers.set_item("argument", what)?;
        numbers.set_item("got", got)
    })
}

/// Points of the plane, shape (N, 2).
pub(crate) fn plane_points(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<Vec2>> {
    Rows::of(value, what)?.plane(value.py(), what)
}

/// One array a view: of an array of shape (V, N, C) or (V, N, 1, C) its first index, else of each item of a sequence.
pub(crate) fn views_of_points(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<Vec<Vec2>>> {
    let py = value.py();
    if is_sequence(value) || is_of_objects(value, what)? {
        let view =
            |(i, view): (usize, PyResult<Bound<'_, PyAny>>)| plane_points(&view?, &format!("{what}[{i}]"));
        return value.try_iter()?.enumerate().map(view).collect();
    }
    let array = floats(value, what)?;
    let (views, size, columns) = match *array.shape() {
        [views, points, columns] | [views, points, 1, columns] => (views, points * columns, columns),
        _ => return Err(shape_error(py, what, array.shape(), "(V, N, 2), or a list of one array a view")),
    };
    let all = numbers(&array);
    let view = |v: usize| {
        Rows { numbers: all[size * v..][..size].to_vec(), columns }.plane(py, &format!("{what}[{v}]"))
    };
    (0..views).map(view).collect()
}

/// Whether NumPy has only Python's objects of a value: views of several lengths, or what is no array at all.
fn is_of_objects(value: &Bound<'_, PyAny>, what: &str) -> PyResult<bool> {
    if value.is_exact_instance_of::<PyUntypedArray>()
        && value.extract::<PyReadonlyArrayDyn<'_, f64>>().is_ok()
    {
        return Ok(false);
    }
    let kind: String = as_array(value, what)?.getattr("dtype")?.getattr("kind")?.extract()?;
    Ok(kind == "O")
}

/// Whether these are the points of one board, which all views share: two dimensions, or (N, 1, C) where it is not a list of arrays, which
/// would be views of one point.
pub(crate) fn is_shared(value: &Bound<'_, PyAny>) -> PyResult<bool> {
    Ok(match shape(value, MOST_DIMENSIONS)?[..] {
        [_, _] => true,
        [_, 1, _] => !is_sequence(value) || is_sequence(&value.get_item(0)?),
        _ => false,
    })
}

/// Views, points, a 1 that OpenCV adds, coordinates.
const MOST_DIMENSIONS: usize = 4;

/// How long a value is, its first item, that one's first item, and so on.
fn shape(value: &Bound<'_, PyAny>, most: usize) -> PyResult<Vec<usize>> {
    if most == 0 {
        return Ok(Vec::new());
    }
    if !is_sequence(value) {
        return value.py().import("numpy")?.call_method1("shape", (value,))?.extract();
    }
    let inner = match value.len()? {
        0 => Vec::new(),
        _ => shape(&value.get_item(0)?, most - 1)?,
    };
    Ok([vec![value.len()?], inner].concat())
}

/// Three numbers.
pub(crate) fn vector(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec3> {
    let array = floats(value, what)?;
    match numbers(&array)[..] {
        [x, y, z] => Ok(Vec3::new(x, y, z)),
        _ => Err(shape_error(value.py(), what, array.shape(), "(3,)")),
    }
}

/// One number a mark.
pub(crate) fn list(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Vec<f64>> {
    let array = floats(value, what)?;
    match *array.shape() {
        [_] | [_, 1] => Ok(numbers(&array)),
        _ => Err(shape_error(value.py(), what, array.shape(), "(N,)")),
    }
}

/// Room for so many numbers, asked of the system before any is computed.
///
/// # Errors
/// `MemoryError`, where there is no such room.
pub(crate) fn room<T>(count: usize) -> PyResult<Vec<T>> {
    let mut room = Vec::new();
    room.try_reserve_exact(count).map_err(|_| {
        PyMemoryError::new_err(format!("no memory for {count} numbers of {} bytes", size_of::<T>()))
    })?;
    Ok(room)
}

/// How far `R^T R` may be from the identity: matrices that came through single precision are accepted.
const ORTHOGONAL: f64 = 1e-5;

/// A proper rotation, shape (3, 3).
pub(crate) fn rotation(value: &Bound<'_, PyAny>, what: &str) -> PyResult<Mat3> {
    let array = floats(value, what)?;
    if *array.shape() != [3, 3] {
        return Err(shape_error(value.py(), what, array.shape(), "(3, 3)"));
    }
    let matrix = Mat3::from_row_slice(&numbers(&array));
    let off = (matrix.transpose() * matrix - Mat3::identity()).norm();
    match off <= ORTHOGONAL && matrix.determinant() > 0.0 {
        true => Ok(matrix),
        false => {
            let determinant = matrix.determinant();
            let text = format!("{what}: no rotation: |R^T R - 1| = {off:.2e}, det R = {determinant:.3}");
            Err(refused(value.py(), "NoRotation", what, text))
        }
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
