//! From correspondences to a camera with its uncertainty: the steps of Zhang's method in order.

use super::conditioning::Conditioning;
use super::minimise::{Minimum, Problem, State, Termination};
use super::normal::{self, Observations};
use super::report::{STRONG_CORRELATION, UNCERTAIN_FOCAL};
use super::{Calibration, CalibrationError, Covariance, Loss, Settings, Warning, identifiability, start};
use crate::camera::{Camera, FreeParameters, Parameter};
use crate::geometry::{Homography, Mat3, Pose, Vec2, Vec3, rotation};
use crate::target::View;
use nalgebra::SMatrix;

/// Estimates the free parameters of `settings` and the pose of every view.
///
/// 1. A maximum-likelihood homography for each view.
/// 2. Intrinsics in closed form, poses from them (Zhang 2000, section 3.1).
/// 3. All unknowns refined together: the sum of squared pixel distances is least (Zhang 2000, section 3.2, with the full
///    Brown-Conrady model), which is the maximum-likelihood estimate under Gaussian noise.
/// 4. Covariance, conditioning, warnings.
///
/// # Errors
/// Data that cannot determine the free parameters are refused; see [`CalibrationError`]. A refinement that does not converge is
/// no error: the result says so in [`Calibration::termination`] and in a warning.
pub fn calibrate(views: &[View], settings: &Settings) -> Result<Calibration, CalibrationError> {
    check_counts(views, settings)?;
    let frame = TargetFrame::of(views);
    let observations: Vec<Observations> = views.iter().map(|view| frame.observations(view)).collect();
    let homographies = homographies(&observations)?;
    let starts = start::starts(&homographies, settings, pixel_frame(views))?;
    let problem = Problem {
        free: settings.free(),
        observations: &observations,
        loss: settings.loss,
        max_iterations: settings.max_iterations,
        hold_tilt: false,
    };
    report(&minimise_from(&problem, starts), &problem, &frame)
}

/// The minimum from the first start that converges, or else the lowest point reached.
fn minimise_from(problem: &Problem<'_>, starts: Vec<State>) -> Minimum {
    let mut best: Option<Minimum> = None;
    for start in starts {
        let minimum = problem.minimise(start);
        if minimum.termination == Termination::Converged {
            return minimum;
        }
        if best.as_ref().is_none_or(|b| minimum.system.cost < b.system.cost) {
            best = Some(minimum);
        }
    }
    best.expect("there is at least one start")
}

fn check_counts(views: &[View], settings: &Settings) -> Result<(), CalibrationError> {
    use Parameter::*;
    if !settings.loss.is_valid() {
        return Err(CalibrationError::BadLoss);
    }
    let free = settings.free();
    let linear = [Fx, Fy, Cx, Cy, Skew].into_iter().filter(|&p| free.contains(p)).count();
    let need = linear.div_ceil(2).max(1);
    if views.len() < need {
        return Err(CalibrationError::TooFewViews { need, got: views.len(), linear });
    }
    let coordinates = 2 * views.iter().map(View::len).sum::<usize>();
    let unknowns = free.len() + 6 * views.len();
    if coordinates < unknowns {
        return Err(CalibrationError::TooFewPoints { coordinates, unknowns });
    }
    Ok(())
}

fn homographies(observations: &[Observations]) -> Result<Vec<Homography>, CalibrationError> {
    observations
        .iter()
        .enumerate()
        .map(|(view, o)| {
            let (points, pixels): (Vec<Vec2>, Vec<Vec2>) = o.pairs.iter().copied().unzip();
            Homography::fit(&points, &pixels)
                .map(|fit| fit.homography)
                .map_err(|source| CalibrationError::View { view, source })
        })
        .collect()
}

