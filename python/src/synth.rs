//! The virtual camera, and the one place where noise enters: the same bits as in Rust.

use crate::arguments;
use crate::arrays::{
    Matrix, Vector, of_plane, of_rotations, of_space, of_translations, plane_points, refuse_masked, room,
    rotation, stacked, vector,
};
use crate::camera::Camera;
use crate::errors;
use crate::evaluate::brown_conrady;
use calibench::geometry::{Pose, Vec3};
use calibench::synth::{Scene as Photographed, Stream as Draws, StreamKey, Truth, scene};
use numpy::{Element, PyArray1, PyArray2, PyArray3};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

/// A stream of random numbers, ChaCha8 (Bernstein 2008), keyed by what it is for: the same key gives the same numbers on every machine.
///
/// Args:
///     seed: of the experiment.
///     scenario: within it.
///     trial: within the scenario.
///     purpose: what is drawn.
#[pyclass(module = "calibench")]
#[derive(Debug)]
pub(crate) struct Stream {
    draws: Draws,
    /// What it was opened with.
    key: Key,
}

/// Seed, scenario, trial and purpose.
type Key = (u64, String, u64, String);

/// So many draws, in an array for which there is room.
fn drawn<'py, T: Element>(
    count: &Bound<'py, PyAny>,
    draw: impl FnMut() -> T,
) -> PyResult<Bound<'py, PyArray1<T>>> {
    let py = count.py();
    let count = arguments::value(count, "count")?;
    let mut numbers = room(count)?;
    numbers.extend(std::iter::repeat_with(draw).take(count));
    Ok(PyArray1::from_vec(py, numbers))
}

#[pymethods]
impl Stream {
    #[new]
    #[pyo3(signature = (seed, scenario, trial = None, purpose = "noise"), text_signature = "(seed, scenario, trial=0, purpose='noise')")]
    fn new(
        seed: &Bound<'_, PyAny>,
        scenario: &str,
        trial: Option<&Bound<'_, PyAny>>,
        purpose: &str,
    ) -> PyResult<Stream> {
        let (seed, trial) =
            (arguments::value(seed, "seed")?, trial.map_or(Ok(0), |trial| arguments::value(trial, "trial"))?);
        let draws = Draws::open(StreamKey { seed, scenario, trial, purpose });
        Ok(Stream { draws, key: (seed, scenario.into(), trial, purpose.into()) })
    }

    /// A copy, and what `pickle` keeps: the key, and how far it was drawn.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> (Bound<'py, PyAny>, Key, u128) {
        let stream = slf.borrow();
        (slf.get_type().into_any(), stream.key.clone(), stream.draws.position())
    }

    fn __setstate__(&mut self, position: u128) {
        self.draws = self.draws.clone().drawn_to(position);
    }

    fn __repr__(&self) -> String {
        let (seed, scenario, trial, purpose) = &self.key;
        format!("Stream(seed={seed}, scenario={scenario:?}, trial={trial}, purpose={purpose:?})")
    }

    /// Standard normal numbers, shape (count,).
    fn normal<'py>(&mut self, count: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        drawn(count, || self.draws.normal())
    }

    /// Uniform numbers in (low, high), (0, 1) if neither is given, shape (count,).
    #[pyo3(signature = (count, low = None, high = None))]
    fn uniform<'py>(
        &mut self,
        count: &Bound<'py, PyAny>,
        low: Option<f64>,
        high: Option<f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let py = count.py();
        match (low, high) {
            (None, None) => drawn(count, || self.draws.uniform()),
            (Some(low), Some(high)) => {
                let (low, high) = (arguments::finite(py, "low", low)?, arguments::finite(py, "high", high)?);
                if low > high {
                    let wanted = format!("the range ends at high = {high}, below its begin");
                    return Err(errors::argument(py, "low", low, &wanted));
                }
                drawn(count, || self.draws.uniform_in(low, high))
            }
            _ => Err(PyTypeError::new_err("a range is low and high: give both or none")),
        }
    }

    /// Uniform whole numbers below `bound`, shape (count,).
    fn below<'py>(
        &mut self,
        count: &Bound<'py, PyAny>,
        bound: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyArray1<u64>>> {
        let bound: usize = arguments::value(bound, "bound")?;
        if bound == 0 {
            return Err(errors::argument(count.py(), "bound", bound, "no whole number lies below 0"));
        }
        drawn(count, || self.draws.below(bound) as u64)
    }
}

/// A virtual camera of known truth before a target: what it sees without noise, and with.
///
/// Args:
///     camera: brown-conrady.
///     image_size: width and height, px.
///     points: (N, 2) of the target.
///     rotations, translations: (V, 3, 3) and (V, 3), camera from target.
///
/// Raises:
///     SceneError: a point behind the camera, or beyond the radius where the lens is one-to-one.
#[pyclass(frozen, eq, skip_from_py_object, module = "calibench")]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Scene(pub(crate) Photographed);

