//! How many digits of certified results do calibrators reach? Problems whose least-squares solution is known
//! to twenty digits.
//!
//! Expected: polished, this library's solver reaches what doubles can hold, eleven digits and more; as it is,
//! it stops where a step would gain less than 1e-14 of the cost, at some six to twelve digits, of which
//! measurements mean three or four. Only Brown-Conrady's lens can be polished; with the other models it is
//! asked as it is.
//!
//! What it cannot show: whether the least-squares solution is near the truth; `four-pose` and the gate ask
//! that. The other programs are not run here: `calibench gate certified --digits reference/digits.csv`
//! measured them, and what it wrote is read.

use calibench_gate::certified::{Digits, DigitsTable, Level, Measured, ReferenceProblem, measure, read_with};
use calibench_gate::solver::{Builtin, Polished, Solver};
use calibench_harness::project::Project;
use calibench_harness::{Band, Context, Experiment, ExperimentError, Record, Table};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "certified-digits",
    title: "Digits of certified results",
    question: "The least-squares solution of each problem in reference/ is certified to twenty digits by an \
               independent program. How many digits of it do calibrators reach? Expected: polished, this \
               library's solver eleven or more of every parameter, nine where tilts of two degrees hardly \
               separate focal length from distance; with the lens models that it cannot polish six, as it is.",
    seed: 1,
    takes_image: false,
    run,
};

/// Digits that the polished solver must reach.
const WANTED: f64 = 11.0;
/// The same for the near-degenerate problem.
const WANTED_NEAR_DEGENERATE: f64 = 9.0;
/// Digits that the solver must reach as it is, with the other lens models.
const WANTED_AS_IT_IS: f64 = 6.0;

/// What `--digits` wrote.
const DIGITS: &str = include_str!("../reference/digits.csv");

fn run(context: &Context) -> Result<Record, ExperimentError> {
    let mut record = context.record();
    let project = Project::find().map_err(ExperimentError::at("the source tree"))?;
    let problems = read_with(|name| project.read_text(&format!("reference/{name}")))
        .map_err(ExperimentError::at("the certified problems"))?;
    let committed = DigitsTable::of_csv(DIGITS).map_err(ExperimentError::at("the table of digits"))?;
    record.input("reference/digits.csv", DIGITS.as_bytes());

    let known = Polished.models();
    let can_be_polished = |p: &ReferenceProblem| known.contains(&p.problem.lens_model());
    let (problems, others): (Vec<_>, Vec<_>) = problems.into_iter().partition(can_be_polished);
    let (measured, plain) = (measure(&problems, &Polished), measure(&others, &Builtin));
    record.exact("").count("problems", problems.len() + others.len(), "certified problems");
    record.exact("").count("problems-brown", problems.len(), "certified problems of Brown-Conrady's lens");
    let reason = "the last digits of doubles: another order of sums moves them";
    let least = |measured: &Measured| measured.as_ref().map_or(0.0, Digits::least);
    for level in Level::ALL {
        let of_level = problems.iter().zip(&measured).filter(|(p, _)| p.reference.level == level);
        let least = of_level.map(|(_, m)| least(m)).fold(f64::INFINITY, f64::min);
        record.group("", Band::absolute(1.0, reason)).number(
            format!("least-{}", level.name()),
            least,
            format!("least digits of a parameter over the problems of level {}, polished", level.name()),
        );
    }
    record.group("", Band::absolute(1.0, reason)).number(
        "least-other-lenses",
        plain.iter().map(least).fold(f64::INFINITY, f64::min),
        "least digits of a parameter over the problems of the other lens models, as the solver is",
    );
    let reached = |(p, m): (&ReferenceProblem, &Measured)| {
        let wanted = if p.problem.id == "near-degenerate" { WANTED_NEAR_DEGENERATE } else { WANTED };
        (p.problem.id.clone(), m.as_ref().is_ok_and(|digits| digits.least() >= wanted))
    };
    record
        .claim_that(
            "digits-are-reached",
            "polished, this library's solver reaches 11 digits of every parameter of every problem of \
             Brown-Conrady's lens, 9 of the near-degenerate one",
        )
        .every("cases", problems.iter().zip(&measured).map(reached))
        .because("certified by an independent program in numbers of 40 and 60 digits: reference/README.md");
    let is_near = |(p, m): (&ReferenceProblem, &Measured)| {
        (p.problem.id.clone(), m.as_ref().is_ok_and(|digits| digits.least() >= WANTED_AS_IT_IS))
    };
    record
        .claim_that(
            "digits-of-other-lenses",
            "as it is, this library's solver reaches 6 digits of every parameter of every problem of the \
             other lens models",
        )
        .every("cases", others.iter().zip(&plain).map(is_near))
        .because("certified by an independent program in numbers of 40 and 60 digits: reference/README.md");
    let mut ours = DigitsTable::default();
    ours.add("calibench, polished", &problems, &measured);
    ours.add("calibench", &others, &plain);
    let is_current = |row: &calibench_gate::certified::Row| {
        (row.problem.clone(), committed.row(&row.solver, &row.problem) == Some(row))
    };
    record
        .claim_that(
            "table-is-current",
            "the committed table has the digits that the solver reaches now, polished where it can be",
        )
        .every("cases", ours.rows.iter().map(is_current))
        .because("the same bits on every machine");
    record.table(table(&committed));
    Ok(record)
}

/// Least digits, a row a problem and a column a solver.
fn table(committed: &DigitsTable) -> Table {
    let name = |solver: &str| solver.to_lowercase().replace([',', ' '], "_").replace("__", "_");
    let solvers = committed.solvers();
    let first = solvers.first().copied().unwrap_or_default();
    let digits =
        |solver: &str, problem: &str| committed.row(solver, problem).map_or("-".into(), |row| row.result());
    let caption = "digits that agree with the certified parameters, the least of each problem";
    Table::of("digits", caption, committed.rows.iter().filter(|row| row.solver == first))
        .column("problem", "", |row| row.problem.clone())
        .column("level", "", |row| row.level.name())
        .columns(solvers.iter().map(|solver| name(solver)), "", |row| {
            solvers.iter().map(|solver| digits(solver, &row.problem)).collect::<Vec<String>>()
        })
        .into()
}
