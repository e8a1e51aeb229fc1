//! Where on a plane is what a calibrated camera's pixel shows, and how does that move with everything that is
//! not known exactly?

use crate::calibrate::Covariance;
use crate::camera::{Camera, UndistortError, project_with_jacobian};
use crate::geometry::{Pose, Vec2, Vec3};
use nalgebra::{DMatrix, Matrix2, Matrix2x3, RowDVector, SMatrix};

/// A camera nearer to a plane than this part of its distance from the plane's origin lies in it: rounding
/// leaves as much.
const IN_THE_PLANE: f64 = 1e-12;

/// Why a pixel shows no point of the plane.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlaneViewError {
    /// The lens model does not reach the pixel.
    #[error("pixel ({u:.2}, {v:.2}): {cause}")]
    OutsideLens {
        /// u, px.
        u: f64,
        /// v, px.
        v: f64,
        /// Why.
        cause: UndistortError,
    },
    /// The ray does not meet the plane before the camera.
    #[error("pixel ({u:.2}, {v:.2}) lies on or behind the horizon of the plane")]
    BehindHorizon {
        /// u, px.
        u: f64,
        /// v, px.
        v: f64,
    },
    /// The camera's centre lies in the plane, which it sees as a line.
    #[error("the plane goes through the camera's centre: it shows no places of it")]
    ThroughCamera,
    /// There is no such view.
    #[error("view {view} of {views}: there is none")]
    NoSuchView {
        /// The index asked for.
        view: usize,
        /// Number of views.
        views: usize,
    },
}

/// A plane before a calibrated camera: Z = 0 of a target whose pose is known.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneView {
    camera: Camera,
    cam_from_plane: Pose,
    /// For the columns of the estimated parameters.
    known: Covariance,
    /// Of the n estimated parameters and the six of the pose.
    joint: DMatrix<f64>,
}

/// A point of the plane, and its derivatives.
pub(super) struct Foot {
    pub at: Vec2,
    /// By the pixel.
    pub by_pixel: Matrix2<f64>,
    /// By the n estimated parameters and the six of the pose, 2 x (n + 6).
    pub by_unknowns: DMatrix<f64>,
    /// By the height of the surface over the plane.
    pub by_height: Vec2,
}

impl PlaneView {
    /// The target's plane in one of the views of a calibration; camera and pose with their full covariance,
    /// cross blocks included.
    ///
    /// # Errors
    /// [`PlaneViewError::NoSuchView`].
    pub fn of_view(
        camera: &Camera,
        cam_from_target: &[Pose],
        covariance: &Covariance,
        view: usize,
    ) -> Result<PlaneView, PlaneViewError> {
        let found = (cam_from_target.get(view), covariance.poses.get(view), covariance.cross.get(view));
        let (Some(pose), Some(of_pose), Some(cross)) = found else {
            return Err(PlaneViewError::NoSuchView { view, views: cam_from_target.len() });
        };
        let n = covariance.free.len();
        let entry = |i: usize, j: usize| match (i < n, j < n) {
            (true, true) => covariance.intrinsics[(i, j)],
            (true, false) => cross[(i, j - n)],
            (false, true) => cross[(j, i - n)],
            (false, false) => of_pose[(i - n, j - n)],
        };
        let joint = DMatrix::from_fn(n + 6, n + 6, entry);
        Ok(PlaneView { camera: *camera, cam_from_plane: *pose, known: covariance.clone(), joint })
    }

    /// A plane whose pose comes from elsewhere, its errors independent of the camera's: standard deviations
    /// of rotation (left perturbation, rad) and translation.
    pub fn with_pose(
        camera: &Camera,
        cam_from_plane: &Pose,
        covariance: &Covariance,
        deviations: [f64; 6],
    ) -> PlaneView {
        let n = covariance.free.len();
        let entry = |i: usize, j: usize| {
            let is_pose = i == j && i >= n;
            let of_pose = if is_pose { deviations[i - n] * deviations[i - n] } else { 0.0 };
            if i < n && j < n { covariance.intrinsics[(i, j)] } else { of_pose }
        };
        let joint = DMatrix::from_fn(n + 6, n + 6, entry);
        PlaneView { camera: *camera, cam_from_plane: *cam_from_plane, known: covariance.clone(), joint }
    }

