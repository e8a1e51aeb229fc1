//! Which files of other programs are read and written? Cameras in ten formats, corners and boards in those of
//! mrcal and Kalibr.
//!
//! A format is a file here: how its text becomes a [`CameraFile`] and back. What all of them share is done in
//! one place, [`read_camera_file`] and [`write_camera_file`]: the origin of the pixels is moved, and what a
//! format cannot hold is refused, if this would be another camera without it, or else named.

mod calibench;
mod camera_file;
mod colmap;
mod decimal;
mod error;
mod fitted;
mod flow;
mod halcon;
mod kalibr;
mod lens;
mod matlab;
mod mrcal;
mod node;
mod opencv;
mod ros;
#[cfg(test)]
mod tests;
mod vnl;
mod xml;
mod yaml;

pub use calibench::SCHEMA;
pub use camera_file::{CameraFile, Estimated};
pub use error::FormatError;
pub use kalibr::{AprilTarget, ChessTarget, KalibrTarget, parse_target, target_text};
pub use vnl::{VnlBoard, corner_text, looks_like_vnl, parse_vnl, vnl_text};

use super::plausible::implausible;
use crate::camera::{Model, Parameter};
use crate::geometry::Vec3;
use node::Source;

/// Bytes of a file of a camera: mrcal keeps whole calibrations beside one.
pub const MOST_BYTES: u64 = 1 << 28;

/// What a format has room for, beyond focal lengths, principal point and lens.
#[derive(Debug, Clone, Copy)]
struct Room {
    /// Lenses that have an equal there.
    lenses: &'static [Model],
    /// Those of them with which its program sees beyond 90 degrees from the axis, as here.
    behind: &'static [Model],
    skew: bool,
    covariance: bool,
    pose: bool,
    name: bool,
    size: Size,
}

/// Whether a format has the image's size.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Size {
    Needed,
    Kept,
}

/// A format: its names, its conventions, its reader and its writer.
#[derive(Debug)]
pub struct Format {
    /// The name on the command line.
    pub name: &'static str,
    /// The program or library whose format it is.
    pub of: &'static str,
    /// Endings of its files.
    pub endings: &'static [&'static str],
    /// Both coordinates of the centre of the first pixel.
    pub first_pixel: f64,
    /// The order of the lens's coefficients in its files.
    pub coefficients: &'static str,
    room: Room,
    looks_like: fn(&str) -> bool,
    read: fn(&Source) -> Result<Vec<Found>, FormatError>,
    write: fn(&CameraFile, &Wishes) -> Result<Written, FormatError>,
}

/// A camera of a file that may hold several: one that cannot be read here does not keep the others from it.
#[derive(Debug)]
struct Found {
    name: Option<String>,
    camera: Result<CameraFile, FormatError>,
}

impl From<CameraFile> for Found {
    fn from(camera: CameraFile) -> Found {
        Found { name: camera.name.clone(), camera: Ok(camera) }
    }
}

/// What the user wants where the files leave a choice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wishes {
    /// Fits the nearest lens where a lens has no equal in the format that is written.
    pub fit: bool,
    /// Height of a pixel, m: HALCON states focal lengths in metres.
    pub pixel_height_m: f64,
    /// Both coordinates of the first pixel's centre in the file that is read, where its program did not keep
    /// to the format's.
    pub first_pixel: Option<f64>,
}

impl Default for Wishes {
    fn default() -> Wishes {
        Wishes { fit: false, pixel_height_m: 1e-6, first_pixel: None }
    }
}

/// A file's text, and what is to be said about it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Written {
    /// The text.
    pub text: String,
    /// What was converted.
    pub converted: Vec<String>,
    /// What the file does not keep.
    pub lost: Vec<String>,
}

impl From<String> for Written {
    fn from(text: String) -> Written {
        Written { text, ..Written::default() }
    }
}

/// Formats of cameras. Those with the clearest marks come first: the first that a text looks like is taken.
pub static FORMATS: [Format; 10] = [
    calibench::FORMAT,
    opencv::JSON,
    opencv::XML,
    mrcal::FORMAT,
    matlab::FORMAT,
    halcon::FORMAT,
    ros::FORMAT,
    kalibr::FORMAT,
    opencv::YAML,
    colmap::FORMAT,
];

/// The format of a name.
pub fn format_of_name(name: &str) -> Option<&'static Format> {
    FORMATS.iter().find(|format| format.name == name)
}

/// The names of all formats.
pub fn format_names() -> Vec<&'static str> {
    FORMATS.iter().map(|format| format.name).collect()
}

/// The formats whose files end like this one.
fn formats_of_ending(file: &str) -> Vec<&'static Format> {
    let ending = file.rsplit_once('.').map_or("", |(_, ending)| ending).to_lowercase();
    FORMATS.iter().filter(|format| format.endings.contains(&ending.as_str())).collect()
}

