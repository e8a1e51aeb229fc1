//! Do the data determine the parameters, or does only their noise? Refuses calibrations whose answer would be
//! an accident.
//!
//! Views of parallel planes say no more about the linear parameters than one view does (Zhang 2000, section
//! 4), and views parallel to the image plane leave focal length and distance inseparable. With noise no two
//! planes are exactly parallel, and a solver finds some camera, with small and meaningless standard
//! deviations: linearised where the noise put it, the model looks well determined. The covariance cannot see
//! this; the cost can, and it is asked twice.
//!
//! - A parameter is moved far away and the rest refitted ([`super::walk`]): if the data do not object, the
//!   calibration is refused, and what moved along is named.
//! - Where tilts are no larger than noise makes them, all planes are held parallel: if the data fit as well,
//!   and the parameters could not be identified were the planes parallel, the calibration is refused.

use super::conditioning::{Conditioning, WeakComponent};
use super::minimise::{Minimum, Problem, State};
use super::noise::Noise;
use super::normal::Observations;
use super::prior::Priors;
use super::system::System;
use super::walk::{Far, Walked};
use super::{CalibrationError, Unknown};
use crate::camera::{FreeParameters, Parameter};
use crate::distribution::ChiSquare;
use crate::geometry::{Pose, Vec2, Vec3, rotation};

/// Why singular equations are refused.
const SINGULAR: &str = "the normal equations are singular";
/// With this probability at most data that determine nothing pass.
const FALSE_ACCEPTANCE: f64 = 1e-6;
/// Planes whose difference of tilt moves the edge of the target's image by more than this many standard
/// deviations of a pixel are not parallel by accident, and need no test.
const EVIDENT_TILT: f64 = 50.0;

/// A cost lower by more variances than this is no rounding.
const LOWER: f64 = 1e-3;
/// Iterations of the fit with parallel planes: it starts next to its answer.
const PARALLEL_ITERATIONS: usize = 50;
/// The cost rises by the square of so many standard deviations when a focal length that the data determine is
/// moved far away: three. A factor of three in focal length that costs less is no knowledge of it.
const FOCAL_RISE: f64 = 9.0;
/// Likewise for the principal point: two. It may be known poorly while the focal length is known well; then a
/// warning is enough.
const CENTRE_RISE: f64 = 4.0;

/// The least rise, in variances, that a parameter far away must cause.
pub(super) fn least_rise(parameter: Parameter) -> f64 {
    if matches!(parameter, Parameter::Cx | Parameter::Cy) { CENTRE_RISE } else { FOCAL_RISE }
}

/// What a chi-squared variable with `d` degrees of freedom exceeds with probability [`FALSE_ACCEPTANCE`].
fn largest_chance_chi_squared(degrees_of_freedom: usize) -> f64 {
    ChiSquare::new(degrees_of_freedom).quantile(1.0 - FALSE_ACCEPTANCE)
}

/// Whether the tilts of a state are so different, and so different from none, that no test is needed; for
/// noise `noise_px` on a coordinate.
pub(super) fn tilts_are_evident(problem: &Problem<'_>, state: &State, noise_px: f64) -> bool {
    doubtful_slopes(problem, state, noise_px).is_empty()
}

/// The common slopes that all planes might have: none, and the mean. Empty where the planes are evidently not
/// parallel.
fn doubtful_slopes(problem: &Problem<'_>, state: &State, noise_px: f64) -> Vec<(Vec2, &'static str)> {
    let slopes: Vec<Slope> =
        state.cam_from_target.iter().zip(problem.observations).filter_map(|(p, o)| Slope::of(p, o)).collect();
    if slopes.len() < state.cam_from_target.len() || slopes.is_empty() {
        return Vec::new(); // a plane seen edge-on is parallel to no other by accident
    }
    let focal = 0.5 * (state.camera.fx + state.camera.fy);
    let mean = slopes.iter().map(|s| s.value).sum::<Vec2>() / slopes.len() as f64;
    let mut candidates = vec![(Vec2::zeros(), "the target is parallel to the image plane in every view")];
    if slopes.len() > 1 {
        candidates.push((mean, "the target has the same tilt in every view"));
    }
    candidates.retain(|(common, _)| {
        !slopes.iter().any(|s| s.edge_shift_px(common, focal) > EVIDENT_TILT * noise_px)
    });
    candidates
}

