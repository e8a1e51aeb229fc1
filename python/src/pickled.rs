//! How does a result go to another process, and how is it copied? As Python's own numbers, lists and dicts, which keep every bit.

use crate::calibrate::Calibration;
use crate::camera::Camera;
use crate::covariance::Covariance;
use calibench::io::loss_from_text;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pythonize::depythonize;

/// What `__reduce__` gives: a function, and its arguments.
pub(crate) type Reduced<'py> = (Bound<'py, PyAny>, (&'static str, Bound<'py, PyAny>));

/// An object of the class `class` as its state.
pub(crate) fn reduced<'py>(
    py: Python<'py>,
    class: &'static str,
    state: Bound<'py, PyAny>,
) -> PyResult<Reduced<'py>> {
    Ok((py.import("calibench._native")?.getattr("restored")?, (class, state)))
}

/// What `pickle` and `copy` call: an object of its class and state.
#[pyfunction]
pub(crate) fn restored<'py>(
    py: Python<'py>,
    name: &str,
    state: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    match name {
        "Covariance" => Ok(Covariance(depythonize(state)?).into_pyobject(py)?.into_any()),
        "Calibration" => {
            type State<'py> = (Camera, Bound<'py, PyAny>, Option<(usize, usize)>, String, Option<f64>);
            let (camera, result, image_size, loss, seconds) = state.extract::<State<'py>>()?;
            let loss =
                loss_from_text(&loss).ok_or_else(|| PyValueError::new_err(format!("no loss {loss:?}")))?;
            let restored = Calibration::restored(camera, depythonize(&result)?, image_size, loss, seconds);
            Ok(restored.into_pyobject(py)?.into_any())
        }
        other => Err(PyValueError::new_err(format!("no class {other:?} is restored here"))),
    }
}