/// The format of a text: by what stands in it, then by the name of its file.
///
/// # Errors
/// [`FormatError::Unknown`].
pub fn detect(file: &str, text: &str) -> Result<&'static Format, FormatError> {
    let by_contents = FORMATS.iter().find(|format| (format.looks_like)(text));
    if let Some(format) = by_contents {
        return Ok(format);
    }
    only_one(file, "--from", formats_of_ending(file))
}

/// The format in which a file of this name is to be written.
///
/// # Errors
/// [`FormatError::Unknown`] where an ending is of no format or of several.
pub fn format_to_write(file: &str) -> Result<&'static Format, FormatError> {
    only_one(file, "--to", formats_of_ending(file))
}

fn only_one(
    file: &str,
    option: &'static str,
    formats: Vec<&'static Format>,
) -> Result<&'static Format, FormatError> {
    match formats[..] {
        [format] => Ok(format),
        [] => Err(FormatError::Unknown { file: file.into(), option, names: format_names() }),
        _ => Err(FormatError::Unknown {
            file: file.into(),
            option,
            names: formats.iter().map(|format| format.name).collect(),
        }),
    }
}

/// Reads the camera of a text in a format; of several, the one with this name. `file` names it in errors.
///
/// # Errors
/// See [`FormatError`].
///
/// ```
/// use calibench::camera::Parameter;
/// use calibench::io::formats::{Wishes, detect, read_camera_file};
///
/// let text = "# CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]\n1 SIMPLE_RADIAL 640 480 600 320 240 -0.18\n";
/// let format = detect("cameras.txt", text)?;
/// let read = read_camera_file(format, "cameras.txt", text, None, &Wishes::default())?;
/// assert_eq!((format.name, read.image_size), ("colmap", Some((640, 480))));
/// // COLMAP's first pixel has its centre at (0.5, 0.5), ours at (0, 0).
/// assert_eq!((read.camera.cx, read.camera.value(Parameter::K1)), (319.5, Some(-0.18)));
/// # Ok::<(), calibench::io::formats::FormatError>(())
/// ```
pub fn read_camera_file(
    format: &Format,
    file: &str,
    text: &str,
    camera: Option<&str>,
    wishes: &Wishes,
) -> Result<CameraFile, FormatError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let cameras = (format.read)(&Source { file, text })?;
    let first_pixel = wishes.first_pixel.unwrap_or(format.first_pixel);
    let read = chosen(file, cameras, camera)?.with_origin_moved(-first_pixel);
    match implausible(&read.camera) {
        None => Ok(read),
        Some(reason) => Err(FormatError::NoCamera { file: file.into(), reason }),
    }
}

/// The camera of a name, or the only one.
fn chosen(file: &str, mut cameras: Vec<Found>, wanted: Option<&str>) -> Result<CameraFile, FormatError> {
    let names = || cameras.iter().map(|found| found.name.clone().unwrap_or_default()).collect::<Vec<_>>();
    let file = file.to_string();
    let place = match wanted {
        Some(wanted) => match names().iter().position(|name| name == wanted) {
            Some(place) => place,
            None => return Err(FormatError::NoSuchCamera { file, name: wanted.to_string(), names: names() }),
        },
        None if cameras.len() > 1 => return Err(FormatError::Several { file, names: names() }),
        None if cameras.is_empty() => {
            return Err(FormatError::NoCamera { file, reason: "no camera stands in it".into() });
        }
        None => 0,
    };
    cameras.swap_remove(place).camera
}

/// Writes a camera in a format.
///
/// # Errors
/// [`FormatError::CannotHold`] where the format's file would be another camera, or would lack what every such
/// file has.
pub fn write_camera_file(
    format: &Format,
    camera: &CameraFile,
    wishes: &Wishes,
) -> Result<Written, FormatError> {
    let camera = with_simplest_lens(format, camera);
    let (camera, fitted) = &with_nearest_lens(format, camera, wishes)?;
    refuse_what_has_no_room(format, camera)?;
    let mut written = (format.write)(&camera.clone().with_origin_moved(format.first_pixel), wishes)?;
    written.converted.extend(fitted.clone());
    let room = format.room;
    let losses = [
        (camera.estimated.is_some() && !room.covariance, "the covariance"),
        (camera.cam_from_reference.is_some() && !room.pose, "the camera's pose"),
        (camera.name.is_some() && !room.name, "the camera's name"),
    ];
    let lost = losses.into_iter().filter(|(lost, _)| *lost);
    written.lost.extend(lost.map(|(_, what)| format!("{what}: {} has no place for it", format.of)));
    written.lost.extend(lost_behind(format, camera));
    Ok(written)
}

/// The same camera with its lens by the model with the fewest coefficients, where no covariance speaks of
/// them.
fn with_simplest_lens(format: &Format, camera: &CameraFile) -> CameraFile {
    let mut camera = camera.clone();
    if !format.room.covariance {
        camera.camera.distortion = lens::simplest(camera.camera.distortion);
    }
    camera
}

