//! How does a refusal of the library reach Python? As an exception of `calibench.errors` with the kind of the refusal and its numbers.

use calibench::board::{BoardError, ViewError};
use calibench::calibrate::CalibrationError;
use calibench::camera::UndistortError;
use calibench::detect::{ChessboardError, GridError};
use calibench::evaluate::BoundError;
use calibench::io::formats::FormatError;
use calibench::photos::{BoardSpecError, DetectError, NotFound};
use calibench::rectify::{OutputCameraError, RectifyError};
use calibench::synth::SceneError;
use calibench::synth::render::RenderError;
use calibench_study::SpecError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::error::Error;
use std::fmt::Display;

/// Options of the command line in the library's advice, and what they are here.
const OPTIONS: [(&str, &str); 7] = [
    ("--fix k3=0", "hold={\"k3\": 0.0}"),
    ("--image-size WxH", "image_size=(width, height)"),
    ("--fit", "fit=True"),
    ("--camera", "camera="),
    ("--from", "format="),
    ("--to", "format="),
    (": see --memory", ""),
];

/// The text of an error, with its causes, in the words of Python.
fn message(error: &(dyn Error + 'static)) -> String {
    OPTIONS.iter().fold(calibench::io::message(error), |text, (option, here)| text.replace(option, here))
}

/// An exception of the class `class`: its text, kind and numbers.
pub(crate) fn exception(
    py: Python<'_>,
    class: &str,
    text: String,
    kind: &str,
    numbers: Bound<'_, PyAny>,
) -> PyErr {
    let raised =
        py.import("calibench.errors").and_then(|errors| errors.getattr(class)?.call1((text, kind, numbers)));
    raised.map_or_else(|error| error, PyErr::from_value)
}

/// An exception whose numbers are filled in by `fill`.
pub(crate) fn numbered<'py>(
    py: Python<'py>,
    class: &str,
    kind: &str,
    text: String,
    fill: impl FnOnce(&Bound<'py, PyDict>) -> PyResult<()>,
) -> PyErr {
    let numbers = PyDict::new(py);
    match fill(&numbers) {
        Ok(()) => exception(py, class, text, kind, numbers.into_any()),
        Err(error) => error,
    }
}

/// An argument that cannot be: what it is, and what is wanted.
pub(crate) fn argument<'py>(
    py: Python<'py>,
    name: &str,
    value: impl IntoPyObject<'py> + Display + Copy,
    wanted: &str,
) -> PyErr {
    let text = format!("{name} = {value}: {wanted}");
    numbered(py, "SettingsError", "Argument", text, |numbers| {
        numbers.set_item("argument", name)?;
        numbers.set_item("value", value)
    })
}

/// A refusal that carries no numbers beside its text.
pub(crate) fn plain(py: Python<'_>, class: &str, kind: &str, error: &(dyn Error + 'static)) -> PyErr {
    exception(py, class, message(error), kind, PyDict::new(py).into_any())
}

/// Kind and fields of a value of an enum, by name; of a variant that is not listed the kind `other`.
macro_rules! exception_of {
    ($py:expr, $class:literal, $error:expr; $($enum:ident :: $variant:ident { $($field:ident),* })*) => {{
        let numbers = PyDict::new($py);
        let kind = match $error {
            $($enum::$variant { $($field,)* .. } => {
                $(if let Err(error) = numbers.set_item(stringify!($field), $field) { return error; })*
                stringify!($variant)
            })*
            #[allow(unreachable_patterns, reason = "an enum of the library may gain a variant")]
            _ => "other",
        };
        exception($py, $class, message($error), kind, numbers.into_any())
    }};
}

/// Data of serde that are one variant of an enum: its name and its fields.
pub(crate) fn variant<'py>(data: &Bound<'py, PyAny>) -> PyResult<(String, Bound<'py, PyAny>)> {
    let py = data.py();
    match data.cast::<PyDict>().ok().and_then(|fields| fields.iter().next()) {
        Some((kind, fields)) => Ok((kind.extract()?, fields)),
        None => Ok((data.extract()?, PyDict::new(py).into_any())),
    }
}

pub(crate) fn calibration(py: Python<'_>, error: &CalibrationError) -> PyErr {
    let data = pythonize::pythonize(py, error).map_err(PyErr::from).and_then(|data| variant(&data));
    match data {
        Ok((kind, numbers)) => exception(py, "CalibrationError", message(error), &kind, numbers),
        Err(error) => error,
    }
}

pub(crate) fn view(py: Python<'_>, view: usize, error: &ViewError) -> PyErr {
    let py_error = exception_of!(py, "ViewError", error;
        ViewError::Lengths { points, pixels }
        ViewError::NotFinite { index, x, y, u, v }
        ViewError::Weights { marks, weights }
        ViewError::BadWeight { index, weight });
    with_number(py, py_error, "view", view)
}

