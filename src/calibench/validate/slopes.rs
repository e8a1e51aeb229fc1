//! How does a pixel move with what was estimated of its camera, and with a pose?

use crate::camera::{Camera, FreeParameters, Lens, Parameter};
use crate::geometry::{Pose, Vec2, Vec3, rotation};
use nalgebra::SMatrix;

/// What of a camera was estimated: parameters, fy perhaps tied to fx.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Estimated {
    pub free: FreeParameters,
    pub fy_per_fx: Option<f64>,
}

impl Estimated {
    /// Whether a parameter has a value of its own that nothing was estimated of.
    pub fn is_held(&self, parameter: Parameter) -> bool {
        let is_tied = parameter == Parameter::Fy && self.fy_per_fx.is_some();
        !self.free.contains(parameter) && !is_tied
    }

    /// How much of a parameter one unit of an estimated one is: that of fx moves an fy that is tied to it.
    pub fn share(&self, estimated: Parameter, parameter: Parameter) -> f64 {
        match self.fy_per_fx {
            Some(ratio) if (estimated, parameter) == (Parameter::Fx, Parameter::Fy) => ratio,
            _ if estimated == parameter => 1.0,
            _ => 0.0,
        }
    }
}

/// A pixel and its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Slopes {
    pub pixel: Vec2,
    /// By each parameter of the model.
    pub by_parameters: Vec<(Parameter, Vec2)>,
    /// By the pose: rotation vector `delta` (rad) of `R <- exp(delta) R`, then translation.
    pub by_pose: SMatrix<f64, 2, 6>,
}

impl Slopes {
    /// Of a point of the target; `None` where the lens has no image of it. With `X_c = R X + t`: `d X_c / d
    /// delta =
    /// -[R X]x`, `d X_c / d t = I`.
    pub fn of(camera: &Camera<Lens>, cam_from_target: &Pose, point: &Vec3) -> Option<Slopes> {
        let rotated = cam_from_target.rotation * point;
        let at = camera.pixel_with_derivatives(&(rotated + cam_from_target.translation))?;
        let mut by_pose = SMatrix::<f64, 2, 6>::zeros();
        by_pose.fixed_columns_mut::<3>(0).copy_from(&(-at.by_point * rotation::skew(&rotated)));
        by_pose.fixed_columns_mut::<3>(3).copy_from(&at.by_point);
        Some(Slopes { pixel: at.pixel, by_parameters: at.by_parameters, by_pose })
    }

    /// By what was estimated, in its order.
    pub fn by_estimated(&self, estimated: &Estimated) -> Vec<Vec2> {
        let by = |free: Parameter| {
            self.by_parameters
                .iter()
                .map(|(parameter, slope)| slope * estimated.share(free, *parameter))
                .sum()
        };
        estimated.free.iter().map(by).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Model;

    #[test]
    fn slopes_are_central_differences_of_pixels() {
        let lens = Lens::new(Model::KannalaBrandt, &[-0.02, 0.003, 1e-3, -1e-4]).unwrap();
        let camera = Camera::with_lens(400.0, 480.0, 320.0, 240.0, lens);
        let pose = Pose {
            rotation: rotation::exp(&Vec3::new(0.3, -0.2, 0.1)),
            translation: Vec3::new(5.0, -8.0, 60.0),
        };
        let point = Vec3::new(40.0, 70.0, 0.0);
        let at = Slopes::of(&camera, &pose, &point).unwrap();
        let pixel = |camera: &Camera<Lens>, pose: &Pose| camera.pixel(&pose.apply(&point)).unwrap();
        assert_eq!(at.pixel, pixel(&camera, &pose));
        for i in 0..6 {
            let step = nalgebra::Vector6::ith(i, 1e-5);
            let difference =
                (pixel(&camera, &pose.perturbed(&step)) - pixel(&camera, &pose.perturbed(&-step))) / 2e-5;
            assert!((difference - at.by_pose.column(i)).norm() < 1e-6 * (1.0 + difference.norm()), "{i}");
        }
        // fy goes with fx.
        let free = FreeParameters::of(&[Parameter::Fx, Parameter::K1]);
        let tied = Estimated { free, fy_per_fx: Some(1.2) };
        let [by_f, by_k1] = at.by_estimated(&tied)[..] else { panic!("two") };
        let with = |by: f64| Camera { fx: camera.fx + by, fy: camera.fy + 1.2 * by, ..camera };
        let difference = (pixel(&with(1e-3), &pose) - pixel(&with(-1e-3), &pose)) / 2e-3;
        assert!((difference - by_f).norm() < 1e-9);
        assert_eq!(Some(&by_k1), at.by_parameters.iter().find(|(p, _)| *p == Parameter::K1).map(|(_, s)| s));
        assert!(tied.is_held(Parameter::K2) && !tied.is_held(Parameter::Fy));
    }
}
