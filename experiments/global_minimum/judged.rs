//! What did the solver make of a scene, held against the search from the truth?

use super::oracle::{self, Reference};
use super::scenes::Drawn;
use calibench::calibrate::{Calibration, CalibrationError, Termination, calibrate};
use calibench::camera::{FreeParameters, Parameter};
use calibench::evaluate::cramer_rao;
use std::fmt;
use std::time::Instant;

/// A cost is the reference's if it exceeds it by no more than this part of it ...
const SAME_COST: f64 = 1e-6;
/// ... and this many noise variances, for scenes with hardly more data than unknowns.
const SAME_COST_VARIANCES: f64 = 1e-6;

/// How a scene ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// Accepted, at the reference's cost or below.
    Right,
    /// Accepted, at a higher cost.
    Wrong,
    /// Given out with the word that it is no minimum.
    NotConverged,
    /// No result.
    Refused,
}

impl Class {
    /// All, in order.
    pub const ALL: [Class; 4] = [Class::Right, Class::Wrong, Class::NotConverged, Class::Refused];

    /// The word for it.
    pub fn name(self) -> &'static str {
        ["right", "wrong", "not-converged", "refused"][self as usize]
    }
}

impl fmt::Display for Class {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A scene and what became of it.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Its number.
    pub index: u64,
    /// Name of the layout.
    pub layout: &'static str,
    /// Name of the model.
    pub model: &'static str,
    /// What was free.
    pub free: FreeParameters,
    /// Number of views.
    pub views: usize,
    /// Marks of the target.
    pub points: usize,
    /// True fx, px.
    pub fx_true: f64,
    /// Image width, px.
    pub width_px: usize,
    /// Noise, px.
    pub noise_px: f64,
    /// Largest tilt, degrees.
    pub tilt_deg: f64,
    /// Coverage asked for.
    pub coverage: f64,
    /// Whether the solver knew the image size.
    pub size_given: bool,
    /// Cramer-Rao bound of sd(fx) over fx; infinite where the scene determines nothing.
    pub bound: f64,
    /// Measurements less unknowns.
    pub freedom: usize,
    /// Cost of the reference over the noise variance.
    pub reference: f64,
    /// Whether the reference is a minimum.
    pub reference_converged: bool,
    /// fx of the reference, px.
    pub reference_fx: f64,
    /// How it ended.
    pub class: Class,
    /// The termination or the error by name.
    pub ending: String,
    /// What the solver found, unless it refused.
    pub found: Option<Found>,
    /// Time of the solver, us.
    pub time_us: f64,
    /// The bits of the estimate, of its cost and of the reference.
    pub bits: Vec<u8>,
}

/// What the solver found.
#[derive(Debug, Clone)]
pub struct Found {
    /// Its cost less the reference's, over the noise variance.
    pub excess: f64,
    /// fx, px.
    pub fx: f64,
    /// Stated standard deviation of fx, px.
    pub fx_sd: f64,
    /// Root mean square error, px.
    pub rmse_px: f64,
    /// Normalised error squared of all free intrinsics.
    pub nees: f64,
    /// Error over stated standard deviation, of each free parameter in order.
    pub z: Vec<f64>,
    /// Kinds of its warnings.
    pub warnings: Vec<String>,
}

/// Runs solver and reference on a scene.
pub fn judge(drawn: &Drawn) -> Option<Judged> {
    let truth = drawn.truth();
    let variance = drawn.noise_px * drawn.noise_px;
    let reference = oracle::from_truth(truth, &drawn.views, drawn.free)?;
    let bound = cramer_rao(truth, drawn.free, drawn.noise_px)
        .ok()
        .and_then(|bound| bound.standard_deviation(Parameter::Fx))
        .map_or(f64::INFINITY, |sd| sd / truth.camera.fx);
    let settings = drawn.settings();
    let start = Instant::now();
    let answer = calibrate(&drawn.views, &settings);
    let time_us = start.elapsed().as_secs_f64() * 1e6;
    let bits = bits(&answer, &reference);
    let (class, ending) = classify(&answer, reference.cost, variance);
    let points = truth.points.len();
    let views = drawn.views.len();
    Some(Judged {
        index: drawn.index,
        layout: drawn.layout,
        model: drawn.model,
        free: drawn.free,
        views,
        points,
        fx_true: truth.camera.fx,
        width_px: truth.image_size.0,
        noise_px: drawn.noise_px,
        tilt_deg: drawn.tilt_deg,
        coverage: drawn.coverage,
        size_given: drawn.size_given,
        bound,
        freedom: 2 * views * points - 6 * views - drawn.free.len(),
        reference: reference.cost / variance,
        reference_converged: reference.converged,
        reference_fx: reference.camera.fx,
        class,
        ending,
        found: answer.ok().map(|c| Found::of(&c, drawn, (cost(&c) - reference.cost) / variance)),
        time_us,
        bits,
    })
}

/// Equal exactly when solver and reference gave the same bits.
fn bits(answer: &Result<Calibration, CalibrationError>, reference: &Reference) -> Vec<u8> {
    let mut numbers = reference.camera.parameters().to_vec();
    numbers.push(reference.cost);
    if let Ok(calibration) = answer {
        numbers.extend(calibration.camera.parameters());
        numbers.push(cost(calibration));
    }
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

fn classify(
    answer: &Result<Calibration, CalibrationError>,
    reference: f64,
    variance: f64,
) -> (Class, String) {
    let calibration = match answer {
        Ok(calibration) => calibration,
        Err(error) => return (Class::Refused, word(error)),
    };
    let ending = calibration.termination.name().to_string();
    let same = cost(calibration) <= reference * (1.0 + SAME_COST) + SAME_COST_VARIANCES * variance;
    let class = match (calibration.termination == Termination::Converged, same) {
        (true, true) => Class::Right,
        (true, false) => Class::Wrong,
        (false, _) => Class::NotConverged,
    };
    (class, ending)
}

/// Sum of squared residuals.
fn cost(calibration: &Calibration) -> f64 {
    calibration.residuals.iter().flatten().map(|r| r.norm_squared()).sum()
}

/// The variant's name.
fn word(value: &impl fmt::Debug) -> String {
    format!("{value:?}").chars().take_while(|c| c.is_alphanumeric()).collect()
}

impl Found {
    fn of(calibration: &Calibration, drawn: &Drawn, excess: f64) -> Found {
        let truth = &drawn.truth().camera;
        let error = |p| calibration.camera.get(p) - truth.get(p);
        let errors: Vec<f64> = drawn.free.iter().map(error).collect();
        let z = drawn
            .free
            .iter()
            .map(|p| error(p) / calibration.standard_deviation(p).unwrap_or(f64::NAN))
            .collect();
        Found {
            excess,
            fx: calibration.camera.fx,
            fx_sd: calibration.standard_deviation(Parameter::Fx).unwrap_or(0.0),
            rmse_px: calibration.rmse_px,
            nees: calibration.covariance.normalised_error_squared(&errors).unwrap_or(f64::NAN),
            z,
            warnings: calibration.warnings.iter().map(word).collect(),
        }
    }
}
