//! How many instructions does a kernel take? Repeats one row's work, for `valgrind` to count: `instructions ROW TIMES`.
//!
//! `.ci/instructions` runs it with two counts; the difference is that of the repetitions, without making the input.

mod common;
mod works;

use calibench::harness::study;

/// A batch of the study of four poses, as `study run` does it but for the files.
const STUDY: &str = include_str!("../studies/four-pose.toml");

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [row, times] = &arguments[..] else { return Err("usage: instructions ROW TIMES".into()) };
    let times: usize = times.parse()?;
    if row == "study" {
        let mut spec = study::Spec::parse(STUDY)?;
        spec.trials.per_cell = times as u64;
        spec.trials.batch = times as u64;
        study::in_memory(spec, STUDY, |_| {})?;
        return Ok(());
    }
    works::named(row).ok_or_else(|| format!("no row {row}"))?.repeat(times);
    Ok(())
}
