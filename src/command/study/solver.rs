//! `calibench study run --solver`: any program that speaks the gate's protocol calibrates what a study has
//! seen.

use super::super::{program, warn};
use super::Failure;
use calibench::board::View;
use calibench::calibrate::CalibrationError;
use calibench_gate::accept::Outcome;
use calibench_gate::protocol::Problem;
use calibench_gate::{Process, Solver};
use calibench_study::{Calibrator, Cell, Engine, Estimate};
use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};

#[derive(Debug, clap::Args)]
pub(super) struct ProgramArguments {
    /// Program that calibrates in place of this library's solver, on the same noise (see
    /// adapters/PROTOCOL.md)
    #[arg(long, value_name = "COMMAND")]
    pub solver: Option<String>,
    /// Copies of the program that run at the same time [default: one a thread]
    #[arg(long, value_name = "N", requires = "solver", value_parser = crate::said::whole::<usize>)]
    jobs: Option<usize>,
    /// Seconds that the program may take for a calibration
    #[arg(long, value_name = "SECONDS", default_value_t = 20.0, requires = "solver")]
    timeout: f64,
}

impl ProgramArguments {
    /// The engine, calibrated by the program if one is named.
    pub fn applied(&self, engine: Engine) -> Result<Engine, Failure> {
        let Some(command) = &self.solver else { return Ok(engine) };
        calibench_gate::program::adopt_orphans();
        let jobs = self.jobs.unwrap_or_else(rayon::current_num_threads);
        let process = program::process(command, self.timeout, jobs).map_err(Failure::usage)?;
        check(&engine.cells, &process)?;
        Ok(engine.calibrated_by(Arc::new(Program { process, told: Mutex::default() })))
    }
}

/// Refuses what the protocol cannot ask of a program, or what the program says that it does not know.
fn check(cells: &[Cell], process: &Process) -> Result<(), Failure> {
    let known = process.models();
    for cell in cells {
        let model = cell.model();
        if !known.contains(&model) {
            let names: Vec<&str> = known.iter().map(|model| model.name()).collect();
            return Err(Failure::usage(format!(
                "{}: the program does not say that it knows the lens model {model}, only {}: a greeting names others (adapters/PROTOCOL.md)",
                cell.name,
                names.join(", ")
            )));
        }
        if !cell.minimises_squares() {
            return Err(Failure::usage(format!(
                "{}: a program is asked for least squares only: leave estimator.loss out",
                cell.name
            )));
        }
        problem(cell, "", &[]).map_err(|error| Failure::usage(format!("{}: {error}", cell.name)))?;
    }
    Ok(())
}

fn problem(cell: &Cell, id: &str, views: &[View]) -> Result<Problem, CalibrationError> {
    Ok(Problem::of_views(id.to_string(), cell.image_size(), views, &cell.held()?, cell.free()))
}

/// A program behind two pipes.
#[derive(Debug)]
struct Program {
    process: Process,
    /// Outcomes whose first reason was told.
    told: Mutex<BTreeSet<&'static str>>,
}

impl Program {
    /// What a trial takes from an answer; the first reason of every other outcome is told at once.
    fn estimate(&self, outcome: Outcome) -> Result<Estimate, String> {
        estimate(outcome).map_err(|(name, reason)| {
            let is_first = self.told.lock().unwrap_or_else(PoisonError::into_inner).insert(name);
            if is_first {
                warn(&format!("first trial that is {name}: {reason}"));
            }
            name.to_string()
        })
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        calibench_gate::program::end_all();
    }
}

impl Calibrator for Program {
    fn calibrate(&self, cell: &Cell, seen: &[Vec<View>]) -> Vec<Result<Estimate, String>> {
        let asked = |(i, views): (usize, &Vec<View>)| problem(cell, &i.to_string(), views);
        let problems: Vec<Problem> =
            seen.iter().enumerate().map(asked).collect::<Result<_, _>>().expect("the cells were checked");
        let replies = self.process.ask_all(&problems);
        replies.into_iter().map(|reply| self.estimate(reply.outcome)).collect()
    }
}

/// What a trial takes from an answer, or the outcome's name and the reason. Warnings are not looked at, as
/// they are not for this library's solver.
fn estimate(outcome: Outcome) -> Result<Estimate, (&'static str, String)> {
    match outcome {
        Outcome::Estimate(estimate) if !estimate.camera.is_possible() => {
            Err(("broken", "a focal length that is not positive".to_string()))
        }
        Outcome::Estimate(estimate) => Ok(Estimate {
            camera: estimate.camera,
            cam_from_target: estimate.cam_from_target,
            rmse_px: estimate.rmse_px,
            covariance: estimate.covariance,
            outcome: calibench::calibrate::Termination::Converged.name().to_string(),
            iterations: 0,
        }),
        Outcome::Refused(reason) => Err(("refused-by-program", reason)),
        Outcome::Unsupported(reason) => Err(("unsupported", reason)),
        Outcome::Broken(breakage) => Err(("broken", breakage.to_string())),
    }
}
