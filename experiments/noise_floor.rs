//! How small should the reprojection error be, and when is it too small?
//!
//! Expected: `RMSE = sigma sqrt(2 (1 - p / 2N))`, under the noise floor `sqrt(2) sigma` because p parameters
//! absorb noise. The distribution is known, so "alarmingly far below the floor" is a quantile of it: a
//! threshold with a false-alarm rate.
//!
//! What it cannot show: an RMSE that is right says nothing about the parameters; with few points RMSE shrinks
//! while their errors grow.

use super::sweep::{Sweep, Swept, at, solver_band};
use calibench::evaluate::RmseDistribution;
use calibench_harness::stats::{self, Interval, each_of, normal_two_sided};
use calibench_harness::{
    Band, Context, Dash, Experiment, ExperimentError, Figure, Look, Plot, Record, Rows, Table,
};
use calibench_study::{Cell as Design, Estimated, Spec, Trial};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "noise-floor",
    title: "The reprojection error and its floor",
    question: "Noise from 0.02 to 0.5 px, 3 to 16 views, and targets of 9 to 221 marks: does the RMSE \
               follow sigma sqrt(2 (1 - p / 2N)), and how far below the noise floor is alarming? Expected: \
               it does, and the 1 % quantile of its distribution raises a false alarm once in a hundred \
               calibrations, wherever it is applied.",
    seed: 21,
    takes_image: false,
    run,
};

const SCENE: &str = r#"
question = "Where does the RMSE settle?"
seed = 0
# Cells draw noise of their own, so that alarms can be counted over all of them.
common_random_numbers = false
scene.image = [640, 480]
scene.camera = { fx = 600.0, fy = 600.0, cx = 326.0, cy = 243.0, k1 = -0.18, k2 = 0.05 }
scene.target = { columns = 9, rows = 7, spacing_mm = 10.0 }
scene.poses = { kind = "spread", views = 4, tilt_deg = 20.0, distance_mm = 120.0 }
scene.noise_px = 0.1
trials = { per_cell = 300, batch = 300 }
"#;

const NOISE_AND_VIEWS: &str = r#"
[[factor]]
name = "noise"
unit = "px"
set = ["scene.noise_px"]
levels = [0.02, 0.05, 0.1, 0.2, 0.5]

[[factor]]
name = "views"
set = ["scene.poses.views"]
levels = [3, 4, 8, 16]
"#;

/// Targets of about 80 x 60 mm.
const MARKS: &str = r#"
[[factor]]
name = "marks"
set = ["scene.target.columns", "scene.target.rows", "scene.target.spacing_mm"]
levels = [[3, 3, 30.0], [4, 3, 26.0], [5, 4, 20.0], [9, 7, 10.0], [17, 13, 5.0]]
labels = ["9", "12", "20", "63", "221"]
"#;

/// Noise that the user overstates: the data have 0.09 px where 0.1 px is assumed.
const OVERSTATED: &str = r#"
[[factor]]
name = "noise"
unit = "px"
set = ["scene.noise_px"]
levels = [0.1, 0.09, 0.08]
"#;

/// Chance that a correct program fails one of the statistical claims.
const FALSE_ALARM: f64 = 1e-4;
/// Rate of the overfitting alarm itself, one calibration in a hundred.
const ALARM_RATE: f64 = 0.01;
/// Terms of second order in the noise, relative: `(sigma / 600 px)` over the tilt's lever, at most 5e-3 at
/// 0.5 px.
const NONLINEARITY: f64 = 0.005;

/// A study, and for each cell how many trials have an RMSE under the alarm threshold.
struct Watched {
    sweep: Sweep,
    alarms: Vec<u64>,
}

/// A cell of it, with the predicted distribution of its RMSE.
struct Cell<'a> {
    swept: Swept<'a>,
    theory: RmseDistribution,
    alarms: u64,
}

impl Watched {
    fn cells(&self) -> Vec<Cell<'_>> {
        let cells = self.sweep.cells().zip(&self.alarms);
        cells.map(|(swept, &alarms)| Cell { swept, theory: predicted(swept.design), alarms }).collect()
    }
}

impl Cell<'_> {
    fn trials(&self) -> u64 {
        self.swept.found.trials
    }

    fn name(&self) -> &str {
        &self.swept.found.name
    }

    fn id(&self) -> String {
        self.swept.found.labels.join("-")
    }

    fn alarm_share(&self) -> f64 {
        self.alarms as f64 / self.trials() as f64
    }
}

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let grid = sweep(context, &mut record, "noise-and-views", NOISE_AND_VIEWS, None)?;
    let marks = sweep(context, &mut record, "marks", MARKS, None)?;
    let overstated = sweep(context, &mut record, "overstated", OVERSTATED, Some(0.1))?;

    for (name, watched) in [("grid", &grid), ("marks", &marks)] {
        claim_mean(&mut record, name, &watched.cells());
        report_means(&mut record, name, &watched.cells());
    }
    claim_alarm_rate(&mut record, &grid.cells());
    claim_power(&mut record, &overstated.cells());
    claim_overfitting(&mut record, &marks.cells());
    record.table(table("rmse-noise-views", grid.cells()));
    record.table(table("rmse-marks", marks.cells()));
    record.table(table("rmse-overstated", overstated.cells()));
    record.figure(floor_figure(&grid));
    record.figure(overfitting_figure(&marks));
    record.figure(alarm_figure());
    Ok(record)
}

