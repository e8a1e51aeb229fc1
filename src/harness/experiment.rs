//! What is an experiment? A question, a default seed, and a function from a context to a record.

use super::progress::{Progress, ProgressDisplay};
use super::record::{Record, RecordError};
use std::path::PathBuf;

/// An experiment: one file in experiments/.
#[derive(Debug, Clone, Copy)]
pub struct Experiment {
    /// Name in kebab-case, such as `four-pose`: of the binary, the folder in out/ and figures/, and the snapshot.
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
    /// Folder of third-party measurements, when it is there.
    pub data: Option<PathBuf>,
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
    /// A file cannot be read or written.
    #[error("{path}: {source}", path = path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The user's input cannot be used.
    #[error("{0}")]
    Input(String),
    /// A step failed that should not.
    #[error("{step}: {source}")]
    Step {
        /// What was being done.
        step: &'static str,
        /// Why it failed.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
}

impl ExperimentError {
    /// Names the step that failed: `.map_err(ExperimentError::at("closed form"))?`.
    pub fn at<E>(step: &'static str) -> impl Fn(E) -> ExperimentError
    where
        E: Into<Box<dyn std::error::Error + Send + Sync>>,
    {
        // `Fn` because it is handed to `map_err` inside loops and iterators as well.
        move |source| ExperimentError::Step { step, source: source.into() }
    }
}

impl Context {
    /// A context with the default seed, the data folder of the environment, no image and no progress shown.
    pub fn of(experiment: &Experiment) -> Context {
        Context {
            experiment: experiment.id,
            seed: experiment.seed,
            data: super::project::data_folder(),
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

    /// Announces `total` steps of work; call [`Progress::step`] after each, from any thread. Work that is done within a
    /// second is not shown.
    pub fn progress(&self, what: &str, total: usize) -> Progress {
        self.display.start(&format!("{}: {what}", self.experiment), total)
    }
}

impl Experiment {
    /// Runs the experiment and checks its record.
    pub fn execute(&self, context: &Context) -> Result<Record, ExperimentError> {
        let record = (self.run)(context)?;
        record.validate()?;
        Ok(record)
    }

    /// Whether the run in this context is the one that golden/ locks.
    pub fn is_locked_run(&self, context: &Context) -> bool {
        context.seed == self.seed && context.image.is_none()
    }
}
