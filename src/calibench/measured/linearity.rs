//! Do standard deviations mislead? Where the cost around a minimum is no parabola, an interval of two of them
//! ends elsewhere.
//!
//! The profile of the cost holds one parameter two standard deviations away and refits the rest: linear
//! theory has it rise by `2^2` variances, and where it rises by `tau^2` the half-width of the interval is `2
//! / tau` times as large (Bates & Watts 1988, section 6.1; [`crate::calibrate`] asks the same).

use super::descent::{Minimum, descend};
use super::equations::{Inverse, Reduced, Step};
use super::noise::settled;
use super::problem::{Problem, State};
use super::{MeasuredError, Noise};
use crate::calibrate::{Termination, Warning};
use crate::camera::Parameter;
use nalgebra::DVector;

/// Where it is asked, in standard deviations.
const CHECKED_AT: f64 = 2.0;
/// A half-width that is off by less than this part does not mislead.
const TOLERATED: f64 = 0.1;
/// A rise below minus this many variances is a better minimum and no rounding.
const LOWER: f64 = 1e-3;
/// Better minima that profiles may meet on their way before the search is left as it is.
const BETTER_BY_PROFILE: usize = 5;

/// A minimum around which no profile meets a lower cost, and the parameters whose deviations mislead: among
/// them, where a search from such a cost ends no lower, those whose profile does not rise.
///
/// # Errors
/// As [`settled`].
pub(super) fn checked<'a>(
    mut problem: Problem<'a>,
    noise: Noise,
    mut minimum: Minimum,
) -> Result<(Problem<'a>, Minimum, Vec<Warning>), MeasuredError> {
    for _ in 0..BETTER_BY_PROFILE {
        let Some(profile) = Profile::of(&problem, &minimum) else { break };
        let lower = match profile.misleading(Err) {
            Ok(warnings) => return Ok((problem, minimum, warnings)),
            Err(lower) => lower,
        };
        let (next_problem, next) = settled(problem, noise, *lower)?;
        if next.equations.cost.is_nan() || next.equations.cost >= minimum.equations.cost {
            break;
        }
        let iterations = minimum.iterations + next.iterations;
        (problem, minimum) = (next_problem, Minimum { iterations, ..next });
    }
    let open = Profile::of(&problem, &minimum).and_then(|profile| profile.misleading(|_| Ok(0.0)).ok());
    Ok((problem, minimum, open.unwrap_or_default()))
}

/// The profile around a minimum.
struct Profile<'a, 'b> {
    problem: &'b Problem<'a>,
    minimum: &'b Minimum,
    reduced: Reduced,
    inverse: Inverse,
}

impl<'a, 'b> Profile<'a, 'b> {
    /// `None` where there is no minimum, nothing but rounding, or singular equations, which are refused
    /// elsewhere.
    fn of(problem: &'b Problem<'a>, minimum: &'b Minimum) -> Option<Profile<'a, 'b>> {
        let is_minimum = minimum.termination == Termination::Converged;
        if !is_minimum || minimum.equations.cost <= problem.rounding_cost() {
            return None;
        }
        let (reduced, inverse) = (minimum.equations.reduced(0.0)?, minimum.equations.inverse()?);
        Some(Profile { problem, minimum, reduced, inverse })
    }

    /// The parameters whose deviations mislead; `at_lower` says what `tau` is where a state of lower cost is
    /// met, or ends the search with it.
    fn misleading(
        &self,
        at_lower: impl Fn(Box<State>) -> Result<f64, Box<State>>,
    ) -> Result<Vec<Warning>, Box<State>> {
        let mut found = Vec::new();
        if self.rises_straight() {
            return Ok(found);
        }
        for (row, parameter) in self.problem.free.iter().enumerate() {
            let mut ratios = [1.0; 2];
            for (ratio, side) in ratios.iter_mut().zip([-CHECKED_AT, CHECKED_AT]) {
                *ratio = CHECKED_AT / self.tau(row, parameter, side).or_else(&at_lower)?;
            }
            // A ratio that is no number counts as far off.
            if !ratios.iter().all(|r| (r - 1.0).abs() <= TOLERATED) {
                let [below, above] = ratios.map(|ratio| Some(ratio).filter(|ratio| ratio.is_finite()));
                found.push(Warning::NotLinear { parameter, below, above });
            }
        }
        Ok(found)
    }

    /// Whether the cost rises as linear theory says where all other unknowns follow a parameter to first
    /// order: a few evaluations say that nothing needs to be refitted.
    fn rises_straight(&self) -> bool {
        self.problem.free.iter().enumerate().all(|(row, parameter)| {
            [-CHECKED_AT, CHECKED_AT].into_iter().all(|deviations| {
                let rise = self.moved(row, parameter, deviations).and_then(|state| {
                    let cost = self.holding(parameter).equations(&state)?.cost;
                    Some(self.rise(cost, &state, row))
                });
                rise.is_some_and(|rise| (CHECKED_AT / rise.max(0.0).sqrt() - 1.0).abs() <= TOLERATED)
            })
        })
    }

