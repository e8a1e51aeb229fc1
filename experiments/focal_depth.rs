//! Why must the target be tilted? Focal length against distance as the tilt goes to zero.
//!
//! Expected: a plane that faces the camera shows `f / Z` only. Tilt shows in two ways: lines converge, by
//! `sin(tilt) / Z`, and the target is foreshortened, by `cos(tilt)`. Convergence alone does not tell a small
//! tilt near from a large one far; only foreshortening knows the tilt, and its slope is `sin(tilt)`. So
//! `sd(f) / f` grows as `1 / sin^2(tilt)`, sd(Z) with it, and their correlation goes to one. Three facing
//! views are refused.
//!
//! What it cannot show: how other sources of depth, such as a step of known height, would separate the two.

use super::sweep::{Sweep, Swept, solver_band, spread_cases};
use calibench::camera::Parameter;
use calibench_harness::stats::{self, Interval, each_of};
use calibench_harness::{
    Band, Context, Experiment, ExperimentError, Figure, Look, Plot, Record, Rows, Table,
};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "focal-depth",
    title: "Focal length and distance as the tilt goes to zero",
    question: "Three views, tilted alike by 0 to 30 degrees about three axes: how well are focal length and \
               distance known, and how do their errors go together? Expected: both spread as one over the \
               squared sine of the tilt, their correlation goes to one, and views that face the camera are \
               refused.",
    seed: 22,
    takes_image: false,
    run,
};

const STUDY: &str = r#"
name = "focal-depth"
question = "What does tilt bring?"
seed = 0
# Cells draw noise of their own, so that they can be judged together.
common_random_numbers = false
scene.image = [640, 480]
scene.camera = { fx = 600.0, fy = 600.0, cx = 326.0, cy = 243.0, k1 = -0.18, k2 = 0.05 }
scene.target = { columns = 9, rows = 7, spacing_mm = 10.0 }
scene.poses = { kind = "spread", views = 3, tilt_deg = 0.0, distance_mm = 120.0 }
scene.noise_px = 0.1
trials = { per_cell = 400, batch = 400 }

[[factor]]
name = "tilt"
unit = "deg"
set = ["scene.poses.tilt_deg"]
levels = [0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 15.0, 20.0, 25.0, 30.0]
"#;

/// Chance that a correct program fails one of the statistical claims.
const FALSE_ALARM: f64 = 1e-4;
/// From here sd(f)/f is below 2 %, and first-order theory holds.
const LINEAR_TILT_DEG: f64 = 6.0;
/// Terms of second order, relative to the spread: sd(f)/f of 1 % at 6 degrees, and twice that.
const NONLINEARITY: f64 = 0.02;
/// Tilts between which the law of the squared sine is read off the bound: `cos(tilt)` and terms of fourth
/// order in the sine stay within 1 %.
const LAW_TILTS_DEG: (f64, f64) = (1.0, 4.0);

/// A tilt, with the correlation of focal length and distance that its bound predicts; NaN where there is
/// none.
struct Tilt<'a> {
    cell: Swept<'a>,
    correlation: f64,
}

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let sweep = Sweep::run(context, &mut record, "study", STUDY, |_| {})?;
    let tilts: Vec<Tilt> = sweep.cells().map(Tilt::of).collect();
    let linear: Vec<&Tilt> = tilts.iter().filter(|tilt| tilt.cell.level >= LINEAR_TILT_DEG).collect();

    report_numbers(&mut record, &tilts);
    claim_facing_refused(&mut record, &tilts[0].cell);
    claim_tilted_solved(&mut record, &linear);
    claim_spread(&mut record, &linear);
    claim_correlation(&mut record, &tilts, &linear);
    claim_law(&mut record, &sweep)?;
    record.table(table(&tilts));
    record.figure(figure(&sweep, &tilts)?);
    Ok(record)
}

impl Tilt<'_> {
    fn of(cell: Swept<'_>) -> Tilt<'_> {
        let predicted = || {
            let covariance = cell.design.bound()?;
            let row = covariance.free.position(Parameter::Fx)?;
            Some(covariance.cross[0][(row, 5)] / (cell.bound("fx") * cell.bound("depth")))
        };
        Tilt { cell, correlation: predicted().unwrap_or(f64::NAN) }
    }

    fn measured_correlation(&self) -> f64 {
        let correlations = &self.cell.found.correlations;
        let found = correlations.iter().find(|(a, b, _)| a.name() == "fx" && b.name() == "depth");
        found.map_or(f64::NAN, |r| r.2.value)
    }
}

