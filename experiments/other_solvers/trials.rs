//! How does a program do in the trials? It is asked in the words of the gate, on the noise of the studies.

use super::super::global_minimum::oracle;
use super::grid::GRIDS;
use super::row::{Answer, Ending, Row};
use calibench::board::View;
use calibench::calibrate::Termination;
use calibench::camera::Parameter;
use calibench_gate::Solver;
use calibench_gate::accept::{Estimate as Stated, Outcome};
use calibench_gate::protocol::Problem;
use calibench_study::{Calibrator, Cell, Estimate, Quantity, SpecError, Trial, in_memory_by};
use std::fmt::Debug;
use std::sync::{Arc, Mutex, PoisonError};

/// What is judged of a camera.
pub const JUDGED: [Parameter; 2] = [Parameter::Fx, Parameter::K2];

/// Trials with what single precision would have done to them.
pub struct Asked {
    /// A trial a row, cell after cell.
    pub rows: Vec<Row>,
    /// Of each row: root mean square of what single precision moves a pixel coordinate by, over the noise's
    /// standard deviation.
    pub rounding: Vec<f64>,
}

/// Asks a program about the first `trials` trials of every cell. Each of them is the same for every program.
///
/// # Errors
/// A study that cannot be run as written.
pub fn ask<S: Solver + Debug + Send + 'static>(solver: S, trials: u64) -> Result<Asked, SpecError> {
    let asking = Arc::new(Asking { solver, heard: Mutex::default() });
    let (mut rows, mut rounding, mut before) = (Vec::new(), Vec::new(), 0);
    for grid in &GRIDS {
        let mut done: Vec<Trial> = Vec::new();
        let engine = in_memory_by(asking.clone(), grid.spec(trials)?, grid.text(), |t| done.push(t.clone()))?;
        let heard = std::mem::take(&mut *asking.heard.lock().unwrap_or_else(PoisonError::into_inner));
        for (trial, heard) in done.iter().zip(heard) {
            rounding.push(heard.rounding);
            rows.push(row(trial, &engine.quantities, heard, before));
        }
        before += engine.cells.len();
    }
    Ok(Asked { rows, rounding })
}

fn row(trial: &Trial, quantities: &[Quantity], heard: Heard, before: usize) -> Row {
    let value = |wanted: Quantity| trial.values[quantities.iter().position(|q| *q == wanted)?];
    let errors = JUDGED.map(|p| value(Quantity::Parameter(p)));
    let answer = match (heard.ending, errors) {
        (Ending::Answered, [Some(fx), Some(k2)]) => {
            let Heard { stated, cost, .. } = heard;
            Some(Answer { errors: [fx, k2], stated, nees: value(Quantity::Nees), cost })
        }
        _ => None,
    };
    Row { cell: before + trial.cell, trial: trial.trial, ending: heard.ending, warned: heard.warned, answer }
}

/// A program that is asked, and what it said that no study keeps.
#[derive(Debug)]
struct Asking<S> {
    solver: S,
    heard: Mutex<Vec<Heard>>,
}

/// What is kept of an answer.
#[derive(Debug)]
struct Heard {
    ending: Ending,
    warned: bool,
    stated: Option<[f64; 2]>,
    cost: Option<f64>,
    rounding: f64,
}

impl<S: Solver + Debug + Send> Calibrator for Asking<S> {
    fn calibrate(&self, cell: &Cell, seen: &[Vec<View>]) -> Vec<Result<Estimate, String>> {
        let held = cell.held().expect("the studies hold nothing without a value");
        let problem = |(i, views): (usize, &Vec<View>)| {
            Problem::of_views(i.to_string(), cell.image_size(), views, &held, cell.free())
        };
        let problems: Vec<Problem> = seen.iter().enumerate().map(problem).collect();
        let replies = self.solver.ask_all(&problems);
        let mut heard = self.heard.lock().unwrap_or_else(PoisonError::into_inner);
        let taken = replies.into_iter().zip(seen).map(|(reply, views)| {
            heard.push(Heard::of(cell, views, &reply.outcome));
            estimate(reply.outcome)
        });
        taken.collect()
    }
}

/// What a study takes from an answer.
fn estimate(outcome: Outcome) -> Result<Estimate, String> {
    match outcome {
        Outcome::Estimate(stated) if stated.camera.is_possible() => Ok(Estimate {
            camera: stated.camera,
            cam_from_target: stated.cam_from_target,
            rmse_px: stated.rmse_px,
            covariance: stated.covariance,
            outcome: Termination::Converged.name().to_string(),
            iterations: 0,
        }),
        _ => Err("no-camera".to_string()),
    }
}

impl Heard {
    fn of(cell: &Cell, views: &[View], outcome: &Outcome) -> Heard {
        let rounding = rounding_px(views) / cell.noise_px();
        let silent = |ending| Heard { ending, warned: false, stated: None, cost: None, rounding };
        match outcome {
            Outcome::Estimate(stated) if stated.camera.is_possible() => Heard {
                ending: Ending::Answered,
                warned: !stated.warnings.is_empty(),
                stated: deviations(cell, stated),
                cost: cost(stated, views).map(|cost| cost / (cell.noise_px() * cell.noise_px())),
                rounding,
            },
            Outcome::Estimate(_) | Outcome::Broken(_) => silent(Ending::Broken),
            Outcome::Refused(_) => silent(Ending::Refused),
            Outcome::Unsupported(_) => silent(Ending::Unsupported),
        }
    }
}

/// The stated standard deviations of [`JUDGED`].
fn deviations(cell: &Cell, stated: &Stated) -> Option<[f64; 2]> {
    let all = stated.standard_deviations.as_ref()?;
    let of = |wanted: Parameter| all.get(cell.free().iter().position(|p| p == wanted)?).copied();
    let [fx, k2] = JUDGED.map(of);
    Some([fx?, k2?])
}

fn cost(stated: &Stated, views: &[View]) -> Option<f64> {
    let camera = stated.camera.brown_conrady()?;
    oracle::cost(&camera, stated.cam_from_target.as_ref()?, views).filter(|cost| cost.is_finite())
}

/// Root mean square of what single precision moves a pixel coordinate by, px.
fn rounding_px(views: &[View]) -> f64 {
    let pixels = || views.iter().flat_map(View::pixels).flat_map(|pixel| [pixel.x, pixel.y]);
    let squares: f64 = pixels().map(|x| f64::from(x as f32) - x).map(|moved| moved * moved).sum();
    (squares / pixels().count() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::geometry::Vec2;

    #[test]
    fn single_precision_moves_a_coordinate_by_less_than_half_of_its_last_digit() {
        // 0.1 and 511.3 in single precision are off by 1.49e-9 and 1.22e-5.
        let off = |x: f64| f64::from(x as f32) - x;
        let (a, b) = (off(0.1), off(511.3));
        assert!((a - 1.490_116e-9).abs() < 1e-14 && b.abs() < 0.5 / 32768.0 && b != 0.0);
        let view = View::new(vec![Vec2::zeros()], vec![Vec2::new(0.1, 511.3)]).unwrap();
        assert!((rounding_px(&[view]) - (0.5 * (a * a + b * b)).sqrt()).abs() < 1e-18);
    }
}
