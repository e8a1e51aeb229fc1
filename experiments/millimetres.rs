//! What does an error in pixels cost in millimetres?
//!
//! A drawing is in millimetres, with a tolerance of 0.02 mm; an image is in pixels. The chapter gives 0.8 px
//! as an example of an error, calls a focal length that is off by 0.24 % ample, and scales pixels to
//! millimetres by one number once the lens is corrected (sections 5, 5.3 and 5.4). So a length on the facing
//! view's plane is measured in four ways, with calibrations of many draws of the noise.
//!
//! Expected: without correction the lens alone exceeds the tolerance many times. With a focal length and a
//! known distance the calibration's error exceeds it too. With a scale from the plane itself what is left is
//! the noise of the two marks, and a single measurement of marks known to 0.1 px does not hold 0.02 mm
//! either. The uncertainty that is stated with a length is true.
//!
//! What it cannot show: a part that does not lie in the target's plane, and marks that are worse than the
//! target's.

use calibench::calibrate::{Calibration, Settings, calibrate};
use calibench::camera::{FreeParameters, Parameter};
use calibench::downstream::{Conditions, PlaneView, length_in_view};
use calibench::evaluate::cramer_rao;
use calibench::geometry::{Similarity, Vec2};
use calibench::synth::{Scene, Stream, StreamKey};
use calibench_harness::figure::density;
use calibench_harness::stats::{Interval, each_of, mean, root_mean_square};
use calibench_harness::{Band, Context, Experiment, ExperimentError, Figure, Plot, Record, Table};
use rayon::prelude::*;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "millimetres",
    title: "What an error in pixels costs in millimetres",
    question: "A length on the plane of the facing view is read in four ways. How wrong is it in millimetres, against \
               a tolerance of 0.02 mm, and is the stated uncertainty true? Expected: only with a scale from the plane \
               itself is it as good as its two marks.",
    seed: 1,
    takes_image: false,
    run,
};

/// Noise on each of u and v, of the target's points and of the marks.
const SIGMA_PX: f64 = 0.1;
const TRIALS: usize = 2000;
/// Chance that a correct program fails one claim.
const RATE: f64 = 1e-4;
/// The chapter's example of a drawing: a length, an error and a tolerance.
const EXAMPLE_PX: f64 = 312.46;
const EXAMPLE_ERROR_PX: f64 = 0.8;
const TOLERANCE_MM: f64 = 0.02;
/// Ends of the length on the target, mm: 60 mm, off the middle, between the target's points.
const ENDS_MM: [Vec2; 2] = [Vec2::new(-25.0, -15.0), Vec2::new(35.0, -15.0)];
/// The view whose plane is measured on.
const FACING: usize = 0;
/// Ways to read the length, and what each is called in a table.
const WAYS: [(&str, &str); 4] = [
    ("uncorrected", "pixels as photographed, scale from focal length and known distance"),
    ("known-distance", "corrected, scale from focal length and known distance"),
    ("plane-scale", "corrected, scale from the target's points in the plane"),
    ("plane-view", "camera and pose of the calibration, with its uncertainty"),
];

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let scene = Scene::example();
    let progress = context.progress("calibrations", TRIALS);
    let trials = (0..TRIALS as u64)
        .into_par_iter()
        .map(|trial| {
            let measured = Measured::new(&scene, context.seed, trial);
            progress.step();
            measured
        })
        .collect::<Result<Vec<_>, _>>()?;
    drop(progress);
    let ways: Vec<Way> = (0..WAYS.len()).map(|way| Way::of(way, &trials)).collect();
    report_example(&mut record, &scene);
    report_ways(&mut record, &ways);
    claim_scale(&mut record, &ways, &scene)?;
    claim_stated(&mut record, &trials);
    record.table(ways_table(&ways));
    record.figure(errors_figure(&trials, &ways, context.seed));
    Ok(record)
}

/// One draw: calibrated, and the length read in four ways.
struct Measured {
    /// Measured less true length, mm, in the order of [`WAYS`].
    errors_mm: [f64; 4],
    /// Stated standard uncertainty of the last way, mm.
    stated_mm: f64,
}

