//! How far is the centre of an imaged disc from the image of the disc's centre?
//!
//! Perspective maps a disc to an ellipse whose centre is not the image of the disc's centre, and distortion
//! bends it further; a detector sees the centroid of the imaged area (Heikkila & Silven 1997 for the
//! perspective part). With the outline `p(theta)` of the disc through the full camera model, Green's theorem
//! gives
//!
//! ```text
//! A = 1/2 oint (u dv - v du),     centroid = (1 / 2A) (oint u^2 dv, -oint v^2 du)
//! ```
//! The integrands are periodic and analytic, so the trapezoidal rule converges geometrically.

use crate::board::{Board, Pattern};
use crate::camera::{BehindCamera, Camera, Lens};
use crate::geometry::{Pose, Vec2, Vec3};
use nalgebra::{Matrix2, Matrix2x3, Matrix3x2};

/// Points of the trapezoidal rule. The integrand's harmonics fall at least as fast as (radius / distance)^n,
/// below 1e-16 from the 32nd on for any disc smaller than a third of its distance.
const OUTLINE_POINTS: usize = 64;

/// Area centroid of the imaged disc minus the projection of its centre, px. Subtract it from a detected
/// centre.
///
/// # Errors
/// A disc that is not wholly in front of the camera.
///
/// ```
/// use calibench::detect::disc_bias;
/// use calibench::geometry::Vec2;
/// use calibench::synth::Truth;
/// use calibench::synth::scene::looking_at_centre;
///
/// let camera = Truth::example_camera();
/// let (pose, centre) = (looking_at_centre([40.0, 0.0, 0.0], 120.0), Vec2::new(0.0, 20.0));
/// let bias = |diameter| disc_bias(&camera, &pose, &centre, diameter);
/// // Some hundredths of a pixel for a disc of 3 mm, four times as much for one twice as wide.
/// let (small, large) = (bias(3.0)?.norm(), bias(6.0)?.norm());
/// assert!(small > 0.01 && (large / small - 4.0).abs() < 0.05);
/// # Ok::<(), calibench::camera::BehindCamera>(())
/// ```
pub fn disc_bias(
    camera: &impl Imaging,
    cam_from_target: &Pose,
    centre: &Vec2,
    diameter: f64,
) -> Result<Vec2, BehindCamera> {
    let (projected, _) = pixel_and_slope(camera, cam_from_target, centre)?;
    let (mut twice_area, mut moment) = (0.0, Vec2::zeros());
    for i in 0..OUTLINE_POINTS {
        let (sine, cosine) = libm::sincos(std::f64::consts::TAU * i as f64 / OUTLINE_POINTS as f64);
        let radius = 0.5 * diameter;
        let (pixel, slope) =
            pixel_and_slope(camera, cam_from_target, &(centre + Vec2::new(cosine, sine) * radius))?;
        // Relative to the projected centre, so that nothing cancels.
        let p = pixel - projected;
        let dp = slope * Vec2::new(-sine, cosine) * radius;
        twice_area += p.x * dp.y - p.y * dp.x;
        moment += Vec2::new(p.x * p.x * dp.y, -p.y * p.y * dp.x);
    }
    Ok(moment / twice_area)
}

/// The bias of every mark of a board, in the order of [`Board::points`]; zero for corners, which have no
/// extent.
///
/// # Errors
/// A mark that is not wholly in front of the camera.
pub fn disc_biases(
    camera: &impl Imaging,
    cam_from_target: &Pose,
    board: &Board,
) -> Result<Vec<Vec2>, BehindCamera> {
    let points = board.points();
    match board.pattern() {
        Pattern::Chessboard => Ok(vec![Vec2::zeros(); points.len()]),
        Pattern::Circles { diameter } => {
            points.iter().map(|point| disc_bias(camera, cam_from_target, point, diameter)).collect()
        }
    }
}

/// The pixel of a board point and its derivative by the point.
fn pixel_and_slope(
    camera: &impl Imaging,
    cam_from_target: &Pose,
    point: &Vec2,
) -> Result<(Vec2, Matrix2<f64>), BehindCamera> {
    let point_cam = cam_from_target.apply(&Vec3::new(point.x, point.y, 0.0));
    let in_plane: Matrix3x2<f64> = cam_from_target.rotation.fixed_columns::<2>(0).into_owned();
    let (pixel, slope) = camera.image(&point_cam).ok_or(BehindCamera { depth: point_cam.z })?;
    Ok((pixel, slope * in_plane))
}

