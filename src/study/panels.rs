//! What does one panel of a study's figures show? One quantity against the x factor: its spread, its bias, or
//! its mean, beside what theory expects.

use super::grid::{Grid, Series, wide};
use super::moments::Estimated;
use super::quantity::Quantity;
use super::summary::Statistic;
use calibench_harness::{Look, Plot};

/// What is drawn of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shows {
    /// Standard deviation of an error, and the bound.
    Spread,
    /// Standard deviation of an error over the bound: where the bound itself spans decades, these hide what
    /// is left.
    SpreadOverBound,
    /// Mean of an error over the bound.
    Bias,
    /// Mean of what is no error, and the mean expected.
    Mean,
    /// The same over the mean expected.
    MeanOverExpected,
}

/// One panel under its name, such as `bias/fx`.
pub(super) struct Panel {
    pub name: String,
    pub plot: Plot,
}

/// Width and height of a panel, px.
const SIZE: (f64, f64) = (400.0, 320.0);

impl Shows {
    /// Name of the figure.
    pub fn figure(self) -> &'static str {
        match self {
            Shows::Spread | Shows::SpreadOverBound => "spread",
            Shows::Bias => "bias",
            Shows::Mean | Shows::MeanOverExpected => "means",
        }
    }

    fn y_label(self, quantity: Quantity) -> String {
        let unit = if quantity.unit().is_empty() { String::new() } else { format!(" ({})", quantity.unit()) };
        match self {
            Shows::Spread => format!("sd{unit}"),
            Shows::SpreadOverBound => "sd / bound".to_string(),
            Shows::Bias => "bias / bound".to_string(),
            Shows::Mean => format!("mean{unit}"),
            Shows::MeanOverExpected => "mean / expected".to_string(),
        }
    }

    /// What was measured.
    fn measured(self, of: &Statistic) -> Option<Estimated> {
        let over = |estimated: Option<Estimated>, unit: f64| {
            (unit > 0.0).then_some(estimated).flatten().map(|e| e.scaled(1.0 / unit))
        };
        match self {
            Shows::Spread => of.sd,
            Shows::SpreadOverBound => of.ratio,
            Shows::Bias => over(of.mean, of.predicted?.sd),
            Shows::Mean => of.mean,
            Shows::MeanOverExpected => over(of.mean, of.predicted?.mean),
        }
    }

    /// What theory expects, where it differs from cell to cell.
    fn expected(self, of: &Statistic) -> Option<f64> {
        match self {
            Shows::Spread => Some(of.predicted?.sd),
            Shows::Mean => Some(of.predicted?.mean),
            _ => None,
        }
    }

    /// What theory expects of every cell.
    fn everywhere(self) -> Option<(&'static str, f64)> {
        match self {
            Shows::SpreadOverBound => Some(("bound", 1.0)),
            Shows::Bias => Some(("no bias", 0.0)),
            Shows::MeanOverExpected => Some(("expected", 1.0)),
            Shows::Spread | Shows::Mean => None,
        }
    }
}

