//! Is the cost a parabola around the minimum, and is there another camera that is as good?

use super::super::conditioning::Spectrum;
use super::super::intervals::{Profile, Profiled, Skewed};
use super::super::minimise::{Descent, Minimum, descend};
use super::super::noise::Noise;
use super::super::rival::{Met, Rival};
use super::super::system::Reduction;
use super::super::tie::tied;
use super::super::{CalibrationError, Warning, identifiability};
use super::problem::{Problem, ROUGH_GAIN, State};
use super::{WIDTH, report, rivals, root, start, walk};
use crate::camera::{FreeParameters, Lens, Parameter};
use nalgebra::SVector;

/// A minimum with what is needed to state it.
pub(super) struct Judged {
    pub minimum: Minimum<State, WIDTH>,
    pub reduction: Reduction<WIDTH>,
    /// Of a coordinate of weight 1.
    pub noise: Noise,
    /// Starts that were refined.
    pub starts: usize,
    /// Parameters whose cost is no parabola.
    pub skewed: Vec<Skewed>,
    /// Other cameras that are nearly as good, the best first.
    pub rivals: Vec<Rival>,
}

/// Minima that profiles may meet on their way before the search is left as it is.
const BETTER_BY_PROFILE: usize = 5;
/// Where the check of linearity looks, in standard deviations.
const CHECKED_AT: f64 = 2.0;
/// So many of the worst-known combinations are looked along.
const LOOKED_ALONG: usize = 3;
/// Iterations of a refit with one parameter held: where it takes more, its cost so far is an upper bound.
const MOST_REFIT: usize = 40;
/// A refit's cost is known to this part of itself: to a ten-thousandth of a variance with a thousand degrees
/// of freedom.
const REFIT_GAIN: f64 = 1e-7;
/// A cost that rises by another factor than linear theory says is worth the profiles.
const TOLERATED: f64 = 0.1;

/// Judges a minimum, and replaces it by a lower one that lies on a profile; `met` are those that the search
/// met.
///
/// # Errors
/// Normal equations that are singular.
pub(super) fn judge(
    problem: &Problem<'_>,
    mut minimum: Minimum<State, WIDTH>,
    mut met: Vec<Met<Lens>>,
) -> Result<Judged, CalibrationError> {
    let mut skewed = Vec::new();
    let mut reduction = reduction_of(problem, &minimum)?;
    let mut noise = report::noise(problem, &minimum);
    if !is_parabola(problem, &minimum, &reduction, noise) {
        for state in start::alternatives(problem, &minimum.state) {
            take_better(problem, &mut minimum, state, &mut met);
        }
        skewed = profiles(problem, &mut minimum, &mut met)?;
        reduction = reduction_of(problem, &minimum)?;
        noise = report::noise(problem, &minimum);
    }
    let starts = met.len();
    // A camera that the model does not have is no other one.
    if !Warning::is_outside_range(&minimum.state.camera) {
        met.retain(|other| !Warning::is_outside_range(&other.camera));
    }
    let rivals = rivals::of(problem, &minimum, &reduction, noise, &met, &skewed);
    Ok(Judged { minimum, reduction, noise, starts, skewed, rivals })
}

/// Notes the minimum that a start leads to, and takes it where it is better: also once it is refined to the
/// end, which a valley may turn out not to have.
fn take_better(
    problem: &Problem<'_>,
    minimum: &mut Minimum<State, WIDTH>,
    start: State,
    met: &mut Vec<Met<Lens>>,
) -> bool {
    let rough = descend(&Problem { relative_gain: ROUGH_GAIN, ..*problem }, start);
    if !walk::is_better(problem, &rough, minimum) {
        met.push(walk::met(&rough));
        return false;
    }
    let before = minimum.iterations + rough.iterations;
    let next = descend(problem, rough.state);
    met.push(walk::met(&next));
    let is_better = walk::is_better(problem, &next, minimum);
    if is_better {
        *minimum = Minimum { iterations: before + next.iterations, ..next };
    }
    is_better
}

/// The parameters whose profile is no parabola, around the best minimum that a profile meets.
fn profiles(
    problem: &Problem<'_>,
    minimum: &mut Minimum<State, WIDTH>,
    met: &mut Vec<Met<Lens>>,
) -> Result<Vec<Skewed>, CalibrationError> {
    for _ in 0..BETTER_BY_PROFILE {
        let reduction = reduction_of(problem, minimum)?;
        let noise = report::noise(problem, minimum);
        let Some(profile) = Profile::new(problem, minimum, &reduction, noise) else { break };
        let lower = match profile.skewed() {
            Ok(skewed) => return Ok(skewed),
            Err(lower) => lower,
        };
        // What is lower at the end of a valley without end is no camera, but the deviations are worth little.
        let open = profile.skewed_or_open();
        if !take_better(problem, minimum, *lower, met) {
            return Ok(open);
        }
    }
    Ok(Vec::new())
}

fn reduction_of(
    problem: &Problem<'_>,
    minimum: &Minimum<State, WIDTH>,
) -> Result<Reduction<WIDTH>, CalibrationError> {
    let mut reduction = minimum.system.reduction().ok_or_else(identifiability::singular)?;
    root::add_root(problem, &minimum.state, &minimum.system, &mut reduction);
    Ok(reduction)
}