impl Measured {
    fn new(scene: &Scene, seed: u64, trial: u64) -> Result<Measured, ExperimentError> {
        let stream = |purpose| Stream::open(StreamKey { seed, scenario: "millimetres", trial, purpose });
        let views = scene.observe(SIGMA_PX, &mut stream("noise"));
        let calibration =
            calibrate(&views, &Settings::standard()).map_err(ExperimentError::at("calibration"))?;
        let mut noise = stream("marks");
        let pose = &scene.truth.cam_from_target[FACING];
        let marks = ENDS_MM.map(|end| {
            let seen = scene.truth.camera.project(&pose.apply(&end.push(0.0)));
            seen.map(|p| p + SIGMA_PX * Vec2::new(noise.normal(), noise.normal()))
        });
        let [Some(a), Some(b)] = marks else {
            return Err(ExperimentError::Input("an end of the length is not seen".to_string()));
        };
        let camera = &calibration.camera;
        let correct = |p: &Vec2| camera.correct_pixel(p).map_err(ExperimentError::at("correction of a mark"));
        let (ideal_a, ideal_b) = (correct(&a)?, correct(&b)?);
        let mm_per_px = pose.translation.z / camera.fx;
        let ideal = views[FACING].pixels().iter().map(correct).collect::<Result<Vec<_>, _>>()?;
        let plane = Similarity::fit(&ideal, views[FACING].points())
            .map_err(ExperimentError::at("scale of the plane"))?;
        let (length, stated_mm) = in_view(&calibration, [a, b])?;
        let truth = (ENDS_MM[1] - ENDS_MM[0]).norm();
        let lengths = [
            mm_per_px * (b - a).norm(),
            mm_per_px * (ideal_b - ideal_a).norm(),
            plane.scale() * (ideal_b - ideal_a).norm(),
            length,
        ];
        Ok(Measured { errors_mm: lengths.map(|length| length - truth), stated_mm })
    }
}

/// The length as `calibench measure` reads it, and its standard uncertainty.
fn in_view(calibration: &Calibration, pixels: [Vec2; 2]) -> Result<(f64, f64), ExperimentError> {
    let plane = PlaneView::of_view(
        &calibration.camera,
        &calibration.cam_from_target,
        &calibration.covariance,
        FACING,
    )
    .map_err(ExperimentError::at("plane of the view"))?;
    let length = length_in_view(&plane, &pixels, &Conditions::marks(SIGMA_PX))
        .map_err(ExperimentError::at("length"))?;
    Ok((length.value, length.standard_uncertainty()))
}

/// One way over all trials.
struct Way {
    name: &'static str,
    what: &'static str,
    mean_mm: f64,
    sd_mm: f64,
    rms_mm: f64,
    /// Share of the trials within the tolerance.
    within: f64,
}

impl Way {
    fn of(way: usize, trials: &[Measured]) -> Way {
        let errors: Vec<f64> = trials.iter().map(|t| t.errors_mm[way]).collect();
        let mean_mm = mean(&errors);
        let (name, what) = WAYS[way];
        Way {
            name,
            what,
            mean_mm,
            sd_mm: root_mean_square(errors.iter().map(|e| e - mean_mm)),
            rms_mm: root_mean_square(errors.iter().copied()),
            within: errors.iter().filter(|e| e.abs() <= TOLERANCE_MM).count() as f64 / errors.len() as f64,
        }
    }
}

/// Numbers that rest on converged estimates.
fn converged() -> Band {
    Band::relative(1e-6, "refinement converges to 1e-6 of a standard deviation")
}

/// The chapter's example at this station.
fn report_example(record: &mut Record, scene: &Scene) {
    let mm_per_px = scene.truth.cam_from_target[FACING].translation.z / scene.truth.camera.fx;
    record
        .exact("mm")
        .number(
            "pixel",
            mm_per_px,
            "what a pixel is on the plane of the facing view, distance over focal length",
        )
        .number(
            "example-length",
            EXAMPLE_PX * mm_per_px,
            "the chapter's example of a length, 312.46 px, there",
        )
        .number("example-error", EXAMPLE_ERROR_PX * mm_per_px, "its example of an error, 0.8 px, there")
        .number("tolerance", TOLERANCE_MM, "its example of a tolerance")
        .number("length", (ENDS_MM[1] - ENDS_MM[0]).norm(), "the length that is measured here")
        .unit("px")
        .number("tolerance-px", TOLERANCE_MM / mm_per_px, "that tolerance in pixels");
    record.exact("").count("trials", TRIALS, "calibrations, each with a measurement");
}

fn report_ways(record: &mut Record, ways: &[Way]) {
    for way in ways {
        record
            .group("mm", converged())
            .prefix(format!("{}-", way.name))
            .number("mean", way.mean_mm, format!("mean error of the length: {}", way.what))
            .number("sd", way.sd_mm, "its standard deviation")
            .number("rms", way.rms_mm, "root mean square of the error")
            .unit("")
            .number("within", way.within, "share within the tolerance");
    }
}

