//! How far is an estimate from the truth, and how far should it be?

use crate::arguments;
use crate::camera::Camera;
use crate::covariance::Covariance;
use crate::errors;
use crate::records::record;
use crate::settings::free_parameters;
use crate::synth::Scene;
use crate::watch::detached;
use calibench::evaluate::RmseDistribution as Distribution;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The Cramer-Rao bound of a scene: the covariance that no unbiased calibrator can be below (Rao 1945; Cramer 1946).
///
/// Args:
///     sigma_px: standard deviation of the noise on each of u and v, px.
///     free: parameters to estimate; fx, fy, cx, cy, k1, k2 if not given.
///
/// Raises:
///     BoundError: the scene does not determine them.
///     SettingsError: a standard deviation that is not positive.
#[pyfunction]
#[pyo3(signature = (scene, sigma_px, *, free = None))]
pub(crate) fn cramer_rao(
    py: Python<'_>,
    scene: &Scene,
    sigma_px: f64,
    free: Option<&Bound<'_, PyAny>>,
) -> PyResult<Covariance> {
    let sigma_px = arguments::positive(py, "sigma_px", sigma_px)?;
    let free = free.map_or(Ok(calibench::camera::FreeParameters::STANDARD), free_parameters)?;
    let truth = scene.0.truth.clone();
    let bound = detached(py, false, move || calibench::evaluate::cramer_rao(&truth, free, sigma_px))?;
    bound.map(Covariance).map_err(|e| errors::bound(py, &e))
}

/// A camera with the lens that scenes have.
pub(crate) fn brown_conrady(camera: &Camera, what: &str) -> PyResult<calibench::camera::Camera> {
    let other = || PyValueError::new_err(format!("{what}: only the lens model brown-conrady will do here"));
    camera.0.brown_conrady().ok_or_else(other)
}

/// An estimate against the truth under a predicted covariance, such as the Cramer-Rao bound.
#[pyfunction]
#[pyo3(signature = (truth, estimate, covariance))]
pub(crate) fn errors_of<'py>(
    py: Python<'py>,
    truth: &Camera,
    estimate: &Camera,
    covariance: &Covariance,
) -> PyResult<Bound<'py, PyAny>> {
    let (truth, estimate) = (brown_conrady(truth, "truth")?, brown_conrady(estimate, "estimate")?);
    let singular = || PyValueError::new_err("the covariance is singular");
    let errors = calibench::evaluate::errors_of(&truth, &estimate, &covariance.0).ok_or_else(singular)?;
    let by_name = |value: fn(&calibench::evaluate::errors::Item) -> f64| -> PyResult<Bound<'py, PyDict>> {
        let values = PyDict::new(py);
        errors.items.iter().try_for_each(|item| values.set_item(item.parameter.name(), value(item)))?;
        Ok(values)
    };
    let fields = PyDict::new(py);
    fields.set_item("error", by_name(|item| item.error)?)?;
    fields.set_item("standard_deviation", by_name(|item| item.standard_deviation)?)?;
    fields.set_item("z", by_name(|item| item.z)?)?;
    fields.set_item("chi_squared", errors.chi_squared)?;
    fields.set_item("p_value", errors.p_value)?;
    record(py, "Errors", &fields)
}

/// How large the RMSE should be where the model is right and the noise Gaussian: ``RMSE = sigma sqrt(X / N)``, X chi-squared with ``2 N - p`` degrees of
/// freedom.
///
/// Args:
///     sigma_px: standard deviation of the noise on each of u and v, px.
///     points: number of points N.
///     parameters: number of fitted parameters p, six a pose included.
#[pyclass(frozen, eq, skip_from_py_object, module = "calibench")]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RmseDistribution(Distribution);

#[pymethods]
impl RmseDistribution {
    #[new]
    fn new(
        py: Python<'_>,
        sigma_px: f64,
        points: &Bound<'_, PyAny>,
        parameters: &Bound<'_, PyAny>,
    ) -> PyResult<RmseDistribution> {
        let sigma_px = arguments::positive(py, "sigma_px", sigma_px)?;
        let points: usize = arguments::value(points, "points")?;
        let parameters: usize = arguments::value(parameters, "parameters")?;
        // Beyond 2^52 a number of points is no longer exact in double precision.
        if !(1..=1 << 52).contains(&points) {
            return Err(errors::argument(py, "points", points, "expected 1 to 2^52 points"));
        }
        if parameters >= 2 * points {
            let wanted = format!(
                "{points} points have {} coordinates, and more than the parameters are needed",
                2 * points
            );
            return Err(errors::argument(py, "parameters", parameters, &wanted));
        }
        Ok(RmseDistribution(Distribution { sigma_px, points, parameters }))
    }

    /// A copy, and what `pickle` keeps: the arguments.
    fn __getnewargs__(&self) -> (f64, usize, usize) {
        (self.0.sigma_px, self.0.points, self.0.parameters)
    }

    /// ``sqrt(2) sigma``, px: what perfect knowledge of the camera would leave.
    #[getter]
    fn noise_floor_px(&self) -> f64 {
        self.0.noise_floor_px()
    }

    /// Expected RMSE, px.
    #[getter]
    fn mean_px(&self) -> f64 {
        self.0.mean_px()
    }

    /// Its standard deviation, px.
    #[getter]
    fn standard_deviation_px(&self) -> f64 {
        self.0.standard_deviation_px()
    }

    /// ``P(RMSE <= rmse_px)``.
    fn cdf(&self, py: Python<'_>, rmse_px: f64) -> PyResult<f64> {
        Ok(self.0.cdf(arguments::not_negative(py, "rmse_px", rmse_px)?))
    }

    /// Two-sided probability of an RMSE as far from the middle.
    fn p_value(&self, py: Python<'_>, rmse_px: f64) -> PyResult<f64> {
        Ok(self.0.p_value(arguments::not_negative(py, "rmse_px", rmse_px)?))
    }
}
