//! How well the unknowns are known, as matrices.

use crate::arguments::not_negative;
use crate::arrays::{list, of_matrix, stacked};
use crate::camera::parameter;
use crate::pickled::{Reduced, reduced};
use calibench::calibrate::Covariance as Blocks;
use calibench::camera::Parameter;
use numpy::{PyArray2, PyArray3};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use pythonize::pythonize;

/// How well the unknowns are known, to first order: ``sigma^2 (J^T J)^-1``.
///
/// A pose's six entries are the rotation vector of ``R <- exp(delta) R``, rad, and the translation in the target's unit.
#[pyclass(frozen, eq, skip_from_py_object, module = "calibench")]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Covariance(pub(crate) Blocks);

/// The names of a set of parameters, in order.
pub(crate) fn names<'py>(
    py: Python<'py>,
    free: calibench::camera::FreeParameters,
) -> PyResult<Bound<'py, PyTuple>> {
    PyTuple::new(py, free.iter().map(Parameter::name).collect::<Vec<_>>())
}

/// The standard deviation of every estimated parameter, by name.
pub(crate) fn standard_deviations<'py>(py: Python<'py>, blocks: &Blocks) -> PyResult<Bound<'py, PyDict>> {
    let by_name = PyDict::new(py);
    for parameter in Parameter::OF_ALL_MODELS {
        if let Some(deviation) = blocks.standard_deviation(parameter) {
            by_name.set_item(parameter.name(), deviation)?;
        }
    }
    Ok(by_name)
}

#[pymethods]
impl Covariance {
    /// Names of the rows of `intrinsics`.
    #[getter]
    fn free<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        names(py, self.0.free)
    }

    /// fy over fx where the two are tied; fy then has no row.
    #[getter]
    fn fy_per_fx(&self) -> Option<f64> {
        self.0.fy_per_fx
    }

    /// Covariance of the estimated parameters, shape (n, n).
    #[getter]
    fn intrinsics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        of_matrix(py, &self.0.intrinsics)
    }

    /// Covariance of every pose, shape (V, 6, 6).
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        stacked(py, self.0.poses.len(), (6, 6), |v, i, j| self.0.poses[v][(i, j)])
    }

    /// Covariance of the parameters with every pose, shape (V, n, 6).
    #[getter]
    fn cross<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        stacked(py, self.0.cross.len(), (self.0.free.len(), 6), |v, i, j| self.0.cross[v][(i, j)])
    }

    /// Standard deviation of every estimated parameter by name, in its unit.
    #[getter]
    fn standard_deviations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        standard_deviations(py, &self.0)
    }

    /// Correlation coefficient of two parameters; ``None`` if one was not estimated.
    fn correlation(&self, py: Python<'_>, a: &str, b: &str) -> PyResult<Option<f64>> {
        Ok(self.0.correlation(parameter(py, a)?, parameter(py, b)?))
    }

    /// ``e^T P^-1 e`` of an error of the parameters in `free`: chi-squared with n degrees of freedom if the covariance is right (Bar-Shalom, Li & Kirubarajan 2001). ``None`` if it is singular.
    ///
    /// Raises:
    ///     ArrayError: not one number a parameter.
    fn normalised_error_squared(&self, errors: &Bound<'_, PyAny>) -> PyResult<Option<f64>> {
        let numbers = list(errors, "errors")?;
        let n = self.0.free.len();
        if numbers.len() != n {
            let text = format!("errors: {} numbers for {n} parameters: {}", numbers.len(), self.0.free);
            return Err(crate::errors::numbered(errors.py(), "ArrayError", "Shape", text, |fields| {
                fields.set_item("argument", "errors")?;
                fields.set_item("expected", n)?;
                fields.set_item("got", numbers.len())
            }));
        }
        Ok(self.0.normalised_error_squared(&numbers))
    }

    /// The covariance for noise of `factor` times the variance.
    fn scaled(&self, py: Python<'_>, factor: f64) -> PyResult<Covariance> {
        Ok(Covariance(self.0.clone().scaled(not_negative(py, "factor", factor)?)))
    }

    /// A copy, and what `pickle` keeps: every number.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        reduced(py, "Covariance", pythonize(py, &self.0)?)
    }

    fn __repr__(&self) -> String {
        format!("Covariance(free={:?}, views={})", self.0.free.to_string(), self.0.poses.len())
    }
}
