//! One photograph calibrated in every way, and several by Zhang's method, over many draws of the noise.

use super::{COVERAGE, DISTANCE_MM, SIGMA_PX, TILT_DEG, TRIALS};
use calibench::board::View;
use calibench::calibrate::{Calibration, Covariance, Settings, calibrate};
use calibench::camera::{Camera, FreeParameters, Parameter};
use calibench::evaluate::cramer_rao;
use calibench::geometry::{Pose, Vec2};
use calibench::synth::scene::looking_at_centre;
use calibench::synth::{Scene, Stream, StreamKey, Truth};
use calibench::tsai::{Assumed, SpatialView, two_stage};
use calibench_harness::ExperimentError;
use calibench_harness::stats::{mean, root_mean_square, share};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// The chapter's camera with the first coefficient of its lens.
pub(super) fn camera() -> Camera {
    Truth::example_camera().with(Parameter::K2, 0.0)
}

/// Where someone puts the principal point who does not know it: the image's centre, 6.5 px left and 3.5 px
/// above.
pub(super) fn image_centre() -> Vec2 {
    Assumed::centre_of(Truth::EXAMPLE_IMAGE).principal_point_px
}

pub(super) fn true_centre() -> Vec2 {
    Vec2::new(camera().cx, camera().cy)
}

/// A plane tilted by so much about an axis in this direction, its centre on the optical axis.
pub(super) fn pose(tilt_deg: f64, direction_rad: f64) -> Pose {
    let (sin, cos) = libm::sincos(direction_rad);
    looking_at_centre([tilt_deg * cos, tilt_deg * sin, 10.0], DISTANCE_MM)
}

/// Direction of the first axis: along neither row nor column. Further views follow by the golden angle.
pub(super) const FIRST_RAD: f64 = 0.6;
pub(super) const GOLDEN_RAD: f64 = 2.399_963_229_728_653;

pub(super) fn truth(views: usize, tilt_deg: f64) -> Truth {
    let pose = |k: usize| pose(tilt_deg, FIRST_RAD + GOLDEN_RAD * k as f64);
    Truth { camera: camera(), cam_from_target: (0..views).map(pose).collect(), ..Truth::example() }
}

/// Principal point given, fy tied to fx, k1 free: what one view determines.
pub(super) fn held_at(centre: Vec2) -> Settings {
    let free = FreeParameters::of(&[Parameter::Fx, Parameter::K1]);
    Settings::new(free)
        .hold(Parameter::Cx, centre.x)
        .hold(Parameter::Cy, centre.y)
        .tie_focal_lengths(1.0)
        .with_image_size(Truth::EXAMPLE_IMAGE)
}

/// Principal point free too: what two views and more determine.
pub(super) fn all_free() -> Settings {
    held_at(true_centre()).estimate(Parameter::Cx).estimate(Parameter::Cy)
}

/// What is asked of an estimate: error of f (px), of the distance (mm), of k1, and the standard deviation
/// that it states of f.
#[derive(Debug, Clone, Copy)]
pub(super) struct Estimate {
    pub(super) errors: [f64; 3],
    pub(super) stated_fx: f64,
    pub(super) rmse_px: f64,
}

pub(super) fn estimate(result: &Calibration) -> Estimate {
    Estimate {
        errors: [
            result.camera.fx - camera().fx,
            result.cam_from_target[0].translation.z - DISTANCE_MM,
            result.camera.distortion.k1 - camera().distortion.k1,
        ],
        stated_fx: result.covariance.standard_deviation(Parameter::Fx).unwrap_or(f64::NAN),
        rmse_px: result.rmse_px,
    }
}

/// One photograph, answered in three ways; `None` where it is refused.
pub(super) struct OneView {
    pub(super) tsai: Option<Estimate>,
    /// From Tsai's answer by maximum likelihood, without any other start.
    pub(super) refined: Option<Estimate>,
    /// From Zhang's start, with the search.
    pub(super) zhang: Option<Estimate>,
    /// As `refined`, the principal point in the image's centre.
    pub(super) off_centre: Option<Estimate>,
}

