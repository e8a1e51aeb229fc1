//! A Monte Carlo study in Python: the text of its file in, statistics with intervals and the columns of its trials out.

use crate::errors;
use crate::records::record;
use crate::watch::{interruptible, needs_threads};
use calibench_study::{
    CellSummary, Engine, Estimated, Spec, SpecError, Statistic, Trial, columns, in_memory_until, summarise,
};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// Trials that are kept in memory: some 500 bytes each.
const MOST_TRIALS: u64 = 10_000_000;

/// The study, if its trials fit into memory.
fn parsed(text: &str) -> Result<Spec, SpecError> {
    let spec = Spec::parse(text)?;
    let cells =
        spec.factor.iter().fold(1, |cells: u128, factor| cells.saturating_mul(factor.count() as u128));
    let needed = cells.saturating_mul(u128::from(spec.trials.per_cell));
    let advice = "run it with `calibench study run`, which writes them to a file";
    match needed <= u128::from(MOST_TRIALS) {
        true => Ok(spec),
        false => Err(SpecError::TooMuch { needed, limit: MOST_TRIALS, what: "trials in memory", advice }),
    }
}

/// Runs a Monte Carlo study, on all cores, to the bits that the command `calibench study run` gives.
///
/// Args:
///     text: the study as in a file of `calibench study`: TOML with the scene, its noise, the estimator, factors with their levels, and the trials. The README
///         of this package has one.
///
/// Returns:
///     Statistics of every cell with their intervals beside what the Cramer-Rao bound expects, and the columns of all trials.
///
/// Raises:
///     StudyError: the study cannot be run as written; ``numbers`` says what and where.
#[pyfunction]
pub(crate) fn run_study<'py>(py: Python<'py>, text: String) -> PyResult<Bound<'py, PyAny>> {
    needs_threads(py)?;
    let ran = interruptible(py, move |stop| -> Result<_, SpecError> {
        let mut trials = Vec::new();
        let see = |trial: &Trial| trials.push(trial.clone());
        // Where it is stopped, nobody waits for what it gives.
        let (engine, _) = in_memory_until(parsed(&text)?, &text, stop, see, |_| ())?;
        Ok((engine, trials))
    })?;
    let (engine, trials) = ran.map_err(|error| errors::study(py, &error))?;
    study(py, &engine, &trials)
}

fn study<'py>(py: Python<'py>, engine: &Engine, trials: &[Trial]) -> PyResult<Bound<'py, PyAny>> {
    let summary = summarise(engine);
    let cells = summary.cells.iter().map(|one| cell(py, one)).collect::<PyResult<Vec<_>>>()?;
    let fields = PyDict::new(py);
    fields.set_item("name", &engine.spec.name)?;
    fields.set_item("question", &engine.spec.question)?;
    fields.set_item("confidence", summary.confidence)?;
    fields.set_item("cells", PyTuple::new(py, cells)?)?;
    fields.set_item("trials", columns_of(py, engine, trials)?)?;
    record(py, "Study", &fields)
}

fn cell<'py>(py: Python<'py>, cell: &CellSummary) -> PyResult<Bound<'py, PyAny>> {
    let outcomes = PyDict::new(py);
    cell.outcomes.iter().try_for_each(|(outcome, count, _)| outcomes.set_item(outcome, count))?;
    let statistics = PyDict::new(py);
    for one in &cell.statistics {
        statistics.set_item(one.quantity.name(), statistic(py, one)?)?;
    }
    let fields = PyDict::new(py);
    fields.set_item("name", &cell.name)?;
    fields.set_item("labels", PyTuple::new(py, &cell.labels)?)?;
    fields.set_item("trials", cell.trials)?;
    fields.set_item("outcomes", outcomes)?;
    fields.set_item("statistics", statistics)?;
    record(py, "StudyCell", &fields)
}

fn statistic<'py>(py: Python<'py>, statistic: &Statistic) -> PyResult<Bound<'py, PyAny>> {
    let fields = PyDict::new(py);
    fields.set_item("unit", statistic.quantity.unit())?;
    fields.set_item("count", statistic.count)?;
    fields.set_item("mean", estimated(py, statistic.mean)?)?;
    fields.set_item("sd", estimated(py, statistic.sd)?)?;
    fields.set_item("rms", estimated(py, statistic.rms)?)?;
    fields.set_item("predicted_sd", statistic.predicted.map(|predicted| predicted.sd))?;
    fields.set_item("ratio", estimated(py, statistic.ratio)?)?;
    record(py, "Statistic", &fields)
}

fn estimated<'py>(py: Python<'py>, estimated: Option<Estimated>) -> PyResult<Option<Bound<'py, PyAny>>> {
    let of = |estimated: Estimated| {
        let fields = PyDict::new(py);
        fields.set_item("value", estimated.value)?;
        fields.set_item("low", estimated.low)?;
        fields.set_item("high", estimated.high)?;
        record(py, "Estimated", &fields)
    };
    estimated.map(of).transpose()
}

/// The columns of `trials.csv` by name; a value that a trial does not have is NaN.
fn columns_of<'py>(py: Python<'py>, engine: &Engine, trials: &[Trial]) -> PyResult<Bound<'py, PyDict>> {
    let of = |value: fn(&Trial) -> u64| PyArray1::from_iter(py, trials.iter().map(value));
    let found = PyDict::new(py);
    found.set_item("cell", of(|trial| trial.cell as u64))?;
    found.set_item("trial", of(|trial| trial.trial))?;
    found.set_item("outcome", trials.iter().map(|trial| trial.outcome.as_str()).collect::<Vec<_>>())?;
    found.set_item("iterations", of(|trial| trial.iterations as u64))?;
    for (index, name) in columns(&engine.quantities).into_iter().skip(found.len()).enumerate() {
        let values = trials.iter().map(|trial| trial.values[index].unwrap_or(f64::NAN));
        found.set_item(name, PyArray1::from_iter(py, values))?;
    }
    Ok(found)
}