    /// `sqrt(rise)` in variances with a parameter held so many deviations away; infinite where no camera is,
    /// and a state of lower cost if one is met.
    fn tau(&self, row: usize, parameter: Parameter, deviations: f64) -> Result<f64, Box<State>> {
        let holding = self.holding(parameter);
        // Marks follow nearly to first order: the large equations that have their positions come last.
        let marks_held = Problem { moves_marks: false, ..holding };
        let refitted = |start: State| descend(&holding, descend(&marks_held, start)?.state);
        let following = self.moved(row, parameter, deviations).and_then(refitted);
        // Where others that follow are no camera, the deviations are absurd.
        let alone =
            || self.with_value(self.minimum.state.clone(), row, parameter, deviations).and_then(refitted);
        let Some(refitted) = following.or_else(alone) else { return Ok(f64::INFINITY) };
        let rise = self.rise(refitted.equations.cost, &refitted.state, row);
        if rise < -LOWER { Err(Box::new(refitted.state)) } else { Ok(rise.max(0.0).sqrt()) }
    }

    /// By how many variances a cost with a parameter held is above the least one: what is known of it
    /// beforehand counts.
    fn rise(&self, cost: f64, state: &State, held: usize) -> f64 {
        let known = self.problem.known(state).filter(|(row, ..)| *row == held);
        let of_known: f64 = known.map(|(_, off, sd)| (off / sd) * (off / sd)).sum();
        (cost - self.minimum.equations.cost) / self.problem.variance + of_known
    }

