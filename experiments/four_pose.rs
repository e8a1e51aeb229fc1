//! How well do four views of the target determine the camera, and what does the reprojection error say about
//! that?
//!
//! Expected: the chapter's Table 5.1 and ours are two plausible draws from the distribution that the
//! Cramer-Rao bound predicts, and over many draws the solver attains that bound. The RMSE settles a little
//! under the noise floor whatever the errors of k1 and k2, and lies far under it only if few points feed many
//! parameters (section 5.3).
//!
//! What it cannot show: errors of a real target, lens or detector. Here the model is right and the noise is
//! Gaussian.

use calibench::board::View;
use calibench::calibrate::{Calibration, Settings, calibrate};
use calibench::camera::{Camera, FreeParameters, Parameter};
use calibench::evaluate::distribution::{fisher_cdf, round_significant};
use calibench::evaluate::{BoundError, Errors, RmseDistribution, Sample, cramer_rao, errors_of, leverages};
use calibench::geometry::{Vec2, Vec3};
use calibench::synth::{Scene, Stream, StreamKey, Truth, scene::looking_at_centre};
use calibench_harness::figure::density;
use calibench_harness::monte_carlo::Estimate;
use calibench_harness::stats::{Interval, each_of, normal_cdf, normal_two_sided};
use calibench_harness::{
    Band, Context, Dash, Experiment, ExperimentError, Figure, Look, Marker, MonteCarlo, Outcome, Plot,
    Predicted, Progress, Record, Table,
};

mod drawings;
mod figures;
mod trials;
mod weak;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "four-pose",
    title: "The camera from four views",
    question: "Four views of 63 points with 0.1 px of noise: how close do fx, fy, cx, cy, k1 and k2 come to \
               the truth, is the book's table one plausible draw, does the solver attain the Cramer-Rao \
               bound, and does the reprojection error tell? Expected: both tables inside the predicted \
               distribution, RMSE 0.1371 +- 0.0045 px just under the floor of 0.1414 px, and no relation \
               between RMSE and the errors of k1 and k2.",
    seed: 1,
    takes_image: false,
    run,
};

/// Standard deviation of the noise on each of u and v.
const SIGMA_PX: f64 = 0.1;
/// Trials of the Monte Carlo of the four poses.
const TRIALS: usize = 2000;
/// Points of the target as columns x rows, always over the same 80 x 60 mm.
const GRIDS: [(usize, usize); 5] = [(3, 3), (4, 3), (5, 4), (7, 5), (9, 7)];
/// Trials of each.
const GRID_TRIALS: usize = 300;
/// Distances of the views that face the camera, mm, and trials with them.
const FACING_MM: [f64; 4] = [100.0, 120.0, 140.0, 160.0];
const FACING_TRIALS: usize = 200;
/// Chance that a correct program fails one claim, or one family of claims.
const RATE: f64 = 1e-4;
/// Nominal coverage of the estimate's own confidence region.
const COVERAGE: f64 = 0.95;
/// Residuals are drawn this many times longer than they are.
const ARROW_SCALE: f64 = 150.0;
/// Draws that show how much the residuals of neighbours correlate by chance.
const PATTERN_TRIALS: usize = 200;
/// Trials that the clouds show: enough for a shape.
const CLOUD: usize = 600;

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let draw = Draw::new(context.seed)?;
    let book = Book::new(&record, &draw)?;
    report_inputs(&mut record, &draw);
    report_table(&mut record, &draw, &book);
    report_rmse(&mut record, &draw)?;
    claim_residuals(&mut record, &draw);

    let progress = context.progress("Monte Carlo", TRIALS);
    let outcome = monte_carlo(&draw.scene, context.seed, "four-pose/monte-carlo", TRIALS, &progress);
    drop(progress);
    trials::claim_attained(&mut record, &draw, &outcome);
    trials::claim_rmse_blind(&mut record, &draw, &outcome);
    let grids = weak::few_points(context)?;
    weak::claim_overfitting(&mut record, &grids);
    weak::claim_two_views(&mut record)?;
    weak::claim_facing_views(&mut record, context)?;

    record.figure(drawings::imaging(&draw));
    let verdicts = drawings::verdicts(&record)?;
    record.figure(verdicts);
    record.figure(figures::space(&draw));
    record.figure(figures::views(&draw));
    record.figure(figures::residuals(&draw)?);
    record.figure(figures::residual_distribution(&draw));
    record.figure(figures::ellipse(&draw, &book, &outcome));
    record.figure(figures::rmse(&draw, &book, &outcome));
    record.figure(figures::blind(&draw, &outcome));
    record.figure(figures::overfitting(&grids));
    Ok(record)
}

