//! How does a pixel move when the camera or the pose moves? Projection with analytic derivatives.

use super::{Camera, Parameter};
use crate::geometry::{Pose, Vec2, Vec3};
use nalgebra::SMatrix;

/// A pixel and its derivatives with respect to the ten intrinsics and the six pose parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProjectionJacobian {
    /// Predicted pixel.
    pub pixel: Vec2,
    /// 2 x 10, columns in the order of [`Parameter::ALL`].
    pub intrinsics: SMatrix<f64, 2, { Parameter::COUNT }>,
    /// 2 x 6: rotation vector `delta` (rad) of `R <- exp(delta) R`, then translation.
    pub pose: SMatrix<f64, 2, 6>,
}

/// A point that is not in front of the camera has no pixel.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("the point lies at depth {depth} of the camera: only points with positive depth are seen")]
pub struct BehindCamera {
    /// Its Z in camera coordinates.
    pub depth: f64,
}

/// Projects a target point and differentiates the pixel.
///
/// With `X_c = R X + t`, `(x, y) = (X_c, Y_c) / Z_c` and `D` the distortion's Jacobian: `d pixel / d X_c =
/// [[fx, skew], [0, fy]] D [[1, 0, -x], [0, 1, -y]] / Z_c`, and `d X_c / d delta = -[R X]x`, `d X_c / d t =
/// I`.
///
/// ```
/// use calibench::camera::{Camera, Parameter, project_with_jacobian};
/// use calibench::geometry::{Pose, Vec2, Vec3};
///
/// let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
/// let ahead = Pose { translation: Vec3::new(0.0, 0.0, 100.0), ..Pose::identity() };
/// let seen = project_with_jacobian(&camera, &ahead, &Vec3::new(10.0, -5.0, 0.0))?;
/// assert_eq!(seen.pixel, Vec2::new(380.0, 210.0));
/// // A focal length that is 1 px larger moves this pixel by a tenth of a pixel.
/// assert!((seen.intrinsics[(0, Parameter::Fx as usize)] - 0.1).abs() < 1e-15);
/// # Ok::<(), calibench::camera::BehindCamera>(())
/// ```
///
/// # Errors
/// A point that is not in front of the camera.
pub fn project_with_jacobian(
    camera: &Camera,
    cam_from_target: &Pose,
    point: &Vec3,
) -> Result<ProjectionJacobian, BehindCamera> {
    let rotated = cam_from_target.rotation * point;
    let point_cam = rotated + cam_from_target.translation;
    if point_cam.z.is_nan() || point_cam.z <= 0.0 {
        return Err(BehindCamera { depth: point_cam.z });
    }
    let inverse_depth = 1.0 / point_cam.z;
    let (x, y) = (point_cam.x * inverse_depth, point_cam.y * inverse_depth);
    let ideal = Vec2::new(x, y);
    let distorted = camera.distortion.distort(&ideal);
    let linear = nalgebra::Matrix2::new(camera.fx, camera.skew, 0.0, camera.fy);
    let by_ideal = linear * camera.distortion.jacobian(&ideal);
    let by_point = by_ideal
        * SMatrix::<f64, 2, 3>::new(
            inverse_depth,
            0.0,
            -x * inverse_depth,
            0.0,
            inverse_depth,
            -y * inverse_depth,
        );
    let mut pose = SMatrix::<f64, 2, 6>::zeros();
    pose.fixed_columns_mut::<3>(0).copy_from(&(-by_point * crate::geometry::rotation::skew(&rotated)));
    pose.fixed_columns_mut::<3>(3).copy_from(&by_point);
    Ok(ProjectionJacobian {
        pixel: camera.pixel_from_normalised(&distorted),
        intrinsics: intrinsics_columns(camera, &ideal, &distorted),
        pose,
    })
}

