//! Which scene has the number `i`? Camera, board, poses, noise and settings, drawn from a family by seed and
//! index alone.

use super::families::Family;
use calibench::board::View;
use calibench::calibrate::Settings;
use calibench::camera::{Camera, Imaging, Lens};
use calibench::geometry::{Homography, Mat3, Pose, Vec2, Vec3, rotation};
use calibench::synth::{Stream, StreamKey};
use std::f64::consts::TAU;

/// Image width, px.
const WIDTH_PX: (f64, f64) = (640.0, 4000.0);
/// Width over height of the image, one of these.
const ASPECTS: [f64; 4] = [4.0 / 3.0, 1.5, 16.0 / 9.0, 1.0];
/// Height over width of a pixel: square to two parts in a hundred, or, in a quarter of the scenes, far from
/// it.
const NEARLY_SQUARE: (f64, f64) = (0.98, 1.02);
const FAR_FROM_SQUARE: (f64, f64) = (0.5, 2.0);
const FAR_SHARE: f64 = 0.25;
/// Principal point from the image's centre, part of width and height, either way.
const OFF_CENTRE: f64 = 0.05;
/// Marks in a row and in a column.
const COLUMNS: (f64, f64) = (4.0, 12.0);
const ROWS: (f64, f64) = (3.0, 9.0);
/// Number of views.
const VIEWS: (f64, f64) = (4.0, 20.0);
/// Width of the board, mm.
const WIDTH_MM: f64 = 200.0;
/// Width of the board in the image over the image's height, if it faced the camera in the middle.
const EXTENT: (f64, f64) = (0.25, 0.8);
/// The largest tilt of a scene, degrees; its views have any up to it.
const TILT_DEG: (f64, f64) = (15.0, 60.0);
/// Noise of a coordinate, px.
const NOISE_PX: (f64, f64) = (0.01, 1.0);
/// A view shows so many marks of the board at least, and so large a part of them.
const LEAST_MARKS: usize = 6;
const LEAST_PART: f64 = 1.0 / 3.0;
/// Lenses drawn until one is one-to-one over its field, and poses until one is seen.
const MOST_DRAWS: usize = 10_000;
/// The lens is one-to-one farther out than the corner by this factor.
const BEYOND: f64 = 1.02;

/// A scene with all that a solver is given, and what it is judged by.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Its number in the family.
    pub index: u64,
    /// Its family.
    pub family: &'static Family,
    /// The true camera.
    pub camera: Camera<Lens>,
    /// Width and height of the image, px.
    pub size: (usize, usize),
    /// Angle from the axis of the farthest corner, degrees.
    pub half_field_deg: f64,
    /// True poses.
    pub cam_from_target: Vec<Pose>,
    /// Noise of a coordinate, px.
    pub noise_px: f64,
    /// The noisy marks that are seen.
    pub views: Vec<View>,
}

impl Drawn {
    /// Scene `index` of a family; `None` if no draw of the family gives one.
    pub fn new(family: &'static Family, seed: u64, index: u64) -> Option<Drawn> {
        let key = |purpose| StreamKey { seed, scenario: family.name(), trial: index, purpose };
        let mut stream = Stream::open(key("lens-scene"));
        let mut noise = Stream::open(key("lens-noise"));
        let size = size(&mut stream);
        let (camera, half_field_deg) = camera(family, size, &mut stream)?;
        let points = board(&mut stream);
        let count = count(VIEWS, &mut stream);
        let tilt_deg = stream.uniform_in(TILT_DEG.0, TILT_DEG.1);
        let noise_px = log_uniform(NOISE_PX, &mut stream);
        let mut cam_from_target = Vec::with_capacity(count);
        let mut views = Vec::with_capacity(count);
        let mut draws = 0;
        while views.len() < count {
            draws += 1;
            if draws > MOST_DRAWS {
                return None;
            }
            let Some(pose) = pose(&camera, size, tilt_deg, &mut stream) else { continue };
            let Some((points, pixels)) = seen(&camera, size, &points, &pose) else { continue };
            let mut noisy = |p: &Vec2| p + Vec2::new(noise.normal(), noise.normal()) * noise_px;
            views.push(View::new(points, pixels.iter().map(&mut noisy).collect()).ok()?);
            cam_from_target.push(pose);
        }
        Some(Drawn { index, family, camera, size, half_field_deg, cam_from_target, noise_px, views })
    }

