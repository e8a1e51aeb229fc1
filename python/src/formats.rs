//! Cameras and corners in files, of this program and of others.

use crate::arrays::{of_matrix, of_plane, of_rotations};
use crate::calibrate::{Calibration, views};
use crate::camera::Camera;
use crate::covariance::names;
use crate::errors;
use crate::records::record;
use calibench::io::formats::{
    self, CameraFile, Estimated, Format, FormatError, MOST_BYTES, Wishes, corner_text, detect,
    format_of_name, format_to_write, read_camera_file, write_camera_file,
};
use calibench::io::{CornerFile, doubts, read_regular_text, write_atomically};
use numpy::PyArray1;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::path::PathBuf;

/// The formats of cameras.
#[pyfunction]
pub(crate) fn format_names() -> Vec<&'static str> {
    formats::format_names()
}

fn named(name: &str) -> PyResult<&'static Format> {
    let known = || formats::format_names().join(", ");
    format_of_name(name)
        .ok_or_else(|| PyValueError::new_err(format!("no format {name:?}; there are: {}", known())))
}

fn wishes(fit: bool, pixel_height_m: Option<f64>, first_pixel: Option<f64>) -> Wishes {
    let usual = Wishes::default();
    Wishes { fit, first_pixel, pixel_height_m: pixel_height_m.unwrap_or(usual.pixel_height_m) }
}

/// Reads a camera from a file of this program or of another.
///
/// Args:
///     format: one of `format_names`; by the file's contents and ending if not given.
///     camera: name of the camera in a file of several.
///     pixel_height_m: height of a pixel, m, for HALCON.
///     first_pixel: both coordinates of the first pixel's centre in the file, where its program did not keep to the format's.
///
/// Raises:
///     FormatError: with file, line and column.
#[pyfunction]
#[pyo3(signature = (path, *, format = None, camera = None, pixel_height_m = None, first_pixel = None))]
pub(crate) fn read_camera<'py>(
    py: Python<'py>,
    path: PathBuf,
    format: Option<&str>,
    camera: Option<&str>,
    pixel_height_m: Option<f64>,
    first_pixel: Option<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let refused = |e: FormatError| errors::format(py, &e);
    let file = path.display().to_string();
    let text = read_regular_text(&path, MOST_BYTES).map_err(|e| refused(e.into()))?;
    let format = format.map_or_else(|| detect(&file, &text).map_err(refused), named)?;
    let wishes = wishes(false, pixel_height_m, first_pixel);
    let read = read_camera_file(format, &file, &text, camera, &wishes).map_err(refused)?;
    camera_file(py, format.name, &read)
}

fn camera_file<'py>(py: Python<'py>, format: &str, read: &CameraFile) -> PyResult<Bound<'py, PyAny>> {
    let fields = PyDict::new(py);
    fields.set_item("camera", Camera(read.camera))?;
    fields.set_item("format", format)?;
    fields.set_item("image_size", read.image_size)?;
    fields.set_item("name", &read.name)?;
    let notes: Vec<&String> = read.notes.iter().chain(&read.assumed).collect();
    fields.set_item("notes", PyTuple::new(py, notes)?)?;
    if let Some(estimated) = &read.estimated {
        fields.set_item("free", names(py, estimated.free)?)?;
        fields.set_item("covariance", of_matrix(py, &estimated.covariance)?)?;
        fields.set_item("degrees_of_freedom", estimated.degrees_of_freedom)?;
    }
    if let Some(pose) = &read.cam_from_reference {
        let rotation = of_rotations(py, std::slice::from_ref(pose))?.get_item(0)?;
        fields.set_item("rotation", rotation)?;
        fields.set_item("translation", PyArray1::from_slice(py, pose.translation.as_slice()))?;
    }
    record(py, "CameraFile", &fields)
}

