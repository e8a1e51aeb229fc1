//! Kalibr: `camchain.yaml` with a camera or several, and the YAML of a target.
//!
//! `intrinsics` of the model `pinhole` are `[fu, fv, pu, pv]`, `distortion_coeffs` of `radtan` `[k1, k2, r1,
//! r2]`, which are OpenCV's first four, of `equidistant` `[k1, k2, k3, k4]`, OpenCV's fisheye; `intrinsics`
//! of the model `ds` (double sphere, without further distortion) are `[xi, alpha, fu, fv, pu, pv]`; the
//! centre of the first pixel is (0, 0), since marks come from OpenCV's detectors. `T_cn_cnm1` takes
//! coordinates of the camera before to those of this one. (Kalibr wiki, "yaml formats", "Supported models",
//! "Calibration targets".)

use super::camera_file::CameraFile;
use super::decimal::{decimal, decimals};
use super::error::FormatError;
use super::node::{Field, Source, shortened};
use super::opencv::fisheye_of;
use super::ros::plain;
use super::{Format, Found, Room, Size, Written, lens, yaml};
use crate::camera::{Camera, Lens, Model};

pub(super) const FORMAT: Format = Format {
    name: "kalibr",
    of: "Kalibr",
    endings: &["yaml", "yml"],
    first_pixel: 0.0,
    coefficients: lens::IN_OPENCVS_ORDER,
    room: Room {
        lenses: &[Model::BrownConrady, Model::KannalaBrandt, Model::DoubleSphere],
        behind: &[Model::DoubleSphere],
        skew: false,
        covariance: false,
        pose: false,
        name: true,
        size: Size::Needed,
    },
    looks_like: |text| ["camera_model:", "intrinsics:", "resolution:"].iter().all(|key| text.contains(key)),
    read,
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
    let lens = lens_of(source, name, camera)?;
    let [width, height] = camera.need("resolution")?.array()?;
    let size = |side: f64| {
        super::node::side(side).ok_or_else(|| camera.wrong(format!("{side} is no number of pixels")))
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
        ..CameraFile::of(lens)
    })
}

/// The camera of both of Kalibr's models: that of the projection and that of the distortion.
fn lens_of(source: &Source, name: &str, camera: &Field) -> Result<Camera<Lens>, FormatError> {
    let refused = |what: &str, model: &str| {
        Err(source.lens(format!("the {what} model {} of {name}", shortened(model)), lens::CALIBRATE_AGAIN))
    };
    let distortion = camera.need("distortion_model")?;
    let coefficients = || camera.need("distortion_coeffs");
    match (camera.need("camera_model")?.text()?, distortion.text()?) {
        ("ds", "none") => {
            let [xi, alpha, linear @ ..] = camera.need("intrinsics")?.array::<6>()?;
            let lens = Lens::new(Model::DoubleSphere, &[xi, alpha]).ok();
            Ok(lens::camera(linear, lens.ok_or_else(|| camera.wrong("xi and alpha are expected"))?))
        }
        ("pinhole", model) => {
            let lens = match model {
                "none" => lens::ideal(),
                "radtan" => {
                    let field = coefficients()?;
                    lens::from_opencv_order(source, field.node.offset, &field.array::<4>()?)?
                }
                "equidistant" => fisheye_of(&coefficients()?, &coefficients()?.numbers()?)?,
                other => return refused("distortion", other),
            };
            Ok(lens::camera(camera.need("intrinsics")?.array()?, lens))
        }
        ("ds", other) => refused("distortion", other),
        (other, _) => refused("camera", other),
    }
}

/// How Kalibr says a lens.
struct Said {
    camera_model: &'static str,
    /// Intrinsics before the focal lengths.
    before: Vec<f64>,
    distortion_model: &'static str,
    coefficients: Vec<f64>,
}

