//! Does the gate notice a faulty calibrator, and after how many problems? Does it leave a correct one in peace?
//!
//! Expected: every gross fault fails the gate within a few hundred problems, far inside a quick run; the correct solver passes.
//!
//! What it cannot show: faults of a kind that nobody thought of. The subtle faults need thousands of samples a scenario; their
//! table stands in golden/gate-power-thorough.csv, made by `calibench gate --power FILE --size thorough`.

use calibench::harness::gate::faults::{Class, Planted, planted};
use calibench::harness::gate::power::{Catch, catch, false_alarms};
use calibench::harness::{Band, Claim, Context, Experiment, ExperimentError, Record, Table};
use rayon::prelude::*;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "gate-power",
    title: "What the gate catches, and how soon",
    question: "Faults of the kinds that calibrators have are planted in the correct solver: exchanged parameters, wrong \
               signs, definitions and units, lost views, rounded data, searches that end too early, confident answers to \
               degenerate data. Which of them does the gate catch, after how many problems, and by which property? \
               Expected: every gross one within 32 samples a scenario, and the correct solver not at all.",
    seed: 1,
    takes_image: false,
    run,
};

calibench::experiment_main!(EXPERIMENT);

/// Most samples a scenario: a quarter of a quick run.
const MOST_SAMPLES: usize = 32;
/// Chance that the correct solver fails in this experiment.
const FALSE_ALARM_RATE: f64 = 1e-4;

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let faults: Vec<Planted> = planted().into_iter().filter(|f| f.class == Class::Gross).collect();
    let progress = context.progress("planted faults", faults.len());
    let catches: Vec<Catch> = faults
        .par_iter()
        .map(|fault| {
            let caught = catch(*fault, context.seed, MOST_SAMPLES);
            progress.step();
            caught
        })
        .collect::<Result<_, _>>()
        .map_err(ExperimentError::at("planted faults"))?;
    let clean = false_alarms(context.seed, 1, MOST_SAMPLES, &|_| ())
        .map_err(ExperimentError::at("correct solver"))?;
    let smallest = clean.smallest.first().copied().unwrap_or(f64::NAN);

    let caught = catches.iter().filter(|c| c.samples.is_some()).count();
    let largest = catches.iter().map(|c| c.problems).max().unwrap_or(0);
    let all = planted().len();
    record.number("planted-faults", all as f64, "", Band::Exact, "planted faults, gross and subtle");
    record.number("gross-faults", faults.len() as f64, "", Band::Exact, "gross faults");
    record.number("gross-caught", caught as f64, "", Band::Exact, "gross faults caught");
    record.number("most-problems", largest as f64, "", Band::Exact, "problems asked for the last of them");
    let reason = "p-value of sums over the solver's results: bits of the solver move it in its last digits";
    record.number(
        "clean-p-value",
        smallest,
        "",
        Band::relative(1e-3, reason),
        "smallest p-value of the correct solver times the number of checks",
    );
    record.claim(Claim::all_of(
        "gross-faults-are-caught",
        "every gross fault fails the gate within 32 samples a scenario",
        faults.iter().zip(&catches).map(|(f, c)| (f.id.to_string(), c.samples.is_some())),
        "the gate's own decision: Holm's procedure at its stated overall rate",
    ));
    record.claim(
        Claim::at_least(
            "correct-solver-passes",
            "the correct solver is not failed by any statistical check",
            smallest,
            FALSE_ALARM_RATE,
            "Bonferroni over all statistical checks of the run",
        )
        .with_false_alarm_rate(FALSE_ALARM_RATE),
    );
    record.claim(Claim::all_of(
        "correct-solver-fails-nothing-certain",
        "the correct solver fails no check that leaves nothing to chance",
        std::iter::once(("correct solver".to_string(), clean.certain.is_empty()))
            .chain(clean.certain.iter().map(|line| (line.clone(), false))),
        "exact data, the same bits twice, invariances, refusals",
    ));
    record.table(table(&faults, &catches));
    Ok(record)
}

fn table(faults: &[Planted], catches: &[Catch]) -> Table {
    let columns = [
        ("fault", ""),
        ("samples_a_scenario", ""),
        ("problems", ""),
        ("verdict", ""),
        ("property", ""),
        ("what", ""),
    ];
    let mut table = Table::new("faults", "gross faults: when and by what each is caught", &columns);
    for (fault, caught) in faults.iter().zip(catches) {
        table.push([
            fault.id.to_string(),
            caught.samples.map_or("not caught".to_string(), |n| n.to_string()),
            caught.problems.to_string(),
            caught.verdict.word().to_string(),
            caught.by.first().map_or("-", |p| p.name()).to_string(),
            fault.about.to_string(),
        ]);
    }
    table
}
