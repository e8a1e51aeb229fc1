//! How does a photograph of known truth arise? A random pose that keeps the whole board in the image,
//! rendered, moved, made noisy, rounded to grey levels, and packed by a codec where that is asked.

use calibench::board::Pattern;
use calibench::camera::{BrownConrady, Camera};
use calibench::detect::disc_biases;
use calibench::geometry::{Pose, Vec2, Vec3, rotation};
use calibench::photos::BoardSpec;
use calibench::raster::Raster;
use calibench::synth::render::{
    Appearance, Imaging, Photograph, SensorNoise, Shading, Surround, photograph, photograph_dark,
};
use calibench::synth::{Stream, StreamKey};
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageFormat};
use std::io::Cursor;

/// The conditions of a photograph.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Look {
    /// Width and height, px.
    pub size: (usize, usize),
    /// Least and largest tilt, degrees.
    pub tilt: (f64, f64),
    /// Largest roll either way, degrees.
    pub roll: f64,
    /// Standard deviation of a sample's noise, as part of the range.
    pub noise: f64,
    /// Standard deviation of the lens's blur, px.
    pub blur_px: f64,
    /// Length of the motion during the exposure, px.
    pub motion_px: f64,
    /// Levels of dark marks, bright ground and of what surrounds the board.
    pub levels: [f64; 3],
    /// Radial distortion k1, k2.
    pub lens: [f64; 2],
    /// Focal length as part of the image's width.
    pub focal: f64,
    /// Largest distance of the board, where 1 fills the image.
    pub far: f64,
    /// Change of the light from the centre to the edges.
    pub light: f64,
    /// Quality of the JPEG file, 1 to 100; `None` for a file that keeps every level.
    pub jpeg: Option<u8>,
}

impl Default for Look {
    /// A sharp, well lit photograph of 640 x 480 px without noise.
    fn default() -> Look {
        Look {
            size: (640, 480),
            tilt: (0.0, 40.0),
            roll: 180.0,
            noise: 0.0,
            blur_px: 0.6,
            motion_px: 0.0,
            levels: [0.1, 0.85, 0.5],
            lens: [-0.18, 0.05],
            focal: 0.9375,
            far: 1.6,
            light: 0.0,
            jpeg: None,
        }
    }
}

/// A photograph of which the truth is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Photo {
    /// What a detector is given.
    pub image: Raster<u8>,
    /// The same before noise and rounding, as intensity.
    pub clean: Raster<f32>,
    /// Where the marks are, in the order of [`BoardSpec::points`]: of a disc the centroid of its image.
    pub places_px: Vec<Vec2>,
}

/// Least distance of the board from the image's edges, px.
const MARGIN_PX: f64 = 6.0;
/// Poses that are tried before a look is given up.
const POSES: usize = 50;

impl Look {
    /// The photograph of a trial; `None` where no pose fits the image.
    pub fn photo(&self, board: &BoardSpec, seed: u64, scenario: &str, trial: u64) -> Option<Photo> {
        let stream = |purpose: &'static str| Stream::open(StreamKey { seed, scenario, trial, purpose });
        let camera = self.camera();
        let mut random = stream("pose");
        let pose = (0..POSES).find_map(|_| self.pose(board, &camera, &mut random))?;
        let [ink, paper, level] = self.levels;
        let margin = beyond_marks(board) + board.board().spacing() * random.uniform_in(0.1, 0.8);
        let turn = random.uniform_in(0.0, std::f64::consts::TAU);
        let imaging = Imaging {
            appearance: Appearance { paper, ink, surround: Some(Surround { level, margin }) },
            blur_px: self.blur_px,
            shading: Shading {
                slope_x: self.light * libm::cos(turn),
                slope_y: self.light * libm::sin(turn),
                falloff: 0.0,
            },
        };
        let photo = self.rendered(board, &camera, &pose, &imaging)?;
        let mut places_px = photo.centres_true;
        let biases = disc_biases(&camera, &pose, board.board()).ok()?;
        places_px.iter_mut().zip(biases).for_each(|(place, bias)| *place += bias);
        let clean = moved(&photo.image, self.motion_px, random.uniform_in(0.0, std::f64::consts::PI));
        let mut noisy = clean.clone();
        SensorNoise::constant(self.noise).add_to(&mut noisy, &mut stream("noise"));
        let image = match self.jpeg {
            Some(quality) => packed(&noisy.to_u8(), quality)?,
            None => noisy.to_u8(),
        };
        Some(Photo { image, clean, places_px })
    }

    fn rendered(
        &self,
        board: &BoardSpec,
        camera: &Camera,
        pose: &Pose,
        imaging: &Imaging,
    ) -> Option<Photograph> {
        let photo = match board.dark() {
            None => photograph(camera, self.size, board.board(), pose, imaging),
            Some(dark) => photograph_dark(camera, self.size, &dark, &board.points(), pose, imaging),
        };
        photo.ok()
    }

    fn camera(&self) -> Camera {
        let (width, height) = (self.size.0 as f64, self.size.1 as f64);
        let focal_px = self.focal * width;
        Camera::pinhole(focal_px, focal_px, 0.507 * width, 0.492 * height)
            .with_distortion(BrownConrady::radial(self.lens[0], self.lens[1]))
    }

