//! What do the trials of a cell say? Every number with its interval, beside what theory expects.

use super::accumulate::Tally;
use super::engine::Engine;
use super::expected::Expected;
use super::moments::Estimated;
use super::quantity::Quantity;
use super::sketch::Sketch;
use calibench::evaluate::Interval;
use calibench::evaluate::distribution::normal_two_sided;
use calibench::evaluate::interval::each_of;
use calibench_harness::Cell as Entry;
use calibench_harness::Table;

/// A study's results.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    /// One a cell.
    pub cells: Vec<CellSummary>,
    /// Confidence of the intervals.
    pub confidence: f64,
}

/// The results of a cell.
#[derive(Debug, Clone, PartialEq)]
pub struct CellSummary {
    /// Name of the cell.
    pub name: String,
    /// Labels of its levels.
    pub labels: Vec<String>,
    /// Trials, failed ones included.
    pub trials: u64,
    /// Outcome, number of trials, and share of all trials with its interval (Wilson 1927).
    pub outcomes: Vec<(String, u64, Estimated)>,
    /// One a quantity of the study.
    pub statistics: Vec<Statistic>,
    /// Correlation of the errors of two quantities, with its interval (Fisher 1921).
    pub correlations: Vec<(Quantity, Quantity, Estimated)>,
}

/// What converged trials say of one quantity. `None` where too few trials have it.
#[derive(Debug, Clone, PartialEq)]
pub struct Statistic {
    /// Of what.
    pub quantity: Quantity,
    /// Values.
    pub count: u64,
    /// Mean; of an error, the bias.
    pub mean: Option<Estimated>,
    /// Standard deviation.
    pub sd: Option<Estimated>,
    /// Root mean square; of an error, about the truth.
    pub rms: Option<Estimated>,
    /// Share, and the value that so many stay below.
    pub quantiles: Vec<(f64, Option<Estimated>)>,
    /// What theory expects.
    pub predicted: Option<Expected>,
    /// Standard deviation over the predicted one.
    pub ratio: Option<Estimated>,
    /// The same with the interval widened so that all such intervals of the study hold together with its
    /// confidence (Bonferroni), whether or not its cells are independent.
    pub ratio_jointly: Option<Estimated>,
}

/// Shares whose quantiles are told.
pub const SHARES: [f64; 5] = [0.025, 0.25, 0.5, 0.75, 0.975];

/// Summarises a study as far as it is done.
pub fn summarise(engine: &Engine) -> Summary {
    let false_alarm = 1.0 - engine.spec.confidence;
    let one = |cell: &super::Cell| {
        let tally = &engine.tallies[cell.index];
        CellSummary {
            name: cell.name.clone(),
            labels: cell.labels.clone(),
            trials: tally.trials,
            outcomes: outcomes(tally, false_alarm),
            statistics: engine
                .quantities
                .iter()
                .enumerate()
                .map(|(q, &quantity)| statistic(quantity, q, tally, cell.prediction.0[q], false_alarm))
                .collect(),
            correlations: correlations(&engine.quantities, tally, false_alarm),
        }
    };
    let mut cells: Vec<CellSummary> = engine.cells.iter().map(one).collect();
    widen(&mut cells, &engine.tallies, false_alarm);
    Summary { cells, confidence: engine.spec.confidence }
}

/// Fills in [`Statistic::ratio_jointly`].
fn widen(cells: &mut [CellSummary], tallies: &[Tally], false_alarm: f64) {
    let judged = cells.iter().flat_map(|cell| &cell.statistics).filter(|s| s.ratio.is_some()).count();
    let each = each_of(judged, false_alarm);
    for (cell, tally) in cells.iter_mut().zip(tallies) {
        for (statistic, moments) in cell.statistics.iter_mut().zip(&tally.moments) {
            let predicted = statistic.predicted.filter(|_| statistic.ratio.is_some());
            statistic.ratio_jointly =
                predicted.and_then(|p| Some(moments.sd_interval(each)?.scaled(1.0 / p.sd)));
        }
    }
}

fn outcomes(tally: &Tally, false_alarm: f64) -> Vec<(String, u64, Estimated)> {
    let share = |count: u64| {
        let interval = Interval::of_proportion(count as usize, tally.trials as usize, false_alarm);
        let value = count as f64 / tally.trials as f64;
        // The interval holds its estimate but for a rounding, which shows at 0 and 1.
        Estimated { value, low: interval.low.min(value), high: interval.high.max(value) }
    };
    let mut counts = tally.outcomes.clone();
    // Said even where nothing converged.
    counts.entry(super::trial::CONVERGED.to_string()).or_default();
    if tally.trials == 0 {
        return Vec::new();
    }
    counts.into_iter().map(|(outcome, count)| (outcome, count, share(count))).collect()
}

