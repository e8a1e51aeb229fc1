//! What should a user know before trusting a calibration? The conditions behind each warning.

use super::intervals::Skewed;
use super::report::{STRONG_CORRELATION, UNCERTAIN_FOCAL};
use super::{Calibration, Covariance, Loss, Termination, Warning};
use crate::camera::{Camera, FreeParameters, Parameter};

/// The warnings of a calibration; `skewed` are the parameters whose cost is no parabola.
pub(super) fn of(calibration: &Calibration, largest_radius: f64, loss: Loss, skewed: &[Skewed]) -> Vec<Warning> {
    let mut warnings = Vec::new();
    warnings.extend(ending(calibration));
    if loss == Loss::Squares {
        warnings.extend(outliers(calibration));
    }
    if calibration.degrees_of_freedom == 0 {
        warnings.push(Warning::NoDegreesOfFreedom);
    }
    warnings.extend(correlated(&calibration.covariance, calibration.free));
    warnings.extend([Parameter::Fx, Parameter::Fy].into_iter().filter_map(|parameter| {
        let relative = calibration.standard_deviation(parameter)? / calibration.camera.get(parameter);
        (relative > UNCERTAIN_FOCAL).then_some(Warning::FocalLengthUncertain { parameter, relative })
    }));
    warnings.extend(folding(&calibration.camera, largest_radius));
    warnings.extend(skewed.iter().map(|s| Warning::NotLinear {
        parameter: s.parameter,
        below: s.ratios[0],
        above: s.ratios[1],
    }));
    warnings
}

/// What the ending of the search asks to be told.
fn ending(calibration: &Calibration) -> Option<Warning> {
    match (calibration.termination, calibration.certificate) {
        (Termination::Converged, _) => None,
        (Termination::AboveFloor, Some(certificate)) => Some(Warning::AboveFloor {
            rmse_px: calibration.rmse_px,
            floor_rmse_px: certificate.floor_rmse_px,
            p_value: certificate.p_value,
            starts: calibration.starts,
        }),
        (termination, _) => {
            Some(Warning::NotConverged { termination, iterations: calibration.iterations })
        }
    }
}

/// A squared residual above this many variances is worth a look at the distribution: in 250 marks of noise one in a hundred sets has one.
const LARGE: f64 = 20.0;
/// Of noise, one squared residual in 10^8 exceeds the median by this factor: `36 sigma^2` over `2 ln 2 sigma^2`.
const OUTLYING: f64 = 26.0;
/// More than this part of the marks are no strays: the model is wrong.
const FEW: f64 = 0.1;

/// Marks that are no noise, if they are few.
fn outliers(calibration: &Calibration) -> Option<Warning> {
    let limit = LARGE * calibration.sigma_px * calibration.sigma_px;
    let residuals = || calibration.residuals.iter().flatten().map(|r| r.norm_squared());
    if calibration.degrees_of_freedom == 0 || !residuals().any(|square| square > limit) {
        return None;
    }
    let mut squares: Vec<f64> = residuals().collect();
    let middle = squares.len() / 2;
    let median = *squares.select_nth_unstable_by(middle, f64::total_cmp).1;
    let marks = residuals().filter(|&square| square > OUTLYING * median).count();
    if marks == 0 || marks as f64 > (FEW * squares.len() as f64).max(1.0) {
        return None;
    }
    let all = calibration.residuals.iter().enumerate();
    let numbered = all.flat_map(|(view, list)| list.iter().enumerate().map(move |(point, r)| (view, point, r.norm())));
    let (view, point, residual_px) = numbered.max_by(|a, b| a.2.total_cmp(&b.2))?;
    Some(Warning::Outliers { marks, view, point, residual_px, median_px: median.sqrt() })
}

/// Pairs of distortion coefficients, or of any parameters, that trade off against each other.
fn correlated(covariance: &Covariance, free: FreeParameters) -> Vec<Warning> {
    let parameters: Vec<Parameter> = free.iter().collect();
    let mut found = Vec::new();
    for (i, &a) in parameters.iter().enumerate() {
        for &b in &parameters[i + 1..] {
            match covariance.correlation(a, b) {
                // fx and fy share the distance to the target: their correlation is the rule, and harmless.
                Some(_) if (a, b) == (Parameter::Fx, Parameter::Fy) => {}
                Some(correlation) if correlation.abs() > STRONG_CORRELATION => {
                    found.push(Warning::Correlated { a, b, correlation });
                }
                _ => {}
            }
        }
    }
    found
}

/// Warns if the model folds within 1.2 times the largest radius seen.
fn folding(camera: &Camera, largest_observed: f64) -> Option<Warning> {
    let monotone_radius = camera.distortion.monotone_radius();
    (monotone_radius < 1.2 * largest_observed)
        .then_some(Warning::FoldsInsideImage { monotone_radius, largest_observed })
}