/// Runs a study; `assumed_px` is the noise that the alarm assumes, the true one if `None`.
fn sweep(
    context: &Context,
    record: &mut Record,
    name: &str,
    factors: &str,
    assumed_px: Option<f64>,
) -> Result<Watched, ExperimentError> {
    let text = format!("name = \"{name}\"\n{SCENE}{factors}");
    let cells =
        Spec::parse(&text).and_then(|spec| spec.cells(&text)).map_err(ExperimentError::at("study"))?;
    let thresholds: Vec<f64> = cells
        .iter()
        .map(|cell| {
            let own = predicted(cell);
            RmseDistribution { sigma_px: assumed_px.unwrap_or(own.sigma_px), ..own }.quantile_px(ALARM_RATE)
        })
        .collect();
    let mut alarms = vec![0; cells.len()];
    let see = |trial: &Trial| {
        // The first quantity is the RMSE; a trial without one raises no alarm.
        if trial.values[0].is_some_and(|rmse| rmse < thresholds[trial.cell]) {
            alarms[trial.cell] += 1;
        }
    };
    let sweep = Sweep::run(context, record, name, &text, see)?;
    Ok(Watched { sweep, alarms })
}

/// The predicted distribution of a cell's RMSE: six intrinsics, and six pose parameters a view.
fn predicted(cell: &Design) -> RmseDistribution {
    let (views, points) = cell.size();
    RmseDistribution { sigma_px: cell.noise_px(), points: views * points, parameters: 6 + 6 * views }
}

/// The mean of T values of the predicted distribution.
fn claim_mean(record: &mut Record, name: &str, cells: &[Cell]) {
    let over = if name == "grid" { "noise and views" } else { "marks" };
    let each = each_of(cells.len(), FALSE_ALARM);
    let cases = cells.iter().map(|cell| {
        let (mean, theory) = (cell.swept.mean("rmse"), &cell.theory);
        let (expected, sd) = (theory.mean_px(), theory.standard_deviation_px());
        let interval = Interval::of_mean(expected, sd, cell.trials() as usize, each);
        let slack = NONLINEARITY * expected;
        let held = (interval.low - slack..=interval.high + slack).contains(&mean);
        (format!("{}: {mean:.6} px, expected {expected:.6}", cell.name()), held)
    });
    record
        .claim_that(
            format!("mean-rmse-{name}"),
            format!("the mean RMSE is that of sigma sqrt(chi2 / N) with 2N - p degrees of freedom in every cell of the study of {over}"),
        )
        .every("cells", cases)
        .at_rate(FALSE_ALARM)
        .because(
            "central limit over 300 trials, all cells together at 1e-4, and half a percent for terms of \
             second order",
        );
}

fn report_means(record: &mut Record, name: &str, cells: &[Cell]) {
    for cell in cells {
        let over = cell.swept.mean("rmse") / cell.theory.noise_floor_px();
        let what = format!("mean RMSE over sqrt(2) sigma, {}", cell.name());
        record.group("", solver_band()).number(format!("mean-over-floor-{name}-{}", cell.id()), over, what);
    }
}

fn claim_alarm_rate(record: &mut Record, cells: &[Cell]) {
    let trials: u64 = cells.iter().map(Cell::trials).sum();
    let alarms: u64 = cells.iter().map(|cell| cell.alarms).sum();
    let share = alarms as f64 / trials as f64;
    let band = Band::absolute(1.5 / trials as f64, "one trial that changes sides by a rounding");
    record.group("", band).number(
        "false-alarm-share",
        share,
        "share of right calibrations whose RMSE lies under the 1 % threshold, all cells",
    );
    let interval = Interval::around(
        ALARM_RATE,
        normal_two_sided(FALSE_ALARM) * (ALARM_RATE * (1.0 - ALARM_RATE) / trials as f64).sqrt(),
    );
    record
        .claim_that("alarm-rate", "the threshold raises a false alarm in one of a hundred right calibrations")
        .within(share, interval)
        .at_rate(FALSE_ALARM)
        .because("binomial over all trials of the grid, normal approximation at 60 expected alarms");
}

