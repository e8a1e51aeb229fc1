//! How does a reader see a study? Spread against its bound over the factors, and how trials ended where some
//! failed.

use super::engine::Engine;
use super::grid::{Grid, wide};
use super::moments::Estimated;
use super::panels::{Panel, Shows};
use super::quantity::Quantity;
use super::summary::{CellSummary, SHARES, Statistic, Summary};
use calibench::evaluate::distribution::normal_quantile;
use calibench_harness::{Dash, Figure, HeatMap, Look, Plot};

/// Series beyond this number cannot be told apart in one plot.
const MOST_SERIES: usize = 6;
/// Width of a page on a desktop, px: three panels of 400.
const PAGE: f64 = 1200.0;
/// All figures of a study.
pub(super) fn draw(engine: &Engine, summary: &Summary) -> Vec<Figure> {
    let grid = Grid { engine, summary };
    let mut figures = Vec::new();
    match grid.x_factor() {
        _ if engine.spec.factor.is_empty() => figures.push(grid.distributions()),
        Some(x) if grid.series(x).len() <= MOST_SERIES => {
            for (shows, panels) in grid.all_panels(x) {
                let plots: Vec<Plot> = panels.into_iter().map(|panel| panel.plot).collect();
                let columns = plots.len().min(3);
                figures.push(Figure::panels(shows.figure(), &plots, columns, grid.caption_of(shows)));
            }
            figures.extend(grid.endings(x));
        }
        _ => figures.extend(grid.by_cell()),
    }
    if engine.spec.factor.len() == 2 {
        figures.extend(grid.maps());
    }
    figures
}

/// The figure that shows one quantity alone, by its name: `spread/fx`.
pub(super) struct Alone {
    pub name: String,
    pub figure: Figure,
}

/// Every panel as a figure of its own; none where the study has no numeric factor, or too many series for one
/// plot.
pub(super) fn panels(engine: &Engine, summary: &Summary) -> Vec<Alone> {
    let grid = Grid { engine, summary };
    let Some(x) = grid.x_factor().filter(|&x| grid.series(x).len() <= MOST_SERIES) else { return Vec::new() };
    let alone = |shows: Shows, panel: Panel| {
        let figure = Figure::plot(panel.name.replace('/', "-"), &panel.plot, grid.caption_of(shows));
        Alone { name: panel.name, figure }
    };
    let all = grid.all_panels(x).into_iter();
    all.flat_map(|(shows, panels)| panels.into_iter().map(move |panel| (shows, panel)))
        .map(|(shows, panel)| alone(shows, panel))
        .collect()
}