/// Whether the cost rises as linear theory says on the straight way to where it says least: two standard
/// deviations of the worst-known combinations of shared unknowns, both ways. A few evaluations say that the
/// profiles need not be walked. Nor need they where exact data leave no cost but rounding, which has any
/// shape.
fn is_parabola(
    problem: &Problem<'_>,
    minimum: &Minimum<State, WIDTH>,
    reduction: &Reduction<WIDTH>,
    noise: Noise,
) -> bool {
    if minimum.system.cost <= problem.rounding_cost {
        return true;
    }
    let rises_as_said = |direction: SVector<f64, WIDTH>| {
        let step = reduction.following(noise.scale() * direction);
        let cost = problem.cost(&problem.stepped(&minimum.state, step));
        let rise = (cost - minimum.system.cost) / noise.rise;
        (CHECKED_AT / rise.max(0.0).sqrt() - 1.0).abs() <= TOLERATED
    };
    weakest(reduction)
        .into_iter()
        .all(|weak| [-CHECKED_AT, CHECKED_AT].into_iter().all(|deviations| rises_as_said(deviations * weak)))
}

/// One standard deviation, for unit noise, along each of the worst-known combinations in units in which each
/// unknown alone is known equally well; none where nothing is shared or free.
fn weakest(reduction: &Reduction<WIDTH>) -> Vec<SVector<f64, WIDTH>> {
    let shared = reduction.schur.nrows();
    let scale = reduction.schur.diagonal().map(|information| 1.0 / information.sqrt());
    let Some(Spectrum { values, directions, .. }) = Spectrum::of(reduction, &scale) else {
        return Vec::new();
    };
    let mut order: Vec<usize> = (0..shared).filter(|&i| values[i] > 0.0).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let direction = |&worst: &usize| {
        let mut direction = SVector::zeros();
        for i in 0..shared {
            direction[i] = directions[(i, worst)] * scale[i] / values[worst].sqrt();
        }
        direction
    };
    order.iter().take(LOOKED_ALONG).map(direction).collect()
}

impl Profiled<WIDTH> for Problem<'_> {
    fn free(&self) -> FreeParameters {
        self.free
    }

    fn holding(&self, parameter: Parameter) -> Self {
        let max_iterations = self.max_iterations.min(MOST_REFIT);
        let (free, held) = (self.free.without(parameter), self.held.with(parameter));
        Problem { free, held, max_iterations, relative_gain: REFIT_GAIN, ..*self }
    }

    fn value(state: &State, parameter: Parameter) -> f64 {
        state.camera.value(parameter).unwrap_or(0.0)
    }

    fn with_value(&self, mut state: State, parameter: Parameter, value: f64) -> State {
        if let Some(camera) = state.camera.with_value(parameter, value) {
            state.camera = camera;
        }
        state.camera = tied(state.camera, self.fy_per_fx);
        state
    }

    fn beyond(state: &State) -> Option<(Parameter, f64)> {
        let limits = |(parameter, value): (Parameter, f64)| {
            let (low, high) = parameter.defined_range();
            let limit = if value < low { low } else { high };
            (!parameter.is_defined_at(value)).then_some((parameter, limit))
        };
        state.camera.values().find_map(limits)
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{FREE, at_minimum};
    use super::*;
    use crate::camera::{Camera, Model};

    #[test]
    fn the_cost_of_good_views_is_a_parabola_by_the_noise_that_is_right() {
        at_minimum(FreeParameters::of(&FREE), 1.0, |problem, minimum| {
            let reduction = reduction_of(problem, minimum).unwrap();
            let noise = Noise::of_squares(0.01);
            assert!(is_parabola(problem, minimum, &reduction, noise));
            // A deviation that costs four times as much as it should is no parabola's.
            let wrong = Noise { rise: 0.04, ..noise };
            assert!(!is_parabola(problem, minimum, &reduction, wrong));
            // Rounding has any shape.
            let exact = Problem { rounding_cost: 2.0 * minimum.system.cost, ..*problem };
            assert!(is_parabola(&exact, minimum, &reduction, wrong));
        });
    }

    #[test]
    fn a_start_that_leads_to_a_lower_cost_is_taken() {
        at_minimum(FreeParameters::of(&FREE), 1.0, |problem, minimum| {
            let mut worse = minimum.clone();
            (worse.system.cost, worse.iterations) = (2.0 * minimum.system.cost, 7);
            worse.state.camera.fx *= 1.1;
            let mut met = Vec::new();
            assert!(take_better(problem, &mut worse, minimum.state.clone(), &mut met));
            assert!((worse.system.cost / minimum.system.cost - 1.0).abs() < 1e-9 && worse.iterations >= 7);
            assert!((worse.state.camera.fx / minimum.state.camera.fx - 1.0).abs() < 1e-6);
            // From there it is none any more; both are noted.
            assert!(!take_better(problem, &mut worse, minimum.state.clone(), &mut met));
            assert_eq!(met.len(), 2);
        });
    }

    #[test]
    fn a_coefficient_beyond_its_range_is_told_with_the_limit_that_it_passed() {
        let beyond = |xi: f64, alpha: f64| {
            let lens = Lens::ideal(Model::DoubleSphere);
            let camera = Camera::with_lens(300.0, 300.0, 320.0, 240.0, lens)
                .with_value(Parameter::Xi, xi)
                .and_then(|camera| camera.with_value(Parameter::Alpha, alpha))
                .unwrap();
            let state = State { camera, cam_from_target: Vec::new(), shape: [0.0; 3] };
            <Problem<'_> as Profiled<WIDTH>>::beyond(&state)
        };
        assert_eq!(beyond(0.2, 0.3), None);
        assert_eq!(beyond(0.2, -0.1), Some((Parameter::Alpha, 0.0)));
        assert_eq!(beyond(0.2, 1.1), Some((Parameter::Alpha, 1.0)));
        assert_eq!(beyond(-1.2, 0.3), Some((Parameter::Xi, -1.0)));
    }
}
