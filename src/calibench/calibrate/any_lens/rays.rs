//! Along which rays does a camera see its pixels, roughly? An exact inverse asks for the roots of a
//! polynomial at every pixel; a start is refined anyway.

use crate::camera::{Camera, Lens};
use crate::geometry::{Vec2, Vec3};

/// Angles of the table, rad: between two of them a radius is off by an eighth of its square times the
/// curvature, some 1e-4 rad.
const STEP: f64 = 0.04;

/// A camera whose lens bends every ray by its angle from the axis alone.
pub(super) struct Rays<'a> {
    camera: &'a Camera<Lens>,
    /// Distorted radii of the angles `k STEP`, as long as they grow.
    radii: Vec<f64>,
}

impl Rays<'_> {
    /// The table of a camera.
    pub fn of(camera: &Camera<Lens>) -> Rays<'_> {
        let count = (std::f64::consts::PI / STEP) as usize;
        let mut radii = vec![0.0];
        for k in 1..=count {
            let angle = k as f64 * STEP;
            let at = camera.distortion.project(&Vec3::new(libm::sin(angle), 0.0, libm::cos(angle)));
            match at {
                Some(at) if at.x > radii[k - 1] => radii.push(at.x),
                _ => break,
            }
        }
        Rays { camera, radii }
    }

    /// The ray of a pixel, to a part of [`STEP`]; `None` beyond the table.
    pub fn near(&self, pixel: &Vec2) -> Option<Vec3> {
        let Camera { fx, fy, cx, cy, skew, .. } = self.camera;
        let y = (pixel.y - cy) / fy;
        let x = (pixel.x - cx - skew * y) / fx;
        let radius = (x * x + y * y).sqrt();
        let above = self.radii.partition_point(|&r| r <= radius);
        let (low, high) = (self.radii[above - 1], *self.radii.get(above)?);
        let angle = STEP * ((above - 1) as f64 + (radius - low) / (high - low));
        let across = if radius > 0.0 { libm::sin(angle) / radius } else { 1.0 };
        Some(Vec3::new(across * x, across * y, libm::cos(angle)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Model;

    fn cameras() -> [Camera<Lens>; 3] {
        let lens = |model, coefficients: &[f64]| Lens::new(model, coefficients).unwrap();
        [
            lens(Model::KannalaBrandt, &[0.0; 4]),
            lens(Model::KannalaBrandt, &[0.02, -0.01, 0.004, -0.0015]),
            lens(Model::Division, &[-0.2]),
        ]
        .map(|lens| Camera { skew: 3.0, ..Camera::with_lens(230.0, 240.0, 326.0, 243.0, lens) })
    }

    #[test]
    fn rays_are_those_of_the_exact_inverse_but_for_the_step() {
        for camera in cameras() {
            let rays = Rays::of(&camera);
            for (x, y) in [(0.0, 0.0), (30.0, -20.0), (-130.0, 90.0), (150.0, 160.0)] {
                let pixel = Vec2::new(326.0 + x, 243.0 + y);
                let (near, exact) = (rays.near(&pixel).unwrap(), camera.ray(&pixel).unwrap());
                assert!((near - exact).norm() < 3e-4, "{near} {exact}");
                assert!((near.norm() - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn beyond_the_angle_up_to_which_a_lens_is_one_to_one_there_is_no_ray() {
        let [equidistant, polynomial, _] = cameras();
        // Half a turn is seen at pi 230 = 723 px.
        assert!(Rays::of(&equidistant).near(&Vec2::new(326.0 + 710.0, 243.0)).is_some());
        assert!(Rays::of(&equidistant).near(&Vec2::new(326.0 + 730.0, 243.0)).is_none());
        let [limit, beyond] = [0.99, 1.01].map(|part| {
            let angle = polynomial.distortion.monotone_angle().min(std::f64::consts::PI);
            let at = polynomial.distortion.project(&Vec3::new(libm::sin(angle), 0.0, libm::cos(angle)));
            Vec2::new(326.0 + 230.0 * (part * at.unwrap().x), 243.0)
        });
        assert!(Rays::of(&polynomial).near(&(0.9 * limit + 0.1 * Vec2::new(326.0, 243.0))).is_some());
        assert!(Rays::of(&polynomial).near(&beyond).is_none());
    }
}
