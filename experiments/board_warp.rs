//! What does a board cost that is not flat, and what does it take to know?
//!
//! A printed board bows by tenths of a millimetre, and a calibration that takes it for flat puts the
//! difference elsewhere. mrcal and others estimate the bow with the camera. Here boards of known bow are
//! photographed; each set is calibrated as flat and with two bows estimated.
//!
//! Expected: taken for flat, the camera is biased in proportion to the bow, by standard deviations long
//! before the RMSE looks wrong, and the stated covariance is a lie. Residuals that agree with their
//! neighbours' tell of it where the RMSE does not, and a score test, which asks the marks for that very bow,
//! sooner. With the bows estimated bias and lie are gone, at the price of a little spread.
//!
//! A board that bends otherwise is calibrated with its marks measured in space besides.
//!
//! What it cannot show: boards that bend differently in every view.

mod wave;

use calibench::board::View;
use calibench::calibrate::{Board, LensCalibration, Settings, Warning, calibrate_lens};
use calibench::camera::{Camera, FreeParameters, Parameter};
use calibench::geometry::{Pose, Vec2, Vec3, rotation};
use calibench::synth::{Stream, StreamKey, Truth};
use calibench_harness::stats::{Interval, each_of, mean, root_mean_square, share};
use calibench_harness::{Band, Context, Experiment, ExperimentError, Figure, Look, Plot, Record, Table};
use rayon::prelude::*;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "board-warp",
    title: "What a bowed board costs, and what estimating the bow repairs",
    question: "A board of 80 x 60 mm bows by up to half a millimetre along its length. How wrong is a camera that takes \
               it for flat, what tells of it, and what does it cost to estimate the bow? Expected: a bias in proportion \
               to the bow, told by residuals that agree before the RMSE looks wrong and by a test for the bow itself sooner, and gone \
               with the bow estimated.",
    seed: 1,
    takes_image: false,
    run,
};

const SIGMA_PX: f64 = 0.1;
const TRIALS: usize = 150;
/// Heights of the board's middle over its ends, mm.
const BOWS_MM: [f64; 6] = [0.0, 0.02, 0.05, 0.1, 0.2, 0.5];
const VIEWS: usize = 12;
/// Chance that a correct program fails one claim.
const RATE: f64 = 1e-4;
/// What is estimated of the camera.
const FREE: FreeParameters = FreeParameters::STANDARD;

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let progress = context.progress("calibrations", BOWS_MM.len() * TRIALS);
    let one = |&bow_mm: &f64| -> Result<Level, ExperimentError> {
        let trials = (0..TRIALS as u64)
            .into_par_iter()
            .map(|trial| {
                let trial = Trial::new(bow_mm, context.seed, trial);
                progress.step();
                trial
            })
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Level { bow_mm, trials })
    };
    let levels = BOWS_MM.iter().map(one).collect::<Result<Vec<_>, _>>()?;
    drop(progress);
    report(&mut record, &levels);
    claim_flat_is_biased(&mut record)?;
    claim_told(&mut record, &levels);
    claim_repaired(&mut record, &levels);
    record.table(table(&levels));
    record.figure(figure(&levels, context.seed));
    wave::report(&mut record, context)?;
    Ok(record)
}

/// Poses 130 mm away, tilted by 25 degrees in directions that follow the golden angle, each a little aside.
fn poses() -> Vec<Pose> {
    let pose = |k: usize| {
        let (sin, cos) = libm::sincos(2.399_963_229_728_653 * k as f64);
        let tilt = Vec3::new(cos, sin, 0.0) * 25f64.to_radians();
        Pose { rotation: rotation::exp(&tilt), translation: Vec3::new(12.0 * sin, -12.0 * cos, 130.0) }
    };
    (0..VIEWS).map(pose).collect()
}