/// With a wish for it, the same camera with the Brown-Conrady lens nearest over the frame in place of
/// HALCON's polynomial where the format does not hold that, and the largest error in words.
///
/// # Errors
/// A lens that none comes near to, and a frame of no known size.
fn with_nearest_lens(
    format: &Format,
    camera: CameraFile,
    wishes: &Wishes,
) -> Result<(CameraFile, Option<String>), FormatError> {
    if !wishes.fit || !can_be_fitted(format, camera.camera.distortion.model()) {
        return Ok((camera, None));
    }
    let nearest = match camera.image_size {
        Some(size) => fitted::nearest_brown_conrady(&camera.camera, size),
        None => Err("give --image-size WxH: it is fitted over the frame".into()),
    };
    let (fitted, error_px) = nearest.map_err(|help| FormatError::CannotHold {
        format: format.of,
        what: "this lens exactly".into(),
        help,
    })?;
    let said =
        format!("HALCON's polynomial lens is fitted over the frame: the largest error is {error_px:.2e} px");
    Ok((CameraFile { camera: fitted, ..camera }, Some(said)))
}

/// Whether the nearest lens of another model is looked for on request. Not where a covariance is kept: it is
/// of other coefficients.
fn can_be_fitted(format: &Format, model: Model) -> bool {
    let Room { lenses, covariance, .. } = format.room;
    let holds = |model| lenses.contains(&model);
    model == Model::HalconPolynomial && !holds(model) && holds(Model::BrownConrady) && !covariance
}

fn refuse_what_has_no_room(format: &Format, camera: &CameraFile) -> Result<(), FormatError> {
    let refuse = |what: &str, help: &str| {
        Err(FormatError::CannotHold { format: format.of, what: what.into(), help: help.into() })
    };
    let Format { room, .. } = format;
    let lens = camera.camera.distortion.model();
    if let Some(reason) = implausible(&camera.camera) {
        return refuse("this camera", &reason);
    }
    let is_outside = |(parameter, value): &(Parameter, f64)| !parameter.is_defined_at(*value);
    if let Some((parameter, value)) = camera.camera.values().find(is_outside)
        && format.of != calibench::FORMAT.of
    {
        let (low, high) = parameter.defined_range();
        return refuse(
            &format!("{parameter} = {value}"),
            &format!(
                "the model is defined from {low} to {high}; calibrate with another --model, or hold it (--fix)"
            ),
        );
    }
    if !room.lenses.contains(&lens) {
        let held: Vec<&str> = room.lenses.iter().map(|model| model.name()).collect();
        let how = if can_be_fitted(format, lens) { "--fit finds the nearest lens, or " } else { "" };
        let help = format!("{how}calibrate again with another --model; it holds {}", held.join(", "));
        return refuse(&format!("a {lens} lens"), &help);
    }
    if camera.camera.skew != 0.0 && !room.skew {
        return refuse("skew", "calibrate without it (--fix skew=0), or write calibench or matlab");
    }
    if camera.image_size.is_none() && room.size == Size::Needed {
        return refuse("a camera without its image's size", "give --image-size WxH");
    }
    Ok(())
}

/// What a program does not see that this library does: rays from beside and behind, where it divides by their
/// depth.
fn lost_behind(format: &Format, camera: &CameraFile) -> Option<String> {
    if format.room.behind.contains(&camera.camera.distortion.model()) {
        return None;
    }
    let rays: Vec<Vec3> =
        fitted::frame(camera.image_size?).filter_map(|pixel| camera.camera.ray(&pixel).ok()).collect();
    let behind = rays.iter().filter(|ray| ray.z <= 0.0).count();
    let share = 100.0 * behind as f64 / rays.len() as f64;
    (behind > 0).then(|| {
        format!("what is seen at 90 degrees from the axis and beyond, {share:.1} % of the frame: {} projects what lies in front of the camera", format.of)
    })
}

/// Largest distance between the pixels of a written file's camera and those of the camera it was written
/// from, px, for rays through the whole frame, infinite if the former has no pixel for one; `None` where the
/// image's size is not known, and where the latter itself has a pixel for none of its rays.
///
/// # Errors
/// What keeps the written file from being read: a fault of this library.
pub fn read_back_px(
    format: &Format,
    written: &Written,
    camera: &CameraFile,
) -> Result<Option<f64>, FormatError> {
    let back = read_camera_file(format, "what was written", &written.text, None, &Wishes::default())?;
    let Some(size) = camera.image_size else { return Ok(None) };
    let rays = fitted::frame(size).filter_map(|pixel| camera.camera.ray(&pixel).ok());
    let apart = rays.filter_map(|ray| {
        let pixel = camera.camera.pixel(&ray)?;
        Some(back.camera.pixel(&ray).map_or(f64::INFINITY, |back| (back - pixel).norm()))
    });
    Ok(apart.reduce(f64::max))
}