/// What theory says of three of the ways.
fn claim_scale(record: &mut Record, ways: &[Way], scene: &Scene) -> Result<(), ExperimentError> {
    let [uncorrected, distance, plane, _] = ways else { return Ok(()) };
    let bound = cramer_rao(&scene.truth, FreeParameters::STANDARD, SIGMA_PX)
        .map_err(ExperimentError::at("Cramer-Rao bound"))?;
    let fx = scene.truth.camera.fx;
    let of_focal =
        (ENDS_MM[1] - ENDS_MM[0]).norm() * bound.standard_deviation(Parameter::Fx).unwrap_or(f64::NAN) / fx;
    // Two marks, each with the noise of a pixel along the length.
    let of_marks =
        std::f64::consts::SQRT_2 * SIGMA_PX * scene.truth.cam_from_target[FACING].translation.z / fx;
    record
        .group("mm", converged())
        .number("marks-sd", of_marks, "standard deviation of the length by the noise of its two marks")
        .number("focal-sd", of_focal, "standard deviation of the length by the bound of the focal length");
    record
        .claim_that("uncorrected-exceeds-the-tolerance", "without correction of the lens the length is wrong by more than the tolerance, whatever the noise")
        .at_least(uncorrected.mean_mm.abs() - 5.0 * uncorrected.sd_mm, TOLERANCE_MM)
        .unit("mm")
        .at_rate(RATE)
        .because("five standard deviations of the error, both from the trials");
    record
        .claim_that("focal-length-is-not-ample", "with a known distance the error of the focal length comes on top of the marks'")
        .at_least(distance.sd_mm, 1.5 * of_marks)
        .unit("mm")
        .at_rate(RATE)
        .because("bound of the focal length and noise of the marks together are 2.6 times the latter; chance moves a deviation of 2000 trials by a tenth at most");
    let ratio = Interval::of_deviation_ratio(TRIALS, RATE);
    record
        .claim_that("a-scale-suffices", "with a scale from the plane itself hardly more is left than the noise of the two marks")
        .at_most(plane.rms_mm / of_marks, 1.1 * ratio.high)
        .at_rate(RATE)
        .because("chi-squared interval of the trials' deviation, and a tenth for the scale's and the lens's own errors");
    Ok(())
}

/// The stated uncertainty against the errors.
fn claim_stated(record: &mut Record, trials: &[Measured]) {
    let in_standard_deviations = |t: &Measured| t.errors_mm[3] / t.stated_mm;
    let squares: Vec<f64> =
        trials.iter().map(|t| in_standard_deviations(t) * in_standard_deviations(t)).collect();
    let found = mean(&squares);
    let interval = Interval::of_mean_chi_squared(1, TRIALS, each_of(1, RATE));
    record.group("", converged()).number(
        "stated-squared",
        found,
        "mean squared error over the stated standard uncertainty, 1 if that is true",
    );
    record
        .claim_that(
            "the-stated-uncertainty-is-true",
            "errors of the length are as large as its stated uncertainty says",
        )
        .within(found, interval)
        .at_rate(RATE)
        .because("mean of as many chi-squared numbers of one degree of freedom as there are trials");
}

fn ways_table(ways: &[Way]) -> Table {
    Table::of("ways", "error of a length of 60 mm on the plane of the facing view, read in four ways", ways)
        .column("way", "", |way| way.what)
        .column("mean_error", "mm", |way| way.mean_mm)
        .column("standard_deviation", "mm", |way| way.sd_mm)
        .column("within_tolerance", "", |way| way.within)
        .into()
}

fn errors_figure(trials: &[Measured], ways: &[Way], seed: u64) -> Figure {
    const RANGE: (f64, f64) = (-0.3, 0.3);
    let outline = |way: usize| {
        let errors: Vec<f64> = trials.iter().map(|t| t.errors_mm[way]).collect();
        let bins = density(&errors, RANGE, 60);
        bins.into_iter().map(|(left, right, height)| (0.5 * (left + right), height)).collect::<Vec<_>>()
    };
    let plot = Plot::new("Error of a length of 60 mm", "error (mm)", "density (1/mm)")
        .x_range(RANGE.0, RANGE.1)
        .line("focal length and known distance", outline(1))
        .line("scale from the plane", outline(2))
        .line("camera and pose", outline(3))
        .vline("tolerance", TOLERANCE_MM)
        .vline("", -TOLERANCE_MM);
    let [uncorrected, known_distance, from_plane, from_pose] = [0, 1, 2, 3].map(|way| &ways[way]);
    let caption = format!(
        "Error of a length over {TRIALS} calibrations and measurements (seed {seed}, noise of target points and marks \
         {SIGMA_PX} px). Without correction of the lens the errors lie outside of the figure, near {:.1} mm. Standard \
         deviations: {:.3} mm by focal length and known distance, {:.3} mm by the scale from the plane, {:.3} mm by \
         camera and pose. Of single measurements by the scale from the plane {:.0} % miss the tolerance.",
        uncorrected.mean_mm,
        known_distance.sd_mm,
        from_plane.sd_mm,
        from_pose.sd_mm,
        100.0 * (1.0 - from_plane.within)
    );
    Figure::plot("errors", &plot, caption)
}