/// The seeded draw, calibrated, with what theory predicts of it.
struct Draw {
    seed: u64,
    scene: Scene,
    views: Vec<View>,
    calibration: Calibration,
    bound: calibench::calibrate::Covariance,
    errors: Errors,
    rmse: RmseDistribution,
    /// Residual over its predicted standard deviation `sigma sqrt(1 - h)`, u and v of every point.
    standardised: Vec<f64>,
    leverage_sum: f64,
}

impl Draw {
    fn new(seed: u64) -> Result<Draw, ExperimentError> {
        let scene = Scene::example();
        let key = StreamKey { seed, scenario: "four-pose", trial: 0, purpose: "noise" };
        let views = scene.observe(SIGMA_PX, &mut Stream::open(key));
        let calibration =
            calibrate(&views, &Settings::standard()).map_err(ExperimentError::at("calibration"))?;
        let bound = cramer_rao(&scene.truth, FreeParameters::STANDARD, SIGMA_PX)
            .map_err(ExperimentError::at("Cramer-Rao bound"))?;
        let singular = || ExperimentError::Input("the Cramer-Rao bound is singular".to_string());
        let errors = errors_of(&scene.truth.camera, &calibration.camera, &bound).ok_or_else(singular)?;
        let leverages = leverages(&calibration, &views).ok_or_else(singular)?;
        let leverage: Vec<f64> = leverages.iter().flatten().flat_map(|h| [h.x, h.y]).collect();
        let residuals = calibration.residuals.iter().flatten().flat_map(|r| [r.x, r.y]);
        let standardised = residuals.zip(&leverage).map(|(r, h)| r / (SIGMA_PX * (1.0 - h).sqrt())).collect();
        let rmse = predicted_rmse(&scene);
        let leverage_sum = leverage.iter().sum();
        Ok(Draw { seed, scene, views, calibration, bound, errors, rmse, standardised, leverage_sum })
    }

    fn sd(&self, parameter: Parameter) -> f64 {
        self.bound.standard_deviation(parameter).unwrap_or(f64::NAN)
    }

    /// The RMSE as a distribution that published values are held against.
    fn predicted_rmse(&self) -> Predicted {
        let scale = SIGMA_PX / (self.rmse.points as f64).sqrt();
        Predicted::Chi { scale, dof: self.rmse.degrees_of_freedom() as f64 }
    }
}

/// The distribution of the RMSE: six intrinsics are fitted, and six numbers for every pose.
fn predicted_rmse(scene: &Scene) -> RmseDistribution {
    let parameters = FreeParameters::STANDARD.len() + 6 * scene.pixels().len();
    RmseDistribution { sigma_px: SIGMA_PX, points: scene.observations(), parameters }
}

/// Calibrations of a scene with other noise each.
fn monte_carlo(scene: &Scene, seed: u64, scenario: &str, trials: usize, progress: &Progress) -> Outcome {
    let settings = Settings::standard();
    MonteCarlo { scene, settings: &settings, sigma_px: SIGMA_PX, seed, scenario, trials }.run(progress)
}

/// The book's table against the same truth and bound.
struct Book {
    camera: Camera,
    errors: Errors,
    rmse_px: f64,
}

impl Book {
    fn new(record: &Record, draw: &Draw) -> Result<Book, ExperimentError> {
        let mut values = [0.0; Parameter::COUNT];
        for parameter in FreeParameters::STANDARD.iter() {
            values[parameter as usize] = record.printed(parameter.name())?;
        }
        let camera = Camera::from_parameters(values);
        let errors = errors_of(&draw.scene.truth.camera, &camera, &draw.bound)
            .ok_or_else(|| ExperimentError::Input("the Cramer-Rao bound is singular".to_string()))?;
        Ok(Book { camera, errors, rmse_px: record.printed("rmse")? })
    }
}

