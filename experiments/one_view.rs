//! What does one view give, by Tsai's method, and when does it mislead?
//!
//! One photograph of a tilted plane tells focal length, distance and lens, if the principal point is told: two of the
//! plane's eight numbers go to them, six to the pose. Zhang's method finds the principal point too, from more views. Here
//! the camera of the chapter's experiment, its lens with one coefficient, is calibrated from one view by Tsai's two
//! stages, from the same view by maximum likelihood, and from two views and more with the principal point free.
//!
//! Expected: refined, one view attains its Cramer-Rao bound, which falls with the squared sine of the tilt; Tsai's own
//! answer is a little worse. A principal point that is wrong by pixels moves the focal length by pixels, in proportion,
//! while residuals hardly tell: the stated uncertainty is then too small. What was expected besides and does not hold: that
//! one view with an exact principal point does what two or three with a free one do. Two do better.
//!
//! What it cannot show: targets in three dimensions, whose one view finds the principal point; lenses that need two
//! coefficients.

use calibench::board::View;
use calibench::calibrate::{Calibration, Covariance, Settings, calibrate};
use calibench::camera::{Camera, FreeParameters, Parameter};
use calibench::evaluate::cramer_rao;
use calibench::geometry::{Pose, Vec2};
use calibench::synth::scene::looking_at_centre;
use calibench::synth::{Scene, Stream, StreamKey, Truth};
use calibench::tsai::{Assumed, SpatialView, two_stage};
use calibench_harness::stats::{Interval, each_of, mean, root_mean_square, share};
use calibench_harness::{Band, Context, Experiment, ExperimentError, Figure, Look, Plot, Record, Table};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "one-view",
    title: "One view by Tsai's method, against Zhang's with more",
    question: "A plane at 120 mm, tilted by 0 to 50 degrees, one photograph: how well are focal length, distance and k1 \
               known if the principal point is given, how wrong are they if it is wrong, and how many views with a free \
               principal point do as well? Expected: the bound is attained and falls with the squared sine of the tilt; \
               a wrong principal point is a bias that residuals hardly show.",
    seed: 5,
    takes_image: false,
    run,
};

const SIGMA_PX: f64 = 0.1;
const TRIALS: usize = 400;
const TILTS_DEG: [f64; 11] = [0.0, 1.0, 2.0, 4.0, 6.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0];
/// From here the focal length is known to a twentieth and better, and first-order theory holds.
const LINEAR_TILT_DEG: f64 = 10.0;
/// Where noise and number of views are varied.
const TILT_DEG: f64 = 30.0;
const NOISES_PX: [f64; 6] = [0.01, 0.03, 0.1, 0.3, 0.5, 1.0];
const VIEWS: [usize; 5] = [2, 3, 4, 8, 16];
const DISTANCE_MM: f64 = 120.0;
/// Chance that a correct program fails one claim.
const RATE: f64 = 1e-4;
/// Terms of second order, relative to a standard deviation: sd(f)/f of 5 % at 10 degrees, and its square.
const NONLINEARITY: f64 = 0.05;
/// What a calibration of one view states: the interval of a normal variable.
const COVERAGE: f64 = 0.95;

/// The chapter's camera with the first coefficient of its lens.
fn camera() -> Camera {
    Truth::example_camera().with(Parameter::K2, 0.0)
}

/// Where someone puts the principal point who does not know it: the image's centre, 6.5 px left and 3.5 px above.
fn image_centre() -> Vec2 {
    Assumed::centre_of(Truth::EXAMPLE_IMAGE).principal_point_px
}

fn true_centre() -> Vec2 {
    Vec2::new(camera().cx, camera().cy)
}

/// A plane tilted by so much about an axis in this direction, its centre on the optical axis.
fn pose(tilt_deg: f64, direction_rad: f64) -> Pose {
    let (sin, cos) = libm::sincos(direction_rad);
    looking_at_centre([tilt_deg * cos, tilt_deg * sin, 10.0], DISTANCE_MM)
}

/// Direction of the first axis: along neither row nor column. Further views follow by the golden angle.
const FIRST_RAD: f64 = 0.6;
const GOLDEN_RAD: f64 = 2.399_963_229_728_653;

