//! How large is the error on views that a calibration has not seen, and how large should it be?
//!
//! A new view is located with the camera held. To first order its residuals are what the pose leaves of the
//! noise and of the camera's error:
//!
//! ```text
//! r = M (e + J d),   M = I - C (C^T C)^-1 C^T,   e ~ N(0, sigma^2 I),   d ~ N(0, P)
//! cov r = sigma^2 M + M J P J^T M
//! ```
//! `J` has the derivatives of the pixels by the estimated parameters, `C` those by the view's pose, `P` is
//! the camera's covariance, which all views share. With `P = sigma^2 L L^T` and `G = L^T (sum J^T M J) L`, of
//! eigenvalues `g_k`, the sum of squares over `sigma^2` is chi-squared with `2 N - 6 V - n` degrees of
//! freedom and, of `n` more terms, each `1 + g_k` times one of one degree. `sigma` and the scale of `P` are
//! known from the calibration's residuals alone, so that the whole is a [`Ratio`].
//!
//! The second test asks of the camera alone: `b = L^T sum J^T r / sigma` has the covariance `G + G^2`. A
//! camera that is wrong by a few of its standard deviations moves the RMSE of hundreds of points hardly, and
//! this by as many.

use super::Ratio;
use super::root::root;
use super::slopes::{Estimated, Slopes};
use crate::board::View;
use crate::calibrate::{Covariance, LensCalibration, locate};
use crate::camera::{Camera, Lens};
use crate::distribution::{ChiSquare, fisher_tail};
use crate::evaluate::Interval;
use crate::geometry::{Pose, Vec2, Vec3};
use nalgebra::{DMatrix, DVector, Matrix6, SMatrix, Vector6};

/// A calibration to be judged.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate<'a> {
    /// The camera, with a lens of any model.
    pub camera: &'a Camera<Lens>,
    /// Covariance of what was estimated of it; of poses nothing is asked.
    pub covariance: &'a Covariance,
    /// Noise of a pixel coordinate (of a mark of weight 1), px.
    pub sigma_px: f64,
    /// Degrees of freedom of that noise; without them it is taken as known.
    pub degrees_of_freedom: Option<usize>,
}

impl<'a> From<&'a LensCalibration> for Estimate<'a> {
    fn from(calibration: &'a LensCalibration) -> Estimate<'a> {
        let LensCalibration { camera, covariance, sigma_px, degrees_of_freedom, .. } = calibration;
        let degrees_of_freedom = Some(*degrees_of_freedom);
        Estimate { camera, covariance, sigma_px: *sigma_px, degrees_of_freedom }
    }
}

/// An error with its prediction.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Outcome {
    /// Points.
    pub points: usize,
    /// `sqrt(sum |r|^2 / N)`, weighted, px.
    pub rmse_px: f64,
    /// `sqrt` of its expected square, px.
    pub predicted_px: f64,
    /// The same if the camera were known exactly: what the noise alone leaves, px.
    pub noise_alone_px: f64,
    /// Where a right calibration lets it lie but for the rate of false alarms, px.
    pub interval_px: Interval,
    /// Chance of so large an error, or a larger one.
    pub p_value: f64,
}

/// A view that the calibration had not seen.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Unseen {
    /// Its pose, the camera held.
    pub cam_from_target: Pose,
    /// Predicted - observed, px.
    pub residuals_px: Vec<Vec2>,
    /// Its error and prediction.
    pub outcome: Outcome,
}

/// Whether the new views ask for another camera.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct CameraTest {
    /// Squared length of `(G + G^2)^(-1/2) b`.
    pub chi_squared: f64,
    /// Combinations of parameters that the new views see.
    pub degrees_of_freedom: usize,
    /// Chance of so large a value if the camera is right within its covariance.
    pub p_value: f64,
}

/// What new views say of a calibration.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct HoldOut {
    /// View by view.
    pub views: Vec<Unseen>,
    /// All together.
    pub together: Outcome,
    /// The camera's test; `None` if nothing was estimated of it.
    pub camera: Option<CameraTest>,
    /// Chance that a right calibration fails.
    pub false_alarm: f64,
}

impl HoldOut {
    /// Whether the calibration holds: neither the error of all views nor the camera's test is rarer than half
    /// of the rate of false alarms (Bonferroni).
    pub fn holds(&self) -> bool {
        let of_camera = self.camera.map_or(1.0, |test| test.p_value);
        self.together.p_value.min(of_camera) >= 0.5 * self.false_alarm
    }
}

