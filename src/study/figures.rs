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

    /// Shares of trials that converged, where not all did. A part of a study may have none of a cell.
    fn endings(&self, x: usize) -> Option<Figure> {
        let converged = |cell: usize| self.summary.cells[cell].converged();
        let all = (0..self.summary.cells.len()).all(|cell| converged(cell).is_none_or(|c| c.value == 1.0));
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
    use crate::{Expected, Shard, Spec, Trial, in_memory, summarise};
    use std::collections::BTreeMap;

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

    /// The study after four trials a cell, whose values are these multiples of the bound for an error and of
    /// the expected mean for what is none; every other cell has the second four.
    fn after(text: &str, multiples: [[f64; 4]; 2]) -> Engine {
        let mut engine = Engine::new(text, Shard::WHOLE).unwrap();
        for (cell, tally) in engine.cells.iter().zip(&mut engine.tallies) {
            for (trial, multiple) in multiples[cell.index % 2].into_iter().enumerate() {
                let of =
                    |p: &Option<Expected>| p.map(|p| multiple * if p.mean == 0.0 { p.sd } else { p.mean });
                let values = cell.prediction.0.iter().map(of).collect();
                let (cell, trial) = (cell.index, trial as u64);
                tally.add(&Trial { cell, trial, outcome: "converged".into(), iterations: 1, values });
            }
        }
        engine
    }

    fn svg(figure: &Figure) -> String {
        String::from_utf8(figure.bytes.clone()).unwrap()
    }

    #[test]
    fn every_cell_of_a_heat_map_has_its_number_written_in() {
        // Means 2 and -0.75; standard deviations 3 sqrt(4 / 3) and 0.3 of that.
        let engine = after(STUDY, [[-1.0, 5.0, -1.0, 5.0], [-1.65, 0.15, -1.65, 0.15]]);
        let figures = Grid { engine: &engine, summary: &summarise(&engine) }.by_cell();
        let names: Vec<&str> = figures.iter().map(|figure| &figure.name[..]).collect();
        assert_eq!(names, ["ratio", "bias", "means"]);
        // Seven errors, RMSE and NEES.
        for (figure, [first, second], rows) in [
            (&figures[0], ["3.46", "1.04"], 7),
            (&figures[1], ["2.00", "0.750"], 7),
            (&figures[2], ["2.00", "\u{2212}0.750"], 2),
        ] {
            let count = |number| svg(figure).lines().filter(|line| *line == number).count();
            assert!(count(first) >= rows && count(second) >= rows, "{}", svg(figure));
        }
    }

    #[test]
    fn a_cell_in_which_nothing_converged_stands_at_zero() {
        let mut engine = after(STUDY, [[1.0, 2.0, 3.0, 4.0]; 2]);
        let shares = |engine: &Engine| Grid { engine, summary: &summarise(engine) }.endings(0);
        assert_eq!(shares(&engine), None);
        engine.tallies[1] = engine.for_shard(Shard::WHOLE).tallies.remove(1);
        let (outcome, values) = ("stalled".to_string(), vec![None; engine.quantities.len()]);
        engine.tallies[1].add(&Trial { cell: 1, trial: 0, outcome, iterations: 1, values });
        let svg = svg(&shares(&engine).unwrap());
        // The axis holds no share and all of them.
        let ends = ["0.0", "1.0"].map(|end| svg.lines().filter(|line| *line == end).count());
        assert_eq!(ends, [1, 1], "{svg}");
    }

    #[test]
    fn errors_are_drawn_beside_the_quantiles_of_a_normal_distribution() {
        let (alone, _) = STUDY.split_once("[[factor]]").unwrap();
        let engine = after(alone, [[-1.0, 1.0, -2.0, 2.0]; 2]);
        let svg = svg(&Grid { engine: &engine, summary: &summarise(&engine) }.distributions());
        let curves = svg.split("points=\"").map(|rest| {
            let numbers = rest.split('"').next().unwrap().split([',', ' ']);
            numbers.filter_map(|number| number.parse().ok()).collect::<Vec<f64>>()
        });
        let curves: Vec<Vec<f64>> = curves.filter(|numbers| numbers.len() == 2 * 99).collect();
        assert_eq!(curves.len(), 7, "one an error");
        for curve in curves {
            let at = |percent: usize| [curve[2 * percent - 2], curve[2 * percent - 1]];
            // As many trials lie below the median as above.
            let [[left, _], [middle, median], [right, _]] = [1, 50, 99].map(at);
            assert!(right - left > 1000.0 && (left + right - 2.0 * middle).abs() <= 2.0);
            // One in a hundred lies 2.3263 standard deviations below it or above, 16 lie 0.9945 below.
            let [low, lower, high] = [16, 1, 99].map(|percent| at(percent)[1] - median);
            assert!((lower / low - 2.3263 / 0.9945).abs() < 0.02 && (lower + high).abs() <= 2.0);
        }
    }

    #[test]
    fn the_numbers_of_neighbouring_cells_do_not_run_into_each_other() {
        let tilts: Vec<f64> = (0..12).map(|i| 20.0 + f64::from(i)).collect();
        let factor = "\n[[factor]]\nname = \"tilt\"\nset = [\"scene.poses.tilt_deg\"]\n";
        let text = format!("{STUDY}{factor}levels = {tilts:?}\n");
        let engine = after(&text, [[-1.0, 5.0, -1.0, 5.0], [-1.65, 0.15, -1.65, 0.15]]);
        let summary = summarise(&engine);
        let grid = Grid { engine: &engine, summary: &summary };
        for (figure, columns) in [(grid.maps().unwrap(), 12), (grid.by_cell().remove(0), 24)] {
            let svg = svg(&figure);
            let mut rows: BTreeMap<&str, Vec<(f64, usize)>> = BTreeMap::new();
            for text in svg.split("<text ").filter(|text| text.contains("anchor=\"middle\"")) {
                let fields: Vec<&str> = text.split('"').collect();
                let number = text.lines().nth(1).unwrap();
                if number.parse::<f64>().is_ok() {
                    rows.entry(fields[3]).or_default().push((fields[1].parse().unwrap(), number.len()));
                }
            }
            assert!(rows.len() >= 2 && rows.values().all(|row| row.len() >= columns), "{rows:?}");
            for pair in rows.values().flat_map(|row| row.windows(2)) {
                // A digit of this font is 0.636 of its size wide, of 11.5 px on a canvas ten times as fine.
                let width = 0.636 * 115.0 * pair[0].1.max(pair[1].1) as f64;
                assert!(pair[1].0 - pair[0].0 > width, "{pair:?}");
            }
        }
    }
}
