//! What should a user know before trusting a calibration? The conditions behind each warning.

use super::intervals::Skewed;
use super::report::{STRONG_CORRELATION, UNCERTAIN_FOCAL};
use super::search::Rival;
use super::{Calibration, Covariance, Termination, Warning};
use crate::camera::{Camera, FreeParameters, Parameter};

/// The warnings of a calibration: `strays` is that of its outliers, `skewed` are the parameters whose cost is no parabola, `rival`
/// is another camera.
pub(super) fn of(
    calibration: &Calibration,
    largest_radius: f64,
    strays: Option<Warning>,
    skewed: &[Skewed],
    rival: Option<Rival>,
) -> Vec<Warning> {
    let mut warnings = Vec::new();
    warnings.extend(ending(calibration));
    warnings.extend(strays);
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
    warnings.extend(rival.map(|Rival { parameter, value, excess }| Warning::Ambiguous {
        parameter,
        value: calibration.camera.get(parameter),
        other: value,
        excess,
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
        (termination, _) => Some(Warning::NotConverged { termination, iterations: calibration.iterations }),
    }
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
