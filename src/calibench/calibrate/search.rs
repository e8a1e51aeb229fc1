//! Which minimum is the right one? One start where the data leave no doubt, and a search where they do.
//!
//! Good data need one start, and the certificate says that it was enough. Otherwise the relaxed model
//! ([`super::relaxed`]) gives the lens and the homographies without it; focal lengths are tried against both
//! tilts of every plane ([`super::condensed`]); the best are refined, and tilts that perspective hardly tells
//! are tried the other way round. The least cost wins.

use super::certificate;
use super::from_relaxed::{Evidence, Found, from_relaxed};
use super::identifiability::{self, tilts_are_evident};
use super::intervals::Profile;
use super::judged::{Judged, Settled, noise_of};
use super::minimise::{Minimum, Problem, State};
use super::noise::Noise;
use super::retraction::Retraction;
use super::walk::Walked;
use super::{CalibrationError, Termination, outliers, walk};

/// The best minimum that is found; `starts` are tried in order until one converges, and the search goes on if
/// that is in doubt.
///
/// # Errors
/// Where the data do not determine focal length or principal point.
pub(super) fn best_minimum(
    problem: &Problem<'_>,
    starts: Vec<State>,
    evidence: &Evidence<'_>,
) -> Result<Judged, CalibrationError> {
    let mut starts = starts.into_iter();
    let first = problem.minimise(starts.next().expect("there is at least one start"));
    let first = Judged::of(problem, first, 1);
    if !evidence.search {
        return Ok(first);
    }
    let settled = first.is_settled(problem)?;
    if settled != Settled::Not {
        return Ok(with_tilts(problem, first, settled));
    }
    let first = first_converged(problem, first, starts);
    let settled = first.is_settled(problem)?;
    if settled != Settled::Not {
        return Ok(with_tilts(problem, first, settled));
    }
    let half_width = evidence.pixel_frame.1;
    let patient = Problem {
        max_iterations: PATIENCE * problem.max_iterations,
        retraction: Retraction::Curved,
        focal_limits: (SHORTEST * half_width, LONGEST * half_width),
        ..*problem
    };
    let Found { best, starts: count, mut met, lowest_relaxed } = from_relaxed(&patient, first, evidence);
    let best = walk::with_better_tilts(&patient, best);
    let judged = Judged::of(problem, best, count);
    let noise = judged.noise(problem);
    if judged.is_well_known(problem) && tilts_are_evident(problem, &judged.minimum.state, noise.px()) {
        return Ok(judged.certified(problem, lowest_relaxed).with_rival(problem, &met).with_twins(problem));
    }
    let centre_sd = judged.centre_deviations(problem);
    let walked = walk::far_away(&patient, judged.minimum, noise, centre_sd);
    let noise = noise_of(problem, &walked.best);
    let lower = refuse_undetermined(problem, &walked, noise)?;
    let mut best = walked.best;
    if let Some(lower) = lower {
        let minimum = patient.minimise(lower);
        if is_better(&minimum, &best) {
            best = minimum;
        }
    }
    met.extend(walked.met);
    let judged = Judged::of(problem, best, count + walked.starts);
    Ok(with_profiles(&patient, judged)
        .certified(problem, lowest_relaxed)
        .with_rival(problem, &met)
        .with_twins(problem))
}

/// A minimum that is settled, with the better of the tilts that are in doubt.
fn with_tilts(problem: &Problem<'_>, judged: Judged, settled: Settled) -> Judged {
    if settled == Settled::Entirely {
        return judged;
    }
    let starts = judged.starts;
    let best = walk::with_better_tilts(problem, judged.minimum);
    Judged::of(problem, best, starts).with_twins(problem)
}

/// Refuses what the data do not determine, where the noise is known: at a cost that its floor certifies.
/// Gross errors would pass for noise under which nothing is determined, and the advice would be wrong. A
/// state of lower cost is returned if one is met.
fn refuse_undetermined(
    problem: &Problem<'_>,
    walked: &Walked,
    noise: Noise,
) -> Result<Option<State>, CalibrationError> {
    let certified = walked.best.system.reduction().is_none_or(|reduction| {
        let best = &walked.best;
        let certificate = certificate::certify(problem, &best.state, &reduction, best.system.cost);
        !certificate.is_possible() || certificate.holds()
    });
    if !certified {
        return Ok(None);
    }
    let refused = identifiability::refuse_if_parallel(problem, &walked.best, noise)
        .and_then(|lower| identifiability::refuse_if_flat(problem, walked, noise).map(|()| lower));
    outliers::or_blamed(problem, &walked.best.state, refused)
}

/// Minima that profiles may meet on their way before the search is left as it is.
const BETTER_BY_PROFILE: usize = 3;

