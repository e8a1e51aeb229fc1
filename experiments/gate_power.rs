//! Does the gate notice a faulty calibrator, and after how many problems? Does it leave a correct one in
//! peace?
//!
//! Expected: every gross fault fails the gate within a few hundred problems, far inside a quick run; the
//! correct solver passes.
//!
//! What it cannot show: faults of a kind that nobody thought of. The subtle faults need thousands of samples
//! a scenario, and false alarms hundreds of runs: they are measured by
//! `calibench gate power golden/gate-power --size thorough`, and what that wrote is read here. It is
//! refused as stale when a line of the gate or of the solver has changed since.

use calibench_gate::faults::{Class, Planted, planted};
use calibench_gate::power::{Catch, FaultRow, Measured, catch, false_alarms};
use calibench_gate::suite::suite;
use calibench_harness::fingerprint::Fingerprint;
use calibench_harness::{Band, Context, Experiment, ExperimentError, Record, Table};
use rayon::prelude::*;

mod figures;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "gate-power",
    title: "What the gate catches, and how soon",
    question: "Faults of the kinds that calibrators have are planted in the correct solver: exchanged \
               parameters, wrong signs, definitions and units, lost views, rounded data, searches that end \
               too early, confident answers to degenerate data. Which of them does the gate catch, after \
               how many problems, and by which property? Expected: every gross one within 32 samples a \
               scenario, and the correct solver not at all.",
    seed: 1,
    takes_image: false,
    run,
};

/// Most samples a scenario: a quarter of a quick run.
const MOST_SAMPLES: usize = 32;
/// Chance that the correct solver fails in this experiment.
const FALSE_ALARM_RATE: f64 = 1e-4;
/// Stated rates at which false alarms were counted.
const STATED_RATES: usize = 4;

/// The command of the thorough measurement.
const COMMAND: &str = "calibench gate power golden/gate-power --size thorough";

/// What the thorough measurement wrote.
const FAULTS: &str = include_str!("../golden/gate-power/faults.csv");
const FALSE_ALARMS: &str = include_str!("../golden/gate-power/false-alarms.csv");
const TEXTBOOK: &str = include_str!("../golden/gate-power/textbook.csv");

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
    let reason = "p-value of sums over the solver's results: bits of the solver move it in its last digits";
    record
        .exact("")
        .count("samples-at-most", MOST_SAMPLES, "samples a scenario at which this run stops looking")
        .count("planted-faults", all, "planted faults, gross and subtle")
        .count("gross-faults", faults.len(), "gross faults")
        .count("gross-caught", caught, "gross faults caught")
        .count("most-problems", largest, "problems asked for the last of them")
        .band(Band::relative(1e-3, reason))
        .number(
            "clean-p-value",
            smallest,
            "smallest p-value of the correct solver times the number of checks",
        );
    record
        .claim_that(
            "gross-faults-are-caught",
            "every gross fault fails the gate within 32 samples a scenario",
        )
        .every("faults", faults.iter().zip(&catches).map(|(f, c)| (f.id.to_string(), c.samples.is_some())))
        .because("the gate's own decision: Holm's procedure at its stated overall rate");
    record
        .claim_that("correct-solver-passes", "the correct solver is not failed by any statistical check")
        .at_least(smallest, FALSE_ALARM_RATE)
        .at_rate(FALSE_ALARM_RATE)
        .because("Bonferroni over all statistical checks of the run");
    record
        .claim_that(
            "correct-solver-fails-nothing-certain",
            "the correct solver fails no check that leaves nothing to chance",
        )
        .every(
            "cases",
            std::iter::once(("correct solver".to_string(), clean.certain.is_empty()))
                .chain(clean.certain.iter().map(|line| (line.clone(), false))),
        )
        .because("exact data, the same bits twice, invariances, refusals");
    record.table(table(&faults, &catches));
    thorough(&mut record)?;
    let scenarios = suite().map_err(ExperimentError::at("the gate's suite"))?.len();
    record.figure(figures::steps(scenarios, all));
    Ok(record)
}