/// A camera of either kind.
pub trait Imaging {
    /// The pixel of a point in camera coordinates, and its derivative by the point; `None` where there is
    /// none.
    fn image(&self, point_cam: &Vec3) -> Option<(Vec2, Matrix2x3<f64>)>;
}

impl Imaging for Camera {
    fn image(&self, point_cam: &Vec3) -> Option<(Vec2, Matrix2x3<f64>)> {
        if point_cam.z.is_nan() || point_cam.z <= 0.0 {
            return None;
        }
        let ideal = point_cam.xy() / point_cam.z;
        let by_point_cam = Matrix2x3::new(1.0, 0.0, -ideal.x, 0.0, 1.0, -ideal.y) / point_cam.z;
        let linear = Matrix2::new(self.fx, self.skew, 0.0, self.fy);
        let slope = linear * self.distortion.jacobian(&ideal) * by_point_cam;
        Some((self.pixel_from_normalised(&self.distortion.distort(&ideal)), slope))
    }
}

impl Imaging for Camera<Lens> {
    fn image(&self, point_cam: &Vec3) -> Option<(Vec2, Matrix2x3<f64>)> {
        self.pixel_with_derivatives(point_cam).map(|at| (at.pixel, at.by_point))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::BrownConrady;
    use crate::geometry::rotation;

    fn tilted(degrees: f64) -> Pose {
        Pose {
            rotation: rotation::from_xyz_rad(degrees.to_radians(), 0.0, 0.0),
            translation: Vec3::new(0.0, 0.0, 120.0),
        }
    }

    #[test]
    fn an_undistorted_fronto_parallel_disc_has_no_bias() {
        let camera = Camera::pinhole(600.0, 590.0, 326.0, 243.0);
        let bias = disc_bias(&camera, &tilted(0.0), &Vec2::new(40.0, -30.0), 3.0).unwrap();
        assert!(bias.norm() < 1e-12);
    }

    #[test]
    fn a_tilted_disc_has_the_bias_of_its_ellipse() {
        // A disc at the origin tilted by t about X: v / f = y cos t / (Z + y sin t) for y = -r ... r, so the
        // ellipse's vertical extent is centred on the mean of its ends.
        let (f, z, r) = (600.0, 120.0, 1.5);
        let camera = Camera::pinhole(f, f, 0.0, 0.0);
        for degrees in [20.0f64, 45.0] {
            let (sine, cosine) = libm::sincos(degrees.to_radians());
            let end = |y: f64| f * y * cosine / (z + y * sine);
            let expected = 0.5 * (end(r) + end(-r));
            let bias = disc_bias(&camera, &tilted(degrees), &Vec2::zeros(), 2.0 * r).unwrap();
            assert!((bias.y - expected).abs() < 1e-13 && bias.x.abs() < 1e-13, "{bias} {expected}");
        }
    }

    #[test]
    fn the_quadrature_has_converged_under_distortion() {
        let lens = BrownConrady { k1: -0.18, k2: 0.05, p1: 1e-3, p2: -2e-3, k3: 0.01 };
        let camera = Camera::pinhole(600.0, 600.0, 326.0, 243.0).with_distortion(lens);
        let centre = Vec2::new(40.0, -30.0);
        let bias = disc_bias(&camera, &tilted(40.0), &centre, 3.0).unwrap();
        // The polygon of 20 000 outline points as an independent centroid: its error falls as 1 / n^2, 1e-8
        // here.
        let pose = tilted(40.0);
        let pixel = |p: Vec2| pixel_and_slope(&camera, &pose, &p).unwrap().0;
        let origin = pixel(centre);
        let n = 20_000;
        let outline: Vec<Vec2> = (0..n)
            .map(|i| std::f64::consts::TAU * f64::from(i) / f64::from(n))
            .map(|angle| pixel(centre + Vec2::new(libm::cos(angle), libm::sin(angle)) * 1.5) - origin)
            .collect();
        let (mut area, mut moment) = (0.0, Vec2::zeros());
        for (a, b) in outline.iter().zip(outline.iter().cycle().skip(1)) {
            let cross = a.x * b.y - a.y * b.x;
            area += 0.5 * cross;
            moment += (a + b) * (cross / 6.0);
        }
        assert!((moment / area - bias).norm() < 1e-7);
        assert!(disc_bias(&camera, &tilted(40.0), &Vec2::new(0.0, -500.0), 3.0).is_err());
    }
}
