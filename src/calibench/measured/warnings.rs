//! What should a user know before trusting a calibration from a measured target? The warnings of every
//! calibration that apply to it, under the same conditions; those of the marks stand in the result itself.

use super::MeasuredView;
use crate::calibrate::{LensCalibration, Outliers, Prior, Termination, Warning, contradiction};
use crate::camera::Parameter;

/// Beyond this two parameters share 96 % of their variance.
const STRONG_CORRELATION: f64 = 0.98;
/// A focal length known worse than this part of itself.
const UNCERTAIN_FOCAL: f64 = 0.05;
/// A correct set of marks has a stray with this probability: `exp(-13)`, as in every calibration.
const LOG_STRAY: f64 = 13.0;

pub(super) fn of(
    calibration: &LensCalibration,
    views: &[MeasuredView],
    variance: f64,
    largest_angle: f64,
) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if calibration.termination != Termination::Converged {
        let LensCalibration { termination, iterations, .. } = *calibration;
        warnings.push(Warning::NotConverged { termination, iterations });
    }
    warnings.extend(outliers(calibration, views, variance));
    warnings.extend(calibration.priors.iter().filter_map(|prior| contradicted(calibration, prior)));
    warnings.extend(correlated(calibration));
    warnings.extend(focal_lengths(calibration));
    let limit = calibration.camera.distortion.monotone_angle();
    if limit < largest_angle {
        warnings.push(Warning::FoldsInsideView {
            monotone_angle: limit.to_degrees(),
            largest_observed: largest_angle.to_degrees(),
        });
    }
    warnings.extend(Warning::outside_range(&calibration.camera));
    warnings
}

/// Marks in single views that no noise explains: the squared residual over the variance of a coordinate is
/// exponential with mean 2.
fn outliers(calibration: &LensCalibration, views: &[MeasuredView], variance: f64) -> Option<Warning> {
    let count = calibration.points() as f64;
    let bound = 2.0 * (LOG_STRAY + libm::log(count)) * variance;
    let mut all = Vec::with_capacity(calibration.points());
    for (view, (seen, residuals)) in views.iter().zip(&calibration.residuals).enumerate() {
        for (point, (seen, residual)) in seen.marks().iter().zip(residuals).enumerate() {
            all.push(((seen.weight * residual).norm_squared(), view, point, residual.norm()));
        }
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let marks = all.iter().take_while(|(square, ..)| *square > bound).count();
    let (_, view, point, residual_px) = *all.first().filter(|_| marks > 0)?;
    let median_px = all[all.len() / 2].3;
    Some(Warning::Outliers(Outliers {
        marks,
        share: marks as f64 / count,
        view,
        point,
        residual_px,
        median_px,
    }))
}

fn contradicted(calibration: &LensCalibration, prior: &Prior) -> Option<Warning> {
    let Prior { parameter, mean, standard_deviation } = *prior;
    let posterior = calibration.standard_deviation(parameter)?;
    let estimate = calibration.camera.value(parameter)?;
    let deviations = contradiction(estimate - mean, standard_deviation, posterior)?;
    Some(Warning::Contradicted { parameter, mean, standard_deviation, estimate, deviations })
}

fn correlated(calibration: &LensCalibration) -> Vec<Warning> {
    let parameters: Vec<Parameter> = calibration.free.iter().collect();
    let mut found = Vec::new();
    for (i, &a) in parameters.iter().enumerate() {
        for &b in &parameters[i + 1..] {
            let correlation = calibration.covariance.correlation(a, b).unwrap_or(0.0);
            // fx and fy share the distance to the target: their correlation is the rule, and harmless.
            if (a, b) != (Parameter::Fx, Parameter::Fy) && correlation.abs() > STRONG_CORRELATION {
                found.push(Warning::Correlated { a, b, correlation });
            }
        }
    }
    found
}

fn focal_lengths(calibration: &LensCalibration) -> impl Iterator<Item = Warning> {
    [Parameter::Fx, Parameter::Fy].into_iter().filter_map(|parameter| {
        calibration.free.position(parameter)?;
        let relative = calibration.standard_deviation(parameter)? / calibration.camera.value(parameter)?;
        (relative > UNCERTAIN_FOCAL).then_some(Warning::FocalLengthUncertain { parameter, relative })
    })
}