impl Grid<'_> {
    /// A panel for each quantity of which something was measured.
    pub fn panels(&self, x: usize, series: &[Series], shows: Shows, of: &[Quantity]) -> Vec<Panel> {
        of.iter().filter_map(|quantity| self.panel(x, series, shows, *quantity)).collect()
    }

    fn panel(&self, x: usize, series: &[Series], shows: Shows, quantity: Quantity) -> Option<Panel> {
        let (mut all_x, mut all_y) = (Vec::new(), Vec::new());
        let what = if quantity.is_error() { " error" } else { "" };
        let title = format!("{}{what}", quantity.name());
        let mut plot = Plot::new(title, self.x_label(x), shows.y_label(quantity)).size(SIZE.0, SIZE.1);
        if let Some((label, y)) = shows.everywhere() {
            plot = plot.hline(label, y);
        }
        let label = if shows == Shows::Mean { "expected" } else { "bound" };
        for (i, s) in series.iter().enumerate() {
            let at = |cell: &usize| Some((self.x_of(x, *cell), self.statistic(*cell, quantity)?));
            let values: Vec<(f64, &Statistic)> = s.cells.iter().filter_map(at).collect();
            let expected: Vec<(f64, f64)> =
                values.iter().filter_map(|(x, v)| Some((*x, shows.expected(v)?))).collect();
            let found: Vec<(f64, Estimated)> =
                values.iter().filter_map(|(x, v)| Some((*x, shows.measured(v)?))).collect();
            let look = Look::series(i);
            let bars: Vec<(f64, f64, f64)> = found.iter().map(|(x, e)| (*x, e.low, e.high)).collect();
            let points: Vec<(f64, f64)> = found.iter().map(|(x, e)| (*x, e.value)).collect();
            let name = if s.label.is_empty() { "measured".to_string() } else { s.label.clone() };
            if !expected.is_empty() {
                plot = plot.line_as(if i == 0 { label } else { "" }, &expected, look);
            }
            plot = plot.error_bars_as("", &bars, look).points_as(name, &points, look);
            all_x.extend(values.iter().map(|v| v.0));
            all_y.extend(points.iter().chain(&expected).map(|p| p.1));
        }
        if wide(&all_x) {
            plot = plot.log_x();
        }
        if shows != Shows::Bias && wide(&all_y) {
            plot = plot.log_y();
        }
        let name = format!("{}/{}", shows.figure(), quantity.name());
        (!all_y.is_empty()).then_some(Panel { name, plot })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::STUDY;
    use crate::{Engine, Expected, Shard, summarise};
    use calibench_harness::Figure;

    #[test]
    fn a_panel_shows_its_statistic_in_units_of_what_is_expected() {
        let estimated = |value: f64| Estimated { value, low: value - 1.0, high: value + 1.0 };
        let statistic = Statistic {
            quantity: Quantity::Depth,
            count: 9,
            mean: Some(estimated(3.0)),
            sd: Some(estimated(5.0)),
            rms: None,
            quantiles: Vec::new(),
            predicted: Some(Expected { mean: 4.0, sd: 2.0 }),
            ratio: Some(estimated(2.5)),
            ratio_jointly: None,
        };
        let values = |shows: Shows| (shows.measured(&statistic).unwrap(), shows.expected(&statistic));
        assert_eq!(values(Shows::Spread), (estimated(5.0), Some(2.0)));
        assert_eq!(values(Shows::Mean), (estimated(3.0), Some(4.0)));
        assert_eq!(values(Shows::SpreadOverBound), (estimated(2.5), None));
        // A mean of 2 to 4, over a bound of 2 and over a mean of 4.
        let over = |low, value, high| (Estimated { value, low, high }, None);
        assert_eq!(values(Shows::Bias), over(1.0, 1.5, 2.0));
        assert_eq!(values(Shows::MeanOverExpected), over(0.5, 0.75, 1.0));
        let unknown = Statistic { predicted: None, ..statistic };
        assert_eq!((Shows::Bias.measured(&unknown), Shows::Mean.expected(&unknown)), (None, None));
    }

    #[test]
    fn what_theory_expects_is_drawn_by_its_name() {
        // A factor that is not the noise, so that every kind of panel can be drawn.
        let text = STUDY
            .replace("scene.noise_px\"]", "scene.poses.distance_mm\"]")
            .replace("[0.1, 0.3]", "[150, 160]");
        let mut engine = Engine::new(&text, Shard::WHOLE).unwrap();
        for tally in &mut engine.tallies {
            for x in [1.0, 2.0, 3.0, 4.0] {
                tally.moments.iter_mut().for_each(|moments| moments.add(x));
            }
        }
        let grid = Grid { engine: &engine, summary: &summarise(&engine) };
        let named = |shows: Shows, quantity: &str| -> Vec<String> {
            let quantity = engine.quantities.iter().find(|q| q.name() == quantity).unwrap();
            let panel = grid.panel(0, &grid.series(0), shows, *quantity).unwrap();
            let svg = String::from_utf8(Figure::plot("one", &panel.plot, "").bytes).unwrap();
            let names = svg.lines().filter(|line| ["bound", "no bias", "expected"].contains(line));
            names.map(String::from).collect()
        };
        assert_eq!(named(Shows::Spread, "fx"), ["bound"]);
        assert_eq!(named(Shows::SpreadOverBound, "fx"), ["bound"]);
        assert_eq!(named(Shows::Bias, "fx"), ["no bias"]);
        assert_eq!(named(Shows::Mean, "rmse"), ["expected"]);
        assert_eq!(named(Shows::MeanOverExpected, "rmse"), ["expected"]);
        let of = |shows: Shows| shows.everywhere().map(|(_, y)| y);
        assert_eq!(
            [Shows::SpreadOverBound, Shows::Bias, Shows::MeanOverExpected].map(of),
            [1.0, 0.0, 1.0].map(Some)
        );
        assert_eq!([Shows::Spread, Shows::Mean].map(of), [None, None], "it differs from cell to cell");
    }
}
