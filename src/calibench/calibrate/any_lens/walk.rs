//! Which minima do the starts lead to?

use super::super::minimise::{Minimum, descend};
use super::super::rival::{Met, RIVALS};
use super::super::{CalibrationError, Settings, Termination, Warning};
use super::problem::{Problem, ROUGH_GAIN, State};
use super::{WIDTH, report, start};
use crate::board::View;
use crate::camera::Lens;

/// The best of the minima, and all that were met, most of them to [`ROUGH_GAIN`].
pub(super) struct Walked {
    pub best: Minimum<State, WIDTH>,
    pub met: Vec<Met<Lens>>,
}

/// Refines the starts: those that the pinhole's solver gives, and, unless that is certified to have found no
/// minimum beside the right one and one of them converges to residuals that look like noise, those that an angle polynomial gives. A
/// certificate counts for the lens of the pinhole, and where that does not hold it may be one of a wrong camera.
///
/// # Errors
/// No lens of the model sees every mark.
pub(super) fn walk(
    problem: &Problem<'_>,
    views: &[View],
    settings: &Settings,
) -> Result<Walked, CalibrationError> {
    let (from_pinhole, is_certified) = start::by_pinhole(problem, views, settings);
    let mut minima = refined(problem, from_pinhole);
    let is_right = |m: &Minimum<State, WIDTH>| {
        m.termination == Termination::Converged && !report::may_have_structure(problem, &m.state)
    };
    let is_found = minima.iter().any(is_right);
    if !(is_certified && is_found) {
        minima.extend(refined(problem, start::by_rays(problem, settings)));
    }
    if let Some(first) = best(problem, &minima) {
        minima.extend(refined(problem, start::other_spheres(problem, &minima[first].state)));
    }
    let rough = best(problem, &minima).ok_or(CalibrationError::NoImage { model: settings.model() })?;
    follow(problem, &mut minima[rough]);
    if minima[rough].termination != Termination::Converged {
        // Its valley goes on and on, and another start may lead to a minimum that is as good.
        let others = minima.iter_mut().enumerate().filter(|(place, _)| *place != rough);
        others.for_each(|(_, minimum)| follow(problem, minimum));
    }
    let met = minima.iter().map(met).collect();
    let best = best(problem, &minima).unwrap_or(rough);
    Ok(Walked { best: minima.swap_remove(best), met })
}

/// Refines a minimum to the end.
fn follow(problem: &Problem<'_>, minimum: &mut Minimum<State, WIDTH>) {
    let end = descend(problem, minimum.state.clone());
    *minimum = Minimum { iterations: minimum.iterations + end.iterations, ..end };
}

/// Which of the minima is the best.
fn best(problem: &Problem<'_>, minima: &[Minimum<State, WIDTH>]) -> Option<usize> {
    let better = |best, next| if is_better(problem, &minima[next], &minima[best]) { next } else { best };
    (0..minima.len()).reduce(better)
}

fn refined(problem: &Problem<'_>, starts: Vec<State>) -> Vec<Minimum<State, WIDTH>> {
    let rough = Problem { relative_gain: ROUGH_GAIN, ..*problem };
    let minima = starts.into_iter().map(|state| descend(&rough, state));
    minima.filter(|minimum| minimum.system.cost.is_finite()).collect()
}

/// Whether one minimum is to be preferred to another: it costs less, and if it is none, because the search went on
/// and on, or has coefficients for which the model is not defined, so much less that chance does not explain it. Where
/// numerator and denominator of a fraction nearly cancel, a valley goes on to coefficients without end, at a fraction of a
/// variance; two spheres make nearly the same picture in and out of their range.
pub(super) fn is_better(
    problem: &Problem<'_>,
    next: &Minimum<State, WIDTH>,
    best: &Minimum<State, WIDTH>,
) -> bool {
    let [next_is_sound, best_is_sound] = [next, best].map(is_sound);
    let margin = match (next_is_sound, best_is_sound) {
        (true, false) => -RIVALS * report::variance(problem, next),
        (false, true) => RIVALS * report::variance(problem, best),
        _ => 0.0,
    };
    next.system.cost + margin < best.system.cost
}

/// Whether a search ended, and with a camera for which its model is defined.
fn is_sound(minimum: &Minimum<State, WIDTH>) -> bool {
    let is_defined = Warning::outside_range(&minimum.state.camera).next().is_none();
    minimum.termination == Termination::Converged && is_defined
}

/// A minimum among those that were met.
pub(super) fn met(minimum: &Minimum<State, WIDTH>) -> Met<Lens> {
    Met {
        camera: minimum.state.camera,
        cost: minimum.system.cost,
        converged: minimum.termination == Termination::Converged,
    }
}
