//! Kalibr: `camchain.yaml` with a camera or several, and the YAML of a target.
//!
//! `intrinsics` of the model `pinhole` are `[fu, fv, pu, pv]`, `distortion_coeffs` of `radtan` `[k1, k2, r1,
//! r2]`, which are OpenCV's first four; the centre of the first pixel is (0, 0), since marks come from
//! OpenCV's detectors. `T_cn_cnm1` takes coordinates of the camera before to those of this one. (Kalibr wiki,
//! "yaml formats", "Supported models", "Calibration targets".)

use super::camera_file::CameraFile;
use super::decimal::{decimal, decimals};
use super::error::FormatError;
use super::node::{Field, Source, shortened};
use super::ros::plain;
use super::{Format, Found, Room, Size, Written, lens, yaml};
use crate::camera::{BrownConrady, Camera};

pub(super) const FORMAT: Format = Format {
    name: "kalibr",
    of: "Kalibr",
    endings: &["yaml", "yml"],
    first_pixel: 0.0,
    coefficients: "k1 k2 p1 p2",
    room: Room { skew: false, covariance: false, pose: false, name: true, size: Size::Needed },
    looks_like: |text| ["camera_model:", "intrinsics:", "resolution:"].iter().all(|key| text.contains(key)),
    read: |source, _| read(source),
    write: |camera, _| write(camera),
};

fn read(source: &Source) -> Result<Vec<Found>, FormatError> {
    let node = yaml::document(source)?;
    let root = Field::root(*source, &node);
    let named = root.pairs();
    let cameras: Vec<_> = named.iter().filter(|(_, camera)| camera.get("camera_model").is_some()).collect();
    if cameras.is_empty() {
        return Err(root.missing("cam0.camera_model"));
    }
    let found = |(name, camera): &(&str, Field)| Found {
        name: Some(name.to_string()),
        camera: read_one(source, name, camera),
    };
    Ok(cameras.into_iter().map(found).collect())
}

fn read_one(source: &Source, name: &str, camera: &Field) -> Result<CameraFile, FormatError> {
    let model = camera.need("camera_model")?.text()?;
    if model != "pinhole" {
        return Err(source.lens(format!("the camera model {model} of {name}"), lens::CALIBRATE_AGAIN));
    }
    let [fx, fy, cx, cy] = camera.need("intrinsics")?.array()?;
    let [width, height] = camera.need("resolution")?.array()?;
    let size = |side: f64| {
        super::node::side(side).ok_or_else(|| camera.wrong(format!("{side} is no number of pixels")))
    };
    let distortion = match camera.need("distortion_model")?.text()? {
        "none" => BrownConrady::default(),
        "radtan" => {
            let [k1, k2, p1, p2] = camera.need("distortion_coeffs")?.array()?;
            BrownConrady { k1, k2, p1, p2, k3: 0.0 }
        }
        other => {
            return Err(source.lens(format!("the distortion model {other} of {name}"), lens::CALIBRATE_AGAIN));
        }
    };
    let further = ["T_cn_cnm1", "T_cam_imu", "timeshift_cam_imu"];
    let notes = further
        .iter()
        .filter(|key| camera.get(key).is_some())
        .map(|key| format!("{key} of {name}, which ties it to another sensor, is not kept"))
        .collect();
    Ok(CameraFile {
        name: Some(name.to_string()),
        image_size: Some((size(width)?, size(height)?)),
        notes,
        ..CameraFile::of(Camera::pinhole(fx, fy, cx, cy).with_distortion(distortion))
    })
}

fn write(camera: &CameraFile) -> Result<Written, FormatError> {
    let Camera { fx, fy, cx, cy, distortion, .. } = camera.camera;
    let BrownConrady { k1, k2, p1, p2, k3 } = distortion;
    if k3 != 0.0 {
        return Err(FormatError::CannotHold {
            format: "Kalibr",
            what: format!("k3 = {k3}"),
            help: "its radtan lens ends with k2: calibrate with --fix k3=0".into(),
        });
    }
    let (width, height) = camera.image_size.unwrap_or_default();
    let name = plain(camera.name.as_deref().unwrap_or("cam0"));
    // Kalibr asks for cam0, cam1, ...: any other name is no camera to it.
    let numbered =
        name.strip_prefix("cam").is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    let kept = if numbered { name.as_str() } else { "cam0" };
    let text = format!(
        "{kept}:\n  camera_model: pinhole\n  intrinsics: [{}]\n  distortion_model: radtan\n  distortion_coeffs: [{}]\n  rostopic: /{name}/image_raw\n  \
         resolution: [{width}, {height}]\n",
        decimals(&[fx, fy, cx, cy], ", "),
        decimals(&[k1, k2, p1, p2], ", "),
    );
    let renamed = camera.name.as_ref().filter(|_| !numbered);
    let lost =
        renamed.map(|name| format!("the name {}: Kalibr's cameras are cam0, cam1, ...", shortened(name)));
    Ok(Written { text, lost: lost.into_iter().collect(), ..Written::default() })
}

/// A chessboard as Kalibr describes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChessTarget {
    /// Inner corners along a row.
    pub columns: usize,
    /// Rows of inner corners.
    pub rows: usize,
    /// Side of a square, m.
    pub square_m: f64,
}

/// Reads the target of a `target.yaml`.
///
/// # Errors
/// See [`FormatError`]; a target that is no chessboard of squares is refused by name.
pub fn parse_target(file: &str, text: &str) -> Result<ChessTarget, FormatError> {
    let source = Source { file, text };
    let node = yaml::document(&source)?;
    let root = Field::root(source, &node);
    let kind = root.need("target_type")?;
    if kind.text()? != "checkerboard" {
        let message = format!(
            "{} is no chessboard: calibench has chess, circles and dots (write circles:COLUMNSxROWS:SPACING:DIAMETER yourself, \
             since Kalibr's file has no diameter), and no tags",
            shortened(kind.text()?)
        );
        return Err(kind.wrong(message));
    }
    let row = root.need("rowSpacingMeters")?;
    let (rows_m, columns_m) = (row.number()?, root.need("colSpacingMeters")?.number()?);
    if rows_m != columns_m || rows_m <= 0.0 {
        return Err(row.wrong(format!("squares are expected, and these are {columns_m} x {rows_m} m")));
    }
    let columns = root.need("targetCols")?.side()?;
    Ok(ChessTarget { columns, rows: root.need("targetRows")?.side()?, square_m: rows_m })
}

/// The `target.yaml` of a chessboard.
pub fn target_text(target: &ChessTarget) -> String {
    let ChessTarget { columns, rows, square_m } = *target;
    let square = decimal(square_m);
    format!(
        "target_type: 'checkerboard'\ntargetCols: {columns}\ntargetRows: {rows}\nrowSpacingMeters: {square}\ncolSpacingMeters: {square}\n"
    )
}
