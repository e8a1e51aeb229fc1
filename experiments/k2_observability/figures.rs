//! The figures of the observability experiment: maps over coverage and tilt, and sections through them.

use super::*;
use calibench_harness::{Dash, Figure, HeatMap, Look, Plot};

/// Confidence of the intervals drawn at the trials.
const SHOWN: f64 = 0.05;
/// Tilts and coverages of the sections.
const SECTION_TILTS: [u32; 3] = [5, 20, 45];
const SECTION_TENTHS: [u32; 4] = [3, 5, 7, 10];

const MAP_NOTE: &str = "Coverage is the fraction of the way to the image's border that the points reach in \
                        every view, tilt the chapter's 20 degrees replaced.";

fn map_plot(
    map: &Map,
    title: &str,
    label: &str,
    style: impl Fn(HeatMap) -> HeatMap,
    value: impl Fn(&Node) -> f64,
) -> Result<Plot, ExperimentError> {
    let columns = COVERAGE_TENTHS.map(|c| format!("{:.1}", f64::from(c) / 10.0)).to_vec();
    let rows = TILT_DEG.map(|t| t.to_string()).to_vec();
    let heat = HeatMap::new(label, columns, rows, map.nodes.iter().map(value).collect())
        .map_err(ExperimentError::at("heat map"))?;
    Ok(Plot::heat_map(title, "coverage (fraction of the way to the border)", "tilt (deg)", style(heat))
        .size(560.0, 360.0))
}

fn three_digits(heat: HeatMap) -> HeatMap {
    heat.digits(3)
}

/// Colours over the values that the RMSE of a single calibration takes, so that flat looks flat.
fn as_wide_as_one_draw(heat: HeatMap) -> HeatMap {
    heat.digits(4).range(0.12, 0.15)
}

/// Blank where first-order theory does not apply.
fn where_identifiable(value: impl Fn(&Node) -> f64) -> impl Fn(&Node) -> f64 {
    move |n| if n.is_identifiable() { value(n) } else { f64::NAN }
}

pub fn heat_maps(map: &Map, seed: u64) -> Result<Figure, ExperimentError> {
    let bound = |p: Parameter| move |n: &Node| n.bound_sd(p);
    let [k2, fx] = ["standard deviation of k2 (bound)", "standard deviation of fx (bound, px)"];
    let [correlation, rmse] = ["correlation of k1 and k2 (bound)", "mean RMSE of the trials (px)"];
    let panels = [
        map_plot(map, "k2", k2, HeatMap::logarithmic, bound(Parameter::K2))?,
        map_plot(map, "fx", fx, HeatMap::logarithmic, bound(Parameter::Fx))?,
        map_plot(map, "k1 and k2", correlation, three_digits, Node::bound_correlation)?,
        map_plot(map, "RMSE", rmse, as_wide_as_one_draw, Node::sampled_rmse_px)?,
    ];
    let caption = format!(
        "Bound of k2 and fx, correlation of k1 and k2, and mean RMSE of {TRIALS} trials (noise {SIGMA_PX} \
         px, seed {seed}) over coverage and tilt; a dash where there is none. {MAP_NOTE} More coverage \
         means a nearer target here. Notice that, where the bound of fx is below {:.0} %, that of k2 \
         changes by a factor of {:.0}, that of fx by {:.0}, and the RMSE by {:.3} (its colours span what \
         single calibrations scatter over).",
        100.0 * FIRST_ORDER,
        map.range(|n| n.bound_sd(Parameter::K2)),
        map.range(|n| n.bound_sd(Parameter::Fx)),
        map.range(Node::sampled_rmse_px)
    );
    Ok(Figure::panels("maps", &panels, 2, caption))
}

pub fn ratios(map: &Map, seed: u64) -> Result<Figure, ExperimentError> {
    let panel = |p: Parameter| {
        let over = where_identifiable(move |n: &Node| n.sd_over_bound(p));
        let title = format!("{p} against the bound");
        map_plot(map, &title, "spread of the trials / bound", three_digits, over)
    };
    let panels = [panel(Parameter::K2)?, panel(Parameter::Fx)?];
    let scatter = |p: Parameter| {
        let nodes = map.identifiable();
        let ratios: Vec<f64> = nodes.iter().map(|n| n.sd_over_bound(p)).collect();
        let mean = stats::mean(&ratios);
        (mean, stats::root_mean_square(ratios.iter().map(|ratio| ratio - mean)))
    };
    let (k2, fx) = (scatter(Parameter::K2), scatter(Parameter::Fx));
    let caption = format!(
        "Spread of {TRIALS} trials over the Cramer-Rao bound (noise {SIGMA_PX} px, seed {seed}). A dash \
         where the bound of fx exceeds {:.0} %, and without tilt, where {} of {} trials are refused. \
         {MAP_NOTE} Notice that the ratios of k2 have mean {:.3} and standard deviation {:.3}, those of fx \
         {:.3} and {:.3}; chance makes 1 and {:.3}.",
        100.0 * FIRST_ORDER,
        map.trials_without_tilt() - map.converged_without_tilt(),
        map.trials_without_tilt(),
        k2.0,
        k2.1,
        fx.0,
        fx.1,
        (0.5 / (TRIALS - 1) as f64).sqrt()
    );
    Ok(Figure::panels("against-the-bound", &panels, 2, caption))
}

