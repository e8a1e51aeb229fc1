//! What numbers may an argument have? Whole numbers, sizes of images and numbers in a range; an error names the argument.

use crate::errors;
use pyo3::exceptions::{PyOverflowError, PyTypeError};
use pyo3::prelude::*;

/// Pixels of an image that is made here: four times the largest sensor that is sold. A table takes 16 bytes for each of them.
const MOST_PIXELS: usize = 1 << 28;

/// The value of an argument.
///
/// # Errors
/// `SettingsError` for a number that is too large or negative, `TypeError` for what is no such value: each names the argument.
pub(crate) fn value<'a, 'py, T: FromPyObject<'a, 'py>>(
    given: &'a Bound<'py, PyAny>,
    name: &str,
) -> PyResult<T> {
    let py = given.py();
    given.extract::<T>().map_err(|error| {
        let error: PyErr = error.into();
        let shown = given.repr().map_or_else(|_| "?".to_string(), |repr| repr.to_string());
        match error.is_instance_of::<PyOverflowError>(py) {
            true => errors::numbered(
                py,
                "SettingsError",
                "OutOfRange",
                format!("{name} = {shown} is out of range: {}", error.value(py)),
                |numbers| numbers.set_item("argument", name),
            ),
            false => PyTypeError::new_err(format!("{name} = {shown}: {}", error.value(py))),
        }
    })
}

/// Width and height of an image, each of at least a pixel.
pub(crate) fn image_size(given: &Bound<'_, PyAny>, name: &str) -> PyResult<(usize, usize)> {
    let (width, height) = value(given, name)?;
    match width > 0 && height > 0 {
        true => Ok((width, height)),
        false => Err(size_error(given.py(), name, "EmptyImage", (width, height), "an image has pixels")),
    }
}

/// Width and height of an image that is to be made.
pub(crate) fn size_to_make(given: &Bound<'_, PyAny>, name: &str) -> PyResult<(usize, usize)> {
    let (width, height) = image_size(given, name)?;
    match width.checked_mul(height).is_some_and(|pixels| pixels <= MOST_PIXELS) {
        true => Ok((width, height)),
        false => {
            let limit = format!("an image that is made here has at most {MOST_PIXELS} pixels");
            Err(size_error(given.py(), name, "TooManyPixels", (width, height), &limit))
        }
    }
}

fn size_error(
    py: Python<'_>,
    name: &str,
    kind: &str,
    (width, height): (usize, usize),
    wanted: &str,
) -> PyErr {
    let text = format!("{name} = ({width}, {height}): {wanted}");
    errors::numbered(py, "SettingsError", kind, text, |numbers| {
        numbers.set_item("width", width)?;
        numbers.set_item("height", height)?;
        numbers.set_item("most_pixels", MOST_PIXELS)
    })
}

/// A finite number.
pub(crate) fn finite(py: Python<'_>, name: &str, value: f64) -> PyResult<f64> {
    match value.is_finite() {
        true => Ok(value),
        false => Err(errors::argument(py, name, value, "expected a finite number")),
    }
}

/// A finite number above 0.
pub(crate) fn positive(py: Python<'_>, name: &str, value: f64) -> PyResult<f64> {
    match value > 0.0 && value.is_finite() {
        true => Ok(value),
        false => Err(errors::argument(py, name, value, "expected a finite number above 0")),
    }
}

/// A finite number, not below 0.
pub(crate) fn not_negative(py: Python<'_>, name: &str, value: f64) -> PyResult<f64> {
    match value >= 0.0 && value.is_finite() {
        true => Ok(value),
        false => Err(errors::argument(py, name, value, "expected a finite number that is not negative")),
    }
}
