//! Which camera and pose make the pixels of one view most likely? Least squared pixel distance, points in
//! three dimensions.
//!
//! The unknowns are any of the ten intrinsics, fy tied to fx if that is asked, and six numbers of the pose,
//! `R <- exp(delta) R`. [`crate::calibrate::calibrate`] does the same and much more for planes; this is what
//! a target in three dimensions needs, and what tells a facing plane from a tilted one.

use super::SpatialView;
use super::descent::{Normal, descend};
use crate::camera::{Camera, FreeParameters, Parameter, project_with_jacobian};
use crate::geometry::{Pose, Vec2, Vec3, rotation};
use nalgebra::{DMatrix, DVector, Vector6};

/// The most likely camera and pose.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Refined {
    /// The camera.
    pub camera: Camera,
    /// Where the target was.
    pub cam_from_target: Pose,
    /// What was estimated of the camera.
    pub free: FreeParameters,
    /// fy over fx, if they were tied.
    pub fy_per_fx: Option<f64>,
    /// Covariance of the free parameters, then of the pose: rotation `delta` (rad), translation; scaled by
    /// the noise that the residuals show.
    #[cfg_attr(feature = "serde", serde(with = "crate::rows"))]
    pub covariance: DMatrix<f64>,
    /// That noise: standard deviation of a pixel coordinate, px.
    pub sigma_px: f64,
    /// `sqrt(sum |r|^2 / N)`, px.
    pub rmse_px: f64,
    /// `2 N - p`.
    pub degrees_of_freedom: usize,
    /// Predicted - observed, px.
    pub residuals_px: Vec<Vec2>,
}

impl Refined {
    /// Standard deviation of a parameter; `None` if it was held.
    pub fn standard_deviation(&self, parameter: Parameter) -> Option<f64> {
        let of = |p: Parameter| Some(self.free.position(p)?).map(|i| self.covariance[(i, i)].sqrt());
        match self.fy_per_fx {
            Some(ratio) if parameter == Parameter::Fy => Some(ratio * of(Parameter::Fx)?),
            _ => of(parameter),
        }
    }

    /// Standard deviation of the pose: rotation (rad), translation.
    pub fn pose_standard_deviations(&self) -> [f64; 6] {
        let n = self.free.len();
        std::array::from_fn(|k| self.covariance[(n + k, n + k)].sqrt())
    }
}

/// Why there is no most likely camera.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RefineError {
    /// Nothing is left to tell the noise.
    #[error(
        "{coordinates} pixel coordinates leave nothing over for {unknowns} unknowns: give more points or hold parameters"
    )]
    TooFewPoints {
        /// Twice the number of points.
        coordinates: usize,
        /// Free intrinsics and six of the pose.
        unknowns: usize,
    },
    /// The minimum is none, or none that these data determine.
    #[error(
        "the view does not determine all that is estimated: hold the principal point, or use a target that is more tilted or deeper"
    )]
    NotDetermined,
}

/// The most likely camera and pose near a start, such as that of [`super::two_stage`]. Parameters that are
/// not free stay as they are; with `fy_per_fx` fy follows fx.
///
/// # Errors
/// Too few points, or unknowns that the view does not determine.
///
/// ```
/// use calibench::camera::FreeParameters;
/// use calibench::synth::{Scene, Truth};
/// use calibench::tsai::{SpatialView, refine_view};
///
/// let scene = Scene::example();
/// let view = SpatialView::from(&scene.exact()[1]);
/// let start = scene.truth.camera.with(calibench::camera::Parameter::Fx, 640.0);
/// let free: FreeParameters = "fx,k1,k2".parse()?;
/// let found = refine_view(&view, (&start, &scene.truth.cam_from_target[1]), free, Some(1.0))?;
/// assert!((found.camera.fx - 600.0).abs() < 1e-6 && found.camera.fy == found.camera.fx);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn refine_view(
    view: &SpatialView,
    start: (&Camera, &Pose),
    free: FreeParameters,
    fy_per_fx: Option<f64>,
) -> Result<Refined, RefineError> {
    let unknowns = free.len() + 6;
    let coordinates = 2 * view.len();
    if coordinates <= unknowns {
        return Err(RefineError::TooFewPoints { coordinates, unknowns });
    }
    let fit = Fit::of(view, free, fy_per_fx, &[0, 1, 2, 3, 4, 5]);
    let best = fit.descend(start).ok_or(RefineError::NotDetermined)?;
    let normal = fit.normal(&best).ok_or(RefineError::NotDetermined)?;
    let degrees_of_freedom = coordinates - unknowns;
    let variance = normal.cost / degrees_of_freedom as f64;
    let unit = inverse(&normal.square).ok_or(RefineError::NotDetermined)?;
    let (camera, pose) = (best.camera, fit.cam_from_target(&best));
    Ok(Refined {
        covariance: fit.about_the_origin(&best, &unit) * variance,
        free,
        fy_per_fx,
        sigma_px: variance.sqrt(),
        rmse_px: (normal.cost / view.len() as f64).sqrt(),
        degrees_of_freedom,
        residuals_px: residuals(&camera, &pose, view).ok_or(RefineError::NotDetermined)?,
        camera,
        cam_from_target: pose,
    })
}

/// `sqrt(sum |r|^2 / N)`, px; `None` where a point is behind the camera.
pub(super) fn rmse_px(camera: &Camera, cam_from_target: &Pose, view: &SpatialView) -> Option<f64> {
    let residuals = residuals(camera, cam_from_target, view)?;
    Some((residuals.iter().map(Vec2::norm_squared).sum::<f64>() / view.len() as f64).sqrt())
}

