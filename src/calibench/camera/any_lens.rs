//! What is a camera with a lens of any model? The five linear parameters behind it.

use super::{
    BrownConrady, Camera, FreeParameters, Lens, LensModel, LensVisitor, Parameter, UndistortError, visit,
};
use crate::geometry::{Vec2, Vec3};
use nalgebra::{Matrix2, Matrix2x3};

/// A pixel and its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelDerivatives {
    /// The pixel.
    pub pixel: Vec2,
    /// By the point in camera coordinates.
    pub by_point: Matrix2x3<f64>,
    /// By the camera's parameters, in the order of [`Model::parameters`](super::Model::parameters).
    pub by_parameters: Vec<(Parameter, Vec2)>,
}

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

    /// The pixel of a point in camera coordinates and its derivatives; `None` where the lens has no image of
    /// it.
    pub fn pixel_with_derivatives(&self, point_cam: &Vec3) -> Option<PixelDerivatives> {
        let linear = Matrix2::new(self.fx, self.skew, 0.0, self.fy);
        let Slopes { at, by_point, by_lens } = visit(&self.distortion, SlopesAt(*point_cam))?;
        let by_linear = [
            Vec2::new(at.x, 0.0),
            Vec2::new(0.0, at.y),
            Vec2::new(1.0, 0.0),
            Vec2::new(0.0, 1.0),
            Vec2::new(at.y, 0.0),
        ];
        let by_lens = by_lens.into_iter().map(|slope| linear * slope);
        Some(PixelDerivatives {
            pixel: self.on_sensor(&at),
            by_point: linear * by_point,
            by_parameters: self
                .distortion
                .model()
                .parameters()
                .zip(by_linear.into_iter().chain(by_lens))
                .collect(),
        })
    }

    /// Whether every parameter is finite and both focal lengths are positive.
    pub fn is_possible(&self) -> bool {
        self.values().all(|(_, value)| value.is_finite()) && self.fx > 0.0 && self.fy > 0.0
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

/// What a lens does to a point, with derivatives.
struct Slopes {
    at: Vec2,
    by_point: Matrix2x3<f64>,
    by_lens: Vec<Vec2>,
}

struct SlopesAt(Vec3);

impl LensVisitor for SlopesAt {
    type Output = Option<Slopes>;

    fn run<M: LensModel<P>, const P: usize>(self, coefficients: [f64; P]) -> Option<Slopes> {
        let p = M::project(&M::constants(coefficients), self.0.into());
        let [[a, b, c], [d, e, f]] = p.by_point;
        (p.inside > 0.0).then(|| Slopes {
            at: p.at.into(),
            by_point: Matrix2x3::new(a, b, c, d, e, f),
            by_lens: p.by_lens.into_iter().map(Vec2::from).collect(),
        })
    }
}

impl Camera<Lens> {
    /// The same camera as one whose lens model is known to be Brown-Conrady's; `None` if it is another.
    pub fn brown_conrady(&self) -> Option<Camera> {
        let Camera { fx, fy, cx, cy, skew, distortion } = *self;
        let distortion = distortion.brown_conrady()?;
        Some(Camera { fx, fy, cx, cy, skew, distortion })
    }
}

impl From<Camera> for Camera<Lens> {
    fn from(camera: Camera<BrownConrady>) -> Camera<Lens> {
        let Camera { fx, fy, cx, cy, skew, distortion } = camera;
        Camera { fx, fy, cx, cy, skew, distortion: distortion.into() }
    }
}
