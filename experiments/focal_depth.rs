//! Why must the target be tilted? Focal length against distance as the tilt goes to zero.
//!
//! Expected: a plane that faces the camera shows `f / Z` only. Tilt shows in two ways: lines converge, by
//! `sin(tilt) / Z`, and the target is foreshortened, by `cos(tilt)`. Convergence alone does not tell a small
//! tilt near from a large one far; only foreshortening knows the tilt, and its slope is `sin(tilt)`. So
//! `sd(f) / f` grows as `1 / sin^2(tilt)`, sd(Z) with it, and their correlation goes to one. Three facing
//! views are refused.
//!
//! What it cannot show: how other sources of depth, such as a step of known height, would separate the two.

use calibench::camera::Parameter;
use calibench_harness::stats::{Interval, each_of};
use calibench_harness::{
    Band, Context, Dash, Experiment, ExperimentError, Figure, Look, Plot, Record, Table,
};
use calibench_study::{Cell as StudyCell, CellSummary, Engine, Summary, within};

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
/// The refinement ends within a millionth of a standard deviation of the minimum.
const SOLVER: f64 = 1e-6;

/// What the Cramer-Rao bound says of one tilt.
struct Bound {
    focal_px: f64,
    depth_mm: f64,
    correlation: f64,
}

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let (engine, summary) = within(context, &mut record, "study", STUDY, |_| {})?;
    let bounds: Vec<Option<Bound>> = engine.cells.iter().map(bound).collect();

    report_numbers(&mut record, &engine, &summary, &bounds);
    claim_facing_refused(&mut record, &summary);
    claim_tilted_solved(&mut record, &engine, &summary);
    claim_spread(&mut record, &engine, &summary);
    claim_correlation(&mut record, &engine, &summary, &bounds);
    claim_law(&mut record, &engine, &bounds)?;
    record.table(table(&engine, &summary, &bounds));
    record.figure(figure(&engine, &summary, &bounds)?);
    Ok(record)
}

fn tilt_deg(engine: &Engine, cell: usize) -> f64 {
    engine.spec.factor[0].number(engine.cells[cell].levels[0]).unwrap_or(f64::NAN)
}

/// What the bound of a cell says of the first view.
fn bound(cell: &StudyCell) -> Option<Bound> {
    let covariance = cell.bound()?;
    let focal_px = covariance.standard_deviation(Parameter::Fx)?;
    let depth_mm = covariance.poses[0][(5, 5)].sqrt();
    let row = covariance.free.position(Parameter::Fx)?;
    Some(Bound { focal_px, depth_mm, correlation: covariance.cross[0][(row, 5)] / (focal_px * depth_mm) })
}

fn sd(cell: &CellSummary, quantity: &str) -> f64 {
    cell.of(quantity).and_then(|s| s.sd).map_or(f64::NAN, |sd| sd.value)
}

fn correlation(cell: &CellSummary) -> f64 {
    let found = cell.correlations.iter().find(|(a, b, _)| a.name() == "fx" && b.name() == "depth");
    found.map_or(f64::NAN, |r| r.2.value)
}

fn converged(cell: &CellSummary) -> f64 {
    cell.converged().map_or(f64::NAN, |c| c.value)
}

