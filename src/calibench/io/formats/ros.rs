//! ROS: the YAML of `camera_calibration_parsers`, and what `rostopic echo` prints of a
//! `sensor_msgs/CameraInfo`.
//!
//! `K = [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]`; `D` is in OpenCV's order, five numbers for `plumb_bob`, eight
//! for `rational_polynomial`, and the four of OpenCV's fisheye for `equidistant`; the centre of the first
//! pixel is (0, 0), as in OpenCV, by which `image_geometry` projects. Files are written for a single camera:
//! `R` is the identity and `P` is `K`. (sensor_msgs/CameraInfo documentation; REP 104.)

use super::camera_file::CameraFile;
use super::decimal::decimals;
use super::error::FormatError;
use super::node::{Field, Source, shortened};
use super::opencv::{fisheye_of, linear_of};
use super::{Format, Found, Room, Size, Written, lens, yaml};
use crate::camera::{Camera, Lens, Model};

pub(super) const FORMAT: Format = Format {
    name: "ros",
    of: "ROS",
    endings: &["yaml", "yml"],
    first_pixel: 0.0,
    coefficients: lens::IN_OPENCVS_ORDER,
    room: Room {
        lenses: &[Model::BrownConrady, Model::Rational, Model::KannalaBrandt],
        behind: &[],
        skew: false,
        covariance: false,
        pose: false,
        name: true,
        size: Size::Needed,
    },
    looks_like: |text| {
        // A file of FileStorage may have these names too; then either reader does.
        let has = |key: &str| text.lines().any(|line| line.starts_with(key));
        let message = (has("K:") || has("k:")) && (has("D:") || has("d:"));
        has("distortion_model:") && (has("camera_matrix:") || message)
            || has("camera_matrix:") && has("projection_matrix:")
    },
    read,
    write: |camera, _| Ok(write(camera)),
};

fn read(source: &Source) -> Result<Vec<Found>, FormatError> {
    let node = yaml::document(source)?;
    let root = Field::root(*source, &node);
    let width = root.get_any(&["image_width", "width"]).ok_or_else(|| root.missing("image_width"))?.side()?;
    let height =
        root.get_any(&["image_height", "height"]).ok_or_else(|| root.missing("image_height"))?.side()?;
    let k = root.get_any(&["camera_matrix", "K", "k"]).ok_or_else(|| root.missing("camera_matrix"))?;
    let linear = linear_of(&k, &k.matrix()?)?;
    let d = root
        .get_any(&["distortion_coefficients", "D", "d"])
        .ok_or_else(|| root.missing("distortion_coefficients"))?;
    let model = root.get_any(&["distortion_model", "camera_model"]);
    let model = model.map_or(Ok("plumb_bob"), |model| model.text())?;
    let distortion = match model {
        "plumb_bob" | "rational_polynomial" => lens::from_opencv_order(source, d.node.offset, &d.matrix()?)?,
        "equidistant" => fisheye_of(&d, &d.matrix()?)?,
        other => {
            return Err(
                source.lens(format!("the distortion model {}", shortened(other)), lens::CALIBRATE_AGAIN)
            );
        }
    };
    let name = root.get("camera_name").map(|name| name.text()).transpose()?.map(str::to_string);
    let notes = rectified_note(&root, &linear)?;
    let camera = lens::camera(linear, distortion);
    Ok(vec![CameraFile { name, image_size: Some((width, height)), notes, ..CameraFile::of(camera) }.into()])
}

/// What is said of the matrices for rectified images, unless they say nothing.
fn rectified_note(root: &Field, raw: &[f64; 4]) -> Result<Vec<String>, FormatError> {
    let r = root.get_any(&["rectification_matrix", "R", "r"]).map(|r| r.matrix()).transpose()?;
    let p = root.get_any(&["projection_matrix", "P", "p"]).map(|p| p.matrix()).transpose()?;
    let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let [fx, fy, cx, cy] = *raw;
    let of_raw = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0];
    let says_nothing = r.is_none_or(|r| r == identity) && p.is_none_or(|p| p == of_raw);
    let note = "rectification_matrix and projection_matrix, which are of the rectified image, are not kept";
    Ok(if says_nothing { Vec::new() } else { vec![note.to_string()] })
}

fn write(camera: &CameraFile) -> Written {
    let Camera { fx, fy, cx, cy, ref distortion, .. } = camera.camera;
    let (width, height) = camera.image_size.unwrap_or_default();
    let name = camera.name.as_deref().unwrap_or("camera");
    let block = |key: &str, rows: usize, columns: usize, data: &[f64]| {
        format!("{key}:\n  rows: {rows}\n  cols: {columns}\n  data: [{}]\n", decimals(data, ", "))
    };
    let k = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0];
    let p = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0];
    let identity = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let coefficients = distortion.coefficients();
    let text = [
        format!("image_width: {width}\nimage_height: {height}\ncamera_name: {}\n", plain(name)),
        block("camera_matrix", 3, 3, &k),
        format!("distortion_model: {}\n", name_of(distortion)),
        block("distortion_coefficients", 1, coefficients.len(), coefficients),
        block("rectification_matrix", 3, 3, &identity),
        block("projection_matrix", 3, 4, &p),
    ];
    text.concat().into()
}

/// What ROS calls a lens.
fn name_of(lens: &Lens) -> &'static str {
    match lens.model() {
        Model::KannalaBrandt => "equidistant",
        Model::BrownConrady => "plumb_bob",
        _ => "rational_polynomial",
    }
}

/// A name in letters that mean nothing to YAML.
pub(super) fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_alphanumeric() || matches!(c, '_' | '-' | '.') { c } else { '_' }).collect()
}
