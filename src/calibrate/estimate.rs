//! From correspondences to a camera with its uncertainty: the steps of Zhang's method in order.

use super::Termination;
use super::conditioning::Conditioning;
use super::minimise::{Minimum, Problem, State};
use super::normal::Observations;
use super::report::{STRONG_CORRELATION, UNCERTAIN_FOCAL};
use super::{
    Calibration, CalibrationError, Covariance, Loss, Settings, Warning, chunks, identifiability, kernel,
    polish, start,
};
use crate::camera::{Camera, FreeParameters, Parameter};
use crate::geometry::{Homography, Mat3, Pose, Vec2, Vec3, rotation};
use crate::target::View;

/// Homographies of the start are refined until a step promises less than this part of their cost: distortion, which they leave out, is
/// far larger than what is left to gain.
const START_GAIN: f64 = 1e-3;

/// Estimates the free parameters of `settings` and the pose of every view.
///
/// 1. A homography for each view, of least squared pixel distance.
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
    let calibration = chunks::in_pool(views.len(), || estimate(views, settings))?;
    Ok(if settings.polish { polish::polish(views, settings.loss, calibration) } else { calibration })
}

fn estimate(views: &[View], settings: &Settings) -> Result<Calibration, CalibrationError> {
    let frame = TargetFrame::of(views);
    let (observations, homographies) = homographies(views, &frame)?;
    let starts = start::starts(&homographies, settings, pixel_frame(&observations))?;
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

/// The views in the target's frame, and the homography of each.
fn homographies(
    views: &[View],
    frame: &TargetFrame,
) -> Result<(Vec<Observations>, Vec<Homography>), CalibrationError> {
    let fits = chunks::map(views, |index, view| {
        let observations = frame.observations(view);
        Homography::fit_pairs(&observations, START_GAIN)
            .map(|fit| (observations, fit.homography))
            .map_err(|source| CalibrationError::View { view: index, source })
    });
    let mut both = (Vec::with_capacity(views.len()), Vec::with_capacity(views.len()));
    for fit in fits {
        let (observations, homography) = fit?;
        both.0.push(observations);
        both.1.push(homography);
    }
    Ok(both)
}

/// Centre and half-width of the box around all pixels.
fn pixel_frame(observations: &[Observations]) -> (Vec2, f64) {
    let outside = (Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY));
    let (low, high) = observations
        .iter()
        .map(Observations::to_box)
        .fold(outside, |(low, high), (l, h)| (low.inf(&l), high.sup(&h)));
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
        let points = || views.iter().flat_map(|view| view.points().iter());
        // Moments about one of the points: its distance from the centroid is of the points' own size.
        let Some(&origin) = points().next() else { return TargetFrame { centre: Vec2::zeros(), scale: 1.0 } };
        let (mut count, mut sum, mut square) = (0.0, Vec2::zeros(), 0.0);
        for view in views {
            let (mut x, mut y, mut squares) = (0.0, 0.0, 0.0);
            for point in view.points() {
                let (dx, dy) = (point.x - origin.x, point.y - origin.y);
                (x, y, squares) = (x + dx, y + dy, squares + (dx * dx + dy * dy));
            }
            count += view.len() as f64;
            sum += Vec2::new(x, y);
            square += squares;
        }
        let offset = sum / count;
        let centre = origin + offset;
        let mean_square = square / count - offset.norm_squared();
        // Coincident points have no size; their homography refuses them.
        let scale = if mean_square > 0.0 { mean_square.sqrt() } else { 1.0 };
        TargetFrame { centre, scale }
    }

    fn observations(&self, view: &View) -> Observations {
        Observations::new(view.pairs().map(|(p, pixel)| ((p - self.centre) / self.scale, *pixel)))
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

    /// Carries pose blocks over, `d t = s d t' + [R c]x delta`, for noise of variance `variance`.
    fn covariance(&self, mut covariance: Covariance, poses: &[Pose], variance: f64) -> Covariance {
        let blocks = covariance.poses.iter_mut().zip(&mut covariance.cross);
        for (pose, (block, cross)) in poses.iter().zip(blocks) {
            let lever = rotation::skew(&self.rotated_centre(pose));
            let turned = |rr: &Mat3, rt: &Mat3| lever * rr + self.scale * rt.transpose();
            let (rr, rt): (Mat3, Mat3) =
                (block.fixed_view::<3, 3>(0, 0).into(), block.fixed_view::<3, 3>(0, 3).into());
            let tt: Mat3 = block.fixed_view::<3, 3>(3, 3).into();
            // With the change [[I, 0], [K, s I]]: the lower rows K P_rr + s P_tr and K P_rt + s P_tt, then the columns alike.
            let lower = turned(&rr, &rt);
            let corner = lower * lever.transpose() + self.scale * (lever * rt + self.scale * tt);
            let symmetric = 0.5 * (corner + corner.transpose());
            block.fixed_view_mut::<3, 3>(0, 0).copy_from(&(variance * rr));
            block.fixed_view_mut::<3, 3>(3, 0).copy_from(&(variance * lower));
            block.fixed_view_mut::<3, 3>(0, 3).copy_from(&(variance * lower.transpose()));
            block.fixed_view_mut::<3, 3>(3, 3).copy_from(&(variance * symmetric));
            for mut row in cross.row_iter_mut() {
                let (r, t) = (Vec3::new(row[0], row[1], row[2]), Vec3::new(row[3], row[4], row[5]));
                let moved = (lever * r + self.scale * t) * variance;
                let scaled = r * variance;
                for i in 0..3 {
                    (row[i], row[3 + i]) = (scaled[i], moved[i]);
                }
            }
        }
        covariance.intrinsics *= variance;
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
    let Fit { residuals, square, largest_radius } = Fit::of(&minimum.state, observations);
    let points = residuals.iter().map(Vec::len).sum::<usize>();
    let degrees_of_freedom = 2 * points - system.unknowns();
    let freedom = degrees_of_freedom.max(1) as f64;
    let sigma_px = (square / freedom).sqrt();
    let reduction = system.reduction();
    let conditioning = reduction.as_ref().and_then(|reduction| Conditioning::of(system, reduction));
    // The cost under the loss in use: gross errors, which a robust loss discounts, say nothing of the noise.
    let noise_px = (system.cost / freedom).sqrt();
    identifiability::check(problem, minimum, conditioning.as_ref(), noise_px)?;
    let unit = reduction.and_then(|reduction| reduction.covariance()).ok_or_else(|| {
        CalibrationError::NotIdentifiable {
            inseparable: vec!["camera".into(), "poses".into()],
            why: "the normal equations are singular".into(),
        }
    })?;
    let variance = noise_variance(&residuals, square, problem.loss, freedom);
    let covariance = frame.covariance(unit, cam_from_target, variance);
    let mut calibration = Calibration {
        camera: *camera,
        free: system.free,
        cam_from_target: cam_from_target.iter().map(|pose| frame.cam_from_target(pose)).collect(),
        rmse_px: (square / points as f64).sqrt(),
        sigma_px,
        degrees_of_freedom,
        covariance,
        conditioning,
        termination: minimum.termination,
        iterations: minimum.iterations,
        warnings: Vec::new(),
        residuals,
    };
    calibration.warnings = warnings(&calibration, largest_radius);
    Ok(calibration)
}

/// How the minimum fits the observations.
struct Fit {
    residuals: Vec<Vec<Vec2>>,
    /// Sum of squared residuals.
    square: f64,
    /// Largest distance of an ideal point from the axis, in normalised coordinates.
    largest_radius: f64,
}

impl Fit {
    fn of(state: &State, observations: &[Observations]) -> Fit {
        let views = chunks::map(observations, |index, pairs| {
            kernel::view_residuals(&state.camera, &state.cam_from_target[index], pairs)
        });
        let square = views.iter().map(|view| view.square).sum();
        let largest_radius = views.iter().map(|view| view.largest_radius_sq).fold(0.0, f64::max).sqrt();
        Fit { residuals: views.into_iter().map(|view| view.residuals).collect(), square, largest_radius }
    }
}

/// Factor of the unit covariance: the residual variance, or Huber's correction for a robust loss.
///
/// The weighted normal matrix is `sum w J^T J`; with `mean w` it stands for `mean w J^T J`, so the sandwich
/// `sum w^2 r^2 / (mean psi')^2 (J^T J)^-1` is `sum w^2 r^2 mean w / (mean psi')^2` times its inverse.
fn noise_variance(residuals: &[Vec<Vec2>], square: f64, loss: Loss, freedom: f64) -> f64 {
    if loss == Loss::Squares {
        return square / freedom;
    }
    let (mut square, mut weights, mut slopes, mut count) = (0.0, 0.0, 0.0, 0.0);
    for r in residuals.iter().flatten() {
        let s = r.norm_squared();
        let weight = loss.at(s).1;
        square += weight * weight * s;
        weights += weight;
        slopes += loss.slope(s);
        count += 1.0;
    }
    square / freedom * weights * count / (slopes * slopes)
}

fn warnings(calibration: &Calibration, largest_radius: f64) -> Vec<Warning> {
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
    warnings.extend(folding(&calibration.camera, largest_radius));
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
fn folding(camera: &Camera, largest_observed: f64) -> Option<Warning> {
    let monotone_radius = camera.distortion.monotone_radius();
    (monotone_radius < 1.2 * largest_observed)
        .then_some(Warning::FoldsInsideImage { monotone_radius, largest_observed })
}
