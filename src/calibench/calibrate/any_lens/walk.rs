//! Which minima do the starts lead to?

use super::super::minimise::{Minimum, descend};
use super::super::rival::{Met, RIVALS};
use super::super::{CalibrationError, Settings, Termination, Warning};
use super::problem::{Problem, ROUGH_GAIN, State};
use super::{WIDTH, certificate, report, start};
use crate::board::View;
use crate::camera::Lens;

/// The best of the minima, refined to the end where the model is certifiable, and the others that were met,
/// most of them to [`ROUGH_GAIN`].
pub(super) struct Walked {
    pub best: Minimum<State, WIDTH>,
    pub others: Vec<Minimum<State, WIDTH>>,
}

/// Refines the starts: those that the pinhole's solver gives, and, unless one of them converges to residuals
/// that look like noise and either the pinhole or this minimum is certified, those that an angle polynomial
/// gives; where none of all these looks like noise, or none is certified of a model that can be, those of one
/// about the centre that the marks tell: few marks look like noise at a wrong minimum too. The pinhole's
/// certificate counts for its own lens, and where that does not hold it may be one of a wrong camera.
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
    let is_settled =
        |m: &Minimum<State, WIDTH>| is_right(m) && (is_certified || certificate::holds(problem, m));
    if !minima.iter().any(is_settled) {
        minima.extend(refined(problem, start::by_rays(problem, settings)));
        let is_enough = |m: &Minimum<State, WIDTH>| {
            if problem.is_certifiable { is_settled(m) } else { is_right(m) }
        };
        if !minima.iter().any(is_enough) {
            minima.extend(refined(problem, start::by_rays_off_centre(problem, settings)));
        }
    }
    let mut spheres = Vec::new();
    if let Some(first) = best_of(problem, &minima) {
        spheres = start::other_spheres(problem, &minima[first].state);
    }
    let may_be_alike = !spheres.is_empty();
    minima.extend(refined(problem, spheres));
    let rough = best_of(problem, &minima).ok_or(CalibrationError::NoImage { model: settings.model() })?;
    follow(problem, &mut minima[rough]);
    // Where its valley goes on and on, another start may lead to a minimum that is as good; where two spheres
    // make nearly the same picture, rough costs do not tell which of them is better.
    let followed_below = if minima[rough].termination != Termination::Converged {
        f64::INFINITY
    } else if may_be_alike {
        minima[rough].system.cost + RIVALS * report::noise(problem, &minima[rough]).rise
    } else {
        f64::NEG_INFINITY
    };
    let others = minima.iter_mut().enumerate().filter(|(place, _)| *place != rough);
    others
        .filter(|(_, minimum)| minimum.system.cost < followed_below)
        .for_each(|(_, minimum)| follow(problem, minimum));
    let best = best_of(problem, &minima).unwrap_or(rough);
    if problem.is_certifiable && best != rough {
        follow(problem, &mut minima[best]);
    }
    Ok(Walked { best: minima.swap_remove(best), others: minima })
}

/// Costs that differ by less than this part, at focal lengths that do, are taken for those of one minimum.
const ONE_MINIMUM: f64 = 1e-4;

/// The minima of another problem that lie where these do, each once: the best there need not be the best
/// here, as where a lens takes up what the board's shape explains.
pub(super) fn walked_anew(walked: Walked, problem: &Problem<'_>) -> Walked {
    let Walked { mut best, others } = walked;
    let is_same = |a: f64, b: f64| (a - b).abs() <= ONE_MINIMUM * b.abs();
    let mut seen = vec![(best.system.cost, best.state.camera.fx)];
    follow(problem, &mut best);
    let mut minima = vec![best];
    for mut other in others {
        let at = (other.system.cost, other.state.camera.fx);
        if seen.iter().any(|known| is_same(at.0, known.0) && is_same(at.1, known.1)) {
            continue;
        }
        seen.push(at);
        follow(problem, &mut other);
        minima.push(other);
    }
    let place = best_of(problem, &minima).unwrap_or(0);
    Walked { best: minima.swap_remove(place), others: minima }
}

/// Refines a minimum to the end.
pub(super) fn follow(problem: &Problem<'_>, minimum: &mut Minimum<State, WIDTH>) {
    let end = descend(problem, minimum.state.clone());
    *minimum = Minimum { iterations: minimum.iterations + end.iterations, ..end };
}

/// Which of the minima is the best.
fn best_of(problem: &Problem<'_>, minima: &[Minimum<State, WIDTH>]) -> Option<usize> {
    let cheapest = minima.iter().min_by(|a, b| a.system.cost.total_cmp(&b.system.cost))?;
    let rise = report::noise(problem, cheapest).rise;
    let dearness = |place: &usize| dearness(&minima[*place], rise);
    (0..minima.len()).min_by(|a, b| dearness(a).total_cmp(&dearness(b)))
}

fn refined(problem: &Problem<'_>, starts: Vec<State>) -> Vec<Minimum<State, WIDTH>> {
    let rough = Problem { relative_gain: ROUGH_GAIN, ..*problem };
    let minima = starts.into_iter().map(|state| descend(&rough, state));
    minima.filter(|minimum| minimum.system.cost.is_finite()).collect()
}

