//! COLMAP: `cameras.txt`, a line a camera: `CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]`.
//!
//! The upper left corner of the image is (0, 0) and the centre of its first pixel (0.5, 0.5). The
//! coefficients of `OPENCV` and `FULL_OPENCV` are OpenCV's; `SIMPLE_RADIAL` and `RADIAL` have one focal
//! length and k1, or k1 and k2. (COLMAP documentation, "Output Format"; `src/colmap/sensor/models.h`.)

use super::camera_file::CameraFile;
use super::decimal::decimals;
use super::error::FormatError;
use super::node::{Source, shortened, side};
use super::{Format, Found, Room, Size, Written, lens};
use crate::camera::{BrownConrady, Camera};

pub(super) const FORMAT: Format = Format {
    name: "colmap",
    of: "COLMAP",
    endings: &["txt"],
    first_pixel: 0.5,
    coefficients: "k1 k2 p1 p2 k3",
    room: Room { skew: false, covariance: false, pose: false, name: true, size: Size::Needed },
    looks_like,
    read: |source, _| read(source),
    write: |camera, _| Ok(write(camera)),
};

/// Most cameras in a file: each is kept until one is chosen.
const MOST_CAMERAS: usize = 1_000_000;

fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut offset = 0;
    let with_offset = text.split_inclusive('\n').map(move |line| {
        let start = offset;
        offset += line.len();
        (start, line.trim_end())
    });
    with_offset.filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'))
}

fn looks_like(text: &str) -> bool {
    let Some((_, line)) = lines(text).next() else { return false };
    let words: Vec<&str> = line.split_whitespace().take(4).collect();
    let [id, model, width, height] = words[..] else { return false };
    let number = |word: &str| word.bytes().all(|byte| byte.is_ascii_digit());
    let upper = model.bytes().all(|byte| byte.is_ascii_uppercase() || byte == b'_' || byte.is_ascii_digit());
    number(id) && number(width) && number(height) && upper && !number(model)
}

fn read(source: &Source) -> Result<Vec<Found>, FormatError> {
    let mut cameras = Vec::new();
    for (offset, line) in lines(source.text) {
        if cameras.len() == MOST_CAMERAS {
            return Err(source.syntax(offset, format!("more than {MOST_CAMERAS} cameras")));
        }
        let name = line.split_whitespace().next().map(str::to_string);
        // A foreign lens does not keep the other cameras from being read; a broken line does.
        let camera = match read_line(source, offset, line) {
            Err(error) if !matches!(error, FormatError::Lens { .. }) => return Err(error),
            camera => camera,
        };
        cameras.push(Found { name, camera });
    }
    Ok(cameras)
}

fn read_line(source: &Source, offset: usize, line: &str) -> Result<CameraFile, FormatError> {
    let words: Vec<&str> = line.split_whitespace().collect();
    let [id, model, width, height, parameters @ ..] = &words[..] else {
        return Err(source.syntax(offset, "CAMERA_ID MODEL WIDTH HEIGHT PARAMS[] is expected"));
    };
    let place = |word: &str| offset + (word.as_ptr() as usize - line.as_ptr() as usize);
    let length = |word: &str, what: &str| {
        let number = source.number(place(word), what, word)?;
        side(number)
            .ok_or_else(|| source.value(place(word), what, format!("{number} is no number of pixels")))
    };
    let image_size = Some((length(width, "WIDTH")?, length(height, "HEIGHT")?));
    let numbers = parameters.iter().map(|word| source.number(place(word), "PARAMS", word));
    let numbers: Vec<f64> = numbers.collect::<Result<_, _>>()?;
    let camera = camera_of(source, offset, model, &numbers)?;
    Ok(CameraFile { name: Some((*id).to_string()), image_size, ..CameraFile::of(camera) })
}

fn camera_of(source: &Source, offset: usize, model: &str, p: &[f64]) -> Result<Camera, FormatError> {
    let pinhole = Camera::pinhole;
    Ok(match (model, p) {
        ("SIMPLE_PINHOLE", &[f, cx, cy]) => pinhole(f, f, cx, cy),
        ("PINHOLE", &[fx, fy, cx, cy]) => pinhole(fx, fy, cx, cy),
        ("SIMPLE_RADIAL", &[f, cx, cy, k]) => {
            pinhole(f, f, cx, cy).with_distortion(BrownConrady::radial(k, 0.0))
        }
        ("RADIAL", &[f, cx, cy, k1, k2]) => {
            pinhole(f, f, cx, cy).with_distortion(BrownConrady::radial(k1, k2))
        }
        ("OPENCV", &[fx, fy, cx, cy, _, _, _, _])
        | ("FULL_OPENCV", &[fx, fy, cx, cy, _, _, _, _, _, _, _, _]) => {
            let distortion = lens::from_opencv_order(source, offset, &p[4..], lens::CALIBRATE_AGAIN)?;
            pinhole(fx, fy, cx, cy).with_distortion(distortion)
        }
        ("SIMPLE_PINHOLE" | "PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" | "OPENCV" | "FULL_OPENCV", _) => {
            return Err(source.value(
                offset,
                model,
                format!("{} numbers are not what this model has", p.len()),
            ));
        }
        _ => return Err(source.lens(format!("the model {}", shortened(model)), lens::CALIBRATE_AGAIN)),
    })
}

fn write(camera: &CameraFile) -> Written {
    let Camera { fx, fy, cx, cy, distortion, .. } = camera.camera;
    let [k1, k2, p1, p2, k3] = lens::opencv_order(&distortion);
    let (model, lens) = match (distortion.is_ideal(), k3 == 0.0) {
        (true, _) => ("PINHOLE", vec![]),
        (false, true) => ("OPENCV", vec![k1, k2, p1, p2]),
        (false, false) => ("FULL_OPENCV", vec![k1, k2, p1, p2, k3, 0.0, 0.0, 0.0]),
    };
    let (width, height) = camera.image_size.unwrap_or_default();
    // An identifier is a number to COLMAP.
    let number = camera.name.as_deref().filter(|name| name.parse::<u32>().is_ok());
    let parameters = decimals(&[vec![fx, fy, cx, cy], lens].concat(), " ");
    let text = format!(
        "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n# Number of cameras: 1\n\
         {} {model} {width} {height} {parameters}\n",
        number.unwrap_or("1")
    );
    let lost = camera.name.iter().filter(|_| number.is_none());
    let lost =
        lost.map(|name| format!("the name {}: COLMAP's cameras have numbers", shortened(name))).collect();
    Written { text, lost, ..Written::default() }
}
