//! What did each cell of a study find, along the axis that it sweeps? What experiments share that run a
//! study.

use calibench_harness::stats::{Interval, each_of};
use calibench_harness::{Band, Context, Dash, ExperimentError, Look, Plot, Record};
use calibench_study::{Cell, CellSummary, Engine, Estimated, Spec, Summary, Trial, within};

/// A study that an experiment has run.
pub(crate) struct Sweep {
    pub engine: Engine,
    pub summary: Summary,
}

/// A cell of it: what was asked, and what was found.
#[derive(Clone, Copy)]
pub(crate) struct Swept<'a> {
    /// Level of the study's first factor; NaN where that is no number.
    pub level: f64,
    pub design: &'a Cell,
    pub found: &'a CellSummary,
}

impl Sweep {
    /// Runs a study, `see` is shown every trial.
    pub fn run(
        context: &Context,
        record: &mut Record,
        name: &str,
        text: &str,
        see: impl FnMut(&Trial),
    ) -> Result<Sweep, ExperimentError> {
        let (engine, summary) = within(context, record, name, text, see)?;
        Ok(Sweep { engine, summary })
    }

    pub fn spec(&self) -> &Spec {
        &self.engine.spec
    }

    /// Trials of a cell; all have as many.
    pub fn trials(&self) -> u64 {
        self.summary.cells[0].trials
    }

    pub fn cells(&self) -> impl DoubleEndedIterator<Item = Swept<'_>> + ExactSizeIterator + Clone {
        let factor = &self.spec().factor[0];
        self.engine.cells.iter().zip(&self.summary.cells).map(|(design, found)| Swept {
            level: factor.number(design.levels[0]).unwrap_or(f64::NAN),
            design,
            found,
        })
    }

    /// Standard deviation against the level, on logarithmic axes: a law, the bound, and what was measured.
    pub fn spread_plot(
        &self,
        (title, axis, unit): (&str, &str, &str),
        quantity: &str,
        (name, law): (&str, impl Fn(f64) -> f64),
    ) -> Plot {
        let unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
        // A logarithmic axis has no place for a level of zero.
        let cells = || self.cells().filter(|cell| cell.level > 0.0);
        let dotted = Look::ink().dash(Dash::Dotted);
        Plot::new(title, axis, format!("standard deviation{unit}"))
            .size(400.0, 340.0)
            .log_x()
            .log_y()
            .line_as(name, cells().map(|cell| (cell.level, law(cell.level))), dotted)
            .line_as(
                "Cramer-Rao bound",
                cells().map(|cell| (cell.level, cell.bound(quantity))),
                Look::series(0),
            )
            .measured_as(
                "measured",
                cells().filter_map(|cell| cell.sd_interval(quantity).map(|sd| at(cell.level, sd))),
                Look::series(1),
            )
    }
}

/// A point of a plot with its interval.
pub(crate) fn at(x: f64, measured: Estimated) -> (f64, f64, f64, f64) {
    (x, measured.value, measured.low, measured.high)
}

impl Swept<'_> {
    /// Mean of a quantity, with its interval; `None` where too few trials converged.
    pub fn mean_interval(&self, quantity: &str) -> Option<Estimated> {
        self.found.of(quantity)?.mean
    }

    /// Mean of a quantity; NaN where too few trials converged.
    pub fn mean(&self, quantity: &str) -> f64 {
        self.mean_interval(quantity).map_or(f64::NAN, |mean| mean.value)
    }

    /// Standard deviation of a quantity, with its interval; `None` where too few trials converged.
    pub fn sd_interval(&self, quantity: &str) -> Option<Estimated> {
        self.found.of(quantity)?.sd
    }

    /// Standard deviation of a quantity; NaN where too few trials converged.
    pub fn sd(&self, quantity: &str) -> f64 {
        self.sd_interval(quantity).map_or(f64::NAN, |sd| sd.value)
    }

    /// The Cramer-Rao bound of a quantity; NaN where there is none.
    pub fn bound(&self, quantity: &str) -> f64 {
        self.found.of(quantity).and_then(|s| s.predicted).map_or(f64::NAN, |predicted| predicted.sd)
    }

    /// Share of trials that gave a camera.
    pub fn converged(&self) -> f64 {
        self.found.converged().map_or(f64::NAN, |share| share.value)
    }

    /// Band of a share of the trials.
    pub fn share_band(&self) -> Band {
        Band::absolute(1.5 / self.found.trials as f64, "one trial that changes sides by a rounding")
    }
}

/// Band of what is computed from estimates.
pub(crate) fn solver_band() -> Band {
    Band::relative(1e-6, "the refinement ends within a millionth of a standard deviation")
}

/// The cases of a claim that quantities spread as the bound says: the sample standard deviation over the true
/// one is `sqrt(chi2 / (n - 1))`, all cases together at `false_alarm`; `second_order` is what terms of second
/// order in the noise may add, relative.
pub(crate) fn spread_cases<'a>(
    cells: impl IntoIterator<Item = Swept<'a>>,
    quantities: &[&str],
    false_alarm: f64,
    second_order: f64,
) -> Vec<(String, bool)> {
    let cells: Vec<Swept> = cells.into_iter().collect();
    let each = each_of(cells.len() * quantities.len(), false_alarm);
    let case = |cell: &Swept, quantity: &str| {
        let ratio = cell.sd(quantity) / cell.bound(quantity);
        let chance = Interval::of_deviation_ratio(cell.found.trials as usize, each);
        let (low, high) = (chance.low * (1.0 - second_order), chance.high * (1.0 + second_order));
        (
            format!("{quantity}, {}: {ratio:.4} of the bound, not in [{low:.4}, {high:.4}]", cell.found.name),
            (low..=high).contains(&ratio),
        )
    };
    cells.iter().flat_map(|cell| quantities.iter().map(move |quantity| case(cell, quantity))).collect()
}
