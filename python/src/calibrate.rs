//! From arrays of points and pixels to a camera, and all that is known of it.

use crate::arrays::{
    is_shared, list, of_plane, of_rotations, of_space, of_translations, plane_points, refuse_masked,
    views_of_points,
};
use crate::board::Board;
use crate::camera::Camera;
use crate::covariance::{Covariance, names, standard_deviations};
use crate::errors;
use crate::pickled::{Reduced, reduced};
use crate::records::{all_mirrored, certificate, conditioning, mirrored, record, warnings};
use crate::settings::settings;
use crate::watch::{detached, needs_threads};
use calibench::board::View;
use calibench::calibrate::{LensCalibration, Loss, Settings, calibrate_lens};
use calibench::geometry::{Vec2, Vec3, rotation};
use calibench::io::{CalibrationFields, loss_to_text};
use calibench::photos::Fitter;
use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use pythonize::pythonize;
use std::time::Instant;

/// Calibrations of more views or marks than this may take longer than a person waits before pressing Ctrl-C; fewer take about a
/// millisecond, hard ones some fifty.
const MANY_VIEWS: usize = 64;
const MANY_MARKS: usize = 5000;

/// A calibrated camera, how sure it is, how it fits, and what to be careful about.
#[pyclass(frozen, eq, skip_from_py_object, module = "calibench")]
#[derive(Debug, Clone)]
pub(crate) struct Calibration {
    pub(crate) result: LensCalibration,
    image_size: Option<(usize, usize)>,
    /// By which residuals counted.
    loss: Loss,
    /// Time that the estimator took, where it alone was called.
    solver_seconds: Option<f64>,
}

/// Equal numbers, whatever time they took.
impl PartialEq for Calibration {
    fn eq(&self, other: &Calibration) -> bool {
        (&self.result, self.image_size, self.loss) == (&other.result, other.image_size, other.loss)
    }
}

/// The views of arrays.
pub(crate) fn views(
    points: &Bound<'_, PyAny>,
    pixels: &Bound<'_, PyAny>,
    weights: Option<&Bound<'_, PyAny>>,
) -> PyResult<Vec<View>> {
    let py = points.py();
    let pixels = views_of_points(pixels, "pixels")?;
    let points = match is_shared(points)? {
        true => vec![plane_points(points, "points")?; pixels.len()],
        false => views_of_points(points, "points")?,
    };
    if points.len() != pixels.len() {
        let (p, v) = (points.len(), pixels.len());
        let text = format!("points of {p} views, pixels of {v}: give one array a view, or one for all views");
        return Err(errors::numbered(py, "ViewError", "Views", text, |numbers| {
            numbers.set_item("points", p)?;
            numbers.set_item("pixels", v)
        }));
    }
    let view = |(index, (points, pixels))| View::new(points, pixels).map_err(|e| errors::view(py, index, &e));
    let views: Vec<View> = points.into_iter().zip(pixels).enumerate().map(view).collect::<PyResult<_>>()?;
    match weights {
        Some(weights) => weighted(views, weights),
        None => Ok(views),
    }
}