/// Where the noise is overstated, RMSE falls under the threshold as often as theory says.
fn claim_power(record: &mut Record, cells: &[Cell]) {
    let each = each_of(cells.len(), FALSE_ALARM);
    for cell in cells {
        let what = "share of alarms where 0.1 px is assumed and the truth is";
        record.group("", cell.swept.share_band()).number(
            format!("alarm-share-{}", cell.id()),
            cell.alarm_share(),
            format!("{what} {} px", cell.swept.design.noise_px()),
        );
    }
    let cases = cells.iter().map(|cell| {
        let threshold = RmseDistribution { sigma_px: 0.1, ..cell.theory }.quantile_px(ALARM_RATE);
        let power = cell.theory.cdf(threshold);
        let interval = Interval::of_proportion(cell.alarms as usize, cell.trials() as usize, each);
        let (name, alarms, trials) = (cell.name(), cell.alarms, cell.trials());
        (format!("{name}: {alarms} alarms of {trials}, expected share {power:.4}"), interval.contains(power))
    });
    record
        .claim_that(
            "alarm-power",
            "where noise is overstated the alarm rings as often as the distribution says",
        )
        .every("cells", cases)
        .at_rate(FALSE_ALARM)
        .because("Wilson's interval of the share, all together at 1e-4");
}

/// Fewer marks: a smaller RMSE and a larger error.
fn claim_overfitting(record: &mut Record, cells: &[Cell]) {
    let (few, many) = (cells[0].swept, cells[cells.len() - 1].swept);
    let apart = |low: Option<Estimated>, high: Option<Estimated>| {
        low.zip(high).is_some_and(|(low, high)| low.high < high.low)
    };
    let cases = [
        (
            "RMSE with 9 marks lies under that with 221",
            apart(few.mean_interval("rmse"), many.mean_interval("rmse")),
        ),
        (
            "the focal length with 9 marks is worse than with 221",
            apart(many.sd_interval("fx"), few.sd_interval("fx")),
        ),
    ];
    record
        .claim_that(
            "smaller-is-not-better",
            "with fewer marks the RMSE falls and the error of the focal length grows",
        )
        .every("cases", cases)
        .because(
            "9 marks: p/2N = 30/72, RMSE factor 0.76, spread 5 times as wide; both far beyond their 95 % \
             intervals",
        );
}

fn table<'a>(name: &str, cells: Vec<Cell<'a>>) -> Rows<Cell<'a>> {
    Table::of(name, "RMSE against its predicted distribution", cells)
        .column("levels", "", |cell| cell.name().to_string())
        .column("points", "", |cell| cell.theory.points)
        .column("parameters", "", |cell| cell.theory.parameters)
        .column("rmse_mean", "px", |cell| cell.swept.mean("rmse"))
        .column("rmse_predicted", "px", |cell| cell.theory.mean_px())
        .column("rmse_sd", "px", |cell| cell.swept.sd("rmse"))
        .column("rmse_sd_predicted", "px", |cell| cell.theory.standard_deviation_px())
        .column("noise_floor", "px", |cell| cell.theory.noise_floor_px())
        .column("alarm_share", "", Cell::alarm_share)
}

fn floor_figure(grid: &Watched) -> Figure {
    let (cells, factor) = (grid.cells(), &grid.sweep.spec().factor[1]);
    let views = factor.count();
    let over_floor = |cell: &Cell, value: f64| value / cell.theory.noise_floor_px();
    let predicted_factor = |cell: &Cell| over_floor(cell, cell.theory.mean_px());
    // Over the noises: how far the means of each number of views lie apart, and how wide their intervals are.
    let (mut apart, mut widths) = (Vec::new(), Vec::new());
    let mut plot =
        Plot::new("RMSE over the noise floor", "noise sigma (px)", "mean RMSE / (\u{221a}2 sigma)").log_x();
    for v in 0..views {
        let of_views = || cells.iter().skip(v).step_by(views);
        // Side by side, so that bars do not cover each other.
        let noise = |cell: &Cell| cell.theory.sigma_px * (0.94 + 0.04 * v as f64);
        let mean = |cell: &Cell| {
            let mean = cell.swept.mean_interval("rmse")?;
            let [value, low, high] = [mean.value, mean.low, mean.high].map(|px| over_floor(cell, px));
            Some((noise(cell), value, low, high))
        };
        let means: Vec<_> = of_views().filter_map(mean).collect();
        let values = || means.iter().map(|mean| mean.1);
        apart.push(stats::largest(values()) - stats::smallest(values()));
        widths.extend(means.iter().map(|(.., low, high)| high - low));
        let theory = of_views().map(|cell| (noise(cell), predicted_factor(cell)));
        let label = format!("{} views", factor.label(v));
        plot = plot.line_as("", theory, Look::series(v)).measured_as(label, means, Look::series(v));
    }
    let caption = format!(
        "Mean RMSE over the noise floor sqrt(2) sigma against the noise (marks, {} trials, 95 % intervals, \
         seed {}) and its prediction (lines): the mean of sigma / sqrt(N) times chi with 2N - p degrees of \
         freedom, which lies under sigma sqrt(2 (1 - p / 2N)), the root of the mean square, by one part in \
         4 (2N - p). Notice that the factor depends on the views, since 6 + 6n parameters absorb noise: \
         {:.4} is predicted for {} views, {:.4} for {}. From noise to noise the mean of equally many views \
         differs by {:.4} at most, where the intervals are up to {:.4} wide.",
        grid.sweep.trials(),
        grid.sweep.spec().seed,
        predicted_factor(&cells[0]),
        factor.label(0),
        predicted_factor(&cells[views - 1]),
        factor.label(views - 1),
        stats::largest(apart),
        stats::largest(widths)
    );
    Figure::plot("floor", &plot.y_range(0.96, 0.98), caption)
}

