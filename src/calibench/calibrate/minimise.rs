//! Which parameters make the residuals least? Levenberg-Marquardt on the arrow-shaped normal equations.

use super::Loss;
use super::Termination;
use super::blocks::N;
use super::normal::{self, Observations};
use super::prior::Priors;
use super::retraction::Retraction;
use super::system::{Step, System};
use crate::camera::{Camera, FreeParameters};
use crate::geometry::Pose;

/// The unknowns.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub camera: Camera,
    pub cam_from_target: Vec<Pose>,
}

/// What is minimised.
pub(super) struct Problem<'a> {
    pub free: FreeParameters,
    /// fy over fx, where fy follows fx.
    pub fy_per_fx: Option<f64>,
    /// What is known beforehand.
    pub priors: Priors<'a>,
    pub observations: &'a [Observations],
    pub loss: Loss,
    pub max_iterations: usize,
    /// Whether every target keeps the normal of its starting pose.
    pub hold_tilt: bool,
    /// How steps are taken.
    pub retraction: Retraction,
    /// Focal lengths, px, outside of which a search has run away and ends.
    pub focal_limits: (f64, f64),
    /// Below this a cost is rounding: [`rounding_cost`] of the observations.
    pub rounding_cost: f64,
}

/// A minimum, or where the search ended.
#[derive(Clone)]
pub(super) struct Minimum<S = State, const W: usize = N> {
    pub state: S,
    /// Normal equations one last negligible step before `state`.
    pub system: System<W>,
    pub termination: Termination,
    pub iterations: usize,
}

/// A step that gains less than this part of the cost moves no parameter by more than `1e-7 sqrt(degrees of
/// freedom)` of its standard deviation.
pub(super) const RELATIVE_GAIN: f64 = 1e-14;
/// Residuals of pixels near `p` cannot be known better than this many roundings of `p`.
const ROUNDINGS: f64 = 8.0;
/// Small enough not to slow a good start, large enough to tame a singular first matrix.
const FIRST_DAMPING: f64 = 1e-6;
/// What damping falls to at most.
const LEAST_DAMPING: f64 = 1e-6 * FIRST_DAMPING;
/// Damping grows by this on failure and falls by it on success.
const DAMPING_FACTOR: f64 = 10.0;
/// With this damping a step is a short way down the gradient; if that fails, nothing helps.
const LARGEST_DAMPING: f64 = 1e10;

/// What a search on a curved path multiplies its damping by after a failure, and again by this after each
/// further one.
const FIRST_GROWTH: f64 = 2.0;

/// Factor of the damping after a step that gained `ratio` of what it promised: a third at best, 1 where half
/// was kept (Nielsen 1999). A fixed factor goes to and fro between steps that are too long and steps that are
/// short.
fn eased(ratio: f64) -> f64 {
    let x = 2.0 * ratio - 1.0;
    (1.0 - x * x * x).max(1.0 / 3.0)
}

/// The cost that rounding alone makes.
pub(super) fn rounding_cost(observations: &[Observations]) -> f64 {
    let unit = |p: f64| (ROUNDINGS * f64::EPSILON * p) * (ROUNDINGS * f64::EPSILON * p);
    observations.iter().flat_map(Observations::iter).map(|(_, pixel)| unit(pixel.x) + unit(pixel.y)).sum()
}

impl Problem<'_> {
    /// The minimum that a start leads to.
    pub fn minimise(&self, start: State) -> Minimum {
        descend(self, start)
    }

    /// Normal equations at a state; an infinite cost where a point is not in front of the camera.
    pub fn linearise_into(&self, state: &State, system: &mut System) {
        let State { camera, cam_from_target } = state;
        if normal::fill(system, camera, cam_from_target, self.observations, self.loss, self.fy_per_fx)
            .is_none()
        {
            system.cost = f64::INFINITY;
            return;
        }
        self.priors.add_to(camera, system);
        if self.hold_tilt {
            for (view, pose) in system.views.iter_mut().zip(&state.cam_from_target) {
                view.hold_tilt(&pose.rotation.column(2).into_owned());
            }
        }
        if !(state.camera.fx > 0.0 && state.camera.fy > 0.0) || system.cost.is_nan() {
            system.cost = f64::INFINITY;
        }
    }
}

