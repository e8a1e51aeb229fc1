//! What is kept of an answer? Its distance from the truth in the units of theory, so that a million answers
//! fit in memory.

use super::accept::{Breakage, Estimate, Outcome};
use super::covariance_form::CovarianceFault;
use super::plan::{Case, Plan, Purpose};
use super::protocol::Problem;
use super::setup::Setup;
use super::solver::{self, Reply};
use super::suite::Scenario;
use calibench::calibrate::calibrate_lens;
use calibench::camera::{Camera, FreeParameters, Imaging, Lens, Parameter};
use calibench::geometry::{Pose, Vec3};
use calibench::synth::fnv1a;
use nalgebra::{DMatrix, DVector, Matrix6};

/// What became of a case.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Seen {
    /// An estimate, measured.
    Estimate(Box<Trial>),
    /// No estimate, and the solver said so.
    Refused {
        /// Its reason.
        reason: String,
        /// Time it took, s.
        seconds: f64,
    },
    /// The solver is not made for problems of this kind.
    Unsupported(String),
    /// The protocol was broken.
    Broken(Breakage),
}

/// An estimate against the truth.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Trial {
    /// The camera as answered.
    pub camera: Camera<Lens>,
    /// Estimate - truth of the free parameters, in order.
    pub errors: Vec<f64>,
    /// The errors over the standard deviations of this trial's bound.
    pub standardised: Vec<f64>,
    /// `L^-1 e` with the bound `P = L L^T` of this trial: uncorrelated, of variance 1.
    pub whitened: Vec<f64>,
    /// `e^T P^-1 e` under the bound, the square of `whitened`: chi-squared with as many degrees of freedom as
    /// parameters.
    pub nees: f64,
    /// Reported standard deviations.
    pub standard_deviations: Option<Vec<f64>>,
    /// The same over those of the bound.
    pub deviations_over_bound: Option<Vec<f64>>,
    /// What is wrong with the form of the reported covariance.
    pub covariance_fault: Option<CovarianceFault>,
    /// Variances of the reported covariance along the bound's principal directions, over the bound's
    /// ([`super::principal`]).
    pub principal_variances: Option<Vec<f64>>,
    /// `e^T P^-1 e` under the reported covariance.
    pub own_nees: Option<f64>,
    /// What is wrong with the form of a reported pose covariance.
    pub pose_covariance_fault: Option<CovarianceFault>,
    /// The reported covariance of one pose against the bound: of another view in every trial.
    pub pose_spread: Option<Box<PoseSpread>>,
    /// Reported RMSE, px.
    pub rmse_px: Option<f64>,
    /// Sum of squared residuals at the reported camera and poses, px^2.
    pub square: Option<f64>,
    /// The same with poses refitted to the reported camera; for the first trials only.
    pub refitted_square: Option<f64>,
    /// `e^T P^-1 e` of every reported pose under the bound: chi-squared with six degrees of freedom. Infinite
    /// where the matrix is no rotation.
    pub pose_nees: Option<Vec<f64>>,
    /// Number of warnings.
    pub warnings: usize,
    /// A held parameter that was changed.
    pub held_changed: Option<(Parameter, f64, f64)>,
    /// A fingerprint of every number of the answer.
    pub bits: u64,
    /// Time it took, s.
    pub seconds: f64,
}

/// A reported pose covariance against the bound, both marginal.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct PoseSpread {
    /// Variances of rotation about x, y, z and translation along them, over the bound's.
    pub over_bound: Vec<f64>,
    /// The same along the bound's uncorrelated combinations.
    pub principal: Vec<f64>,
    /// `e^T S^-1 e` of the reported pose under the reported covariance S, where both are stated.
    pub own_nees: Option<f64>,
}

/// Trials whose poses are refitted, to learn how the solver defines its RMSE.
pub const REFITTED: u64 = 8;
/// A rotation matrix whose `R^T R` differs by more than this from the identity is none: single precision
/// leaves 1e-7.
const NOT_A_ROTATION: f64 = 1e-5;

/// Reduces the reply to a case.
pub fn reduce(plan: &Plan, case: &Case, problem: &Problem, reply: Reply) -> Seen {
    let Reply { outcome, seconds } = reply;
    match outcome {
        Outcome::Broken(breakage) => Seen::Broken(breakage),
        Outcome::Refused(reason) => Seen::Refused { reason, seconds },
        Outcome::Unsupported(reason) => Seen::Unsupported(reason),
        Outcome::Estimate(estimate) => Seen::Estimate(Box::new(match case.purpose {
            Purpose::Bad(index) => measure_bad(&plan.bad[index].truth, problem, &estimate, seconds),
            _ => measure(plan, case, problem, &estimate, seconds),
        })),
    }
}

