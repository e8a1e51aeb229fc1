//! What happens in one trial? Noise is drawn, a camera is calibrated without seeing the truth, and both are
//! compared.

use super::calibrator::{self, Calibrator, Estimate};
use super::cells::Cell;
use super::frame::Displacement;
use super::quantity::Quantity;
use calibench::board::View;
use calibench::calibrate::Termination;
use calibench::camera::{Lens, Model, Parameter};
use calibench::geometry::Vec2;
use calibench::synth::{Scene, Stream};
use std::borrow::Cow;
use std::ops::Range;

/// The result of one trial.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Index of the cell.
    pub cell: usize,
    /// Index of the trial in the cell.
    pub trial: u64,
    /// `converged`, `iteration-limit`, `stalled`, or `refused-...` with the reason.
    pub outcome: String,
    /// Steps of the refinement.
    pub iterations: usize,
    /// One value a quantity of the study; `None` where the trial has none.
    pub values: Vec<Option<f64>>,
}

/// The outcome whose values count in the statistics.
pub(super) const CONVERGED: &str = Termination::Converged.name();

impl Trial {
    /// Whether a minimum was found.
    pub fn converged(&self) -> bool {
        self.outcome == CONVERGED
    }
}

/// Runs trial `trial` of a cell with this library's solver. It depends on nothing but its arguments.
pub fn run_trial(cell: &Cell, quantities: &[Quantity], trial: u64) -> Trial {
    match seen_in(cell, trial) {
        Err(outcome) => failed(cell, quantities, trial, outcome),
        Ok((scene, views)) => {
            let estimate = calibrator::builtin(cell, &views);
            measured(cell, quantities, trial, &scene, estimate)
        }
    }
}

/// The same for several trials with somebody else's solver, which is asked all at once.
pub(super) fn run_trials_of(
    calibrator: &dyn Calibrator,
    cell: &Cell,
    quantities: &[Quantity],
    trials: Range<u64>,
) -> Vec<Trial> {
    let mut seen: Vec<Vec<View>> = Vec::new();
    let scenes: Vec<_> = trials
        .clone()
        .map(|trial| {
            seen_in(cell, trial).map(|(scene, views)| {
                seen.push(views);
                scene
            })
        })
        .collect();
    let mut estimates = calibrator.calibrate(cell, &seen).into_iter();
    let of_trial = |(trial, scene): (u64, Result<Cow<'_, Scene<Lens>>, String>)| match scene {
        Err(outcome) => failed(cell, quantities, trial, outcome),
        Ok(scene) => {
            let estimate = estimates.next().unwrap_or_else(|| Err("broken".to_string()));
            measured(cell, quantities, trial, &scene, estimate)
        }
    };
    trials.zip(scenes).map(of_trial).collect()
}

/// What a trial photographs, and what is seen of it.
type Seen<'a> = (Cow<'a, Scene<Lens>>, Vec<View>);

/// What a trial photographs and sees; where it cannot, the name of its outcome.
fn seen_in(cell: &Cell, trial: u64) -> Result<Seen<'_>, String> {
    let scene = scene_of(cell, trial)?;
    let views = observe(cell, &scene, trial).ok_or("refused-poses")?;
    Ok((scene, views))
}

/// What a trial photographs; without poses the name of its outcome.
fn scene_of(cell: &Cell, trial: u64) -> Result<Cow<'_, Scene<Lens>>, String> {
    match &cell.scene {
        Some(scene) => Ok(Cow::Borrowed(scene)),
        None => cell.draw_scene(trial).map(Cow::Owned).map_err(|_| "refused-poses".to_string()),
    }
}