/// What the camera sees of a board: `height_mm` of every mark over the plane, `noise` of every coordinate.
fn photograph(
    height_mm: impl Fn(&Vec2) -> f64,
    mut noise: impl FnMut() -> f64,
) -> Result<Vec<View>, ExperimentError> {
    let (camera, points) = (Truth::example_camera(), Truth::example_board().points());
    let on_board = |p: &Vec2| Vec3::new(p.x, p.y, height_mm(p));
    let mut view = |pose: &Pose| {
        let pixel = |p: &Vec2| camera.project(&pose.apply(&on_board(p)));
        let exact: Option<Vec<Vec2>> = points.iter().map(pixel).collect();
        let exact = exact.ok_or("a mark is behind the camera").map_err(ExperimentError::at("scene"))?;
        let noisy = exact.iter().map(|p| p + Vec2::new(noise(), noise())).collect();
        View::new(points.clone(), noisy).map_err(ExperimentError::at("scene"))
    };
    poses().iter().map(&mut view).collect()
}

/// Half of the board's length, mm.
fn half_length_mm() -> f64 {
    Truth::example_board().points().iter().map(|p| p.x.abs()).fold(0.0, f64::max)
}

/// The same of a board whose middle lies `bow_mm` over its ends.
fn photograph_bowed(bow_mm: f64, noise: impl FnMut() -> f64) -> Result<Vec<View>, ExperimentError> {
    let half = half_length_mm();
    photograph(|p| bow_mm * (1.0 - (p.x / half) * (p.x / half)), noise)
}

/// The views calibrated as of a flat board, and with two bows estimated.
fn calibrated(views: &[View]) -> Result<[LensCalibration; 2], ExperimentError> {
    let flat = Settings::new(FREE).with_image_size(Truth::EXAMPLE_IMAGE);
    let bowed = flat.clone().with_board(Board::Bowed { standard_deviation: f64::INFINITY });
    let calibrate = |settings| calibrate_lens(views, settings).map_err(ExperimentError::at("calibration"));
    Ok([calibrate(&flat)?, calibrate(&bowed)?])
}

/// One set of photographs, calibrated both ways.
struct Trial {
    flat: LensCalibration,
    bowed: LensCalibration,
}

impl Trial {
    fn new(bow_mm: f64, seed: u64, trial: u64) -> Result<Trial, ExperimentError> {
        let mut stream = Stream::open(StreamKey { seed, scenario: "board-warp", trial, purpose: "noise" });
        Trial::of(&photograph_bowed(bow_mm, || SIGMA_PX * stream.normal())?)
    }

    fn of(views: &[View]) -> Result<Trial, ExperimentError> {
        let [flat, bowed] = calibrated(views)?;
        Ok(Trial { flat, bowed })
    }
}

/// Estimate - truth.
fn error(calibration: &LensCalibration, parameter: Parameter) -> f64 {
    let truth: Camera = Truth::example_camera();
    calibration.camera.value(parameter).unwrap_or(f64::NAN) - truth.get(parameter)
}

/// `e^T P^-1 e` of the camera.
fn nees(calibration: &LensCalibration) -> f64 {
    let errors: Vec<f64> = FREE.iter().map(|p| error(calibration, p)).collect();
    calibration.covariance.normalised_error_squared(&errors).unwrap_or(f64::NAN)
}

/// Whether residuals of neighbours are said to agree.
fn is_told(calibration: &LensCalibration) -> bool {
    calibration.warnings.iter().any(|warning| matches!(warning, Warning::Structured { .. }))
}

/// Whether the marks are said to ask for a board that is not flat, and for nothing else.
fn is_asked_for(calibration: &LensCalibration) -> bool {
    let any = |is_kind: fn(&Warning) -> bool| calibration.warnings.iter().any(is_kind);
    any(|w| matches!(w, Warning::NotFlat { .. })) && !any(|w| matches!(w, Warning::LeftOut { .. }))
}

/// The trials with boards of one bow.
struct Level {
    bow_mm: f64,
    trials: Vec<Trial>,
}

/// Which of a trial's two calibrations.
type Way = fn(&Trial) -> &LensCalibration;
const FLAT: Way = |trial| &trial.flat;
const BOWED: Way = |trial| &trial.bowed;

impl Level {
    fn mean(&self, way: Way, value: impl Fn(&LensCalibration) -> f64) -> f64 {
        mean(&self.trials.iter().map(|trial| value(way(trial))).collect::<Vec<_>>())
    }