fn statistic(
    quantity: Quantity,
    q: usize,
    tally: &Tally,
    predicted: Option<Expected>,
    false_alarm: f64,
) -> Statistic {
    let moments = &tally.moments[q];
    let sd = moments.sd_interval(false_alarm);
    let ratio = predicted.filter(|p| p.sd > 0.0).and_then(|p| Some(sd?.scaled(1.0 / p.sd)));
    Statistic {
        quantity,
        count: moments.count(),
        mean: moments.mean_interval(false_alarm),
        sd,
        rms: moments.rms_interval(false_alarm),
        quantiles: SHARES
            .map(|share| (share, quantile(&tally.sketches[q], tally.origins[q], share, false_alarm)))
            .to_vec(),
        predicted,
        ratio,
        ratio_jointly: None,
    }
}

/// A quantile, and the values at the ranks between which the true one lies: their number below it is binomial
/// (normal approximation). `None` where a rank would lie outside the sample.
fn quantile(sketch: &Sketch, origin: f64, share: f64, false_alarm: f64) -> Option<Estimated> {
    let n = sketch.total() as f64;
    let middle = n * share;
    let half = normal_two_sided(false_alarm) * (n * share * (1.0 - share)).sqrt();
    let rank = |x: f64| if x >= 1.0 { sketch.of_rank(x as u64).map(|v| origin + v) } else { None };
    Some(Estimated {
        value: rank(libm::ceil(middle))?,
        low: rank(libm::floor(middle - half))?,
        high: rank(libm::ceil(middle + half) + 1.0)?,
    })
}

fn correlations(
    quantities: &[Quantity],
    tally: &Tally,
    false_alarm: f64,
) -> Vec<(Quantity, Quantity, Estimated)> {
    let joint = &tally.joint;
    let errors: Vec<usize> =
        (0..tally.joint_of.len()).filter(|&i| quantities[tally.joint_of[i]].is_error()).collect();
    if joint.count() < 4 {
        return Vec::new();
    }
    let mut found = Vec::new();
    for (k, &i) in errors.iter().enumerate() {
        for &j in &errors[k + 1..] {
            let value = joint.correlation(i, j);
            if value.abs() < 1.0 {
                let interval = Interval::of_correlation(value, joint.count(), false_alarm);
                let estimated = Estimated { value, low: interval.low, high: interval.high };
                found.push((quantities[tally.joint_of[i]], quantities[tally.joint_of[j]], estimated));
            }
        }
    }
    found
}

impl CellSummary {
    /// What is said of a quantity.
    pub fn of(&self, name: &str) -> Option<&Statistic> {
        self.statistics.iter().find(|s| s.quantity.name() == name)
    }

    /// Share of trials that converged.
    pub fn converged(&self) -> Option<Estimated> {
        self.outcomes.iter().find(|o| o.0 == super::trial::CONVERGED).map(|o| o.2)
    }
}

impl Summary {
    /// The tables `summary`, `outcomes` and `correlations`.
    pub fn tables(&self) -> [Table; 3] {
        [self.statistics_table(), self.outcomes_table(), self.correlations_table()]
    }

    fn statistics_table(&self) -> Table {
        let mut columns: Vec<String> =
            ["cell", "levels", "quantity", "unit", "count"].map(String::from).to_vec();
        let quantiles = SHARES.map(|share| format!("q{}", 1000.0 * share));
        let estimated = ["mean", "sd", "rms"].into_iter().map(String::from).chain(quantiles);
        columns.extend(estimated.flat_map(with_ends));
        columns.extend(["predicted_mean", "predicted_sd"].map(String::from));
        columns.extend(with_ends("sd_over_predicted".to_string()));
        let columns: Vec<(&str, &str)> = columns.iter().map(|c| (c.as_str(), "")).collect();
        let mut table =
            Table::new("summary", "What converged trials say, a cell and quantity a row", &columns);
        for (index, cell) in self.cells.iter().enumerate() {
            for s in &cell.statistics {
                let (name, unit) = (s.quantity.name(), s.quantity.unit());
                let mut row: Vec<Entry> = vec![
                    index.into(),
                    cell.name.as_str().into(),
                    name.into(),
                    unit.into(),
                    (s.count as i64).into(),
                ];
                row.extend([s.mean, s.sd, s.rms].into_iter().flat_map(ends));
                row.extend(s.quantiles.iter().flat_map(|q| ends(q.1)));
                row.extend([number(s.predicted.map(|p| p.mean)), number(s.predicted.map(|p| p.sd))]);
                row.extend(ends(s.ratio));
                table.push(row);
            }
        }
        table
    }