fn said(lens: &Lens) -> Result<Said, FormatError> {
    let pinhole = |distortion_model, coefficients| {
        Ok(Said { camera_model: "pinhole", before: vec![], distortion_model, coefficients })
    };
    let own = lens.coefficients().to_vec();
    match lens.model() {
        Model::DoubleSphere => {
            Ok(Said { camera_model: "ds", before: own, distortion_model: "none", coefficients: vec![] })
        }
        Model::KannalaBrandt => pinhole("equidistant", own),
        _ if lens::least_count(lens, &[4]).is_some() => pinhole("radtan", lens::padded(lens, 4)),
        _ => Err(FormatError::CannotHold {
            format: "Kalibr",
            what: format!("k3 = {}", lens::padded(lens, 5)[4]),
            help: "its radtan lens ends with k2: calibrate with --fix k3=0".into(),
        }),
    }
}

fn write(camera: &CameraFile) -> Result<Written, FormatError> {
    let Camera { fx, fy, cx, cy, distortion, .. } = camera.camera;
    let Said { camera_model, before, distortion_model, coefficients } = said(&distortion)?;
    let (width, height) = camera.image_size.unwrap_or_default();
    let name = plain(camera.name.as_deref().unwrap_or("cam0"));
    // Kalibr asks for cam0, cam1, ...: any other name is no camera to it.
    let numbered =
        name.strip_prefix("cam").is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()));
    let kept = if numbered { name.as_str() } else { "cam0" };
    let text = format!(
        "{kept}:\n  camera_model: {camera_model}\n  intrinsics: [{}]\n  distortion_model: {distortion_model}\n  distortion_coeffs: [{}]\n  rostopic: /{name}/image_raw\n  \
         resolution: [{width}, {height}]\n",
        decimals(&[before, vec![fx, fy, cx, cy]].concat(), ", "),
        decimals(&coefficients, ", "),
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

/// A grid of AprilTags of the family 36h11 as Kalibr describes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AprilTarget {
    /// Tags along a row.
    pub columns: usize,
    /// Rows of tags.
    pub rows: usize,
    /// Side of a tag, m.
    pub tag_m: f64,
    /// Space between two tags, in sides of a tag.
    pub spacing: f64,
}

/// A target of Kalibr's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum KalibrTarget {
    /// `checkerboard`.
    Chess(ChessTarget),
    /// `aprilgrid`.
    AprilGrid(AprilTarget),
}

/// Reads the target of a `target.yaml`.
///
/// # Errors
/// See [`FormatError`]; a target that is neither a chessboard of squares nor a grid of tags is refused by
/// name.
pub fn parse_target(file: &str, text: &str) -> Result<KalibrTarget, FormatError> {
    let source = Source { file, text };
    let node = yaml::document(&source)?;
    let root = Field::root(source, &node);
    let kind = root.need("target_type")?;
    if kind.text()? == "aprilgrid" {
        let positive = |key: &str| {
            let field = root.need(key)?;
            let number = field.number()?;
            if number > 0.0 { Ok(number) } else { Err(field.wrong(format!("{number} is not positive"))) }
        };
        return Ok(KalibrTarget::AprilGrid(AprilTarget {
            columns: root.need("tagCols")?.side()?,
            rows: root.need("tagRows")?.side()?,
            tag_m: positive("tagSize")?,
            spacing: positive("tagSpacing")?,
        }));
    }
    if kind.text()? != "checkerboard" {
        let message = format!(
            "{} is neither checkerboard nor aprilgrid: calibench has circles, asymmetric, hexagonal and dots too (write circles:COLUMNSxROWS:SPACING:DIAMETER \
             yourself, since Kalibr's file has no diameter)",
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
    let rows = root.need("targetRows")?.side()?;
    Ok(KalibrTarget::Chess(ChessTarget { columns, rows, square_m: rows_m }))
}

/// The `target.yaml` of a target.
pub fn target_text(target: &KalibrTarget) -> String {
    let ChessTarget { columns, rows, square_m } = match *target {
        KalibrTarget::Chess(target) => target,
        KalibrTarget::AprilGrid(AprilTarget { columns, rows, tag_m, spacing }) => {
            return format!(
                "target_type: 'aprilgrid'\ntagCols: {columns}\ntagRows: {rows}\ntagSize: {}\ntagSpacing: {}\n",
                decimal(tag_m),
                decimal(spacing)
            );
        }
    };
    let square = decimal(square_m);
    format!(
        "target_type: 'checkerboard'\ntargetCols: {columns}\ntargetRows: {rows}\nrowSpacingMeters: {square}\ncolSpacingMeters: {square}\n"
    )
}