    /// Mean and standard deviation of the error of fx, px.
    fn fx(&self, way: Way) -> (f64, f64) {
        let bias = self.mean(way, |c| error(c, Parameter::Fx));
        let spread = root_mean_square(self.trials.iter().map(|t| error(way(t), Parameter::Fx) - bias));
        (bias, spread)
    }

    fn told(&self) -> f64 {
        share(&self.trials, |trial| is_told(&trial.flat))
    }

    fn asked_for(&self) -> f64 {
        share(&self.trials, |trial| is_asked_for(&trial.flat))
    }
}

/// Sums of thousands of numbers known to the solver's half of the digits.
fn band() -> Band {
    Band::relative(1e-5, "means over trials of estimates whose refinement stops at half of the digits")
}

fn report(record: &mut Record, levels: &[Level]) {
    for level in levels {
        let Level { bow_mm, .. } = level;
        for (name, way, what) in [("flat", FLAT, "taken for flat"), ("bowed", BOWED, "bows estimated")] {
            let (bias, spread) = level.fx(way);
            record
                .group("px", Band::absolute(1e-4, "a mean of estimates known to 1e-5 px"))
                .suffix(format!("-{name}-{bow_mm}"), format!(", bow of {bow_mm} mm, {what}"))
                .number("fx-bias", bias, "mean error of fx")
                .group("px", band())
                .number("fx-sd", spread, "standard deviation of fx")
                .number("rmse", level.mean(way, |c| c.rmse_px), "mean RMSE")
                .group("", band())
                .number("nees", level.mean(way, nees), "mean of e^T P^-1 e of six parameters");
        }
        record
            .exact("")
            .suffix(format!("-{bow_mm}"), format!(", bow of {bow_mm} mm"))
            .number("told", level.told(), "share of the flat calibrations that warn of residuals that agree")
            .number(
                "asked-for",
                level.asked_for(),
                "share of the flat calibrations whose marks ask for a bowed board, and for nothing else",
            );
    }
}

/// Without noise, the bias of fx of twice the bow is twice as large.
fn claim_flat_is_biased(record: &mut Record) -> Result<(), ExperimentError> {
    let bias = |bow_mm: f64| {
        Trial::of(&photograph_bowed(bow_mm, || 0.0)?).map(|trial| error(&trial.flat, Parameter::Fx))
    };
    let (one, two) = (bias(0.1)?, bias(0.2)?);
    record
        .group("px", band())
        .number("exact-bias-0.1", one, "error of fx without noise, bow of 0.1 mm taken for flat")
        .number("exact-bias-0.2", two, "error of fx without noise, bow of 0.2 mm taken for flat");
    record
        .claim_that("bias-is-in-proportion", "twice the bow, taken for flat, is twice the error of the focal length")
        .within(two / one, Interval::around(2.0, 0.1))
        .because("the effect is of first order in the bow; 0.2 mm is 1/650 of the distance, and a twentieth is left for second order");
    Ok(())
}

/// At which bow the residuals speak, and that they are silent without one.
fn claim_told(record: &mut Record, levels: &[Level]) {
    let [flat, _, _, tenth, _, large] = levels else { return };
    record
        .claim_that("a-small-bow-is-asked-for", "every calibration that takes a bow of a tenth of a millimetre for flat says that its marks ask for a bow")
        .every(
            "calibrations",
            tenth.trials.iter().enumerate().map(|(i, t)| (format!("trial {i}"), is_asked_for(&t.flat))),
        )
        .because("the cost would fall by some two hundred variances, and 26 are told");
    record
        .claim_that(
            "a-bow-is-told",
            "every calibration that takes a bow of half a millimetre for flat warns of it",
        )
        .every(
            "calibrations",
            large.trials.iter().enumerate().map(|(i, t)| (format!("trial {i}"), is_told(&t.flat))),
        )
        .because("the bow moves marks by pixels, the noise by a tenth");
    let limit = Interval::of_proportion(0, TRIALS, RATE).high;
    record
        .claim_that("a-flat-board-is-not-accused", "flat boards are hardly ever taken for bent")
        .at_most(flat.told(), limit.max(0.05))
        .at_rate(RATE)
        .because("the warning's own false alarms are rarer than one in a hundred; what 150 trials can show of that");
    let limit = Interval::of_proportion(0, TRIALS, RATE).high;
    record
        .claim_that("a-flat-board-asks-for-nothing", "the marks of flat boards hardly ever ask for a bow")
        .at_most(flat.asked_for(), limit)
        .at_rate(RATE)
        .because(
            "the test's rate of false alarms is one in a hundred thousand; what 150 trials can show of that",
        );
}

