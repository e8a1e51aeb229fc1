//! A board: where its marks are, where they are seen in an image, and what image a virtual camera takes of it.

use crate::arguments;
use crate::arrays::{of_plane, pose};
use crate::camera::Camera;
use crate::errors;
use crate::rectify::{grey, of_intensity};
use crate::watch::detached;
use calibench::board::Pattern;
use calibench::photos::BoardSpec;
use calibench::synth::fnv1a;
use calibench::synth::render::{Imaging, photograph, photograph_dark};
use numpy::PyArray2;
use pyo3::prelude::*;

/// A board, as on the command line.
///
/// Args:
///     board: ``chess:9x6:25mm`` (inner corners and side of a square), ``circles:9x7:10mm:3mm`` (pitch and diameter of the discs),
///         ``asymmetric:4x11:20mm:15mm`` (OpenCV's asymmetric grid: distance of rows, half that of a row's discs, and diameter),
///         ``hexagonal:9x9:10mm:5mm`` (distance of neighbours, diameter), or ``dots:3x3:1`` (a few dots); the diameter may be left out.
///         ``charuco:7x5:30mm:22mm:DICT_4X4_50`` (squares, their side, that of a marker, OpenCV's dictionary; ``:legacy`` for OpenCV's
///         legacy pattern) or ``aprilgrid:6x6:88mm:0.3`` (Kalibr's tags, their side, the space between two in sides).
///
/// Raises:
///     BoardError: a text that is no board, or a board that cannot exist.
#[pyclass(frozen, eq, skip_from_py_object, module = "calibench")]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Board(pub(crate) BoardSpec);

impl Board {
    /// The text of which it is made.
    fn text(&self) -> String {
        if self.0.dark().is_some() {
            return self.0.words();
        }
        let (kind, unit) = (self.kind(), self.unit());
        let plain = format!("{kind}:{}x{}:{}{unit}", self.columns(), self.rows(), self.spacing());
        match self.0.board().pattern() {
            Pattern::Circles { diameter } if self.0.diameter_known => format!("{plain}:{diameter}{unit}"),
            _ => plain,
        }
    }
}

#[pymethods]
impl Board {
    #[new]
    fn new(py: Python<'_>, board: &str) -> PyResult<Board> {
        board.parse().map(Board).map_err(|e| errors::board(py, &e))
    }

    /// ``chess``, ``circles``, ``asymmetric``, ``hexagonal``, ``dots``, ``charuco`` or ``aprilgrid``.
    #[getter]
    fn kind(&self) -> &'static str {
        self.0.kind.name()
    }

    /// Marks along a row.
    #[getter]
    fn columns(&self) -> usize {
        self.0.board().columns()
    }

    /// Number of rows of marks.
    #[getter]
    fn rows(&self) -> usize {
        self.0.board().rows()
    }

    /// Distance of neighbouring marks, in `unit`; of tags' corners the mean one.
    #[getter]
    fn spacing(&self) -> f64 {
        self.0.board().spacing()
    }

    /// Unit of lengths; empty if none was given.
    #[getter]
    fn unit(&self) -> &str {
        &self.0.unit
    }

    /// The marks, row by row (those of tags from below, as Kalibr counts them), about the board's centre, shape (N, 2).
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        of_plane(py, &self.0.points())
    }

    /// The marks in an image, px, in the order of `points`, shape (N, 2): all of them, or an error.
    ///
    /// Args:
    ///     image: grey, (height, width) of uint8, uint16 or float32.
    ///
    /// Raises:
    ///     DetectError: the board is not seen whole and clearly; `numbers` says what was.
    fn detect<'py>(&self, py: Python<'py>, image: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let (photo, spec) = (grey(image)?, self.0.clone());
        let marks = detached(py, true, move || spec.detect(&photo))?;
        of_plane(py, &marks.map_err(|e| errors::not_found(py, &e))?)
    }

    /// The image that a virtual camera takes of the board: intensity (black 0, white 1), float32, shape (height, width); exact area sampling.
    ///
    /// Args:
    ///     camera: of any lens model.
    ///     image_size: width and height, px.
    ///     rotation, translation: camera from target.
    ///     blur_px: standard deviation of the Gaussian point spread function.
    ///
    /// Raises:
    ///     SceneError: part of the board is behind a brown-conrady camera, or where the lens folds back; a pose that is not finite.
    ///     SettingsError: an image without pixels, or of more than 2^28.
    #[pyo3(signature = (camera, image_size, rotation, translation, *, blur_px = 0.0))]
    fn photograph<'py>(
        &self,
        py: Python<'py>,
        camera: &Camera,
        image_size: &Bound<'py, PyAny>,
        rotation: &Bound<'py, PyAny>,
        translation: &Bound<'py, PyAny>,
        blur_px: f64,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let image_size = arguments::size_to_make(image_size, "image_size")?;
        let (camera, pose) = (camera.0, pose(rotation, translation)?);
        let (spec, imaging) = (self.0.clone(), Imaging { blur_px, ..Imaging::default() });
        let photo = detached(py, true, move || match spec.dark() {
            Some(dark) => photograph_dark(&camera, image_size, &dark, &spec.points(), &pose, &imaging),
            None => photograph(&camera, image_size, spec.board(), &pose, &imaging),
        })?;
        of_intensity(py, photo.map_err(|e| errors::render(py, &e))?.image)
    }

    /// A copy, and what `pickle` keeps: the text.
    fn __getnewargs__(&self) -> (String,) {
        (self.text(),)
    }

    /// Equal boards have equal hashes.
    fn __hash__(&self) -> u64 {
        fnv1a(self.text().bytes())
    }

    fn __repr__(&self) -> String {
        format!("Board({})", self.0)
    }
}
