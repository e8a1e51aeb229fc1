//! How does a small result reach Python? As a dataclass of `calibench.records`, made from the data that serde gives of it.

use crate::errors::variant;
use calibench::calibrate::{Calibration, Warning};
use calibench::camera::Lens;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use serde::Serialize;

/// A dataclass with these fields.
pub(crate) fn record<'py>(
    py: Python<'py>,
    class: &str,
    fields: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyAny>> {
    py.import("calibench.records")?.getattr(class)?.call((), Some(fields))
}

/// The fields of a struct of the library.
pub(crate) fn fields<'py>(py: Python<'py>, data: &impl Serialize) -> PyResult<Bound<'py, PyDict>> {
    Ok(pythonize::pythonize(py, data)?.cast_into::<PyDict>()?)
}

/// The dataclass of the same name and fields as a struct of the library.
pub(crate) fn mirrored<'py>(
    py: Python<'py>,
    class: &str,
    data: &impl Serialize,
) -> PyResult<Bound<'py, PyAny>> {
    record(py, class, &fields(py, data)?)
}

/// One dataclass an item.
pub(crate) fn all_mirrored<'py, T: Serialize>(
    py: Python<'py>,
    class: &str,
    items: &[T],
) -> PyResult<Bound<'py, PyTuple>> {
    PyTuple::new(py, items.iter().map(|item| mirrored(py, class, item)).collect::<PyResult<Vec<_>>>()?)
}

/// A warning: its kind, its text and its numbers.
fn warning<'py>(py: Python<'py>, warning: &Warning) -> PyResult<Bound<'py, PyAny>> {
    let (kind, numbers) = variant(&pythonize::pythonize(py, warning)?)?;
    let fields = PyDict::new(py);
    fields.set_item("kind", kind)?;
    fields.set_item("message", warning.to_string())?;
    fields.set_item("numbers", numbers)?;
    record(py, "Warning", &fields)
}

pub(crate) fn warnings<'py>(
    py: Python<'py>,
    calibration: &Calibration<Lens>,
) -> PyResult<Bound<'py, PyTuple>> {
    PyTuple::new(py, calibration.warnings.iter().map(|w| warning(py, w)).collect::<PyResult<Vec<_>>>()?)
}

pub(crate) fn certificate<'py>(
    py: Python<'py>,
    calibration: &Calibration<Lens>,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let of = |certificate: &calibench::calibrate::Certificate| {
        let fields = fields(py, certificate)?;
        fields.set_item("holds", certificate.holds())?;
        record(py, "Certificate", &fields)
    };
    calibration.certificate.as_ref().map(of).transpose()
}

pub(crate) fn conditioning<'py>(
    py: Python<'py>,
    calibration: &Calibration<Lens>,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let of = |conditioning: &calibench::calibrate::Conditioning| {
        let fields = fields(py, conditioning)?;
        fields.set_item("weakest", all_mirrored(py, "WeakComponent", &conditioning.weakest)?)?;
        record(py, "Conditioning", &fields)
    };
    calibration.conditioning.as_ref().map(of).transpose()
}