/// The 2 x 10 block of the intrinsics.
pub(crate) fn intrinsics_columns(
    camera: &Camera,
    ideal: &Vec2,
    distorted: &Vec2,
) -> SMatrix<f64, 2, { Parameter::COUNT }> {
    let (x, y) = (ideal.x, ideal.y);
    let s = x * x + y * y;
    // Derivatives of (x_d, y_d) by k1, k2, p1, p2, k3.
    let by_lens = [
        Vec2::new(x * s, y * s),
        Vec2::new(x * s * s, y * s * s),
        Vec2::new(2.0 * x * y, s + 2.0 * y * y),
        Vec2::new(s + 2.0 * x * x, 2.0 * x * y),
        Vec2::new(x * s * s * s, y * s * s * s),
    ];
    let mut columns = SMatrix::<f64, 2, { Parameter::COUNT }>::zeros();
    columns.set_column(Parameter::Fx as usize, &Vec2::new(distorted.x, 0.0));
    columns.set_column(Parameter::Fy as usize, &Vec2::new(0.0, distorted.y));
    columns.set_column(Parameter::Cx as usize, &Vec2::new(1.0, 0.0));
    columns.set_column(Parameter::Cy as usize, &Vec2::new(0.0, 1.0));
    columns.set_column(Parameter::Skew as usize, &Vec2::new(distorted.y, 0.0));
    for (offset, d) in by_lens.iter().enumerate() {
        let moved = Vec2::new(camera.fx * d.x + camera.skew * d.y, camera.fy * d.y);
        columns.set_column(Parameter::K1 as usize + offset, &moved);
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::rotation;
    use nalgebra::Vector6;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn derivatives_agree_with_central_differences(
            p in prop::array::uniform10(-1.0f64..1.0), w in prop::array::uniform3(-0.8f64..0.8),
            t in prop::array::uniform3(-1.0f64..1.0), q in prop::array::uniform2(-40.0f64..40.0),
        ) {
            let camera = Camera::from_parameters([
                600.0 + 100.0 * p[0], 600.0 + 100.0 * p[1], 320.0 + 50.0 * p[2], 240.0 + 50.0 * p[3], 5.0 * p[4],
                0.3 * p[5], 0.2 * p[6], 0.01 * p[7], 0.01 * p[8], 0.1 * p[9],
            ]);
            let pose = Pose {
                rotation: rotation::exp(&Vec3::from(w)),
                translation: Vec3::new(30.0 * t[0], 30.0 * t[1], 180.0 + 40.0 * t[2]),
            };
            let point = Vec3::new(q[0], q[1], 0.0);
            let at = project_with_jacobian(&camera, &pose, &point).unwrap();
            let pixel = |c: &Camera, p: &Pose| c.project(&p.apply(&point)).unwrap();
            prop_assert!((at.pixel - pixel(&camera, &pose)).norm() < 1e-11);
            for parameter in Parameter::ALL {
                let h = 1e-5 * (1.0 + camera.get(parameter).abs());
                let ahead = pixel(&camera.with(parameter, camera.get(parameter) + h), &pose);
                let behind = pixel(&camera.with(parameter, camera.get(parameter) - h), &pose);
                let difference = (ahead - behind) / (2.0 * h);
                let analytic = at.intrinsics.column(parameter as usize);
                prop_assert!((difference - analytic).norm() <= 1e-6 * (1.0 + analytic.norm()), "{parameter}");
            }
            for i in 0..6 {
                let h = 1e-5;
                let step = Vector6::ith(i, h);
                let difference = (pixel(&camera, &pose.perturbed(&step)) - pixel(&camera, &pose.perturbed(&-step))) / (2.0 * h);
                let analytic = at.pose.column(i);
                prop_assert!((difference - analytic).norm() <= 1e-6 * (1.0 + analytic.norm()), "pose {i}");
            }
        }
    }

    #[test]
    fn a_point_behind_the_camera_is_refused_with_its_depth() {
        let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
        let error =
            project_with_jacobian(&camera, &Pose::identity(), &Vec3::new(0.0, 0.0, -2.0)).unwrap_err();
        assert_eq!(error, BehindCamera { depth: -2.0 });
    }
}
