//! In which order are trials done, and when is a cell finished? Batches of fixed size, one cell after the
//! other, round by round.

use super::accumulate::Tally;
use super::calibrator::Calibrator;
use super::cells::Cell;
use super::frame;
use super::inputs::Inputs;
use super::quantity::Quantity;
use super::shard::Shard;
use super::spec::Spec;
use super::spec_error::SpecError;
use super::trial::{Trial, run_trial, run_trials_of};
use rayon::prelude::*;
use std::convert::Infallible;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A study in progress: what is done, and what comes next.
#[derive(Debug, Clone)]
pub struct Engine {
    /// The study.
    pub spec: Spec,
    /// Its cells.
    pub cells: Vec<Cell>,
    /// What every trial measures.
    pub quantities: Vec<Quantity>,
    /// The part that is done here.
    pub shard: Shard,
    /// What the trials say, one a cell.
    pub tallies: Vec<Tally>,
    /// Batches absorbed.
    pub batches: u64,
    /// Who calibrates; this library's solver where it is nobody else.
    calibrator: Option<Arc<dyn Calibrator>>,
    finished: Vec<bool>,
    round: u64,
    place: usize,
}

/// How far a run is, told after each batch and within long ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Pace {
    /// Trials done since the run began or was resumed.
    pub trials: u64,
    /// Trials done before it was resumed.
    pub before: u64,
    /// Trials that the part will have at its end, as far as can be told: a cell that stops at a precision is
    /// taken to approach it by the root of its trials.
    pub expected: u64,
    /// The cell that is known worst.
    pub worst: Option<Worst>,
}

/// The cell whose trials say least.
#[derive(Debug, Clone, PartialEq)]
pub struct Worst {
    /// Its name.
    pub cell: String,
    /// Of whose standard deviation.
    pub quantity: &'static str,
    /// Half-width of the interval over the value; `None` where too few trials converged to say anything.
    pub relative_half_width: Option<f64>,
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// All is done.
    Complete,
    /// Asked to stop, and stopped after a batch.
    Interrupted,
}

/// A request to stop after the present batch.
pub type Interruption = AtomicBool;

/// Trials that somebody else's solver is given at once: what they have seen is held in memory.
const ASKED_AT_ONCE: u64 = 64;
/// Trials that a thread makes until it is told how far they are.
const MADE_AT_ONCE: u64 = 16;

/// The stop rule needs this many batches.
const LEAST_BATCHES: u64 = 2;

impl Engine {
    /// The beginning of a study's part; `text` is its file.
    pub fn new(text: &str, shard: Shard) -> Result<Engine, SpecError> {
        Engine::of(Spec::parse(text)?, text, shard)
    }

    /// The same for a study that names files.
    ///
    /// # Errors
    /// A study that cannot be run as written.
    pub fn with_inputs(text: &str, inputs: &Inputs, shard: Shard) -> Result<Engine, SpecError> {
        Engine::of(Spec::parse_with(text, inputs)?, text, shard)
    }

    /// The same for a study that was read already.
    pub fn of(spec: Spec, text: &str, shard: Shard) -> Result<Engine, SpecError> {
        let cells = spec.cells(text)?;
        let quantities = spec.quantities(&cells);
        let tallies = cells.iter().map(Tally::new).collect();
        let finished = vec![false; cells.len()];
        let calibrator = None;
        Ok(Engine {
            spec,
            quantities,
            tallies,
            finished,
            cells,
            shard,
            calibrator,
            batches: 0,
            round: 0,
            place: 0,
        })
    }

    /// The same, calibrated by somebody else's solver.
    #[must_use]
    pub fn calibrated_by(self, calibrator: Arc<dyn Calibrator>) -> Engine {
        Engine { calibrator: Some(calibrator), ..self }
    }

    /// Whether this library's solver calibrates.
    pub fn is_calibrated_here(&self) -> bool {
        self.calibrator.is_none()
    }

