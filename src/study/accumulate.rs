//! What is kept of the trials of a cell? Counts and sums, whatever their number.

use super::cells::Cell;
use super::moments::Moments;
use super::sketch::Sketch;
use super::trial::Trial;
use calibench::evaluate::Sample;
use std::collections::BTreeMap;

/// What the trials of one cell say so far.
#[derive(Debug, Clone, PartialEq)]
pub struct Tally {
    /// Trials, failed ones included.
    pub trials: u64,
    /// Trials by outcome.
    pub outcomes: BTreeMap<String, u64>,
    /// One a quantity of the study, over converged trials.
    pub moments: Vec<Moments>,
    /// Counts of values less their `origins`.
    pub sketches: Vec<Sketch>,
    /// What the values are expected to lie about: a sketch is exact to a part of the distance from there.
    pub origins: Vec<f64>,
    /// Joint sums of all quantities that the cell measures, over converged trials that have them all.
    pub joint: Sample,
    /// Which quantities the joint sums hold.
    pub joint_of: Vec<usize>,
}

impl Tally {
    pub(super) fn new(cell: &Cell) -> Tally {
        let quantities = cell.prediction.0.len();
        let origins: Vec<f64> = cell.prediction.0.iter().map(|p| p.map_or(0.0, |p| p.mean)).collect();
        let joint_of: Vec<usize> = (0..quantities).filter(|&q| cell.prediction.0[q].is_some()).collect();
        let origin: Vec<f64> = joint_of.iter().map(|&q| origins[q]).collect();
        Tally {
            trials: 0,
            outcomes: BTreeMap::new(),
            moments: vec![Moments::default(); quantities],
            sketches: vec![Sketch::default(); quantities],
            origins,
            joint: Sample::about(&origin),
            joint_of,
        }
    }

    /// Adds a trial. The order of trials matters to the last bit, so callers keep theirs.
    pub(super) fn add(&mut self, trial: &Trial) {
        self.trials += 1;
        match self.outcomes.get_mut(&trial.outcome) {
            Some(count) => *count += 1,
            None => {
                self.outcomes.insert(trial.outcome.clone(), 1);
            }
        }
        if !trial.converged() {
            return;
        }
        for (q, value) in trial.values.iter().enumerate() {
            if let Some(x) = value {
                self.moments[q].add(*x);
                self.sketches[q].add(x - self.origins[q]);
            }
        }
        let joint: Option<Vec<f64>> = self.joint_of.iter().map(|&q| trial.values[q]).collect();
        if let Some(values) = joint {
            self.joint.add(&values);
        }
    }

    /// Trials that found a minimum.
    pub fn converged(&self) -> u64 {
        self.outcomes.get(super::trial::CONVERGED).copied().unwrap_or(0)
    }

    /// Trials without a camera.
    pub fn refused(&self) -> u64 {
        self.outcomes.iter().filter(|(name, _)| name.starts_with("refused-")).map(|(_, count)| count).sum()
    }
}

#[cfg(test)]
mod tests {
    use crate::example::STUDY;
    use crate::{Engine, Shard, Trial};

    #[test]
    fn every_trial_is_counted_and_the_values_of_those_that_converged() {
        let mut engine = Engine::new(STUDY, Shard::WHOLE).unwrap();
        let values: Vec<Option<f64>> = (0..engine.quantities.len()).map(|q| Some(q as f64)).collect();
        let trial = |outcome: &str| Trial {
            cell: 0,
            trial: 0,
            outcome: outcome.to_string(),
            iterations: 1,
            values: values.clone(),
        };
        let tally = &mut engine.tallies[0];
        ["converged", "refused-parallel", "converged", "stalled", "refused-strays"]
            .iter()
            .for_each(|outcome| tally.add(&trial(outcome)));
        assert_eq!((tally.trials, tally.converged(), tally.refused()), (5, 2, 2));
        assert!(tally.moments.iter().all(|moments| moments.count() == 2));
        assert!(tally.sketches.iter().all(|sketch| sketch.total() == 2));
        assert_eq!(tally.joint.count(), 2);
    }

    #[test]
    fn a_sketch_counts_values_by_their_distance_from_what_is_expected() {
        let mut engine = Engine::new(STUDY, Shard::WHOLE).unwrap();
        let tally = &mut engine.tallies[0];
        // The RMSE is expected at a tenth of a pixel, the NEES at six or so, errors at zero.
        assert!(tally.origins[0] > 0.1 && tally.origins[1] > 1.0);
        let values = tally.origins.iter().map(|origin| Some(origin + 0.25)).collect();
        tally.add(&Trial { cell: 0, trial: 0, outcome: "converged".into(), iterations: 1, values });
        for sketch in &tally.sketches {
            let found = sketch.of_rank(1).unwrap();
            assert!((found - 0.25).abs() <= 0.25 * 0.005_001, "{found}");
        }
    }
}