fn weighted(views: Vec<View>, weights: &Bound<'_, PyAny>) -> PyResult<Vec<View>> {
    let py = weights.py();
    refuse_masked(weights, "weights")?;
    let of_view =
        |(i, weights): (usize, PyResult<Bound<'_, PyAny>>)| list(&weights?, &format!("weights[{i}]"));
    let given: Vec<Vec<f64>> = weights.try_iter()?.enumerate().map(of_view).collect::<PyResult<_>>()?;
    if given.len() != views.len() {
        let (w, v) = (given.len(), views.len());
        let text = format!("weights of {w} views, pixels of {v}");
        return Err(errors::numbered(py, "ViewError", "Views", text, |numbers| {
            numbers.set_item("weights", w)?;
            numbers.set_item("pixels", v)
        }));
    }
    let with = |(index, (view, weights)): (usize, (View, Vec<f64>))| {
        view.with_weights(weights).map_err(|e| errors::view(py, index, &e))
    };
    views.into_iter().zip(given).enumerate().map(with).collect()
}

/// A mark may lie this part of the image's longer side beyond the centres of the outermost pixels, one pixel at least: as on the command line.
const BEYOND: f64 = 0.02;

/// Whether a mark lies in an image, or as little outside as noise puts it.
fn is_within(pixel: &Vec2, (width, height): (usize, usize)) -> bool {
    let beyond = (BEYOND * width.max(height) as f64).max(1.0);
    let on_side = |at: f64, length: usize| (-beyond..=length as f64 - 1.0 + beyond).contains(&at);
    on_side(pixel.x, width) && on_side(pixel.y, height)
}

/// Refuses marks of another image: where most lie outside of it, or where all lie inside when its sides are swapped. Single ones may come from
/// a made-up scene.
pub(crate) fn refuse_marks_outside(
    py: Python<'_>,
    views: &[View],
    image_size: Option<(usize, usize)>,
) -> PyResult<()> {
    let Some((width, height)) = image_size else { return Ok(()) };
    let marks = || views.iter().enumerate().flat_map(|(v, view)| view.pixels().iter().map(move |p| (v, p)));
    let outside = || marks().filter(|(_, pixel)| !is_within(pixel, (width, height)));
    let Some((view, pixel)) = outside().next() else { return Ok(()) };
    let (all, count) = (marks().count(), outside().count());
    let is_swapped = marks().all(|(_, pixel)| is_within(pixel, (height, width)));
    if !is_swapped && 2 * count <= all {
        return Ok(());
    }
    let help =
        if is_swapped { "were the sides of image_size swapped?" } else { "check image_size and pixels" };
    let text = format!(
        "{count} of {all} marks lie outside of the image of {width} x {height} px, the first, of view {view}, at ({}, {}): {help}",
        pixel.x, pixel.y
    );
    Err(errors::numbered(py, "ViewError", "OutsideImage", text, |numbers| {
        numbers.set_item("view", view)?;
        numbers.set_item("marks", all)?;
        numbers.set_item("outside", count)?;
        numbers.set_item("u", pixel.x)?;
        numbers.set_item("v", pixel.y)
    }))
}

/// Whether the work is shared among the library's threads.
pub(crate) fn is_shared_out(views: &[View]) -> bool {
    views.len() >= MANY_VIEWS
}

/// Whether Ctrl-C should be heard meanwhile.
pub(crate) fn is_long(views: &[View], settings: &Settings) -> bool {
    let marks: usize = views.iter().map(View::len).sum();
    views.len() >= MANY_VIEWS || marks > MANY_MARKS || settings.polish || settings.profile_coverage.is_some()
}

/// Calibrates a camera from points of a planar target and the pixels at which they were seen.
///
/// Zhang's method (2000) with maximum-likelihood refinement; a minimum is certified against free homographies behind the same lens, and the search
/// goes on where that fails.
///
/// Args:
///     points: (N, 2), the same for all views, or one such array a view; Z = 0, in any unit. A third column must be 0.
///     pixels: (V, N, 2), or one array (N, 2) a view.
///     weights: one array (N,) a view: factors of the residuals, 1 over the standard deviation.
///     model: the lens model, see `Camera`. Outside of brown-conrady nothing certifies the minimum.
///     free: names of the parameters to estimate; those that most lenses of the model need if not given.
///     image_size: width and height, px: needed where cx and cy are held and not given.
///     hold: values of parameters that are held.
///     tie: fy over fx, 1 for square pixels.
///     priors: ``name: (mean, standard deviation)``, one more measurement that counts in the covariance.
///     loss: ``squares``, ``huber:PX`` or ``cauchy:PX``.
///     board_shape: ``flat``, ``bow:SD`` (two bows, known beforehand to be 0 within SD) or ``bent:SD`` (a twist besides); ``free`` for SD.
///     start: a camera to start from.
///     intervals: coverage of profile intervals, such as 0.95.
///     max_iterations: of the refinement.
///     polish: follows the minimum to its last digits, for comparisons.
///     search: ``False`` takes the first minimum, whatever it is.
///
/// Raises:
///     CalibrationError: the data determine no camera; `kind` and `numbers` say why.
///     ArrayError: what is no array of points: another shape, complex, masked.
///     ViewError: points and pixels that do not pair up, are not finite, or lie outside of the image for the most part.
///     SettingsError: an option that cannot be.
#[pyfunction]
#[pyo3(signature = (points, pixels, *, weights = None, **options))]
pub(crate) fn calibrate(
    py: Python<'_>,
    points: &Bound<'_, PyAny>,
    pixels: &Bound<'_, PyAny>,
    weights: Option<&Bound<'_, PyAny>>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Calibration> {
    let settings = settings(py, options)?;
    let views = views(points, pixels, weights)?;
    let (image_size, loss, long) = (settings.image_size, settings.loss, is_long(&views, &settings));
    refuse_marks_outside(py, &views, image_size)?;
    if is_shared_out(&views) {
        needs_threads(py)?;
    }
    let (result, took) = detached(py, long, move || {
        let started = Instant::now();
        (calibrate_lens(&views, &settings), started.elapsed())
    })?;
    let result = result.map_err(|e| errors::calibration(py, &e))?;
    Ok(Calibration { result, image_size, loss, solver_seconds: Some(took.as_secs_f64()) })
}

/// Calibrates from marks that `Board.detect` found: imaged discs are corrected for their bias once the camera is known (Heikkila 2000), and stray
/// views are left out.
///
/// Args:
///     board: the board that was photographed.
///     pixels: (V, N, 2), or one array (N, 2) a view, in the board's order.
///     reject_views: leaves out views whose RMSE is more than this many times the median, worst first.
///     options: those of `calibrate`.
#[pyfunction]
#[pyo3(signature = (board, pixels, *, reject_views = None, **options))]
pub(crate) fn fit_views<'py>(
    py: Python<'py>,
    board: &Bound<'py, Board>,
    pixels: &Bound<'py, PyAny>,
    reject_views: Option<f64>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let settings = settings(py, options)?;
    let spec = board.get().0.clone();
    let points = spec.board().points();
    let view = |(index, pixels)| View::new(points.clone(), pixels).map_err(|e| errors::view(py, index, &e));
    let views: Vec<View> =
        views_of_points(pixels, "pixels")?.into_iter().enumerate().map(view).collect::<PyResult<_>>()?;
    let (image_size, loss) = (settings.image_size, settings.loss);
    refuse_marks_outside(py, &views, image_size)?;
    if is_shared_out(&views) {
        needs_threads(py)?;
    }
    let fit = detached(py, true, move || {
        let discs = spec.diameter_known.then(|| spec.board());
        Fitter { settings: &settings, discs, reject_factor: reject_views }.fit(&views)
    })?;
    let fit = fit.map_err(|e| errors::calibration(py, &e))?;
    let fields = PyDict::new(py);
    fields.set_item("kept", PyTuple::new(py, &fit.kept)?)?;
    let left_out: Vec<(usize, &str)> = fit.rejected.iter().map(|r| (r.view, r.reason.as_str())).collect();
    fields.set_item("left_out", PyTuple::new(py, left_out)?)?;
    let corrected = fit.views.iter().map(|view| of_plane(py, view.pixels())).collect::<PyResult<Vec<_>>>()?;
    fields.set_item("pixels", PyTuple::new(py, corrected)?)?;
    fields.set_item("largest_bias_px", fit.bias.map(|bias| bias.largest_px))?;
    fields.set_item("calibration", Calibration::of(fit.calibration, image_size, loss))?;
    record(py, "Fit", &fields)
}