fn report_numbers(record: &mut Record, tilts: &[Tilt]) {
    for tilt in tilts {
        let cell = &tilt.cell;
        let deg = cell.level;
        let (id, what) = (format!("-{deg}"), format!(", tilt {deg} deg"));
        record.group("", cell.share_band()).suffix(&id, &what).number(
            "converged",
            cell.converged(),
            "share of trials with a camera",
        );
        if cell.bound("fx").is_nan() {
            continue;
        }
        // Where trials are refused, one that changes sides moves the statistics of the others.
        if cell.converged() == 1.0 {
            record
                .group("px", solver_band())
                .suffix(&id, &what)
                .number("sd-fx", cell.sd("fx"), "sd of fx")
                .unit("mm")
                .number("sd-depth", cell.sd("depth"), "sd of the distance")
                .unit("")
                .number("correlation", tilt.measured_correlation(), "correlation of fx and distance");
        }
        let reason = "the normal equations lose as many digits as they have condition, 1e8 at half a degree";
        record
            .group("px", Band::relative(1e-7, reason))
            .suffix(&id, &what)
            .number("bound-fx", cell.bound("fx"), "Cramer-Rao bound of fx")
            .unit("mm")
            .number("bound-depth", cell.bound("depth"), "Cramer-Rao bound of the distance")
            .unit("")
            .number("bound-correlation", tilt.correlation, "predicted correlation");
    }
}

fn claim_facing_refused(record: &mut Record, facing: &Swept) {
    let refused = facing.found.outcomes.iter().find(|o| o.0 == "refused-not-identifiable").map_or(0, |o| o.1);
    record
        .claim_that(
            "facing-refused",
            "three views that face the camera are refused as not identifiable, every time",
        )
        .within(refused as f64, Interval::around(facing.found.trials as f64, 0.0))
        .because(
            "parallel planes give f / Z only (Zhang 2000, section 4); the solver's test lets one pass in 1e9",
        );
}

fn claim_tilted_solved(record: &mut Record, linear: &[&Tilt]) {
    record
        .claim_that("tilted-solved", "from 6 degrees of tilt every trial gives a camera")
        .every("cells", linear.iter().map(|t| (t.cell.found.name.clone(), t.cell.converged() == 1.0)))
        .because("6 degrees move the edge of the target by 5 px, fifty times the noise");
}

fn claim_spread(record: &mut Record, linear: &[&Tilt]) {
    let cells = linear.iter().map(|tilt| tilt.cell);
    record
        .claim_that(
            "bound-attained",
            "from 6 degrees of tilt focal lengths and distance spread as the Cramer-Rao bound says",
        )
        .every("spreads", spread_cases(cells, &["fx", "fy", "depth"], FALSE_ALARM, NONLINEARITY))
        .at_rate(FALSE_ALARM)
        .because("sqrt(chi2 / (n - 1)), all cases together at 1e-4, and 2 % for terms of second order");
}

fn claim_correlation(record: &mut Record, tilts: &[Tilt], linear: &[&Tilt]) {
    let each = each_of(linear.len(), FALSE_ALARM);
    let cases = linear.iter().map(|tilt| {
        let (found, expected, measured) = (tilt.cell.found, tilt.correlation, tilt.measured_correlation());
        let interval = Interval::of_correlation(measured, found.trials as usize, each);
        let case = format!("{}: correlation {measured:.6}, expected {expected:.6}", found.name);
        (case, interval.contains(expected))
    });
    record
        .claim_that("correlation", "focal length and distance err together as the bound predicts")
        .every("cells", cases)
        .at_rate(FALSE_ALARM)
        .because("Fisher's interval of a correlation, all tilts together at 1e-4");
    record
        .claim_that(
            "correlated-throughout",
            "even at 30 degrees the errors of focal length and distance go together",
        )
        .at_least(stats::smallest(tilts.iter().map(|tilt| tilt.correlation)), 0.9)
        .because(
            "the size of the image gives f / Z at any tilt: with correlation r it is known sqrt(1 - r^2) as \
             badly as f, 0.44 at r = 0.9",
        );
}

/// The cells of the two tilts between which the law is read off.
fn law_cells(sweep: &Sweep) -> Result<(Swept<'_>, Swept<'_>), ExperimentError> {
    let at = |deg: f64| {
        let cell = sweep.cells().find(|cell| cell.level == deg && cell.bound("fx").is_finite());
        cell.ok_or_else(|| ExperimentError::Input(format!("no bound at {deg} deg")))
    };
    Ok((at(LAW_TILTS_DEG.0)?, at(LAW_TILTS_DEG.1)?))
}

/// Slope of `ln bound` over `ln sin(tilt)` between the same two.
fn law_exponent((near, far): (Swept, Swept), quantity: &str) -> f64 {
    let run = libm::log(libm::sin(LAW_TILTS_DEG.1.to_radians()) / libm::sin(LAW_TILTS_DEG.0.to_radians()));
    libm::log(far.bound(quantity) / near.bound(quantity)) / run
}