/// Adds a number that the error itself does not know.
fn with_number(py: Python<'_>, error: PyErr, name: &str, value: usize) -> PyErr {
    let added = error.value(py).getattr("numbers").and_then(|numbers| numbers.set_item(name, value));
    added.map_or_else(|other| other, |()| error)
}

pub(crate) fn undistort(py: Python<'_>, index: usize, error: &UndistortError) -> PyErr {
    let py_error = exception_of!(py, "UndistortError", error;
        UndistortError::OutsideMonotoneRadius { x, y, radius, limit }
        UndistortError::NotFinite { x, y });
    with_number(py, py_error, "index", index)
}

pub(crate) fn scene(py: Python<'_>, error: &SceneError) -> PyErr {
    exception_of!(py, "SceneError", error;
        SceneError::BehindCamera { view, point }
        SceneError::BeyondMonotoneRadius { view, point })
}

pub(crate) fn render(py: Python<'_>, error: &RenderError) -> PyErr {
    exception_of!(py, "SceneError", error;
        RenderError::BehindCamera { x, y }
        RenderError::TooNear { x, y }
        RenderError::BeyondMonotoneRadius { x, y, radius, limit }
        RenderError::BeyondMonotoneAngle { x, y, angle_deg, limit_deg }
        RenderError::Setting { name, value, need })
}

pub(crate) fn bound(py: Python<'_>, error: &BoundError) -> PyErr {
    let numbers = PyDict::new(py);
    let kind = match error {
        BoundError::Singular { free, views } => {
            let filled = numbers.set_item("free", free).and_then(|()| numbers.set_item("views", views));
            if let Err(error) = filled {
                return error;
            }
            "Singular"
        }
        _ => "BehindCamera",
    };
    exception(py, "BoundError", message(error), kind, numbers.into_any())
}

pub(crate) fn board(py: Python<'_>, error: &BoardSpecError) -> PyErr {
    match error {
        BoardSpecError::Board(error) => exception_of!(py, "BoardError", error;
            BoardError::TooSmall { columns, rows }
            BoardError::TooLarge { columns, rows, most }
            BoardError::Geometry { spacing, diameter }),
        BoardSpecError::CornerDiameter { .. } => exception_of!(py, "BoardError", error;
            BoardSpecError::CornerDiameter { columns, rows }),
        other => plain(py, "BoardError", "Form", other),
    }
}

pub(crate) fn not_found(py: Python<'_>, error: &NotFound) -> PyErr {
    match &error.reason {
        DetectError::Grid(error) => exception_of!(py, "DetectError", error;
            GridError::TooFewForGrid { columns, rows, found, need }
            GridError::TooSmall { columns, rows }
            GridError::Partial { columns, rows, found, expected, seen }
            GridError::WrongSize { columns, rows, found_columns, found_rows }
            GridError::NotRectangular { columns, rows, found }
            GridError::Staggered { columns, rows, found_columns, found_rows }
            GridError::InLine { columns, rows, found_columns, found_rows }
            GridError::Mirrored { columns, rows, found_columns, found_rows }
            GridError::TooFewStaggered { columns, rows, need_columns, need_rows }
            GridError::Irregular { column, row, deviation, limit }),
        DetectError::Chessboard(error) => exception_of!(py, "DetectError", error;
            ChessboardError::TooSmall { columns, rows }
            ChessboardError::WrongSize { columns, rows, found_columns, found_rows }
            ChessboardError::Partial { columns, rows, found, expected, seen }
            ChessboardError::Unclear { columns, rows }
            ChessboardError::NotRectangular { columns, rows, found }),
        other => plain(py, "DetectError", "other", other),
    }
}

pub(crate) fn rectify(py: Python<'_>, error: &RectifyError) -> PyErr {
    exception_of!(py, "RectifyError", error;
        RectifyError::Size { width, height }
        RectifyError::OtherSize { expected_width, expected_height, width, height })
}

pub(crate) fn output_camera(py: Python<'_>, error: &OutputCameraError) -> PyErr {
    exception_of!(py, "RectifyError", error;
        OutputCameraError::Border { u, v }
        OutputCameraError::NothingValid { width, height })
}

pub(crate) fn study(py: Python<'_>, error: &SpecError) -> PyErr {
    exception_of!(py, "StudyError", error;
        SpecError::Toml { line, column }
        SpecError::Value { field, value }
        SpecError::TooMuch { needed, limit, what }
        SpecError::Factor { line, column, factor }
        SpecError::SetTwice { field, before, by }
        SpecError::Precision { quantity, cell, known })
}

pub(crate) fn format(py: Python<'_>, error: &FormatError) -> PyErr {
    exception_of!(py, "FormatError", error;
        FormatError::Syntax { file, line, column }
        FormatError::Missing { file, line, what }
        FormatError::Value { file, line, column, what }
        FormatError::Lens { file, model, help }
        FormatError::Several { file, names }
        FormatError::NoSuchCamera { file, name, names }
        FormatError::NoCamera { file }
        FormatError::Unknown { file, names }
        FormatError::CannotHold { format, what, help })
}