/// Bounds as lines, trials as points with intervals, one series a level.
fn sections<'a, L: Copy>(
    plot: Plot,
    levels: &[(L, String)],
    parameter: Parameter,
    nodes: impl Fn(L) -> Vec<(f64, &'a Node)>,
) -> Plot {
    levels.iter().enumerate().fold(plot, |plot, (i, (level, name))| {
        let look = Look::series(i);
        let nodes = nodes(*level);
        let bound = nodes.iter().map(|(x, n)| (*x, n.bound_sd(parameter)));
        let complete = nodes.iter().filter(|(_, n)| n.outcome.converged() == TRIALS);
        let points: Vec<_> = complete.map(|(x, n)| (*x, n.sampled_sd(parameter))).collect();
        let ratio = Interval::of_deviation_ratio(TRIALS, SHOWN);
        let bars = points.iter().map(|(x, sd)| (*x, sd / ratio.high, sd / ratio.low));
        plot.line_as(name, bound, look).points_as("", &points, look).error_bars_as("", bars, look)
    })
}

pub fn k2_sections(map: &Map, seed: u64) -> Figure {
    let levels = SECTION_TILTS.map(|t| (t, format!("tilt {t}\u{b0}")));
    let plot = Plot::new(
        "k2 against coverage",
        "coverage (fraction of the way to the border)",
        "standard deviation of k2",
    )
    .log_y();
    let plot = sections(plot, &levels, Parameter::K2, |t| {
        COVERAGE_TENTHS.iter().map(|&c| map.at(c, t)).map(|n| (n.coverage(), n)).collect()
    });
    let sd = |tenths: u32, tilt_deg: u32| map.at(tenths, tilt_deg).bound_sd(Parameter::K2);
    let falls = || SECTION_TILTS.iter().map(|&t| sd(COVERAGE_TENTHS[0], t) / sd(10, t));
    let caption = format!(
        "Standard deviation of k2 against coverage: Cramer-Rao bound (lines) and {TRIALS} trials (points \
         with 95 % intervals; noise {SIGMA_PX} px, seed {seed}). {MAP_NOTE} Notice that between a target in \
         the middle and one that fills the image the bound falls by a factor of {:.0} to {:.0}, by tilt.",
        stats::smallest(falls()),
        stats::largest(falls())
    );
    Figure::plot("k2-sections", &plot, caption)
}

pub fn focal_sections(map: &Map, seed: u64) -> Figure {
    let levels = SECTION_TENTHS.map(|c| (c, format!("coverage {:.1}", f64::from(c) / 10.0)));
    let plot = Plot::new("Focal length against tilt", "tilt (deg)", "standard deviation of fx (px)").log_y();
    let plot = sections(plot, &levels, Parameter::Fx, |c| {
        TILT_DEG.iter().map(|&t| (f64::from(t), map.at(c, t))).collect()
    });
    let sd = |tenths: u32, tilt_deg: u32| map.at(tenths, tilt_deg).bound_sd(Parameter::Fx);
    let grows = || SECTION_TENTHS.iter().map(|&c| sd(c, TILT_DEG[1]) / sd(c, TILT_DEG[TILT_DEG.len() - 1]));
    let caption = format!(
        "Standard deviation of fx against tilt: Cramer-Rao bound (lines) and {TRIALS} trials (points with \
         95 % intervals, where none was refused; noise {SIGMA_PX} px, seed {seed}). {MAP_NOTE} Notice that \
         it grows {:.0} to {:.0} times from {} to {} degrees of tilt, by coverage, and that of {} trials \
         without tilt {} give a camera.",
        stats::smallest(grows()),
        stats::largest(grows()),
        TILT_DEG[TILT_DEG.len() - 1],
        TILT_DEG[1],
        map.trials_without_tilt(),
        map.converged_without_tilt()
    );
    Figure::plot("focal-sections", &plot, caption)
}

pub fn rmse_sections(map: &Map, seed: u64) -> Figure {
    let any = map.at(COVERAGE_TENTHS[0], 20);
    let (mean, sd) = (any.rmse.mean_px(), any.rmse.standard_deviation_px());
    let around = Interval::of_mean(mean, sd, TRIALS, SHOWN);
    let (first, last) = (0.28, 1.02);
    let plot =
        Plot::new("RMSE against coverage", "coverage (fraction of the way to the border)", "mean RMSE (px)")
            .x_range(first, last)
            .y_range(0.134, 0.143)
            .band_as(
                "predicted, 95 %",
                [(first, around.low, around.high), (last, around.low, around.high)],
                Look::ink(),
            );
    let plot = SECTION_TILTS.iter().enumerate().fold(plot, |plot, (i, &t)| {
        let nodes = COVERAGE_TENTHS.map(|c| map.at(c, t));
        let points: Vec<_> = nodes.iter().map(|n| (n.coverage(), n.sampled_rmse_px())).collect();
        plot.line_as(format!("tilt {t}\u{b0}"), &points, Look::series(i).width(0.9)).points_as(
            "",
            &points,
            Look::series(i),
        )
    });
    let plot =
        plot.hline_as("noise floor", any.rmse.noise_floor_px(), Look::ink().dash(Dash::Dotted).width(2.0));
    let caption = format!(
        "Mean RMSE of {TRIALS} trials against coverage, with the interval that holds 95 % of such means if \
         the model is right (noise {SIGMA_PX} px, seed {seed}). {MAP_NOTE} Notice that its largest value is \
         {:.3} of its smallest, while the bound of k2 changes by a factor of {:.0}.",
        map.range(Node::sampled_rmse_px),
        map.range(|n| n.bound_sd(Parameter::K2))
    );
    Figure::plot("rmse-sections", &plot, caption)
}
