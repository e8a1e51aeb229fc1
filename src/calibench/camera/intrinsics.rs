//! What is a camera? Five linear and five distortion parameters that take a ray to a pixel.
//!
//! ```text
//! u = fx x_d + skew y_d + cx        (x_d, y_d) = distort(X / Z, Y / Z)
//! v = fy y_d + cy
//! ```
//! Pixel (0, 0) is the centre of the top-left pixel; camera axes: x right, y down, z forward.

use super::{BrownConrady, FreeParameters, Parameter, UndistortError};
use crate::geometry::{Mat3, Vec2, Vec3};

/// Intrinsic parameters of a camera.
///
/// ```
/// use calibench::camera::{BrownConrady, Camera};
/// use calibench::geometry::{Vec2, Vec3};
///
/// let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0).with_distortion(BrownConrady::radial(-0.18, 0.05));
/// // A point on the optical axis is seen at the principal point.
/// assert_eq!(camera.project(&Vec3::new(0.0, 0.0, 5.0)), Some(Vec2::new(320.0, 240.0)));
/// // The inverse of the lens is exact: corrected and distorted again, a pixel is where it was.
/// let pixel = Vec2::new(100.0, 50.0);
/// let ideal = camera.correct_pixel(&pixel)?;
/// assert!((camera.distort_pixel(&ideal) - pixel).norm() < 1e-9);
/// # Ok::<(), calibench::camera::UndistortError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Camera<L = BrownConrady> {
    /// Focal length along u, px.
    pub fx: f64,
    /// Focal length along v, px.
    pub fy: f64,
    /// Principal point, u, px.
    pub cx: f64,
    /// Principal point, v, px.
    pub cy: f64,
    /// Skew, px: `u` gains `skew * y_d` (Zhang's gamma).
    pub skew: f64,
    /// The lens.
    pub distortion: L,
}

impl Camera<BrownConrady> {
    /// A camera without skew or distortion.
    pub fn pinhole(fx: f64, fy: f64, cx: f64, cy: f64) -> Camera {
        Camera { fx, fy, cx, cy, skew: 0.0, distortion: BrownConrady::default() }
    }

    /// The same camera with another lens.
    pub fn with_distortion(self, distortion: BrownConrady) -> Camera {
        Camera { distortion, ..self }
    }

    /// The parameter vector, in the order of [`Parameter::ALL`].
    pub fn parameters(&self) -> [f64; Parameter::COUNT] {
        let d = &self.distortion;
        [self.fx, self.fy, self.cx, self.cy, self.skew, d.k1, d.k2, d.p1, d.p2, d.k3]
    }

    /// The camera of a parameter vector.
    pub fn from_parameters(p: [f64; Parameter::COUNT]) -> Camera {
        let [fx, fy, cx, cy, skew, k1, k2, p1, p2, k3] = p;
        Camera { fx, fy, cx, cy, skew, distortion: BrownConrady { k1, k2, p1, p2, k3 } }
    }

    /// One parameter's value.
    ///
    /// # Panics
    /// If it is a coefficient of another lens: ask `Camera<Lens>` by [`Camera::value`].
    pub fn get(&self, parameter: Parameter) -> f64 {
        self.parameters()[place(parameter)]
    }

    /// This camera with one parameter changed.
    ///
    /// # Panics
    /// If it is a coefficient of another lens: ask `Camera<Lens>` by [`Camera::with_value`].
    pub fn with(self, parameter: Parameter, value: f64) -> Camera {
        let mut parameters = self.parameters();
        parameters[place(parameter)] = value;
        Camera::from_parameters(parameters)
    }

    /// The free parameters changed by `step`, one entry per free parameter in order.
    ///
    /// # Panics
    /// If a coefficient of another lens is free.
    pub fn stepped(&self, free: FreeParameters, step: &[f64]) -> Camera {
        let mut parameters = self.parameters();
        for (parameter, delta) in free.iter().zip(step) {
            parameters[place(parameter)] += delta;
        }
        Camera::from_parameters(parameters)
    }

    /// `K = [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]`.
    pub fn k(&self) -> Mat3 {
        Mat3::new(self.fx, self.skew, self.cx, 0.0, self.fy, self.cy, 0.0, 0.0, 1.0)
    }