    /// The same problem with a parameter held where the start has it.
    fn holding(&self, parameter: Parameter) -> Problem<'a> {
        Problem {
            free: self.problem.free.without(parameter),
            fy_per_fx: self.problem.fy_per_fx.filter(|_| parameter != Parameter::Fx),
            ..*self.problem
        }
    }

    /// The state with one parameter moved by so many deviations and all other unknowns following it to first
    /// order; `None` where that is no camera.
    fn moved(&self, row: usize, parameter: Parameter, deviations: f64) -> Option<State> {
        let offset = self.offset(row, deviations);
        let own = self.inverse.shared.column(row) / self.inverse.shared[(row, row)];
        let shared: DVector<f64> = own * offset;
        let poses = self.minimum.equations.following(&self.reduced, &shared)?;
        let step = Step { shared, poses, predicted_gain: 0.0 };
        // A curved path may end beside the value wanted.
        self.with_value(self.problem.stepped(&self.minimum.state, &step), row, parameter, deviations)
    }

    fn offset(&self, row: usize, deviations: f64) -> f64 {
        deviations * (self.inverse.shared[(row, row)] * self.problem.variance).sqrt()
    }

    /// A state with one parameter so many deviations away from the minimum, and what is tied to it.
    fn with_value(
        &self,
        mut state: State,
        row: usize,
        parameter: Parameter,
        deviations: f64,
    ) -> Option<State> {
        let value = self.minimum.state.camera.value(parameter)? + self.offset(row, deviations);
        state.camera = state.camera.with_value(parameter, value)?;
        if let Some(ratio) = self.problem.fy_per_fx {
            state.camera.fy = ratio * state.camera.fx;
        }
        Some(state)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{SIGMA_PX, Scene, poses, stream};
    use super::super::{MeasuredCalibration, calibrate_measured};
    use super::*;
    use crate::board::View;
    use crate::calibrate::{Settings, calibrate_lens};
    use crate::camera::{Camera, Lens, Model};

    const KNOWN: Noise = Noise::Known { sigma_px: SIGMA_PX };

    /// Parameters and their ratios, infinite where the cost never rises.
    fn not_linear(warnings: &[Warning]) -> Vec<(Parameter, [f64; 2])> {
        let ratios = |w: &Warning| match *w {
            Warning::NotLinear { parameter, below, above } => {
                Some((parameter, [below, above].map(|r| r.unwrap_or(f64::INFINITY))))
            }
            _ => None,
        };
        warnings.iter().filter_map(ratios).collect()
    }

    /// A double sphere over a narrow angle, whose parameters hang together.
    fn narrow() -> Scene {
        let lens = Lens::new(Model::DoubleSphere, &[-0.2, 0.55]).unwrap();
        Scene {
            camera: Camera::with_lens(600.0, 601.0, 322.0, 241.0, lens),
            cam_from_target: poses(6, 95.0),
            ..Scene::cube()
        }
    }

    /// `sum |r|^2 / sigma^2 + sum (c / sd)^2`.
    fn cost(found: &MeasuredCalibration, sd: f64) -> f64 {
        let pixels: f64 = found.calibration.residuals.iter().flatten().map(|r| r.norm_squared()).sum();
        let marks: f64 = found.marks.iter().map(|mark| mark.correction.norm_squared()).sum();
        pixels / (SIGMA_PX * SIGMA_PX) + if sd > 0.0 { marks / (sd * sd) } else { 0.0 }
    }

    #[test]
    fn ratios_are_those_of_calibrations_with_the_parameter_held_and_marks_that_move() {
        // From afar the distance is told by little, and the focal length with it: its inverse is known
        // evenly.
        let camera = Camera::pinhole(40_000.0, 40_100.0, 320.0, 240.0).into();
        let scene = Scene { camera, cam_from_target: poses(6, 15_000.0), ..Scene::cube() };
        let settings =
            [Parameter::Fx, Parameter::Fy].into_iter().fold(Settings::standard(), Settings::estimate);
        let held =
            [(Parameter::Cx, 320.0), (Parameter::Cy, 240.0), (Parameter::K1, 0.0), (Parameter::K2, 0.0)];
        let settings = held.into_iter().fold(settings, |all, (parameter, value)| all.hold(parameter, value));
        let (sd, mut told) = (0.02, 0);
        for trial in 0..4 {
            let (target, views) = scene.drawn(sd, &mut stream("profile", trial));
            let found = calibrate_measured(&target, &views, &settings, KNOWN).unwrap();
            let said = not_linear(&found.calibration.warnings);
            for parameter in [Parameter::Fx, Parameter::Fy] {
                let (value, deviation) = (
                    found.calibration.camera.value(parameter).unwrap(),
                    found.standard_deviation(parameter).unwrap(),
                );
                let wanted = [-2.0, 2.0].map(|side: f64| {
                    let held = settings.clone().hold(parameter, value + side * deviation);
                    let there = calibrate_measured(&target, &views, &held, KNOWN).unwrap();
                    2.0 / (cost(&there, sd) - cost(&found, sd)).sqrt()
                });
                let is_linear = wanted.iter().all(|ratio| (ratio - 1.0).abs() <= TOLERATED);
                match said.iter().find(|(named, _)| *named == parameter) {
                    Some((_, ratios)) => {
                        told += 1;
                        for (said, wanted) in ratios.iter().zip(wanted) {
                            assert!(
                                (said / wanted - 1.0).abs() < 1e-3,
                                "{trial} {parameter} {said} {wanted}"
                            );
                        }
                    }
                    None => assert!(is_linear, "{trial} {parameter} {wanted:?}"),
                }
            }
        }
        assert!(told > 3, "{told}");
    }

    #[test]
    fn a_flat_target_is_told_what_a_board_is() {
        let mut scene = narrow();
        scene.marks.iter_mut().for_each(|mark| mark.z = 0.0);
        let mut told = 0;
        for trial in 0..6 {
            let (target, views) = scene.drawn(0.0, &mut stream("flat profile", trial));
            let place = |id: &str| target.marks()[target.position(id).unwrap()].position.xy();
            let board = |view: &super::super::MeasuredView| {
                let (points, pixels) = view.marks().iter().map(|m| (place(&m.id), m.pixel)).unzip();
                View::new(points, pixels).unwrap()
            };
            let board: Vec<View> = views.iter().map(board).collect();
            let of_board = calibrate_lens(&board, &scene.settings()).unwrap();
            let of_target = calibrate_measured(&target, &views, &scene.settings(), Noise::Estimated).unwrap();
            let (a, b) = (not_linear(&of_board.warnings), not_linear(&of_target.calibration.warnings));
            for (parameter, ratios) in &a {
                let clear = ratios.iter().any(|r| (r - 1.0).abs() > 1.3 * TOLERATED);
                let other = b.iter().find(|(named, _)| named == parameter);
                assert!(other.is_some() || !clear, "{trial} {parameter} {ratios:?} {b:?}");
                for (said, wanted) in other.iter().flat_map(|(_, other)| other.iter().zip(ratios)) {
                    assert!((said / wanted - 1.0).abs() < 0.05, "{trial} {parameter} {other:?} {ratios:?}");
                    told += 1;
                }
            }
        }
        assert!(told > 3, "{told}");
    }

    #[test]
    fn what_is_known_of_a_parameter_counts_where_it_is_held() {
        let scene = narrow();
        let (target, views) = scene.drawn(0.02, &mut stream("profile", 0));
        let alone = calibrate_measured(&target, &views, &scene.settings(), KNOWN).unwrap();
        let [xi, alpha] =
            [Parameter::Xi, Parameter::Alpha].map(|p| alone.calibration.camera.value(p).unwrap());
        let known =
            |settings: Settings| settings.with_prior(Parameter::Xi, xi, 1e-4).hold(Parameter::Alpha, alpha);
        let found = calibrate_measured(&target, &views, &known(scene.settings()), KNOWN).unwrap();
        assert!(found.standard_deviation(Parameter::Xi) < Some(1.01e-4));
        assert_eq!(not_linear(&found.calibration.warnings), []);
    }

    #[test]
    fn ordinary_targets_are_told_nothing() {
        let scene = Scene::cube();
        for trial in 0..5 {
            let (target, views) = scene.drawn(0.02, &mut stream("ordinary profile", trial));
            let tied = scene.settings().tie_focal_lengths(602.0 / 600.0);
            for settings in [scene.settings(), tied] {
                let found = calibrate_measured(&target, &views, &settings, Noise::Estimated).unwrap();
                assert_eq!(not_linear(&found.calibration.warnings), []);
            }
        }
    }
}