/// Refuses if planes that are parallel explain the data and do not determine the parameters. A state of lower
/// cost, if one is met, is returned: what was given is then no minimum, and nothing is refused.
pub(super) fn refuse_if_parallel(
    problem: &Problem<'_>,
    minimum: &Minimum,
    noise: Noise,
) -> Result<Option<State>, CalibrationError> {
    if problem.free.is_empty() {
        return Ok(None);
    }
    for (slope, what) in doubtful_slopes(problem, &minimum.state, noise.px()) {
        if let Some(lower) = refuse_if_fits(problem, minimum, noise, slope, what)? {
            return Ok(Some(lower));
        }
    }
    Ok(None)
}

/// Refuses if planes of the given common slope explain the data and do not determine the parameters.
///
/// Twice the log-likelihood ratio against free tilts is at most that against free homographies, which under
/// parallel planes is chi-squared with at most four degrees of freedom a view (two of perspective, two of
/// foreshortening).
fn refuse_if_fits(
    problem: &Problem<'_>,
    minimum: &Minimum,
    noise: Noise,
    slope: Vec2,
    what: &str,
) -> Result<Option<State>, CalibrationError> {
    let parallel = Problem { hold_tilt: true, max_iterations: PARALLEL_ITERATIONS, ..*problem };
    let held = parallel.minimise(turned_to(&minimum.state, slope));
    let degrees_of_freedom = 4 * problem.observations.len();
    let bound = largest_chance_chi_squared(degrees_of_freedom);
    let ratio = (held.system.cost - minimum.system.cost) / noise.at_least(problem.rounding_cost).rise;
    if ratio < -LOWER {
        return Ok(Some(held.state));
    }
    // No number where the planes held parallel put a mark behind the camera.
    if ratio.is_nan() || ratio > bound {
        return Ok(None);
    }
    let mut exact = System::new(problem.free, problem.observations.len());
    problem.linearise_into(&held.state, &mut exact);
    let why = || {
        format!(
            "{what} within noise (holding it so raises the cost by {ratio:.1} variances, and up to {bound:.0} could be \
             chance on {degrees_of_freedom} degrees of freedom)"
        )
    };
    refuse_if_singular(exact.conditioning().as_ref(), why)?;
    if !problem.priors.list.is_empty() {
        refuse_if_priors_give_way(problem, minimum, &held.state, &exact, why)?;
    }
    Ok(None)
}

/// A parameter that parallel planes leave to the priors must be known by them: where the estimate is said to
/// be known better than this part of what they say, the difference comes from the tilts that noise made.
const GIVEN_WAY: f64 = 0.9;

/// Refuses planes that may be parallel, and then leave something to the priors, if the priors are so wide
/// that the noise's tilts decide: `exact` are the equations at the state `parallel`.
fn refuse_if_priors_give_way(
    problem: &Problem<'_>,
    minimum: &Minimum,
    parallel: &State,
    exact: &System,
    why: impl FnOnce() -> String,
) -> Result<(), CalibrationError> {
    let pixels = Problem { priors: Priors::NONE, ..*problem };
    let mut alone = System::new(problem.free, problem.observations.len());
    pixels.linearise_into(parallel, &mut alone);
    let alone = alone.conditioning();
    let covariance = |system: &System| system.reduction().and_then(|r| r.intrinsics_covariance());
    let (Some(claimed), Some(known)) = (covariance(&minimum.system), covariance(exact)) else {
        return Ok(());
    };
    let gives_way = |row: usize| claimed[(row, row)] < GIVEN_WAY * GIVEN_WAY * known[(row, row)];
    if alone.as_ref().is_some_and(|c| !c.is_singular()) || !(0..problem.free.len()).any(gives_way) {
        return Ok(());
    }
    let inseparable = alone.map_or_else(|| vec![Unknown::Camera, Unknown::Poses], |c| names(&c.weakest));
    let why =
        format!("{}, and what is known beforehand is too little to decide: state it more narrowly", why());
    Err(CalibrationError::NotIdentifiable { inseparable, why })
}