/// Why nothing can be said.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HoldOutError {
    /// Nothing to judge by.
    #[error("there is no view to validate with")]
    NoViews,
    /// A view whose pose leaves nothing over.
    #[error(
        "view {view} has {points} marks: a pose takes 6 coordinates, so that 4 marks are the least that leave an error"
    )]
    TooFewPoints {
        /// Index of the view.
        view: usize,
        /// Its marks.
        points: usize,
    },
    /// The camera does not see a view.
    #[error(
        "view {view} cannot be located: the camera cannot have seen its marks there, or they lie on a line"
    )]
    NotLocated {
        /// Index of the view.
        view: usize,
    },
    /// The calibration does not say how well it is known.
    #[error(
        "the calibration's noise of {sigma_px} px and its covariance predict nothing: it needs more than {LEAST_FREEDOM} degrees of freedom"
    )]
    NoPrediction {
        /// Its noise.
        sigma_px: f64,
    },
}

/// Locates new views with the camera held, and compares their error with its prediction. `false_alarm` is the
/// chance that a right calibration fails.
///
/// # Errors
/// See [`HoldOutError`].
///
/// ```
/// use calibench::calibrate::{Settings, calibrate_lens};
/// use calibench::synth::{Scene, Stream, StreamKey};
/// use calibench::validate::{Estimate, hold_out};
///
/// let scene = Scene::example();
/// let photographs = |trial: u64| {
///     scene.observe(0.1, &mut Stream::open(StreamKey { seed: 1, scenario: "hold-out", trial, purpose: "noise" }))
/// };
/// let result = calibrate_lens(&photographs(0), &Settings::standard())?;
/// let estimate = Estimate::from(&result);
/// let new = photographs(1);
/// let right = hold_out(&estimate, &new, 0.01)?;
/// assert!(right.holds() && right.together.predicted_px > right.together.noise_alone_px);
/// // The same camera after its lens was turned by two percent.
/// let turned = calibench::camera::Camera { fx: 1.02 * result.camera.fx, fy: 1.02 * result.camera.fy, ..result.camera };
/// assert!(!hold_out(&Estimate { camera: &turned, ..estimate }, &new, 0.01)?.holds());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn hold_out(estimate: &Estimate, views: &[View], false_alarm: f64) -> Result<HoldOut, HoldOutError> {
    let Estimate { sigma_px, covariance, degrees_of_freedom, .. } = *estimate;
    let is_known = sigma_px > 0.0
        && sigma_px.is_finite()
        && degrees_of_freedom.is_none_or(|freedom| freedom > LEAST_FREEDOM);
    if views.is_empty() {
        return Err(HoldOutError::NoViews);
    }
    let unit = is_known.then(|| &covariance.intrinsics / (sigma_px * sigma_px));
    let root = unit.and_then(|unit| root(&unit)).ok_or(HoldOutError::NoPrediction { sigma_px })?;
    let mut all = Sums::zero(root.ncols());
    let mut judged = Vec::new();
    for (index, view) in views.iter().enumerate() {
        let (pose, residuals_px, sums) = seen(estimate, view, &root, index)?;
        all.add(&sums);
        let outcome = sums.outcome(estimate, false_alarm);
        judged.push(Unseen { cam_from_target: pose, residuals_px, outcome });
    }
    Ok(HoldOut {
        views: judged,
        together: all.outcome(estimate, false_alarm),
        camera: all.camera_test(estimate),
        false_alarm,
    })
}

/// A located view: its pose, its residuals and its share of the sums.
fn seen(
    estimate: &Estimate,
    view: &View,
    root: &DMatrix<f64>,
    index: usize,
) -> Result<(Pose, Vec<Vec2>, Sums), HoldOutError> {
    if view.len() < 4 {
        return Err(HoldOutError::TooFewPoints { view: index, points: view.len() });
    }
    let lost = HoldOutError::NotLocated { view: index };
    let located = locate(estimate.camera, view).ok_or(lost)?;
    let pose = located.cam_from_target;
    let sums = Sums::of_view(estimate, view, &pose, &located.residuals, root).ok_or(lost)?;
    Ok((pose, located.residuals, sums))
}

/// What views add up: `G`, `b` and the sum of squares over `sigma^2`.
#[derive(Debug, Clone, PartialEq)]
struct Sums {
    information: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Weighted, px^2.
    square: f64,
    points: usize,
    views: usize,
}

impl Sums {
    fn zero(n: usize) -> Sums {
        Sums {
            information: DMatrix::zeros(n, n),
            gradient: DVector::zeros(n),
            square: 0.0,
            points: 0,
            views: 0,
        }
    }

    fn add(&mut self, other: &Sums) {
        self.information += &other.information;
        self.gradient += &other.gradient;
        self.square += other.square;
        self.points += other.points;
        self.views += other.views;
    }