/// The committed measurement: is it of the faults that are planted now, does it catch them, do false alarms
/// keep their rate?
fn thorough(record: &mut Record) -> Result<(), ExperimentError> {
    let measured = Measured::of_csv([FAULTS, FALSE_ALARMS, TEXTBOOK])
        .map_err(ExperimentError::at("the thorough measurement"))?;
    record.input("golden/gate-power/faults.csv", FAULTS.as_bytes());
    record.input("golden/gate-power/false-alarms.csv", FALSE_ALARMS.as_bytes());
    claim_current(record);
    let row_of = |fault: &Planted| measured.faults.iter().find(|row| row.fault == fault.id);
    let is_current = |row: &FaultRow, fault: &Planted| row.class == fault.class && row.what == fault.about;
    let caught = |fault: &Planted| {
        row_of(fault).is_some_and(|row| is_current(row, fault) && row.samples_a_scenario.is_some())
    };
    record
        .claim_that(
            "every-fault-is-caught-thoroughly",
            "the thorough measurement is of the faults planted now, and catches each",
        )
        .every("faults", planted().iter().map(|fault| (fault.id.to_string(), caught(fault))))
        .because("the gate's own decision, up to 8192 samples a scenario");
    let samples = measured.faults.iter().filter_map(|row| row.samples_a_scenario).max().unwrap_or(0);
    let what = "samples a scenario that the last planted fault takes, thorough measurement";
    record.exact("").count("most-samples-needed", samples, what);
    if let Some(row) = measured.alarms.first() {
        let what = "quick runs of the correct solver in which false alarms were counted";
        record.exact("").count("quick-runs", row.seeds, what);
    }
    for textbook in &measured.misled {
        let draws = "samples of that scenario on which the textbook's error bars were measured";
        let rate = textbook.misled as f64 / textbook.draws as f64;
        record
            .exact("")
            .suffix(format!("-{}", textbook.scenario), "")
            .number("textbook-draws", textbook.draws as f64, draws)
            .number("textbook-misled", rate, "share of them in which the textbook is confidently wrong");
    }
    for row in &measured.alarms {
        let per_thousand = 1000.0 * row.stated_rate;
        let what = "rate at which the gate was told to be wrong";
        let name = format!("false-alarms-at-{per_thousand}-per-thousand");
        record.exact("").number(format!("stated-rate-{per_thousand}"), row.stated_rate, what).count(
            &name,
            row.alarms,
            "failed runs of the correct solver, thorough measurement",
        );
        record
            .claim_that(
                &name,
                format!(
                    "at a stated rate of {per_thousand} in a thousand, no more quick runs of the correct \
                     solver fail than that"
                ),
            )
            .at_most(row.alarms as f64, row.most(FALSE_ALARM_RATE / STATED_RATES as f64) as f64)
            .at_rate(FALSE_ALARM_RATE / STATED_RATES as f64)
            .because(format!(
                "binomial over {} seeds from {}; Holm's procedure keeps the rate or stays below",
                row.seeds, row.first_seed
            ));
    }
    let class = |class: &Class| match class {
        Class::Gross => "gross",
        Class::Subtle => "subtle",
    };
    let problems = |row: &FaultRow| {
        let asked = row.problems.to_string();
        if row.samples_a_scenario.is_some() { asked } else { format!("not in {asked}") }
    };
    let caption = "every planted fault, up to 8192 samples a scenario: when and by what it is caught";
    record.table(
        Table::of("thorough", caption, &measured.faults)
            .column("fault", "", |row| row.fault.clone())
            .column("class", "", |row| class(&row.class))
            .column("problems", "", |row| problems(row))
            .column("verdict", "", |row| row.verdict.clone())
            .column("property", "", |row| row.property.clone())
            .column("what", "", |row| row.what.clone()),
    );
    Ok(())
}

/// The committed tables are of the gate and the solver that run now.
fn claim_current(record: &mut Record) {
    let present = Fingerprint::of_gate_power();
    let files = [("faults.csv", FAULTS), ("false-alarms.csv", FALSE_ALARMS), ("textbook.csv", TEXTBOOK)];
    let cases = files.map(|(name, text)| present.case(name, text, COMMAND));
    record
        .claim_that(
            "thorough-measurement-is-current",
            "the thorough measurement is of the present gate and the present solver",
        )
        .every("cases", cases)
        .because("SHA-256 of their code lines and the versions of the numeric crates");
}

fn table(faults: &[Planted], catches: &[Catch]) -> Table {
    let caption = "gross faults: when and by what each is caught";
    Table::of("faults", caption, faults.iter().zip(catches))
        .column("fault", "", |(fault, _)| fault.id)
        .column("samples_a_scenario", "", |(_, caught)| {
            caught.samples.map_or("not caught".to_string(), |n| n.to_string())
        })
        .column("problems", "", |(_, caught)| caught.problems.to_string())
        .column("verdict", "", |(_, caught)| caught.verdict.word())
        .column("property", "", |(_, caught)| caught.by.first().map_or("-", |p| p.name()))
        .column("what", "", |(fault, _)| fault.about)
        .into()
}
