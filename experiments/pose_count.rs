//! How many views are enough? Accuracy against the number of views, and the law of the root.
//!
//! Expected: views tilted alike in evenly spread directions each add the same information, so the Cramer-Rao
//! bound falls as `1/sqrt(n)` once the directions are spread; the solver attains the bound from three views
//! on.
//!
//! What it cannot show: views that a person takes are not spread evenly, and errors of the target or the lens
//! model, common to all views, do not average out.

use super::sweep::{Sweep, Swept, solver_band, spread_cases};
use calibench::camera::{FreeParameters, Parameter};
use calibench_harness::stats;
use calibench_harness::{Band, Context, Experiment, ExperimentError, Figure, Plot, Record, Rows, Table};

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

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let sweep = Sweep::run(context, &mut record, "study", STUDY, |_| {})?;

    report_numbers(&mut record, &sweep);
    claim_all_converged(&mut record, &sweep);
    claim_bound_attained(&mut record, &sweep);
    claim_root_law(&mut record, &sweep);
    record.table(table(&sweep));
    record.figure(figure(&sweep));
    Ok(record)
}

fn parameters() -> impl Iterator<Item = Parameter> {
    FreeParameters::STANDARD.iter()
}

fn report_numbers(record: &mut Record, sweep: &Sweep) {
    for cell in sweep.cells() {
        let views = cell.level;
        for p in parameters() {
            record
                .group(p.unit(), solver_band())
                .suffix(format!("-{p}-{views}"), format!(" of {p}, {views} views"))
                .number("sd", cell.sd(p.name()), "sd")
                .number("bound", cell.bound(p.name()), "Cramer-Rao bound");
        }
    }
}

fn claim_all_converged(record: &mut Record, sweep: &Sweep) {
    record
        .claim_that("all-converged", "every trial ends in a minimum")
        .every("cells", sweep.cells().map(|cell| (cell.found.name.clone(), cell.converged() == 1.0)))
        .because("20 degrees of tilt determine the camera at 0.1 px");
}

fn claim_bound_attained(record: &mut Record, sweep: &Sweep) {
    let names: Vec<&str> = parameters().map(Parameter::name).collect();
    record
        .claim_that(
            "bound-attained",
            "the spread of every parameter is its Cramer-Rao bound for every number of views",
        )
        .every("spreads", spread_cases(sweep.cells(), &names, FALSE_ALARM, NONLINEARITY))
        .at_rate(FALSE_ALARM)
        .because("sqrt(chi2 / (n - 1)), each of 60 cases at 1e-4 / 60, and 1 % for terms of second order");
}

/// `ln sd = a - b ln n` over the long series.
fn claim_root_law(record: &mut Record, sweep: &Sweep) {
    let long: Vec<Swept> = sweep.cells().filter(|cell| cell.level >= ASYMPTOTIC_VIEWS).collect();
    let logarithms =
        |value: &dyn Fn(&Swept) -> f64| long.iter().map(|cell| libm::log(value(cell))).collect::<Vec<_>>();
    let log_views = logarithms(&|cell| cell.level);
    let slope = |value: &dyn Fn(&Swept) -> f64| stats::slope(&log_views, &logarithms(value));
    let mut cases = Vec::new();
    for p in parameters() {
        let bound = slope(&|cell| cell.bound(p.name()));
        let measured = slope(&|cell| cell.sd(p.name()));
        record
            .group("", Band::relative(1e-5, "a difference of logarithms of numbers known to 1e-6"))
            .number(format!("exponent-bound-{p}"), bound, "slope of ln bound over ln n, n >= 16")
            .number(format!("exponent-{p}"), measured, "slope of ln sd over ln n, n >= 16");
        let low_high = -0.5 - EXPONENT_SLACK..=-0.5 + EXPONENT_SLACK;
        cases.push((format!("{p}: exponent {bound}"), low_high.contains(&bound)));
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

fn table(sweep: &Sweep) -> Rows<impl Sized> {
    let all = sweep.cells().flat_map(|cell| parameters().map(move |p| (cell, p)));
    let rows = all.filter_map(|(cell, p)| Some((cell, p, cell.sd_interval(p.name())?)));
    Table::of("spread", "Standard deviation and Cramer-Rao bound, 95 % intervals", rows)
        .column("views", "", |(cell, ..)| cell.level as i64)
        .column("parameter", "", |(_, p, _)| p.name())
        .column("sd", "unit", |(.., sd)| sd.value)
        .column("sd_low", "unit", |(.., sd)| sd.low)
        .column("sd_high", "unit", |(.., sd)| sd.high)
        .column("bound", "unit", |(cell, p, _)| cell.bound(p.name()))
        .column("unit", "", |(_, p, _)| p.unit())
}

fn figure(sweep: &Sweep) -> Figure {
    let cells: Vec<Swept> = sweep.cells().collect();
    let [first, .., before, last] = &cells[..] else { unreachable!("the study has ten levels") };
    let panel = |p: Parameter| {
        let through_last = |n: f64| last.bound(p.name()) * (last.level / n).sqrt();
        let labels = (p.name(), "views", p.unit());
        sweep.spread_plot(labels, p.name(), ("1/\u{221a}n", through_last))
    };
    let panels: Vec<Plot> = parameters().map(panel).collect();
    let off = cells
        .iter()
        .flat_map(|cell| parameters().map(|p| (cell.sd(p.name()) / cell.bound(p.name()) - 1.0).abs()));
    // The bound before the last, over the law through the last.
    let root = (last.level / before.level).sqrt();
    let of_law = || parameters().map(|p| before.bound(p.name()) / (last.bound(p.name()) * root));
    let caption = format!(
        "Standard deviation of the six parameters against the number of views, {} trials a point with 95 % \
         intervals, seed {}, noise 0.1 px, tilt 20 degrees, distance 120 mm. Notice that no measured one is \
         more than {:.0} % off the bound, from {} views on, and that the bound at {} views is {:.3} to \
         {:.3} of the law of the root drawn through that at {}.",
        sweep.trials(),
        sweep.spec().seed,
        (100.0 * stats::largest(off)).ceil(),
        first.level,
        before.level,
        stats::smallest(of_law()),
        stats::largest(of_law()),
        last.level
    );
    Figure::panels("spread", &panels, 3, caption)
}