/// Looks along the profile of every parameter: for those that are no parabola, and for lower costs.
fn with_profiles(problem: &Problem<'_>, mut judged: Judged) -> Judged {
    for _ in 0..BETTER_BY_PROFILE {
        let noise = judged.noise(problem);
        let Some(reduction) = &judged.reduction else { break };
        let Some(profile) = Profile::new(problem, &judged.minimum, reduction, noise) else { break };
        match profile.skewed() {
            Ok(skewed) => {
                judged.skewed = skewed;
                break;
            }
            Err(state) => {
                let minimum = problem.minimise(*state);
                if !is_better(&minimum, &judged.minimum) {
                    break;
                }
                judged = Judged::of(problem, minimum, judged.starts + 1);
            }
        }
    }
    judged
}

/// A search in doubt may take this many times the iterations.
const PATIENCE: usize = 10;
/// A focal length shorter than this many half-widths of the pixels seen is no lens's: a search that comes
/// there has run away.
const SHORTEST: f64 = 0.02;
/// Likewise a longer one.
const LONGEST: f64 = 1e4;

/// The first minimum, or that of the next start that converges, or else the lowest point reached.
fn first_converged(problem: &Problem<'_>, first: Judged, starts: impl Iterator<Item = State>) -> Judged {
    let converged = |minimum: &Minimum| minimum.termination == Termination::Converged;
    if converged(&first.minimum) {
        return first;
    }
    let (mut best, mut tried) = (first.minimum, first.starts);
    for start in starts {
        tried += 1;
        let minimum = problem.minimise(start);
        if converged(&minimum) || minimum.system.cost < best.system.cost {
            best = minimum;
        }
        if converged(&best) {
            break;
        }
    }
    Judged::of(problem, best, tried)
}

/// A lower cost, by more than rounding; among equals a search that converged.
pub(super) fn is_better(new: &Minimum, old: &Minimum) -> bool {
    const EQUAL: f64 = 1e-9;
    let converged = |m: &Minimum| m.termination == Termination::Converged;
    if new.system.cost < old.system.cost * (1.0 - EQUAL) {
        return true;
    }
    converged(new) && !converged(old) && new.system.cost <= old.system.cost * (1.0 + EQUAL)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::View;
    use crate::calibrate::system::System;
    use crate::calibrate::tests::{observations, plain_problem, seen};
    use crate::calibrate::walk::Far;
    use crate::camera::{Camera, FreeParameters, Parameter};
    use crate::geometry::{Pose, Vec2, Vec3, rotation};

    #[test]
    fn a_minimum_is_better_by_more_than_rounding_or_as_good_and_converged() {
        let at = |cost: f64, converged: bool| {
            let mut system = System::new(FreeParameters::NONE, 0);
            system.cost = cost;
            let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
            let termination = if converged { Termination::Converged } else { Termination::Stalled };
            Minimum {
                state: State { camera, cam_from_target: Vec::new() },
                system,
                termination,
                iterations: 1,
            }
        };
        for (new, old, is) in [
            (at(7.0 - 1e-7, false), at(7.0, true), true),
            (at(7.0 - 1e-9, true), at(7.0, true), false),
            (at(7.0, true), at(7.0, true), false),
            (at(7.0, false), at(7.0, false), false),
            (at(7.0, true), at(7.0, false), true),
            (at(7.0 + 1e-9, true), at(7.0, false), true),
            (at(7.0 + 1e-7, true), at(7.0, false), false),
        ] {
            assert_eq!(is_better(&new, &old), is, "{} {}", new.system.cost, old.system.cost);
        }
    }

    #[test]
    fn what_the_data_leave_open_is_refused_at_a_certified_cost_only() {
        let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
        let poses = [[0.35, 0.0, 0.0], [0.0, -0.35, 0.3], [-0.26, 0.26, -0.2]].map(|[x, y, z]| Pose {
            rotation: rotation::from_xyz_rad(x, y, z),
            translation: Vec3::new(2.0, -3.0, 120.0),
        });
        // One view stretched as no pose can, and as any homography can.
        for (stretch, is_refused) in [(1.0, true), (1.05, false)] {
            let mut views = seen(&camera, &poses, 0.1);
            let pixels = views[1].pixels().iter().map(|q| Vec2::new(q.x, stretch * q.y)).collect();
            views[1] = View::new(views[1].points().to_vec(), pixels).unwrap();
            let observations = observations(&views);
            let problem = Problem {
                fy_per_fx: Some(1.0),
                ..plain_problem(&observations, FreeParameters::of(&[Parameter::Fx]))
            };
            let best = problem.minimise(State { camera, cam_from_target: poses.to_vec() });
            // As if a focal length three times as long cost no more.
            let mut minimum = best.clone();
            minimum.state.camera.fx *= 3.0;
            let far = vec![Far { parameter: Parameter::Fx, minimum }];
            let noise = noise_of(&problem, &best);
            let walked = Walked { best, starts: 1, far, met: Vec::new() };
            let outcome = refuse_undetermined(&problem, &walked, noise);
            assert_eq!(
                matches!(outcome, Err(CalibrationError::NotIdentifiable { .. })),
                is_refused,
                "{stretch}"
            );
            assert_eq!(matches!(outcome, Ok(None)), !is_refused, "{stretch}");
        }
    }
}
