//! What does one view give, by Tsai's method, and when does it mislead?
//!
//! One photograph of a tilted plane tells focal length, distance and lens, if the principal point is told:
//! two of the plane's eight numbers go to them, six to the pose. Zhang's method finds the principal point
//! too, from more views. Here the camera of the chapter's experiment, its lens with one coefficient, is
//! calibrated from one view by Tsai's two stages, from the same view by maximum likelihood, and from two
//! views and more with the principal point free.
//!
//! Expected: refined, one view attains its Cramer-Rao bound, which falls with the squared sine of the tilt;
//! Tsai's own answer is a little worse. A principal point that is wrong by pixels moves the focal length by
//! pixels, in proportion, while residuals hardly tell: the stated uncertainty is then too small. What was
//! expected besides and does not hold: that one view with an exact principal point does what two or three
//! with a free one do. Two do better.
//!
//! What it cannot show: targets in three dimensions, whose one view finds the principal point; lenses that
//! need two coefficients.

use calibench_harness::{Context, Experiment, ExperimentError, Record};

mod claims;
mod numbers;
mod shown;
mod trial;

use trial::{Cell, Several};

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

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let tilts =
        TILTS_DEG.iter().map(|&t| Cell::run(t, SIGMA_PX, context.seed)).collect::<Result<Vec<_>, _>>()?;
    let noises =
        NOISES_PX.iter().map(|&n| Cell::run(TILT_DEG, n, context.seed)).collect::<Result<Vec<_>, _>>()?;
    let several = VIEWS.iter().map(|&n| Several::run(n, context.seed)).collect::<Result<Vec<_>, _>>()?;
    numbers::report_tilts(&mut record, &tilts);
    numbers::report_noises(&mut record, &noises);
    numbers::report_several(&mut record, &several);
    numbers::report_tolerance(&mut record, &tilts)?;
    claims::claim_refused(&mut record, &tilts);
    claims::claim_one_minimum(&mut record, &tilts);
    claims::claim_bound(&mut record, &tilts, &several);
    claims::claim_two_are_better(&mut record, &tilts, &several);
    claims::claim_misled(&mut record, &tilts)?;
    record.table(shown::tilt_table(&tilts));
    record.figure(shown::tilt_figure(&tilts, context.seed));
    record.figure(shown::noise_figure(&noises, context.seed));
    record.figure(shown::views_figure(&several, &tilts, context.seed));
    Ok(record)
}