    /// What the solver is told.
    pub fn settings(&self) -> Settings {
        let settings = Settings::of_model(self.family.model).with_image_size(self.size);
        self.family.held.iter().fold(settings, |settings, &parameter| settings.hold(parameter, 0.0))
    }

    /// Marks of all views.
    pub fn marks(&self) -> usize {
        self.views.iter().map(View::len).sum()
    }
}

fn log_uniform((low, high): (f64, f64), stream: &mut Stream) -> f64 {
    libm::exp(stream.uniform_in(libm::log(low), libm::log(high)))
}

/// A whole number, as likely by its logarithm.
fn count((low, high): (f64, f64), stream: &mut Stream) -> usize {
    log_uniform((low - 0.5, high + 0.5), stream).round() as usize
}

fn size(stream: &mut Stream) -> (usize, usize) {
    let width = log_uniform(WIDTH_PX, stream).round();
    (width as usize, (width / ASPECTS[stream.below(ASPECTS.len())]).round() as usize)
}

/// A camera whose farthest corner is seen at a drawn angle, with that angle.
fn camera(
    family: &Family,
    (width, height): (usize, usize),
    stream: &mut Stream,
) -> Option<(Camera<Lens>, f64)> {
    for _ in 0..MOST_DRAWS {
        let half_field_deg = stream.uniform_in(family.half_field_deg.0, family.half_field_deg.1);
        let far = stream.uniform() < FAR_SHARE;
        let shape = log_uniform(if far { FAR_FROM_SQUARE } else { NEARLY_SQUARE }, stream);
        let mut off = |size: usize| {
            0.5 * (size as f64 - 1.0) + size as f64 * stream.uniform_in(-OFF_CENTRE, OFF_CENTRE)
        };
        let (cx, cy) = (off(width), off(height));
        let drawn: Vec<f64> =
            family.coefficients.iter().map(|&(_, low, high)| stream.uniform_in(low, high)).collect();
        let value = |p| family.coefficients.iter().position(|(of, ..)| *of == p).map_or(0.0, |i| drawn[i]);
        let coefficients: Vec<f64> = family.model.coefficients().iter().map(|&p| value(p)).collect();
        let lens = Lens::new(family.model, &coefficients).ok()?;
        let angle = half_field_deg.to_radians();
        if lens.monotone_angle() < BEYOND * angle {
            continue;
        }
        // The farthest corner from the principal point, in widths of a pixel.
        let right = cx.max(width as f64 - 1.0 - cx);
        let below = cy.max(height as f64 - 1.0 - cy) / shape;
        let (sin, cos) = libm::sincos(angle);
        let Some(corner) = lens.project(&Vec3::new(sin, 0.0, cos)) else { continue };
        let fx = libm::hypot(right, below) / corner.norm();
        return Some((Camera::with_lens(fx, shape * fx, cx, cy, lens), half_field_deg));
    }
    None
}

/// The marks about the board's middle, mm.
fn board(stream: &mut Stream) -> Vec<Vec2> {
    let (columns, rows) = (count(COLUMNS, stream), count(ROWS, stream));
    let spacing = WIDTH_MM / (columns - 1) as f64;
    let middle = 0.5 * Vec2::new((columns - 1) as f64, (rows - 1) as f64);
    let cells =
        (0..rows).flat_map(|row| (0..columns).map(move |column| Vec2::new(column as f64, row as f64)));
    cells.map(|cell| (cell - middle) * spacing).collect()
}

