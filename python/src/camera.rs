//! A camera in Python: its parameters by name, and points through its lens and back.

use crate::arrays::{Rows, of_plane, of_space, plane_points, pose, shaped};
use crate::errors;
use crate::rectify;
use crate::watch::detached;
use calibench::camera::{Camera as LensCamera, Lens, Model, Parameter, UndistortError};
use calibench::geometry::{Pose, Vec2, Vec3};
use calibench::synth::fnv1a;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// Of what has no image.
const NOWHERE: Vec2 = Vec2::new(f64::NAN, f64::NAN);

/// How far, of the angle itself, a ray of `unproject` may lie beyond the last one of the lens by rounding.
const AT_THE_LIMIT: f64 = 1e-12;

/// More points than this are a long call: some milliseconds.
const MANY: usize = 100_000;

/// A camera: focal lengths, principal point, skew, and a lens.
///
/// ``(x_d, y_d) = lens(X / Z, Y / Z)``, ``u = fx x_d + skew y_d + cx``, ``v = fy y_d + cy``. Values not given are 0 (``alpha`` 0.5).
///
/// Args:
///     fx, fy: focal lengths, px.
///     cx, cy: principal point, px.
///     model: ``brown-conrady`` (k1 k2 p1 p2 k3), ``rational`` (and k4 k5 k6), ``thin-prism`` (and s1 s2 s3 s4), ``tilted`` (and tau_x tau_y,
///         rad), ``kannala-brandt`` (k1 k2 k3 k4), ``division`` (k1), ``double-sphere`` (xi alpha),
///         ``halcon-polynomial`` (k1 k2 p1 p2 k3, from the seen point to the ideal one).
///     values: ``skew`` (px) and the coefficients of the model by name.
///
/// Raises:
///     SettingsError: an unknown model, a focal length that is not positive, a number that is not finite.
///     TypeError: a number that the model does not have.
#[pyclass(frozen, eq, from_py_object, module = "calibench")]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Camera(pub(crate) LensCamera<Lens>);

/// What becomes of a pixel outside the image of the lens.
#[derive(Clone, Copy, PartialEq)]
enum Outside {
    Raise,
    Nan,
}

impl Outside {
    fn named(name: &str) -> PyResult<Outside> {
        match name {
            "raise" => Ok(Outside::Raise),
            "nan" => Ok(Outside::Nan),
            other => {
                Err(PyValueError::new_err(format!("outside = {other:?}: expected \"raise\" or \"nan\"")))
            }
        }
    }
}

/// A parameter of a name that Python gave.
pub(crate) fn parameter(py: Python<'_>, name: &str) -> PyResult<Parameter> {
    name.parse().map_err(|e| errors::plain(py, "SettingsError", "UnknownParameter", &e))
}

/// A lens model of a name that Python gave.
pub(crate) fn model(py: Python<'_>, name: &str) -> PyResult<Model> {
    name.parse().map_err(|e| errors::plain(py, "SettingsError", "UnknownModel", &e))
}

impl Camera {
    /// The camera of a lens without skew, changed by parameters of Python's.
    fn with_values(
        py: Python<'_>,
        mut camera: LensCamera<Lens>,
        values: &Bound<'_, PyDict>,
    ) -> PyResult<Camera> {
        for (name, value) in values {
            let name: String = name.extract()?;
            let model = camera.distortion.model();
            let changed = name.parse().ok().and_then(|p| Some(camera.with_value(p, value.extract().ok()?)));
            camera = changed.flatten().ok_or_else(|| {
                let names = model.parameters().map(Parameter::name).collect::<Vec<_>>().join(" ");
                PyTypeError::new_err(format!("{name} = {value}: the numbers of a {model} camera are {names}"))
            })?;
        }
        if !camera.is_possible() {
            let kind = "NotPossible";
            let text = "fx and fy must be positive, and every parameter finite".to_string();
            return Err(errors::exception(py, "SettingsError", text, kind, PyDict::new(py).into_any()));
        }
        Ok(Camera(camera))
    }

    /// The pixel of a point in camera coordinates, NaN where the lens has no image of it: of Brown-Conrady's lens by the operations with
    /// which scenes are photographed.
    fn pixel(&self, plain: Option<&LensCamera>, point_cam: &Vec3) -> Vec2 {
        let seen = match plain {
            Some(camera) => camera.project(point_cam),
            None => self.0.pixel(point_cam),
        };
        seen.unwrap_or(NOWHERE)
    }

    /// Tells of points in camera coordinates whether the lens has one image of them: not beyond the angle up to which it is one-to-one, and not
    /// exactly behind it, where no direction from the axis is theirs.
    fn sees(&self) -> impl Fn(&Vec3) -> bool + use<> {
        let limit = self.0.distortion.monotone_angle() * (1.0 + AT_THE_LIMIT);
        move |point| {
            let across = point.xy().norm();
            libm::atan2(across, point.z) <= limit && (across > 0.0 || point.z > 0.0)
        }
    }

