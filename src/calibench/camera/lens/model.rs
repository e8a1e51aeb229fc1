//! A lens of any model: which, and its coefficients.

use super::LensModel;
use super::models::{Model, for_model};
use crate::camera::{Parameter, UndistortError};
use crate::geometry::{Vec2, Vec3};

/// Most coefficients that a model has.
const MOST: usize = 14;

/// Not as many coefficients as the model has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the {model} model has {} coefficients ({}), not {got}", model.coefficients().len(), named(*model))]
pub struct WrongCoefficients {
    /// The model.
    pub model: Model,
    /// How many were given.
    pub got: usize,
}

fn named(model: Model) -> String {
    model.coefficients().iter().map(|p| p.name()).collect::<Vec<_>>().join(" ")
}

/// A lens of any model: which, and its coefficients.
///
/// ```
/// use calibench::camera::{Camera, Lens, Model};
/// use calibench::geometry::Vec3;
///
/// let lens = Lens::new(Model::KannalaBrandt, &[-0.02, 0.003, 0.0, 0.0])?;
/// let camera = Camera::with_lens(400.0, 400.0, 639.5, 479.5, lens);
/// // A fisheye sees what lies beside the camera, and its inverse is exact.
/// let beside = Vec3::new(1.0, 0.2, -0.1).normalize();
/// let pixel = camera.pixel(&beside).expect("fisheyes see beyond 90 degrees");
/// assert!((camera.ray(&pixel)? - beside).norm() < 1e-14);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lens {
    model: Model,
    coefficients: [f64; MOST],
}

impl Lens {
    /// A lens with all coefficients 0, for the double sphere xi = 0 and alpha = 0.5.
    pub fn ideal(model: Model) -> Lens {
        let mut coefficients = [0.0; MOST];
        if model == Model::DoubleSphere {
            coefficients[1] = 0.5;
        }
        Lens { model, coefficients }
    }

    /// A lens with the coefficients of [`Model::coefficients`].
    ///
    /// # Errors
    /// Not as many as the model has.
    pub fn new(model: Model, coefficients: &[f64]) -> Result<Lens, WrongCoefficients> {
        if coefficients.len() != model.coefficients().len() {
            return Err(WrongCoefficients { model, got: coefficients.len() });
        }
        let mut lens = Lens { model, coefficients: [0.0; MOST] };
        lens.coefficients[..coefficients.len()].copy_from_slice(coefficients);
        Ok(lens)
    }

    /// Its model.
    pub fn model(&self) -> Model {
        self.model
    }

    /// Its coefficients, in the order of [`Model::coefficients`].
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients[..self.model.coefficients().len()]
    }

    /// One coefficient, if the model has it.
    pub fn get(&self, parameter: Parameter) -> Option<f64> {
        self.place(parameter).map(|i| self.coefficients[i])
    }

    /// This lens with one coefficient changed, if the model has it.
    pub(crate) fn with(mut self, parameter: Parameter, value: f64) -> Option<Lens> {
        self.coefficients[self.place(parameter)?] = value;
        Some(self)
    }

    fn place(&self, parameter: Parameter) -> Option<usize> {
        self.model.coefficients().iter().position(|&p| p == parameter)
    }

    /// The image of a point in camera coordinates on the plane of the linear parameters; `None` where the
    /// model has none: behind a pinhole, beyond the reach of a division.
    pub fn project(&self, point_cam: &Vec3) -> Option<Vec2> {
        for_model!(self.model, M, P => {
            let constants = <M as LensModel<P>>::constants(self.array::<P>());
            let p = M::project(&constants, [point_cam.x, point_cam.y, point_cam.z]);
            (p.inside > 0.0).then(|| Vec2::new(p.at[0], p.at[1]))
        })
    }

    /// The ray, of length 1, whose image is `at`.
    ///
    /// # Errors
    /// Outside the image of the cone in which the model is one-to-one, or not finite.
    pub fn ray(&self, at: &Vec2) -> Result<Vec3, UndistortError> {
        if !(at.x.is_finite() && at.y.is_finite()) {
            return Err(UndistortError::NotFinite { x: at.x, y: at.y });
        }
        for_model!(self.model, M, P => <M as LensModel<P>>::ray(&self.array::<P>(), at))
    }

    /// The same as a Brown-Conrady lens; `None` if it is another.
    pub fn brown_conrady(&self) -> Option<crate::camera::BrownConrady> {
        let [k1, k2, p1, p2, k3] = self.coefficients().try_into().ok()?;
        (self.model == Model::BrownConrady).then_some(crate::camera::BrownConrady { k1, k2, p1, p2, k3 })
    }

    /// The angle from the optical axis, rad, up to which the model is one-to-one.
    pub fn monotone_angle(&self) -> f64 {
        for_model!(self.model, M, P => <M as LensModel<P>>::monotone_angle(&self.array::<P>()))
    }

    fn array<const P: usize>(&self) -> [f64; P] {
        std::array::from_fn(|i| self.coefficients[i])
    }
}

impl From<crate::camera::BrownConrady> for Lens {
    fn from(lens: crate::camera::BrownConrady) -> Lens {
        let mut coefficients = [0.0; MOST];
        coefficients[..5].copy_from_slice(&[lens.k1, lens.k2, lens.p1, lens.p2, lens.k3]);
        Lens { model: Model::BrownConrady, coefficients }
    }
}

/// What is done with a lens whose model the compiler knows.
pub(crate) trait LensVisitor {
    type Output;
    fn run<M: LensModel<P>, const P: usize>(self, coefficients: [f64; P]) -> Self::Output;
}

/// The choice of the model, once for all that `visitor` does.
pub(crate) fn visit<V: LensVisitor>(lens: &Lens, visitor: V) -> V::Output {
    for_model!(lens.model, M, P => visitor.run::<M, P>(lens.array::<P>()))
}