/// Bands of estimates: the refinement ends within 1e-6 of a standard deviation of the minimum.
fn of_deviation(sd: f64) -> Band {
    Band::absolute(
        round_significant(1e-5 * sd, 2),
        "ten times the 1e-6 of a standard deviation to which the refinement converges",
    )
}

/// Bands of sums over estimates, and of predictions: rounding and convergence.
fn relative() -> Band {
    Band::relative(1e-6, "convergence of the refinement and rounding of the prediction")
}

fn report_inputs(record: &mut Record, draw: &Draw) {
    let truth = &draw.scene.truth;
    for parameter in FreeParameters::STANDARD.iter() {
        let (name, unit) = (parameter.name(), parameter.unit());
        record
            .exact(unit)
            .number(format!("{name}-true"), truth.camera.get(parameter), "truth")
            .rounds_to_printed();
    }
    let half_width = 0.5 * truth.image_size.0 as f64;
    let field_of_view = 2.0 * libm::atan(half_width / truth.camera.fx).to_degrees();
    let last_bits = Band::absolute(1e-12, "rounding of an angle below 180 degrees");
    record
        .group("deg", last_bits)
        .number("field-of-view-deg", field_of_view, "horizontal field of view")
        .rounds_to_printed()
        .exact("")
        .count("points-per-view", truth.points.len(), "points of the target")
        .rounds_to_printed()
        .count("pairs", draw.rmse.points, "point pairs of the four views")
        .rounds_to_printed()
        .unit("px")
        .number("sigma", SIGMA_PX, "standard deviation of the noise on each of u and v")
        .rounds_to_printed()
        .number("noise-floor", draw.rmse.noise_floor_px(), "sqrt(2) sigma")
        .rounds_to_printed()
        .unit("")
        .count("trials", TRIALS, "trials of the Monte Carlo");
}

fn report_table(record: &mut Record, draw: &Draw, book: &Book) {
    for (ours, theirs) in draw.errors.items.iter().zip(&book.errors.items) {
        let (name, sd) = (ours.parameter.name(), ours.standard_deviation);
        record
            .group(ours.parameter.unit(), of_deviation(sd))
            .prefix(name)
            .number("", ours.estimate, format!("calibrated {name}"))
            .drawn_as_printed(Predicted::Normal { mean: ours.truth, sd }, RATE)
            .number("-error", ours.error, format!("calibrated minus true {name}"))
            .drawn_as_printed(Predicted::Normal { mean: 0.0, sd }, RATE)
            .band(relative())
            .number("-sd", sd, format!("Cramer-Rao standard deviation of {name} at the truth"))
            .group("", of_deviation(1.0))
            .number("-z", ours.z, "our error over its standard deviation")
            .number("-book-z", theirs.z, "the book's error over it");
    }
    let pairs = draw.errors.items.iter().zip(&book.errors.items);
    record.table(
        Table::of("table-5-1", "truth, ours and the book's, in the parameter's unit", pairs)
            .column("parameter", "", |(ours, _)| ours.parameter.name())
            .column("unit", "", |(ours, _)| ours.parameter.unit())
            .column("truth", "", |(ours, _)| ours.truth)
            .column("ours", "", |(ours, _)| ours.estimate)
            .column("error", "", |(ours, _)| ours.error)
            .column("predicted_sd", "", |(ours, _)| ours.standard_deviation)
            .column("z", "", |(ours, _)| ours.z)
            .column("book", "", |(_, book)| book.estimate)
            .column("book_error", "", |(_, book)| book.error)
            .column("book_z", "", |(_, book)| book.z),
    );
    report_percent(record, draw, Parameter::Fx, "focal-error-percent");
    report_percent(record, draw, Parameter::K2, "k2-error-percent");
    claim_joint(record, "ours", &draw.errors);
    claim_joint(record, "book", &book.errors);
}

