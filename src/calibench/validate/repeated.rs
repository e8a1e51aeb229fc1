//! Do calibrations that were repeated agree, as much as each says of itself?
//!
//! If all are of one camera, estimates `a_i` with covariances `P_i` scatter about their weighted mean `m`:
//!
//! ```text
//! m = (sum P_i^-1)^-1 sum P_i^-1 a_i
//! chi^2 = sum (a_i - m)^T P_i^-1 (a_i - m)   with (k - 1) n degrees of freedom
//! ```
//! Where fy is tied to fx the two are one parameter. Parameters that trade against each other may scatter and
//! predict the same pixels; in pixels over the frame two calibrations are compared by [`one_camera`], the
//! rotation between them taken out.

use super::one_camera::OneCamera;
use super::{Calibrated, Estimate, frame_difference, one_camera};
use crate::calibrate::Covariance;
use crate::camera::{Model, Parameter};
use crate::distribution::{ChiSquare, fisher_tail};
use crate::evaluate::{DifferenceError, FrameDifference, TakenOut};
use nalgebra::{DMatrix, DVector};

/// What repeated calibrations say together.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Agreement {
    /// Scatter of the parameters about their weighted mean.
    pub chi_squared: f64,
    /// `(k - 1) n`.
    pub degrees_of_freedom: usize,
    /// Chance of so large a scatter, or a larger one, of one camera.
    pub p_value: f64,
    /// The weighted mean of each estimated parameter, and its standard deviation.
    pub mean: Vec<(Parameter, f64, f64)>,
    /// Every other calibration against the first, in pixels over the frame.
    pub in_pixels: Vec<(FrameDifference, OneCamera)>,
    /// Chance that calibrations of one camera fail.
    pub false_alarm: f64,
}

impl Agreement {
    /// Whether they agree: none of the tests is rarer than its share of the rate of false alarms
    /// (Bonferroni).
    pub fn holds(&self) -> bool {
        let each = self.each();
        let tests = self.in_pixels.iter().map(|(_, test)| test.p_value);
        tests.chain([self.p_value]).all(|p_value| p_value >= each)
    }

    /// The rate of each test.
    pub fn each(&self) -> f64 {
        self.false_alarm / (1 + self.in_pixels.len()) as f64
    }
}

/// Why repeated calibrations cannot be compared.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RepeatedError {
    /// One is no repetition.
    #[error("{got} calibration(s): two or more are compared")]
    TooFew {
        /// Number given.
        got: usize,
    },
    /// Parameters of two lens models have no mean.
    #[error(
        "calibration {index} has a {other} lens and the first a {first} lens: compare two models with calibench diff"
    )]
    OtherModel {
        /// Which, from 0.
        index: usize,
        /// The first's.
        first: Model,
        /// The other's.
        other: Model,
    },
    /// Not the same was estimated.
    #[error(
        "calibration {index} estimated other parameters than the first: calibrate with the same --free, --fix and --tie"
    )]
    OtherParameters {
        /// Which, from 0.
        index: usize,
    },
    /// Something was held at two values.
    #[error(
        "{parameter} was held at {first} in the first calibration and at {other} in calibration {index}: they cannot be one camera"
    )]
    HeldApart {
        /// Which parameter.
        parameter: Parameter,
        /// Its value in the first.
        first: f64,
        /// Its value in the other.
        other: f64,
        /// Which other, from 0.
        index: usize,
    },
    /// A covariance is none.
    #[error(
        "the covariance of calibration {index} is not positive definite: was a parameter not determined?"
    )]
    NotPositive {
        /// Which, from 0.
        index: usize,
    },
    /// Two cameras cannot be compared over the frame.
    #[error("calibration {index} against the first: {cause}")]
    Frame {
        /// Which, from 0.
        index: usize,
        /// Why.
        cause: DifferenceError,
    },
}

/// Tests whether independent calibrations, from photographs of their own, are of one camera, over a frame of
/// this size.
///
/// # Errors
/// See [`RepeatedError`].
///
/// ```
/// use calibench::calibrate::{LensCalibration, Settings, calibrate_lens};
/// use calibench::synth::{Scene, Stream, StreamKey};
/// use calibench::validate::{Estimate, repeated};
///
/// let scene = Scene::example();
/// let again = |trial: u64| {
///     let key = StreamKey { seed: 1, scenario: "repeated", trial, purpose: "noise" };
///     calibrate_lens(&scene.observe(0.1, &mut Stream::open(key)), &Settings::standard())
/// };
/// let results: Vec<LensCalibration> = (0..3).map(again).collect::<Result<_, _>>()?;
/// let estimates: Vec<Estimate> = results.iter().map(Estimate::from).collect();
/// let agreement = repeated(&estimates, (640, 480), 0.01)?;
/// assert!(agreement.holds() && agreement.degrees_of_freedom == 12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn repeated(
    estimates: &[Estimate],
    size: (usize, usize),
    false_alarm: f64,
) -> Result<Agreement, RepeatedError> {
    let [first, others @ ..] = estimates else { return Err(RepeatedError::TooFew { got: 0 }) };
    if others.is_empty() {
        return Err(RepeatedError::TooFew { got: 1 });
    }
    for (index, other) in others.iter().enumerate() {
        same_parameters(first, other, index + 1)?;
    }
    let scatter = Scatter::of(estimates)?;
    let n = first.covariance.free.len();
    let degrees_of_freedom = others.len() * n;
    let noise = estimates.iter().filter_map(|e| e.degrees_of_freedom).min();
    let p_value = match noise {
        // Each covariance is scaled by a noise of its own; the least known one decides, on the safe side.
        Some(noise) => {
            fisher_tail(scatter.chi_squared / degrees_of_freedom as f64, degrees_of_freedom, noise)
        }
        None => ChiSquare::new(degrees_of_freedom).survival(scatter.chi_squared),
    };
    let mean = first.covariance.free.iter().enumerate();
    let in_pixels = others.iter().enumerate().map(|(k, other)| {
        against(first, other, size).map_err(|cause| RepeatedError::Frame { index: k + 1, cause })
    });
    Ok(Agreement {
        chi_squared: scatter.chi_squared,
        degrees_of_freedom,
        p_value,
        mean: mean.map(|(i, p)| (p, scatter.mean[i], scatter.covariance[(i, i)].sqrt())).collect(),
        in_pixels: in_pixels.collect::<Result<_, _>>()?,
        false_alarm,
    })
}