fn measured(
    cell: &Cell,
    quantities: &[Quantity],
    trial: u64,
    scene: &Scene<Lens>,
    estimate: Result<Estimate, String>,
) -> Trial {
    match estimate {
        Err(outcome) => failed(cell, quantities, trial, outcome),
        Ok(estimate) => {
            let frame = match cell.measures_frame {
                true => Displacement::of(&cell.camera, &estimate.camera, cell.image_size()),
                false => Displacement::default(),
            };
            Trial {
                cell: cell.index,
                trial,
                iterations: estimate.iterations,
                values: quantities.iter().map(|q| measure(*q, cell, scene, &estimate, &frame)).collect(),
                outcome: estimate.outcome,
            }
        }
    }
}

fn failed(cell: &Cell, quantities: &[Quantity], trial: u64, outcome: String) -> Trial {
    Trial { cell: cell.index, trial, outcome, iterations: 0, values: vec![None; quantities.len()] }
}

/// Gaussian noise from one stream and gross errors from another, both drawn point by point whatever their
/// size: cells that differ in noise, outliers or model meet the same draws, and a longer series of views
/// begins with those of a shorter one. `None` where a bowed board reaches behind the camera.
fn observe(cell: &Cell, scene: &Scene<Lens>, trial: u64) -> Option<Vec<View>> {
    let (design, departure) = (&cell.design.scene, cell.departure());
    let mut noise = cell.stream(trial, "noise");
    let seen = match departure.is_none() {
        true => scene.observe(design.noise_px, &mut noise),
        // Without columns no noise is shared.
        false => {
            departure.observe(scene, design.target.columns().unwrap_or(1), design.noise_px, &mut noise)?
        }
    };
    if design.outlier_share == 0.0 {
        return Some(seen);
    }
    let mut stream = cell.stream(trial, "outliers");
    let spoilt = |view| spoil(view, design.outlier_share, design.outlier_px, &mut stream);
    Some(seen.iter().map(spoilt).collect())
}

fn spoil(view: &View, share: f64, half_width_px: f64, stream: &mut Stream) -> View {
    let pixels = view.pixels().iter().map(|pixel| {
        let [chance, du, dv] = std::array::from_fn(|_| stream.uniform());
        let jump = Vec2::new(2.0 * du - 1.0, 2.0 * dv - 1.0) * half_width_px;
        if chance < share { pixel + jump } else { *pixel }
    });
    View::new(view.points().to_vec(), pixels.collect()).expect("finite pixels stay finite, one a point")
}

fn measure(
    quantity: Quantity,
    cell: &Cell,
    scene: &Scene<Lens>,
    estimate: &Estimate,
    frame: &Displacement,
) -> Option<f64> {
    let truth = cell.camera.distortion;
    let error = |p: Parameter| {
        let is_comparable = cell.knows_its_lens() || is_the_same_thing(p, [cell.model(), truth.model()]);
        is_comparable.then(|| Some(estimate.camera.value(p)? - cell.camera.value(p)?)).flatten()
    };
    let value = match quantity {
        Quantity::Rmse => estimate.rmse_px?,
        Quantity::Nees => {
            let error: Vec<f64> = cell.free.iter().map(error).collect::<Option<_>>()?;
            estimate.normalised_error_squared(&error)?
        }
        Quantity::Parameter(p) if cell.free.contains(p) => error(p)?,
        Quantity::Parameter(_) => return None,
        Quantity::Depth => {
            let first = estimate.cam_from_target.as_ref()?.first()?;
            first.translation.z - scene.truth.cam_from_target[0].translation.z
        }
        Quantity::Length => {
            let (length, pixels) = cell.length.as_ref()?;
            length.error_mm(&estimate.camera, pixels)?
        }
        Quantity::Frame(of_frame) => frame.value(of_frame)?,
    };
    value.is_finite().then_some(value)
}

/// Whether a parameter means the same with different models: coefficients never do, of one name or not, and a
/// double sphere's focal length is not the scale of the image on the axis.
fn is_the_same_thing(parameter: Parameter, models: [Model; 2]) -> bool {
    match parameter {
        Parameter::Cx | Parameter::Cy | Parameter::Skew => true,
        Parameter::Fx | Parameter::Fy => !models.contains(&Model::DoubleSphere),
        _ => false,
    }
}
