//! COLMAP: `cameras.txt`, a line a camera: `CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]`.
//!
//! The upper left corner of the image is (0, 0) and the centre of its first pixel (0.5, 0.5). The
//! coefficients of `OPENCV`, `FULL_OPENCV` and `OPENCV_FISHEYE` are OpenCV's; `SIMPLE_RADIAL` and `RADIAL`
//! have one focal length and k1, or k1 and k2, and so have their fisheyes; `DIVISION` divides by `1 + k r^2`
//! of the seen point, as here. (COLMAP documentation, "Output Format"; `src/colmap/sensor/models.h`.)

use super::camera_file::CameraFile;
use super::decimal::decimals;
use super::error::FormatError;
use super::node::{Source, shortened, side};
use super::{Format, Found, Room, Size, Written, lens};
use crate::camera::{Camera, Lens, Model};

pub(super) const FORMAT: Format = Format {
    name: "colmap",
    of: "COLMAP",
    endings: &["txt"],
    first_pixel: 0.5,
    coefficients: lens::IN_OPENCVS_ORDER,
    room: Room {
        lenses: &[Model::BrownConrady, Model::Rational, Model::KannalaBrandt, Model::Division],
        behind: &[],
        skew: false,
        covariance: false,
        pose: false,
        name: true,
        size: Size::Needed,
    },
    looks_like,
    read,
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

/// What the numbers behind the focal lengths and the principal point are.
type Coefficients = fn(&[f64]) -> Option<Lens>;

/// COLMAP's models that have an equal here: name, focal lengths, how many coefficients, which lens.
const MODELS: [(&str, usize, usize, Coefficients); 13] = [
    ("SIMPLE_PINHOLE", 1, 0, opencv),
    ("PINHOLE", 2, 0, opencv),
    ("SIMPLE_RADIAL", 1, 1, opencv),
    ("RADIAL", 1, 2, opencv),
    ("OPENCV", 2, 4, opencv),
    ("FULL_OPENCV", 2, 8, opencv),
    ("SIMPLE_FISHEYE", 1, 0, lens::fisheye),
    ("FISHEYE", 2, 0, lens::fisheye),
    ("SIMPLE_RADIAL_FISHEYE", 1, 1, lens::fisheye),
    ("RADIAL_FISHEYE", 1, 2, lens::fisheye),
    ("OPENCV_FISHEYE", 2, 4, lens::fisheye),
    ("SIMPLE_DIVISION", 1, 1, division),
    ("DIVISION", 2, 1, division),
];

fn division(k: &[f64]) -> Option<Lens> {
    k.first().map(|k1| lens::division(*k1))
}

/// In OpenCV's order: k1 k2 p1 p2, of which there may be fewer, k3 k4 k5 k6.
fn opencv(coefficients: &[f64]) -> Option<Lens> {
    Some(lens::least_of(coefficients))
}

fn camera_of(source: &Source, offset: usize, model: &str, p: &[f64]) -> Result<Camera<Lens>, FormatError> {
    let known = MODELS.iter().find(|(name, ..)| *name == model);
    let Some((_, focal, coefficients, lens)) = known else {
        return Err(source.lens(format!("the model {}", shortened(model)), lens::CALIBRATE_AGAIN));
    };
    let linear = match p {
        [f, cx, cy, ..] if *focal == 1 => Some([*f, *f, *cx, *cy]),
        [fx, fy, cx, cy, ..] => Some([*fx, *fy, *cx, *cy]),
        _ => None,
    };
    let behind = p.get(focal + 2..).filter(|behind| behind.len() == *coefficients);
    let camera = linear.zip(behind.and_then(lens)).map(|(linear, lens)| lens::camera(linear, lens));
    camera.ok_or_else(|| {
        source.value(offset, model, format!("{} numbers are not what this model has", p.len()))
    })
}

/// The model in which a lens is written, and its coefficients.
fn said(lens: &Lens) -> (&'static str, Vec<f64>) {
    match lens.model() {
        Model::KannalaBrandt => ("OPENCV_FISHEYE", lens.coefficients().to_vec()),
        Model::Division => ("DIVISION", lens.coefficients().to_vec()),
        _ => match lens::least_count(lens, &[0, 4]) {
            Some(0) => ("PINHOLE", vec![]),
            Some(_) => ("OPENCV", lens::padded(lens, 4)),
            None => ("FULL_OPENCV", lens::padded(lens, 8)),
        },
    }
}

fn write(camera: &CameraFile) -> Written {
    let Camera { fx, fy, cx, cy, distortion, .. } = camera.camera;
    let (model, lens) = said(&distortion);
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