/// Centre and half-width of the box around all pixels.
fn pixel_frame(views: &[View]) -> (Vec2, f64) {
    let pixels = || views.iter().flat_map(View::pixels);
    let low = pixels().fold(Vec2::repeat(f64::INFINITY), |m, p| m.inf(p));
    let high = pixels().fold(Vec2::repeat(f64::NEG_INFINITY), |m, p| m.sup(p));
    (0.5 * (low + high), 0.5 * (high - low).max())
}

/// The frame in which targets are refined: centred on the points, scaled to unit size, so that neither the unit nor a far
/// origin of the target costs digits.
struct TargetFrame {
    centre: Vec2,
    scale: f64,
}

impl TargetFrame {
    fn of(views: &[View]) -> TargetFrame {
        let points = || views.iter().flat_map(View::points);
        let count = points().count() as f64;
        let centre = points().sum::<Vec2>() / count;
        let mean_square = points().map(|p| (p - centre).norm_squared()).sum::<f64>() / count;
        // Coincident points have no size; their homography refuses them.
        let scale = if mean_square > 0.0 { mean_square.sqrt() } else { 1.0 };
        TargetFrame { centre, scale }
    }

    fn observations(&self, view: &View) -> Observations {
        Observations {
            pairs: view.pairs().map(|(p, pixel)| ((p - self.centre) / self.scale, *pixel)).collect(),
        }
    }

    /// `t = s t' - R c` for a pose of the centred, scaled target.
    fn cam_from_target(&self, pose: &Pose) -> Pose {
        Pose {
            rotation: pose.rotation,
            translation: pose.translation * self.scale - self.rotated_centre(pose),
        }
    }

    fn rotated_centre(&self, pose: &Pose) -> Vec3 {
        pose.rotation * Vec3::new(self.centre.x, self.centre.y, 0.0)
    }

    /// Carries pose blocks over: `d t = s d t' + [R c]x delta`.
    fn covariance(&self, mut covariance: Covariance, poses: &[Pose]) -> Covariance {
        for (i, pose) in poses.iter().enumerate() {
            let mut change = SMatrix::<f64, 6, 6>::identity();
            change.fixed_view_mut::<3, 3>(3, 0).copy_from(&rotation::skew(&self.rotated_centre(pose)));
            change.fixed_view_mut::<3, 3>(3, 3).copy_from(&(Mat3::identity() * self.scale));
            covariance.poses[i] = change * covariance.poses[i] * change.transpose();
            covariance.cross[i] = &covariance.cross[i] * change.transpose();
        }
        covariance
    }
}

fn report(
    minimum: &Minimum,
    problem: &Problem<'_>,
    frame: &TargetFrame,
) -> Result<Calibration, CalibrationError> {
    let observations = problem.observations;
    let State { camera, cam_from_target } = &minimum.state;
    let system = &minimum.system;
    let residuals = residuals(&minimum.state, observations);
    let points = residuals.iter().map(Vec::len).sum::<usize>();
    let degrees_of_freedom = 2 * points - system.unknowns();
    let square: f64 = residuals.iter().flatten().map(|r| r.norm_squared()).sum();
    let freedom = degrees_of_freedom.max(1) as f64;
    let sigma_px = (square / freedom).sqrt();
    identifiability::check(problem, minimum, sigma_px)?;
    let unit = system.covariance().ok_or_else(|| CalibrationError::NotIdentifiable {
        inseparable: vec!["camera".into(), "poses".into()],
        why: "the normal equations are singular".into(),
    })?;
    let covariance =
        frame.covariance(unit, cam_from_target).scaled(noise_variance(&residuals, problem.loss, freedom));
    let mut calibration = Calibration {
        camera: *camera,
        free: system.free,
        cam_from_target: cam_from_target.iter().map(|pose| frame.cam_from_target(pose)).collect(),
        rmse_px: (square / points as f64).sqrt(),
        sigma_px,
        degrees_of_freedom,
        covariance,
        conditioning: Conditioning::of(system),
        termination: minimum.termination,
        iterations: minimum.iterations,
        warnings: Vec::new(),
        residuals,
    };
    calibration.warnings = warnings(&calibration, observations, &minimum.state);
    Ok(calibration)
}