fn report_numbers(record: &mut Record, engine: &Engine, summary: &Summary, bounds: &[Option<Bound>]) {
    for (cell, result) in summary.cells.iter().enumerate() {
        let tilt = tilt_deg(engine, cell);
        let share = Band::absolute(1.5 / result.trials as f64, "one trial that changes sides by a rounding");
        record.group("", share).number(
            format!("converged-{tilt}"),
            converged(result),
            format!("share of trials with a camera, tilt {tilt} deg"),
        );
        let Some(bound) = &bounds[cell] else { continue };
        // Where trials are refused, one that changes sides moves the statistics of the others.
        if converged(result) == 1.0 {
            let band =
                || Band::relative(SOLVER, "the refinement ends within a millionth of a standard deviation");
            record
                .group("px", band())
                .number(format!("sd-fx-{tilt}"), sd(result, "fx"), format!("sd of fx, tilt {tilt} deg"))
                .unit("mm")
                .number(
                    format!("sd-depth-{tilt}"),
                    sd(result, "depth"),
                    format!("sd of the distance, tilt {tilt} deg"),
                )
                .unit("")
                .number(
                    format!("correlation-{tilt}"),
                    correlation(result),
                    format!("correlation of fx and distance, tilt {tilt} deg"),
                );
        }
        let band = || {
            Band::relative(
                1e-7,
                "the normal equations lose as many digits as they have condition, 1e8 at half a degree",
            )
        };
        record
            .group("px", band())
            .number(
                format!("bound-fx-{tilt}"),
                bound.focal_px,
                format!("Cramer-Rao bound of fx, tilt {tilt} deg"),
            )
            .unit("mm")
            .number(
                format!("bound-depth-{tilt}"),
                bound.depth_mm,
                format!("Cramer-Rao bound of the distance, tilt {tilt} deg"),
            )
            .unit("")
            .number(
                format!("bound-correlation-{tilt}"),
                bound.correlation,
                format!("predicted correlation, tilt {tilt} deg"),
            );
    }
}

fn claim_facing_refused(record: &mut Record, summary: &Summary) {
    let refused =
        summary.cells[0].outcomes.iter().find(|o| o.0 == "refused-not-identifiable").map_or(0, |o| o.1);
    record
        .claim_that(
            "facing-refused",
            "three views that face the camera are refused as not identifiable, every time",
        )
        .within(
            refused as f64,
            Interval { low: summary.cells[0].trials as f64, high: summary.cells[0].trials as f64 },
        )
        .because(
            "parallel planes give f / Z only (Zhang 2000, section 4); the solver's test lets one pass in 1e9",
        );
}

fn claim_tilted_solved(record: &mut Record, engine: &Engine, summary: &Summary) {
    let linear = summary.cells.iter().enumerate().filter(|(i, _)| tilt_deg(engine, *i) >= LINEAR_TILT_DEG);
    record
        .claim_that("tilted-solved", "from 6 degrees of tilt every trial gives a camera")
        .every("cells", linear.map(|(_, c)| (c.name.clone(), converged(c) == 1.0)))
        .because("6 degrees move the edge of the target by 5 px, fifty times the noise");
}

fn claim_spread(record: &mut Record, engine: &Engine, summary: &Summary) {
    let quantities = ["fx", "fy", "depth"];
    let linear: Vec<&CellSummary> = summary
        .cells
        .iter()
        .enumerate()
        .filter(|(i, _)| tilt_deg(engine, *i) >= LINEAR_TILT_DEG)
        .map(|(_, c)| c)
        .collect();
    let each = each_of(linear.len() * quantities.len(), FALSE_ALARM);
    let cases = linear.iter().flat_map(|cell| {
        quantities.map(|quantity| {
            let predicted = cell.of(quantity).and_then(|s| s.predicted).map_or(f64::NAN, |p| p.sd);
            let ratio = sd(cell, quantity) / predicted;
            let interval = Interval::of_deviation_ratio(cell.trials as usize, each);
            let range = interval.low * (1.0 - NONLINEARITY)..=interval.high * (1.0 + NONLINEARITY);
            (format!("{quantity}, {}: sd over bound {ratio:.4}", cell.name), range.contains(&ratio))
        })
    });
    record
        .claim_that(
            "bound-attained",
            "from 6 degrees of tilt focal lengths and distance spread as the Cramer-Rao bound says",
        )
        .every("spreads", cases)
        .at_rate(FALSE_ALARM)
        .because("sqrt(chi2 / (n - 1)), all cases together at 1e-4, and 2 % for terms of second order");
}

