//! How many views are enough? Accuracy against the number of views, and the law of the root.
//!
//! Expected: views tilted alike in evenly spread directions each add the same information, so the Cramer-Rao
//! bound falls as `1/sqrt(n)` once the directions are spread; the solver attains the bound from three views
//! on.
//!
//! What it cannot show: views that a person takes are not spread evenly, and errors of the target or the lens
//! model, common to all views, do not average out.

use calibench::camera::{FreeParameters, Parameter};
use calibench_harness::stats::{self, Interval, each_of};
use calibench_harness::{
    Band, Context, Dash, Experiment, ExperimentError, Figure, Look, Plot, Record, Table,
};
use calibench_study::{CellSummary, Engine, Summary, within};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "pose-count",
    title: "Accuracy against the number of views",
    question: "A 9 x 7 target is photographed 3 to 64 times, tilted by 20 degrees in directions that follow \
               the golden angle, with 0.1 px of noise. How do the standard deviations of the six parameters \
               fall, and does the solver attain the Cramer-Rao bound? Expected: as one over the root of the \
               number of views, and yes.",
    seed: 20,
    takes_image: false,
    run,
};

const STUDY: &str = r#"
name = "pose-count"
question = "How does accuracy grow with the number of views?"
seed = 0
# Cells draw noise of their own, so that they can be judged together.
common_random_numbers = false
scene.image = [640, 480]
scene.camera = { fx = 600.0, fy = 600.0, cx = 326.0, cy = 243.0, k1 = -0.18, k2 = 0.05 }
scene.target = { columns = 9, rows = 7, spacing_mm = 10.0 }
scene.poses = { kind = "spread", views = 3, tilt_deg = 20.0, distance_mm = 120.0 }
scene.noise_px = 0.1
trials = { per_cell = 400, batch = 400 }

[[factor]]
name = "views"
set = ["scene.poses.views"]
levels = [3, 4, 6, 8, 12, 16, 24, 32, 48, 64]
"#;

/// Chance that a correct program fails one of the statistical claims.
const FALSE_ALARM: f64 = 1e-4;
/// The first view count of the asymptotic law. The directions' sums of second order, which the information
/// needs to be isotropic, are bounded while the number of views grows: a part `c / n` of the information,
/// with c near 1.
const ASYMPTOTIC_VIEWS: f64 = 16.0;
/// Half of that part, doubled: the exponent between 16 and 64 views may miss -1/2 by `(1/16) / ln 4`.
const EXPONENT_SLACK: f64 = 0.045;
/// Terms of second order in the noise: the bound is of first order, and sd(f)/f is about 2e-3 with three
/// views; a hundredth covers ten times that.
const NONLINEARITY: f64 = 0.01;
/// The refinement ends within a millionth of a standard deviation of the minimum.
const SOLVER: f64 = 1e-6;

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let (engine, summary) = within(context, &mut record, "study", STUDY, |_| {})?;

    report_numbers(&mut record, &engine, &summary);
    claim_all_converged(&mut record, &summary);
    claim_bound_attained(&mut record, &summary);
    claim_root_law(&mut record, &engine, &summary);
    record.table(table(&engine, &summary));
    record.figure(figure(&engine, &summary));
    Ok(record)
}

fn views(engine: &Engine, cell: usize) -> f64 {
    engine.spec.factor[0].number(engine.cells[cell].levels[0]).unwrap_or(f64::NAN)
}

/// `(measured, bound)` standard deviation; NaN where nothing converged.
fn spread(cell: &CellSummary, parameter: Parameter) -> (f64, f64) {
    let statistic = cell.of(parameter.name());
    let sd = statistic.and_then(|s| s.sd).map_or(f64::NAN, |sd| sd.value);
    (sd, statistic.and_then(|s| s.predicted).map_or(f64::NAN, |p| p.sd))
}

fn parameters() -> impl Iterator<Item = Parameter> {
    FreeParameters::STANDARD.iter()
}

fn report_numbers(record: &mut Record, engine: &Engine, summary: &Summary) {
    for (cell, result) in summary.cells.iter().enumerate() {
        for parameter in parameters() {
            let (sd, bound) = spread(result, parameter);
            let band =
                || Band::relative(SOLVER, "the refinement ends within a millionth of a standard deviation");
            let n = views(engine, cell);
            let what = format!("Cramer-Rao bound of {parameter}, {n} views");
            record
                .group(parameter.unit(), band())
                .number(format!("sd-{parameter}-{n}"), sd, format!("sd of {parameter}, {n} views"))
                .number(format!("bound-{parameter}-{n}"), bound, what);
        }
    }
}

fn claim_all_converged(record: &mut Record, summary: &Summary) {
    let cases = summary.cells.iter().map(|c| (c.name.clone(), c.converged().is_some_and(|s| s.value == 1.0)));
    record
        .claim_that("all-converged", "every trial ends in a minimum")
        .every("cells", cases)
        .because("20 degrees of tilt determine the camera at 0.1 px");
}

/// The sample standard deviation over the true one is `sqrt(chi2 / (n - 1))`.
fn claim_bound_attained(record: &mut Record, summary: &Summary) {
    let family = summary.cells.len() * parameters().count();
    let cases = summary.cells.iter().flat_map(|cell| {
        parameters().map(move |parameter| {
            let (sd, bound) = spread(cell, parameter);
            let interval = Interval::of_deviation_ratio(cell.trials as usize, each_of(family, FALSE_ALARM));
            let (low, high) = (interval.low * (1.0 - NONLINEARITY), interval.high * (1.0 + NONLINEARITY));
            let ratio = sd / bound;
            (
                format!("{parameter}, {}: {ratio:.4} not in [{low:.4}, {high:.4}]", cell.name),
                (low..=high).contains(&ratio),
            )
        })
    });
    record
        .claim_that(
            "bound-attained",
            "the spread of every parameter is its Cramer-Rao bound for every number of views",
        )
        .every("spreads", cases)
        .at_rate(FALSE_ALARM)
        .because("sqrt(chi2 / (n - 1)), each of 60 cases at 1e-4 / 60, and 1 % for terms of second order");
}