    /// The point of the plane that a pixel shows, in the target's unit.
    ///
    /// # Errors
    /// [`PlaneViewError::OutsideLens`], [`PlaneViewError::BehindHorizon`], [`PlaneViewError::ThroughCamera`].
    pub fn point(&self, pixel: &Vec2) -> Result<Vec2, PlaneViewError> {
        let (u, v) = (pixel.x, pixel.y);
        let ray =
            self.camera.normalised_ray(pixel).map_err(|cause| PlaneViewError::OutsideLens { u, v, cause })?;
        let plane_from_cam = self.cam_from_plane.inverse();
        let (centre, along) =
            (plane_from_cam.translation, plane_from_cam.rotation * Vec3::new(ray.x, ray.y, 1.0));
        if centre.z.abs() <= IN_THE_PLANE * centre.norm() {
            return Err(PlaneViewError::ThroughCamera);
        }
        let depth = -centre.z / along.z;
        if !(depth > 0.0 && depth.is_finite()) {
            return Err(PlaneViewError::BehindHorizon { u, v });
        }
        Ok((centre + along * depth).xy())
    }

    /// The point with its derivatives. The pixel `p = F(X, Y, Z; theta)` stays where it was found, so `d(X,
    /// Y) = (dF/d(X, Y))^-1 (dp - dF/dZ dZ - dF/dtheta dtheta)`.
    pub(super) fn foot(&self, pixel: &Vec2) -> Result<Foot, PlaneViewError> {
        let at = self.point(pixel)?;
        let horizon = || PlaneViewError::BehindHorizon { u: pixel.x, v: pixel.y };
        let derivatives =
            project_with_jacobian(&self.camera, &self.cam_from_plane, &Vec3::new(at.x, at.y, 0.0))
                .map_err(|_| horizon())?;
        let by_point: Matrix2x3<f64> = derivatives.pose.fixed_columns::<3>(3) * self.cam_from_plane.rotation;
        let by_pixel: Matrix2<f64> =
            by_point.fixed_columns::<2>(0).into_owned().try_inverse().ok_or_else(horizon)?;
        let camera = self.known.columns(&derivatives.intrinsics);
        let n = camera.len();
        let column = |j: usize| -> Vec2 {
            if j < n { camera[j] } else { derivatives.pose.column(j - n).into_owned() }
        };
        let moved: Vec<Vec2> = (0..n + 6).map(|j| -(by_pixel * column(j))).collect();
        Ok(Foot {
            at,
            by_pixel,
            by_unknowns: DMatrix::from_fn(2, n + 6, |i, j| moved[j][i]),
            by_height: -(by_pixel * by_point.column(2)),
        })
    }

    /// Variance of a linear function of the unknowns by cause: camera, pose, and twice their covariance.
    pub(super) fn variances(&self, gradient: &RowDVector<f64>) -> [f64; 3] {
        let n = self.known.free.len();
        let (camera, pose) = (gradient.columns(0, n), gradient.columns(n, 6));
        let block =
            |i: usize, j: usize, rows: usize, columns: usize| self.joint.view((i, j), (rows, columns));
        [
            (camera * block(0, 0, n, n) * camera.transpose())[(0, 0)],
            (pose * block(n, n, 6, 6) * pose.transpose())[(0, 0)],
            2.0 * (camera * block(0, n, n, 6) * pose.transpose())[(0, 0)],
        ]
    }