    /// The same study's beginning in another part.
    pub(super) fn for_shard(&self, shard: Shard) -> Engine {
        let tallies = self.cells.iter().map(Tally::new).collect();
        let finished = vec![false; self.cells.len()];
        Engine { shard, tallies, finished, batches: 0, round: 0, place: 0, ..self.clone() }
    }

    /// Cell and batch that come next; `None` at the end.
    pub(super) fn next(&self) -> Option<(usize, u64)> {
        let cells = self.cells.len();
        if self.spec.trials.precision.is_none() {
            let deal = self.shard.first_from(self.round * cells as u64 + self.place as u64);
            let unit = ((deal % cells as u64) as usize, deal / cells as u64);
            return Some(unit).filter(|unit| unit.1 < self.rounds());
        }
        let held = |cell: &usize| !self.finished[*cell] && self.shard.holds(*cell, 0, cells, true);
        let here = (self.place..cells).find(held).map(|cell| (cell, self.round));
        let unit = here.or_else(|| (0..cells).find(held).map(|cell| (cell, self.round + 1)));
        unit.filter(|unit| unit.1 < self.rounds())
    }

    /// Batches of a cell that takes all its trials.
    fn rounds(&self) -> u64 {
        self.spec.trials.per_cell.div_ceil(self.spec.trials.batch)
    }

    /// The trials of a batch.
    pub(super) fn trials_of(&self, batch: u64) -> std::ops::Range<u64> {
        let size = self.spec.trials.batch;
        let first = batch * size;
        first..first.saturating_add(size).min(self.spec.trials.per_cell)
    }

    /// Runs the batch that comes next, in parallel; the trials are in order. Tells how many are done before
    /// all are.
    fn run(&self, (cell, batch): (usize, u64), mut report: impl FnMut(u64)) -> Vec<Trial> {
        let cell = &self.cells[cell];
        let range = self.trials_of(batch);
        let size = match self.calibrator {
            Some(_) => ASKED_AT_ONCE,
            None => MADE_AT_ONCE * rayon::current_num_threads() as u64,
        };
        let mut trials = Vec::with_capacity((range.end - range.start) as usize);
        for first in range.clone().step_by(size as usize) {
            if first > range.start {
                report(first - range.start);
            }
            let chunk = first..range.end.min(first + size);
            match &self.calibrator {
                Some(solver) => {
                    trials.extend(run_trials_of(solver.as_ref(), cell, &self.quantities, chunk));
                }
                None => trials
                    .par_extend(chunk.into_par_iter().map(|trial| run_trial(cell, &self.quantities, trial))),
            }
        }
        trials
    }

    /// Takes in the trials of the batch that comes next.
    pub(super) fn absorb(&mut self, (cell, batch): (usize, u64), trials: &[Trial]) {
        trials.iter().for_each(|trial| self.tallies[cell].add(trial));
        self.batches += 1;
        (self.round, self.place) = (batch, cell + 1);
        if batch + 1 >= LEAST_BATCHES && self.is_precise(cell) {
            self.finished[cell] = true;
        }
    }

    fn is_precise(&self, cell: usize) -> bool {
        let Some(precision) = &self.spec.trials.precision else { return false };
        self.relative_half_width(cell, &precision.quantity)
            .is_some_and(|width| width <= precision.relative_half_width)
    }

    /// Half-width of the interval of a quantity's standard deviation over that; zero where all values are
    /// equal.
    fn relative_half_width(&self, cell: usize, quantity: &str) -> Option<f64> {
        let at = self.quantities.iter().position(|q| q.name() == quantity)?;
        let sd = self.tallies[cell].moments[at].sd_interval(1.0 - self.spec.confidence)?;
        Some(if sd.value == 0.0 { 0.0 } else { 0.5 * (sd.high - sd.low) / sd.value })
    }

