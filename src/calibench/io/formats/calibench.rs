//! This library's own JSON: `result.json` of a calibration, or no more than a camera.
//!
//! The centre of the first pixel is (0, 0); parameters stand under their names. `camera.schema.json` is its
//! schema.

use super::super::doubts::doubts;
use super::super::known::is_possible;
use super::super::result::LensFields;
use super::super::result_camera::parse_lens_camera;
use super::camera_file::{CameraFile, Estimated};
use super::error::FormatError;
use super::node::Source;
use super::{Format, Found, Room, Size, Written};
use crate::camera::{FreeParameters, Model, Parameter};
use crate::geometry::{Pose, Vec3, rotation};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// The JSON schema of what is written and read.
pub const SCHEMA: &str = include_str!("camera.schema.json");

pub(super) const FORMAT: Format = Format {
    name: "calibench",
    of: "calibench",
    endings: &["json"],
    first_pixel: 0.0,
    coefficients: "by name",
    room: Room {
        lenses: &Model::ALL,
        behind: &Model::ALL,
        skew: true,
        covariance: true,
        pose: true,
        name: true,
        size: Size::Kept,
    },
    looks_like: |text| {
        text.trim_start().starts_with('{') && text.contains("\"camera\"") && text.contains("\"fx\"")
    },
    read,
    write: |camera, _| Ok(write(camera)),
};

/// What stands in a file beside the camera and the image's size.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Fields {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    written_by: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    name: Option<String>,
    camera: LensFields,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    image_size: Option<(usize, usize)>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    free: Vec<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    fy_per_fx: Option<f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    covariance: Vec<Vec<f64>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    degrees_of_freedom: Option<usize>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    cam_from_reference: Option<PoseFields>,
    /// Of a result all; only those that doubt the covariance are kept.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    warnings: Vec<String>,
    /// Only whether there are any.
    #[serde(default, skip_serializing)]
    views: Option<serde::de::IgnoredAny>,
}

/// A pose as numbers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PoseFields {
    rotation_vector_rad: [f64; 3],
    translation: [f64; 3],
}

fn read(source: &Source) -> Result<Vec<Found>, FormatError> {
    let (camera, image_size) = parse_lens_camera(source.file, source.text)?;
    let syntax = |error: serde_json::Error| FormatError::Syntax {
        file: source.file.into(),
        line: error.line(),
        column: error.column(),
        message: error.to_string(),
    };
    let fields: Fields = serde_json::from_str(source.text).map_err(syntax)?;
    let views = fields.views.is_some();
    let pose = fields.cam_from_reference.map(|pose| Pose {
        rotation: rotation::exp(&Vec3::from(pose.rotation_vector_rad)),
        translation: Vec3::from(pose.translation),
    });
    let note = "the views with their residuals, and what was found about the calibration, are not kept";
    Ok(vec![
        CameraFile {
            image_size,
            estimated: estimated(source, &fields, camera.distortion.model())?,
            cam_from_reference: pose,
            notes: views.then(|| note.to_string()).into_iter().collect(),
            name: fields.name,
            ..CameraFile::of(camera)
        }
        .into(),
    ])
}

fn estimated(source: &Source, fields: &Fields, model: Model) -> Result<Option<Estimated>, FormatError> {
    if fields.covariance.is_empty() {
        return Ok(None);
    }
    let at = |key: &str| source.text.find(&format!("\"{key}\"")).unwrap_or(0);
    let wrong = |key: &str, message: String| Err(source.value(at(key), key, message));
    let mut free = FreeParameters::NONE;
    for name in &fields.free {
        match name.parse::<Parameter>() {
            Ok(parameter) if !model.parameters().any(|other| other == parameter) => {
                return wrong("free", format!("the {model} model has no {parameter}"));
            }
            Ok(parameter) if free.is_empty() || free.iter().last() < Some(parameter) => {
                free = free.with(parameter)
            }
            Ok(parameter) => return wrong("free", format!("{parameter} is out of order")),
            Err(error) => return wrong("free", error.to_string()),
        }
    }
    let n = free.len();
    let square = fields.covariance.len() == n && fields.covariance.iter().all(|row| row.len() == n);
    if !square {
        return wrong("covariance", format!("{n} rows of {n} numbers are expected, as many as are free"));
    }
    let covariance = DMatrix::from_fn(n, n, |i, j| fields.covariance[i][j]);
    if covariance.iter().any(|value| !value.is_finite()) {
        return wrong("covariance", "a number is not finite".into());
    }
    if !is_possible(n, &|i, j| covariance[(i, j)]) {
        let message =
            "variances of 0 or more are expected, and correlations from -1 to 1, both ways the same";
        return wrong("covariance", message.into());
    }
    // Nothing tells the noise that the covariance is scaled by.
    if fields.degrees_of_freedom == Some(0) {
        return Ok(None);
    }
    let (fy_per_fx, degrees_of_freedom) = (fields.fy_per_fx, fields.degrees_of_freedom);
    let doubts = doubts(fields.warnings.clone());
    Ok(Some(Estimated { free, fy_per_fx, covariance, degrees_of_freedom, doubts }))
}

