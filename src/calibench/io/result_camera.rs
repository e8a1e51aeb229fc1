//! How is the camera of a `result.json` read? Of its own files and of others that name its numbers so, and of
//! none that would be read in part.

use super::input::{InputError, MOST_SIDE_PX, MOST_TABLE_BYTES, read_regular_text};
use super::plausible::implausible;
use super::result::LensFields;
use super::shown::ShownPath;
use crate::calibrate::Termination;
use crate::camera::{Camera, Lens, Model, Parameter};
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;
use std::path::Path;

/// What another command needs of a result; further fields are ignored.
#[derive(Debug, Deserialize)]
#[serde(expecting = "an object with `camera`")]
struct CameraOnly {
    camera: LensFields,
    #[serde(default)]
    image_size: ImageSize,
    #[serde(default)]
    termination: Option<String>,
    /// What was estimated, of a result: the camera must have it.
    #[serde(default)]
    free: Vec<String>,
    // What would be part of the camera, were it in `camera`: left beside it, another camera would be read.
    model: Option<IgnoredAny>,
    distortion: Option<IgnoredAny>,
    distortion_model: Option<IgnoredAny>,
    distortion_coefficients: Option<IgnoredAny>,
    dist_coeffs: Option<IgnoredAny>,
}

impl CameraOnly {
    /// What stands beside the camera and belongs into it.
    fn beside(&self) -> Option<&'static str> {
        let named = [
            ("model", &self.model),
            ("distortion", &self.distortion),
            ("distortion_model", &self.distortion_model),
            ("distortion_coefficients", &self.distortion_coefficients),
            ("dist_coeffs", &self.dist_coeffs),
        ];
        named.into_iter().find(|(_, value)| value.is_some()).map(|(name, _)| name)
    }
}

/// The names of a camera's numbers.
#[derive(Debug, Deserialize)]
#[serde(expecting = "an object with `camera`")]
struct NamesOnly {
    camera: BTreeMap<String, IgnoredAny>,
}

/// Why a result cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ResultError {
    /// The file cannot be read.
    #[error(transparent)]
    Input(#[from] InputError),
    /// It is not such a result.
    #[error("{file}:{}:{}: {cause}; expected {{\"camera\": {{\"fx\": ..., \"fy\": ..., \"cx\": ..., \"cy\": ...}}}}", cause.line(), cause.column())]
    Format {
        /// The file.
        file: String,
        /// What is wrong, with line and column.
        cause: serde_json::Error,
    },
    /// The calibration found no minimum: its camera is wherever the search ended.
    #[error(
        "{file}: the calibration ended as `{termination}`, not `converged`, so its camera is not to be used: calibrate again"
    )]
    NotConverged {
        /// The file.
        file: String,
        /// How it ended.
        termination: String,
    },
    /// The camera has a lens of another model than can be used here.
    #[error("{file}: a camera with a {model} lens cannot be used here: this needs brown-conrady")]
    OtherModel {
        /// The file.
        file: String,
        /// The model.
        model: Model,
    },
    /// No camera has these numbers.
    #[error("{file}: {reason}")]
    NoCamera {
        /// The file.
        file: String,
        /// Which, and what would do.
        reason: String,
    },
    /// No image has this size.
    #[error("{file}: image_size: each side must have 1 to {most} px, and it has {width} x {height}; leave it out where it is not known",
        most = MOST_SIDE_PX)]
    NoImage {
        /// The file.
        file: String,
        /// As stated, px.
        width: usize,
        /// As stated, px.
        height: usize,
    },
}

/// Reads the camera, and the image size if it is there, of a `result.json`.
///
/// # Errors
/// See [`ResultError`].
///
/// ```
/// use calibench::calibrate::{Settings, calibrate};
/// use calibench::io::{CalibrationFields, read_camera, write_atomically};
/// use calibench::synth::Scene;
///
/// let result = calibrate(&Scene::example().exact(), &Settings::standard())?;
/// let names: Vec<String> = (1..=4).map(|view| format!("view {view}")).collect();
/// let file = std::env::temp_dir().join("calibench-example-result.json");
/// write_atomically(&file, CalibrationFields::of(&result.clone().into(), &names, Some((640, 480))).to_json().as_bytes())?;
/// // The numbers are written with all their digits: the same camera comes back.
/// assert_eq!(read_camera(&file)?, (result.camera, Some((640, 480))));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn read_camera(path: &Path) -> Result<(Camera, ImageSize), ResultError> {
    let file = path.shown();
    parse_camera(&file, &read_regular_text(path, MOST_TABLE_BYTES)?)
}

/// Width and height, px, where a file states them.
pub type ImageSize = Option<(usize, usize)>;

/// As [`read_camera`], of any lens model.
///
/// # Errors
/// See [`ResultError`].
pub fn read_lens_camera(path: &Path) -> Result<(Camera<Lens>, ImageSize), ResultError> {
    let file = path.shown();
    parse_lens_camera(&file, &read_regular_text(path, MOST_TABLE_BYTES)?)
}

/// As [`read_lens_camera`], from text; `file` names it in errors.
///
/// # Errors
/// See [`ResultError`].
pub fn parse_lens_camera(file: &str, text: &str) -> Result<(Camera<Lens>, ImageSize), ResultError> {
    let fields: CameraOnly =
        serde_json::from_str(text).map_err(|cause| ResultError::Format { file: file.into(), cause })?;
    refuse_parts(file, &fields, text)?;
    let LensFields(camera) = fields.camera;
    refuse_unfinished(file, fields.termination)?;
    if let Some(reason) = implausible(&camera) {
        return Err(ResultError::NoCamera { file: file.into(), reason });
    }
    match fields.image_size {
        Some((width, height)) if width.min(height) == 0 || width.max(height) > MOST_SIDE_PX => {
            Err(ResultError::NoImage { file: file.into(), width, height })
        }
        size => Ok((camera, size)),
    }
}

