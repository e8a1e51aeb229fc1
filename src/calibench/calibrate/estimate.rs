//! From correspondences to a camera with its uncertainty: the steps of Zhang's method in order.

use super::certificate::Certificate;
use super::conditioning::Conditioning;
use super::from_relaxed::Evidence;
use super::intervals::Profile;
use super::judged::Judged;
use super::minimise::{Problem, State, rounding_cost};
use super::noise::Noise;
use super::normal::Observations;
use super::prior::{self, Priors};
use super::retraction::Retraction;
use super::search;
use super::start::Held;
use super::system::System;
use super::target_frame::TargetFrames;
use super::{
    Board, Calibration, CalibrationError, Loss, Prior, Settings, Termination, Warning, chunks, copies,
    domain, identifiability, kernel, outliers, polish, start, structure, warnings,
};
use crate::board::View;
use crate::camera::{Model, Parameter};
use crate::geometry::{Homography, Vec2};

/// Homographies of the start are refined until a step promises less than this part of their cost: distortion,
/// which they leave out, is far larger than what is left to gain.
const START_GAIN: f64 = 1e-3;

/// Estimates the free parameters of `settings` and the pose of every view.
///
/// 1. A homography for each view, of least squared pixel distance.
/// 2. Intrinsics in closed form, poses from them (Zhang 2000, section 3.1).
/// 3. All unknowns refined together: the sum of squared pixel distances is least (Zhang 2000, section 3.2,
///    with the full Brown-Conrady model), which is the maximum-likelihood estimate under Gaussian noise.
/// 4. Covariance, conditioning, warnings.
///
/// # Errors
/// Data that cannot determine the free parameters are refused; see [`CalibrationError`]. A refinement that
/// does not converge is no error: the result says so in [`Calibration::termination`] and in a warning.
///
/// ```
/// use calibench::calibrate::{CalibrationError, Settings, calibrate};
/// use calibench::synth::Scene;
///
/// let scene = Scene::example();
/// let result = calibrate(&scene.exact(), &Settings::standard())?;
/// // Without noise the camera is found up to rounding.
/// assert!((result.camera.fx - scene.truth.camera.fx).abs() < 1e-4 && result.rmse_px < 1e-6);
/// // One view does not determine fx, fy, cx and cy.
/// let refused = calibrate(&scene.exact()[..1], &Settings::standard());
/// assert!(matches!(refused, Err(CalibrationError::TooFewViews { need: 2, got: 1, .. })));
/// # Ok::<(), CalibrationError>(())
/// ```
pub fn calibrate(views: &[View], settings: &Settings) -> Result<Calibration, CalibrationError> {
    copies::without(views, |views| calibrate_distinct(views, settings))
}

/// [`calibrate`] of views of which none is a copy.
pub(super) fn calibrate_distinct(
    views: &[View],
    settings: &Settings,
) -> Result<Calibration, CalibrationError> {
    check_counts(views, settings)?;
    let found = chunks::in_pool(views.len(), || estimate(views, settings));
    let (calibration, noise) = found?;
    Ok(if settings.polish { polish::polish(views, settings.loss, noise, calibration) } else { calibration })
}

/// The calibration, and the noise that weighed the priors.
fn estimate(views: &[View], settings: &Settings) -> Result<(Calibration, Noise), CalibrationError> {
    searched(views, settings, |judged, problem, frames| {
        let noise = problem.priors.noise;
        Ok((report(judged, problem, frames, settings)?, noise))
    })
}

/// The state of [`calibrate`] in the targets' own frames, and whether it is certified: where a search with
/// another lens starts, which needs neither covariance nor warnings.
///
/// # Errors
/// As [`calibrate`].
pub(super) fn state_alone(views: &[View], settings: &Settings) -> Result<(State, bool), CalibrationError> {
    check_counts(views, settings)?;
    searched(views, settings, |judged, problem, _| {
        let Judged { minimum, reduction, certificate, .. } = judged;
        let conditioning = reduction.as_ref().and_then(|r| Conditioning::of(&minimum.system, r));
        identifiability::refuse_singular_minimum(problem.free, conditioning.as_ref())?;
        let is_certified = minimum.termination.is_minimum()
            && certificate.is_some_and(|certificate| certificate.is_possible() && certificate.holds());
        Ok((minimum.state, is_certified))
    })
}