/// What is written of a calibration, or of a camera of which nothing more is known.
fn contents(
    camera: &Bound<'_, PyAny>,
    image_size: Option<(usize, usize)>,
    name: Option<String>,
) -> PyResult<CameraFile> {
    if let Ok(calibration) = camera.cast::<Calibration>() {
        let result = &calibration.get().result;
        let estimated = Estimated {
            free: result.free,
            fy_per_fx: result.covariance.fy_per_fx,
            covariance: result.covariance.intrinsics.clone(),
            degrees_of_freedom: Some(result.degrees_of_freedom),
            doubts: doubts(result.warnings.iter().map(ToString::to_string).collect()),
        };
        let file = CameraFile::of(result.camera);
        let image_size = image_size.or(calibration.get().size());
        return Ok(CameraFile { image_size, name, estimated: Some(estimated), ..file });
    }
    let camera: Camera = camera.extract()?;
    Ok(CameraFile { image_size, name, ..CameraFile::of(camera.0) })
}

/// Writes a camera, or a calibration with its covariance, whole or not at all; says what was converted and what is lost.
///
/// Raises:
///     FormatError: the format cannot hold the camera.
#[pyfunction]
#[pyo3(signature = (path, camera, *, format = None, image_size = None, name = None, fit = false, pixel_height_m = None))]
#[allow(clippy::too_many_arguments, reason = "keywords of Python")]
pub(crate) fn write_camera<'py>(
    py: Python<'py>,
    path: PathBuf,
    camera: &Bound<'py, PyAny>,
    format: Option<&str>,
    image_size: Option<(usize, usize)>,
    name: Option<String>,
    fit: bool,
    pixel_height_m: Option<f64>,
) -> PyResult<Bound<'py, PyAny>> {
    let refused = |e: FormatError| errors::format(py, &e);
    let format =
        format.map_or_else(|| format_to_write(&path.display().to_string()).map_err(refused), named)?;
    let file = contents(camera, image_size, name)?;
    let written = write_camera_file(format, &file, &wishes(fit, pixel_height_m, None)).map_err(refused)?;
    write_atomically(&path, written.text.as_bytes()).map_err(|e| PyOSError::new_err(e.to_string()))?;
    let fields = PyDict::new(py);
    fields.set_item("format", format.name)?;
    fields.set_item("converted", PyTuple::new(py, &written.converted)?)?;
    fields.set_item("lost", PyTuple::new(py, &written.lost)?)?;
    record(py, "Written", &fields)
}

/// Reads a corner file (``view,point,X,Y,u,v`` and perhaps ``weight`` or ``sigma_px``): `Corners` by the view's name.
///
/// Raises:
///     FormatError: with file and line in its text.
#[pyfunction]
pub(crate) fn read_corners<'py>(py: Python<'py>, path: PathBuf) -> PyResult<Bound<'py, PyDict>> {
    let corners = calibench::io::read_corners(&path).map_err(|e| errors::format(py, &e.into()))?;
    let by_name = PyDict::new(py);
    for (name, view) in corners.view_names.iter().zip(&corners.views) {
        let fields = PyDict::new(py);
        fields.set_item("points", of_plane(py, view.points())?)?;
        fields.set_item("pixels", of_plane(py, view.pixels())?)?;
        fields.set_item("weights", view.weights().map(|weights| PyArray1::from_slice(py, weights)))?;
        by_name.set_item(name, record(py, "Corners", &fields)?)?;
    }
    Ok(by_name)
}

/// Writes a corner file. Shapes are those of `calibrate`.
#[pyfunction]
#[pyo3(signature = (path, points, pixels, *, view_names = None))]
pub(crate) fn write_corners(
    path: PathBuf,
    points: &Bound<'_, PyAny>,
    pixels: &Bound<'_, PyAny>,
    view_names: Option<Vec<String>>,
) -> PyResult<()> {
    let views = views(points, pixels, None)?;
    let view_names = view_names.unwrap_or_else(|| (0..views.len()).map(|view| view.to_string()).collect());
    if view_names.len() != views.len() {
        return Err(PyValueError::new_err(format!("{} names for {} views", view_names.len(), views.len())));
    }
    let text = corner_text(&CornerFile { view_names, views });
    write_atomically(&path, text.as_bytes()).map_err(|e| PyOSError::new_err(e.to_string()))
}