    /// Whether every parameter is finite and both focal lengths are positive.
    pub fn is_valid(&self) -> bool {
        self.parameters().iter().all(|p| p.is_finite()) && self.fx > 0.0 && self.fy > 0.0
    }

    /// Distorted normalised coordinates to pixel.
    pub fn pixel_from_normalised(&self, distorted: &Vec2) -> Vec2 {
        Vec2::new(self.fx * distorted.x + self.skew * distorted.y + self.cx, self.fy * distorted.y + self.cy)
    }

    /// Pixel to distorted normalised coordinates.
    pub fn normalised_from_pixel(&self, pixel: &Vec2) -> Vec2 {
        let y = (pixel.y - self.cy) / self.fy;
        Vec2::new((pixel.x - self.cx - self.skew * y) / self.fx, y)
    }

    /// The pixel of a point in camera coordinates; `None` at or behind the camera's plane (`Z <= 0`).
    pub fn project(&self, point_cam: &Vec3) -> Option<Vec2> {
        (point_cam.z > 0.0).then(|| {
            let ideal = Vec2::new(point_cam.x / point_cam.z, point_cam.y / point_cam.z);
            self.pixel_from_normalised(&self.distortion.distort(&ideal))
        })
    }

    /// The pixel that an ideal lens would have shown: distortion is applied to an ideal pixel.
    pub fn distort_pixel(&self, ideal: &Vec2) -> Vec2 {
        self.pixel_from_normalised(&self.distortion.distort(&self.normalised_from_pixel(ideal)))
    }

    /// Where an ideal lens with the same `K` would have shown what is seen at `pixel`: the correction of a
    /// point. The result is in pixels, not in target units.
    ///
    /// # Errors
    /// Outside the monotone radius of the lens model.
    pub fn correct_pixel(&self, pixel: &Vec2) -> Result<Vec2, UndistortError> {
        Ok(self.pixel_from_normalised(&self.normalised_ray(pixel)?))
    }

    /// The undistorted normalised coordinates `(X/Z, Y/Z)` of the ray seen at `pixel`.
    ///
    /// # Errors
    /// Outside the monotone radius of the lens model.
    pub fn normalised_ray(&self, pixel: &Vec2) -> Result<Vec2, UndistortError> {
        self.distortion.undistort(&self.normalised_from_pixel(pixel))
    }
}

/// The place of a parameter in the vector of a camera with Brown-Conrady's lens.
fn place(parameter: Parameter) -> usize {
    let place = parameter as usize;
    assert!(place < Parameter::COUNT, "Brown-Conrady's lens has no {parameter}");
    place
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correction_undoes_distortion_to_a_rounding_of_a_pixel() {
        let camera = Camera { skew: 0.7, ..Camera::pinhole(600.0, 590.0, 326.0, 243.0) }
            .with_distortion(BrownConrady { k1: -0.18, k2: 0.05, p1: 1e-3, p2: -2e-3, k3: 0.01 });
        for u in (0..640).step_by(40) {
            for v in (0..480).step_by(40) {
                let ideal = Vec2::new(f64::from(u), f64::from(v));
                let back = camera.correct_pixel(&camera.distort_pixel(&ideal)).unwrap();
                // Two maps of pixels near 640 at a few ulp each: 640 eps is 1.4e-13.
                assert!((back - ideal).norm() < 1e-12);
            }
        }
    }

    #[test]
    fn a_point_behind_the_camera_has_no_pixel() {
        let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
        assert_eq!(camera.project(&Vec3::new(0.0, 0.0, -1.0)), None);
        assert_eq!(camera.project(&Vec3::new(0.1, 0.2, 1.0)), Some(Vec2::new(380.0, 360.0)));
    }

    #[test]
    fn parameters_round_trip() {
        let camera = Camera::pinhole(1.0, 2.0, 3.0, 4.0).with(Parameter::K3, 0.5);
        assert_eq!(Camera::from_parameters(camera.parameters()), camera);
        assert_eq!(camera.get(Parameter::K3), 0.5);
        let stepped = camera.stepped(FreeParameters::of(&[Parameter::Fx, Parameter::K3]), &[1.0, 0.25]);
        assert_eq!((stepped.fx, stepped.distortion.k3), (2.0, 0.75));
    }
}