fn residuals(camera: &Camera, cam_from_target: &Pose, view: &SpatialView) -> Option<Vec<Vec2>> {
    view.pairs().map(|(point, pixel)| Some(camera.project(&cam_from_target.apply(point))? - pixel)).collect()
}

/// Inverse of a positive definite matrix whose unknowns may have any unit; `None` where rounding decides.
fn inverse(square: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let size = square.diagonal().map(|d| 1.0 / d.sqrt());
    let n = square.nrows();
    let scaled = DMatrix::from_fn(n, n, |i, j| size[i] * square[(i, j)] * size[j]);
    // The columns have unit length: an eigenvalue of this size is the rounding of the sums.
    let least = scaled.symmetric_eigenvalues().min();
    if least.is_nan() || least < SINGULAR {
        return None;
    }
    let inverse = scaled.cholesky()?.inverse();
    Some(DMatrix::from_fn(n, n, |i, j| size[i] * inverse[(i, j)] * size[j]))
}

/// Least eigenvalue of normal equations with a unit diagonal: sums of some hundred terms of size one are
/// known to 1e-14.
const SINGULAR: f64 = 1e-13;

/// Camera, and pose of the target's centroid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct State {
    pub camera: Camera,
    pose: Pose,
}

/// What is fitted to what.
pub(super) struct Fit<'a> {
    pixels: &'a [Vec2],
    /// Points from their centroid: rotations then move no far origin.
    points: Vec<Vec3>,
    centre: Vec3,
    free: FreeParameters,
    fy_per_fx: Option<f64>,
    /// Which of the six numbers of the pose are unknown.
    of_pose: &'a [usize],
}

impl<'a> Fit<'a> {
    pub fn of(
        view: &'a SpatialView,
        free: FreeParameters,
        fy_per_fx: Option<f64>,
        of_pose: &'a [usize],
    ) -> Fit<'a> {
        let centre = view.points().iter().sum::<Vec3>() / view.len() as f64;
        let points = view.points().iter().map(|p| p - centre).collect();
        Fit { pixels: view.pixels(), points, centre, free, fy_per_fx, of_pose }
    }

    pub fn descend(&self, (camera, cam_from_target): (&Camera, &Pose)) -> Option<State> {
        let pose = Pose { translation: cam_from_target.apply(&self.centre), ..*cam_from_target };
        let start = self.stepped(&State { camera: *camera, pose }, &DVector::zeros(self.unknowns()));
        descend(start, |at| self.normal(at), |at, step| self.stepped(at, step))
    }

    pub fn normal(&self, at: &State) -> Option<Normal> {
        let mut normal = Normal::zeros(self.unknowns());
        let n = self.free.len();
        for (point, pixel) in self.points.iter().zip(self.pixels) {
            let of = project_with_jacobian(&at.camera, &at.pose, point).ok()?;
            let of_camera: Vec<Vec2> = self.free.iter().map(|p| self.column(&of.intrinsics, p)).collect();
            let entry = |i: usize, j: usize| match j.checked_sub(n) {
                None => of_camera[j][i],
                Some(k) => of.pose[(i, self.of_pose[k])],
            };
            normal.add(&(of.pixel - pixel), &DMatrix::from_fn(2, self.unknowns(), entry));
        }
        normal.cost.is_finite().then_some(normal)
    }

    fn unknowns(&self) -> usize {
        self.free.len() + self.of_pose.len()
    }

    /// To the derivative by fx an fy that is tied to it adds its share.
    fn column(&self, of_all: &nalgebra::SMatrix<f64, 2, { Parameter::COUNT }>, parameter: Parameter) -> Vec2 {
        let own = of_all.column(parameter as usize).into_owned();
        match self.fy_per_fx {
            Some(ratio) if parameter == Parameter::Fx => own + ratio * of_all.column(Parameter::Fy as usize),
            _ => own,
        }
    }

    fn stepped(&self, at: &State, step: &DVector<f64>) -> State {
        let with = |camera: Camera, (i, p): (usize, Parameter)| camera.with(p, camera.get(p) + step[i]);
        let camera = self.free.iter().enumerate().fold(at.camera, with);
        let camera = self.fy_per_fx.map_or(camera, |ratio| camera.with(Parameter::Fy, ratio * camera.fx));
        let mut moved = Vector6::zeros();
        self.of_pose.iter().enumerate().for_each(|(k, &which)| moved[which] = step[self.free.len() + k]);
        State { camera, pose: at.pose.perturbed(&moved) }
    }

    fn cam_from_target(&self, at: &State) -> Pose {
        let Pose { rotation, translation } = at.pose;
        Pose { rotation, translation: translation - rotation * self.centre }
    }

    /// A covariance whose translation is that of the centroid, as that of the target's origin: `T = T_c - R
    /// c`, so `dT = dT_c + [R c]x delta`.
    fn about_the_origin(&self, at: &State, covariance: &DMatrix<f64>) -> DMatrix<f64> {
        let n = self.free.len();
        let mut change = DMatrix::identity(n + 6, n + 6);
        change.fixed_view_mut::<3, 3>(n + 3, n).copy_from(&rotation::skew(&(at.pose.rotation * self.centre)));
        &change * covariance * change.transpose()
    }
}