/// What `then` makes of the best minimum; the problem's priors are weighed with the noise that was found.
fn searched<T>(
    views: &[View],
    settings: &Settings,
    then: impl FnOnce(Judged, &Problem<'_>, &TargetFrames) -> Result<T, CalibrationError>,
) -> Result<T, CalibrationError> {
    let frames = TargetFrames::of(views);
    let (observations, homographies) = homographies(views, &frames)?;
    let pixel_frame = pixel_frame(&observations);
    let held = Held::of(settings, pixel_frame.0)?;
    let priors: Vec<Prior> = settings.priors().collect();
    let starts = start::starts(&homographies, settings, &held, pixel_frame)?;
    let problem = Problem {
        free: settings.free(),
        fy_per_fx: held.fy_per_fx,
        priors: Priors { list: &priors, noise: Noise::of_squares(0.0) },
        observations: &observations,
        loss: settings.loss,
        max_iterations: settings.max_iterations,
        hold_tilt: false,
        retraction: Retraction::Straight,
        focal_limits: (0.0, f64::INFINITY),
        rounding_cost: rounding_cost(&observations),
    };
    let evidence =
        Evidence { homographies: &homographies, held: &held, pixel_frame, search: settings.search };
    let (judged, noise) = if priors.is_empty() {
        (search::best_minimum(&problem, starts, &evidence)?, problem.priors.noise)
    } else {
        prior::best_minimum(&problem, starts, &evidence)?
    };
    then(judged, &Problem { priors: Priors { noise, ..problem.priors }, ..problem }, &frames)
}

fn check_counts(views: &[View], settings: &Settings) -> Result<(), CalibrationError> {
    use Parameter::*;
    refuse_other_lenses(views, settings)?;
    domain::check(settings)?;
    let free = settings.free();
    let is_known = |p| settings.priors().any(|prior| prior.parameter == p);
    let linear = [Fx, Fy, Cx, Cy, Skew].into_iter().filter(|&p| free.contains(p) && !is_known(p)).count();
    let most = if is_distorting(settings)? { 2 } else { usize::MAX };
    let need = linear.div_ceil(2).clamp(1, most);
    if views.len() < need {
        return Err(CalibrationError::TooFewViews { need, got: views.len(), linear, copies: 0 });
    }
    let coordinates = 2 * views.iter().map(View::len).sum::<usize>();
    let unknowns = free.len() - settings.priors().count() + 6 * views.len();
    if coordinates < unknowns {
        return Err(CalibrationError::TooFewPoints { coordinates, unknowns });
    }
    // The homography of such a view may pass, since distortion bends the image of a line, and would certify
    // whatever it says.
    views.iter().enumerate().try_for_each(|(view, marks)| domain::refuse_line(view, marks))
}

/// What [`super::calibrate_lens`] is for.
fn refuse_other_lenses(views: &[View], settings: &Settings) -> Result<(), CalibrationError> {
    let what = if settings.model() != Model::BrownConrady {
        "a lens model other than brown-conrady"
    } else if views.iter().any(|view| view.weights().is_some()) {
        "the weight of a mark"
    } else if settings.board != Board::Flat {
        "a board that is not flat"
    } else {
        return Ok(());
    };
    Err(CalibrationError::OfAnyLens { what: what.into() })
}

/// Whether the lens may distort: homographies give two constraints a view, and a distortion tells its centre
/// and the aspect ratio besides, so that two views may tell all; the rank of the equations has the last word.
fn is_distorting(settings: &Settings) -> Result<bool, CalibrationError> {
    use Parameter::*;
    for parameter in [K1, K2, P1, P2, K3] {
        if settings.held(parameter)? != Some(0.0) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// The views in the target's frame, and the homography of each.
fn homographies(
    views: &[View],
    frames: &TargetFrames,
) -> Result<(Vec<Observations>, Vec<Homography>), CalibrationError> {
    let fits = chunks::map(views, |index, view| {
        let observations = frames.at(index).observations(view);
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

fn report(
    judged: Judged,
    problem: &Problem<'_>,
    frames: &TargetFrames,
    settings: &Settings,
) -> Result<Calibration, CalibrationError> {
    let observations = problem.observations;
    let Judged { minimum, reduction, certificate, starts, skewed, rival, twins } = judged;
    let State { camera, cam_from_target } = &minimum.state;
    let system = &minimum.system;
    let fit = Fit::of(&minimum.state, observations);
    let points = fit.marks();
    let settled = problem.priors.settled(&minimum);
    let freedom = fit.freedom(system, settled);
    let degrees_of_freedom = whole((2 * points) as f64 + settled - system.unknowns() as f64);
    outliers::refuse_narrow_loss(problem.loss, &fit.residuals)?;
    let of_residuals = warnings_of_residuals(problem, &minimum.state, &fit, freedom);
    let noise =
        if problem.priors.list.is_empty() { fit.noise(problem.loss, freedom) } else { problem.priors.noise };
    let Fit { residuals, square, largest_radius, .. } = fit;
    let sigma_px = (square / freedom).sqrt();
    let conditioning = reduction.as_ref().and_then(|reduction| Conditioning::of(system, reduction));
    identifiability::refuse_singular_minimum(problem.free, conditioning.as_ref())?;
    let intervals = settings
        .profile_coverage
        .zip(reduction.as_ref())
        .and_then(|(coverage, reduction)| {
            let curved = Problem { retraction: Retraction::Curved, ..*problem };
            let profile = Profile::new(&curved, &minimum, reduction, noise)?;
            Some(profile.intervals(coverage, degrees_of_freedom))
        })
        .unwrap_or_default();
    let unit =
        reduction.and_then(|reduction| reduction.covariance()).ok_or_else(identifiability::singular)?;
    let mut covariance = frames.covariance(unit, cam_from_target, noise.variance);
    covariance.fy_per_fx = problem.fy_per_fx;
    let mut calibration = Calibration {
        camera: *camera,
        free: system.free,
        priors: problem.priors.list.to_vec(),
        cam_from_target: cam_from_target
            .iter()
            .enumerate()
            .map(|(view, pose)| frames.at(view).cam_from_target(pose))
            .collect(),
        rmse_px: (square / points as f64).sqrt(),
        sigma_px,
        degrees_of_freedom,
        covariance,
        conditioning,
        termination: judged_termination(minimum.termination, certificate.as_ref()),
        certificate,
        intervals,
        starts,
        iterations: minimum.iterations,
        warnings: Vec::new(),
        board: None,
        residuals,
    };
    calibration.warnings = warnings::of(&calibration, largest_radius, of_residuals, &skewed, rival, twins);
    Ok(calibration)
}

/// Gross errors, and residuals that agree with their neighbours'. What rounding leaves of exact data tells of
/// neither.
fn warnings_of_residuals(
    problem: &Problem<'_>,
    state: &State,
    fit: &Fit,
    freedom: f64,
) -> impl Iterator<Item = Warning> + use<> {
    let (outliers, structure) = if fit.square > problem.rounding_cost {
        let outliers = outliers::outliers(problem, state, fit, fit.square / freedom);
        (outliers, structure::structure(&fit.residuals, 0.5 * fit.square / fit.marks() as f64, problem.loss))
    } else {
        (None, None)
    };
    outliers.map(Warning::Outliers).into_iter().chain(structure)
}

/// A minimum counts as one only where the certificate holds.
fn judged_termination(termination: Termination, certificate: Option<&Certificate>) -> Termination {
    match termination {
        Termination::Converged if certificate.is_some_and(|c| !c.holds()) => Termination::AboveFloor,
        other => other,
    }
}

/// A sum of shares that is a whole number but for rounding counts as one.
const WHOLE: f64 = 1e-6;

/// Degrees of freedom as they are told.
pub(super) fn whole(freedom: f64) -> usize {
    (freedom + WHOLE).max(0.0) as usize
}

/// How the minimum fits the observations.
pub(super) struct Fit {
    pub residuals: Vec<Vec<Vec2>>,
    /// Sum of squared residuals.
    pub square: f64,
    /// Sum of their squares.
    fourth: f64,
    /// The largest of them.
    pub largest_square: f64,
    /// Largest distance of an ideal point from the axis, in normalised coordinates.
    largest_radius: f64,
}

impl Fit {
    /// Degrees of freedom that the residuals have, 1 at the least; `settled` unknowns are known from
    /// elsewhere.
    pub fn freedom(&self, system: &System, settled: f64) -> f64 {
        let coordinates = 2 * self.marks();
        (coordinates as f64 + settled - system.unknowns() as f64).max(1.0)
    }

    /// The noise that the residuals show.
    pub fn noise(&self, loss: Loss, freedom: f64) -> Noise {
        Noise::of_residuals(&self.residuals, self.square, loss, freedom)
    }

    pub fn of(state: &State, observations: &[Observations]) -> Fit {
        let views = chunks::map(observations, |index, pairs| {
            kernel::view_residuals(&state.camera, &state.cam_from_target[index], pairs)
        });
        let largest = |of: fn(&kernel::ViewResiduals) -> f64| views.iter().map(of).fold(0.0, f64::max);
        Fit {
            square: views.iter().map(|view| view.square).sum(),
            fourth: views.iter().map(|view| view.fourth).sum(),
            largest_square: largest(|view| view.largest_square),
            largest_radius: largest(|view| view.largest_radius_sq).sqrt(),
            residuals: views.into_iter().map(|view| view.residuals).collect(),
        }
    }

    /// Number of marks.
    pub fn marks(&self) -> usize {
        self.residuals.iter().map(Vec::len).sum()
    }

    /// `N sum s^2 / (sum s)^2` of the squared residuals `s`: 2 for noise, larger where tails are heavy.
    pub fn tails(&self) -> f64 {
        self.fourth * self.marks() as f64 / (self.square * self.square)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::tests::{correlations, four_views};
    use crate::camera::{Camera, FreeParameters};
    use crate::geometry::{Mat3, Pose, Vec3};

    #[test]
    fn every_view_has_six_unknowns_that_its_marks_must_pay_for() {
        let some = |marks: usize| -> Vec<View> {
            let of = |view: &View| {
                let corners = [0, 8, 54, 62, 31].into_iter().take(marks);
                let (points, pixels) = corners.map(|i| (view.points()[i], view.pixels()[i])).unzip();
                View::new(points, pixels).unwrap()
            };
            four_views(0.0)[1..3].iter().map(of).collect()
        };
        // Six of the camera and six of each of two views.
        let refused = CalibrationError::TooFewPoints { coordinates: 16, unknowns: 18 };
        assert_eq!(check_counts(&some(4), &Settings::standard()), Err(refused));
        assert_eq!(check_counts(&some(5), &Settings::standard()), Ok(()));
    }

    #[test]
    fn a_view_whose_marks_lie_on_a_line_but_for_one_is_refused() {
        let mut views = four_views(0.1);
        let few = [0, 1, 2, 3, 4, 62].map(|i| (views[2].points()[i], views[2].pixels()[i]));
        let (points, pixels) = few.into_iter().unzip();
        views[2] = View::new(points, pixels).unwrap();
        let refused = calibrate(&views, &Settings::standard());
        assert!(matches!(refused, Err(CalibrationError::View { view: 2, .. })), "{refused:?}");
    }

    #[test]
    fn the_frame_of_the_pixels_is_the_box_around_all_of_them() {
        let corners = |low: f64, high: f64| {
            let pairs = [(low, 50.0), (high, 150.0)].map(|(u, v)| (Vec2::zeros(), Vec2::new(u, v)));
            Observations::new(pairs.into_iter())
        };
        let (centre, half_width) = pixel_frame(&[corners(100.0, 120.0), corners(110.0, 300.0)]);
        assert_eq!((centre, half_width), (Vec2::new(200.0, 100.0), 100.0));
    }

    #[test]
    fn what_is_known_beforehand_needs_no_view() {
        let views = &four_views(0.1)[1..2];
        let need = |settings: &Settings| match check_counts(views, settings) {
            Err(CalibrationError::TooFewViews { need, got: 1, linear, .. }) => Some((need, linear)),
            _ => None,
        };
        // A view has two equations for the linear parameters.
        let standard = Settings::standard();
        assert_eq!(need(&standard), Some((2, 4)));
        let one = standard.with_prior(Parameter::Cx, 326.0, 1.0);
        assert_eq!(need(&one), Some((2, 3)));
        assert_eq!(check_counts(views, &one.with_prior(Parameter::Cy, 243.0, 1.0)), Ok(()));
    }

    #[test]
    fn a_fit_has_the_tails_and_degrees_of_freedom_of_its_residuals() {
        let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
        let pose = Pose { rotation: Mat3::identity(), translation: Vec3::new(0.0, 0.0, 100.0) };
        // Squared residuals of 1, 1, 1 and 9.
        let pair = |i: u32| {
            let point = Vec2::new(f64::from(i % 2), f64::from(i / 2)) * 10.0;
            let off = if i == 3 { 3.0 } else { 1.0 };
            (point, camera.project(&Vec3::new(point.x, point.y, 100.0)).unwrap() + Vec2::new(0.0, off))
        };
        let fit =
            Fit::of(&State { camera, cam_from_target: vec![pose] }, &[Observations::new((0..4).map(pair))]);
        assert!((fit.tails() - 4.0 * 84.0 / 144.0).abs() < 1e-9, "{}", fit.tails());
        // Eight coordinates and half of an unknown known from elsewhere, less two parameters.
        let system = System::new(FreeParameters::of(&[Parameter::Fx, Parameter::Fy]), 0);
        assert_eq!(fit.freedom(&system, 0.5), 6.5);
    }

    #[test]
    fn the_correlation_that_is_told_is_that_of_neighbours_residuals() {
        // A wave that no lens of two coefficients follows.
        let waved = |view: &View| {
            let wave = |pixel: &Vec2| pixel + Vec2::new(0.2 * libm::sin(pixel.y / 25.0), 0.0);
            View::new(view.points().to_vec(), view.pixels().iter().map(wave).collect()).unwrap()
        };
        let views: Vec<View> = four_views(0.02).iter().map(waved).collect();
        let found = calibrate(&views, &Settings::standard()).unwrap();
        let (told, expected) = correlations(&found);
        assert!((told - expected).abs() < 1e-12, "{told} {expected}");
    }

    #[test]
    fn a_mark_nine_deviations_off_is_an_outlier_by_the_noise_of_a_coordinate() {
        // Sixteen views: four times four with other noise.
        let mut views: Vec<View> = [0.1, 0.101, 0.102, 0.103].into_iter().flat_map(four_views).collect();
        let mut pixels = views[6].pixels().to_vec();
        pixels[17].x += 0.92;
        views[6] = View::new(views[6].points().to_vec(), pixels).unwrap();
        let found = calibrate(&views, &Settings::standard()).unwrap();
        // So few do not make the tails heavy: four times the square of the mean square.
        let squares = || found.residuals.iter().flatten().map(Vec2::norm_squared);
        let (mean, fourth) =
            (squares().sum::<f64>() / 1008.0, squares().map(|s| s * s).sum::<f64>() / 1008.0);
        assert!(fourth < 3.8 * mean * mean, "{}", fourth / (mean * mean));
        let is_it =
            |w: &Warning| matches!(w, Warning::Outliers(o) if (o.marks, o.view, o.point) == (1, 6, 17));
        assert!(found.warnings.iter().any(is_it), "{:?}", found.warnings);
    }
}
