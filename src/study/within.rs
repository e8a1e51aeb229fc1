//! How does an experiment use a study? Seeded by the experiment, told in its record, with its progress, and
//! without files.

use super::engine::{Engine, in_memory_seeing};
use super::spec::Spec;
use super::summary::{Summary, summarise};
use super::trial::Trial;
use calibench_harness::{Context, ExperimentError, Record};

/// Runs the study `text` within an experiment. `see` is shown every trial, in order.
///
/// # Errors
/// A study that cannot be run as written.
pub fn within(
    context: &Context,
    record: &mut Record,
    name: &str,
    text: &str,
    see: impl FnMut(&Trial),
) -> Result<(Engine, Summary), ExperimentError> {
    let mut spec = Spec::parse(text).map_err(ExperimentError::at("study"))?;
    spec.seed = context.seed;
    record.input(name, text.as_bytes());
    let cells: usize = spec.factor.iter().map(|factor| factor.count()).product();
    let progress = context.progress(name, cells * spec.trials.per_cell as usize);
    let mut done = 0;
    let engine = in_memory_seeing(spec, text, see, |pace| {
        progress.advance((pace.trials - done) as usize);
        done = pace.trials;
    })
    .map_err(ExperimentError::at("study"))?;
    let summary = summarise(&engine);
    Ok((engine, summary))
}