    /// `None` where a mark cannot be seen, or the marks do not determine the pose.
    fn of_view(
        estimate: &Estimate,
        view: &View,
        pose: &Pose,
        residuals: &[Vec2],
        root: &DMatrix<f64>,
    ) -> Option<Sums> {
        let n = root.ncols();
        let Covariance { free, fy_per_fx, .. } = *estimate.covariance;
        let estimated = Estimated { free, fy_per_fx };
        let mut of_pose = Matrix6::<f64>::zeros();
        let mut cross = DMatrix::<f64>::zeros(6, n);
        let mut sums = Sums { points: view.len(), views: 1, ..Sums::zero(n) };
        for (i, (point, residual)) in view.points().iter().zip(residuals).enumerate() {
            let weight = view.weights().map_or(1.0, |weights| weights[i]);
            let of = Slopes::of(estimate.camera, pose, &Vec3::new(point.x, point.y, 0.0))?;
            let columns = of.by_estimated(&estimated);
            let by_camera = DMatrix::from_fn(2, n, |i, j| weight * columns[j][i]) * root;
            let by_pose: SMatrix<f64, 2, 6> = of.by_pose * weight;
            let weighted = residual * weight;
            of_pose += by_pose.transpose() * by_pose;
            cross += by_pose.transpose() * &by_camera;
            sums.information += by_camera.transpose() * &by_camera;
            sums.gradient += by_camera.transpose() * weighted / estimate.sigma_px;
            sums.square += weighted.norm_squared();
        }
        // Rotations and lengths have different units: the pose is scaled to unit columns first.
        let size = Vector6::from_fn(|i, _| 1.0 / of_pose[(i, i)].sqrt());
        let scaled = DMatrix::from_fn(6, 6, |i, j| size[i] * of_pose[(i, j)] * size[j]).cholesky()?;
        let cross = DMatrix::from_fn(6, n, |i, j| size[i] * cross[(i, j)]);
        sums.information -= cross.transpose() * scaled.solve(&cross);
        Some(sums)
    }

    /// Eigenvalues of `G`, those that rounding leaves below 0 raised to it.
    fn gains(&self) -> Vec<f64> {
        self.information.clone().symmetric_eigenvalues().iter().map(|g| g.max(0.0)).collect()
    }

    /// Distribution of the sum of squares over `sigma^2`.
    fn distribution(&self, noise_freedom: Option<usize>) -> Ratio {
        let rest = 2.0 * self.points as f64 - 6.0 * self.views as f64;
        let mut terms: Vec<(f64, f64)> = self.gains().iter().map(|g| (1.0 + g, 1.0)).collect();
        // A view of few marks has fewer coordinates to spare than the camera has parameters.
        terms.sort_by(|a, b| b.0.total_cmp(&a.0));
        terms.truncate(rest as usize);
        let noise = rest - terms.len() as f64;
        terms.extend((noise > 0.0).then_some((1.0, noise)));
        Ratio::new(terms, noise_freedom)
    }

    fn outcome(&self, estimate: &Estimate, false_alarm: f64) -> Outcome {
        let distribution = self.distribution(estimate.degrees_of_freedom);
        let (sigma, count) = (estimate.sigma_px, self.points as f64);
        let in_px = |square: f64| sigma * (square / count).sqrt();
        let rest = 2.0 * count - 6.0 * self.views as f64;
        Outcome {
            points: self.points,
            rmse_px: (self.square / count).sqrt(),
            predicted_px: in_px(distribution.mean_of_numerator()),
            noise_alone_px: in_px(rest),
            interval_px: Interval {
                low: in_px(distribution.quantile(1.0 - 0.5 * false_alarm)),
                high: in_px(distribution.quantile(0.5 * false_alarm)),
            },
            p_value: distribution.tail(self.square / (sigma * sigma)),
        }
    }

    fn camera_test(&self, estimate: &Estimate) -> Option<CameraTest> {
        let eigen = self.information.clone().symmetric_eigen();
        let components = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
        let told: Vec<f64> = components
            .filter(|(g, _)| **g > UNTOLD)
            .map(|(g, direction)| direction.dot(&self.gradient) / (g + g * g).sqrt())
            .collect();
        let (chi_squared, degrees_of_freedom) = (told.iter().map(|z| z * z).sum::<f64>(), told.len());
        let p_value = match estimate.degrees_of_freedom {
            Some(noise) => fisher_tail(chi_squared / degrees_of_freedom as f64, degrees_of_freedom, noise),
            None => ChiSquare::new(degrees_of_freedom).survival(chi_squared),
        };
        (degrees_of_freedom > 0).then_some(CameraTest { chi_squared, degrees_of_freedom, p_value })
    }
}

/// With so few degrees of freedom of the noise, errors over it have no mean (that of Fisher's ratio is `nu /
/// (nu - 2)`), and limits for them lie beyond all that is of use.
const LEAST_FREEDOM: usize = 2;

/// New views that tell less than this part of what the calibration knows of a combination tell rounding of
/// it.
const UNTOLD: f64 = 1e-6;