    fn outcomes_table(&self) -> Table {
        let columns =
            ["cell", "levels", "outcome", "count", "share", "share_low", "share_high"].map(|c| (c, ""));
        let mut table = Table::new("outcomes", "How the trials of each cell ended", &columns);
        for (index, cell) in self.cells.iter().enumerate() {
            for (outcome, count, share) in &cell.outcomes {
                let mut row: Vec<Entry> = vec![
                    index.into(),
                    cell.name.as_str().into(),
                    outcome.as_str().into(),
                    (*count as i64).into(),
                ];
                row.extend(ends(Some(*share)));
                table.push(row);
            }
        }
        table
    }

    fn correlations_table(&self) -> Table {
        let columns = ["cell", "levels", "a", "b", "correlation", "correlation_low", "correlation_high"]
            .map(|c| (c, ""));
        let mut table = Table::new("correlations", "Correlation of the errors of two quantities", &columns);
        for (index, cell) in self.cells.iter().enumerate() {
            for (a, b, r) in &cell.correlations {
                let mut row: Vec<Entry> =
                    vec![index.into(), cell.name.as_str().into(), a.name().into(), b.name().into()];
                row.extend(ends(Some(*r)));
                table.push(row);
            }
        }
        table
    }
}

fn with_ends(name: String) -> [String; 3] {
    [name.clone(), format!("{name}_low"), format!("{name}_high")]
}

fn number(value: Option<f64>) -> Entry {
    value.map_or_else(|| Entry::Text(String::new()), Entry::Number)
}