fn write(camera: &CameraFile) -> Written {
    let estimated = camera.estimated.as_ref();
    let rows = |e: &Estimated| e.covariance.row_iter().map(|row| row.iter().copied().collect()).collect();
    let fields = Fields {
        written_by: Some(format!("calibench {}", env!("CARGO_PKG_VERSION"))),
        name: camera.name.clone(),
        camera: LensFields(camera.camera),
        image_size: camera.image_size,
        free: estimated.map_or(Vec::new(), |e| e.free.iter().map(|p| p.name().to_string()).collect()),
        fy_per_fx: estimated.and_then(|e| e.fy_per_fx),
        covariance: estimated.map_or(Vec::new(), rows),
        degrees_of_freedom: estimated.and_then(|e| e.degrees_of_freedom),
        cam_from_reference: camera.cam_from_reference.map(|pose| PoseFields {
            rotation_vector_rad: rotation::log(&pose.rotation).into(),
            translation: pose.translation.into(),
        }),
        warnings: estimated.map_or(Vec::new(), |e| e.doubts.clone()),
        views: None,
    };
    // Plain fields and string keys: nothing in them can fail to serialise.
    let text = serde_json::to_string_pretty(&fields).expect("a camera serialises") + "\n";
    text.into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{Camera, Lens};
    use serde_json::Value;
    use std::collections::BTreeSet;

    /// A file in which every field stands.
    fn whole() -> CameraFile {
        CameraFile {
            name: Some("left".into()),
            image_size: Some((640, 480)),
            estimated: Some(Estimated {
                free: FreeParameters::of(&[Parameter::Fx, Parameter::Cx]),
                fy_per_fx: Some(1.25),
                covariance: DMatrix::from_row_slice(2, 2, &[1.0, 0.1, 0.1, 2.0]),
                degrees_of_freedom: Some(100),
                doubts: vec![
                    "the standard deviation of fx misleads: an interval of two of them is not one of 95 %"
                        .into(),
                ],
            }),
            cam_from_reference: Some(Pose {
                rotation: rotation::exp(&Vec3::new(0.1, 0.2, 0.3)),
                translation: Vec3::new(1.0, 2.0, 3.0),
            }),
            ..CameraFile::of(Camera::pinhole(600.0, 601.0, 320.0, 240.0))
        }
    }

    #[test]
    fn everything_survives_the_way_through_a_file() {
        let text = write(&whole()).text;
        let back = read(&Source { file: "f", text: &text }).unwrap().remove(0).camera.unwrap();
        assert_eq!(
            (back.camera, back.image_size, &back.estimated),
            (whole().camera, whole().image_size, &whole().estimated)
        );
        let (a, b) = (back.cam_from_reference.unwrap(), whole().cam_from_reference.unwrap());
        assert!((a.rotation - b.rotation).norm() < 1e-15 && a.translation == b.translation);
    }

    #[test]
    fn the_schema_names_every_field_that_is_written_and_no_other() {
        let schema: Value = serde_json::from_str(SCHEMA).unwrap();
        let written: Value = serde_json::from_str(&write(&whole()).text).unwrap();
        let names = |value: &Value| value.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
        let of_schema = |path: &str| names(schema.pointer(path).unwrap());
        assert_eq!(of_schema("/properties"), names(&written));
        let of_model = |model: Model| {
            let camera = Camera::with_lens(600.0, 600.0, 320.0, 240.0, Lens::ideal(model));
            let written: Value = serde_json::from_str(&write(&CameraFile::of(camera)).text).unwrap();
            names(&written["camera"])
        };
        let of_cameras: BTreeSet<String> = Model::ALL.into_iter().flat_map(of_model).collect();
        assert_eq!(
            of_schema("/properties/camera/properties").into_iter().collect::<BTreeSet<_>>(),
            of_cameras
        );
        let listed = |path: &str| -> Vec<String> {
            serde_json::from_value(schema.pointer(path).unwrap().clone()).unwrap()
        };
        assert_eq!(listed("/properties/camera/properties/model/enum"), Model::ALL.map(Model::name));
        assert_eq!(listed("/properties/free/items/enum"), Parameter::OF_ALL_MODELS.map(Parameter::name));
        assert_eq!(
            of_schema("/properties/cam_from_reference/properties"),
            names(&written["cam_from_reference"])
        );
    }

    #[test]
    fn a_covariance_that_does_not_fit_its_parameters_is_refused_with_its_line() {
        let camera = r#"{"camera": {"fx": 1, "fy": 1, "cx": 0, "cy": 0},"#;
        let cases = [
            ("\"free\": [\"fx\"],\n\"covariance\": [[1, 2]]}", "f:2:1: covariance: 1 rows of 1 numbers"),
            ("\"free\": [\"cx\", \"fx\"], \"covariance\": [[1]]}", "free: fx is out of order"),
            ("\"free\": [\"alpha\"], \"covariance\": [[1]]}", "the brown-conrady model has no alpha"),
            ("\"free\": [\"fx\"], \"covariance\": [[-1]]}", "f:1:65: covariance: variances of 0 or more"),
            ("\"free\": [\"fx\"], \"covariance\": [[1e308]]}", "covariance: variances of 0 or more"),
            ("\"free\": [\"f\"], \"covariance\": [[1]]}", "unknown camera parameter `f`"),
        ];
        for (rest, expected) in cases {
            let text = format!("{camera}{rest}");
            let error = read(&Source { file: "f", text: &text }).unwrap_err().to_string();
            assert!(error.contains(expected), "{error}");
        }
    }
}