/// Where a flat board stands before a known camera: the pose of least squared pixel distance, the better of its two tilts; ``None`` with fewer
/// than four marks, or where the camera cannot see them.
///
/// Args:
///     points: (N, 2) on the board.
///     pixels: (N, 2), px.
#[pyfunction]
#[pyo3(signature = (camera, points, pixels))]
pub(crate) fn locate<'py>(
    py: Python<'py>,
    camera: &Camera,
    points: &Bound<'py, PyAny>,
    pixels: &Bound<'py, PyAny>,
) -> PyResult<Option<Bound<'py, PyAny>>> {
    let (points, pixels) = (plane_points(points, "points")?, plane_points(pixels, "pixels")?);
    let view = View::new(points, pixels).map_err(|e| errors::view(py, 0, &e))?;
    if view.len() < 4 {
        return Ok(None);
    }
    let camera = camera.0;
    let found = detached(py, false, move || calibench::calibrate::locate(&camera, &view))?;
    let of = |located: calibench::calibrate::Located| {
        let fields = PyDict::new(py);
        let pose = located.cam_from_target;
        fields.set_item(
            "rotation",
            of_space(py, &std::array::from_fn::<Vec3, 3, _>(|i| pose.rotation.row(i).transpose()))?,
        )?;
        fields.set_item("translation", PyArray1::from_slice(py, pose.translation.as_slice()))?;
        fields.set_item("residuals", of_plane(py, &located.residuals)?)?;
        record(py, "Located", &fields)
    };
    found.map(of).transpose()
}

