//! Which of the poses that can be reached tells most of what is wanted?

use super::candidates::{Candidate, Reach, ReachError};
use super::gain::{Gain, Knowledge};
use super::information::view_information;
use super::wanted::Wish;
use crate::camera::{Camera, Lens};
use crate::geometry::{Pose, Vec2};

/// A pose with what its photograph would do.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ranked {
    /// The pose.
    pub candidate: Candidate,
    /// One a wish.
    pub gains: Vec<Gain>,
}

/// What a search found.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Found {
    /// The best pose, then those that come after it, no two of them neighbours in the grid.
    pub ranked: Vec<Ranked>,
    /// Poses of the grid.
    pub tried: usize,
    /// Those of them that show every mark.
    pub reachable: usize,
}

/// What a view of these marks at this pose does for every wish; `None` where a mark has no image, or rounding
/// leaves nothing.
pub(super) fn gains(
    camera: &Camera<Lens>,
    knowledge: &Knowledge,
    wishes: &[Wish],
    cam_from_target: &Pose,
    (points, sigma_px): (&[Vec2], f64),
) -> Option<Vec<Gain>> {
    let information = view_information(camera, &knowledge.estimated, cam_from_target, points, sigma_px)?;
    let after = knowledge.after(&information)?;
    let gain = |wish: &Wish| Gain {
        before: wish.standard_deviation(knowledge.covariance()),
        after: wish.standard_deviation(&after),
    };
    Some(wishes.iter().map(gain).collect())
}

/// What remains of all wishes together: the logarithm of the product of the parts of their standard
/// deviations, so that none counts more for its unit.
pub(super) fn remains(gains: &[Gain]) -> f64 {
    gains.iter().map(|gain| libm::log(gain.ratio())).sum()
}

/// The poses of the board whose photograph lowers the standard deviations of what is wanted most, the best
/// first, `most` of them: every pose of the grid that shows all marks is tried. Of several wishes the product
/// of what remains of each counts. `marks` are the target's points, Z = 0, and the standard deviation of a
/// pixel coordinate, px.
///
/// # Errors
/// [`ReachError`].
///
/// ```
/// use calibench::camera::{FreeParameters, Parameter};
/// use calibench::evaluate::cramer_rao;
/// use calibench::planning::{Estimated, Knowledge, Reach, Wanted, Wish, next_pose};
/// use calibench::synth::Truth;
///
/// // After four views with noise of 0.1 px: which fifth tells most of the focal length?
/// let truth = Truth::example();
/// let bound = cramer_rao(&truth, FreeParameters::STANDARD, 0.1)?;
/// let estimated = Estimated { free: bound.free, fy_per_fx: None };
/// let knowledge = Knowledge::of(estimated, &bound.intrinsics)?;
/// let camera = truth.camera.into();
/// let wish = Wish::of(Wanted::Parameter(Parameter::Fx), &camera, &estimated)?;
/// let reach = Reach {
///     image_size: truth.image_size,
///     margin_px: 10.0,
///     distances: vec![120.0, 150.0],
///     places: (5, 3),
///     tilts_rad: vec![0.0, 0.4, 0.8],
///     directions: 8,
///     turns: 2,
/// };
/// let found = next_pose(&camera, &knowledge, &[wish], (&truth.points, 0.1), &reach, 3)?;
/// let best = &found.ranked[0];
/// // Strongly tilted, it takes a third and more off what is not known of fx.
/// assert!(best.candidate.tilt_rad == 0.8 && best.gains[0].ratio() < 0.67);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn next_pose(
    camera: &Camera<Lens>,
    knowledge: &Knowledge,
    wishes: &[Wish],
    marks: (&[Vec2], f64),
    reach: &Reach,
    most: usize,
) -> Result<Found, ReachError> {
    let (candidates, tried) = reach.candidates(camera, marks.0)?;
    let reachable = candidates.len();
    let mut ranked: Vec<Ranked> = candidates
        .into_iter()
        .filter_map(|candidate| {
            let gains = gains(camera, knowledge, wishes, &candidate.cam_from_target, marks)?;
            Some(Ranked { candidate, gains })
        })
        .collect();
    // Equals keep the order of the grid.
    ranked.sort_by(|a, b| remains(&a.gains).total_cmp(&remains(&b.gains)));
    let mut chosen: Vec<Ranked> = Vec::new();
    for next in ranked {
        if chosen.len() == most {
            break;
        }
        if !chosen.iter().any(|other| other.candidate.is_next_to(&next.candidate, reach)) {
            chosen.push(next);
        }
    }
    Ok(Found { ranked: chosen, tried, reachable })
}

/// The best of views that exist, taken once more: its place among the poses, and what it does; `None` where
/// none shows these marks.
///
/// [`next_pose`] has an example of all but the last argument: the poses of the views that exist.
pub fn best_repeated(
    camera: &Camera<Lens>,
    knowledge: &Knowledge,
    wishes: &[Wish],
    marks: (&[Vec2], f64),
    cam_from_target: &[Pose],
) -> Option<(usize, Vec<Gain>)> {
    let of = |(i, pose): (usize, &Pose)| Some((i, gains(camera, knowledge, wishes, pose, marks)?));
    let all = cam_from_target.iter().enumerate().filter_map(of);
    all.min_by(|a, b| remains(&a.1).total_cmp(&remains(&b.1)))
}