fn truth(views: usize, tilt_deg: f64) -> Truth {
    let pose = |k: usize| pose(tilt_deg, FIRST_RAD + GOLDEN_RAD * k as f64);
    Truth { camera: camera(), cam_from_target: (0..views).map(pose).collect(), ..Truth::example() }
}

/// Principal point given, fy tied to fx, k1 free: what one view determines.
fn held_at(centre: Vec2) -> Settings {
    let free = FreeParameters::of(&[Parameter::Fx, Parameter::K1]);
    Settings::new(free)
        .hold(Parameter::Cx, centre.x)
        .hold(Parameter::Cy, centre.y)
        .tie_focal_lengths(1.0)
        .with_image_size(Truth::EXAMPLE_IMAGE)
}

/// Principal point free too: what two views and more determine.
fn all_free() -> Settings {
    held_at(true_centre()).estimate(Parameter::Cx).estimate(Parameter::Cy)
}

/// What is asked of an estimate: error of f (px), of the distance (mm), of k1, and the standard deviation that it states
/// of f.
#[derive(Debug, Clone, Copy)]
struct Estimate {
    errors: [f64; 3],
    stated_fx: f64,
    rmse_px: f64,
}

fn estimate(result: &Calibration) -> Estimate {
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
struct OneView {
    tsai: Option<Estimate>,
    /// From Tsai's answer by maximum likelihood, without any other start.
    refined: Option<Estimate>,
    /// From Zhang's start, with the search.
    zhang: Option<Estimate>,
    /// As `refined`, the principal point in the image's centre.
    off_centre: Option<Estimate>,
}

impl OneView {
    fn of(view: &View) -> OneView {
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
fn by_tsai(view: &View, centre: Vec2) -> (Option<Estimate>, Option<Estimate>) {
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
fn photographs(
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
struct Cell {
    tilt_deg: f64,
    sigma_px: f64,
    /// Bound of f (px), distance (mm) and k1; `None` where there is none.
    bound: Option<[f64; 3]>,
    trials: Vec<OneView>,
}

/// Which of the answers.
type Way = fn(&OneView) -> Option<Estimate>;
const TSAI: Way = |trial| trial.tsai;
const REFINED: Way = |trial| trial.refined;
const OFF_CENTRE: Way = |trial| trial.off_centre;

impl Cell {
    fn run(tilt_deg: f64, sigma_px: f64, seed: u64) -> Result<Cell, ExperimentError> {
        let trial = |trial| Ok(OneView::of(&photographs(1, (tilt_deg, sigma_px), (seed, trial))?[0]));
        let trials = (0..TRIALS as u64).into_par_iter().map(trial).collect::<Result<_, ExperimentError>>()?;
        Ok(Cell { tilt_deg, sigma_px, bound: one_view_bound(tilt_deg, sigma_px), trials })
    }

    /// Errors of the trials that were answered.
    fn errors(&self, way: Way, which: usize) -> Vec<f64> {
        self.trials.iter().filter_map(|trial| Some(way(trial)?.errors[which])).collect()
    }

    fn rms(&self, way: Way, which: usize) -> f64 {
        root_mean_square(self.errors(way, which))
    }

    fn bias(&self, way: Way, which: usize) -> f64 {
        mean(&self.errors(way, which))
    }

    /// About their mean.
    fn sd(&self, way: Way, which: usize) -> f64 {
        let (errors, bias) = (self.errors(way, which), self.bias(way, which));
        let n = errors.len() as f64;
        root_mean_square(errors.iter().map(|e| e - bias)) * (n / (n - 1.0)).sqrt()
    }

    fn answered(&self) -> f64 {
        share(&self.trials, |trial| trial.refined.is_some())
    }

    fn is_answered_always(&self) -> bool {
        self.trials.iter().all(|trial| trial.refined.is_some() && trial.off_centre.is_some())
    }

    /// Share of the answers whose stated interval of f contains the truth.
    fn coverage(&self, way: Way) -> f64 {
        let z = calibench_harness::stats::normal_two_sided(1.0 - COVERAGE);
        let answers: Vec<Estimate> = self.trials.iter().filter_map(way).collect();
        share(&answers, |answer| answer.errors[0].abs() <= z * answer.stated_fx)
    }

    fn rmse_px(&self, way: Way) -> f64 {
        mean(&self.trials.iter().filter_map(|trial| Some(way(trial)?.rmse_px)).collect::<Vec<_>>())
    }

    fn bound_of(&self, which: usize) -> f64 {
        self.bound.map_or(f64::NAN, |bound| bound[which])
    }
}

/// The Cramer-Rao bound of f, distance and k1 from one view, fy tied to fx, the principal point given.
fn one_view_bound(tilt_deg: f64, sigma_px: f64) -> Option<[f64; 3]> {
    let free = FreeParameters::of(&[Parameter::Fx, Parameter::Fy, Parameter::K1]);
    let bound = cramer_rao(&truth(1, tilt_deg), free, sigma_px).ok()?;
    let (tied, depth) = tied(&bound);
    Some([tied[(0, 0)].sqrt(), depth.sqrt(), tied[(2, 2)].sqrt()])
}

/// The covariance of the intrinsics, and the variance of the first view's distance, once `fx = fy` is known: with `a^T x =
/// 0` for a vector `a`, `C - C a a^T C / (a^T C a)`.
fn tied(bound: &Covariance) -> (DMatrix<f64>, f64) {
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
fn several_views_bound(views: usize) -> Result<f64, ExperimentError> {
    use Parameter::{Cx, Cy, Fx, Fy, K1};
    let free = FreeParameters::of(&[Fx, Fy, Cx, Cy, K1]);
    let bound = cramer_rao(&truth(views, TILT_DEG), free, SIGMA_PX).map_err(ExperimentError::at("bound"))?;
    Ok(tied(&bound).0[(0, 0)].sqrt())
}

/// Trials of several views with a free principal point.
struct Several {
    views: usize,
    bound_fx: f64,
    /// Errors of f; NaN where it was refused.
    errors: Vec<f64>,
}

impl Several {
    fn run(views: usize, seed: u64) -> Result<Several, ExperimentError> {
        let trial = |trial| {
            let views = photographs(views, (TILT_DEG, SIGMA_PX), (seed, trial))?;
            Ok(calibrate(&views, &all_free()).map_or(f64::NAN, |result| result.camera.fx - camera().fx))
        };
        let errors = (0..TRIALS as u64).into_par_iter().map(trial).collect::<Result<_, ExperimentError>>()?;
        Ok(Several { views, bound_fx: several_views_bound(views)?, errors })
    }

    fn rms(&self) -> f64 {
        root_mean_square(self.errors.iter().copied())
    }
}

/// Error of f from exact pixels, the principal point taken to be `offset` away from where it is.
fn exact_error(tilt_deg: f64, offset: Vec2) -> Result<f64, ExperimentError> {
    let views = Scene::new(truth(1, tilt_deg)).map_err(ExperimentError::at("scene"))?.exact();
    let result =
        calibrate(&views, &held_at(true_centre() + offset)).map_err(ExperimentError::at("exact view"))?;
    Ok(result.camera.fx - camera().fx)
}

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let tilts =
        TILTS_DEG.iter().map(|&t| Cell::run(t, SIGMA_PX, context.seed)).collect::<Result<Vec<_>, _>>()?;
    let noises =
        NOISES_PX.iter().map(|&n| Cell::run(TILT_DEG, n, context.seed)).collect::<Result<Vec<_>, _>>()?;
    let several = VIEWS.iter().map(|&n| Several::run(n, context.seed)).collect::<Result<Vec<_>, _>>()?;
    report_tilts(&mut record, &tilts);
    report_noises(&mut record, &noises);
    report_several(&mut record, &several);
    report_tolerance(&mut record, &tilts)?;
    claim_refused(&mut record, &tilts);
    claim_one_minimum(&mut record, &tilts);
    claim_bound(&mut record, &tilts, &several);
    claim_two_are_better(&mut record, &tilts, &several);
    claim_misled(&mut record, &tilts)?;
    record.table(tilt_table(&tilts));
    record.figure(tilt_figure(&tilts, context.seed));
    record.figure(noise_figure(&noises, context.seed));
    record.figure(views_figure(&several, &tilts, context.seed));
    Ok(record)
}

/// Means over trials of estimates whose refinement stops at half of the digits.
fn band() -> Band {
    Band::relative(1e-5, "means over trials of estimates whose refinement stops at half of the digits")
}

/// Bounds lose as many digits as their normal equations have condition.
fn bound_band() -> Band {
    Band::relative(1e-7, "the normal equations lose as many digits as they have condition, 1e8 at a degree")
}

/// A bias that may be next to nothing, beside its spread.
fn bias_band() -> Band {
    Band::absolute(1e-3, "means over trials of estimates known to 1e-4 px")
}

/// What f, distance and k1 are called.
const QUANTITIES: [(&str, &str, &str); 3] =
    [("fx", "px", "focal length"), ("depth", "mm", "distance"), ("k1", "", "coefficient k1")];

fn report_tilts(record: &mut Record, tilts: &[Cell]) {
    for cell in tilts {
        let (id, what) = (format!("-{}", cell.tilt_deg), format!(", tilt {} deg", cell.tilt_deg));
        record.exact("").suffix(&id, &what).number(
            "answered",
            cell.answered(),
            "share of views with an answer",
        );
        for (k, (name, unit, quantity)) in QUANTITIES.iter().enumerate() {
            if cell.bound.is_some() {
                let what_bound = format!("Cramer-Rao bound of the {quantity}");
                record.group(*unit, bound_band()).suffix(&id, &what).number(
                    format!("bound-{name}"),
                    cell.bound_of(k),
                    what_bound,
                );
            }
            if cell.is_answered_always() {
                record
                    .group(*unit, band())
                    .suffix(&id, &what)
                    .number(
                        format!("refined-{name}"),
                        cell.rms(REFINED, k),
                        format!("RMS error of the {quantity}, refined"),
                    )
                    .number(
                        format!("tsai-{name}"),
                        cell.rms(TSAI, k),
                        format!("RMS error of the {quantity}, Tsai's own answer"),
                    );
            }
        }
        if cell.is_answered_always() {
            record
                .group("px", bias_band())
                .suffix(&id, &what)
                .number(
                    "bias-off-centre",
                    cell.bias(OFF_CENTRE, 0),
                    "mean error of f, the principal point in the image's centre",
                )
                .group("px", band())
                .number("rmse", cell.rmse_px(REFINED), "mean RMSE")
                .number(
                    "rmse-off-centre",
                    cell.rmse_px(OFF_CENTRE),
                    "mean RMSE, the principal point in the image's centre",
                )
                .exact("")
                .number(
                    "coverage",
                    cell.coverage(REFINED),
                    "share of stated intervals of 95 % that contain f",
                )
                .number(
                    "coverage-off-centre",
                    cell.coverage(OFF_CENTRE),
                    "the same, the principal point in the image's centre",
                );
        }
    }
}

fn report_noises(record: &mut Record, noises: &[Cell]) {
    for cell in noises.iter().filter(|cell| cell.is_answered_always()) {
        record
            .group("px", band())
            .suffix(
                format!("-noise-{}", cell.sigma_px),
                format!(", tilt {TILT_DEG} deg, noise {} px", cell.sigma_px),
            )
            .number("refined-fx", cell.rms(REFINED, 0), "RMS error of f, refined")
            .number("tsai-fx", cell.rms(TSAI, 0), "RMS error of f, Tsai's own answer")
            .number(
                "off-centre-fx",
                cell.rms(OFF_CENTRE, 0),
                "RMS error of f, the principal point in the image's centre",
            );
    }
}

fn report_several(record: &mut Record, several: &[Several]) {
    for Several { views, bound_fx, .. } in several {
        record.group("px", bound_band()).number(
            format!("bound-fx-views-{views}"),
            *bound_fx,
            format!("Cramer-Rao bound of f from {views} views, the principal point free"),
        );
    }
    for found in several {
        record.group("px", band()).number(
            format!("fx-views-{}", found.views),
            found.rms(),
            format!("RMS error of f from {} views, the principal point free", found.views),
        );
    }
}

/// How well must the principal point be known for the stated uncertainty to mean anything?
fn report_tolerance(record: &mut Record, tilts: &[Cell]) -> Result<(), ExperimentError> {
    for cell in tilts.iter().filter(|cell| cell.tilt_deg >= LINEAR_TILT_DEG) {
        let step = 0.5;
        let slope = |direction: Vec2| -> Result<f64, ExperimentError> {
            let (ahead, behind) = (
                exact_error(cell.tilt_deg, step * direction)?,
                exact_error(cell.tilt_deg, -step * direction)?,
            );
            Ok((ahead - behind) / (2.0 * step))
        };
        // The gradient of f by the principal point: its length is the slope in the worst direction.
        let gradient = Vec2::new(slope(Vec2::x())?, slope(Vec2::y())?).norm();
        let band = Band::relative(1e-5, "a central difference of answers known to 1e-7 px");
        record
            .group("", band)
            .suffix(format!("-{}", cell.tilt_deg), format!(", tilt {} deg", cell.tilt_deg))
            .number(
                "fx-by-centre",
                gradient,
                "change of f by that of the principal point, px by px, in the worst direction",
            )
            .unit("px")
            .number(
                "tolerance",
                cell.bound_of(0) / gradient,
                "error of the principal point in that direction that moves f by its bound",
            );
    }
    Ok(())
}

fn claim_refused(record: &mut Record, tilts: &[Cell]) {
    let facing = &tilts[0];
    record
        .claim_that("facing-is-refused", "a plane that faces the camera is refused, every time")
        .every(
            "views",
            facing.trials.iter().enumerate().map(|(i, t)| (format!("trial {i}"), t.tsai.is_none())),
        )
        .because("a facing plane passes for a tilted one once in a million");
    let steep = tilts.iter().filter(|cell| cell.tilt_deg >= LINEAR_TILT_DEG);
    record
        .claim_that("tilted-is-answered", "from 10 degrees of tilt every view gives a camera")
        .every("cells", steep.map(|cell| (format!("{} deg", cell.tilt_deg), cell.is_answered_always())))
        .because("the focal length is then known to a twentieth and better, and refused at a third");
}

fn claim_one_minimum(record: &mut Record, tilts: &[Cell]) {
    let answered = tilts.iter().filter(|cell| cell.tilt_deg >= LINEAR_TILT_DEG).flat_map(|cell| {
        let case = |(i, trial): (usize, &OneView)| {
            let same = trial
                .refined
                .zip(trial.zhang)
                .is_some_and(|(a, b)| (a.errors[0] - b.errors[0]).abs() < 1e-4 * a.stated_fx);
            (format!("{} deg, trial {i}", cell.tilt_deg), same)
        };
        cell.trials.iter().enumerate().map(case).collect::<Vec<_>>()
    });
    record
        .claim_that("one-minimum", "from 10 degrees of tilt the refinement ends where Zhang's start and the search lead, whether it starts there or at Tsai's answer")
        .every("views", answered)
        .because("both minimise one cost; a refinement ends within a millionth of a standard deviation, and a hundred times that is allowed");
}

fn claim_bound(record: &mut Record, tilts: &[Cell], several: &[Several]) {
    let linear: Vec<&Cell> = tilts.iter().filter(|cell| cell.tilt_deg >= LINEAR_TILT_DEG).collect();
    let interval = Interval::of_deviation_ratio(TRIALS, each_of(3 * linear.len(), RATE));
    let within = |ratio: f64, interval: Interval| {
        interval.low * (1.0 - NONLINEARITY) < ratio && ratio < interval.high * (1.0 + NONLINEARITY)
    };
    let cases = linear.iter().flat_map(|cell| {
        (0..3).map(|k| {
            let ratio = cell.sd(REFINED, k) / cell.bound_of(k);
            (format!("{} deg, {}: {ratio:.3}", cell.tilt_deg, QUANTITIES[k].0), within(ratio, interval))
        })
    });
    record
        .claim_that(
            "bound-attained",
            "from 10 degrees of tilt one view, refined, spreads as its Cramer-Rao bound says",
        )
        .every("spreads", cases)
        .at_rate(RATE)
        .because("sqrt(chi2 / (n - 1)), all cases together at 1e-4, and 5 % for terms of second order");
    let interval = Interval::of_deviation_ratio(TRIALS, each_of(several.len(), RATE));
    record
        .claim_that(
            "several-attain-theirs",
            "two views and more with a free principal point spread as their bounds say",
        )
        .every(
            "numbers of views",
            several.iter().map(|found| {
                let ratio = found.rms() / found.bound_fx;
                (format!("{} views: {ratio:.3}", found.views), within(ratio, interval))
            }),
        )
        .at_rate(RATE)
        .because("the same; the bias is less than a fiftieth of the spread and counts in its square only");
}

fn claim_two_are_better(record: &mut Record, tilts: &[Cell], several: &[Several]) {
    let one = tilts.iter().find(|cell| cell.tilt_deg == TILT_DEG).map_or(f64::NAN, |cell| cell.bound_of(0));
    let two = several.iter().find(|found| found.views == 2).map_or(f64::NAN, |found| found.bound_fx);
    record
        .claim_that(
            "two-views-are-better",
            "two views about different axes with a free principal point know f better than one whose principal point is exact, by their bounds",
        )
        .at_most(two / one, 1.0)
        .because("bounds, without noise of their own; it could be otherwise, since two views have two unknowns more");
}

/// The bias is that of exact pixels, and the stated interval does not know of it.
fn claim_misled(record: &mut Record, tilts: &[Cell]) -> Result<(), ExperimentError> {
    let linear: Vec<&Cell> = tilts.iter().filter(|cell| cell.tilt_deg >= LINEAR_TILT_DEG).collect();
    let offset = image_centre() - true_centre();
    let mut cases = Vec::new();
    for cell in &linear {
        let (exact, found) = (exact_error(cell.tilt_deg, offset)?, cell.bias(OFF_CENTRE, 0));
        let sd = cell.sd(OFF_CENTRE, 0);
        let interval = Interval::of_mean(exact, sd, TRIALS, each_of(linear.len(), RATE));
        // The noise's own bias, of second order: sd^2 / f.
        let slack = 2.0 * sd * sd / camera().fx;
        let holds = (found - exact).abs() < interval.half_width() + slack;
        cases.push((format!("{} deg: {found:.3} px, exact {exact:.3} px", cell.tilt_deg), holds));
    }
    record
        .claim_that("a-wrong-centre-is-a-bias", "with the principal point 7 px off, f is wrong on average by what exact pixels give")
        .every("tilts", cases)
        .at_rate(RATE)
        .because("to first order noise and a wrong principal point add; normal interval of a mean, and twice the noise's own bias of second order");
    let cases = linear.iter().map(|cell| {
        let interval = Interval::of_proportion(
            (cell.coverage(REFINED) * TRIALS as f64).round() as usize,
            TRIALS,
            each_of(linear.len(), RATE),
        );
        (
            format!("{} deg: {:.3}", cell.tilt_deg, cell.coverage(REFINED)),
            interval.low - 0.01 < COVERAGE && COVERAGE < interval.high + 0.01,
        )
    });
    record
        .claim_that("a-right-centre-is-honest", "with the principal point right the stated interval of f contains it as often as it says")
        .every("tilts", cases)
        .at_rate(RATE)
        .because("Wilson's interval of a share, and a hundredth for the degrees of freedom of the noise and the tails of second order");
    Ok(())
}

fn tilt_table(tilts: &[Cell]) -> Table {
    Table::of(
        "tilt",
        "One view: what is answered, bound and RMS errors of f, and what a wrong principal point does",
        tilts,
    )
    .column("tilt", "deg", |cell| cell.tilt_deg)
    .column("answered", "", |cell| cell.answered())
    .column("bound_fx", "px", |cell| cell.bound_of(0))
    .column("refined_fx", "px", |cell| cell.rms(REFINED, 0))
    .column("tsai_fx", "px", |cell| cell.rms(TSAI, 0))
    .column("bias_off_centre", "px", |cell| cell.bias(OFF_CENTRE, 0))
    .column("coverage_off_centre", "", |cell| cell.coverage(OFF_CENTRE))
    .into()
}

fn tilt_figure(tilts: &[Cell], seed: u64) -> Figure {
    let answered = || tilts.iter().filter(|cell| cell.is_answered_always());
    let panel = |title: &str, unit: &str, k: usize| {
        let tilted = tilts.iter().filter(|cell| cell.bound.is_some() && cell.tilt_deg > 0.0);
        Plot::new(title, "tilt (deg)", unit)
            .line_as(
                "Cram\u{e9}r-Rao bound",
                tilted.map(|cell| (cell.tilt_deg, cell.bound_of(k))),
                Look::ink(),
            )
            .points_as(
                "refined",
                answered().map(|cell| (cell.tilt_deg, cell.rms(REFINED, k))),
                Look::series(0),
            )
            .points_as(
                "Tsai's own answer",
                answered().map(|cell| (cell.tilt_deg, cell.rms(TSAI, k))),
                Look::series(1),
            )
            .points_as(
                "refined, principal point 7 px off",
                answered().map(|cell| (cell.tilt_deg, cell.rms(OFF_CENTRE, k))),
                Look::series(2),
            )
            .log_x()
            .log_y()
    };
    let panels = [
        panel("Focal length", "RMS error (px)", 0),
        panel("Distance", "RMS error (mm)", 1),
        panel("k1", "RMS error", 2),
    ];
    let caption = format!(
        "RMS error of one view against its tilt, {TRIALS} photographs a point where all are answered, noise {SIGMA_PX} px, seed {seed}. Notice that \
         refinement attains the bound, and that with a wrong principal point more tilt does not help as much."
    );
    Figure::panels("tilt", &panels, 3, caption)
}

fn noise_figure(noises: &[Cell], seed: u64) -> Figure {
    let answered = || noises.iter().filter(|cell| cell.is_answered_always());
    let plot =
        Plot::new("One view, tilted by 30 degrees", "noise of a coordinate (px)", "RMS error of f (px)")
            .line_as(
                "Cram\u{e9}r-Rao bound",
                noises.iter().map(|cell| (cell.sigma_px, cell.bound_of(0))),
                Look::ink(),
            )
            .points_as(
                "refined",
                answered().map(|cell| (cell.sigma_px, cell.rms(REFINED, 0))),
                Look::series(0),
            )
            .points_as(
                "Tsai's own answer",
                answered().map(|cell| (cell.sigma_px, cell.rms(TSAI, 0))),
                Look::series(1),
            )
            .points_as(
                "refined, principal point 7 px off",
                answered().map(|cell| (cell.sigma_px, cell.rms(OFF_CENTRE, 0))),
                Look::series(2),
            )
            .log_x()
            .log_y();
    let caption = format!(
        "RMS error of f against the noise, {TRIALS} photographs a point, seed {seed}. With the principal point wrong, better marks stop helping: notice the floor."
    );
    Figure::plot("noise", &plot, caption)
}

fn views_figure(several: &[Several], tilts: &[Cell], seed: u64) -> Figure {
    let mut plot = Plot::new("Views with a free principal point", "number of views", "RMS error of f (px)")
        .line_as("Cram\u{e9}r-Rao bound", several.iter().map(|s| (s.views as f64, s.bound_fx)), Look::ink())
        .points_as("principal point free", several.iter().map(|s| (s.views as f64, s.rms())), Look::series(0))
        .log_x()
        .log_y();
    if let Some(one) = tilts.iter().find(|cell| cell.tilt_deg == TILT_DEG) {
        plot = plot
            .hline_as("one view, principal point right", one.rms(REFINED, 0), Look::series(1))
            .hline_as("one view, principal point 7 px off", one.rms(OFF_CENTRE, 0), Look::series(2));
    }
    let caption = format!(
        "RMS error of f against the number of views, all tilted by {TILT_DEG} degrees about different axes, {TRIALS} sets a point, noise {SIGMA_PX} px, seed {seed}. \
         Notice where the points cross the two lines of one view."
    );
    Figure::plot("views", &plot, caption)
}
