//! How does a photograph of a case arise? A random pose that keeps the whole board in the image, rendered,
//! moved, made noisy, rounded.

use super::BOARD;
use super::cases::Case;
use calibench::board::Board;
use calibench::camera::{BrownConrady, Camera};
use calibench::geometry::{Pose, Vec2, Vec3, rotation};
use calibench::raster::Raster;
use calibench::synth::render::{Appearance, Imaging, SensorNoise, Shading, Surround, photograph};
use calibench::synth::{Stream, StreamKey};

/// A rendered photograph.
pub struct Photo {
    pub image: Raster<u8>,
    pub truth_px: Vec<Vec2>,
}

/// Side of a square.
const SQUARE: f64 = 10.0;

/// Least distance of the board's outer squares from the image's edges, px.
const MARGIN_PX: f64 = 6.0;

/// A trial of a case; `None` where no pose of it fits the image.
pub fn photo(case: &Case, trial: u64) -> Option<Photo> {
    let stream =
        |purpose: &'static str| Stream::open(StreamKey { seed: 16, scenario: case.name, trial, purpose });
    let board = Board::chessboard(BOARD.0, BOARD.1, SQUARE).ok()?;
    let camera = camera(case);
    let mut random = stream("pose");
    let pose = (0..50).find_map(|_| pose(case, &camera, &mut random))?;
    let [ink, paper, level] = case.levels;
    let margin = SQUARE * random.uniform_in(0.1, 0.8);
    let turn = random.uniform_in(0.0, std::f64::consts::TAU);
    let imaging = Imaging {
        appearance: Appearance { paper, ink, surround: Some(Surround { level, margin }) },
        blur_px: case.blur_px,
        shading: Shading {
            slope_x: case.light * libm::cos(turn),
            slope_y: case.light * libm::sin(turn),
            falloff: 0.0,
        },
    };
    let photo = photograph(&camera, case.size, &board, &pose, &imaging).ok()?;
    let mut image = moved(&photo.image, case.motion_px, random.uniform_in(0.0, std::f64::consts::PI));
    SensorNoise::constant(case.noise).add_to(&mut image, &mut stream("noise"));
    Some(Photo { image: image.to_u8(), truth_px: photo.centres_true })
}

fn camera(case: &Case) -> Camera {
    let (width, height) = (case.size.0 as f64, case.size.1 as f64);
    let focal_px = case.focal * width;
    Camera::pinhole(focal_px, focal_px, 0.507 * width, 0.492 * height)
        .with_distortion(BrownConrady::radial(case.lens[0], case.lens[1]))
}

/// A random tilt about a random axis, as near as the image allows or up to `far` times farther; `None` where
/// it sees the board's edge.
fn pose(case: &Case, camera: &Camera, random: &mut Stream) -> Option<Pose> {
    let tilt = random.uniform_in(case.tilt.0, case.tilt.1).to_radians();
    let axis = random.uniform_in(0.0, std::f64::consts::TAU);
    let roll = random.uniform_in(0.0, std::f64::consts::TAU);
    let rotation = rotation::from_xyz_rad(0.0, 0.0, roll)
        * rotation::from_xyz_rad(0.0, 0.0, axis)
        * rotation::from_xyz_rad(tilt, 0.0, 0.0)
        * rotation::from_xyz_rad(0.0, 0.0, -axis);
    let (side_x, side_y) = (random.uniform_in(-0.2, 0.2), random.uniform_in(-0.15, 0.15));
    let far = random.uniform_in(1.0, case.far);
    let at = |distance: f64| Pose {
        rotation,
        translation: Vec3::new(side_x * distance, side_y * distance, distance),
    };
    let (mut near, mut beyond) = (10.0, 4000.0);
    if !fits(case, camera, &at(beyond)) {
        return None;
    }
    for _ in 0..40 {
        let middle = 0.5 * (near + beyond);
        if fits(case, camera, &at(middle)) { beyond = middle } else { near = middle }
    }
    Some(at(beyond * far)).filter(|pose| fits(case, camera, pose))
}

/// Whether the outer squares lie in the image.
fn fits(case: &Case, camera: &Camera, pose: &Pose) -> bool {
    let (half_x, half_y) = (0.5 * SQUARE * (BOARD.0 + 1) as f64, 0.5 * SQUARE * (BOARD.1 + 1) as f64);
    let steps = || (0..=10).map(|i| f64::from(i) / 5.0 - 1.0);
    let outline = steps().flat_map(|t| {
        [
            Vec2::new(t * half_x, -half_y),
            Vec2::new(t * half_x, half_y),
            Vec2::new(-half_x, t * half_y),
            Vec2::new(half_x, t * half_y),
        ]
    });
    // The sheet is larger than the squares, and must be in front of the lens's fold too.
    let sheet = 1.2;
    let limit = camera.distortion.monotone_radius();
    outline.into_iter().all(|p| {
        let at = pose.apply(&Vec3::new(p.x, p.y, 0.0));
        let edge = pose.apply(&Vec3::new(sheet * p.x, sheet * p.y, 0.0));
        let inside = |v: f64, size: usize| v > MARGIN_PX && v < size as f64 - 1.0 - MARGIN_PX;
        at.z > 1.0
            && edge.z > 1.0
            && edge.xy().norm() / edge.z < 0.98 * limit
            && camera.project(&at).is_some_and(|p| inside(p.x, case.size.0) && inside(p.y, case.size.1))
    })
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
