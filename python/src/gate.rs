//! The gate in Python: a function of Python's, a program or this library's solver is asked, and its answers are judged.

use crate::arrays::of_plane;
use crate::records::record;
use crate::watch::{detached, needs_threads};
use calibench::camera::{Model, UnknownModel};
use calibench::geometry::Vec2;
use calibench_gate::accept::Breakage;
use calibench_gate::protocol::{Answer, Problem};
use calibench_gate::solver::Given;
use calibench_gate::{Asked, Builtin, Check, Plan, Process, Property, Report as Judged, Solver, Terms, run};
use pyo3::exceptions::{PyException, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Copies of a program: each is a process and three threads.
const MOST_JOBS: usize = 1024;

/// How a run is made and judged.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Options {
    samples: usize,
    seed: u64,
    false_alarms: f64,
    accept: Vec<String>,
    median_time: Option<f64>,
    /// Lens models; empty for those that the solver knows.
    models: Vec<String>,
    /// Names of scenes; empty for all.
    scenes: Vec<String>,
}

impl Options {
    /// What is asked; of a solver that knows `known` unless lens models were named.
    fn plan(&self, known: impl FnOnce() -> Vec<Model>) -> PyResult<Plan> {
        let wrong = |message: String| PyValueError::new_err(message);
        if self.samples == 0 {
            return Err(wrong("samples must be at least 1".into()));
        }
        let named: Result<Vec<Model>, UnknownModel> = self.models.iter().map(|name| name.parse()).collect();
        let named = named.map_err(|e| wrong(e.to_string()))?;
        let models = if named.is_empty() { known() } else { named };
        let asked = Asked { models, scenes: self.scenes.clone() };
        Plan::of(self.seed, self.samples, asked).map_err(|e| wrong(e.to_string()))
    }

    fn terms(&self) -> PyResult<Terms> {
        if let Some(seconds) = self.median_time.filter(|seconds| seconds.is_nan() || *seconds <= 0.0) {
            return Err(PyValueError::new_err(format!(
                "median_time = {seconds}: expected a positive number of seconds"
            )));
        }
        if !(self.false_alarms > 0.0 && self.false_alarms < 1.0) {
            return Err(PyValueError::new_err("false_alarms must lie between 0 and 1"));
        }
        let property = |name: &String| {
            let known = Property::ALL.iter().find(|p| p.name() == name);
            known.copied().ok_or_else(|| {
                PyValueError::new_err(format!(
                    "no property {name:?}; there are: {}",
                    gate_properties().join(", ")
                ))
            })
        };
        let accepted = self.accept.iter().map(property).collect::<PyResult<Vec<_>>>()?;
        Ok(Terms {
            false_alarm_rate: self.false_alarms,
            accepted,
            median_seconds: self.median_time,
            ..Terms::default()
        })
    }
}

/// What is judged, in the order of reports.
#[pyfunction]
pub(crate) fn gate_properties() -> Vec<&'static str> {
    Property::ALL.iter().map(|property| property.name()).collect()
}

/// Digits that a number shares with a certified one: `-log10(|x - c| / |c|)`, of a certified 0 `-log10(|x|)`, between 0 and 15 (McCullough
/// 1998).
#[pyfunction]
pub(crate) fn digits(estimate: f64, certified: f64) -> f64 {
    // Minus the logarithm of 1 is -0.
    calibench_gate::certified::log_relative_error(estimate, certified) + 0.0
}

fn judged(solver: &dyn Solver, plan: &Plan, terms: &Terms) -> Judged {
    let started = Instant::now();
    let seen = run(plan, solver, &|_| ());
    Judged::new(plan, &solver.name(), &seen, terms, started.elapsed().as_secs_f64())
}

/// `run_gate` of this library's solver.
#[pyfunction]
pub(crate) fn gate_builtin(py: Python<'_>, options: Options) -> PyResult<Report> {
    let (plan, terms) = (options.plan(|| Builtin.models())?, options.terms()?);
    needs_threads(py)?;
    detached(py, true, move || judged(&Builtin, &plan, &terms)).map(Report)
}

/// `run_gate` of a program.
#[pyfunction]
pub(crate) fn gate_command(
    py: Python<'_>,
    command: String,
    timeout: f64,
    jobs: usize,
    options: Options,
) -> PyResult<Report> {
    let terms = options.terms()?;
    // Mistakes are told before the program is started.
    options.plan(|| Model::ALL.to_vec())?;
    let limit = Duration::try_from_secs_f64(timeout).ok().filter(|limit| !limit.is_zero());
    let limit = limit.ok_or_else(|| PyValueError::new_err("timeout must be a positive number of seconds"))?;
    if !(1..=MOST_JOBS).contains(&jobs) {
        return Err(PyValueError::new_err(format!("jobs = {jobs}: expected 1 to {MOST_JOBS}")));
    }
    needs_threads(py)?;
    let program = Arc::new(Process::new(&command, limit, jobs));
    let asked = Arc::clone(&program);
    let report = detached(py, true, move || {
        options.plan(|| asked.models()).map(|plan| judged(&*asked, &plan, &terms))
    });
    if report.is_err() {
        py.detach(|| program.stop());
    }
    report?.map(Report)
}