/// The board's middle on the ray of some pixel, its normal tilted from that ray in any direction, rolled by
/// any angle.
fn pose(
    camera: &Camera<Lens>,
    (width, height): (usize, usize),
    tilt_deg: f64,
    stream: &mut Stream,
) -> Option<Pose> {
    let [x, y, extent, direction, tilt, roll] = std::array::from_fn(|_| stream.uniform());
    let ray = camera.ray(&Vec2::new(x * width as f64 - 0.5, y * height as f64 - 0.5)).ok()?;
    let extent = EXTENT.0 + (EXTENT.1 - EXTENT.0) * extent;
    let distance = WIDTH_MM * camera.fx / (extent * height as f64);
    let (sin, cos) = libm::sincos(TAU * direction);
    let tilted = rotation::exp(&(Vec3::new(cos, sin, 0.0) * (tilt * tilt_deg).to_radians()));
    let rolled = rotation::exp(&(Vec3::z() * (TAU * roll)));
    Some(Pose { rotation: towards(&ray) * tilted * rolled, translation: ray * distance })
}

/// The shortest rotation that takes the optical axis to a ray.
fn towards(ray: &Vec3) -> Mat3 {
    let axis = Vec3::z().cross(ray);
    let sin = axis.norm();
    if sin == 0.0 { Mat3::identity() } else { rotation::exp(&(axis * (libm::atan2(sin, ray.z) / sin))) }
}

/// The marks in the image and their pixels; `None` where they are too few, or lie on a line.
fn seen(
    camera: &Camera<Lens>,
    (width, height): (usize, usize),
    points: &[Vec2],
    pose: &Pose,
) -> Option<(Vec<Vec2>, Vec<Vec2>)> {
    let is_one_to_one = camera.distortion.one_to_one();
    let (right, bottom) = (width as f64 - 0.5, height as f64 - 0.5);
    let pixel = |p: &Vec2| {
        let point = pose.apply(&Vec3::new(p.x, p.y, 0.0));
        let pixel = camera.pixel(&point).filter(|_| is_one_to_one(&point))?;
        ((-0.5..=right).contains(&pixel.x) && (-0.5..=bottom).contains(&pixel.y)).then_some((*p, pixel))
    };
    let (marks, pixels): (Vec<Vec2>, Vec<Vec2>) = points.iter().filter_map(pixel).unzip();
    let is_enough = marks.len() >= LEAST_MARKS.max((LEAST_PART * points.len() as f64).ceil() as usize);
    (is_enough && Homography::fit(&marks, &marks).is_ok()).then_some((marks, pixels))
}

#[cfg(test)]
mod tests {
    use super::super::families::FAMILIES;
    use super::*;

    #[test]
    fn a_scene_is_the_same_in_any_order_and_its_corner_is_seen_where_it_says() {
        for family in &FAMILIES {
            let first = Drawn::new(family, 3, 5).unwrap();
            Drawn::new(family, 3, 4).unwrap();
            let again = Drawn::new(family, 3, 5).unwrap();
            assert_eq!((&first.views, first.settings()), (&again.views, again.settings()));
            for index in 0..20 {
                let drawn = Drawn::new(family, 3, index).unwrap();
                let (width, height) = (drawn.size.0 as f64 - 1.0, drawn.size.1 as f64 - 1.0);
                let corners = [(0.0, 0.0), (width, 0.0), (0.0, height), (width, height)];
                let angle = |&(u, v): &(f64, f64)| {
                    let ray = drawn.camera.ray(&Vec2::new(u, v)).unwrap();
                    libm::atan2(ray.xy().norm(), ray.z).to_degrees()
                };
                let farthest = corners.iter().map(angle).fold(0.0, f64::max);
                // Thin prisms, decentring and a tilted sensor make the field not quite round.
                assert!(
                    (farthest / drawn.half_field_deg - 1.0).abs() < 0.2,
                    "{} {index}: {farthest}",
                    family.name()
                );
            }
        }
    }
}
