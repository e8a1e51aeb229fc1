//! What does one more view tell of the camera, when its own pose has to be found too?

use crate::camera::{Camera, FreeParameters, Lens, Parameter};
use crate::geometry::{Pose, Vec2, Vec3, rotation};
use nalgebra::{DMatrix, Matrix2xX, Matrix6, MatrixXx6, SMatrix};

/// What of a camera is estimated: parameters, fy perhaps tied to fx.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimated {
    /// The parameters, in the order of every matrix here.
    pub free: FreeParameters,
    /// fy over fx, if the two are tied: fy is then not free.
    pub fy_per_fx: Option<f64>,
}

impl Estimated {
    /// Number of estimated parameters.
    pub fn len(&self) -> usize {
        self.free.len()
    }

    /// Whether nothing is estimated.
    pub fn is_empty(&self) -> bool {
        self.free.is_empty()
    }

    /// The derivatives by the estimated parameters, 2 x n, from those by all: to that of fx an fy that is
    /// tied to it adds its share.
    pub(super) fn columns(&self, by_parameters: &[(Parameter, Vec2)]) -> Matrix2xX<f64> {
        let slope = |parameter: Parameter| {
            by_parameters.iter().find(|(p, _)| *p == parameter).map_or(Vec2::zeros(), |(_, slope)| *slope)
        };
        let columns: Vec<Vec2> = self
            .free
            .iter()
            .map(|parameter| match self.fy_per_fx {
                Some(ratio) if parameter == Parameter::Fx => slope(parameter) + ratio * slope(Parameter::Fy),
                _ => slope(parameter),
            })
            .collect();
        Matrix2xX::from_fn(columns.len(), |i, j| columns[j][i])
    }
}

/// A smaller part of an unknown's information than this is rounding, of which marks on a line leave some
/// 1e-16: a board that faces the camera from n times its size tells tilt from shift by about the part 1 /
/// n^2, far more.
const SINGULAR: f64 = 1e-12;

/// The information of a view about the estimated parameters, n x n, in units of their inverse squares: `S =
/// (A - B C^-1 B^T) / sigma^2`, with `A = sum J^T J` over the marks' derivatives by the parameters, `C` the
/// same by the six numbers of the view's pose and `B` the products of both. The pose is eliminated (Schur
/// complement): what the view says of the camera is what no other pose explains.
///
/// `points` are the marks of the target, Z = 0, in the unit of the pose. `None` where a mark has no image, or
/// the marks do not determine the pose.
pub fn view_information(
    camera: &Camera<Lens>,
    estimated: &Estimated,
    cam_from_target: &Pose,
    points: &[Vec2],
    sigma_px: f64,
) -> Option<DMatrix<f64>> {
    let ViewBlocks { a, b, c } = ViewBlocks::of(camera, estimated, cam_from_target, points)?;
    // Radians and lengths are of different sizes: each unknown in units of its own information.
    let unit = SMatrix::<f64, 6, 1>::from_fn(|i, _| 1.0 / c[(i, i)].sqrt());
    let scaled = Matrix6::from_fn(|i, j| c[(i, j)] * unit[i] * unit[j]);
    let b = MatrixXx6::from_fn(estimated.len(), |i, j| b[(i, j)] * unit[j]);
    let factor = scaled.cholesky()?;
    // A pivot is the part of an unknown's information that the others before it leave.
    if factor.l_dirty().diagonal().iter().any(|root| root * root < SINGULAR) {
        return None;
    }
    let explained = factor.solve(&b.transpose());
    let information = (a - b * explained) / (sigma_px * sigma_px);
    information.iter().all(|x| x.is_finite()).then_some(information)
}

/// The information of a view about its own pose, the camera known: `C / sigma^2`. `None` where a mark has no
/// image.
pub(super) fn pose_information(
    camera: &Camera<Lens>,
    cam_from_target: &Pose,
    points: &[Vec2],
    sigma_px: f64,
) -> Option<Matrix6<f64>> {
    let nothing = Estimated { free: FreeParameters::NONE, fy_per_fx: None };
    Some(ViewBlocks::of(camera, &nothing, cam_from_target, points)?.c / (sigma_px * sigma_px))
}

/// The sums `J^T J` of a view over its marks, for unit noise: what it says of the camera, of its own pose,
/// and of both together. A step of the pose is `R <- exp(delta) R`, `t <- t + step`.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ViewBlocks {
    /// By the estimated parameters, n x n.
    pub a: DMatrix<f64>,
    /// By parameters and pose, n x 6.
    pub b: MatrixXx6<f64>,
    /// By the pose.
    pub c: Matrix6<f64>,
}

impl ViewBlocks {
    /// Of the marks `points` of the target, Z = 0; `None` where one has no image.
    pub fn of(
        camera: &Camera<Lens>,
        estimated: &Estimated,
        cam_from_target: &Pose,
        points: &[Vec2],
    ) -> Option<ViewBlocks> {
        let n = estimated.len();
        let mut sum = ViewBlocks { a: DMatrix::zeros(n, n), b: MatrixXx6::zeros(n), c: Matrix6::zeros() };
        for point in points {
            let rotated = cam_from_target.rotation * Vec3::new(point.x, point.y, 0.0);
            let at = camera.pixel_with_derivatives(&(rotated + cam_from_target.translation))?;
            let mut by_pose = SMatrix::<f64, 2, 6>::zeros();
            by_pose.fixed_columns_mut::<3>(0).copy_from(&(-at.by_point * rotation::skew(&rotated)));
            by_pose.fixed_columns_mut::<3>(3).copy_from(&at.by_point);
            let by_camera = estimated.columns(&at.by_parameters);
            sum.a += by_camera.transpose() * &by_camera;
            sum.b += by_camera.transpose() * by_pose;
            sum.c += by_pose.transpose() * by_pose;
        }
        Some(sum)
    }
}