/// With the bows estimated the covariance is true again.
fn claim_repaired(record: &mut Record, levels: &[Level]) {
    let parameters = FREE.len();
    let rate = each_of(levels.len(), RATE);
    let interval = Interval::of_mean_chi_squared(parameters, TRIALS, rate);
    // The noise is estimated with 1500 degrees of freedom: F in place of chi-squared, a part 2 / 1500 more,
    // and terms of second order in the noise.
    let slack = 0.02 * parameters as f64;
    let holds = |level: &Level| {
        let found = level.mean(BOWED, nees);
        (
            format!("bow of {} mm: {found:.2}", level.bow_mm),
            interval.low - slack < found && found < interval.high + slack,
        )
    };
    record
        .claim_that("repaired", "with the bows estimated the errors of the camera are as large as its covariance says, whatever the bow")
        .every("bows", levels.iter().map(holds))
        .at_rate(RATE)
        .because("mean of chi-squared numbers of six degrees of freedom");
}

fn table(levels: &[Level]) -> Table {
    Table::of("bows", "A board of 80 x 60 mm taken for flat, and with its bows estimated", levels)
        .column("bow", "mm", |level| level.bow_mm)
        .column("fx_bias_flat", "px", |level| level.fx(FLAT).0)
        .column("fx_bias_bowed", "px", |level| level.fx(BOWED).0)
        .column("fx_sd_flat", "px", |level| level.fx(FLAT).1)
        .column("fx_sd_bowed", "px", |level| level.fx(BOWED).1)
        .column("rmse_flat", "px", |level| level.mean(FLAT, |c| c.rmse_px))
        .column("rmse_bowed", "px", |level| level.mean(BOWED, |c| c.rmse_px))
        .column("nees_flat", "", |level| level.mean(FLAT, nees))
        .column("nees_bowed", "", |level| level.mean(BOWED, nees))
        .column("told", "", |level| level.told())
        .column("asked_for", "", |level| level.asked_for())
        .into()
}

fn figure(levels: &[Level], seed: u64) -> Figure {
    let along =
        |value: &dyn Fn(&Level) -> f64| levels.iter().map(|l| (l.bow_mm, value(l))).collect::<Vec<_>>();
    let panels = [
        Plot::new("Focal length", "bow (mm)", "mean error of fx (px)")
            .line_as("taken for flat", along(&|l| l.fx(FLAT).0), Look::series(1))
            .line_as("bows estimated", along(&|l| l.fx(BOWED).0), Look::series(0)),
        Plot::new("RMSE", "bow (mm)", "mean RMSE (px)")
            .line_as("taken for flat", along(&|l| l.mean(FLAT, |c| c.rmse_px)), Look::series(1))
            .line_as("bows estimated", along(&|l| l.mean(BOWED, |c| c.rmse_px)), Look::series(0)),
        Plot::new("Warned of", "bow (mm)", "share of the calibrations taken for flat")
            .line_as("neighbours agree", along(&Level::told), Look::series(1))
            .line_as("the marks ask for a bow", along(&Level::asked_for), Look::series(2))
            .y_range(-0.02, 1.02),
    ];
    let [flat, _, _, tenth, ..] = levels else { unreachable!("there are six bows") };
    let caption = format!(
        "Mean error of fx, mean RMSE and share of calibrations that warn, against the bow of the board, {TRIALS} sets of {VIEWS} \
         views a point, noise 0.1 px, seed {seed}. Notice that a bow of 0.1 mm moves fx by {:.1} of its standard deviations while \
         the RMSE rises by {:.0} % only.",
        (tenth.fx(FLAT).0 / flat.fx(FLAT).1).abs(),
        100.0 * (tenth.mean(FLAT, |c| c.rmse_px) / flat.mean(FLAT, |c| c.rmse_px) - 1.0),
    );
    Figure::panels("bows", &panels, 3, caption)
}