#[pymethods]
impl Scene {
    #[new]
    fn new(
        camera: &Camera,
        image_size: &Bound<'_, PyAny>,
        points: &Bound<'_, PyAny>,
        rotations: &Bound<'_, PyAny>,
        translations: &Bound<'_, PyAny>,
    ) -> PyResult<Scene> {
        let py = points.py();
        // A masked array of poses would lose its mask when it is taken apart.
        refuse_masked(rotations, "rotations")?;
        refuse_masked(translations, "translations")?;
        let rotations =
            rotations.try_iter()?.map(|r| rotation(&r?, "rotations")).collect::<PyResult<Vec<_>>>()?;
        let translations =
            translations.try_iter()?.map(|t| vector(&t?, "translations")).collect::<PyResult<Vec<_>>>()?;
        if rotations.len() != translations.len() {
            let (r, t) = (rotations.len(), translations.len());
            let text = format!("{r} rotations and {t} translations: a pose is one of each");
            return Err(errors::numbered(py, "SceneError", "Poses", text, |numbers| {
                numbers.set_item("rotations", r)?;
                numbers.set_item("translations", t)
            }));
        }
        let points = plane_points(points, "points")?;
        if points.is_empty() || rotations.is_empty() {
            let (n, v) = (points.len(), rotations.len());
            let text = format!("{n} points in {v} views: a scene has at least one of each");
            return Err(errors::numbered(py, "SceneError", "Empty", text, |numbers| {
                numbers.set_item("points", n)?;
                numbers.set_item("views", v)
            }));
        }
        let poses = rotations.into_iter().zip(translations);
        let truth = Truth {
            camera: brown_conrady(camera, "camera")?,
            image_size: arguments::image_size(image_size, "image_size")?,
            points,
            cam_from_target: poses.map(|(rotation, translation)| Pose { rotation, translation }).collect(),
        };
        Photographed::new(truth).map(Scene).map_err(|e| errors::scene(py, &e))
    }

    /// Four photographs of a 9 x 7 grid, 10 mm apart, at 120 mm: f = 600 px, principal point (326, 243), k1 = -0.18, k2 = 0.05, 640 x 480 px.
    #[staticmethod]
    fn example() -> Scene {
        Scene(Photographed::example())
    }

    /// The true camera.
    #[getter]
    fn camera(&self) -> Camera {
        Camera(self.0.truth.camera.into())
    }

    /// Width and height, px.
    #[getter]
    fn image_size(&self) -> (usize, usize) {
        self.0.truth.image_size
    }

    /// Points of the target, shape (N, 2).
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        of_plane(py, &self.0.truth.points)
    }

    /// True rotations, camera from target, shape (V, 3, 3).
    #[getter]
    fn rotations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        of_rotations(py, &self.0.truth.cam_from_target)
    }

    /// True translations, camera from target, shape (V, 3).
    #[getter]
    fn translations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        of_translations(py, &self.0.truth.cam_from_target)
    }

    /// Pixels without noise, shape (V, N, 2).
    #[getter]
    fn pixels<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let pixels = self.0.pixels();
        stacked(py, pixels.len(), (self.0.truth.points.len(), 2), |v, i, j| pixels[v][i][j])
    }

    /// Pixels with Gaussian noise, shape (V, N, 2), drawn view by view, point by point, u before v.
    ///
    /// Args:
    ///     sigma_px: standard deviation on each of u and v, px.
    ///     stream: the noise; it is used up as far as it is drawn.
    fn observe<'py>(
        &self,
        py: Python<'py>,
        sigma_px: f64,
        stream: &mut Stream,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        // Noise that is not finite would make views that nobody can photograph.
        let sigma_px = arguments::not_negative(py, "sigma_px", sigma_px)?;
        let views = self.0.observe(sigma_px, &mut stream.draws);
        stacked(py, views.len(), (self.0.truth.points.len(), 2), |v, i, j| views[v].pixels()[i][j])
    }

    /// A copy, and what `pickle` keeps: the arguments.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyTuple>)> {
        let (py, scene) = (slf.py(), slf.borrow());
        let arguments = (
            scene.camera(),
            scene.image_size(),
            scene.points(py)?,
            scene.rotations(py)?,
            scene.translations(py)?,
        );
        Ok((slf.get_type().into_any(), arguments.into_pyobject(py)?))
    }

    fn __repr__(&self) -> String {
        let Truth { image_size, points, cam_from_target, .. } = &self.0.truth;
        format!(
            "Scene({}, image_size={image_size:?}, points={}, views={})",
            self.camera().__repr__(),
            points.len(),
            cam_from_target.len()
        )
    }
}

/// The pose of a target whose centre lies on the optical axis: rotation ``Rz Ry Rx`` (3, 3) of degrees, and translation (3,).
#[pyfunction]
pub(crate) fn looking_at_centre<'py>(
    py: Python<'py>,
    xyz_degrees: [f64; 3],
    distance: f64,
) -> PyResult<(Matrix<'py>, Vector<'py>)> {
    for degrees in xyz_degrees {
        arguments::finite(py, "xyz_degrees", degrees)?;
    }
    arguments::finite(py, "distance", distance)?;
    let pose = scene::looking_at_centre(xyz_degrees, distance);
    let rows: [Vec3; 3] = std::array::from_fn(|i| pose.rotation.row(i).transpose());
    Ok((of_space(py, &rows)?, PyArray1::from_slice(py, pose.translation.as_slice())))
}
