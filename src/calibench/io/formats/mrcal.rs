//! mrcal: `.cameramodel`, a literal of Python with the lens's name, its numbers, the camera's place and the
//! image's size.
//!
//! `intrinsics` are `fx, fy, cx, cy` and the lens in OpenCV's order; the centre of the first pixel is (0, 0);
//! `extrinsics` is a rotation vector (rad) and a translation that take reference to camera coordinates,
//! `rt_cam_ref`. (mrcal documentation, "Camera model representation", "Lens models", "Conventions".)

use super::camera_file::CameraFile;
use super::decimal::decimals;
use super::error::FormatError;
use super::node::{Field, Source};
use super::{Format, Found, Room, Size, Written, flow, lens};
use crate::camera::{Camera, Model};
use crate::geometry::{Pose, Vec3, rotation};

pub(super) const FORMAT: Format = Format {
    name: "mrcal",
    of: "mrcal",
    endings: &["cameramodel"],
    first_pixel: 0.0,
    coefficients: lens::IN_OPENCVS_ORDER,
    room: Room {
        lenses: &[Model::BrownConrady, Model::Rational, Model::ThinPrism],
        behind: &[],
        skew: false,
        covariance: false,
        pose: true,
        name: false,
        size: Size::Needed,
    },
    looks_like: |text| ["'lensmodel'", "\"lensmodel\"", "'lens_model'"].iter().any(|key| text.contains(key)),
    read,
    write: |camera, _| Ok(write(camera)),
};

/// The models with OpenCV's coefficients, and how many they have.
const OPENCV: [(&str, usize); 5] = [
    ("LENSMODEL_PINHOLE", 0),
    ("LENSMODEL_OPENCV4", 4),
    ("LENSMODEL_OPENCV5", 5),
    ("LENSMODEL_OPENCV8", 8),
    ("LENSMODEL_OPENCV12", 12),
];

fn read(source: &Source) -> Result<Vec<Found>, FormatError> {
    let node = flow::document(source)?;
    let root = Field::root(*source, &node);
    let model = root.need("lensmodel")?.text()?;
    let Some(count) = OPENCV.iter().find(|(name, _)| *name == model).map(|(_, count)| *count) else {
        return Err(source.lens(super::node::shortened(model), lens::REFIT_BY_MRCAL));
    };
    let field = root.need("intrinsics")?;
    let numbers = field.numbers()?;
    let (4, linear) = (numbers.len().wrapping_sub(count), numbers.first_chunk().copied().unwrap_or_default())
    else {
        return Err(field.wrong(format!("{model} has {} numbers, got {}", 4 + count, numbers.len())));
    };
    let distortion = lens::from_opencv_order(source, field.node.offset, &numbers[4..])?;
    let [width, height] = root.need("imagersize")?.numbers()?[..] else {
        return Err(root.need("imagersize")?.wrong("width and height are expected"));
    };
    let size = |side: f64| {
        super::node::side(side)
            .ok_or_else(|| root.wrong(format!("imagersize: {side} is no number of pixels")))
    };
    let pose = root.get_any(&["extrinsics", "rt_cam_ref"]).map(|field| field.array::<6>()).transpose()?;
    let pose = pose.map(|[rx, ry, rz, x, y, z]| Pose {
        rotation: rotation::exp(&Vec3::new(rx, ry, rz)),
        translation: Vec3::new(x, y, z),
    });
    let further = ["optimization_inputs", "valid_intrinsics_region", "icam_intrinsics"];
    let notes = further
        .iter()
        .filter(|key| root.get(key).is_some())
        .map(|key| format!("{key} is not kept"))
        .collect();
    Ok(vec![
        CameraFile {
            image_size: Some((size(width)?, size(height)?)),
            cam_from_reference: pose.filter(|pose| *pose != Pose::identity()),
            notes,
            ..CameraFile::of(lens::camera(linear, distortion))
        }
        .into(),
    ])
}

fn write(camera: &CameraFile) -> Written {
    let Camera { fx, fy, cx, cy, distortion, .. } = camera.camera;
    // The longest of mrcal's models holds whatever `lenses` lets in.
    let counts = OPENCV.map(|(_, count)| count);
    let count = lens::least_count(&distortion, &counts).unwrap_or_default();
    let model = OPENCV.iter().find(|(_, n)| *n == count).map_or("", |(name, _)| *name);
    let (width, height) = camera.image_size.unwrap_or_default();
    let pose = camera.cam_from_reference.unwrap_or_else(Pose::identity);
    let (r, t) = (rotation::log(&pose.rotation), pose.translation);
    let intrinsics = [vec![fx, fy, cx, cy], lens::padded(&distortion, count)].concat();
    let text = format!(
        "{{\n    'lensmodel':  '{model}',\n\n    # fx, fy, cx, cy and the lens\n    'intrinsics': [ {}, ],\n\n    \
         # rotation vector and translation from the reference to the camera\n    'extrinsics': [ {}, ],\n\n    'imagersize': [ {width}, {height}, ],\n}}\n",
        decimals(&intrinsics, ", "),
        decimals(&[r.x, r.y, r.z, t.x, t.y, t.z], ", "),
    );
    text.into()
}
