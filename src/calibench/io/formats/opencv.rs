//! OpenCV's FileStorage: YAML, XML and JSON, with the names that OpenCV's own calibration program writes.
//!
//! `camera_matrix` is `[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]`, `distortion_coefficients` as in
//! [`super::lens`], those of a fisheye where `fisheye_model` is 1; the centre of the first pixel is (0, 0),
//! as in `cv::initUndistortRectifyMap`, which asks for the colour of pixel (0, 0) at u = v = 0.
//! `cv::projectPoints` ignores the skew of a matrix, so a matrix with one is refused. (OpenCV documentation,
//! "Camera Calibration and 3D Reconstruction", "File Input and Output using XML / YAML / JSON files".)

use super::camera_file::CameraFile;
use super::decimal::decimals;
use super::error::FormatError;
use super::node::{Field, Node, Source};
use super::{Format, Found, Room, Size, flow, lens, xml, yaml};
use crate::camera::{Camera, Lens, Model};

const ROOM: Room = Room {
    lenses: &[Model::BrownConrady, Model::Rational, Model::ThinPrism, Model::Tilted, Model::KannalaBrandt],
    behind: &[],
    skew: false,
    covariance: false,
    pose: false,
    name: false,
    size: Size::Kept,
};

pub(super) const YAML: Format = Format {
    name: "opencv-yaml",
    of: "OpenCV",
    endings: &["yaml", "yml"],
    first_pixel: 0.0,
    coefficients: lens::IN_OPENCVS_ORDER,
    room: ROOM,
    looks_like: |text| is_yaml(text) && NAMES_OF_K.iter().any(|name| text.contains(name)),
    read: |source| read(source, &yaml::document(source)?),
    write: |camera, _| Ok(write_yaml(camera).into()),
};

pub(super) const XML: Format = Format {
    name: "opencv-xml",
    of: "OpenCV",
    endings: &["xml"],
    first_pixel: 0.0,
    coefficients: lens::IN_OPENCVS_ORDER,
    room: ROOM,
    looks_like: |text| text.contains("<opencv_storage>"),
    read: |source| read(source, &xml::document(source)?),
    write: |camera, _| Ok(write_xml(camera).into()),
};

pub(super) const JSON: Format = Format {
    name: "opencv-json",
    of: "OpenCV",
    // `.json` is this library's own: this one must be named.
    endings: &[],
    first_pixel: 0.0,
    coefficients: lens::IN_OPENCVS_ORDER,
    room: ROOM,
    looks_like: |text| text.trim_start().starts_with('{') && text.contains("\"opencv-matrix\""),
    read: |source| read(source, &flow::json(source)?),
    write: |camera, _| Ok(write_json(camera).into()),
};

fn is_yaml(text: &str) -> bool {
    text.starts_with("%YAML") || text.contains("!!opencv-matrix")
}

/// Names under which programs keep the camera's matrix and the lens.
const NAMES_OF_K: [&str; 6] =
    ["camera_matrix", "cameraMatrix", "Camera_Matrix", "intrinsic_matrix", "mtx", "K"];
const NAMES_OF_LENS: [&str; 7] = [
    "distortion_coefficients",
    "distCoeffs",
    "Distortion_Coefficients",
    "distortion_coeffs",
    "dist_coeffs",
    "dist",
    "D",
];

fn read(source: &Source, node: &Node) -> Result<Vec<Found>, FormatError> {
    let root = Field::root(*source, node);
    let matrix = root.get_any(&NAMES_OF_K).ok_or_else(|| root.missing("camera_matrix"))?;
    let linear = linear_of(&matrix, &matrix.matrix()?)?;
    let mut assumed = Vec::new();
    let distortion = match (is_fisheye(&root)?, root.get_any(&NAMES_OF_LENS)) {
        (true, Some(field)) => fisheye_of(&field, &field.matrix()?)?,
        (true, None) => return Err(root.missing("distortion_coefficients")),
        (false, Some(field)) => lens::from_opencv_order(source, field.node.offset, &field.matrix()?)?,
        (false, None) => {
            assumed.push("no distortion coefficients stand in the file: an ideal lens".to_string());
            lens::ideal()
        }
    };
    let camera = lens::camera(linear, distortion);
    Ok(vec![CameraFile { image_size: image_size(&root)?, assumed, ..CameraFile::of(camera) }.into()])
}

/// Whether the coefficients are those of `cv::fisheye`.
fn is_fisheye(root: &Field) -> Result<bool, FormatError> {
    let stated = root.get_any(&["fisheye_model", "fisheye"]);
    Ok(stated.map(|field| field.text()).transpose()?.is_some_and(|text| !matches!(text, "0" | "false")))
}

