//! Images as an ideal lens would have shown them: levels of 8 bits, of 16 bits, and intensities of 32 bits.

use crate::arguments;
use crate::arrays::refuse_masked;
use crate::camera::Camera;
use crate::errors;
use crate::evaluate::brown_conrady;
use crate::watch::detached;
use calibench::geometry::Vec2;
use calibench::io::Grey;
use calibench::raster::Raster;
use calibench::rectify::{
    Interpolated, OutputView, Projection, RectifyError, RectifyMap as Table, output_camera, rectify_image,
};
use numpy::{Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use std::sync::Arc;

/// A grey image from an array of shape (height, width).
pub(crate) fn grey(image: &Bound<'_, PyAny>) -> PyResult<Grey> {
    refuse_masked(image, "image")?;
    if let Ok(levels) = image.extract::<PyReadonlyArray2<'_, u8>>() {
        return Ok(Grey::U8(raster(&levels)));
    }
    if let Ok(levels) = image.extract::<PyReadonlyArray2<'_, u16>>() {
        return Ok(Grey::U16(raster(&levels)));
    }
    if let Ok(levels) = image.extract::<PyReadonlyArray2<'_, f32>>() {
        return Ok(Grey::F32(raster(&levels)));
    }
    Err(PyTypeError::new_err(
        "expected a grey image: an array of shape (height, width) of uint8, uint16 or float32",
    ))
}

fn raster<T: Element + Copy>(levels: &PyReadonlyArray2<'_, T>) -> Raster<T> {
    let (height, width) = (levels.shape()[0], levels.shape()[1]);
    let samples = match levels.as_slice() {
        Ok(samples) if levels.is_c_contiguous() => samples.to_vec(),
        _ => levels.as_array().iter().copied().collect(),
    };
    Raster::from_samples(width, height, samples).expect("an array has height times width samples")
}

fn array<T: Element + Copy>(py: Python<'_>, image: Raster<T>) -> PyResult<Bound<'_, PyArray2<T>>> {
    PyArray1::from_slice(py, image.samples()).reshape([image.height(), image.width()])
}

/// An array of intensities.
pub(crate) fn of_intensity(py: Python<'_>, image: Raster<f32>) -> PyResult<Bound<'_, PyArray2<f32>>> {
    array(py, image)
}

fn of_grey(py: Python<'_>, image: Grey) -> PyResult<Bound<'_, PyAny>> {
    Ok(match image {
        Grey::U8(image) => array(py, image)?.into_any(),
        Grey::U16(image) => array(py, image)?.into_any(),
        Grey::F32(image) => array(py, image)?.into_any(),
    })
}

/// What is done alike to levels of any kind.
trait Change: Send + 'static {
    fn of<T: Interpolated>(&self, image: &Raster<T>, border: T) -> Result<Raster<T>, RectifyError>;

    fn of_grey(&self, image: &Grey, border: f64) -> Result<Grey, RectifyError> {
        Ok(match image {
            Grey::U8(image) => Grey::U8(self.of(image, border as u8)?),
            Grey::U16(image) => Grey::U16(self.of(image, border as u16)?),
            Grey::F32(image) => Grey::F32(self.of(image, border as f32)?),
        })
    }
}

/// From a photograph of one camera to an image of another.
struct Between {
    camera: calibench::camera::Camera,
    output: calibench::camera::Camera,
    size: (usize, usize),
}

impl Change for Between {
    fn of<T: Interpolated>(&self, image: &Raster<T>, border: T) -> Result<Raster<T>, RectifyError> {
        rectify_image(image, &self.camera, &self.output, self.size, border)
    }
}

struct ByTable(Arc<Table>);

impl Change for ByTable {
    fn of<T: Interpolated>(&self, image: &Raster<T>, border: T) -> Result<Raster<T>, RectifyError> {
        self.0.apply(image, border)
    }
}

fn changed<'py>(
    py: Python<'py>,
    change: impl Change,
    image: &Bound<'py, PyAny>,
    border: f64,
) -> PyResult<Bound<'py, PyAny>> {
    let image = grey(image)?;
    let rectified = detached(py, true, move || change.of_grey(&image, border))?;
    of_grey(py, rectified.map_err(|e| errors::rectify(py, &e))?)
}

fn output_view(name: &str) -> Option<OutputView> {
    match name {
        "same-k" => Some(OutputView::SameK),
        "all-pixels" => Some(OutputView::AllPixels),
        "only-valid" => Some(OutputView::OnlyValid),
        _ => None,
    }
}