/// Refuses the normal equations of a minimum with these free parameters if they are singular.
pub(super) fn refuse_singular_minimum(
    free: FreeParameters,
    conditioning: Option<&Conditioning>,
) -> Result<(), CalibrationError> {
    if free.is_empty() { Ok(()) } else { refuse_if_singular(conditioning, || SINGULAR.into()) }
}

/// Normal equations that say nothing about some combination.
pub(super) fn singular() -> CalibrationError {
    let inseparable = vec![Unknown::Camera, Unknown::Poses];
    CalibrationError::NotIdentifiable { inseparable, why: SINGULAR.into() }
}

/// Refuses normal equations that are singular.
fn refuse_if_singular(
    conditioning: Option<&Conditioning>,
    why: impl FnOnce() -> String,
) -> Result<(), CalibrationError> {
    match conditioning {
        Some(c) if !c.is_singular() => Ok(()),
        Some(c) => Err(CalibrationError::NotIdentifiable { inseparable: names(&c.weakest), why: why() }),
        None => Err(CalibrationError::NotIdentifiable {
            inseparable: vec![Unknown::Camera, Unknown::Poses],
            why: why(),
        }),
    }
}

/// Refuses where a walk far away met no resistance.
pub(super) fn refuse_if_flat(
    problem: &Problem<'_>,
    walked: &Walked,
    noise: Noise,
) -> Result<(), CalibrationError> {
    // Exact data leave rounding as noise.
    let noise = noise.at_least(problem.rounding_cost);
    let rise = |far: &Minimum| (far.system.cost - walked.best.system.cost) / noise.rise;
    let share = |far: &Far| rise(&far.minimum) / least_rise(far.parameter);
    // A better minimum met on the way may lie where the walk ended.
    let is_elsewhere = |far: &&Far| {
        let [here, there] =
            [&walked.best, &far.minimum].map(|minimum| minimum.state.camera.get(far.parameter));
        (here - there).abs() > ELSEWHERE * here.abs()
    };
    let flattest = walked.far.iter().filter(is_elsewhere).min_by(|a, b| share(a).total_cmp(&share(b)));
    match flattest {
        Some(far) if share(far) < 1.0 => Err(CalibrationError::NotIdentifiable {
            inseparable: moved(&walked.best.state, &far.minimum.state, far.parameter),
            why: format!(
                "{} {:.5} fits as {:.5} does: the cost rises by {:.1} variances only, and {:.0} are needed to rule chance out",
                far.parameter.name(),
                far.minimum.state.camera.get(far.parameter),
                walked.best.state.camera.get(far.parameter),
                rise(&far.minimum),
                least_rise(far.parameter),
            ),
        }),
        _ => Ok(()),
    }
}

/// Groups for people: fx and fy together are the focal length, and so on; the poses' share last. Coefficients
/// that hang together among themselves only are named one by one.
fn names(weakest: &[WeakComponent]) -> Vec<Unknown> {
    if weakest.iter().all(|member| member.unknown.group() == Unknown::RadialDistortion) {
        return weakest.iter().map(|member| member.unknown).collect();
    }
    let mut names = Vec::new();
    for member in weakest {
        add(&mut names, member.unknown.group());
    }
    names
}

fn add(names: &mut Vec<Unknown>, name: Unknown) {
    if !names.contains(&name) {
        names.push(name);
    }
}

