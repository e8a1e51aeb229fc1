//! Do the data determine the parameters, or does only their noise? Refuses calibrations whose answer would be an accident.
//!
//! Views of parallel planes say no more about the linear parameters than one view does (Zhang 2000, section 4), and views
//! parallel to the image plane leave focal length and distance inseparable. With noise no two planes are exactly parallel,
//! and a solver finds some camera, with small and meaningless standard deviations: linearised where the noise put it, the
//! model looks well determined. So the question is put to the data: do they fit worse if all planes are held parallel? If
//! not, and if the parameters could not be identified were the planes parallel, the data are refused.

use super::CalibrationError;
use super::Termination;
use super::conditioning::{Conditioning, WeakComponent};
use super::minimise::{Minimum, Problem, State};
use super::normal::Observations;
use super::system::System;
use crate::geometry::{Pose, Vec2, Vec3, rotation};

/// With this probability planes that are parallel pass for tilted: -ln(1e-9).
const LOG_FALSE_ACCEPTANCE: f64 = 20.7;
/// Planes whose difference of tilt moves the edge of the target's image by more than this many standard deviations of a pixel are not
/// parallel by accident, and need no test.
const EVIDENT_TILT: f64 = 50.0;
/// Iterations of the fit with parallel planes: it starts next to its answer.
const PARALLEL_ITERATIONS: usize = 50;

/// Refuses if the free parameters are not determined by the data that `problem` holds and `minimum` explains with noise
/// `sigma_px` on a pixel coordinate; `conditioning` is that of the minimum.
pub(super) fn check(
    problem: &Problem<'_>,
    minimum: &Minimum,
    conditioning: Option<&Conditioning>,
    sigma_px: f64,
) -> Result<(), CalibrationError> {
    let state = &minimum.state;
    if problem.free.is_empty() {
        return Ok(());
    }
    refuse_if_singular(conditioning, || "the normal equations are singular".to_string())?;
    let slopes: Vec<Slope> =
        state.cam_from_target.iter().zip(problem.observations).filter_map(|(p, o)| Slope::of(p, o)).collect();
    if slopes.len() < state.cam_from_target.len() {
        return Ok(()); // a plane seen edge-on is parallel to no other by accident
    }
    let focal = 0.5 * (state.camera.fx + state.camera.fy);
    let unsettled = minimum.termination != Termination::Converged;
    let suspicious = |common: Vec2| {
        let evident = |s: &Slope| s.edge_shift_px(&common, focal) > EVIDENT_TILT * sigma_px;
        unsettled || !slopes.iter().any(evident)
    };
    if suspicious(Vec2::zeros()) {
        refuse_if_fits(
            problem,
            minimum,
            sigma_px,
            Vec2::zeros(),
            "the target is parallel to the image plane in every view",
        )?;
    }
    let common = slopes.iter().map(|s| s.value).sum::<Vec2>() / slopes.len() as f64;
    if slopes.len() > 1 && suspicious(common) {
        refuse_if_fits(problem, minimum, sigma_px, common, "the target has the same tilt in every view")?;
    }
    Ok(())
}

/// Refuses if planes of the given common slope explain the data and do not determine the parameters.
///
/// Twice the log-likelihood ratio against free tilts is at most that against free homographies, which under parallel
/// planes is chi-squared with at most four degrees of freedom a view (two of perspective, two of foreshortening).
fn refuse_if_fits(
    problem: &Problem<'_>,
    minimum: &Minimum,
    sigma_px: f64,
    slope: Vec2,
    what: &str,
) -> Result<(), CalibrationError> {
    let parallel = Problem { hold_tilt: true, max_iterations: PARALLEL_ITERATIONS, ..*problem };
    let held = parallel.minimise(turned_to(&minimum.state, slope));
    let degrees_of_freedom = 4 * problem.observations.len();
    let bound = largest_chance_chi_squared(degrees_of_freedom);
    // Exact data leave rounding as noise: then planes that fit to rounding fit.
    let variance = (sigma_px * sigma_px).max(problem.rounding_cost());
    let ratio = (held.system.cost - minimum.system.cost) / variance;
    if ratio > bound {
        return Ok(());
    }
    let mut exact = System::new(problem.free, problem.observations.len());
    problem.linearise_into(&held.state, &mut exact);
    refuse_if_singular(exact.conditioning().as_ref(), || {
        format!(
            "{what} within noise (holding it so raises the cost by {ratio:.1} variances, and up to {bound:.0} could be \
             chance on {degrees_of_freedom} degrees of freedom)"
        )
    })
}

fn refuse_if_singular(
    conditioning: Option<&Conditioning>,
    why: impl FnOnce() -> String,
) -> Result<(), CalibrationError> {
    match conditioning {
        Some(c) if !c.is_singular() => Ok(()),
        Some(c) => Err(CalibrationError::NotIdentifiable { inseparable: spoken(&c.weakest), why: why() }),
        None => Err(CalibrationError::NotIdentifiable {
            inseparable: vec!["camera".into(), "poses".into()],
            why: why(),
        }),
    }
}

/// Names for people: fx and fy together are the focal length, and so on; the poses' share last.
fn spoken(weakest: &[WeakComponent]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for member in weakest {
        let name = match member.name.as_str() {
            "fx" | "fy" => "focal length",
            "cx" | "cy" => "principal point",
            "k1" | "k2" | "k3" => "radial distortion",
            "p1" | "p2" => "tangential distortion",
            other => other,
        };
        if !names.iter().any(|n| n == name) {
            names.push(name.to_string());
        }
    }
    names
}

/// A chi-squared variable with `d` degrees of freedom exceeds `d + 2 sqrt(d x) + 2 x` with probability below `exp(-x)`
/// (Laurent & Massart 2000, lemma 1).
fn largest_chance_chi_squared(degrees_of_freedom: usize) -> f64 {
    let (d, x) = (degrees_of_freedom as f64, LOG_FALSE_ACCEPTANCE);
    d + 2.0 * (d * x).sqrt() + 2.0 * x
}

/// The tilt of a target plane: `(n_x, n_y) / n_z` of its normal in the camera's frame.
///
/// Inverse depth is linear over the image, `1/Z ~ 1 + slope . (x, y)`, so a slope `g` moves the edge of the target's image,
/// `w` px from its centre, by about `g w^2 / f` px against a plane that faces the camera.
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
