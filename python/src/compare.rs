//! Which lens model do the views speak for?

use crate::calibrate::{Calibration, is_shared_out, refuse_marks_outside, views};
use crate::errors;
use crate::records::record;
use crate::settings::settings;
use crate::watch::{detached, needs_threads};
use calibench::calibrate::{Candidate, Compared};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// Compares eight choices of lens model by how they predict views that were left out; the first is the choice, by Schwarz's criterion among those
/// within half a percent of the best.
///
/// Arguments are those of `calibrate`; `model` and `free` are what is compared.
///
/// Raises:
///     CalibrationError: the views determine none of them.
#[pyfunction]
#[pyo3(signature = (points, pixels, *, weights = None, **options))]
pub(crate) fn compare_models<'py>(
    py: Python<'py>,
    points: &Bound<'py, PyAny>,
    pixels: &Bound<'py, PyAny>,
    weights: Option<&Bound<'py, PyAny>>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyTuple>> {
    let settings = settings(py, options)?;
    let views = views(points, pixels, weights)?;
    let (image_size, loss) = (settings.image_size, settings.loss);
    refuse_marks_outside(py, &views, image_size)?;
    if is_shared_out(&views) {
        needs_threads(py)?;
    }
    let compare = move || calibench::calibrate::compare_models(&views, &settings, &Candidate::usual());
    let (compared, refused) = detached(py, true, compare)?;
    if let (true, Some((_, error))) = (compared.is_empty(), refused.first()) {
        return Err(errors::calibration(py, error));
    }
    let of = |compared: Compared| {
        let fields = PyDict::new(py);
        fields.set_item("model", compared.candidate.model.name())?;
        fields.set_item("coefficients", compared.candidate.coefficients.to_string())?;
        fields.set_item("hold_out_px", compared.hold_out_px)?;
        fields.set_item("bic", compared.bic)?;
        fields.set_item("correlation", compared.correlation)?;
        fields.set_item("is_behind", compared.is_behind)?;
        fields.set_item("calibration", Calibration::of(compared.calibration, image_size, loss))?;
        record(py, "ComparedModel", &fields)
    };
    PyTuple::new(py, compared.into_iter().map(of).collect::<PyResult<Vec<_>>>()?)
}