/// `d ln sd / d ln sin(tilt) = -2`.
fn claim_law(record: &mut Record, sweep: &Sweep) -> Result<(), ExperimentError> {
    let cells = law_cells(sweep)?;
    for (id, what) in [("fx", "focal length"), ("depth", "distance")] {
        let exponent = law_exponent(cells, id);
        let band = Band::relative(1e-6, "a difference of logarithms of numbers known to 1e-7");
        let slope = format!("slope of ln bound of the {what} over ln sin(tilt), 1 to 4 deg");
        record.group("", band).number(format!("exponent-{id}"), exponent, slope);
        record
            .claim_that(
                format!("squared-sine-{id}"),
                format!("the bound of the {what} falls as one over the squared sine of the tilt"),
            )
            .within(exponent, Interval { low: -2.05, high: -1.95 })
            .because(
                "tilt is known by foreshortening, cos(tilt), whose slope is the sine, and distance by \
                 sin(tilt) / Z; at 4 deg terms of fourth order are 1 % of the information from convergence, \
                 and lens distortion adds as much",
            );
    }
    Ok(())
}

fn table<'a>(tilts: &'a [Tilt]) -> Rows<&'a Tilt<'a>> {
    let caption =
        "Spread of focal length and distance, and their correlation; statistics of converged trials";
    Table::of("tilt", caption, tilts)
        .column("tilt", "deg", |tilt| tilt.cell.level)
        .column("converged", "", |tilt| tilt.cell.converged())
        .column("sd_fx", "px", |tilt| tilt.cell.sd("fx"))
        .column("bound_fx", "px", |tilt| tilt.cell.bound("fx"))
        .column("sd_depth", "mm", |tilt| tilt.cell.sd("depth"))
        .column("bound_depth", "mm", |tilt| tilt.cell.bound("depth"))
        .column("correlation", "", |tilt| tilt.measured_correlation())
        .column("bound_correlation", "", |tilt| tilt.correlation)
}

fn figure(sweep: &Sweep, tilts: &[Tilt]) -> Result<Figure, ExperimentError> {
    let cells = law_cells(sweep)?;
    let spread = |title: &str, unit: &str, quantity: &str| {
        let sine = |deg: f64| libm::sin(deg.to_radians());
        let (at, value) = (LAW_TILTS_DEG.0, cells.0.bound(quantity));
        let law = |deg: f64| value * sine(at) * sine(at) / (sine(deg) * sine(deg));
        sweep.spread_plot((title, "tilt (deg)", unit), quantity, ("1/sin\u{b2}(tilt)", law))
    };
    let one_minus = |value: fn(&Tilt) -> f64| {
        let tilted = tilts.iter().filter(|tilt| tilt.cell.level > 0.0);
        tilted.map(move |tilt| (tilt.cell.level, 1.0 - value(tilt)))
    };
    let panels = [
        spread("Focal length fx", "px", "fx"),
        spread("Distance of the first view", "mm", "depth"),
        Plot::new("Correlation of fx and distance", "tilt (deg)", "1 \u{2212} correlation")
            .size(400.0, 340.0)
            .log_x()
            .log_y()
            .line_as("Cramer-Rao bound", one_minus(|tilt| tilt.correlation), Look::series(0))
            .points_as("measured", one_minus(|tilt| tilt.measured_correlation()), Look::series(1)),
        Plot::new("Trials with a camera", "tilt (deg)", "share of trials")
            .size(400.0, 340.0)
            .line_as("", sweep.cells().map(|cell| (cell.level, cell.converged())), Look::series(1))
            .y_range(-0.03, 1.03),
    ];
    let steepest = &tilts[tilts.len() - 1];
    let least = tilts.iter().find(|tilt| tilt.cell.sd("fx").is_finite()).unwrap_or(&tilts[0]);
    let caption = format!(
        "Three views at 120 mm tilted alike, 0.1 px of noise, {} trials a tilt, seed {}, 95 % intervals; \
         statistics of the trials that gave a camera. Notice that the bound of fx follows the sine to the \
         power {:.2}, and that 1 \u{2212} correlation falls from {:.1e} at {} deg to {:.1e} at {} deg. At \
         {} deg {:.0} % of the trials gave a camera; fx spreads over them by {:.2} of the bound, since they \
         are a selection.",
        sweep.trials(),
        sweep.spec().seed,
        law_exponent(cells, "fx"),
        1.0 - steepest.correlation,
        steepest.cell.level,
        1.0 - least.correlation,
        least.cell.level,
        least.cell.level,
        100.0 * least.cell.converged(),
        least.cell.sd("fx") / least.cell.bound("fx")
    );
    Ok(Figure::panels("tilt", &panels, 2, caption))
}