impl Descent<N> for Problem<'_> {
    type State = State;

    fn system(&self) -> System {
        System::new(self.free, self.observations.len())
    }

    fn linearise_into(&self, state: &State, system: &mut System) {
        Problem::linearise_into(self, state, system);
    }

    fn step(&self, from: &State, step: &Step, to: &mut State) {
        self.retraction.apply(from, self.free, self.fy_per_fx, step, to);
    }

    fn is_curved(&self) -> bool {
        self.retraction == Retraction::Curved
    }

    fn has_run_away(&self, state: &State) -> bool {
        let (shortest, longest) = self.focal_limits;
        state.camera.fx.min(state.camera.fy) < shortest || state.camera.fx.max(state.camera.fy) > longest
    }

    fn max_iterations(&self) -> usize {
        self.max_iterations
    }

    fn rounding_cost(&self) -> f64 {
        self.rounding_cost
    }
}

/// What is to be made least: sums of squares whose normal equations are an arrow `W` wide.
pub(super) trait Descent<const W: usize> {
    /// The unknowns.
    type State: Clone;

    /// An empty system of the right size.
    fn system(&self) -> System<W>;

    /// Normal equations at a state; an infinite cost where the model has no image of a point.
    fn linearise_into(&self, state: &Self::State, system: &mut System<W>);

    /// Moves `from` by a step.
    fn step(&self, from: &Self::State, step: &Step<W>, to: &mut Self::State);

    /// Where a step leads.
    fn stepped(&self, from: &Self::State, step: Step<W>) -> Self::State {
        let mut to = from.clone();
        self.step(from, &step, &mut to);
        to
    }

    /// Whether steps follow a curve.
    fn is_curved(&self) -> bool {
        false
    }

    /// Whether the search has left all that is possible.
    fn has_run_away(&self, _: &Self::State) -> bool {
        false
    }

    /// Whether a step that gains next to nothing may lead far away, along a combination that is hardly known,
    /// and is to be looked at.
    fn may_leap(&self) -> bool {
        false
    }

    /// Iterations after which a search creeps: its steps then follow the bend of their path.
    fn patience(&self) -> usize {
        usize::MAX
    }

    /// The second-order correction of a step; `None` where there is none.
    fn acceleration(&self, _: &Self::State, _damping: f64, _: &Step<W>) -> Option<Step<W>> {
        None
    }

    fn max_iterations(&self) -> usize;

    /// A step that promises less than this part of the cost is the last.
    fn relative_gain(&self) -> f64 {
        RELATIVE_GAIN
    }

    /// Below this a cost is rounding.
    fn rounding_cost(&self) -> f64;
}