fn claim_correlation(record: &mut Record, engine: &Engine, summary: &Summary, bounds: &[Option<Bound>]) {
    let linear: Vec<usize> = (0..bounds.len()).filter(|&i| tilt_deg(engine, i) >= LINEAR_TILT_DEG).collect();
    let each = each_of(linear.len(), FALSE_ALARM);
    let cases = linear.iter().map(|&i| {
        let (result, expected) = (&summary.cells[i], bounds[i].as_ref().map_or(f64::NAN, |b| b.correlation));
        let measured = correlation(result);
        let interval = Interval::of_correlation(measured, result.trials as usize, each);
        (
            format!("{}: correlation {measured:.6}, expected {expected:.6}", result.name),
            interval.contains(expected),
        )
    });
    record
        .claim_that("correlation", "focal length and distance err together as the bound predicts")
        .every("cells", cases)
        .at_rate(FALSE_ALARM)
        .because("Fisher's interval of a correlation, all tilts together at 1e-4");
    let least = bounds.iter().flatten().map(|b| b.correlation).fold(f64::INFINITY, f64::min);
    record
        .claim_that(
            "correlated-throughout",
            "even at 30 degrees the errors of focal length and distance go together",
        )
        .at_least(least, 0.9)
        .because(
            "the size of the image gives f / Z at any tilt: with correlation r it is known sqrt(1 - r^2) as \
             badly as f, 0.44 at r = 0.9",
        );
}

/// The bounds at the two tilts between which the law is read off.
fn law_bounds<'a>(
    engine: &Engine,
    bounds: &'a [Option<Bound>],
) -> Result<(&'a Bound, &'a Bound), ExperimentError> {
    let at = |tilt: f64| {
        let bound = (0..bounds.len()).find(|&i| tilt_deg(engine, i) == tilt).and_then(|i| bounds[i].as_ref());
        bound.ok_or_else(|| ExperimentError::Input(format!("no bound at {tilt} deg")))
    };
    Ok((at(LAW_TILTS_DEG.0)?, at(LAW_TILTS_DEG.1)?))
}

/// Slope of `ln sd` over `ln sin(tilt)` between the same two.
fn law_exponent(near: f64, far: f64) -> f64 {
    let run = libm::log(libm::sin(LAW_TILTS_DEG.1.to_radians()) / libm::sin(LAW_TILTS_DEG.0.to_radians()));
    libm::log(far / near) / run
}