fn projection(name: &str) -> Option<Projection> {
    match name {
        "pinhole" => Some(Projection::Pinhole),
        "equidistant" => Some(Projection::Equidistant),
        "equirectangular" => Some(Projection::Equirectangular),
        _ => None,
    }
}

/// The image without the lens's distortion, and the camera that would have taken it.
pub(crate) fn undistort_image<'py>(
    py: Python<'py>,
    camera: &Camera,
    image: &Bound<'py, PyAny>,
    view: &str,
    border: f64,
) -> PyResult<(Bound<'py, PyAny>, Option<Camera>)> {
    let size = size_of(image)?;
    if let Some(view) = output_view(view) {
        let camera = brown_conrady(camera, "view = same-k, all-pixels or only-valid")?;
        let output = output_camera(&camera, size, view).map_err(|e| errors::output_camera(py, &e))?;
        let image = changed(py, Between { camera, output, size }, image, border)?;
        return Ok((image, Some(Camera(output.into()))));
    }
    let Some(projection) = projection(view) else {
        let known = "same-k, all-pixels, only-valid, pinhole, equidistant or equirectangular";
        return Err(PyValueError::new_err(format!("view = {view:?}: expected {known}")));
    };
    let lens = camera.0;
    let table = detached(py, true, move || Table::through_lens(&lens, size, projection))?;
    let table = table.map_err(|e| errors::rectify(py, &e))?;
    let image = changed(py, ByTable(Arc::new(table)), image, border)?;
    Ok((image, projection.camera(&lens).map(Camera)))
}

/// Width and height of an image.
fn size_of(image: &Bound<'_, PyAny>) -> PyResult<(usize, usize)> {
    let (height, width) = image.getattr("shape")?.extract()?;
    Ok((width, height))
}

/// A look-up table from an output image to the photograph, for many photographs of one camera (brown-conrady).
///
/// Args:
///     camera: that took the photographs.
///     image_size: theirs, width and height, px.
///     output: camera of the output, usually one without distortion.
///     output_size: width and height, px; as the photographs if not given.
#[pyclass(frozen, module = "calibench")]
#[derive(Debug)]
pub(crate) struct RectifyMap {
    table: Arc<Table>,
    /// Of the photographs, and of what is made of them.
    cameras: (Camera, Camera),
}

#[pymethods]
impl RectifyMap {
    #[new]
    #[pyo3(signature = (camera, image_size, output, output_size = None))]
    fn new(
        py: Python<'_>,
        camera: &Camera,
        image_size: &Bound<'_, PyAny>,
        output: &Camera,
        output_size: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<RectifyMap> {
        let cameras = (camera.clone(), output.clone());
        let (camera, output) = (brown_conrady(camera, "camera")?, brown_conrady(output, "output")?);
        // The photographs' size is one to make where the output has it.
        let output_size = match output_size {
            Some(size) => arguments::size_to_make(size, "output_size")?,
            None => arguments::size_to_make(image_size, "image_size")?,
        };
        let image_size = arguments::image_size(image_size, "image_size")?;
        let between = move || Table::between(&camera, image_size, &output, output_size);
        let table = detached(py, true, between)?.map_err(|e| errors::rectify(py, &e))?;
        Ok(RectifyMap { table: Arc::new(table), cameras })
    }

    /// A copy, and what `pickle` keeps: the arguments, from which the table is made again.
    fn __getnewargs__(&self) -> (Camera, (usize, usize), Camera, (usize, usize)) {
        let (camera, output) = self.cameras.clone();
        (camera, self.table.input_size(), output, self.table.output_size())
    }

    /// The photograph as the output camera would have taken it; what has no data gets the level `border`.
    ///
    /// Args:
    ///     image: grey, (height, width) of uint8, uint16 or float32.
    ///
    /// Raises:
    ///     RectifyError: an image of another size.
    #[pyo3(signature = (image, *, border = 0.0))]
    fn apply<'py>(
        &self,
        py: Python<'py>,
        image: &Bound<'py, PyAny>,
        border: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        changed(py, ByTable(self.table.clone()), image, border)
    }

    /// Which output pixels have data, shape (height, width).
    #[getter]
    fn valid<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<bool>>> {
        array(py, self.table.mask())
    }

    /// The photograph's pixel that every output pixel is sampled at, shape (height, width, 2); NaN without data.
    #[getter]
    fn sources<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, numpy::PyArray3<f64>>> {
        let (width, height) = self.table.output_size();
        let at = |y, x, axis| self.table.source(x, y).unwrap_or(Vec2::repeat(f64::NAN))[axis];
        crate::arrays::stacked(py, height, (width, 2), at)
    }
}