    /// Covariance of the pose alone.
    pub fn pose_covariance(&self) -> SMatrix<f64, 6, 6> {
        let n = self.known.free.len();
        self.joint.fixed_view::<6, 6>(n, n).into_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::{BrownConrady, FreeParameters, Parameter};
    use nalgebra::{MatrixXx6, Vector6};

    const FREE: [Parameter; 6] =
        [Parameter::Fx, Parameter::Cx, Parameter::Cy, Parameter::K1, Parameter::K2, Parameter::P1];

    fn camera() -> Camera {
        Camera::pinhole(600.0, 612.0, 326.0, 243.0)
            .with_distortion(BrownConrady { p1: 1e-3, ..BrownConrady::radial(-0.18, 0.05) })
    }

    fn pose() -> Pose {
        let rotation = crate::geometry::rotation::from_xyz_rad(0.3, -0.4, 0.2);
        Pose { rotation, translation: Vec3::new(3.0, -5.0, 140.0) }
    }

    /// fy tied to fx.
    fn covariance() -> Covariance {
        Covariance {
            free: FreeParameters::of(&FREE),
            fy_per_fx: Some(1.02),
            intrinsics: DMatrix::identity(6, 6),
            poses: vec![SMatrix::identity()],
            cross: vec![MatrixXx6::zeros(6)],
        }
    }

    fn seen(camera: &Camera, pose: &Pose) -> PlaneView {
        PlaneView::of_view(camera, &[*pose], &covariance(), 0).unwrap()
    }

    #[test]
    fn derivatives_agree_with_central_differences() {
        let pixel = Vec2::new(480.0, 160.0);
        let foot = seen(&camera(), &pose()).foot(&pixel).unwrap();
        let point = |camera: &Camera, pose: &Pose, pixel: &Vec2| seen(camera, pose).point(pixel).unwrap();
        let near = |analytic: Vec2, ahead: Vec2, behind: Vec2, h: f64| {
            let difference = (ahead - behind) / (2.0 * h);
            assert!(
                (difference - analytic).norm() < 1e-6 * (1.0 + analytic.norm()),
                "{difference} {analytic}"
            );
        };
        for (i, parameter) in FREE.into_iter().enumerate() {
            let h = 1e-5 * (1.0 + camera().get(parameter).abs());
            let moved = |h: f64| {
                let camera = camera().with(parameter, camera().get(parameter) + h);
                if parameter == Parameter::Fx {
                    camera.with(Parameter::Fy, camera.fy + 1.02 * h)
                } else {
                    camera
                }
            };
            let at = |h: f64| point(&moved(h), &pose(), &pixel);
            near(foot.by_unknowns.column(i).fixed_rows::<2>(0).into_owned(), at(h), at(-h), h);
        }
        for i in 0..6 {
            let at = |h: f64| point(&camera(), &pose().perturbed(&Vector6::ith(i, h)), &pixel);
            near(foot.by_unknowns.column(6 + i).fixed_rows::<2>(0).into_owned(), at(1e-5), at(-1e-5), 1e-5);
        }
        for (i, axis) in [Vec2::x(), Vec2::y()].into_iter().enumerate() {
            let at = |h: f64| point(&camera(), &pose(), &(pixel + axis * h));
            near(foot.by_pixel.column(i).into_owned(), at(1e-4), at(-1e-4), 1e-4);
        }
        // A plane h higher is one whose origin lies h further along its normal.
        let at = |h: f64| {
            let origin = pose().apply(&Vec3::new(0.0, 0.0, h));
            point(&camera(), &Pose { translation: origin, ..pose() }, &pixel)
        };
        near(foot.by_height, at(1e-3), at(-1e-3), 1e-3);
    }

    #[test]
    fn a_pixel_above_the_horizon_shows_no_point() {
        // Tilted by 80 degrees about x, the plane's horizon crosses the image.
        let rotation = crate::geometry::rotation::from_xyz_rad(80.0_f64.to_radians(), 0.0, 0.0);
        let view = seen(
            &Camera::pinhole(600.0, 612.0, 320.0, 240.0),
            &Pose { rotation, translation: Vec3::new(0.0, 0.0, 140.0) },
        );
        let points = [100.0, 470.0].map(|v| view.point(&Vec2::new(320.0, v)));
        assert!(points.iter().filter(|point| point.is_ok()).count() == 1, "{points:?}");
        assert!(matches!(
            PlaneView::of_view(&camera(), &[pose()], &covariance(), 1),
            Err(PlaneViewError::NoSuchView { view: 1, views: 1 })
        ));
    }
}
