//! What is measured in a trial? Errors of what is estimated, and how well the data were fitted.

use super::frame::FrameQuantity;
use super::spec::Length;
use calibench::camera::{Camera, FreeParameters, Imaging, Lens, Parameter};
use calibench::geometry::{Vec2, Vec3};

/// One number of a trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Reprojection error per point, px.
    Rmse,
    /// Squared error of the intrinsics in units of the covariance that the calibration reports: `e^T P^-1 e`.
    Nees,
    /// Estimate - truth of a parameter.
    Parameter(Parameter),
    /// Estimate - truth of the depth of the target's centre in the first view, mm.
    Depth,
    /// Measured - true length, mm.
    Length,
    /// By how much the estimated camera misplaces pixels, over the frame.
    Frame(FrameQuantity),
}

impl Quantity {
    /// What a study measures whose cells estimate `free` at most.
    pub(super) fn list(free: FreeParameters, length: bool, frame: bool) -> Vec<Quantity> {
        let parameters = free.iter().map(Quantity::Parameter);
        let of_frame = FrameQuantity::ALL.into_iter().filter(|_| frame).map(Quantity::Frame);
        let last = [Quantity::Depth].into_iter().chain(length.then_some(Quantity::Length)).chain(of_frame);
        [Quantity::Rmse, Quantity::Nees].into_iter().chain(parameters).chain(last).collect()
    }

    /// Name in files: `rmse`, `nees`, `fx`, ..., `depth`, `length`, `frame-rms`, ...
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Rmse => "rmse",
            Quantity::Nees => "nees",
            Quantity::Parameter(parameter) => parameter.name(),
            Quantity::Depth => "depth",
            Quantity::Length => "length",
            Quantity::Frame(quantity) => quantity.name(),
        }
    }

    /// Unit, empty for a pure number.
    pub fn unit(self) -> &'static str {
        match self {
            Quantity::Rmse | Quantity::Frame(_) => "px",
            Quantity::Nees => "",
            Quantity::Parameter(parameter) => parameter.unit(),
            Quantity::Depth | Quantity::Length => "mm",
        }
    }

    /// Whether it is an error, whose true value is 0.
    pub fn is_error(self) -> bool {
        !matches!(self, Quantity::Rmse | Quantity::Nees | Quantity::Frame(_))
    }
}

impl Length {
    /// The pixels of both ends in the true camera; `None` where the lens shows none.
    pub(super) fn pixels(&self, camera: &Camera<Lens>) -> Option<[Vec2; 2]> {
        let (sin, cos) = libm::sincos(self.direction_deg.to_radians());
        let half = Vec3::new(cos, sin, 0.0) * (0.5 * self.length_mm);
        let centre = Vec3::from(self.centre_mm);
        let is_one_to_one = camera.distortion.one_to_one();
        let see = |p: Vec3| if is_one_to_one(&p) { Lens::image(camera, &p) } else { None };
        Some([see(centre - half)?, see(centre + half)?])
    }

    /// Measured - true length, mm, of the segment seen at `pixels`; `None` where the camera's lens model has
    /// no ray.
    pub(super) fn error_mm(&self, camera: &Camera<Lens>, pixels: &[Vec2; 2]) -> Option<f64> {
        let [a, b] = [ideal(camera, &pixels[0])?, ideal(camera, &pixels[1])?];
        Some((b - a).norm() * self.centre_mm[2] - self.length_mm)
    }
}

/// Where the ray of a pixel meets the plane at distance 1; `None` where it does not.
fn ideal(camera: &Camera<Lens>, pixel: &Vec2) -> Option<Vec2> {
    if let Some(plain) = camera.brown_conrady() {
        return plain.normalised_ray(pixel).ok();
    }
    let ray = camera.ray(pixel).ok()?;
    (ray.z > 0.0).then(|| ray.xy() / ray.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::camera::Model;

    #[test]
    fn the_true_camera_measures_the_true_length_through_any_lens() {
        let fisheye = Lens::new(Model::KannalaBrandt, &[-0.03, 0.004, 0.0, 0.0]).unwrap();
        let cameras = [
            Camera::with_lens(600.0, 590.0, 320.0, 240.0, fisheye),
            calibench::synth::Truth::example_camera().into(),
        ];
        let length = Length { centre_mm: [30.0, -20.0, 200.0], length_mm: 40.0, direction_deg: 30.0 };
        for camera in cameras {
            let pixels = length.pixels(&camera).unwrap();
            assert!(length.error_mm(&camera, &pixels).unwrap().abs() < 1e-9);
            // A focal length 1 % too long measures 1 % too little.
            let longer = Camera { fx: 1.01 * camera.fx, fy: 1.01 * camera.fy, ..camera };
            let shrunk =
                |p: &Vec2| Vec2::new(camera.cx, camera.cy) + (p - Vec2::new(camera.cx, camera.cy)) * 1.01;
            assert!(length.error_mm(&longer, &pixels.map(|p| shrunk(&p))).unwrap().abs() < 1e-9);
            assert!(length.error_mm(&longer, &pixels).unwrap() < -0.3);
        }
    }
}