/// `ln sd = a - b ln n` over the long series.
fn claim_root_law(record: &mut Record, engine: &Engine, summary: &Summary) {
    let long: Vec<usize> =
        (0..summary.cells.len()).filter(|&c| views(engine, c) >= ASYMPTOTIC_VIEWS).collect();
    let log_views: Vec<f64> = long.iter().map(|&c| libm::log(views(engine, c))).collect();
    let slope = |value: &dyn Fn(usize) -> f64| {
        stats::slope(&log_views, &long.iter().map(|&c| libm::log(value(c))).collect::<Vec<_>>())
    };
    let mut cases = Vec::new();
    for parameter in parameters() {
        let band = || Band::relative(1e-5, "a difference of logarithms of numbers known to 1e-6");
        let bound = slope(&|c| spread(&summary.cells[c], parameter).1);
        let measured = slope(&|c| spread(&summary.cells[c], parameter).0);
        record
            .group("", band())
            .number(format!("exponent-bound-{parameter}"), bound, "slope of ln bound over ln n, n >= 16")
            .number(format!("exponent-{parameter}"), measured, "slope of ln sd over ln n, n >= 16");
        let low_high = -0.5 - EXPONENT_SLACK..=-0.5 + EXPONENT_SLACK;
        cases.push((format!("{parameter}: exponent {bound}"), low_high.contains(&bound)));
    }
    // That the measured spreads follow is no claim of its own: they are at the bound for every number of
    // views.
    record
        .claim_that(
            "root-law",
            "the bound falls as one over the root of the number of views: exponents within 0.045 of -1/2",
        )
        .every("parameters", cases)
        .because("equal views add equal information; uneven directions leave a part 1/n of it, n >= 16");
}

fn table(engine: &Engine, summary: &Summary) -> Table {
    let columns = [
        ("views", ""),
        ("parameter", ""),
        ("sd", "unit"),
        ("sd_low", "unit"),
        ("sd_high", "unit"),
        ("bound", "unit"),
        ("unit", ""),
    ];
    let mut table = Table::new("spread", "Standard deviation and Cramer-Rao bound, 95 % intervals", &columns);
    for (cell, result) in summary.cells.iter().enumerate() {
        for parameter in parameters() {
            let Some(sd) = result.of(parameter.name()).and_then(|s| s.sd) else { continue };
            let bound = spread(result, parameter).1;
            use calibench_harness::Cell;
            table.push([
                Cell::Integer(views(engine, cell) as i64),
                parameter.name().into(),
                sd.value.into(),
                sd.low.into(),
                sd.high.into(),
                bound.into(),
                parameter.unit().into(),
            ]);
        }
    }
    table
}

fn figure(engine: &Engine, summary: &Summary) -> Figure {
    let panel = |parameter: Parameter| {
        let unit =
            if parameter.unit().is_empty() { String::new() } else { format!(" ({})", parameter.unit()) };
        let at = |cell: usize| views(engine, cell);
        let all = || summary.cells.iter().enumerate();
        let bound: Vec<(f64, f64)> = all().map(|(i, c)| (at(i), spread(c, parameter).1)).collect();
        let sds: Vec<(f64, f64)> = all().map(|(i, c)| (at(i), spread(c, parameter).0)).collect();
        let bars: Vec<(f64, f64, f64)> = all()
            .filter_map(|(i, c)| c.of(parameter.name())?.sd.map(|sd| (at(i), sd.low, sd.high)))
            .collect();
        // Through the last bound.
        let last = bound[bound.len() - 1];
        let law: Vec<(f64, f64)> = bound.iter().map(|(n, _)| (*n, last.1 * (last.0 / n).sqrt())).collect();
        Plot::new(parameter.name(), "views", format!("standard deviation{unit}"))
            .size(400.0, 340.0)
            .log_x()
            .log_y()
            .line_as("1/\u{221a}n", &law, Look::ink().dash(Dash::Dotted))
            .line_as("Cramer-Rao bound", &bound, Look::series(0))
            .error_bars_as("", &bars, Look::series(1))
            .points_as("measured", &sds, Look::series(1))
    };
    let panels: Vec<Plot> = parameters().map(panel).collect();
    let off = summary.cells.iter().flat_map(|cell| {
        parameters().map(|parameter| spread(cell, parameter)).map(|(sd, bound)| (sd / bound - 1.0).abs())
    });
    // The bound before the last, over the law through the last.
    let last = summary.cells.len() - 1;
    let of_law = || {
        let root = (views(engine, last) / views(engine, last - 1)).sqrt();
        let bound = |cell: usize, p: Parameter| spread(&summary.cells[cell], p).1;
        parameters().map(move |p| bound(last - 1, p) / (bound(last, p) * root))
    };
    let caption = format!(
        "Standard deviation of the six parameters against the number of views, {} trials a point with 95 % \
         intervals, seed {}, noise 0.1 px, tilt 20 degrees, distance 120 mm. Notice that no measured one is \
         more than {:.0} % off the bound, from {} views on, and that the bound at {} views is {:.3} to \
         {:.3} of the law of the root drawn through that at {}.",
        summary.cells[0].trials,
        engine.spec.seed,
        (100.0 * stats::largest(off)).ceil(),
        views(engine, 0),
        views(engine, last - 1),
        stats::smallest(of_law()),
        stats::largest(of_law()),
        views(engine, last)
    );
    Figure::panels("spread", &panels, 3, caption)
}