    /// Where an ideal lens with the same focal lengths, principal point and skew would have shown it.
    fn ideal_pixel(&self, pixel: &Vec2) -> Result<Vec2, UndistortError> {
        let ray = self.0.ray(pixel)?;
        let (x, y) = (ray.x / ray.z, ray.y / ray.z);
        let seen = Vec2::new(self.0.fx * x + self.0.skew * y + self.0.cx, self.0.fy * y + self.0.cy);
        Ok(if ray.z > 0.0 { seen } else { NOWHERE })
    }

    fn ideal_pixels(&self, pixels: &[Vec2], outside: Outside) -> Result<Vec<Vec2>, (usize, UndistortError)> {
        let plain = self.0.brown_conrady();
        if let Some(corrected) = plain.and_then(|camera| camera.correct_pixels(pixels).ok()) {
            return Ok(corrected);
        }
        each(pixels, outside, NOWHERE, |pixel| match &plain {
            Some(camera) => camera.correct_pixel(pixel),
            None => self.ideal_pixel(pixel),
        })
    }
}

/// Every pixel by itself: the first that fails is named, or all that fail become `nan`.
fn each<T: Copy>(
    pixels: &[Vec2],
    outside: Outside,
    nan: T,
    of: impl Fn(&Vec2) -> Result<T, UndistortError>,
) -> Result<Vec<T>, (usize, UndistortError)> {
    let one = |(index, pixel)| match of(pixel) {
        Err(error) if outside == Outside::Raise => Err((index, error)),
        found => Ok(found.unwrap_or(nan)),
    };
    pixels.iter().enumerate().map(one).collect()
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (fx, fy, cx, cy, *, model = "brown-conrady", **values))]
    fn new(
        py: Python<'_>,
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        model: &str,
        values: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Camera> {
        let lens = Lens::ideal(crate::camera::model(py, model)?);
        let none = PyDict::new(py);
        Camera::with_values(py, LensCamera::with_lens(fx, fy, cx, cy, lens), values.unwrap_or(&none))
    }

    /// The same camera with other values of some parameters.
    #[pyo3(signature = (**values))]
    fn replace(&self, py: Python<'_>, values: Option<&Bound<'_, PyDict>>) -> PyResult<Camera> {
        values.map_or_else(|| Ok(self.clone()), |values| Camera::with_values(py, self.0, values))
    }

    /// Focal length along u, px.
    #[getter]
    fn fx(&self) -> f64 {
        self.0.fx
    }

    /// Focal length along v, px.
    #[getter]
    fn fy(&self) -> f64 {
        self.0.fy
    }

    /// Principal point, u, px.
    #[getter]
    fn cx(&self) -> f64 {
        self.0.cx
    }

    /// Principal point, v, px.
    #[getter]
    fn cy(&self) -> f64 {
        self.0.cy
    }

    /// Skew, px: u gains ``skew * y_d`` (Zhang's gamma).
    #[getter]
    fn skew(&self) -> f64 {
        self.0.skew
    }

    /// Name of the lens model.
    #[getter]
    fn model(&self) -> &'static str {
        self.0.distortion.model().name()
    }

    /// Every parameter by name: linear ones in px, tau_x and tau_y in rad, the others pure numbers.
    #[getter]
    pub(crate) fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let values = PyDict::new(py);
        for (parameter, value) in self.0.values() {
            values.set_item(parameter.name(), value)?;
        }
        Ok(values)
    }

    /// ``K``, shape (3, 3).
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let LensCamera { fx, fy, cx, cy, skew, .. } = self.0;
        shaped(py, vec![fx, skew, cx, 0.0, fy, cy, 0.0, 0.0, 1.0], 3, 3)
    }

    /// The coefficients of the lens in the model's order, which is OpenCV's where OpenCV has the model; shape (P,).
    #[getter]
    fn distortion<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.0.distortion.coefficients())
    }

    /// Angle from the axis, rad, up to which the lens model is one-to-one.
    #[getter]
    fn monotone_angle(&self) -> f64 {
        self.0.distortion.monotone_angle()
    }

    /// Pixels of points, shape (N, 2); NaN where the lens has no image of a point: behind the camera, or further than `monotone_angle` from
    /// the axis, where the formulas of the model show what no lens shows.
    ///
    /// Args:
    ///     points: (N, 3), or (N, 2) with Z = 0; in camera coordinates, or with a pose in the target's.
    ///     rotation, translation: (3, 3) and (3,), camera from target.
    #[pyo3(signature = (points, rotation = None, translation = None))]
    fn project<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        rotation: Option<&Bound<'py, PyAny>>,
        translation: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let points = Rows::of(points, "points")?.space(py, "points")?;
        let pose = match (rotation, translation) {
            (Some(rotation), Some(translation)) => Some(pose(rotation, translation)?),
            (None, None) => None,
            _ => {
                return Err(PyTypeError::new_err(
                    "a pose is a rotation and a translation: give both or none",
                ));
            }
        };
        let (camera, many) = (self.clone(), points.len() > MANY);
        let pixels: Vec<Vec2> = detached(py, many, move || {
            let plain = camera.0.brown_conrady();
            let sees = camera.sees();
            let seen = |point: &Vec3| {
                let point = pose.as_ref().map_or(*point, |pose: &Pose| pose.apply(point));
                if sees(&point) { camera.pixel(plain.as_ref(), &point) } else { NOWHERE }
            };
            points.iter().map(seen).collect()
        })?;
        of_plane(py, &pixels)
    }

    /// Rays of length 1 in camera coordinates that are seen at pixels, shape (N, 3): the exact inverse of `project`.
    ///
    /// Args:
    ///     pixels: (N, 2).
    ///     outside: what becomes of a pixel outside the image of the lens: ``raise``, or ``nan``.
    ///
    /// Raises:
    ///     UndistortError: with the index of the first such pixel.
    #[pyo3(signature = (pixels, *, outside = "raise"))]
    fn unproject<'py>(
        &self,
        py: Python<'py>,
        pixels: &Bound<'py, PyAny>,
        outside: &str,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (pixels, outside) = (plane_points(pixels, "pixels")?, Outside::named(outside)?);
        let (camera, many) = (self.0, pixels.len() > MANY);
        let nan = Vec3::repeat(f64::NAN);
        let rays = detached(py, many, move || each(&pixels, outside, nan, |pixel| camera.ray(pixel)))?;
        of_space(py, &rays.map_err(|(index, error)| errors::undistort(py, index, &error))?)
    }

    /// Where a lens without distortion and with the same K would have shown what is seen at pixels, shape (N, 2), px. The inverse is exact.
    ///
    /// NaN beyond 90 degrees from the axis, where no such lens sees. Arguments and errors are those of `unproject`.
    #[pyo3(signature = (pixels, *, outside = "raise"))]
    fn undistort_points<'py>(
        &self,
        py: Python<'py>,
        pixels: &Bound<'py, PyAny>,
        outside: &str,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (pixels, outside) = (plane_points(pixels, "pixels")?, Outside::named(outside)?);
        let (camera, many) = (self.clone(), pixels.len() > MANY);
        let ideal = detached(py, many, move || camera.ideal_pixels(&pixels, outside))?;
        of_plane(py, &ideal.map_err(|(index, error)| errors::undistort(py, index, &error))?)
    }

    /// The pixels at which the lens shows what one without distortion would show at `pixels`, shape (N, 2), px; NaN further than
    /// `monotone_angle` from the axis.
    #[pyo3(signature = (pixels))]
    fn distort_points<'py>(
        &self,
        py: Python<'py>,
        pixels: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let pixels = plane_points(pixels, "pixels")?;
        let (camera, many) = (self.clone(), pixels.len() > MANY);
        let seen: Vec<Vec2> = detached(py, many, move || {
            let plain = camera.0.brown_conrady();
            let LensCamera { fx, fy, cx, cy, skew, .. } = camera.0;
            let sees = camera.sees();
            let one = |pixel: &Vec2| {
                let y = (pixel.y - cy) / fy;
                let ray = Vec3::new((pixel.x - cx - skew * y) / fx, y, 1.0);
                match plain {
                    _ if !sees(&ray) => NOWHERE,
                    Some(plain) => plain.distort_pixel(pixel),
                    None => camera.pixel(None, &ray),
                }
            };
            pixels.iter().map(one).collect()
        })?;
        of_plane(py, &seen)
    }

    /// The image that another lens would have taken, and its camera (``None`` for equirectangular).
    ///
    /// Args:
    ///     image: grey, (height, width) of uint8, uint16 or float32.
    ///     view: without distortion ``same-k``, ``all-pixels`` (nothing lost) or ``only-valid`` (nothing empty), for brown-conrady;
    ///         ``pinhole``, ``equidistant`` or ``equirectangular`` for lenses of any model.
    ///     border: level of what was not seen.
    ///
    /// Raises:
    ///     RectifyError: an image too small, or a lens that does not reach the image's border.
    #[pyo3(signature = (image, *, view = "same-k", border = 0.0))]
    fn undistort_image<'py>(
        &self,
        py: Python<'py>,
        image: &Bound<'py, PyAny>,
        view: &str,
        border: f64,
    ) -> PyResult<(Bound<'py, PyAny>, Option<Camera>)> {
        rectify::undistort_image(py, self, image, view, border)
    }

    /// Equal cameras have equal hashes.
    fn __hash__(&self) -> u64 {
        // 0.0 and -0.0 are equal.
        let bits = self.0.values().flat_map(|(_, value)| (value + 0.0).to_bits().to_le_bytes());
        fnv1a(self.model().bytes().chain(bits))
    }

    pub(crate) fn __repr__(&self) -> String {
        let values: Vec<String> = self
            .0
            .values()
            .enumerate()
            .filter(|(place, (_, value))| *place < 4 || *value != 0.0)
            .map(|(_, (parameter, value))| format!("{}={value:?}", parameter.name()))
            .collect();
        format!("Camera({}, model={:?})", values.join(", "), self.model())
    }

    fn __getnewargs_ex__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)> {
        let values = self.parameters(py)?;
        values.set_item("model", self.model())?;
        Ok((PyTuple::empty(py), values))
    }
}