/// Two values that differ by less than this part of theirs are one.
const ELSEWHERE: f64 = 1e-3;
/// A parameter or pose that changed by less than this part between two states that fit alike did not move
/// along.
const MOVED: f64 = 0.1;

/// What moved along when a parameter was moved far away, that parameter first.
fn moved(near: &State, far: &State, parameter: Parameter) -> Vec<Unknown> {
    let mut list = Vec::new();
    add(&mut list, Unknown::Intrinsic(parameter).group());
    let (a, b) = (&near.camera, &far.camera);
    let focal = 0.5 * (a.fx + a.fy);
    if (libm::log(a.fx / b.fx)).abs().max(libm::log(a.fy / b.fy).abs()) > MOVED {
        add(&mut list, Unknown::FocalLength);
    }
    let views = || near.cam_from_target.iter().zip(&far.cam_from_target);
    let count = near.cam_from_target.len().max(1) as f64;
    let mean =
        |of: &dyn Fn(&Pose, &Pose) -> f64| (views().map(|(a, b)| of(a, b)).sum::<f64>() / count).sqrt();
    let squared = |x: f64| x * x;
    if mean(&|a, b| squared(libm::log((a.translation.z / b.translation.z).abs()))) > MOVED {
        add(&mut list, Unknown::Distance);
    }
    if (Vec2::new(a.cx, a.cy) - Vec2::new(b.cx, b.cy)).norm() > MOVED * focal {
        add(&mut list, Unknown::PrincipalPoint);
    }
    if mean(&|a, b| squared((a.translation - b.translation).xy().norm() / a.translation.z)) > MOVED {
        add(&mut list, Unknown::LateralPosition);
    }
    if mean(&|a, b| (a.rotation.column(2) - b.rotation.column(2)).norm_squared()) > MOVED {
        add(&mut list, Unknown::Tilt);
    }
    list
}

/// The tilt of a target plane: `(n_x, n_y) / n_z` of its normal in the camera's frame.
///
/// Inverse depth is linear over the image, `1/Z ~ 1 + slope . (x, y)`, so a slope `g` moves the edge of the
/// target's image, `w` px from its centre, by about `g w^2 / f` px against a plane that faces the camera.
struct Slope {
    value: Vec2,
    half_width_px: f64,
}

impl Slope {
    /// `None` for a plane seen edge-on.
    fn of(pose: &Pose, observations: &Observations) -> Option<Slope> {
        let normal = pose.rotation.column(2).into_owned();
        let (low, high) = observations.to_box();
        (normal.z.abs() > 1e-6).then(|| Slope {
            value: Vec2::new(normal.x / normal.z, normal.y / normal.z),
            half_width_px: 0.25 * (high - low).sum(),
        })
    }

    fn edge_shift_px(&self, common: &Vec2, focal: f64) -> f64 {
        (self.value - common).norm() * self.half_width_px * self.half_width_px / focal
    }
}

