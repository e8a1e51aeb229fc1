//! What is a camera with a lens of any model? The five linear parameters behind it.

use super::{BrownConrady, Camera, FreeParameters, Lens, Parameter, UndistortError};
use crate::geometry::{Vec2, Vec3};

impl Camera<Lens> {
    /// A camera without skew.
    pub fn with_lens(fx: f64, fy: f64, cx: f64, cy: f64, lens: Lens) -> Camera<Lens> {
        Camera { fx, fy, cx, cy, skew: 0.0, distortion: lens }
    }

    /// The pixel of a point in camera coordinates; `None` where the lens has no image of it.
    pub fn pixel(&self, point_cam: &Vec3) -> Option<Vec2> {
        self.distortion.project(point_cam).map(|p| self.on_sensor(&p))
    }

    /// The ray, of length 1 in camera coordinates, that is seen at `pixel`.
    ///
    /// # Errors
    /// Outside the image of the cone in which the lens is one-to-one.
    pub fn ray(&self, pixel: &Vec2) -> Result<Vec3, UndistortError> {
        self.distortion.ray(&self.before_sensor(pixel))
    }

    /// One parameter's value; `None` if the model does not have it.
    pub fn value(&self, parameter: Parameter) -> Option<f64> {
        match parameter {
            Parameter::Fx => Some(self.fx),
            Parameter::Fy => Some(self.fy),
            Parameter::Cx => Some(self.cx),
            Parameter::Cy => Some(self.cy),
            Parameter::Skew => Some(self.skew),
            coefficient => self.distortion.get(coefficient),
        }
    }

    /// This camera with one parameter changed; `None` if the model does not have it.
    pub fn with_value(mut self, parameter: Parameter, value: f64) -> Option<Camera<Lens>> {
        match parameter {
            Parameter::Fx => self.fx = value,
            Parameter::Fy => self.fy = value,
            Parameter::Cx => self.cx = value,
            Parameter::Cy => self.cy = value,
            Parameter::Skew => self.skew = value,
            coefficient => self.distortion = self.distortion.with(coefficient, value)?,
        }
        Some(self)
    }

    /// All parameters with their values, in order.
    pub fn values(&self) -> impl Iterator<Item = (Parameter, f64)> {
        let linear = [self.fx, self.fy, self.cx, self.cy, self.skew];
        let coefficients = self.distortion.coefficients().to_vec();
        self.distortion.model().parameters().zip(linear.into_iter().chain(coefficients))
    }

    /// The free parameters changed by `step`, one entry per free parameter in order.
    pub(crate) fn moved(&self, free: FreeParameters, step: &[f64]) -> Camera<Lens> {
        free.iter().zip(step).fold(*self, |camera, (parameter, delta)| {
            let value = camera.value(parameter).unwrap_or(0.0) + delta;
            camera.with_value(parameter, value).unwrap_or(camera)
        })
    }

    fn on_sensor(&self, at: &Vec2) -> Vec2 {
        Vec2::new(self.fx * at.x + self.skew * at.y + self.cx, self.fy * at.y + self.cy)
    }

    fn before_sensor(&self, pixel: &Vec2) -> Vec2 {
        let y = (pixel.y - self.cy) / self.fy;
        Vec2::new((pixel.x - self.cx - self.skew * y) / self.fx, y)
    }
}

impl From<Camera> for Camera<Lens> {
    fn from(camera: Camera<BrownConrady>) -> Camera<Lens> {
        let Camera { fx, fy, cx, cy, skew, distortion } = camera;
        Camera { fx, fy, cx, cy, skew, distortion: distortion.into() }
    }
}