fn same_parameters(first: &Estimate, other: &Estimate, index: usize) -> Result<(), RepeatedError> {
    let models = [first, other].map(|estimate| estimate.camera.distortion.model());
    if models[0] != models[1] {
        return Err(RepeatedError::OtherModel { index, first: models[0], other: models[1] });
    }
    let (a, b): (&Covariance, &Covariance) = (first.covariance, other.covariance);
    if (a.free, a.fy_per_fx) != (b.free, b.fy_per_fx) {
        return Err(RepeatedError::OtherParameters { index });
    }
    let is_tied = |p: Parameter| p == Parameter::Fy && a.fy_per_fx.is_some();
    let is_held = |p: &Parameter| !a.free.contains(*p) && !is_tied(*p);
    let apart = models[0].parameters().filter(is_held).find(|&p| value(first, p) != value(other, p));
    match apart {
        None => Ok(()),
        Some(parameter) => {
            let (first, other) = (value(first, parameter), value(other, parameter));
            Err(RepeatedError::HeldApart { parameter, first, other, index })
        }
    }
}

/// A parameter of the model that both have.
fn value(estimate: &Estimate, parameter: Parameter) -> f64 {
    estimate.camera.value(parameter).unwrap_or_default()
}

/// Weighted mean, its covariance and the scatter about it.
struct Scatter {
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    chi_squared: f64,
}

impl Scatter {
    fn of(estimates: &[Estimate]) -> Result<Scatter, RepeatedError> {
        let free = estimates[0].covariance.free;
        let n = free.len();
        let not_positive = |index: usize| RepeatedError::NotPositive { index };
        // In units of the first's standard deviations, from the first's values.
        let origin = DVector::from_iterator(n, free.iter().map(|p| value(&estimates[0], p)));
        let unit = estimates[0].covariance.intrinsics.diagonal().map(|d| d.max(0.0).sqrt());
        let (mut weight, mut weighted) = (DMatrix::zeros(n, n), DVector::zeros(n));
        let mut scaled = Vec::new();
        for (index, estimate) in estimates.iter().enumerate() {
            let p = &estimate.covariance.intrinsics;
            let p = DMatrix::from_fn(n, n, |i, j| p[(i, j)] / (unit[i] * unit[j]));
            let inverse = p.cholesky().ok_or(not_positive(index))?.inverse();
            let at = DVector::from_iterator(n, free.iter().map(|p| value(estimate, p)));
            let at = (at - &origin).component_div(&unit);
            weight += &inverse;
            weighted += &inverse * &at;
            scaled.push((at, inverse));
        }
        let covariance = weight.cholesky().ok_or(not_positive(0))?.inverse();
        let mean = &covariance * weighted;
        let square = |(at, inverse): &(DVector<f64>, DMatrix<f64>)| {
            let off = at - &mean;
            off.dot(&(inverse * &off))
        };
        Ok(Scatter {
            chi_squared: scaled.iter().map(square).sum(),
            covariance: DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] * unit[i] * unit[j]),
            mean: origin + mean.component_mul(&unit),
        })
    }
}

fn against(
    first: &Estimate,
    other: &Estimate,
    size: (usize, usize),
) -> Result<(FrameDifference, OneCamera), DifferenceError> {
    let (a, b) = (first.calibrated(), other.calibrated());
    let difference = frame_difference(a.camera, b.camera, size, TakenOut::Rotation)?;
    Ok((difference, one_camera(&a, &b, size, TakenOut::Rotation)?))
}

impl<'a> Estimate<'a> {
    fn calibrated(&self) -> Calibrated<'a> {
        Calibrated {
            camera: self.camera,
            free: self.covariance.free,
            fy_per_fx: self.covariance.fy_per_fx,
            covariance: &self.covariance.intrinsics,
            degrees_of_freedom: self.degrees_of_freedom,
        }
    }
}
