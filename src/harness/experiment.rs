//! What is an experiment? A question, a default seed, and a function from a context to a record.

use super::progress::{Progress, ProgressDisplay};
use super::record::Record;
use super::record_error::RecordError;
use calibench::io::message;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;

/// An experiment: one file in experiments/.
///
/// ```
/// use calibench::geometry::{LineFit, Vec2};
/// use calibench_harness::{Context, Experiment, ExperimentError, Record, Table};
///
/// const EXPERIMENT: Experiment = Experiment {
///     id: "straight-line",
///     title: "A line through points of a line",
///     question: "How far do points of a straight line leave the line that is fitted to them? Expected: not at all.",
///     seed: 1,
///     takes_image: false,
///     run,
/// };
///
/// fn run(context: &Context) -> Result<Record, ExperimentError> {
///     let points: Vec<Vec2> = (0..9).map(|k| Vec2::new(f64::from(k), 2.0 * f64::from(k))).collect();
///     let line = LineFit::new(&points).map_err(ExperimentError::at("line fit"))?;
///     let mut record = context.record();
///     record.exact("").count("points", points.len(), "points of the line");
///     record
///         .claim_that("straight", "no point leaves the line but by rounding")
///         .at_most(line.max_deviation(), 1e-13)
///         .unit("px")
///         .because("coordinates below 16 px are rounded by 2^-50 px, some tens of times");
///     record.table(
///         Table::of("line", "the points", &points).column("u", "px", |p| p.x).column("v", "px", |p| p.y),
///     );
///     Ok(record)
/// }
///
/// let record = EXPERIMENT.execute(&Context::of(&EXPERIMENT))?;
/// assert!(record.claims().iter().all(|claim| claim.held));
/// assert_eq!(record.tables()[0].rows().len(), 9);
/// # Ok::<(), ExperimentError>(())
/// ```
#[derive(Debug, Clone, Copy)]
pub struct Experiment {
    /// Name in kebab-case, such as `four-pose`: of the binary, the folder in out/ and figures/, and the
    /// snapshot.
    pub id: &'static str,
    /// A headline.
    pub title: &'static str,
    /// The question it answers and the answer that is expected, in prose.
    pub question: &'static str,
    /// The seed of the locked run. Never chosen for its result.
    pub seed: u64,
    /// Whether it accepts an image file in place of its own.
    pub takes_image: bool,
    /// Runs it.
    pub run: fn(&Context) -> Result<Record, ExperimentError>,
}

/// What an experiment is given.
#[derive(Debug, Clone)]
pub struct Context {
    experiment: &'static str,
    /// Seed of every random stream.
    pub seed: u64,
    /// An image file that takes the place of the experiment's own.
    pub image: Option<PathBuf>,
    display: ProgressDisplay,
}

/// Why an experiment has no result.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// The record contradicts itself.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The user's input cannot be used.
    #[error("{0}")]
    Input(String),
    /// A defect: the code met a state that it holds for impossible.
    #[error("the experiment panicked, which is a defect: {0}")]
    Panicked(String),
    /// A step failed that should not.
    #[error("{step}: {}", message(&**cause))]
    Step {
        /// What was being done.
        step: &'static str,
        /// Why it failed.
        cause: Box<dyn std::error::Error + Send + Sync>,
    },
}

impl ExperimentError {
    /// Names the step that failed: `.map_err(ExperimentError::at("closed form"))?`.
    pub fn at<E>(step: &'static str) -> impl Fn(E) -> ExperimentError
    where
        E: Into<Box<dyn std::error::Error + Send + Sync>>,
    {
        // `Fn` because it is handed to `map_err` inside loops and iterators as well.
        move |cause| ExperimentError::Step { step, cause: cause.into() }
    }
}

impl Context {
    /// A context with the default seed, no image and no progress shown.
    pub fn of(experiment: &Experiment) -> Context {
        Context {
            experiment: experiment.id,
            seed: experiment.seed,
            image: None,
            display: ProgressDisplay::hidden(),
        }
    }

    /// The same context with another seed.
    pub fn with_seed(self, seed: u64) -> Context {
        Context { seed, ..self }
    }

    /// The same context with an image file.
    pub fn with_image(self, image: Option<PathBuf>) -> Context {
        Context { image, ..self }
    }

    /// The same context, showing progress.
    pub fn with_progress(self, display: ProgressDisplay) -> Context {
        Context { display, ..self }
    }

    /// The record to fill.
    pub fn record(&self) -> Record {
        Record::new(self.experiment, self.seed)
    }

    /// Announces `total` steps of work; call [`Progress::step`] after each, from any thread. Work that is
    /// done within a second is not shown.
    pub fn progress(&self, what: &str, total: usize) -> Progress {
        self.display.start(&format!("{}: {what}", self.experiment), total)
    }
}

impl Experiment {
    /// Runs the experiment and checks its record. A panic becomes an error, so that the other experiments
    /// finish.
    pub fn execute(&self, context: &Context) -> Result<Record, ExperimentError> {
        // A panic leaves nothing behind that is used again: the context is read only, the record is lost.
        let outcome = catch_unwind(AssertUnwindSafe(|| (self.run)(context)));
        let record =
            outcome.unwrap_or_else(|payload| Err(ExperimentError::Panicked(panic_message(&*payload))))?;
        record.validate()?;
        Ok(record)
    }

    /// Whether the run in this context is the one that golden/ locks.
    pub fn is_locked_run(&self, context: &Context) -> bool {
        context.seed == self.seed && context.image.is_none()
    }
}

/// What a panic said.
fn panic_message(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().map(|text| text.to_string());
    text.or_else(|| payload.downcast_ref::<String>().cloned()).unwrap_or_else(|| "no message".to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn experiment(run: fn(&Context) -> Result<Record, ExperimentError>) -> Experiment {
        Experiment { id: "e", title: "", question: "", seed: 5, takes_image: false, run }
    }

    #[test]
    fn a_record_is_checked_before_it_is_given_out() {
        let without_claim = experiment(|context| Ok(context.record()));
        let result = without_claim.execute(&Context::of(&without_claim));
        assert!(matches!(result, Err(ExperimentError::Record(RecordError::NoClaim(_)))));
        let complete = experiment(|context| {
            let mut record = context.record();
            record.claim_that("c", "").at_most(0.0, 1.0).because("");
            Ok(record)
        });
        let record = complete.execute(&Context::of(&complete).with_seed(9)).unwrap();
        assert_eq!((record.experiment(), record.seed()), ("e", 9));
        assert!(!complete.is_locked_run(&Context::of(&complete).with_seed(9)));
    }

    #[test]
    fn a_panic_is_an_error_with_its_message() {
        let broken = experiment(|_| panic!("row 3"));
        let error = broken.execute(&Context::of(&broken)).unwrap_err();
        assert!(error.to_string().contains("row 3"), "{error}");
    }
}