/// `d ln sd / d ln sin(tilt) = -2`.
fn claim_law(record: &mut Record, engine: &Engine, bounds: &[Option<Bound>]) -> Result<(), ExperimentError> {
    let (near, far) = law_bounds(engine, bounds)?;
    for (id, what, exponent) in [
        ("fx", "focal length", law_exponent(near.focal_px, far.focal_px)),
        ("depth", "distance", law_exponent(near.depth_mm, far.depth_mm)),
    ] {
        let band = Band::relative(1e-6, "a difference of logarithms of numbers known to 1e-7");
        record.group("", band).number(
            format!("exponent-{id}"),
            exponent,
            format!("slope of ln bound of the {what} over ln sin(tilt), 1 to 4 deg"),
        );
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

fn table(engine: &Engine, summary: &Summary, bounds: &[Option<Bound>]) -> Table {
    let of = |i: usize, value: fn(&Bound) -> f64| bounds[i].as_ref().map_or(f64::NAN, value);
    let caption =
        "Spread of focal length and distance, and their correlation; statistics of converged trials";
    Table::of("tilt", caption, summary.cells.iter().enumerate())
        .column("tilt", "deg", |(i, _)| tilt_deg(engine, *i))
        .column("converged", "", |(_, cell)| converged(cell))
        .column("sd_fx", "px", |(_, cell)| sd(cell, "fx"))
        .column("bound_fx", "px", |(i, _)| of(*i, |b| b.focal_px))
        .column("sd_depth", "mm", |(_, cell)| sd(cell, "depth"))
        .column("bound_depth", "mm", |(i, _)| of(*i, |b| b.depth_mm))
        .column("correlation", "", |(_, cell)| correlation(cell))
        .column("bound_correlation", "", |(i, _)| of(*i, |b| b.correlation))
        .into()
}

fn figure(engine: &Engine, summary: &Summary, bounds: &[Option<Bound>]) -> Result<Figure, ExperimentError> {
    let tilts: Vec<f64> = (0..bounds.len()).map(|i| tilt_deg(engine, i)).collect();
    let curve = |value: &dyn Fn(&Bound) -> f64| -> Vec<(f64, f64)> {
        tilts.iter().zip(bounds).filter_map(|(t, b)| Some((*t, value(b.as_ref()?)))).collect()
    };
    let marks = |value: &dyn Fn(&CellSummary) -> f64| -> Vec<(f64, f64)> {
        tilts
            .iter()
            .zip(&summary.cells)
            .map(|(t, c)| (*t, value(c)))
            .filter(|(t, v)| *t > 0.0 && v.is_finite())
            .collect()
    };
    let spread = |title: &str, unit: &str, bound: &dyn Fn(&Bound) -> f64, quantity: &'static str| {
        let bound = curve(bound);
        let bars: Vec<(f64, f64, f64)> = tilts
            .iter()
            .zip(&summary.cells)
            .filter(|(t, _)| **t > 0.0)
            .filter_map(|(t, c)| c.of(quantity)?.sd.map(|sd| (*t, sd.low, sd.high)))
            .collect();
        // Through the bound where the law is read off.
        let middle = bound.iter().find(|b| b.0 >= LAW_TILTS_DEG.0).copied();
        let (last, value) = middle.unwrap_or((f64::NAN, f64::NAN));
        let sine = |t: f64| libm::sin(t.to_radians());
        let law: Vec<(f64, f64)> = tilts
            .iter()
            .filter(|t| **t > 0.0)
            .map(|t| (*t, value * sine(last) * sine(last) / (sine(*t) * sine(*t))))
            .collect();
        Plot::new(title, "tilt (deg)", format!("standard deviation ({unit})"))
            .size(400.0, 340.0)
            .log_x()
            .log_y()
            .line_as("1/sin\u{b2}(tilt)", &law, Look::ink().dash(Dash::Dotted))
            .line_as("Cramer-Rao bound", &bound, Look::series(0))
            .error_bars_as("", &bars, Look::series(1))
            .points_as("measured", &marks(&|c| sd(c, quantity)), Look::series(1))
    };
    let one_minus: Vec<(f64, f64)> = marks(&|c| 1.0 - correlation(c));
    let panels = [
        spread("Focal length fx", "px", &|b| b.focal_px, "fx"),
        spread("Distance of the first view", "mm", &|b| b.depth_mm, "depth"),
        Plot::new("Correlation of fx and distance", "tilt (deg)", "1 \u{2212} correlation")
            .size(400.0, 340.0)
            .log_x()
            .log_y()
            .line_as("Cramer-Rao bound", &curve(&|b| 1.0 - b.correlation), Look::series(0))
            .points_as("measured", &one_minus, Look::series(1)),
        Plot::new("Trials with a camera", "tilt (deg)", "share of trials")
            .size(400.0, 340.0)
            .line_as(
                "",
                &tilts.iter().zip(&summary.cells).map(|(t, c)| (*t, converged(c))).collect::<Vec<_>>(),
                Look::series(1),
            )
            .y_range(-0.03, 1.03),
    ];
    let (near, far) = law_bounds(engine, bounds)?;
    let nearly_facing = (0..tilts.len()).find(|&i| sd(&summary.cells[i], "fx").is_finite());
    let (steepest, least) = (tilts.len() - 1, nearly_facing.unwrap_or(0));
    let of = |i: usize, value: fn(&Bound) -> f64| bounds[i].as_ref().map_or(f64::NAN, value);
    let caption = format!(
        "Three views at 120 mm tilted alike, 0.1 px of noise, {} trials a tilt, seed {}, 95 % intervals; \
         statistics of the trials that gave a camera. Notice that the bound of fx follows the sine to the \
         power {:.2}, and that 1 \u{2212} correlation falls from {:.1e} at {} deg to {:.1e} at {} deg. At \
         {} deg {:.0} % of the trials gave a camera; fx spreads over them by {:.2} of the bound, since they \
         are a selection.",
        summary.cells[0].trials,
        engine.spec.seed,
        law_exponent(near.focal_px, far.focal_px),
        1.0 - of(steepest, |b| b.correlation),
        tilts[steepest],
        1.0 - of(least, |b| b.correlation),
        tilts[least],
        tilts[least],
        100.0 * converged(&summary.cells[least]),
        sd(&summary.cells[least], "fx") / of(least, |b| b.focal_px)
    );
    Ok(Figure::panels("tilt", &panels, 2, caption))
}