fn ends(estimated: Option<Estimated>) -> [Entry; 3] {
    [number(estimated.map(|e| e.value)), number(estimated.map(|e| e.low)), number(estimated.map(|e| e.high))]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::STUDY;
    use crate::{Shard, Trial};

    #[test]
    fn errors_that_move_as_one_have_no_interval_of_their_correlation() {
        let engine = Engine::new(STUDY, Shard::WHOLE).unwrap();
        let found = |turned: bool| {
            let mut tally = engine.tallies[0].clone();
            // Variance and covariance are 1, without rounding.
            for x in [-1.0, 1.0, -1.0, 1.0, 0.0] {
                let value = |q: usize| Some(if turned && q % 2 == 1 { x * x - 0.8 } else { x });
                let values = (0..engine.quantities.len()).map(value).collect();
                tally.add(&Trial { cell: 0, trial: 0, outcome: "converged".into(), iterations: 1, values });
            }
            correlations(&engine.quantities, &tally, 0.05)
        };
        assert!(found(false).is_empty());
        assert!(found(true).iter().any(|(_, _, r)| r.value.abs() < 1e-12 && r.contains(0.0)));
    }

    #[test]
    fn a_quantiles_interval_reaches_to_the_ranks_of_the_binomial() {
        let mut sketch = Sketch::default();
        (1..=10_000).for_each(|i| sketch.add(f64::from(i)));
        let found = quantile(&sketch, 1000.0, 0.25, 0.05).unwrap();
        // 2500 below on average, with a standard deviation of sqrt(10 000 * 0.25 * 0.75) = 43.3, of which
        // 1.96 are 84.9.
        for (value, rank) in [(found.value, 2500.0), (found.low, 2415.0), (found.high, 2586.0)] {
            assert!(
                (value - 1000.0 - rank).abs() <= 1.000_001 * Sketch::RELATIVE_ERROR * rank,
                "{value} {rank}"
            );
        }
        let mut few = Sketch::default();
        (0..3).for_each(|i| few.add(f64::from(i)));
        assert_eq!(quantile(&few, 0.0, 0.5, 0.05), None);
    }

    #[test]
    fn shares_of_outcomes_are_of_all_trials_and_lie_within_their_intervals() {
        let engine = Engine::new(STUDY, Shard::WHOLE).unwrap();
        let mut tally = engine.tallies[0].clone();
        let values = vec![None; engine.quantities.len()];
        for outcome in ["converged", "refused-few", "converged", "converged"] {
            let trial =
                Trial { cell: 0, trial: 0, outcome: outcome.into(), iterations: 1, values: values.clone() };
            tally.add(&trial);
        }
        let found = outcomes(&tally, 0.05);
        let told: Vec<(&str, u64, f64)> =
            found.iter().map(|(name, n, s)| (name.as_str(), *n, s.value)).collect();
        assert_eq!(told, [("converged", 3, 0.75), ("refused-few", 1, 0.25)]);
        // Wilson's interval of 3 in 4: (0.75 + z^2 / 8 -+ z sqrt(0.1875 / 4 + z^2 / 64)) / (1 + z^2 / 4).
        let share = found[0].2;
        assert!((share.low - 0.300_642).abs() < 1e-6 && (share.high - 0.954_413).abs() < 1e-6, "{share:?}");
    }

    #[test]
    fn what_the_trials_of_a_study_say_is_what_their_values_say() {
        let text = STUDY.replace("per_cell = 3\nbatch = 2", "per_cell = 30\nbatch = 30");
        let text = text.replace("views = 3", "views = 8");
        let spec = crate::Spec::parse(&text).unwrap();
        let mut seen = Vec::new();
        let engine = crate::in_memory_seeing(spec, &text, |trial| seen.push(trial.clone()), |_| {}).unwrap();
        let at = engine.quantities.iter().position(|q| q.name() == "fx").unwrap();
        let values: Vec<f64> = seen.iter().filter(|t| t.cell == 1).map(|t| t.values[at].unwrap()).collect();
        let mean = values.iter().sum::<f64>() / 30.0;
        let sd = (values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / 29.0).sqrt();
        let summary = summarise(&engine);
        let fx = summary.cells[1].of("fx").unwrap();
        let (found, ratio, jointly) = (fx.sd.unwrap(), fx.ratio.unwrap(), fx.ratio_jointly.unwrap());
        assert!((found.value / sd - 1.0).abs() < 1e-12 && fx.count == 30);
        // Student's 97.5 % point with 29 degrees of freedom.
        let mean_told = fx.mean.unwrap();
        let half = 2.045_230 * sd / 30.0f64.sqrt();
        assert!((mean_told.value - mean).abs() < 1e-12 * sd);
        assert!((0.5 * (mean_told.high - mean_told.low) / half - 1.0).abs() < 1e-6, "{mean_told:?}");
        let bound = fx.predicted.unwrap().sd;
        assert!((ratio.value * bound / sd - 1.0).abs() < 1e-12, "{ratio:?} {bound} {sd}");
        assert!(jointly.low < ratio.low, "{ratio:?} {jointly:?}");
        assert!((ratio.high * bound / found.high - 1.0).abs() < 1e-12, "{ratio:?} {found:?}");
        assert!(ratio.high < jointly.high, "{ratio:?} {jointly:?}");
        assert_eq!((jointly.value, summary.confidence), (ratio.value, 0.95));
        let converged = summary.cells[1].converged().unwrap();
        // Wilson's interval of 30 in 30 begins at 30 / (30 + z^2).
        assert!(converged.value == 1.0 && (converged.low - 0.886_487).abs() < 1e-6, "{converged:?}");
    }

    #[test]
    fn three_trials_tell_no_correlation_and_four_do() {
        let engine = Engine::new(STUDY, Shard::WHOLE).unwrap();
        let told = |count: usize| {
            let mut tally = engine.tallies[0].clone();
            for i in 0..count {
                let values = (0..engine.quantities.len()).map(|q| Some(libm::sin((i * q) as f64 + 1.0)));
                let values = values.collect();
                tally.add(&Trial { cell: 0, trial: 0, outcome: "converged".into(), iterations: 1, values });
            }
            correlations(&engine.quantities, &tally, 0.05).len()
        };
        // Seven errors have 21 pairs.
        assert_eq!([0, 1, 3, 4, 5].map(told), [0, 0, 0, 21, 21]);
    }

    #[test]
    fn the_median_of_a_hundred_values_lies_between_the_fortieth_and_the_sixty_first() {
        // As tables of distribution-free intervals have it. Neighbours differ by four errors of the sketch.
        let value = |rank: i32| libm::pow(1.0 + 4.0 * Sketch::RELATIVE_ERROR, f64::from(rank));
        let mut sketch = Sketch::default();
        (1..=100).for_each(|rank| sketch.add(value(rank)));
        let found = quantile(&sketch, 0.0, 0.5, 0.05).unwrap();
        for (told, rank) in [(found.low, 40), (found.value, 50), (found.high, 61)] {
            assert!((told / value(rank) - 1.0).abs() < 1.5 * Sketch::RELATIVE_ERROR, "{told}: {rank}");
        }
    }
}