    /// The cell whose trials say least, by the wanted quantity or else the first estimated parameter. Cells
    /// that are precise enough or not begun are not asked.
    fn worst(&self) -> Option<Worst> {
        let wanted = self.spec.trials.precision.as_ref().map(|p| p.quantity.as_str());
        let quantity =
            self.quantities.iter().find(|q| q.is_error() && wanted.is_none_or(|w| w == q.name()))?;
        let open = (0..self.cells.len()).filter(|&c| !self.finished[c] && self.tallies[c].trials > 0);
        let width = |cell| self.relative_half_width(cell, quantity.name());
        let size = |width: &Option<f64>| width.unwrap_or(f64::INFINITY);
        let (cell, relative_half_width) =
            open.map(|cell| (cell, width(cell))).max_by(|a, b| size(&a.1).total_cmp(&size(&b.1)))?;
        let cell = self.cells[cell].name.clone();
        Some(Worst { cell, quantity: quantity.name(), relative_half_width })
    }

    /// Cells of this part that took all their trials and are not as precise as was wanted.
    pub fn imprecise(&self) -> Vec<&Cell> {
        let held = |cell: &&Cell| self.shard.holds(cell.index, 0, self.cells.len(), true);
        let wanted = self.spec.trials.precision.is_some();
        self.cells.iter().filter(|cell| wanted && held(cell) && !self.is_precise(cell.index)).collect()
    }

    /// Trials at the end, see [`Pace::expected`].
    fn expected_trials(&self) -> u64 {
        let Some(precision) = &self.spec.trials.precision else { return self.most_trials() };
        let trials = &self.spec.trials;
        let of_cell = |cell: usize| {
            let done = self.tallies[cell].trials;
            if self.finished[cell] {
                return done;
            }
            let Some(width) = self.relative_half_width(cell, &precision.quantity) else {
                return trials.per_cell;
            };
            let factor = width / precision.relative_half_width;
            let needed = libm::ceil(done as f64 * factor * factor) as u64;
            needed.div_ceil(trials.batch).saturating_mul(trials.batch).clamp(done, trials.per_cell)
        };
        let held = (0..self.cells.len()).filter(|&cell| self.shard.holds(cell, 0, self.cells.len(), true));
        held.map(of_cell).sum()
    }

    /// The most trials this part may take.
    pub fn most_trials(&self) -> u64 {
        let (trials, cells) = (&self.spec.trials, self.cells.len());
        if trials.precision.is_some() {
            let held = (0..cells).filter(|&cell| self.shard.holds(cell, 0, cells, true));
            return trials.per_cell * held.count() as u64;
        }
        // All batches are whole but those of the last round.
        let last = self.trials_of(self.rounds() - 1);
        let before_last = self.shard.held_below((self.rounds() - 1) * cells as u64);
        let in_last = self.shard.held_below(self.rounds() * cells as u64) - before_last;
        before_last * trials.batch + in_last * (last.end - last.start)
    }

    /// Trials done.
    pub fn trials(&self) -> u64 {
        self.tallies.iter().map(|t| t.trials).sum()
    }

    /// Runs to the end or until asked to stop. `keep` stores each batch before it counts.
    pub(super) fn drive<E>(
        &mut self,
        stop: &Interruption,
        mut keep: impl FnMut(&[Trial]) -> Result<(), E>,
        mut report: impl FnMut(&Pace),
    ) -> Result<Outcome, E> {
        let before = self.trials();
        let pace = |engine: &Engine| Pace {
            trials: engine.trials() - before,
            before,
            expected: engine.expected_trials(),
            worst: engine.worst(),
        };
        let mut last = pace(self);
        while let Some(unit) = self.next() {
            if stop.load(Ordering::Relaxed) {
                return Ok(Outcome::Interrupted);
            }
            let trials = self.run(unit, |done| report(&Pace { trials: last.trials + done, ..last.clone() }));
            keep(&trials)?;
            self.absorb(unit, &trials);
            last = pace(self);
            report(&last);
        }
        Ok(Outcome::Complete)
    }

    /// The first cell whose camera does not show the whole frame over which displacements are measured, and
    /// the share that it shows.
    pub fn frame_in_part(&self) -> Option<(&Cell, f64)> {
        let measured = self.cells.iter().filter(|cell| cell.measures_frame);
        measured
            .into_iter()
            .find_map(|cell| Some((cell, frame::shown(&cell.camera, cell.design.scene.image)?)))
    }
}

