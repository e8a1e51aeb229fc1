//! MATLAB: `jsonencode(toStruct(params))` of a `cameraParameters` or `cameraIntrinsics` object.
//!
//! MATLAB counts pixels from 1: the centre of the first pixel is (1, 1), and a principal point is 1 px more
//! than in OpenCV (MathWorks, `cameraIntrinsicsToOpenCV`). `ImageSize` is rows, columns. `K` is `[[fx, s,
//! cx], [0, fy, cy], [0, 0, 1]]`; its older form `IntrinsicMatrix` is the transpose. `RadialDistortion` is
//! `[k1 k2]` or `[k1 k2 k3]`, `TangentialDistortion` `[p1 p2]`, in the equations of OpenCV. Skew is in
//! pixels, as here. Its fisheye is Scaramuzza's polynomial (`MappingCoefficients`), which has no equal here.
//! (MathWorks, `cameraParameters`, `cameraIntrinsics`, `fisheyeIntrinsics`.)

use super::camera_file::CameraFile;
use super::decimal::decimals;
use super::error::FormatError;
use super::node::{Field, Source};
use super::{Format, Found, Room, Size, Written, flow, lens};
use crate::camera::{BrownConrady, Camera, Model};

pub(super) const FORMAT: Format = Format {
    name: "matlab",
    of: "MATLAB",
    // `.json` is this library's own: this one must be named.
    endings: &[],
    first_pixel: 1.0,
    coefficients: "k1 k2 k3, then p1 p2",
    room: Room {
        lenses: &[Model::BrownConrady],
        behind: &[],
        skew: true,
        covariance: false,
        pose: false,
        name: false,
        size: Size::Kept,
    },
    looks_like: |text| {
        let of_a_lens = ["\"RadialDistortion\"", "\"MappingCoefficients\""];
        text.trim_start().starts_with('{') && of_a_lens.iter().any(|key| text.contains(key))
    },
    read,
    write: |camera, _| Ok(write(camera)),
};

fn read(source: &Source) -> Result<Vec<Found>, FormatError> {
    let node = flow::json(source)?;
    let root = Field::root(*source, &node);
    // A cameraParameters may keep its intrinsics in an object of their own.
    let intrinsics = root.get("Intrinsics").unwrap_or_else(|| root.clone());
    if intrinsics.get("MappingCoefficients").is_some() {
        return Err(source.lens("MATLAB's fisheye lens (Scaramuzza's)", lens::CALIBRATE_AGAIN));
    }
    let mut camera = linear(&intrinsics)?;
    let radial = intrinsics.need("RadialDistortion")?;
    let (k1, k2, k3) = match radial.numbers()?[..] {
        [k1, k2] => (k1, k2, 0.0),
        [k1, k2, k3] => (k1, k2, k3),
        _ => return Err(radial.wrong("2 or 3 numbers are expected")),
    };
    let tangential = intrinsics.get("TangentialDistortion");
    let [p1, p2] = tangential.map_or(Ok([0.0; 2]), |field| field.array())?;
    camera.distortion = BrownConrady { k1, k2, p1, p2, k3 };
    let size = intrinsics.get("ImageSize").filter(|field| !field.numbers().is_ok_and(|n| n.is_empty()));
    let image_size = match size {
        None => None,
        Some(field) => {
            let [height, width] = field.array()?;
            let side = |side: f64| super::node::side(side).ok_or_else(|| field.wrong("no number of pixels"));
            Some((side(width)?, side(height)?))
        }
    };
    let further = ["RotationVectors", "TranslationVectors", "ReprojectionErrors", "WorldPoints"];
    let there = further.iter().filter(|key| {
        root.get(key).is_some_and(|field| !field.numbers().is_ok_and(|numbers| numbers.is_empty()))
    });
    let notes = there.map(|key| format!("{key} is not kept")).collect();
    Ok(vec![CameraFile { image_size, notes, ..CameraFile::of(camera) }.into()])
}

/// Focal lengths, principal point and skew, whichever way they are given.
fn linear(root: &Field) -> Result<Camera, FormatError> {
    let k = match (root.get("K"), root.get("IntrinsicMatrix"), root.get("FocalLength")) {
        (Some(k), ..) => (k.square3()?, k),
        (None, Some(transposed), _) => (transposed.square3()?.transpose(), transposed),
        (None, None, Some(focal)) => {
            let [fx, fy] = focal.array()?;
            let [cx, cy] = root.need("PrincipalPoint")?.array()?;
            let skew = root.get("Skew").map_or(Ok(0.0), |skew| skew.number())?;
            return Ok(Camera { skew, ..Camera::pinhole(fx, fy, cx, cy) });
        }
        (None, None, None) => return Err(root.missing("K, IntrinsicMatrix or FocalLength")),
    };
    let (k, field) = k;
    if (k[(1, 0)], k[(2, 0)], k[(2, 1)], k[(2, 2)]) != (0.0, 0.0, 0.0, 1.0) {
        return Err(
            field.wrong("K = [fx s cx; 0 fy cy; 0 0 1], or IntrinsicMatrix, its transpose, is expected")
        );
    }
    Ok(Camera { skew: k[(0, 1)], ..Camera::pinhole(k[(0, 0)], k[(1, 1)], k[(0, 2)], k[(1, 2)]) })
}

fn write(camera: &CameraFile) -> Written {
    let Camera { fx, fy, cx, cy, skew, distortion } = camera.camera;
    let distortion = lens::padded(&distortion, Model::BrownConrady.coefficients().len());
    let [k1, k2, p1, p2, k3] = distortion.try_into().unwrap_or_default();
    let list = |numbers: &[f64]| format!("[{}]", decimals(numbers, ", "));
    let size = camera.image_size.map_or("[]".to_string(), |(width, height)| format!("[{height}, {width}]"));
    let text = format!(
        "{{\n  \"FocalLength\": {},\n  \"PrincipalPoint\": {},\n  \"ImageSize\": {size},\n  \"RadialDistortion\": {},\n  \
         \"TangentialDistortion\": {},\n  \"Skew\": {skew:?},\n  \"K\": [{}, {}, {}]\n}}\n",
        list(&[fx, fy]),
        list(&[cx, cy]),
        list(&[k1, k2, k3]),
        list(&[p1, p2]),
        list(&[fx, skew, cx]),
        list(&[0.0, fy, cy]),
        list(&[0.0, 0.0, 1.0]),
    );
    text.into()
}