fn overfitting_figure(marks: &Watched) -> Figure {
    let cells = marks.cells();
    let share = |cell: &Cell| cell.theory.parameters as f64 / (2 * cell.theory.points) as f64;
    let floor = cells[0].theory.noise_floor_px();
    let curve = (0..=90).map(|i| 0.005 * f64::from(i)).map(|x| (x, floor * (1.0 - x).sqrt()));
    let measured = |of: &dyn Fn(&Swept) -> Option<Estimated>| -> Vec<_> {
        cells.iter().filter_map(|cell| Some(at(share(cell), of(&cell.swept)?))).collect()
    };
    let bound = cells.iter().map(|cell| (share(cell), cell.swept.bound("fx")));
    let panels = [
        Plot::new("RMSE", "parameters per measurement p / 2N", "mean RMSE (px)")
            .size(420.0, 340.0)
            .line_as("\u{221a}2 sigma \u{221a}(1 \u{2212} p/2N)", curve, Look::series(0))
            .measured_as("measured", measured(&|cell| cell.mean_interval("rmse")), Look::series(1))
            .hline_as("noise floor", floor, Look::ink().dash(Dash::Dotted)),
        Plot::new("Focal length", "parameters per measurement p / 2N", "standard deviation of fx (px)")
            .size(420.0, 340.0)
            .line_as("Cramer-Rao bound", bound, Look::series(0))
            .measured_as("measured", measured(&|cell| cell.sd_interval("fx")), Look::series(1)),
    ];
    let factor = &marks.sweep.spec().factor[0];
    let targets: Vec<String> = (0..factor.count()).rev().map(|i| factor.label(i).to_string()).collect();
    let caption = format!(
        "Targets of {} marks, 4 views, 0.1 px of noise, {} trials each, 95 % intervals, seed {}. Notice \
         that the RMSE falls to {:.2} of the noise floor where the standard deviation of fx is {:.1} times \
         that of the largest target: a small residual is no proof of a good calibration.",
        targets.join(", "),
        marks.sweep.trials(),
        marks.sweep.spec().seed,
        cells[0].swept.mean("rmse") / floor,
        cells[0].swept.sd("fx") / cells[cells.len() - 1].swept.sd("fx")
    );
    Figure::panels("overfitting", &panels, 2, caption)
}

/// The threshold against the number of measurements, for several rates.
fn alarm_figure() -> Figure {
    let mut plot =
        Plot::new("How far below the floor is alarming?", "views of 63 marks", "RMSE / (\u{221a}2 sigma)")
            .log_x();
    let of = |views: usize| RmseDistribution { sigma_px: 1.0, points: 63 * views, parameters: 6 + 6 * views };
    let curve = |value: &dyn Fn(&RmseDistribution) -> f64| -> Vec<(f64, f64)> {
        (3..=64).map(|n| (n as f64, value(&of(n)) / of(n).noise_floor_px())).collect()
    };
    plot = plot.line("expected", curve(&|r| r.mean_px()));
    for (rate, label) in [(0.05, "alarm, 5 %"), (0.01, "alarm, 1 %"), (0.001, "alarm, 0.1 %")] {
        plot = plot.line(label, curve(&|r| r.quantile_px(rate)));
    }
    let below = |views: usize| 100.0 * (1.0 - of(views).quantile_px(ALARM_RATE) / of(views).noise_floor_px());
    let caption = format!(
        "Expected RMSE over the noise floor, and the values under which it falls in 5, 1 and 0.1 percent of \
         right calibrations, against the number of views of a 9 x 7 target with six intrinsics free. \
         Nothing is drawn at random. Notice that the RMSE of four views must lie {:.1} percent below the \
         floor, that of 64 views {:.1} percent, to be alarming at 1 %.",
        below(4),
        below(64)
    );
    Figure::plot("alarm", &plot, caption)
}