fn measure(plan: &Plan, case: &Case, problem: &Problem, estimate: &Estimate, seconds: f64) -> Trial {
    let scenario = &plan.scenarios[case.scenario];
    let setup = scenario.setup_of(plan.seed, case.trial);
    let truth = &setup.scene.truth;
    let camera = match case.purpose {
        Purpose::Variant(variant) => variant.undo(&estimate.camera),
        _ => estimate.camera,
    };
    let errors = errors(&camera, &truth.camera, scenario.free);
    let plain = !matches!(case.purpose, Purpose::Variant(_));
    let poses = estimate.cam_from_target.as_ref().filter(|_| plain);
    let whitened = whitened(&setup, &errors);
    let sd: Vec<f64> = setup.bound.intrinsics.diagonal().iter().map(|variance| variance.sqrt()).collect();
    let over_bound = |values: &[f64]| values.iter().zip(&sd).map(|(x, sd)| x / sd).collect();
    Trial {
        standardised: over_bound(&errors),
        nees: whitened.iter().map(|z| z * z).sum(),
        whitened,
        deviations_over_bound: estimate.standard_deviations.as_deref().map(over_bound),
        own_nees: own_nees(estimate, &errors),
        principal_variances: estimate
            .covariance
            .as_ref()
            .filter(|_| plain)
            .map(|c| principal_variances(scenario, &setup, c)),
        square: poses.map(|poses| square(&estimate.camera, poses, problem)),
        refitted_square: (case.purpose == Purpose::Sample && case.trial < REFITTED)
            .then(|| refitted_square(&estimate.camera, problem))
            .flatten(),
        pose_nees: poses.map(|poses| pose_nees(&setup, poses)),
        pose_spread: plain.then(|| pose_spread(scenario, &setup, case.trial, estimate)).flatten(),
        camera,
        errors,
        ..unmeasured(estimate, seconds)
    }
}

/// Estimate - truth of the free parameters, in order.
fn errors(estimate: &Camera<Lens>, truth: &Camera<Lens>, free: FreeParameters) -> Vec<f64> {
    let value = |camera: &Camera<Lens>, p: Parameter| camera.value(p).unwrap_or(f64::NAN);
    free.iter().map(|p| value(estimate, p) - value(truth, p)).collect()
}

/// Bad input has no bound: only the camera and what the solver says of it are kept.
fn measure_bad(truth: &Camera<Lens>, problem: &Problem, estimate: &Estimate, seconds: f64) -> Trial {
    Trial {
        errors: errors(&estimate.camera, truth, super::accept::free_of(problem)),
        ..unmeasured(estimate, seconds)
    }
}

fn unmeasured(estimate: &Estimate, seconds: f64) -> Trial {
    Trial {
        camera: estimate.camera,
        errors: Vec::new(),
        standardised: Vec::new(),
        whitened: Vec::new(),
        nees: f64::NAN,
        standard_deviations: estimate.standard_deviations.clone(),
        deviations_over_bound: None,
        covariance_fault: estimate.covariance_fault,
        principal_variances: None,
        own_nees: None,
        pose_covariance_fault: estimate.pose_covariance_fault,
        pose_spread: None,
        rmse_px: estimate.rmse_px,
        square: None,
        refitted_square: None,
        pose_nees: None,
        warnings: estimate.warnings.len(),
        held_changed: estimate.held_changed,
        bits: fingerprint(estimate),
        seconds,
    }
}

/// Infinite where the bound is none.
fn whitened(setup: &Setup, errors: &[f64]) -> Vec<f64> {
    let factor = setup.bound.intrinsics.clone().cholesky();
    let solved = factor.and_then(|f| f.l_dirty().solve_lower_triangular(&DVector::from_row_slice(errors)));
    solved.map_or_else(|| vec![f64::INFINITY; errors.len()], |z| z.iter().copied().collect())
}

/// Variances along the principal directions of the scene's bound, over those of this trial's bound there.
fn principal_variances(scenario: &Scenario, setup: &Setup, stated: &DMatrix<f64>) -> Vec<f64> {
    let bound = scenario.principal.variances(&setup.bound.intrinsics);
    scenario
        .principal
        .variances(stated)
        .into_iter()
        .zip(bound)
        .map(|(stated, bound)| stated / bound)
        .collect()
}

fn own_nees(estimate: &Estimate, errors: &[f64]) -> Option<f64> {
    let e = DVector::from_row_slice(errors);
    Some(e.dot(&estimate.covariance.clone()?.cholesky()?.solve(&e)))
}