/// The state with every target turned, the shortest way, to the given slope.
fn turned_to(state: &State, slope: Vec2) -> State {
    let turn = |pose: &Pose| {
        let normal = pose.rotation.column(2).into_owned();
        let wanted = Vec3::new(slope.x, slope.y, 1.0).normalize() * normal.z.signum();
        let axis = normal.cross(&wanted);
        let sine = axis.norm();
        let turn = if sine > 0.0 { axis * (libm::atan2(sine, normal.dot(&wanted)) / sine) } else { axis };
        Pose { rotation: rotation::exp(&turn) * pose.rotation, translation: pose.translation }
    };
    State { camera: state.camera, cam_from_target: state.cam_from_target.iter().map(turn).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Prior;
    use crate::calibrate::Termination;
    use crate::calibrate::tests::{observations, plain_problem, seen};
    use crate::calibrate::tilt::angle_between;
    use crate::camera::Camera;

    /// What is said of a parameter that was moved far away at the cost of so many variances.
    fn verdict(parameter: Parameter, value: f64, variances: f64) -> Result<(), CalibrationError> {
        let (camera, noise_px) = (Camera::pinhole(600.0, 600.0, 320.0, 240.0), 0.1);
        let at = |camera: Camera, rise: f64| {
            let mut system = System::new(FreeParameters::STANDARD, 0);
            system.cost = 5.0 + rise * noise_px * noise_px;
            let state = State { camera, cam_from_target: Vec::new() };
            Minimum { state, system, termination: Termination::Converged, iterations: 5 }
        };
        let far = Far { parameter, minimum: at(camera.with(parameter, value), variances) };
        let walked = Walked { best: at(camera, 0.0), starts: 1, far: vec![far], met: Vec::new() };
        refuse_if_flat(
            &plain_problem(&[], FreeParameters::STANDARD),
            &walked,
            Noise::of_squares(noise_px * noise_px),
        )
    }

    #[test]
    fn a_focal_length_far_away_must_cost_three_deviations_and_a_principal_point_two() {
        for (parameter, value, deviations) in [(Parameter::Fx, 1800.0, 3.0f64), (Parameter::Cy, 540.0, 2.0)] {
            let refused = verdict(parameter, value, 0.98 * deviations * deviations);
            let Err(CalibrationError::NotIdentifiable { inseparable, .. }) = refused else {
                panic!("{parameter}: {refused:?}");
            };
            assert_eq!(inseparable[0], Unknown::Intrinsic(parameter).group());
            assert_eq!(verdict(parameter, value, 1.02 * deviations * deviations), Ok(()));
        }
        // Where the walk came back to the minimum it says nothing.
        assert_eq!(verdict(Parameter::Fx, 600.01, 0.0), Ok(()));
    }

    #[test]
    fn data_that_determine_nothing_pass_once_in_a_million() {
        // With two degrees of freedom chi-squared exceeds x with probability exp(-x / 2).
        let exceeded = libm::exp(-0.5 * largest_chance_chi_squared(2));
        assert!((exceeded / 1e-6 - 1.0).abs() < 1e-4, "{exceeded}");
    }

    #[test]
    fn equations_that_say_nothing_are_refused_unless_nothing_is_free() {
        assert!(refuse_singular_minimum(FreeParameters::STANDARD, None).is_err());
        assert_eq!(refuse_singular_minimum(FreeParameters::NONE, None), Ok(()));
    }

    #[test]
    fn what_moved_along_by_more_than_a_tenth_is_named() {
        use Unknown::{Distance, FocalLength, LateralPosition, PrincipalPoint, Tilt};
        // Mean focal length 500 px; two views, the second from twice as far.
        let state = |focal: f64, cx: f64, x: f64, away: f64, tilt: f64| {
            let pose = |side: f64, z: f64| Pose {
                rotation: rotation::from_xyz_rad(side * tilt, 0.0, 0.4),
                translation: Vec3::new(x, 3.0, z * away),
            };
            let camera = Camera::pinhole(600.0 * focal, 400.0 * focal, cx, 240.0);
            State { camera, cam_from_target: vec![pose(1.0, 100.0), pose(-1.0, 200.0)] }
        };
        let near = state(1.0, 320.0, 5.0, 1.0, 0.3);
        let first = Unknown::Intrinsic(Parameter::Skew);
        for (far, along) in [
            (state(1.0, 320.0, 5.0, 1.0, 0.3), None),
            (state(1.08, 320.0, 5.0, 1.0, 0.3), None),
            (state(1.15, 320.0, 5.0, 1.0, 0.3), Some(FocalLength)),
            (state(1.0, 350.0, 5.0, 1.0, 0.3), None),
            (state(1.0, 380.0, 5.0, 1.0, 0.3), Some(PrincipalPoint)),
            // A shift of d mm is d / 100 and d / 200 of the distance: d / 126 in the root mean square.
            (state(1.0, 320.0, 15.0, 1.0, 0.3), None),
            (state(1.0, 320.0, 19.0, 1.0, 0.3), Some(LateralPosition)),
            (state(1.0, 320.0, 5.0, 1.06, 0.3), None),
            (state(1.0, 320.0, 5.0, 1.2, 0.3), Some(Distance)),
            (state(1.0, 320.0, 5.0, 1.0, 0.38), None),
            (state(1.0, 320.0, 5.0, 1.0, 0.42), Some(Tilt)),
        ] {
            let expected: Vec<Unknown> = std::iter::once(first).chain(along).collect();
            assert_eq!(moved(&near, &far, Parameter::Skew), expected);
        }
    }

    #[test]
    fn the_shortest_turn_gives_a_plane_the_slope_that_is_wanted() {
        let slope = Vec2::new(0.3, -0.2);
        // The second is seen from behind.
        for [x, y, z] in [[0.3, -0.2, 0.5], [3.0, 0.3, 1.0]] {
            let pose =
                Pose { rotation: rotation::from_xyz_rad(x, y, z), translation: Vec3::new(1.0, 2.0, 100.0) };
            let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
            let turned = turned_to(&State { camera, cam_from_target: vec![pose] }, slope).cam_from_target[0];
            let normal = turned.rotation.column(2);
            assert!((normal.xy() / normal.z - slope).norm() < 1e-14);
            let turn = rotation::log(&(turned.rotation * pose.rotation.transpose())).norm();
            assert!((turn - angle_between(&pose, &turned)).abs() < 1e-14, "{turn}");
            assert!(turn < std::f64::consts::FRAC_PI_2 && turned.translation == pose.translation);
        }
    }

    /// A plane of this slope in y, about the optical axis.
    fn sloping(slope: f64) -> Pose {
        Pose {
            rotation: rotation::from_xyz_rad(-libm::atan(slope), 0.0, 0.0),
            translation: Vec3::new(0.0, 0.0, 100.0),
        }
    }

    #[test]
    fn planes_are_parallel_by_accident_where_no_edge_is_shifted_by_fifty_deviations() {
        // Corners of a box of half-width 100 px.
        let corners = [(-100.0, -100.0), (100.0, -100.0), (-100.0, 100.0), (100.0, 100.0)];
        let corners = corners.map(|(x, y)| (Vec2::new(x, y), Vec2::new(320.0 + x, 240.0 + y)));
        let observations = vec![Observations::new(corners.into_iter()); 2];
        // A slope g shifts the edge by g 100^2 / f = 25 g px for the mean f of 400 px.
        let camera = Camera::pinhole(500.0, 300.0, 320.0, 240.0);
        let common = |slopes: [f64; 2], noise_px: f64| -> Vec<Vec2> {
            let state = State { camera, cam_from_target: slopes.map(sloping).to_vec() };
            let list =
                doubtful_slopes(&plain_problem(&observations, FreeParameters::STANDARD), &state, noise_px);
            list.into_iter().map(|(common, _)| common).collect()
        };
        let is = |found: Vec<Vec2>, expected: &[f64]| {
            let agree = |(f, e): (&Vec2, &f64)| (f - Vec2::new(0.0, *e)).norm() < 1e-14;
            found.len() == expected.len() && found.iter().zip(expected).all(agree)
        };
        // 2.5 px either way are more than 50 * 0.048 px and less than 50 * 0.052.
        assert!(common([0.1, -0.1], 0.048).is_empty());
        assert!(is(common([0.1, -0.1], 0.052), &[0.0, 0.0]));
        // Against their mean slope 1.25 px each, against none 2.5 and 5.
        assert!(is(common([0.1, 0.2], 0.052), &[0.15]));
        // The same of slopes in x.
        let aside = Pose { rotation: rotation::from_xyz_rad(0.0, libm::atan(0.8), 0.0), ..sloping(0.0) };
        let state = State { camera, cam_from_target: vec![aside; 2] };
        let found = doubtful_slopes(&plain_problem(&observations, FreeParameters::STANDARD), &state, 0.1);
        assert!(found.len() == 1 && (found[0].0 - Vec2::new(0.8, 0.0)).norm() < 1e-14, "{found:?}");
        // No plane that is seen edge-on is parallel to another by accident.
        let edge_on =
            Pose { rotation: rotation::from_xyz_rad(std::f64::consts::FRAC_PI_2, 0.0, 0.0), ..sloping(0.0) };
        let state = State { camera, cam_from_target: vec![sloping(0.0), edge_on] };
        assert!(
            doubtful_slopes(&plain_problem(&observations, FreeParameters::STANDARD), &state, 1.0).is_empty()
        );
    }

    /// What is said of three views that face the camera, with noise of 0.1 px, where fx is free and fy
    /// follows: with what is known of fx beforehand, and a cost as if the minimum had so much more.
    fn facing(prior_sd: Option<f64>, more_cost: f64) -> Result<Option<State>, CalibrationError> {
        let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
        let pose = |(roll, z): (f64, f64)| Pose {
            rotation: rotation::from_xyz_rad(0.0, 0.0, roll),
            translation: Vec3::new(2.0, -3.0, z),
        };
        let poses = [(0.0, 120.0), (0.3, 130.0), (-0.2, 140.0)].map(pose);
        let observations = observations(&seen(&camera, &poses, 0.1));
        let noise = Noise::of_squares(0.01);
        let known = prior_sd.map(|standard_deviation| Prior {
            parameter: Parameter::Fx,
            mean: 600.0,
            standard_deviation,
        });
        let list: Vec<Prior> = known.into_iter().collect();
        let problem = Problem {
            fy_per_fx: Some(1.0),
            priors: Priors { list: &list, noise },
            ..plain_problem(&observations, FreeParameters::of(&[Parameter::Fx]))
        };
        let mut minimum = problem.minimise(State { camera, cam_from_target: poses.to_vec() });
        minimum.system.cost += more_cost;
        refuse_if_parallel(&problem, &minimum, noise)
    }

    #[test]
    fn views_that_face_the_camera_within_noise_determine_no_focal_length() {
        let Err(CalibrationError::NotIdentifiable { inseparable, why }) = facing(None, 0.0) else { panic!() };
        assert_eq!(inseparable, [Unknown::FocalLength, Unknown::Distance]);
        // Four degrees of freedom a view: 12, which exceed x with probability exp(-x / 2) sum_(k < 6) (x /
        // 2)^k / k!.
        let tail = |x: f64| {
            let terms = (1..6).scan(1.0, |term, k| {
                *term *= 0.5 * x / f64::from(k);
                Some(*term)
            });
            libm::exp(-0.5 * x) * (1.0 + terms.sum::<f64>())
        };
        let bound = (0..1000).map(|i| 0.1 * f64::from(i)).find(|&x| tail(x) < 1e-6).unwrap();
        let end = format!("up to {bound:.0} could be chance on 12 degrees of freedom)");
        assert!(
            why.starts_with("the target is parallel to the image plane in every view") && why.ends_with(&end),
            "{why}"
        );
    }

    #[test]
    fn a_prior_on_the_focal_length_must_be_narrow_where_no_tilt_tells_it() {
        let Err(CalibrationError::NotIdentifiable { why, .. }) = facing(Some(1e4), 0.0) else { panic!() };
        assert!(why.ends_with("state it more narrowly"), "{why}");
        for sd in [0.05, 1.0] {
            assert!(matches!(facing(Some(sd), 0.0), Ok(None)), "{sd}");
        }
    }

    #[test]
    fn a_lower_cost_with_parallel_planes_is_no_reason_to_refuse() {
        // A minimum a hundred variances higher than it could be is none.
        assert!(matches!(facing(None, 1.0), Ok(Some(_))));
    }
}