/// Runs a whole study without files: for experiments, plans and measurements.
///
/// ```
/// use calibench_study::{Spec, in_memory, summarise};
///
/// let text = r#"
/// name = "views"
/// question = "How well do four views tell the focal length?"
/// seed = 1
/// scene.image = [640, 480]
/// scene.camera = { fx = 600.0, fy = 600.0, cx = 326.0, cy = 243.0, k1 = -0.18, k2 = 0.05 }
/// scene.target = { columns = 9, rows = 7, spacing_mm = 10.0 }
/// scene.poses = { kind = "spread", views = 4, tilt_deg = 20.0, distance_mm = 120.0 }
/// scene.noise_px = 0.1
/// trials = { per_cell = 50, batch = 50 }
/// "#;
/// let summary = summarise(&in_memory(Spec::parse(text)?, text, |_| {})?);
/// let fx = summary.cells[0].of("fx").and_then(|fx| fx.sd).expect("fx is free, and trials converge");
/// // The interval of the standard deviation holds some 0.7 px.
/// assert!(fx.low < fx.value && fx.value < fx.high && (0.4..1.2).contains(&fx.value));
/// # Ok::<(), calibench_study::SpecError>(())
/// ```
///
/// # Errors
/// A study that cannot be run as written.
pub fn in_memory(spec: Spec, text: &str, report: impl FnMut(&Pace)) -> Result<Engine, SpecError> {
    in_memory_seeing(spec, text, |_| {}, report)
}

/// As [`in_memory`], showing every trial, in order.
pub fn in_memory_seeing(
    spec: Spec,
    text: &str,
    see: impl FnMut(&Trial),
    report: impl FnMut(&Pace),
) -> Result<Engine, SpecError> {
    Ok(in_memory_until(spec, text, &AtomicBool::new(false), see, report)?.0)
}

/// As [`in_memory_seeing`], calibrated by somebody else's solver.
///
/// # Errors
/// A study that cannot be run as written.
pub fn in_memory_by(
    calibrator: Arc<dyn Calibrator>,
    spec: Spec,
    text: &str,
    mut see: impl FnMut(&Trial),
) -> Result<Engine, SpecError> {
    let mut engine = Engine::of(spec, text, Shard::WHOLE)?.calibrated_by(calibrator);
    let keep = |trials: &[Trial]| {
        trials.iter().for_each(&mut see);
        Ok::<(), Infallible>(())
    };
    let Ok(_) = engine.drive(&AtomicBool::new(false), keep, |_| {});
    Ok(engine)
}