impl OneView {
    pub(super) fn of(view: &View) -> OneView {
        let (tsai, refined) = by_tsai(view, true_centre());
        let views = std::slice::from_ref(view);
        OneView {
            tsai,
            refined,
            zhang: calibrate(views, &held_at(true_centre())).ok().as_ref().map(estimate),
            off_centre: by_tsai(view, image_centre()).1,
        }
    }
}

/// Tsai's answer, and the refinement that starts there.
pub(super) fn by_tsai(view: &View, centre: Vec2) -> (Option<Estimate>, Option<Estimate>) {
    let assumed = Assumed { principal_point_px: centre, fy_per_fx: Some(1.0) };
    let Ok(found) = two_stage(&SpatialView::from(view), &assumed) else { return (None, None) };
    let tsai = Estimate {
        errors: [
            found.camera.fx - camera().fx,
            found.cam_from_target.translation.z - DISTANCE_MM,
            found.camera.distortion.k1 - camera().distortion.k1,
        ],
        stated_fx: f64::NAN,
        rmse_px: found.rmse_px,
    };
    let start = found.camera.with(Parameter::K2, 0.0).with(Parameter::K3, 0.0);
    let settings = held_at(centre).starting_at(start).without_search();
    let refined = calibrate(std::slice::from_ref(view), &settings).ok();
    (Some(tsai), refined.as_ref().map(estimate))
}

/// The views of a scene under noise.
pub(super) fn photographs(
    views: usize,
    (tilt_deg, sigma_px): (f64, f64),
    (seed, trial): (u64, u64),
) -> Result<Vec<View>, ExperimentError> {
    let scene = Scene::new(truth(views, tilt_deg)).map_err(ExperimentError::at("scene"))?;
    // Every cell draws noise of its own.
    let cell = (views as u64) << 40 | (tilt_deg * 1e3) as u64;
    let key =
        StreamKey { seed: seed ^ cell ^ sigma_px.to_bits(), scenario: "one-view", trial, purpose: "noise" };
    Ok(scene.observe(sigma_px, &mut Stream::open(key)))
}

/// Trials of one view at one tilt and one noise.
pub(super) struct Cell {
    pub(super) tilt_deg: f64,
    pub(super) sigma_px: f64,
    /// Bound of f (px), distance (mm) and k1; `None` where there is none.
    pub(super) bound: Option<[f64; 3]>,
    pub(super) trials: Vec<OneView>,
}

/// Which of the answers.
pub(super) type Way = fn(&OneView) -> Option<Estimate>;
pub(super) const TSAI: Way = |trial| trial.tsai;
pub(super) const REFINED: Way = |trial| trial.refined;
pub(super) const OFF_CENTRE: Way = |trial| trial.off_centre;

impl Cell {
    pub(super) fn run(tilt_deg: f64, sigma_px: f64, seed: u64) -> Result<Cell, ExperimentError> {
        let trial = |trial| Ok(OneView::of(&photographs(1, (tilt_deg, sigma_px), (seed, trial))?[0]));
        let trials = (0..TRIALS as u64).into_par_iter().map(trial).collect::<Result<_, ExperimentError>>()?;
        Ok(Cell { tilt_deg, sigma_px, bound: one_view_bound(tilt_deg, sigma_px), trials })
    }

    /// Errors of the trials that were answered.
    pub(super) fn errors(&self, way: Way, which: usize) -> Vec<f64> {
        self.trials.iter().filter_map(|trial| Some(way(trial)?.errors[which])).collect()
    }

    pub(super) fn rms(&self, way: Way, which: usize) -> f64 {
        root_mean_square(self.errors(way, which))
    }

    pub(super) fn bias(&self, way: Way, which: usize) -> f64 {
        mean(&self.errors(way, which))
    }

    /// About their mean.
    pub(super) fn sd(&self, way: Way, which: usize) -> f64 {
        let (errors, bias) = (self.errors(way, which), self.bias(way, which));
        let n = errors.len() as f64;
        root_mean_square(errors.iter().map(|e| e - bias)) * (n / (n - 1.0)).sqrt()
    }

    pub(super) fn answered(&self) -> f64 {
        share(&self.trials, |trial| trial.refined.is_some())
    }

    pub(super) fn is_answered_always(&self) -> bool {
        self.trials.iter().all(|trial| trial.refined.is_some() && trial.off_centre.is_some())
    }