/// Levenberg-Marquardt (Levenberg 1944; Marquardt 1963) with damping `lambda diag(J^T J)`.
pub(super) fn descend<D: Descent<W>, const W: usize>(problem: &D, start: D::State) -> Minimum<D::State, W> {
    let rounding_cost = problem.rounding_cost();
    let (max_iterations, relative_gain) = (problem.max_iterations(), problem.relative_gain());
    let mut state = start;
    let mut system = problem.system();
    let mut trial_system = problem.system();
    let mut step = Step::default();
    let mut trial = state.clone();
    let mut damping = FIRST_DAMPING;
    let mut growth = FIRST_GROWTH;
    let mut iterations = 0;
    problem.linearise_into(&state, &mut system);
    let termination = loop {
        if iterations == max_iterations {
            break Termination::IterationLimit;
        }
        if damping > LARGEST_DAMPING || !system.cost.is_finite() {
            break Termination::Stalled;
        }
        if system.solve_into(damping, &mut step).is_none() {
            damping *= DAMPING_FACTOR;
            continue;
        }
        problem.step(&state, &step, &mut trial);
        let undamped = damping <= FIRST_DAMPING;
        if undamped && step.predicted_gain <= relative_gain * system.cost + rounding_cost {
            if !problem.may_leap() {
                std::mem::swap(&mut state, &mut trial);
                break Termination::Converged;
            }
            if damping > LEAST_DAMPING {
                // Damping hides what a combination that is hardly known would gain.
                damping = LEAST_DAMPING;
                iterations += 1;
                continue;
            }
            problem.linearise_into(&trial, &mut trial_system);
            if trial_system.cost <= system.cost {
                std::mem::swap(&mut state, &mut trial);
                std::mem::swap(&mut system, &mut trial_system);
            }
            break Termination::Converged;
        }
        iterations += 1;
        let is_followed = iterations <= problem.patience() || {
            let bent = problem.acceleration(&state, damping, &step);
            bent.is_some_and(|acceleration| step.bend(&acceleration, &system))
        };
        if is_followed && iterations > problem.patience() {
            problem.step(&state, &step, &mut trial);
        }
        if is_followed {
            problem.linearise_into(&trial, &mut trial_system);
        }
        if is_followed && trial_system.cost < system.cost {
            let gained = system.cost - trial_system.cost;
            std::mem::swap(&mut state, &mut trial);
            std::mem::swap(&mut system, &mut trial_system);
            let lowered = if problem.is_curved() {
                damping * eased(gained / step.predicted_gain)
            } else {
                damping / DAMPING_FACTOR
            };
            damping = lowered.max(FIRST_DAMPING / 1e6);
            growth = FIRST_GROWTH;
            if problem.has_run_away(&state) {
                break Termination::Stalled;
            }
        } else if is_followed && step.predicted_gain <= ROUNDINGS * f64::EPSILON * system.cost + rounding_cost
        {
            // The promised gain is below what the sum of squares can show.
            break Termination::Converged;
        } else {
            damping = if problem.is_curved() {
                damping.max(FIRST_DAMPING / 1e6) * growth
            } else {
                damping.max(FIRST_DAMPING) * DAMPING_FACTOR
            };
            growth *= FIRST_GROWTH;
        }
    };
    Minimum { state, system, termination, iterations }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::tests::plain_problem;
    use crate::geometry::{Mat3, Vec2, Vec3};

    fn one_mark() -> Observations {
        Observations::new([(Vec2::new(10.0, 0.0), Vec2::new(300.0, 400.0))].into_iter())
    }

    #[test]
    fn a_cost_is_rounding_below_eight_roundings_of_each_coordinate() {
        // 8 * 2^-52 of 300 px and of 400 px.
        let expected = (8.0 * f64::EPSILON * 500.0) * (8.0 * f64::EPSILON * 500.0);
        assert!((rounding_cost(&[one_mark()]) / expected - 1.0).abs() < 1e-14);
    }

    #[test]
    fn a_camera_with_a_negative_focal_length_is_none() {
        let observations = [one_mark()];
        let problem = plain_problem(&observations, FreeParameters::STANDARD);
        let pose = Pose { rotation: Mat3::identity(), translation: Vec3::new(0.0, 0.0, 100.0) };
        for (fx, fy, is_camera) in
            [(600.0, 600.0, true), (-600.0, 600.0, false), (600.0, -600.0, false), (f64::NAN, 600.0, false)]
        {
            let state = State { camera: Camera::pinhole(fx, fy, 320.0, 240.0), cam_from_target: vec![pose] };
            let mut system = System::new(problem.free, 1);
            problem.linearise_into(&state, &mut system);
            assert_eq!(system.cost.is_finite(), is_camera, "{fx} {fy}");
        }
    }
}
