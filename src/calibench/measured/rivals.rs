//! Does another camera explain the data nearly as well? The other minima that starts led to, with the marks'
//! positions estimated too.

use super::problem::{Problem, State};
use crate::calibrate::{LensCalibration, Warning};

/// A minimum whose cost is higher by fewer variances than this is a rival, four standard deviations, as in
/// every calibration.
const RIVALS: f64 = 16.0;
/// A minimum whose parameters all lie within this many standard deviations is the same one.
const SAME: f64 = 6.0;

/// The best of the others that is another camera and nearly as good as `found`, whose cost is `least`.
pub(super) fn rival(
    problem: &Problem<'_>,
    found: &LensCalibration,
    least: f64,
    others: &[State],
) -> Option<Warning> {
    let of_state = |state: &State| {
        let excess = (problem.equations(state)?.cost - least) / problem.variance;
        let differences = found.free.iter().filter_map(|parameter| {
            let (value, other) = (found.camera.value(parameter)?, state.camera.value(parameter)?);
            let deviations = (other - value).abs() / found.standard_deviation(parameter)?;
            Some((deviations, Warning::Ambiguous { parameter, value, other, excess }))
        });
        let (deviations, warning) = differences.max_by(|a, b| a.0.total_cmp(&b.0))?;
        (excess < RIVALS && deviations > SAME).then_some((excess, warning))
    };
    let rivals = others.iter().filter_map(of_state);
    rivals.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, warning)| warning)
}