    /// Share of the answers whose stated interval of f contains the truth.
    pub(super) fn coverage(&self, way: Way) -> f64 {
        let z = calibench_harness::stats::normal_two_sided(1.0 - COVERAGE);
        let answers: Vec<Estimate> = self.trials.iter().filter_map(way).collect();
        share(&answers, |answer| answer.errors[0].abs() <= z * answer.stated_fx)
    }

    pub(super) fn rmse_px(&self, way: Way) -> f64 {
        mean(&self.trials.iter().filter_map(|trial| Some(way(trial)?.rmse_px)).collect::<Vec<_>>())
    }

    pub(super) fn bound_of(&self, which: usize) -> f64 {
        self.bound.map_or(f64::NAN, |bound| bound[which])
    }
}

/// The Cramer-Rao bound of f, distance and k1 from one view, fy tied to fx, the principal point given.
pub(super) fn one_view_bound(tilt_deg: f64, sigma_px: f64) -> Option<[f64; 3]> {
    let free = FreeParameters::of(&[Parameter::Fx, Parameter::Fy, Parameter::K1]);
    let bound = cramer_rao(&truth(1, tilt_deg), free, sigma_px).ok()?;
    let (tied, depth) = tied(&bound);
    Some([tied[(0, 0)].sqrt(), depth.sqrt(), tied[(2, 2)].sqrt()])
}

/// The covariance of the intrinsics, and the variance of the first view's distance, once `fx = fy` is known:
/// with `a^T x = 0` for a vector `a`, `C - C a a^T C / (a^T C a)`.
pub(super) fn tied(bound: &Covariance) -> (DMatrix<f64>, f64) {
    let n = bound.free.len();
    let joint = DMatrix::from_fn(n + 1, n + 1, |i, j| match (i < n, j < n) {
        (true, true) => bound.intrinsics[(i, j)],
        (true, false) => bound.cross[0][(i, 5)],
        (false, true) => bound.cross[0][(j, 5)],
        (false, false) => bound.poses[0][(5, 5)],
    });
    let apart = DVector::from_fn(n + 1, |i, _| match i {
        0 => 1.0,
        1 => -1.0,
        _ => 0.0,
    });
    let along = &joint * &apart;
    let tied = &joint - &along * along.transpose() / apart.dot(&along);
    (tied.view((0, 0), (n, n)).into_owned(), tied[(n, n)])
}

/// The bound of f from several views with the principal point free.
pub(super) fn several_views_bound(views: usize) -> Result<f64, ExperimentError> {
    use Parameter::{Cx, Cy, Fx, Fy, K1};
    let free = FreeParameters::of(&[Fx, Fy, Cx, Cy, K1]);
    let bound = cramer_rao(&truth(views, TILT_DEG), free, SIGMA_PX).map_err(ExperimentError::at("bound"))?;
    Ok(tied(&bound).0[(0, 0)].sqrt())
}

/// Trials of several views with a free principal point.
pub(super) struct Several {
    pub(super) views: usize,
    pub(super) bound_fx: f64,
    /// Errors of f; NaN where it was refused.
    pub(super) errors: Vec<f64>,
}

impl Several {
    pub(super) fn run(views: usize, seed: u64) -> Result<Several, ExperimentError> {
        let trial = |trial| {
            let views = photographs(views, (TILT_DEG, SIGMA_PX), (seed, trial))?;
            Ok(calibrate(&views, &all_free()).map_or(f64::NAN, |result| result.camera.fx - camera().fx))
        };
        let errors = (0..TRIALS as u64).into_par_iter().map(trial).collect::<Result<_, ExperimentError>>()?;
        Ok(Several { views, bound_fx: several_views_bound(views)?, errors })
    }

    pub(super) fn rms(&self) -> f64 {
        root_mean_square(self.errors.iter().copied())
    }
}

/// Error of f from exact pixels, the principal point taken to be `offset` away from where it is.
pub(super) fn exact_error(tilt_deg: f64, offset: Vec2) -> Result<f64, ExperimentError> {
    let views = Scene::new(truth(1, tilt_deg)).map_err(ExperimentError::at("scene"))?.exact();
    let result =
        calibrate(&views, &held_at(true_centre() + offset)).map_err(ExperimentError::at("exact view"))?;
    Ok(result.camera.fx - camera().fx)
}