/// Whether one minimum is to be preferred to another.
pub(super) fn is_better(
    problem: &Problem<'_>,
    next: &Minimum<State, WIDTH>,
    best: &Minimum<State, WIDTH>,
) -> bool {
    let cheaper = if next.system.cost < best.system.cost { next } else { best };
    let rise = report::noise(problem, cheaper).rise;
    dearness(next, rise) < dearness(best, rise)
}

/// The cost of a minimum, and for each of its faults so much more that chance does not explain it; `rise` is
/// what one standard deviation costs. Where numerator and denominator of a fraction nearly cancel, a valley
/// goes on to coefficients without end, at a fraction of a variance; two spheres make nearly the same picture
/// in and out of their range, and beside a camera in its range a search may go on and on where it ends out of
/// the range.
fn dearness(minimum: &Minimum<State, WIDTH>, rise: f64) -> f64 {
    let is_outside = Warning::is_outside_range(&minimum.state.camera);
    let is_unended = minimum.termination != Termination::Converged;
    let faults = 2 * u8::from(is_outside) + u8::from(is_unended);
    minimum.system.cost + f64::from(faults) * RIVALS * rise
}

/// A minimum as another problem weighs what is known beforehand, which it does by its own noise. Where that
/// is no minimum of its, the next one costs less.
pub(super) fn weighed_anew(
    minimum: &Minimum<State, WIDTH>,
    before: &Problem<'_>,
    now: &Problem<'_>,
) -> Met<Lens> {
    let of_priors = now.cost_of_priors(&minimum.state) - before.cost_of_priors(&minimum.state);
    Met { cost: minimum.system.cost + of_priors, ..met(minimum) }
}

/// A minimum among those that were met.
pub(super) fn met(minimum: &Minimum<State, WIDTH>) -> Met<Lens> {
    Met {
        camera: minimum.state.camera,
        cost: minimum.system.cost,
        converged: minimum.termination == Termination::Converged,
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::noise::Noise;
    use super::super::super::prior::Prior;
    use super::super::super::target_frame::TargetFrames;
    use super::super::estimate::calibrate;
    use super::super::{fixture, marks, shape};
    use super::*;
    use crate::camera::{FreeParameters, Model, Parameter};

    #[test]
    fn what_is_known_beforehand_is_weighed_by_the_noise_that_has_settled() {
        let free = FreeParameters::of(&fixture::FREE);
        fixture::at_minimum(free, 1.0, |nothing_known, minimum| {
            let mean = minimum.state.camera.fx - 2.0;
            let prior = Prior { parameter: Parameter::Fx, mean, standard_deviation: 0.5 };
            let before = Problem { priors: &[prior], noise: Noise::of_squares(0.01), ..*nothing_known };
            let now = Problem { noise: Noise::of_squares(0.09), ..before };
            let mut weighed = minimum.clone();
            weighed.system.cost = before.cost(&minimum.state);
            let anew = weighed_anew(&weighed, &before, &now);
            // (2 / 0.5)^2 variances.
            assert!((anew.cost - before.cost(&minimum.state) - 16.0 * 0.08).abs() < 1e-9, "{anew:?}");
            assert!((anew.cost / now.cost(&minimum.state) - 1.0).abs() < 1e-12, "{anew:?}");
        });
    }

    #[test]
    fn a_fisheye_that_is_certified_needs_no_other_start_although_the_pinhole_is_not() {
        let views = fixture::wide_views();
        let settings = Settings::of_model(Model::KannalaBrandt);
        let listed = marks::of_views(&views, &TargetFrames::of(&views), &shape::region(&views));
        let problem = fixture::problem(&listed, settings.free());
        let (_, pinhole_is_certified) = start::by_pinhole(&problem, &views, &settings);
        assert!(!pinhole_is_certified);
        let found = calibrate(&views, &settings).unwrap();
        assert_eq!(found.starts, 1);
        assert!((found.sigma_px / fixture::WIDE_NOISE_PX - 1.0).abs() < 0.2, "{}", found.sigma_px);
    }

    #[test]
    fn a_fault_of_a_minimum_is_as_dear_as_a_rival() {
        let free = FreeParameters::of(&fixture::FREE);
        fixture::at_minimum(free, 1.0, |problem, minimum| {
            assert_eq!(dearness(minimum, 0.01), minimum.system.cost);
            let mut unended = minimum.clone();
            unended.termination = Termination::IterationLimit;
            // 16 variances of 0.01 px^2.
            assert!((dearness(&unended, 0.01) - minimum.system.cost - 0.16).abs() < 1e-12);
            assert!(is_better(problem, minimum, &unended) && !is_better(problem, &unended, minimum));
            // A minimum far lower is better all the same.
            let mut dear = minimum.clone();
            dear.system.cost *= 1.5;
            assert!(is_better(problem, &unended, &dear) && !is_better(problem, &dear, &unended));
            assert!(!is_better(problem, minimum, minimum));
        });
    }
}