fn residuals(state: &State, observations: &[Observations]) -> Vec<Vec<Vec2>> {
    let at = |pose: &Pose, (point, pixel): &(Vec2, Vec2)| {
        // Not in front of the camera: no prediction. The search never ends there unless it started there.
        normal::predict(&state.camera, pose, point)
            .map_or(Vec2::repeat(f64::INFINITY), |predicted| predicted - pixel)
    };
    state
        .cam_from_target
        .iter()
        .zip(observations)
        .map(|(pose, o)| o.pairs.iter().map(|pair| at(pose, pair)).collect())
        .collect()
}

/// Factor of the unit covariance: the residual variance, or Huber's correction for a robust loss.
///
/// The weighted normal matrix is `sum w J^T J`; with `m = mean w` it stands for `m J^T J`, so the sandwich
/// `sum w^2 r^2 / m^2 (J^T J)^-1` is `sum w^2 r^2 / m` times its inverse.
fn noise_variance(residuals: &[Vec<Vec2>], loss: Loss, freedom: f64) -> f64 {
    let (mut square, mut weights, mut count) = (0.0, 0.0, 0.0);
    for r in residuals.iter().flatten() {
        let s = r.norm_squared();
        let weight = loss.at(s).1;
        square += weight * weight * s;
        weights += weight;
        count += 1.0;
    }
    square / freedom * count / weights
}

fn warnings(calibration: &Calibration, observations: &[Observations], state: &State) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if calibration.termination != Termination::Converged {
        warnings.push(Warning::NotConverged {
            termination: calibration.termination,
            iterations: calibration.iterations,
        });
    }
    if calibration.degrees_of_freedom == 0 {
        warnings.push(Warning::NoDegreesOfFreedom);
    }
    warnings.extend(correlated(&calibration.covariance, calibration.free));
    warnings.extend([Parameter::Fx, Parameter::Fy].into_iter().filter_map(|parameter| {
        let relative = calibration.standard_deviation(parameter)? / calibration.camera.get(parameter);
        (relative > UNCERTAIN_FOCAL).then_some(Warning::FocalLengthUncertain { parameter, relative })
    }));
    warnings.extend(folding(&calibration.camera, observations, state));
    warnings
}

/// Pairs of distortion coefficients, or of any parameters, that trade off against each other.
fn correlated(covariance: &Covariance, free: FreeParameters) -> Vec<Warning> {
    let parameters: Vec<Parameter> = free.iter().collect();
    let mut found = Vec::new();
    for (i, &a) in parameters.iter().enumerate() {
        for &b in &parameters[i + 1..] {
            match covariance.correlation(a, b) {
                // fx and fy share the distance to the target: their correlation is the rule, and harmless.
                Some(_) if (a, b) == (Parameter::Fx, Parameter::Fy) => {}
                Some(correlation) if correlation.abs() > STRONG_CORRELATION => {
                    found.push(Warning::Correlated { a, b, correlation });
                }
                _ => {}
            }
        }
    }
    found
}

/// Warns if the model folds within 1.2 times the largest radius seen.
fn folding(camera: &Camera, observations: &[Observations], state: &State) -> Option<Warning> {
    let monotone_radius = camera.distortion.monotone_radius();
    let largest_observed = state
        .cam_from_target
        .iter()
        .zip(observations)
        .flat_map(|(pose, o)| {
            o.pairs.iter().map(|(p, _)| {
                let c = pose.apply(&Vec3::new(p.x, p.y, 0.0));
                c.xy().norm() / c.z
            })
        })
        .fold(0.0, f64::max);
    (monotone_radius < 1.2 * largest_observed)
        .then_some(Warning::FoldsInsideImage { monotone_radius, largest_observed })
}