/// Infinite where the lens has no image of a point.
fn square(camera: &Camera<Lens>, poses: &[Pose], problem: &Problem) -> f64 {
    let mut sum = 0.0;
    for (pose, view) in poses.iter().zip(&problem.views) {
        for (&[x, y], &[u, v]) in view.target.iter().zip(&view.pixels) {
            let point = pose.apply(&Vec3::new(x, y, 0.0));
            let Some(seen) = Lens::image(camera, &point) else { return f64::INFINITY };
            sum += (seen.x - u) * (seen.x - u) + (seen.y - v) * (seen.y - v);
        }
    }
    sum
}

/// The least sum of squares that the answered camera allows: only poses are free.
fn refitted_square(camera: &Camera<Lens>, problem: &Problem) -> Option<f64> {
    let fit = calibrate_lens(&solver::views(problem).ok()?, &solver::only_poses(camera)).ok()?;
    Some(fit.rmse_px * fit.rmse_px * fit.points() as f64)
}

fn pose_nees(setup: &Setup, poses: &[Pose]) -> Vec<f64> {
    let truth = &setup.scene.truth.cam_from_target;
    let each = poses.iter().zip(truth).zip(&setup.bound.poses);
    each.map(|((estimate, truth), bound)| pose_distance(truth, estimate, bound)).collect()
}

/// `e^T P^-1 e` of a pose; infinite where the matrix is no rotation or `P` no covariance.
fn pose_distance(truth: &Pose, estimate: &Pose, covariance: &Matrix6<f64>) -> f64 {
    let r = &estimate.rotation;
    let defect = (r.transpose() * r - nalgebra::Matrix3::identity()).amax();
    if defect > NOT_A_ROTATION || r.determinant() < 0.0 {
        return f64::INFINITY;
    }
    let e = truth.step_to(estimate);
    covariance.cholesky().map_or(f64::INFINITY, |factor| e.dot(&factor.solve(&e)))
}

/// All pose covariances have the estimated noise in common: one a trial says what all do, and the views take
/// turns.
fn pose_spread(
    scenario: &Scenario,
    setup: &Setup,
    trial: u64,
    estimate: &Estimate,
) -> Option<Box<PoseSpread>> {
    let stated = estimate.pose_covariances.as_ref()?;
    let view = (trial % stated.len() as u64) as usize;
    let (stated, bound) = (stated.get(view)?, setup.bound.poses.get(view)?);
    let along =
        |m: &Matrix6<f64>| scenario.of_poses[view].variances(&DMatrix::from_fn(6, 6, |i, j| m[(i, j)]));
    let truth = &setup.scene.truth.cam_from_target[view];
    let pose = estimate.cam_from_target.as_ref().map(|poses| &poses[view]);
    Some(Box::new(PoseSpread {
        over_bound: (0..6).map(|i| stated[(i, i)] / bound[(i, i)]).collect(),
        principal: along(stated)
            .into_iter()
            .zip(along(bound))
            .map(|(stated, bound)| stated / bound)
            .collect(),
        own_nees: pose.map(|pose| pose_distance(truth, pose, stated)),
    }))
}

