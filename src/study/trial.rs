//! What happens in one trial? Noise is drawn, a camera is calibrated without seeing the truth, and both are
//! compared.

use super::cells::Cell;
use super::quantity::Quantity;
use calibench::board::View;
use calibench::calibrate::{CalibrationError, LensCalibration, Termination, calibrate_lens};
use calibench::camera::{Lens, Model, Parameter};
use calibench::geometry::Vec2;
use calibench::synth::{Scene, Stream};

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

/// Runs trial `trial` of a cell. It depends on nothing but its arguments.
pub fn run_trial(cell: &Cell, quantities: &[Quantity], trial: u64) -> Trial {
    let drawn;
    let scene = match &cell.scene {
        Some(scene) => scene,
        None => match cell.draw_scene(trial) {
            Ok(scene) => {
                drawn = scene;
                &drawn
            }
            Err(_) => return failed(cell, quantities, trial, "refused-poses".to_string()),
        },
    };
    match calibrate_lens(&observe(cell, scene, trial), &cell.settings) {
        Err(error) => failed(cell, quantities, trial, format!("refused-{}", reason(&error))),
        Ok(calibration) => Trial {
            cell: cell.index,
            trial,
            // Where the world is not the model, as with gross errors, a minimum is a minimum.
            outcome: if calibration.termination.is_minimum() {
                CONVERGED
            } else {
                calibration.termination.name()
            }
            .to_string(),
            iterations: calibration.iterations,
            values: quantities.iter().map(|q| measure(*q, cell, scene, &calibration)).collect(),
        },
    }
}

fn failed(cell: &Cell, quantities: &[Quantity], trial: u64, outcome: String) -> Trial {
    Trial { cell: cell.index, trial, outcome, iterations: 0, values: vec![None; quantities.len()] }
}

/// Gaussian noise from one stream and gross errors from another, both drawn point by point whatever their
/// size: cells that differ in noise, outliers or model meet the same draws, and a longer series of views
/// begins with those of a shorter one.
fn observe(cell: &Cell, scene: &Scene<Lens>, trial: u64) -> Vec<View> {
    let design = &cell.design.scene;
    let exact = scene.observe(design.noise_px, &mut cell.stream(trial, "noise"));
    if design.outlier_share == 0.0 {
        return exact;
    }
    let mut stream = cell.stream(trial, "outliers");
    exact.iter().map(|view| spoil(view, design.outlier_share, design.outlier_px, &mut stream)).collect()
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
    calibration: &LensCalibration,
) -> Option<f64> {
    let truth = cell.camera.distortion;
    let error = |p: Parameter| {
        let is_comparable = cell.knows_its_lens() || is_the_same_thing(p, [cell.model(), truth.model()]);
        is_comparable.then(|| Some(calibration.camera.value(p)? - cell.camera.value(p)?)).flatten()
    };
    let value = match quantity {
        Quantity::Rmse => calibration.rmse_px,
        Quantity::Nees => {
            let error: Vec<f64> = calibration.free.iter().map(error).collect::<Option<_>>()?;
            calibration.covariance.normalised_error_squared(&error)?
        }
        Quantity::Parameter(p) if calibration.free.contains(p) => error(p)?,
        Quantity::Parameter(_) => return None,
        Quantity::Depth => {
            calibration.cam_from_target[0].translation.z - scene.truth.cam_from_target[0].translation.z
        }
        Quantity::Length => {
            let (length, pixels) = cell.length.as_ref()?;
            length.error_mm(&calibration.camera, pixels)?
        }
    };
    value.is_finite().then_some(value)
}

/// Whether a parameter means the same with different models: coefficients never do, of one name or not, and a double
/// sphere's focal length is not the scale of the image on the axis.
fn is_the_same_thing(parameter: Parameter, models: [Model; 2]) -> bool {
    match parameter {
        Parameter::Cx | Parameter::Cy | Parameter::Skew => true,
        Parameter::Fx | Parameter::Fy => !models.contains(&Model::DoubleSphere),
        _ => false,
    }
}

fn reason(error: &CalibrationError) -> &'static str {
    match error {
        CalibrationError::TooFewViews { .. } => "too-few-views",
        CalibrationError::TooFewPoints { .. } => "too-few-points",
        CalibrationError::View { .. } => "homography",
        CalibrationError::HeldWithoutValue { .. } | CalibrationError::BadHeldValue { .. } => "held-value",
        CalibrationError::BadLoss | CalibrationError::NarrowLoss { .. } => "loss",
        CalibrationError::Strays { .. } => "gross-errors",
        CalibrationError::NotIdentifiable { .. } => "not-identifiable",
        CalibrationError::NoStart { .. } => "no-start",
        _ => "refused",
    }
}