impl Calibration {
    pub(crate) fn of(result: LensCalibration, image_size: Option<(usize, usize)>, loss: Loss) -> Calibration {
        Calibration { result, image_size, loss, solver_seconds: None }
    }

    /// A calibration from what `__reduce__` gave.
    pub(crate) fn restored(
        camera: Camera,
        result: calibench::calibrate::Calibration,
        image_size: Option<(usize, usize)>,
        loss: Loss,
        solver_seconds: Option<f64>,
    ) -> Calibration {
        let mut result: LensCalibration = result.into();
        result.camera = camera.0;
        Calibration { result, image_size, loss, solver_seconds }
    }

    /// Width and height, px, where they were stated.
    pub(crate) fn size(&self) -> Option<(usize, usize)> {
        self.image_size
    }
}

#[pymethods]
impl Calibration {
    /// The estimate; parameters that were not free have the values they were held at.
    #[getter]
    fn camera(&self) -> Camera {
        Camera(self.result.camera)
    }

    /// Width and height as stated, px.
    #[getter]
    fn image_size(&self) -> Option<(usize, usize)> {
        self.image_size
    }

    /// Names of the estimated parameters, in the order of the covariance.
    #[getter]
    fn free<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        names(py, self.result.free)
    }

    /// What was known beforehand.
    #[getter]
    fn priors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        all_mirrored(py, "Prior", &self.result.priors)
    }

    /// Rotation of every view, camera from target, shape (V, 3, 3).
    #[getter]
    fn rotations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        of_rotations(py, &self.result.cam_from_target)
    }

    /// The same as rotation vectors, rad, shape (V, 3).
    #[getter]
    fn rotation_vectors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let vectors: Vec<Vec3> =
            self.result.cam_from_target.iter().map(|pose| rotation::log(&pose.rotation)).collect();
        of_space(py, &vectors)
    }

    /// Translation of every view, camera from target, in the target's unit, shape (V, 3).
    #[getter]
    fn translations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        of_translations(py, &self.result.cam_from_target)
    }

    /// Predicted - observed, px: one array (N, 2) a view.
    #[getter]
    fn residuals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let view = |residuals: &Vec<Vec2>| of_plane(py, residuals);
        PyList::new(py, self.result.residuals.iter().map(view).collect::<PyResult<Vec<_>>>()?)
    }

    /// ``sqrt(sum w^2 |r|^2 / N)`` over all N points, px, w being the marks' weights: as OpenCV's where none were given. A robust loss does not
    /// enter: outliers that it set aside count in full.
    #[getter]
    fn rmse_px(&self) -> f64 {
        self.result.rmse_px
    }

    /// ``sqrt(sum |r|^2 / n)`` over the n points of every view, px, shape (V,); weights do not enter.
    #[getter]
    fn view_rmse_px<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let views = 0..self.result.residuals.len();
        PyArray1::from_iter(py, views.map(|view| self.result.view_rmse_px(view).unwrap_or(f64::NAN)))
    }

    /// Estimated standard deviation of a pixel coordinate of a mark of weight 1, ``sqrt(sum w^2 |r|^2 / (2 N - p))``, px. A robust loss does not
    /// enter: outliers count in full. The covariance is scaled by Huber's correction instead (Huber & Ronchetti 2009, section 7.6).
    #[getter]
    fn sigma_px(&self) -> f64 {
        self.result.sigma_px
    }

    /// ``2 N - p``; with priors rounded down.
    #[getter]
    fn degrees_of_freedom(&self) -> usize {
        self.result.degrees_of_freedom
    }

    /// First-order covariance of parameters and poses.
    #[getter]
    fn covariance(&self) -> Covariance {
        Covariance(self.result.covariance.clone())
    }

    /// Standard deviation of every estimated parameter by name, in its unit.
    #[getter]
    fn standard_deviations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        standard_deviations(py, &self.result.covariance)
    }

    /// ``converged`` (a certified minimum), ``above-floor``, ``iteration-limit`` or ``stalled``.
    #[getter]
    fn termination(&self) -> &'static str {
        self.result.termination.name()
    }

    /// Whether the estimate is a minimum whose RMSE lies no more than a quarter above that of free homographies.
    #[getter]
    fn is_usable(&self) -> bool {
        self.result.is_usable()
    }

    /// How the cost compares with its floor; ``None`` where nothing certifies.
    #[getter]
    fn certificate<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        certificate(py, &self.result)
    }

    /// The combination of parameters that the data say least about.
    #[getter]
    fn conditioning<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        conditioning(py, &self.result)
    }

    /// Profile intervals, if they were asked for.
    #[getter]
    fn intervals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        all_mirrored(py, "ProfileInterval", &self.result.intervals)
    }

    /// What to be careful about.
    #[getter]
    fn warnings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        warnings(py, &self.result)
    }

    /// The shape of the board, where it was estimated.
    #[getter]
    fn board<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        self.result.board.as_ref().map(|board| mirrored(py, "BoardShape", board)).transpose()
    }

    /// Starts that were refined: 1 where the first left no doubt.
    #[getter]
    fn starts(&self) -> usize {
        self.result.starts
    }

    /// Refinement steps.
    #[getter]
    fn iterations(&self) -> usize {
        self.result.iterations
    }

    /// Wall-clock time of the estimator alone, s, arrays and Python left out; ``None`` of a fit that calibrates several times.
    #[getter]
    fn solver_seconds(&self) -> Option<f64> {
        self.solver_seconds
    }

    /// A copy, and what `pickle` keeps: every number.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<Reduced<'py>> {
        // What serde writes is a calibration with Brown-Conrady's lens; the camera goes beside it.
        let mut result = self.result.clone();
        result.camera = calibench::camera::Camera::pinhole(1.0, 1.0, 0.0, 0.0).into();
        let data = result.brown_conrady().map(|plain| pythonize(py, &plain)).transpose()?;
        let state = (self.camera(), data, self.image_size, loss_to_text(self.loss), self.solver_seconds);
        reduced(py, "Calibration", state.into_pyobject(py)?.into_any())
    }

    /// The text of `result.json` as the command writes it, all digits kept.
    #[pyo3(signature = (view_names = None))]
    fn to_json(&self, view_names: Option<Vec<String>>) -> String {
        CalibrationFields::of(&self.result, &view_names.unwrap_or_default(), self.image_size)
            .with_loss(self.loss)
            .to_json()
    }

    fn __repr__(&self) -> String {
        let Calibration { result, .. } = self;
        let (views, marks) = (result.residuals.len(), result.points());
        format!(
            "Calibration({}, rmse_px={:?}, views={views}, points={marks}, termination={:?}, warnings={})",
            self.camera().__repr__(),
            result.rmse_px,
            self.termination(),
            result.warnings.len()
        )
    }
}
