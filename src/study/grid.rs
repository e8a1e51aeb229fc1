//! What do all figures of a study share? Its cells along one factor, the quantities in them, and what a
//! caption says of the trials.

use super::engine::Engine;
use super::quantity::Quantity;
use super::summary::{Statistic, Summary};

/// Axes that span more than this are logarithmic.
const WIDE: f64 = 4.0;

/// A study, to be drawn.
pub(super) struct Grid<'a> {
    pub engine: &'a Engine,
    pub summary: &'a Summary,
}

/// Cells that differ in the level of the x factor only, in its order.
pub(super) struct Series {
    pub label: String,
    pub cells: Vec<usize>,
}

impl Grid<'_> {
    /// The numeric factor with most levels.
    pub fn x_factor(&self) -> Option<usize> {
        let factors = &self.engine.spec.factor;
        (0..factors.len())
            .filter(|&f| factors[f].is_numeric())
            .max_by_key(|&f| (factors[f].count(), usize::MAX - f))
    }

    pub fn series(&self, x: usize) -> Vec<Series> {
        let mut found: Vec<Series> = Vec::new();
        for cell in &self.engine.cells {
            let rest = |separator: &str| {
                let others =
                    self.engine.spec.factor.iter().zip(&cell.labels).enumerate().filter(|(f, _)| *f != x);
                others
                    .map(|(_, (f, label))| format!("{} {label}", f.name))
                    .collect::<Vec<_>>()
                    .join(separator)
            };
            let label = rest(", ");
            match found.iter_mut().find(|s| s.label == label) {
                Some(series) => series.cells.push(cell.index),
                None => found.push(Series { label, cells: vec![cell.index] }),
            }
        }
        found
    }

    pub fn x_of(&self, x: usize, cell: usize) -> f64 {
        self.engine.spec.factor[x].number(self.engine.cells[cell].levels[x]).unwrap_or(f64::NAN)
    }

    pub fn x_label(&self, x: usize) -> String {
        let factor = &self.engine.spec.factor[x];
        if factor.unit.is_empty() {
            factor.name.clone()
        } else {
            format!("{} ({})", factor.name, factor.unit)
        }
    }

    /// What is no error: RMSE, NEES, sizes of displacements.
    pub fn others(&self) -> impl Iterator<Item = Quantity> {
        self.engine.quantities.iter().copied().filter(|q| !q.is_error())
    }

    pub fn errors(&self) -> impl Iterator<Item = Quantity> {
        self.engine.quantities.iter().copied().filter(|q| q.is_error())
    }

    pub fn statistic(&self, cell: usize, quantity: Quantity) -> Option<&Statistic> {
        self.summary.cells[cell].of(quantity.name())
    }

    /// What the bars of a plot are.
    pub fn bars(&self) -> String {
        format!("Bars are {} % intervals.", libm::round(1e6 * self.engine.spec.confidence) / 1e4)
    }

    pub fn caption(&self, what: &str) -> String {
        let spec = &self.engine.spec;
        let trials: Vec<u64> = self.summary.cells.iter().map(|c| c.trials).collect();
        let (least, most) =
            (trials.iter().min().copied().unwrap_or(0), trials.iter().max().copied().unwrap_or(0));
        let trials = if least == most { format!("{most}") } else { format!("{least} to {most}") };
        format!(
            "{what} {trials} trials a cell, seed {}. Statistics are of the trials that converged.",
            spec.seed
        )
    }
}

/// Whether values span so much that their axis is logarithmic.
pub(super) fn wide(values: &[f64]) -> bool {
    let (low, high) = values.iter().fold((f64::INFINITY, 0.0f64), |(l, h), v| (l.min(*v), h.max(*v)));
    low > 0.0 && high > WIDE * low
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::STUDY;
    use crate::{Shard, summarise};

    #[test]
    fn an_axis_is_logarithmic_where_positive_values_span_more_than_four_times_the_least() {
        assert!(wide(&[4.1, 1.0]) && wide(&[0.01, 0.02, 1.0]));
        for narrow in [&[1.0, 4.0][..], &[0.0, 5.0], &[-1.0, 5.0], &[3.0], &[]] {
            assert!(!wide(narrow), "{narrow:?}");
        }
    }

    #[test]
    fn figures_have_the_numeric_factor_of_most_levels_along_x_and_a_series_for_the_others() {
        let text = STUDY.to_string()
            + "\n[[factor]]\nname = \"views\"\nset = [\"scene.poses.views\"]\nlevels = [3, 4, 5]\n"
            + "\n[[factor]]\nname = \"tilt\"\nset = [\"scene.poses.tilt_deg\"]\nlevels = [25.0, 30.0, 35.0]\n";
        let engine = Engine::new(&text, Shard::WHOLE).unwrap();
        let summary = summarise(&engine);
        let grid = Grid { engine: &engine, summary: &summary };
        assert_eq!(grid.x_factor(), Some(1), "the first of those with three");
        let series: Vec<(String, Vec<usize>)> =
            grid.series(1).into_iter().map(|series| (series.label, series.cells)).collect();
        // Cells count tilts fastest, then views, then noise.
        let expected = [("noise 0.1, tilt 25.0", [0, 3, 6]), ("noise 0.1, tilt 30.0", [1, 4, 7])];
        for ((label, cells), (name, indices)) in series.iter().zip(expected) {
            assert_eq!((label.as_str(), &cells[..]), (name, &indices[..]));
        }
        assert_eq!(series.len(), 6);
        assert_eq!([0, 3, 6].map(|cell| grid.x_of(1, cell)), [3.0, 4.0, 5.0]);
    }

    #[test]
    fn every_quantity_is_an_error_or_none() {
        let engine = Engine::new(STUDY, Shard::WHOLE).unwrap();
        let summary = summarise(&engine);
        let grid = Grid { engine: &engine, summary: &summary };
        let others: Vec<&str> = grid.others().map(Quantity::name).collect();
        let errors: Vec<&str> = grid.errors().map(Quantity::name).collect();
        assert_eq!(others, ["rmse", "nees"]);
        assert_eq!(errors, ["fx", "fy", "cx", "cy", "k1", "k2", "depth"]);
        assert_eq!(grid.bars(), "Bars are 95 % intervals.");
    }
}