/// `|error| / |truth|` in percent: half-normal, the root of a chi-squared variable with one degree of
/// freedom.
fn report_percent(record: &mut Record, draw: &Draw, parameter: Parameter, id: &str) {
    let percent = 100.0 / draw.scene.truth.camera.get(parameter).abs();
    let error = draw.errors.items.iter().find(|i| i.parameter == parameter).map_or(f64::NAN, |i| i.error);
    let scale = percent * draw.sd(parameter);
    let what = format!("|error of {parameter}| over {parameter}");
    record
        .group("%", of_deviation(scale))
        .number(id, percent * error.abs(), what)
        .drawn_as_printed(Predicted::Chi { scale, dof: 1.0 }, RATE);
}

fn claim_joint(record: &mut Record, whose: &str, errors: &Errors) {
    let dof = errors.items.len();
    let value = errors.chi_squared;
    record
        .group("", relative())
        .number(format!("chi-squared-{whose}"), value, "squared Mahalanobis distance from the truth")
        .number(format!("p-value-{whose}"), errors.p_value, "chance of a larger one");
    record
        .claim_that(
            format!("table-plausible-{whose}"),
            format!(
                "the six errors ({whose}) are jointly one plausible draw under the Cramer-Rao covariance"
            ),
        )
        .drawn_from(value, &Predicted::ChiSquared { dof: dof as f64 }, RATE)
        .because("the maximum-likelihood estimate is Gaussian about the truth to first order in the noise");
}

fn report_rmse(record: &mut Record, draw: &Draw) -> Result<(), ExperimentError> {
    record
        .group("px", relative())
        .number("rmse", draw.calibration.rmse_px, "reprojection RMSE per point")
        .drawn_as_printed(draw.predicted_rmse(), RATE)
        .number("rmse-expected", draw.rmse.mean_px(), "its expectation")
        .number("rmse-sd", draw.rmse.standard_deviation_px(), "its standard deviation");
    let p = |rmse: f64| draw.rmse.p_value(rmse);
    let (ours, book) = (p(draw.calibration.rmse_px), p(record.printed("rmse")?));
    record
        .group("", Band::absolute(1e-5, "convergence"))
        .number("rmse-p-value-ours", ours, "two-sided, ours")
        .band(relative())
        .number("rmse-p-value-book", book, "two-sided, the book's");
    Ok(())
}

/// What the residuals of the one draw must satisfy, whatever their correlations.
fn claim_residuals(record: &mut Record, draw: &Draw) {
    let parameters = draw.rmse.parameters as f64;
    // The trace of a projection is its rank. Covariance and Jacobian are taken one last step of the
    // refinement apart, 1e-6 of a standard deviation at most; a whole standard deviation would not change the
    // derivatives by as much as themselves.
    let convergence = 1e-6 * parameters;
    let what = "sum of the leverages of all coordinates";
    record.group("", relative()).number("leverage-sum", draw.leverage_sum, what);
    record
        .claim_that(
            "leverages-count-the-parameters",
            "the leverages of the 504 coordinates sum to the 30 parameters that absorb noise",
        )
        .within(draw.leverage_sum, Interval::around(parameters, convergence))
        .because(
            "trace of the hat matrix; each leverage to the 1e-6 of a standard deviation to which the \
             refinement converges",
        );
    let largest = draw.standardised.iter().fold(0.0f64, |m, z| m.max(z.abs()));
    let bound = normal_two_sided(each_of(draw.standardised.len(), RATE));
    let what = "largest residual in its own standard deviations";
    record.group("sd", relative()).number("largest-residual", largest, what);
    record
        .claim_that("no-outlier", "no residual is larger than the noise model allows for 504 of them")
        .at_most(largest, bound)
        .unit("sd")
        .at_rate(RATE)
        .because(
            "each is standard normal once divided by sigma sqrt(1 - leverage); Bonferroni over all, valid \
             whatever their correlations",
        );
}

fn position(parameter: Parameter) -> usize {
    FreeParameters::STANDARD.position(parameter).expect("k1 and k2 are free in the chapter's model")
}