    /// A random tilt about a random axis, as near as the image allows or up to `far` times farther; `None`
    /// where it sees the board's edge.
    fn pose(&self, board: &BoardSpec, camera: &Camera, random: &mut Stream) -> Option<Pose> {
        let tilt = random.uniform_in(self.tilt.0, self.tilt.1).to_radians();
        let axis = random.uniform_in(0.0, std::f64::consts::TAU);
        let roll = random.uniform_in(0.0, std::f64::consts::TAU) * self.roll / 180.0;
        let rotation = rotation::from_xyz_rad(0.0, 0.0, roll)
            * rotation::from_xyz_rad(0.0, 0.0, axis)
            * rotation::from_xyz_rad(tilt, 0.0, 0.0)
            * rotation::from_xyz_rad(0.0, 0.0, -axis);
        let (side_x, side_y) = (random.uniform_in(-0.2, 0.2), random.uniform_in(-0.15, 0.15));
        let far = random.uniform_in(1.0, self.far);
        let at = |distance: f64| Pose {
            rotation,
            translation: Vec3::new(side_x * distance, side_y * distance, distance),
        };
        let (mut near, mut beyond) = (10.0, 4000.0);
        if !self.fits(board, camera, &at(beyond)) {
            return None;
        }
        for _ in 0..40 {
            let middle = 0.5 * (near + beyond);
            if self.fits(board, camera, &at(middle)) { beyond = middle } else { near = middle }
        }
        Some(at(beyond * far)).filter(|pose| self.fits(board, camera, pose))
    }

    /// Whether all that is printed lies in the image.
    fn fits(&self, board: &BoardSpec, camera: &Camera, pose: &Pose) -> bool {
        let (half_x, half_y) = half_extents(board);
        let steps = || (0..=10).map(|i| f64::from(i) / 5.0 - 1.0);
        let outline = steps().flat_map(|t| {
            [
                Vec2::new(t * half_x, -half_y),
                Vec2::new(t * half_x, half_y),
                Vec2::new(-half_x, t * half_y),
                Vec2::new(half_x, t * half_y),
            ]
        });
        // The sheet is larger than what is printed, and must be in front of the lens's fold too.
        let sheet = 1.2;
        let limit = camera.distortion.monotone_radius();
        outline.into_iter().all(|p| {
            let at = pose.apply(&Vec3::new(p.x, p.y, 0.0));
            let edge = pose.apply(&Vec3::new(sheet * p.x, sheet * p.y, 0.0));
            let inside = |v: f64, size: usize| v > MARGIN_PX && v < size as f64 - 1.0 - MARGIN_PX;
            at.z > 1.0
                && edge.z > 1.0
                && edge.xy().norm() / edge.z < 0.98 * limit
                && camera.project(&at).is_some_and(|p| inside(p.x, self.size.0) && inside(p.y, self.size.1))
        })
    }
}

/// Half the sides of what is printed: the outer squares or tags, or the outermost discs.
fn half_extents(board: &BoardSpec) -> (f64, f64) {
    let beyond = match board.board().pattern() {
        Pattern::Circles { diameter } => 0.5 * diameter,
        _ => board.board().spacing(),
    };
    let half = match board.dark() {
        Some(dark) => dark.iter().flatten().fold(Vec2::zeros(), |most, corner| most.sup(&corner.abs())),
        None => {
            let marks = board.points();
            marks.iter().fold(Vec2::zeros(), |most, mark| most.sup(&mark.abs())) + Vec2::repeat(beyond)
        }
    };
    (half.x, half.y)
}

/// From where paper is seen all around, counted as [`Surround::margin`] is.
fn beyond_marks(board: &BoardSpec) -> f64 {
    match board.board().pattern() {
        Pattern::Circles { diameter } => 0.5 * diameter,
        _ => 0.0,
    }
}

/// The image that a JPEG file of a quality gives back.
fn packed(image: &Raster<u8>, quality: u8) -> Option<Raster<u8>> {
    let (width, height) = (image.width(), image.height());
    let mut file = Cursor::new(Vec::new());
    let mut encoder = JpegEncoder::new_with_quality(&mut file, quality);
    encoder.encode(image.samples(), width as u32, height as u32, ExtendedColorType::L8).ok()?;
    let read = image::load_from_memory_with_format(file.get_ref(), ImageFormat::Jpeg).ok()?;
    Raster::from_samples(width, height, read.into_luma8().into_raw()).ok()
}

/// The mean of the image over a straight motion of a length, as many shifts as half pixels, each bilinear.
fn moved(image: &Raster<f32>, length_px: f64, turn: f64) -> Raster<f32> {
    if length_px == 0.0 {
        return image.clone();
    }
    let (width, height) = (image.width(), image.height());
    let count = libm::ceil(2.0 * length_px) as usize;
    let mut sums = vec![0.0f64; width * height];
    for k in 0..count {
        let along = length_px * ((k as f64 + 0.5) / count as f64 - 0.5);
        let (dx, dy) = (along * libm::cos(turn), along * libm::sin(turn));
        let at = |x: isize, y: isize| {
            let x = x.clamp(0, width as isize - 1) as usize;
            f64::from(image.get(x, y.clamp(0, height as isize - 1) as usize))
        };
        let (x0, y0) = (libm::floor(dx), libm::floor(dy));
        let (a, b) = (dx - x0, dy - y0);
        for y in 0..height {
            for x in 0..width {
                let (u, v) = (x as isize + x0 as isize, y as isize + y0 as isize);
                let upper = at(u, v) * (1.0 - a) + at(u + 1, v) * a;
                let lower = at(u, v + 1) * (1.0 - a) + at(u + 1, v + 1) * a;
                sums[y * width + x] += upper * (1.0 - b) + lower * b;
            }
        }
    }
    Raster::from_fn(width, height, |x, y| (sums[y * width + x] / count as f64) as f32)
}
