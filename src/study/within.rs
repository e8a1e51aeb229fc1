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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::example::STUDY;
    use calibench_harness::Experiment;

    #[test]
    fn a_study_within_an_experiment_has_its_seed_and_is_told_in_its_record() {
        let run = |context: &Context| Ok(context.record());
        let experiment = Experiment { id: "e", title: "", question: "", seed: 5, takes_image: false, run };
        let context = Context::of(&experiment);
        let mut record = context.record();
        let mut seen = Vec::new();
        let see = |trial: &Trial| seen.push(trial.clone());
        let (engine, summary) = within(&context, &mut record, "two-cells", STUDY, see).unwrap();
        assert_eq!((engine.spec.seed, record.inputs()[0].name.as_str()), (5, "two-cells"));
        assert_eq!(summary, summarise(&engine));
        // As the same study with that seed.
        let text = STUDY.replace("seed = 1", "seed = 5");
        let mut alone = Vec::new();
        let spec = Spec::parse(&text).unwrap();
        in_memory_seeing(spec, &text, |trial| alone.push(trial.clone()), |_| ()).unwrap();
        assert!(seen == alone && seen.len() == 6);
    }
}
