//! Did the experiment hold? Golden, claims and published values of one run, judged in one place for tests and
//! command.

use super::experiment::{Context, Experiment, ExperimentError};
use super::golden;
use super::published::{self, Kind};
use super::record::Record;
use std::fmt;
use std::time::{Duration, Instant};

/// How many of how many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Those that hold.
    pub held: usize,
    /// All.
    pub total: usize,
}

/// Published values by what their verdicts are worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ByKind([Tally; Kind::ALL.len()]);

impl ByKind {
    /// Those of one kind. What cannot be judged has a total and none that hold.
    pub fn of(&self, kind: Kind) -> Tally {
        self.0[kind as usize]
    }

    /// Counts one value.
    pub fn count(&mut self, kind: Kind, held: bool) {
        let Tally { held: held_so_far, total } = &mut self.0[kind as usize];
        *held_so_far += usize::from(held);
        *total += 1;
    }

    /// Both counts together.
    pub fn plus(&self, other: &ByKind) -> ByKind {
        ByKind(std::array::from_fn(|i| Tally {
            held: self.0[i].held + other.0[i].held,
            total: self.0[i].total + other.0[i].total,
        }))
    }
}

/// Kinds that occur, such as `independent 7 of 7, derived 11 of 11, input 8 of 8`; empty where nothing is
/// printed.
impl fmt::Display for ByKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut before = "";
        for kind in Kind::ALL {
            let Tally { held, total } = self.of(kind);
            match (kind, total) {
                (_, 0) => continue,
                (Kind::CannotBeJudged, _) => write!(f, "{before}{} {total}", kind.name())?,
                _ => write!(f, "{before}{} {held} of {total}", kind.name())?,
            }
            before = ", ";
        }
        Ok(())
    }
}

/// What became of the comparison with golden/.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Golden {
    /// Compared; the tally counts numbers.
    Compared(Tally),
    /// Not compared, for this reason.
    Skipped(&'static str),
    /// The experiment has no snapshot yet.
    Missing,
}

/// The judgement of one run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Verdict {
    /// Name of the experiment.
    pub experiment: String,
    /// Against the snapshot.
    pub golden: Golden,
    /// Claims.
    pub claims: Tally,
    /// Published values, by kind.
    pub published: ByKind,
    /// Everything that does not hold, one sentence each.
    pub deviations: Vec<String>,
    /// Bits that moved within their bands.
    pub drift: Vec<String>,
}

/// One run of one experiment, successful or not.
#[derive(Debug)]
pub struct Run {
    /// The experiment.
    pub experiment: Experiment,
    /// Its record, or why there is none.
    pub result: Result<Record, ExperimentError>,
    /// Wall-clock time; for people and out/, never locked.
    pub took: Duration,
    /// Whether golden/ applies: default seed and own input.
    pub locked: bool,
}

/// Runs an experiment and takes the time.
pub fn run(experiment: &Experiment, context: &Context) -> Run {
    let started = Instant::now();
    let result = experiment.execute(context);
    let locked = experiment.is_locked_run(context);
    Run { experiment: *experiment, result, took: started.elapsed(), locked }
}

impl Verdict {
    /// Judges a record. `snapshot` is the text of its golden file; a run with another seed or input is not
    /// compared.
    pub fn of(record: &Record, snapshot: Option<&str>, locked: bool) -> Verdict {
        let mut verdict = Verdict {
            experiment: record.experiment().to_string(),
            golden: Golden::Skipped("another seed or input than the locked run's"),
            claims: Tally::default(),
            published: ByKind::default(),
            deviations: Vec::new(),
            drift: Vec::new(),
        };
        if locked {
            verdict.judge_golden(record, snapshot);
        }
        verdict.judge_claims(record);
        verdict.judge_published(record);
        verdict
    }

    /// Whether nothing deviates.
    pub fn held(&self) -> bool {
        self.deviations.is_empty()
    }

    fn judge_golden(&mut self, record: &Record, snapshot: Option<&str>) {
        let Some(snapshot) = snapshot else {
            self.golden = Golden::Missing;
            self.deviations.push(format!(
                "golden: no snapshot yet; look at the record, then `calibench bless {}`",
                self.experiment
            ));
            return;
        };
        let comparison = golden::compare(golden::contents(snapshot), &golden::snapshot(record));
        self.golden = Golden::Compared(Tally { held: comparison.numbers_held, total: comparison.numbers });
        self.deviations.extend(comparison.deviations.iter().map(|d| format!("golden: {d}")));
        self.drift = comparison.drift;
    }

    fn judge_claims(&mut self, record: &Record) {
        for claim in record.claims() {
            self.claims.total += 1;
            if claim.held {
                self.claims.held += 1;
                continue;
            }
            let (low, high) = claim.interval;
            let found = claim.counted().map_or_else(
                || format!("{} {} is not in [{low}, {high}]", claim.value, claim.unit),
                |counted| format!("{counted} only"),
            );
            let mut text = format!("claim {}: {}; {found} ({})", claim.id, claim.statement, claim.reason);
            for failure in &claim.failures {
                text.push_str(&format!("\n    fails: {failure}"));
            }
            self.deviations.push(text);
        }
    }

    fn judge_published(&mut self, record: &Record) {
        for reconciliation in record.reconciliations() {
            self.published.count(reconciliation.entry.kind, reconciliation.held());
            if !reconciliation.held() {
                self.deviations.push(format!("published {}", reconciliation.describe()));
            }
        }
        for entry in published::not_judged(record.experiment()) {
            self.published.count(entry.kind, false);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Band;

    fn record(value: f64) -> Record {
        let mut record = Record::new("e", 0);
        record.group("px", Band::absolute(0.1, "test")).number("n", value, "");
        record.claim_that("small", "n is small").at_most(value, 1.0).because("test");
        record
    }

    #[test]
    fn golden_and_claims_are_judged_apart() {
        let snapshot = golden::file_text(&record(0.5));
        assert!(Verdict::of(&record(0.5), Some(&snapshot), true).held());
        let moved = Verdict::of(&record(0.9), Some(&snapshot), true);
        assert_eq!((moved.golden, moved.claims.held), (Golden::Compared(Tally { held: 0, total: 1 }), 1));
        let wrong = Verdict::of(&record(2.0), Some(&golden::file_text(&record(2.0))), true);
        assert_eq!((wrong.deviations.len(), wrong.claims), (1, Tally { held: 0, total: 1 }));
    }

    #[test]
    fn published_values_are_counted_by_kind() {
        let mut counts = ByKind::default();
        counts.count(Kind::Independent, true);
        counts.count(Kind::Independent, false);
        counts.count(Kind::CannotBeJudged, false);
        assert_eq!(counts.to_string(), "independent 1 of 2, cannot be judged 1");
        assert_eq!(counts.plus(&counts).of(Kind::Independent), Tally { held: 2, total: 4 });
        assert_eq!(ByKind::default().to_string(), "");
        for (i, kind) in Kind::ALL.into_iter().enumerate() {
            assert_eq!(kind as usize, i, "{}", kind.name());
        }
    }

    #[test]
    fn another_seed_is_not_compared_and_a_missing_snapshot_is_a_deviation() {
        assert!(Verdict::of(&record(0.5), None, false).held());
        let missing = Verdict::of(&record(0.5), None, true);
        assert!(!missing.held() && missing.golden == Golden::Missing);
    }
}
