//! What does Python ask of the estimator? Options by name, as on the command line.

use crate::arguments::{self, image_size, value};
use crate::camera::{Camera, model, parameter};
use crate::errors;
use calibench::calibrate::{Board, Loss, Settings};
use calibench::camera::{FreeParameters, Model};
use calibench::io::loss_from_text;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The options.
const OPTIONS: [&str; 13] = [
    "model",
    "free",
    "image_size",
    "hold",
    "tie",
    "priors",
    "loss",
    "board_shape",
    "start",
    "intervals",
    "max_iterations",
    "polish",
    "search",
];

/// The settings of options by name.
pub(crate) fn settings(py: Python<'_>, options: Option<&Bound<'_, PyDict>>) -> PyResult<Settings> {
    let Some(options) = options else { return Ok(Settings::standard()) };
    let given = |name: &str| Ok::<_, PyErr>(options.get_item(name)?.filter(|value| !value.is_none()));
    let lens =
        given("model")?.map_or(Ok(Model::default()), |name| model(py, &value::<String>(&name, "model")?))?;
    let mut settings = match given("free")? {
        Some(free) => Settings::new(free_parameters(&free)?).with_model(lens),
        None => Settings::of_model(lens),
    };
    for (name, given) in options {
        let name: String = name.extract()?;
        if !OPTIONS.contains(&name.as_str()) {
            return Err(PyTypeError::new_err(format!(
                "no option {name:?}; there are: {}",
                OPTIONS.join(" ")
            )));
        }
        if !given.is_none() {
            settings = with_option(settings, &name, &given)?;
        }
    }
    Ok(settings)
}

/// `"fx,fy,k1"`, or names one by one.
pub(crate) fn free_parameters(value: &Bound<'_, PyAny>) -> PyResult<FreeParameters> {
    let unknown = |e| errors::plain(value.py(), "SettingsError", "UnknownParameter", &e);
    match value.extract::<String>() {
        Ok(list) => list.parse().map_err(unknown),
        Err(_) => arguments::value::<Vec<String>>(value, "free")?.join(",").parse().map_err(unknown),
    }
}

fn with_option(mut settings: Settings, name: &str, given: &Bound<'_, PyAny>) -> PyResult<Settings> {
    let py = given.py();
    match name {
        "image_size" => settings.image_size = Some(image_size(given, name)?),
        "hold" => {
            for (of, held) in by_name(given, name)? {
                let held = value(&held, &format!("{name}[{of:?}]"))?;
                settings = settings.hold(parameter(py, &of)?, held);
            }
        }
        "tie" => settings = settings.tie_focal_lengths(value(given, name)?),
        "priors" => {
            for (of, known) in by_name(given, name)? {
                let (mean, standard_deviation) = value(&known, &format!("{name}[{of:?}]"))?;
                settings = settings.with_prior(parameter(py, &of)?, mean, standard_deviation);
            }
        }
        "loss" => settings.loss = loss(py, &value::<String>(given, name)?)?,
        "board_shape" => settings.board = board_shape(py, &value::<String>(given, name)?)?,
        "start" => settings.start = Some(start(&value::<Camera>(given, name)?, py)?),
        "intervals" => settings.profile_coverage = Some(coverage(py, value(given, name)?)?),
        "max_iterations" => settings.max_iterations = value(given, name)?,
        "polish" => settings.polish = value(given, name)?,
        "search" => settings.search = value(given, name)?,
        // Model and free parameters are what the settings began with.
        _ => {}
    }
    Ok(settings)
}

/// What is given by the names of parameters.
fn by_name<'py>(given: &Bound<'py, PyAny>, name: &str) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
    let wanted = |_| PyTypeError::new_err(format!("{name}: expected a dict by the names of parameters"));
    let items = given.call_method0("items").map_err(wanted)?;
    items.try_iter()?.map(|item| item?.extract()).collect()
}

fn refused(py: Python<'_>, kind: &str, text: String) -> PyErr {
    errors::exception(py, "SettingsError", text, kind, PyDict::new(py).into_any())
}

/// `squares`, `huber:PX` or `cauchy:PX`.
fn loss(py: Python<'_>, text: &str) -> PyResult<Loss> {
    loss_from_text(text).ok_or_else(|| {
        refused(
            py,
            "Loss",
            format!("loss = {text:?}: expected squares, huber:PX or cauchy:PX, such as huber:0.5"),
        )
    })
}

/// `flat`, `bow:SD` or `bent:SD`, the standard deviation being a number or `free`.
fn board_shape(py: Python<'_>, text: &str) -> PyResult<Board> {
    let deviation = |sd: &str| if sd == "free" { Some(f64::INFINITY) } else { sd.parse().ok() };
    let found = match text.split_once(':') {
        None if text == "flat" => Some(Board::Flat),
        Some(("bow", sd)) => deviation(sd).map(|standard_deviation| Board::Bowed { standard_deviation }),
        Some(("bent", sd)) => deviation(sd).map(|standard_deviation| Board::Bent { standard_deviation }),
        _ => None,
    };
    found.ok_or_else(|| {
        refused(
            py,
            "BoardShape",
            format!("board_shape = {text:?}: expected flat, bow:SD or bent:SD, such as bow:0.5 or bent:free"),
        )
    })
}

fn start(camera: &Camera, py: Python<'_>) -> PyResult<calibench::camera::Camera> {
    let other = || refused(py, "Start", "a start is a camera with the lens model brown-conrady".to_string());
    camera.0.brown_conrady().ok_or_else(other)
}

fn coverage(py: Python<'_>, value: f64) -> PyResult<f64> {
    let no_share = || {
        refused(
            py,
            "Coverage",
            format!("intervals = {value}: expected a probability between 0 and 1, such as 0.95"),
        )
    };
    (value > 0.0 && value < 1.0).then_some(value).ok_or_else(no_share)
}