/// Refuses a file of which a part of the camera would not be read, or was lost.
fn refuse_parts(file: &str, fields: &CameraOnly, text: &str) -> Result<(), ResultError> {
    let no_camera = |reason| Err(ResultError::NoCamera { file: file.into(), reason });
    if let Some(name) = fields.beside() {
        let places = "`camera` has `model` and each coefficient by its name, such as \"k1\": -0.2";
        return no_camera(format!("{name} stands beside `camera`, where it is not read: {places}"));
    }
    if fields.free.is_empty() {
        return Ok(());
    }
    let NamesOnly { camera } =
        serde_json::from_str(text).map_err(|cause| ResultError::Format { file: file.into(), cause })?;
    // Names that the model does not have are told where the covariance is read.
    let is_of_model = |name: &str| name.parse().is_ok_and(|p: Parameter| fields.camera.0.value(p).is_some());
    let is_lost = |name: &&String| is_of_model(name) && !camera.contains_key(*name);
    match fields.free.iter().find(is_lost) {
        Some(lost) => no_camera(format!(
            "{lost} was estimated (`free`), and `camera` has none: it is not the file that was written"
        )),
        None => Ok(()),
    }
}

fn refuse_unfinished(file: &str, termination: Option<String>) -> Result<(), ResultError> {
    let is_minimum =
        |how: &str| [Termination::Converged, Termination::AboveFloor].iter().any(|t| how == t.name());
    match termination.filter(|how| !is_minimum(how)) {
        Some(termination) => Err(ResultError::NotConverged { file: file.into(), termination }),
        None => Ok(()),
    }
}

/// As [`read_camera`], from text; `file` names it in errors.
///
/// # Errors
/// See [`ResultError`].
pub fn parse_camera(file: &str, text: &str) -> Result<(Camera, ImageSize), ResultError> {
    let (camera, size) = parse_lens_camera(file, text)?;
    let model = camera.distortion.model();
    let plain = camera.brown_conrady().ok_or(ResultError::OtherModel { file: file.into(), model })?;
    Ok((plain, size))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_survives_the_way_through_a_file() {
        let camera =
            Camera::from_parameters([600.1, 599.7, 326.0, 243.0, 0.1, -0.18, 0.05, 1e-3, -1e-3, 0.0]);
        let text =
            serde_json::json!({"camera": LensFields(camera.into()), "image_size": [640, 480], "extra": 1});
        assert_eq!(parse_camera("f", &text.to_string()).unwrap(), (camera, Some((640, 480))));
    }

    #[test]
    fn a_calibration_that_did_not_converge_gives_no_camera() {
        let text = |how: &str| {
            format!(r#"{{"camera": {{"fx": 600, "fy": 600, "cx": 320, "cy": 240}}, "termination": "{how}"}}"#)
        };
        assert!(parse_camera("r.json", &text("converged")).is_ok());
        for how in ["iteration-limit", "stalled"] {
            let error = parse_camera("r.json", &text(how)).unwrap_err();
            assert!(error.to_string().contains(how), "{error}");
        }
    }

    #[test]
    fn broken_files_are_refused_with_their_place() {
        let error = parse_camera("r.json", "{\"camera\": {\"fx\": 1,\n \"fy\": x}}").unwrap_err().to_string();
        assert!(error.starts_with("r.json:2:"), "{error}");
        let fisheye = "{\"camera\": {\"model\": \"kannala-brandt\",\n \"fx\": 1e999}}";
        let error = parse_lens_camera("r.json", fisheye).unwrap_err().to_string();
        assert!(error.starts_with("r.json:2:") && !error.contains("model"), "{error}");
        let no_camera = r#"{"camera": {"fx": -1, "fy": 1, "cx": 0, "cy": 0}}"#;
        assert!(matches!(parse_camera("r.json", no_camera), Err(ResultError::NoCamera { .. })));
    }

    #[test]
    fn no_camera_is_read_otherwise_than_it_was_written() {
        let refused = |camera: &str, rest: &str| {
            let text =
                format!("{{\"camera\": {{\"fx\": 1, \"fy\": 1, \"cx\": 0, \"cy\": 0{camera}}}{rest}}}");
            parse_lens_camera("r.json", &text).unwrap_err().to_string()
        };
        let kannala_brandt = r#", "model": "kannala-brandt""#;
        assert!(refused(&kannala_brandt.repeat(2), "").contains("model is given twice"));
        assert!(refused(&format!("{kannala_brandt}, \"fx\": 2"), "").contains("fx is given twice"));
        assert!(refused(r#", "k4": 0.1"#, "").contains("the brown-conrady model has no k4"));
        assert!(refused(r#", "focus": 0.1"#, "").contains("focus"));
        for beside in ["model", "distortion", "dist_coeffs"] {
            let error = refused("", &format!(", \"{beside}\": [0.1]"));
            assert!(error.contains(&format!("{beside} stands beside `camera`")), "{error}");
        }
        let error = refused("", ", \"free\": [\"fx\", \"k1\"]");
        assert!(error.contains("k1 was estimated"), "{error}");
        for size in ["[0, 480]", "[640, 0]", "[640, 10000000000]"] {
            let error = refused("", &format!(", \"image_size\": {size}"));
            assert!(error.contains("each side must have 1 to"), "{error}");
        }
    }
}
