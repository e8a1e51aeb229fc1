//! Which other cameras explain the data nearly as well?
//!
//! A minimum that the search met is another camera where it lies so many standard deviations away that it
//! cannot be the same one. Where the cost is no parabola deviations may be absurdly wide, and there the
//! profile tells: with one parameter held on the way from one camera to the other the cost rises so far that
//! an interval of two standard deviations ends before (Bates & Watts 1988, section 6.1). The focal length is
//! asked first; its profile may run into the other's valley, and that of another parameter then does not.

use super::super::intervals::{Profile, Skewed};
use super::super::minimise::Minimum;
use super::super::noise::Noise;
use super::super::rival::{Met, RIVALS, Rival, SAME};
use super::super::system::Reduction;
use super::counterpart::counterpart;
use super::problem::{Problem, State};
use super::{WIDTH, walk};
use crate::camera::{Camera, Lens, Parameter};

/// Standard deviations of the intervals that end before another camera.
const INTERVAL: f64 = 2.0;
/// Cameras whose values differ by less than this part are taken for one.
const ONE_CAMERA: f64 = 0.02;
/// Cameras that are named at most.
const MOST_NAMED: usize = 3;

/// Other cameras among those that were met, the best first; `skewed` are the parameters whose cost is no
/// parabola.
pub(super) fn of(
    problem: &Problem<'_>,
    minimum: &Minimum<State, WIDTH>,
    reduction: &Reduction<WIDTH>,
    noise: Noise,
    met: &[Met<Lens>],
    skewed: &[Skewed],
) -> Vec<Rival> {
    let Some(unit) = reduction.intrinsics_covariance() else { return Vec::new() };
    let second = counterpart(problem, minimum, &unit, noise);
    let profile = Profile::new(problem, minimum, reduction, noise).filter(|_| !skewed.is_empty());
    let (best, covariance) = (walk::met(minimum), unit * noise.variance);
    let mut others: Vec<&Met<Lens>> =
        met.iter().filter(|other| other.converged && best.excess(other, noise.rise) < RIVALS).collect();
    others.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut named: Vec<(Rival, Camera<Lens>)> = second.into_iter().collect();
    let mut reached: Vec<Camera<Lens>> = Vec::new();
    for other in others {
        let camera = &other.camera;
        if named.iter().any(|(_, known)| is_one_camera(known, camera)) {
            continue;
        }
        let apart = best.apart(other, problem.free, &covariance, value);
        let mut parameter =
            apart.filter(|(_, deviations)| *deviations > SAME).map(|(parameter, _)| parameter);
        if parameter.is_none() && !reached.iter().any(|known| is_one_camera(known, camera)) {
            parameter =
                profile.as_ref().and_then(|profile| ends_before(profile, problem, &best.camera, camera));
            reached.extend(parameter.is_none().then_some(*camera));
        }
        let excess = best.excess(other, noise.rise);
        named.extend(parameter.map(|p| (Rival { parameter: p, value: value(camera, p), excess }, *camera)));
    }
    named.sort_by(|(a, _), (b, _)| a.nearer(b));
    named.into_iter().map(|(rival, _)| rival).take(MOST_NAMED).collect()
}

/// The first parameter whose interval ends before another camera's value.
fn ends_before(
    profile: &Profile<'_, Problem<'_>, WIDTH>,
    problem: &Problem<'_>,
    best: &Camera<Lens>,
    other: &Camera<Lens>,
) -> Option<Parameter> {
    let offset = |parameter| value(other, parameter) - value(best, parameter);
    let ends = |&parameter: &Parameter| !profile.reaches(parameter, offset(parameter), INTERVAL);
    if is_one_camera(best, other) { None } else { problem.free.iter().find(ends) }
}

fn value(camera: &Camera<Lens>, parameter: Parameter) -> f64 {
    camera.value(parameter).unwrap_or(0.0)
}

/// Cameras whose focal lengths agree are one to whom they are named; where these are held, the best of the
/// others is.
fn is_one_camera(a: &Camera<Lens>, b: &Camera<Lens>) -> bool {
    !differ(a.fx, b.fx) && !differ(a.fy, b.fy)
}

fn differ(a: f64, b: f64) -> bool {
    (a - b).abs() > ONE_CAMERA * a.abs().max(b.abs())
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{FREE, at_minimum};
    use super::*;
    use crate::camera::{FreeParameters, Model};

    fn camera(fx: f64, fy: f64) -> Camera<Lens> {
        Camera::with_lens(fx, fy, 320.0, 240.0, Lens::ideal(Model::KannalaBrandt))
    }

    #[test]
    fn cameras_are_one_whose_focal_lengths_both_agree_to_a_fiftieth() {
        for (fx, fy, is_one) in [
            (600.0, 600.0, true),
            (611.0, 590.0, true),
            (613.0, 600.0, false),
            (600.0, 587.0, false),
            (613.0, 613.0, false),
        ] {
            assert_eq!(is_one_camera(&camera(600.0, 600.0), &camera(fx, fy)), is_one, "{fx} {fy}");
        }
    }

    #[test]
    fn a_rival_is_a_minimum_that_is_another_camera_and_nearly_as_good() {
        at_minimum(FreeParameters::of(&FREE), 1.0, |problem, minimum| {
            let noise = Noise::of_squares(0.01);
            let own = walk::met(minimum);
            let met = |factor: f64, excess: f64, converged: bool| {
                let camera = Camera { fx: factor * own.camera.fx, fy: factor * own.camera.fy, ..own.camera };
                Met { camera, cost: own.cost + 0.01 * excess, converged }
            };
            let others = [met(1.1, 5.0, true), met(1.2, 1.0, false), met(1.3, 17.0, true), own];
            let rivals = of(problem, minimum, &minimum.system.reduction().unwrap(), noise, &others, &[]);
            let [rival] = &rivals[..] else { panic!("{rivals:?}") };
            assert!((rival.excess - 5.0).abs() < 1e-9, "{rival:?}");
            assert_eq!(Some(rival.value), others[0].camera.value(rival.parameter));
        });
    }

    #[test]
    fn the_parameter_is_named_whose_interval_ends_before_a_camera_far_away() {
        use Parameter::{Cx, Cy, K1, K2};
        at_minimum(FreeParameters::of(&[Cx, Cy, K1, K2]), 1.0, |problem, minimum| {
            let reduction = minimum.system.reduction().unwrap();
            let profile = Profile::new(problem, minimum, &reduction, Noise::of_squares(0.01)).unwrap();
            let own = &minimum.state.camera;
            let sd = |row: usize| 0.1 * reduction.intrinsics_covariance().unwrap()[(row, row)].sqrt();
            let moved = |deviations: [f64; 2]| {
                let camera = Camera { fx: 1.05 * own.fx, cx: own.cx + deviations[0] * sd(0), ..*own };
                camera.with_value(K2, value(own, K2) + deviations[1] * sd(3)).unwrap()
            };
            let named = |other: &Camera<Lens>| ends_before(&profile, problem, own, other);
            assert_eq!(named(&moved([0.0, 10.0])), Some(K2));
            assert_eq!(named(&moved([10.0, 10.0])), Some(Cx));
            assert_eq!((named(&moved([1.0, 0.0])), named(own)), (None, None));
        });
    }
}
