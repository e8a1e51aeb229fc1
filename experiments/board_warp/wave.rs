//! A board that bends as no bow does: what bows mend of it, and what marks measured in space do.

use super::{FREE, RATE, SIGMA_PX, band, calibrated, error, half_length_mm, nees, photograph};
use calibench::board::View;
use calibench::calibrate::{LensCalibration, Settings};
use calibench::camera::Parameter;
use calibench::geometry::{Vec2, Vec3};
use calibench::measured::{MeasuredMark, MeasuredTarget, MeasuredView, Noise, SeenMark, calibrate_measured};
use calibench::synth::{Stream, StreamKey, Truth};
use calibench_harness::stats::{Interval, mean, root_mean_square};
use calibench_harness::{Band, Context, ExperimentError, Record, Table};
use rayon::prelude::*;

/// Height of the wave's crest over the board's ends, mm.
const CREST_MM: f64 = 0.2;
/// Standard deviation to which a mark is measured, each coordinate, mm.
const MEASURED_MM: f64 = 0.02;
/// Sets of photographs, each with marks measured anew.
const TRIALS: usize = 60;

/// What is done about the wave, in the order of the table.
const WAYS: [(&str, &str); 3] =
    [("flat", "taken for flat"), ("bowed", "bows estimated"), ("measured", "marks measured")];

/// One set of photographs, calibrated in three ways.
type Trial = [LensCalibration; 3];

/// Runs the sets and reports them.
pub(super) fn report(record: &mut Record, context: &Context) -> Result<(), ExperimentError> {
    let progress = context.progress("calibrations of a wave", TRIALS);
    let one = |number: u64| {
        let trial = trial(context.seed, number);
        progress.step();
        trial
    };
    let trials: Vec<Trial> = (0..TRIALS as u64).into_par_iter().map(one).collect::<Result<_, _>>()?;
    drop(progress);
    let rows: Vec<Row> = (0..WAYS.len()).map(|way| Row::of(way, &trials)).collect();
    for row in &rows {
        row.report(record);
    }
    claim(record, &rows);
    record.table(table(&rows));
    Ok(())
}

/// One crest and one trough along the board.
fn height_mm(p: &Vec2, half: f64) -> f64 {
    CREST_MM * libm::sin(std::f64::consts::PI * p.x / half)
}

fn trial(seed: u64, trial: u64) -> Result<Trial, ExperimentError> {
    let open = |purpose| Stream::open(StreamKey { seed, scenario: "board-warp-wave", trial, purpose });
    let points = Truth::example_board().points();
    let half = half_length_mm();
    let mut noise = open("noise");
    let views = photograph(|p| height_mm(p, half), || SIGMA_PX * noise.normal())?;
    let [flat, bowed] = calibrated(&views)?;
    let mut measuring = open("measuring");
    let mut off = || MEASURED_MM * measuring.normal();
    let marks = points.iter().enumerate().map(|(i, p)| {
        let place = Vec3::new(p.x, p.y, height_mm(p, half)) + Vec3::new(off(), off(), off());
        MeasuredMark::new(i.to_string(), place, MEASURED_MM)
    });
    let target = MeasuredTarget::new(marks.collect()).map_err(ExperimentError::at("target"))?;
    Ok([flat, bowed, with_measured_marks(&target, &views)?])
}

fn with_measured_marks(target: &MeasuredTarget, views: &[View]) -> Result<LensCalibration, ExperimentError> {
    let view = |view: &View| {
        let marks = view.pixels().iter().enumerate().map(|(i, pixel)| SeenMark::new(i.to_string(), *pixel));
        MeasuredView::new(marks.collect())
    };
    let views: Vec<MeasuredView> =
        views.iter().map(view).collect::<Result<_, _>>().map_err(ExperimentError::at("scene"))?;
    let settings = Settings::new(FREE).with_image_size(Truth::EXAMPLE_IMAGE);
    calibrate_measured(target, &views, &settings, Noise::Estimated)
        .map(|found| found.calibration)
        .map_err(ExperimentError::at("calibration"))
}

/// One way, over all sets.
struct Row {
    id: &'static str,
    what: &'static str,
    bias_px: f64,
    centre_bias_px: f64,
    spread_px: f64,
    rmse_px: f64,
    nees: f64,
}

impl Row {
    fn of(way: usize, trials: &[Trial]) -> Row {
        let average = |value: &dyn Fn(&LensCalibration) -> f64| {
            mean(&trials.iter().map(|trial| value(&trial[way])).collect::<Vec<_>>())
        };
        let fx = |c: &LensCalibration| error(c, Parameter::Fx);
        let bias_px = average(&fx);
        Row {
            id: WAYS[way].0,
            what: WAYS[way].1,
            bias_px,
            centre_bias_px: average(&|c| error(c, Parameter::Cx)),
            spread_px: root_mean_square(trials.iter().map(|trial| fx(&trial[way]) - bias_px)),
            rmse_px: average(&|c| c.rmse_px),
            nees: average(&nees),
        }
    }

    fn report(&self, record: &mut Record) {
        record
            .group("px", Band::absolute(1e-4, "a mean of estimates known to 1e-5 px"))
            .suffix(format!("-wave-{}", self.id), format!(", wave of {CREST_MM} mm, {}", self.what))
            .number("fx-bias", self.bias_px, "mean error of fx")
            .number("cx-bias", self.centre_bias_px, "mean error of cx")
            .group("px", band())
            .number("fx-sd", self.spread_px, "standard deviation of fx")
            .number("rmse", self.rmse_px, "mean RMSE")
            .group("", band())
            .number("nees", self.nees, "mean of e^T P^-1 e of six parameters");
    }
}

/// Bows do not repair a wave, measured marks do.
fn claim(record: &mut Record, rows: &[Row]) {
    let [_, bowed, measured] = rows else { return };
    let parameters = FREE.len();
    let interval = Interval::of_mean_chi_squared(parameters, TRIALS, RATE);
    // As for the bows: the noise is estimated, and terms of second order are left out.
    let slack = 0.02 * parameters as f64;
    record
        .claim_that("bows-do-not-repair-a-wave", "a board that bends as no bow does is not repaired by bows")
        .at_least(bowed.nees, interval.high + slack)
        .at_rate(RATE)
        .because("a crest and a trough are odd along the board, a bow is even");
    record
        .claim_that("measured-marks-repair-a-wave", "with its marks measured the errors of the camera are as large as its covariance says")
        .within(measured.nees, Interval { low: interval.low - slack, high: interval.high + slack })
        .at_rate(RATE)
        .because("mean of chi-squared numbers of six degrees of freedom; the measurements' errors stand in the covariance");
}

fn table(rows: &[Row]) -> Table {
    let title = "A board with a crest and a trough: taken for flat, with its bows estimated, and with its marks measured in space";
    Table::of("wave", title, rows)
        .column("way", "", |row| row.what)
        .column("fx_bias", "px", |row| row.bias_px)
        .column("fx_sd", "px", |row| row.spread_px)
        .column("cx_bias", "px", |row| row.centre_bias_px)
        .column("rmse", "px", |row| row.rmse_px)
        .column("nees", "", |row| row.nees)
        .into()
}