/// FNV-1a over the bits of every number.
fn fingerprint(estimate: &Estimate) -> u64 {
    let poses = estimate.cam_from_target.iter().flatten();
    let numbers = estimate.camera.values().map(|(_, value)| value);
    let numbers = numbers.chain(poses.flat_map(|p| p.rotation.iter().chain(p.translation.iter()).copied()));
    let numbers = numbers.chain(estimate.standard_deviations.iter().flatten().copied());
    let numbers = numbers.chain(estimate.covariance.iter().flat_map(|c| c.iter().copied()));
    let of_poses = estimate.pose_covariances.iter().flatten();
    let numbers = numbers.chain(of_poses.flat_map(|c| c.iter().copied()));
    fnv1a(numbers.chain(estimate.rmse_px).flat_map(|x| x.to_bits().to_le_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Builtin;
    use crate::solver::Solver;

    #[test]
    fn refitted_poses_leave_what_the_best_ones_leave_and_more_with_a_worse_camera() {
        let plan = Plan::new(1, 1).unwrap();
        let problem = plan.problem(&Case { scenario: 0, purpose: Purpose::Sample, trial: 0 });
        let answer = Builtin.ask(&problem).unwrap();
        let Outcome::Estimate(estimate) = super::super::accept::accept(&problem, answer) else {
            panic!("no estimate");
        };
        let camera = estimate.camera;
        let best = square(&camera, estimate.cam_from_target.as_ref().unwrap(), &problem);
        let refitted = refitted_square(&camera, &problem).unwrap();
        assert!((refitted / best - 1.0).abs() < 1e-9, "{refitted} {best}");
        let worse = camera.with_value(Parameter::Fx, camera.fx + 1.0).unwrap();
        assert!(refitted_square(&worse, &problem).unwrap() > 1.01 * best);
    }

    #[test]
    fn an_answer_is_measured_by_its_errors_in_the_units_of_the_bound() {
        let plan = Plan::new(1, 1).unwrap();
        let case = Case { scenario: 0, purpose: Purpose::Sample, trial: 0 };
        let problem = plan.problem(&case);
        let Outcome::Estimate(mut estimate) =
            super::super::accept::accept(&problem, Builtin.ask(&problem).unwrap())
        else {
            panic!("no estimate");
        };
        let setup = plan.scenarios[0].setup_of(1, 0);
        let (truth, bound) = (&setup.scene.truth, &setup.bound);
        estimate.covariance = Some(bound.intrinsics.clone() * 4.0);
        estimate.standard_deviations =
            Some(bound.intrinsics.diagonal().map(|v| 3.0 * v.sqrt()).iter().copied().collect());
        estimate.pose_covariances = Some(bound.poses.iter().map(|pose| pose * 2.5).collect());
        let trial = measure(&plan, &case, &problem, &estimate, 0.0);
        let free: Vec<Parameter> = plan.scenarios[0].free.iter().collect();
        for (i, &p) in free.iter().enumerate() {
            let error = estimate.camera.value(p).unwrap() - truth.camera.value(p).unwrap();
            assert_eq!(trial.errors[i], error);
            let sd = bound.intrinsics[(i, i)].sqrt();
            assert!((trial.standardised[i] / (error / sd) - 1.0).abs() < 1e-12);
        }
        let near =
            |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
        let e = DVector::from_column_slice(&trial.errors);
        let nees = e.dot(&(bound.intrinsics.clone().try_inverse().unwrap() * &e));
        near(trial.nees, nees);
        near(trial.own_nees.unwrap(), nees / 4.0);
        assert_eq!(trial.whitened.len(), 6);
        trial.deviations_over_bound.unwrap().iter().for_each(|ratio| near(*ratio, 3.0));
        let along = trial.principal_variances.unwrap();
        assert_eq!(along.len(), 6);
        along.iter().for_each(|ratio| near(*ratio, 4.0));
        let spread = trial.pose_spread.unwrap();
        spread.over_bound.iter().chain(&spread.principal).for_each(|ratio| near(*ratio, 2.5));
        near(spread.own_nees.unwrap(), trial.pose_nees.as_ref().unwrap()[0] / 2.5);
        assert!(trial.pose_nees.unwrap().iter().all(|nees| (0.1..40.0).contains(nees)));
    }

    #[test]
    fn a_pose_is_as_far_off_as_its_covariance_says_and_infinitely_where_it_is_no_rotation() {
        let at =
            |x: f64| Pose { rotation: nalgebra::Matrix3::identity(), translation: Vec3::new(x, 0.0, 100.0) };
        let variances = nalgebra::Vector6::new(1.0, 1.0, 1.0, 4.0, 9.0, 16.0);
        let covariance = Matrix6::from_diagonal(&variances);
        assert!((pose_distance(&at(0.0), &at(3.0), &covariance) - 9.0 / 4.0).abs() < 1e-12);
        let spoilt = |entry: f64| {
            let mut pose = at(0.0);
            pose.rotation[(2, 2)] = entry;
            pose_distance(&at(0.0), &pose, &covariance)
        };
        assert_eq!((spoilt(-1.0), spoilt(1.001)), (f64::INFINITY, f64::INFINITY));
        assert!(spoilt(1.0 + 1e-7).is_finite());
        assert_eq!(pose_distance(&at(0.0), &at(1.0), &Matrix6::zeros()), f64::INFINITY);
    }

    #[test]
    fn residuals_are_summed_over_both_coordinates_of_every_mark() {
        let camera: Camera<Lens> = Camera::pinhole(100.0, 100.0, 50.0, 40.0).into();
        let pose = Pose { rotation: nalgebra::Matrix3::identity(), translation: Vec3::new(0.0, 0.0, 10.0) };
        let plan = Plan::new(1, 1).unwrap();
        let mut problem = plan.problem(&Case { scenario: 0, purpose: Purpose::Sample, trial: 0 });
        problem.views.truncate(1);
        // Seen at (50, 40) and (60, 60).
        problem.views[0].target = vec![[0.0, 0.0], [1.0, 2.0]];
        problem.views[0].pixels = vec![[51.0, 42.0], [63.0, 56.0]];
        assert!((square(&camera, &[pose], &problem) - (1.0 + 4.0 + 9.0 + 16.0)).abs() < 1e-9);
    }
}