/// The fisheye of four numbers.
pub(super) fn fisheye_of(field: &Field, numbers: &[f64]) -> Result<Lens, FormatError> {
    let lens = lens::fisheye(numbers).filter(|_| numbers.len() == 4);
    lens.ok_or_else(|| {
        field.wrong(format!("a fisheye has 4 coefficients, k1 k2 k3 k4, got {}", numbers.len()))
    })
}

/// fx, fy, cx, cy of `K`, nine numbers row by row.
pub(super) fn linear_of(field: &Field, k: &[f64]) -> Result<[f64; 4], FormatError> {
    let [fx, skew, cx, zero_fy, fy, cy, zero_x, zero_y, one] = k[..] else {
        return Err(field.wrong(format!("9 numbers are expected, got {}", k.len())));
    };
    if skew != 0.0 {
        return Err(field.wrong(format!(
            "skew {skew}, which OpenCV ignores when it projects: a value for it is a mistake"
        )));
    }
    if (zero_fy, zero_x, zero_y, one) != (0.0, 0.0, 0.0, 1.0) {
        return Err(field.wrong("[fx, 0, cx, 0, fy, cy, 0, 0, 1] is expected"));
    }
    Ok([fx, fy, cx, cy])
}

fn image_size(root: &Field) -> Result<Option<(usize, usize)>, FormatError> {
    let width = root.get_any(&["image_width", "image_Width", "width"]);
    let height = root.get_any(&["image_height", "image_Height", "height"]);
    match (width, height) {
        (Some(width), Some(height)) => Ok(Some((width.side()?, height.side()?))),
        _ => Ok(None),
    }
}

/// A matrix as OpenCV keeps it: name, rows, columns, numbers.
type Matrix = (&'static str, usize, usize, Vec<f64>);

fn matrices(camera: &Camera<Lens>) -> [Matrix; 2] {
    let Camera { fx, fy, cx, cy, distortion, .. } = *camera;
    let k = vec![fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0];
    let lens = distortion.coefficients().to_vec();
    [("camera_matrix", 3, 3, k), ("distortion_coefficients", lens.len(), 1, lens)]
}

/// The whole numbers of a file: the image's sides, and that a lens is a fisheye.
fn whole_numbers(camera: &CameraFile) -> Vec<(&'static str, usize)> {
    let sides = |(width, height)| vec![("image_width", width), ("image_height", height)];
    let mut numbers = camera.image_size.map_or(Vec::new(), sides);
    if camera.camera.distortion.model() == Model::KannalaBrandt {
        numbers.push(("fisheye_model", 1));
    }
    numbers
}

fn write_yaml(camera: &CameraFile) -> String {
    let whole: String =
        whole_numbers(camera).iter().map(|(name, number)| format!("{name}: {number}\n")).collect();
    let matrix = |(name, rows, columns, data): Matrix| {
        let data = decimals(&data, ", ");
        format!(
            "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: [ {data} ]\n"
        )
    };
    format!("%YAML:1.0\n---\n{whole}{}", matrices(&camera.camera).map(matrix).concat())
}

fn write_xml(camera: &CameraFile) -> String {
    let whole: String =
        whole_numbers(camera).iter().map(|(name, number)| format!("<{name}>{number}</{name}>\n")).collect();
    let matrix = |(name, rows, columns, data): Matrix| {
        let data = decimals(&data, " ");
        format!(
            "<{name} type_id=\"opencv-matrix\">\n  <rows>{rows}</rows>\n  <cols>{columns}</cols>\n  <dt>d</dt>\n  <data>\n    \
             {data}</data></{name}>\n"
        )
    };
    let matrices = matrices(&camera.camera).map(matrix).concat();
    format!("<?xml version=\"1.0\"?>\n<opencv_storage>\n{whole}{matrices}</opencv_storage>\n")
}

fn write_json(camera: &CameraFile) -> String {
    let whole: String =
        whole_numbers(camera).iter().map(|(name, number)| format!("    \"{name}\": {number},\n")).collect();
    let matrix = |(name, rows, columns, data): Matrix| {
        let data = decimals(&data, ", ");
        format!(
            "    \"{name}\": {{\n        \"type_id\": \"opencv-matrix\",\n        \"rows\": {rows},\n        \"cols\": {columns},\n        \
             \"dt\": \"d\",\n        \"data\": [ {data} ]\n    }}"
        )
    };
    format!("{{\n{whole}{}\n}}\n", matrices(&camera.camera).map(matrix).join(",\n"))
}