/// `run_gate` of a function from the fields of a problem to those of an answer.
#[pyfunction]
pub(crate) fn gate_solver(
    py: Python<'_>,
    name: String,
    ask: Py<PyAny>,
    options: Options,
) -> PyResult<Report> {
    let solver = Function { name, ask, stopped: Mutex::new(None) };
    let (plan, terms) = (options.plan(|| solver.models())?, options.terms()?);
    needs_threads(py)?;
    let report = py.detach(|| judged(&solver, &plan, &terms));
    match solver.stopped.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some(stop) => Err(stop),
        None => Ok(Report(report)),
    }
}

/// A function of Python's that takes the fields of a problem and gives those of an answer.
struct Function {
    name: String,
    ask: Py<PyAny>,
    /// What ended the run: Ctrl-C, and whatever else is no `Exception`.
    stopped: Mutex<Option<PyErr>>,
}

impl Function {
    fn stopped(&self) -> bool {
        self.stopped.lock().unwrap_or_else(PoisonError::into_inner).is_some()
    }

    fn broken(&self, py: Python<'_>, error: PyErr) -> Breakage {
        let text = error.to_string();
        if !error.is_instance_of::<PyException>(py) {
            *self.stopped.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
        }
        Breakage::Crashed { how: "an exception".to_string(), stderr: text }
    }
}

impl Solver for Function {
    fn name(&self) -> String {
        self.name.clone()
    }

    fn ask(&self, problem: &Problem) -> Result<Answer, Breakage> {
        if self.stopped() {
            return Err(Breakage::NotAsked("the run was ended".to_string()));
        }
        Python::attach(|py| {
            let answer = fields(py, problem).and_then(|fields| self.ask.bind(py).call1((fields,)));
            let answer = answer.map_err(|error| self.broken(py, error))?;
            let garbage = |error: pythonize::PythonizeError| Breakage::Garbage {
                reason: error.to_string(),
                line: answer.to_string(),
            };
            pythonize::depythonize(&answer).map_err(garbage)
        })
    }

    /// One after the other, in the thread that called: solvers need not be made for several, and Ctrl-C is heard there.
    fn give_all(&self, problems: &[Problem]) -> Vec<Given> {
        problems.iter().map(|problem| Given::taken(|| self.ask(problem))).collect()
    }
}

/// A problem as the fields of `calibench.gate.Problem`.
fn fields<'py>(py: Python<'py>, problem: &Problem) -> PyResult<Bound<'py, PyDict>> {
    let array =
        |list: &[[f64; 2]]| of_plane(py, &list.iter().map(|&[x, y]| Vec2::new(x, y)).collect::<Vec<_>>());
    let fields = PyDict::new(py);
    fields.set_item("id", &problem.id)?;
    fields.set_item("image_size", (problem.image_size[0], problem.image_size[1]))?;
    fields.set_item("model", &problem.model)?;
    let points = problem.views.iter().map(|view| array(&view.target)).collect::<PyResult<Vec<_>>>()?;
    let pixels = problem.views.iter().map(|view| array(&view.pixels)).collect::<PyResult<Vec<_>>>()?;
    fields.set_item("points", points)?;
    fields.set_item("pixels", pixels)?;
    fields.set_item("free", PyTuple::new(py, &problem.free)?)?;
    fields.set_item("hold", pythonize::pythonize(py, &problem.held)?)?;
    Ok(fields)
}

/// What the gate found.
#[pyclass(frozen, module = "calibench")]
#[derive(Debug)]
pub(crate) struct Report(Judged);

fn check<'py>(py: Python<'py>, check: &Check) -> PyResult<Bound<'py, PyAny>> {
    let fields = PyDict::new(py);
    fields.set_item("property", check.property.name())?;
    fields.set_item("scenario", check.scenario)?;
    fields.set_item("verdict", check.verdict.word())?;
    fields.set_item("evidence", &check.evidence)?;
    fields.set_item("problems", check.problems)?;
    record(py, "Check", &fields)
}

#[pymethods]
impl Report {
    /// Name or command of the solver.
    #[getter]
    fn solver(&self) -> &str {
        &self.0.solver
    }

    /// Whether nothing fails.
    #[getter]
    fn held(&self) -> bool {
        self.0.held()
    }

    /// The worst verdict.
    #[getter]
    fn verdict(&self) -> &'static str {
        self.0.verdict.word()
    }

    /// Number of problems asked.
    #[getter]
    fn problems(&self) -> usize {
        self.0.problems
    }

    /// Wall-clock time, s.
    #[getter]
    fn seconds(&self) -> f64 {
        self.0.seconds
    }

    /// Every check, judged.
    #[getter]
    fn checks<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.0.checks.iter().map(|c| check(py, c)).collect::<PyResult<Vec<_>>>()?)
    }

    /// The report on one screen.
    #[pyo3(signature = (columns = 100))]
    fn to_text(&self, columns: usize) -> String {
        self.0.to_text(columns)
    }

    /// What fails, in full.
    fn details(&self) -> String {
        self.0.details()
    }

    /// The report as JSON.
    fn to_json(&self) -> String {
        self.0.to_json()
    }

    /// The report as JUnit XML.
    fn to_junit(&self) -> String {
        self.0.to_junit()
    }

    /// The report as a page.
    fn to_html(&self) -> String {
        self.0.to_html()
    }

    fn __repr__(&self) -> String {
        format!(
            "Report(solver={:?}, verdict={:?}, problems={})",
            self.0.solver,
            self.verdict(),
            self.0.problems
        )
    }
}