/// As [`in_memory_seeing`], to the end or until asked to stop.
pub fn in_memory_until(
    spec: Spec,
    text: &str,
    stop: &Interruption,
    mut see: impl FnMut(&Trial),
    report: impl FnMut(&Pace),
) -> Result<(Engine, Outcome), SpecError> {
    let mut engine = Engine::of(spec, text, Shard::WHOLE)?;
    let keep = |trials: &[Trial]| {
        trials.iter().for_each(&mut see);
        Ok::<(), Infallible>(())
    };
    let Ok(outcome) = engine.drive(stop, keep, report);
    Ok((engine, outcome))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Estimate;
    use crate::example::STUDY;
    use calibench::board::View;

    #[test]
    fn every_cell_takes_every_batch_once_round_by_round() {
        let text = STUDY.replace("per_cell = 3\nbatch = 2", "per_cell = 5\nbatch = 2");
        let mut engine = Engine::new(&text, Shard::WHOLE).unwrap();
        let mut units = Vec::new();
        while let Some(unit) = engine.next() {
            units.push(unit);
            engine.absorb(unit, &[]);
        }
        assert_eq!(units, [(0, 0), (1, 0), (0, 1), (1, 1), (0, 2), (1, 2)]);
    }

    #[test]
    fn the_worst_cell_is_one_that_has_begun_and_is_known_least() {
        let mut engine =
            Engine::new(&STUDY.replace("per_cell = 3\nbatch = 2", "per_cell = 60\nbatch = 20"), Shard::WHOLE)
                .unwrap();
        assert_eq!(engine.worst(), None);
        let take = |engine: &mut Engine| {
            let unit = engine.next().unwrap();
            let trials = engine.run(unit, |_| {});
            engine.absorb(unit, &trials);
        };
        take(&mut engine);
        let worst = engine.worst().unwrap();
        assert_eq!((worst.cell.as_str(), worst.quantity), ("noise = 0.1", "fx"));
        assert_eq!(worst.relative_half_width, engine.relative_half_width(0, "fx"));
        take(&mut engine);
        take(&mut engine);
        // Forty trials of the first cell, twenty of the second, of which none knows more.
        let widths = [0, 1].map(|cell| engine.relative_half_width(cell, "fx").unwrap());
        let least = if widths[0] > widths[1] { "noise = 0.1" } else { "noise = 0.3" };
        assert_eq!(engine.worst().unwrap().cell, least);
    }

    #[test]
    fn a_long_batch_tells_how_far_it_is_and_has_the_trials_of_one_thread() {
        let text = STUDY.replace("per_cell = 3\nbatch = 2", "per_cell = 80\nbatch = 40");
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (mut trials, mut told) = (Vec::new(), Vec::new());
            let spec = Spec::parse(&text).unwrap();
            let see = |trial: &Trial| trials.push(trial.clone());
            pool.install(|| in_memory_seeing(spec, &text, see, |pace| told.push(pace.trials)).unwrap());
            (trials, told)
        };
        let (alone, told) = run(1);
        // Two batches of each of two cells.
        assert_eq!(told, [16, 32, 40, 56, 72, 80, 96, 112, 120, 136, 152, 160]);
        let (together, told) = run(2);
        assert_eq!(told, [32, 40, 72, 80, 112, 120, 152, 160]);
        assert!(alone == together);
    }

    #[test]
    fn parts_take_all_trials_of_the_whole_together() {
        // Two whole batches of two and a last one of one, of each of two cells.
        let text = STUDY.replace("per_cell = 3\nbatch = 2", "per_cell = 5\nbatch = 2");
        let most = |index, count| Engine::new(&text, Shard { index, count }).unwrap().most_trials();
        assert_eq!(most(0, 1), 10);
        for count in 2..8 {
            assert_eq!((0..count).map(|index| most(index, count)).sum::<u64>(), 10, "{count} parts");
        }
        // Batches are dealt in turn: (0, 0), (0, 1), (0, 2) of the first part, the others of the second.
        assert_eq!([most(0, 2), most(1, 2)], [5, 5]);
        assert_eq!([0, 1, 2, 3].map(|index| most(index, 4)), [3, 3, 2, 2]);
    }

    #[test]
    fn equal_values_are_known_exactly_and_others_by_half_of_their_interval() {
        let mut engine = Engine::new(STUDY, Shard::WHOLE).unwrap();
        let at = engine.quantities.iter().position(|q| q.name() == "fx").unwrap();
        for x in [7.0, 7.0, 7.0, 7.0] {
            engine.tallies[0].moments[at].add(x);
        }
        for x in [-1.0, 2.0, 0.5, -3.0, 1.0, 0.0] {
            engine.tallies[1].moments[at].add(x);
        }
        assert_eq!(engine.relative_half_width(0, "fx"), Some(0.0));
        let sd = engine.tallies[1].moments[at].sd_interval(0.05).unwrap();
        let width = engine.relative_half_width(1, "fx").unwrap();
        assert!((2.0 * width * sd.value - (sd.high - sd.low)).abs() < 1e-12 && width > 0.1, "{width}");
        assert_eq!(engine.relative_half_width(0, "cx"), None);
    }

    /// The study with a wanted precision, and some values of fx in each cell.
    fn precise(per_cell: u64, batch: u64, shard: Shard, values: [&[f64]; 2]) -> Engine {
        let trials = format!("per_cell = {per_cell}\nbatch = {batch}\n");
        let wanted = "precision = { quantity = \"fx\", relative_half_width = 0.05 }";
        let text = STUDY.replace("per_cell = 3\nbatch = 2", &(trials + wanted));
        let mut engine = Engine::new(&text, shard).unwrap();
        let at = engine.quantities.iter().position(|q| q.name() == "fx").unwrap();
        for (tally, values) in engine.tallies.iter_mut().zip(values) {
            tally.trials = values.len() as u64;
            values.iter().for_each(|x| tally.moments[at].add(*x));
        }
        engine
    }

    #[test]
    fn as_many_more_trials_are_expected_as_narrow_the_interval_to_what_is_wanted() {
        assert_eq!(precise(1000, 10, Shard::WHOLE, [&[], &[]]).expected_trials(), 2000);
        // Of ten times +-1 the interval's half-width is 0.1018 of the standard deviation: 20 (0.1018 /
        // 0.05)^2 = 82.9 trials, nine batches of ten.
        let signs: Vec<f64> = (0..20).map(|i| [1.0, -1.0][i % 2]).collect();
        assert_eq!(precise(1000, 10, Shard::WHOLE, [&signs, &[]]).expected_trials(), 1090);
        assert_eq!(precise(60, 10, Shard::WHOLE, [&signs, &signs]).expected_trials(), 120);
        // A cell that has ended takes none beyond its own.
        let mut engine = precise(1000, 10, Shard::WHOLE, [&signs, &signs]);
        engine.finished[0] = true;
        assert_eq!(engine.expected_trials(), 110);
        let part = |index| precise(1000, 10, Shard { index, count: 2 }, [&signs, &[]]).expected_trials();
        assert_eq!((part(0), part(1)), (90, 1000));
    }

    #[test]
    fn a_cell_is_imprecise_where_a_precision_is_wanted_and_not_reached() {
        let signs: Vec<f64> = (0..20).map(|i| [1.0, -1.0][i % 2]).collect();
        let names = |shard| -> Vec<String> {
            let engine = precise(1000, 10, shard, [&[2.0; 20], &signs]);
            engine.imprecise().iter().map(|cell| cell.name.clone()).collect()
        };
        assert_eq!(names(Shard::WHOLE), ["noise = 0.3"]);
        assert_eq!(names(Shard { index: 0, count: 2 }), [""; 0]);
        assert_eq!(names(Shard { index: 1, count: 2 }), ["noise = 0.3"]);
        assert!(Engine::new(STUDY, Shard::WHOLE).unwrap().imprecise().is_empty());
    }

    #[test]
    fn a_part_of_a_study_with_a_precision_holds_whole_cells_until_they_end() {
        let units = |shard, ended: Option<usize>| {
            let mut engine = precise(5, 2, shard, [&[], &[]]);
            let mut units = Vec::new();
            while let Some(unit) = engine.next() {
                units.push(unit);
                engine.absorb(unit, &[]);
                if let (Some(cell), 1) = (ended, unit.1) {
                    engine.finished[cell] = true;
                }
            }
            units
        };
        assert_eq!(units(Shard::WHOLE, None), [(0, 0), (1, 0), (0, 1), (1, 1), (0, 2), (1, 2)]);
        assert_eq!(units(Shard::WHOLE, Some(0)), [(0, 0), (1, 0), (0, 1), (1, 1), (1, 2)]);
        assert_eq!(units(Shard { index: 1, count: 2 }, None), [(1, 0), (1, 1), (1, 2)]);
        let most = |index, count| precise(5, 2, Shard { index, count }, [&[], &[]]).most_trials();
        assert_eq!([most(0, 1), most(0, 2), most(1, 2), most(2, 3)], [10, 5, 5, 0]);
    }

    #[test]
    fn a_cell_ends_after_two_batches_at_least_and_only_if_it_is_precise() {
        let signs: Vec<f64> = (0..20).map(|i| [1.0, -1.0][i % 2]).collect();
        let mut engine = precise(1000, 10, Shard::WHOLE, [&[2.0; 20], &signs]);
        for (unit, ended) in [((0, 0), false), ((1, 0), false), ((0, 1), true), ((1, 1), false)] {
            engine.absorb(unit, &[]);
            assert_eq!(engine.finished[unit.0], ended, "{unit:?}");
        }
        assert_eq!(engine.batches, 4);
    }

    #[test]
    fn a_cell_that_has_ended_is_never_the_worst() {
        let signs: Vec<f64> = (0..20).map(|i| [1.0, -1.0][i % 2]).collect();
        let mut engine = precise(1000, 10, Shard::WHOLE, [&[2.0; 20], &signs]);
        assert_eq!(engine.worst().unwrap().cell, "noise = 0.3");
        engine.finished[1] = true;
        assert_eq!(engine.worst().unwrap().cell, "noise = 0.1");
    }

    #[test]
    fn the_last_batch_has_the_trials_that_are_left() {
        let text = STUDY.replace("per_cell = 3\nbatch = 2", "per_cell = 7\nbatch = 3");
        let engine = Engine::new(&text, Shard::WHOLE).unwrap();
        assert_eq!([0, 1, 2].map(|batch| engine.trials_of(batch)), [0..3, 3..6, 6..7]);
        let of = |unit| engine.run(unit, |_| {}).iter().map(|t| (t.cell, t.trial)).collect::<Vec<_>>();
        assert_eq!(of((1, 1)), [(1, 3), (1, 4), (1, 5)]);
        assert_eq!(of((0, 2)), [(0, 6)]);
    }

    #[test]
    fn parts_count_the_last_batch_by_the_trials_that_it_has() {
        // Batches of three and two, of each of two cells.
        let text = STUDY.replace("per_cell = 3\nbatch = 2", "per_cell = 5\nbatch = 3");
        let most = |index, count| Engine::new(&text, Shard { index, count }).unwrap().most_trials();
        assert_eq!([most(0, 1), most(0, 2), most(1, 2)], [10, 5, 5]);
        assert_eq!([0, 1, 2].map(|index| most(index, 3)), [5, 3, 2]);
    }

    #[test]
    fn a_run_that_goes_on_tells_what_it_did_apart_from_what_was_done() {
        let mut engine = Engine::new(STUDY, Shard::WHOLE).unwrap();
        let first = engine.run((0, 0), |_| {});
        engine.absorb((0, 0), &first);
        let (mut told, mut kept) = (Vec::new(), Vec::new());
        let keep = |trials: &[Trial]| {
            kept.extend(trials.iter().map(|trial| (trial.cell, trial.trial)));
            Ok::<(), Infallible>(())
        };
        let tell = |pace: &Pace| told.push((pace.before, pace.trials, pace.expected));
        let Ok(outcome) = engine.drive(&AtomicBool::new(false), keep, tell);
        assert_eq!((outcome, told), (Outcome::Complete, vec![(2, 2, 6), (2, 3, 6), (2, 4, 6)]));
        assert_eq!(kept, [(1, 0), (1, 1), (0, 2), (1, 2)]);
    }

    #[test]
    fn all_trials_are_calibrated_by_the_solver_that_is_given() {
        #[derive(Debug)]
        struct Refusing;
        impl Calibrator for Refusing {
            fn calibrate(&self, _: &Cell, seen: &[Vec<View>]) -> Vec<Result<Estimate, String>> {
                seen.iter().map(|_| Err("unsupported".to_string())).collect()
            }
        }
        let mut outcomes = Vec::new();
        let see = |trial: &Trial| outcomes.push(trial.outcome.clone());
        let theirs = in_memory_by(Arc::new(Refusing), Spec::parse(STUDY).unwrap(), STUDY, see).unwrap();
        assert_eq!(outcomes, ["unsupported"; 6]);
        assert!(!theirs.is_calibrated_here());
        assert!(Engine::new(STUDY, Shard::WHOLE).unwrap().is_calibrated_here());
    }
}