impl Grid<'_> {
    /// What is drawn of errors and of the others: where the noise varies, every number over what the bound
    /// expects, which is proportional to the noise and spans as many decades.
    fn shown(&self, x: usize) -> [Shows; 3] {
        let is_noise = self.engine.spec.factor[x].set.iter().any(|path| path == "scene.noise_px");
        match is_noise {
            true => [Shows::SpreadOverBound, Shows::Bias, Shows::MeanOverExpected],
            false => [Shows::Spread, Shows::Bias, Shows::Mean],
        }
    }

    /// Every panel, by figures.
    fn all_panels(&self, x: usize) -> Vec<(Shows, Vec<Panel>)> {
        let series = self.series(x);
        let errors: Vec<Quantity> = self.errors().collect();
        let others: Vec<Quantity> = self.others().collect();
        let [spread, bias, means] = self.shown(x);
        [(spread, &errors), (bias, &errors), (means, &others)]
            .into_iter()
            .map(|(shows, of)| (shows, self.panels(x, &series, shows, of)))
            .filter(|(_, panels)| !panels.is_empty())
            .collect()
    }

    fn caption_of(&self, shows: Shows) -> String {
        let what = match shows {
            Shows::Spread => {
                "Standard deviation of the error of each quantity (marks) and its Cramer-Rao bound (lines), which holds for Gaussian noise \
                 without gross errors. Notice where the marks leave the line."
            }
            Shows::SpreadOverBound => {
                "Standard deviation of the error of each quantity over its Cramer-Rao bound, which is proportional to the noise. Notice where the \
                 marks leave 1: from there first-order theory no longer holds."
            }
            Shows::Bias => {
                "Mean error of each quantity in units of its Cramer-Rao bound. Notice the intervals that do not hold 0: there a mean over many \
                 calibrations would keep an error."
            }
            Shows::Mean => {
                "Means (marks) and what theory expects of them (lines). Notice NEES above its line: there the covariance that a calibration \
                 reports is too small."
            }
            Shows::MeanOverExpected => {
                "Means over what theory expects of them. Notice NEES above 1: there the covariance that a calibration reports is too small, so \
                 many times."
            }
        };
        let together = match self.engine.spec.common_random_numbers {
            true if shows != Shows::Spread => " Cells share their draws, so that marks move together.",
            _ => "",
        };
        self.caption(&format!("{what} {}{together}", self.bars()))
    }

    /// Shares of trials that converged, where not all did.
    fn endings(&self, x: usize) -> Option<Figure> {
        let converged = |cell: usize| self.summary.cells[cell].converged();
        let all = (0..self.summary.cells.len()).all(|cell| converged(cell).is_some_and(|c| c.value == 1.0));
        if all {
            return None;
        }
        let mut plot = Plot::new("Trials that converged", self.x_label(x), "share of trials");
        let mut all_x = Vec::new();
        for (i, s) in self.series(x).iter().enumerate() {
            let values: Vec<(f64, Estimated)> =
                s.cells.iter().filter_map(|&cell| Some((self.x_of(x, cell), converged(cell)?))).collect();
            let bars: Vec<(f64, f64, f64)> = values.iter().map(|(x, v)| (*x, v.low, v.high)).collect();
            let points: Vec<(f64, f64)> = values.iter().map(|(x, v)| (*x, v.value)).collect();
            plot = plot.line_as(s.label.clone(), &points, Look::series(i)).error_bars_as(
                "",
                &bars,
                Look::series(i),
            );
            all_x.extend(values.iter().map(|v| v.0));
        }
        let plot = if wide(&all_x) { plot.log_x() } else { plot }.y_range(-0.02, 1.02);
        Some(Figure::plot(
            "converged",
            &plot,
            self.caption(&format!(
                "Share of trials that found a minimum; the others are counted by reason. {}",
                self.bars()
            )),
        ))
    }

    /// Every cell a column, every quantity a row.
    fn by_cell(&self) -> Vec<Figure> {
        let columns: Vec<String> = self.summary.cells.iter().map(|c| c.labels.join(", ")).collect();
        let (errors, others): (Vec<Quantity>, Vec<Quantity>) =
            (self.errors().collect(), self.others().collect());
        let ratio = self.matrix(&errors, &columns, "sd / bound", |_, s| s.ratio.map(|r| r.value));
        let bias = self
            .matrix(&errors, &columns, "|bias| / bound", |_, s| Some(s.mean?.value.abs() / s.predicted?.sd));
        let means =
            self.matrix(&others, &columns, "mean / expected", |_, s| Some(s.mean?.value / s.predicted?.mean));
        [("ratio", "Spread over its Cramer-Rao bound: 1 is the best that is possible.", ratio),
         ("bias", "Size of the bias in units of the Cramer-Rao bound: what is wrong with the model, not with the noise.", bias),
         ("means", "Means over what theory expects of them. NEES above 1: the covariance that a calibration reports is too small, so many times.", means)]
            .into_iter()
            .filter_map(|(name, what, plot)| Some(Figure::plot(name, &plot?, self.caption(what))))
            .collect()
    }

    fn matrix(
        &self,
        rows: &[Quantity],
        columns: &[String],
        label: &str,
        value: impl Fn(&CellSummary, &Statistic) -> Option<f64>,
    ) -> Option<Plot> {
        let values: Vec<f64> = rows
            .iter()
            .flat_map(|q| self.summary.cells.iter().map(move |c| (q, c)))
            .map(|(q, c)| c.of(q.name()).and_then(|s| value(c, s)).unwrap_or(f64::NAN))
            .collect();
        let names = rows.iter().map(|q| q.name().to_string()).collect();
        let heat = HeatMap::new(label, columns.to_vec(), names, values).ok()?.digits(3);
        let width = 160.0 + 110.0 * columns.len() as f64;
        let x_label = self.engine.spec.factor.iter().map(|f| f.name.as_str()).collect::<Vec<_>>().join(", ");
        Some(Plot::heat_map(label, x_label, "quantity", heat).size(width.max(520.0), 400.0))
    }

    /// Two factors across and up: the spread of each estimated quantity.
    fn maps(&self) -> Option<Figure> {
        let [across, up] = [&self.engine.spec.factor[1], &self.engine.spec.factor[0]];
        let labels = |f: &super::factor::Factor| (0..f.count()).map(|l| f.label(l)).collect::<Vec<_>>();
        let width = (170.0 + 62.0 * across.count() as f64).max(400.0);
        let panels: Vec<Plot> = self
            .errors()
            .filter_map(|q| {
                let sd =
                    |cell: usize| self.statistic(cell, q).and_then(|s| s.sd).map_or(f64::NAN, |sd| sd.value);
                let values: Vec<f64> = (0..self.summary.cells.len()).map(sd).collect();
                let unit = if q.unit().is_empty() { String::new() } else { format!(" ({})", q.unit()) };
                let heat = HeatMap::new(format!("sd{unit}"), labels(across), labels(up), values).ok()?;
                let heat = heat.logarithmic();
                let named = |f: &super::factor::Factor| {
                    if f.unit.is_empty() { f.name.clone() } else { format!("{} ({})", f.name, f.unit) }
                };
                let title = format!("{} error", q.name());
                Some(Plot::heat_map(title, named(across), named(up), heat).size(width, 340.0))
            })
            .collect();
        let columns = ((PAGE / width) as usize).clamp(1, panels.len().max(1));
        (!panels.is_empty()).then(|| {
            Figure::panels(
                "map",
                &panels,
                columns,
                self.caption("Standard deviation of the error of each quantity over both factors."),
            )
        })
    }

    /// Without factors: the distribution of each error against the predicted normal one.
    fn distributions(&self) -> Figure {
        let panel = |quantity: Quantity| {
            let unit =
                if quantity.unit().is_empty() { String::new() } else { format!(" ({})", quantity.unit()) };
            let title = format!("{} error", quantity.name());
            let mut plot =
                Plot::new(title, "share of trials below", format!("error{unit}")).size(400.0, 320.0);
            let Some(s) = self.statistic(0, quantity) else { return plot };
            if let Some(predicted) = s.predicted {
                let curve: Vec<(f64, f64)> = (1..100)
                    .map(|p| (0.01 * f64::from(p), predicted.sd * normal_quantile(0.01 * f64::from(p))))
                    .collect();
                plot = plot.line_as("predicted", &curve, Look::series(0));
            }
            let known: Vec<(f64, Estimated)> =
                s.quantiles.iter().filter_map(|(p, q)| Some((*p, (*q)?))).collect();
            let bars: Vec<(f64, f64, f64)> = known.iter().map(|(p, q)| (*p, q.low, q.high)).collect();
            let points: Vec<(f64, f64)> = known.iter().map(|(p, q)| (*p, q.value)).collect();
            plot.error_bars_as("", &bars, Look::series(1)).points_as(
                "measured",
                &points,
                Look::series(1).dash(Dash::Solid),
            )
        };
        let panels: Vec<Plot> = self.errors().map(panel).collect();
        let what = format!(
            "Quantiles of the errors at the shares {SHARES:?}, and those of a normal distribution with the Cramer-Rao bound's spread. {}",
            self.bars()
        );
        Figure::panels("errors", &panels, panels.len().min(3), self.caption(&what))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::STUDY;
    use crate::{Spec, in_memory, summarise};

    #[test]
    fn few_series_are_drawn_over_the_factor_and_many_cell_by_cell() {
        let drawn = |text: &str| -> Vec<String> {
            let engine = in_memory(Spec::parse(text).unwrap(), text, |_| {}).unwrap();
            draw(&engine, &summarise(&engine)).into_iter().map(|figure| figure.name).collect()
        };
        let one = STUDY.replace("per_cell = 3", "per_cell = 8");
        let names = drawn(&one);
        assert!(
            names.iter().any(|name| name == "spread") && names.iter().all(|name| name != "ratio"),
            "{names:?}"
        );
        // Of four factors of two levels one is the axis, and the others make eight series.
        let factor = |name: &str, levels: &str| {
            format!("\n[[factor]]\nname = \"{name}\"\nset = [\"scene.{name}\"]\nlevels = {levels}\n")
        };
        let more = [
            ("camera.fx", "[600.0, 610.0]"),
            ("camera.cx", "[320.0, 321.0]"),
            ("poses.distance_mm", "[150.0, 160.0]"),
        ];
        let four = more.iter().fold(one, |text, (name, levels)| text + &factor(name, levels));
        let names = drawn(&four);
        assert!(
            names.iter().any(|name| name == "ratio") && names.iter().all(|name| name != "spread"),
            "{names:?}"
        );
    }
}
