//! Is a minimum the right one? Its cost is held against the floor of a model in which nothing is ambiguous.
//!
//! Give every view a homography of its own instead of a pose, behind the same lens: the *relaxed model*. It holds every camera and every pose,
//! and it knows no focal length, no distance and no choice between two tilts, so that its own minimum is easily found. If a minimum of the
//! calibration is the right one and the model holds, its cost exceeds the relaxed one by chance only: by `sigma^2` times a chi-squared variable
//! with at most two degrees of freedom a view (a homography has eight parameters, a pose six).
//!
//! At a minimum of the calibration the relaxed model's gradient is left in the two strains of each plane alone
//! ([`super::kernel::Strain`]). One Gauss-Newton step along them, the lens held, tells how far the cost would fall (Rao's score test): with
//!
//! ```text
//! T = sum_i g_i^T S_i^-1 g_i,   floor F = cost - T,   statistic (T / d1) / (F / d2),   d1 = 2 V,   d2 = 2 N - 8 V - n
//! ```
//! for `V` views, `N` points and `n` free parameters of the lens, the statistic follows Fisher's distribution at most. Holding the lens makes
//! `T` smaller, so that the probability told is an upper bound.

use super::chance::fisher_tail;
use super::elimination::Eliminated;
use super::kernel::{self, Strain};
use super::minimise::{Problem, State};
use super::chunks;
use crate::camera::Parameter;

/// A right minimum of a model that holds misses its certificate with this probability at most: rare among the calibrations of a lifetime,
/// while wrong minima of consequence lie tens of orders below.
pub(super) const FALSE_ALARM: f64 = 1e-6;

/// How the cost of a minimum compares with the least that any camera and any poses could reach.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Certificate {
    /// RMSE per point, px, that the views reach with homographies of their own in place of poses.
    pub floor_rmse_px: f64,
    /// By how much the cost exceeds that floor, in variances of a pixel coordinate.
    pub excess: f64,
    /// Degrees of freedom that the excess has at most: two a view.
    pub freedom: usize,
    /// Degrees of freedom of the floor; 0 where the homographies leave none, and nothing can be certified.
    pub floor_freedom: usize,
    /// Upper bound of the probability that chance makes such an excess where the minimum is the right one and the lens model holds.
    pub p_value: f64,
}

impl Certificate {
    /// Whether the excess can be chance, at a false-alarm rate of 1e-6.
    pub fn holds(&self) -> bool {
        self.p_value >= FALSE_ALARM
    }

    /// Compares a cost with a floor.
    fn of(cost: f64, floor: f64, points: usize, freedom: usize, floor_freedom: usize) -> Certificate {
        let variance = floor / floor_freedom.max(1) as f64;
        let excess = (cost - floor).max(0.0) / variance;
        let p_value = if floor_freedom == 0 || excess.is_nan() {
            1.0
        } else {
            fisher_tail(excess / freedom as f64, freedom, floor_freedom)
        };
        Certificate {
            floor_rmse_px: (floor / points as f64).sqrt(),
            excess: if excess.is_nan() { 0.0 } else { excess },
            freedom,
            floor_freedom,
            p_value,
        }
    }
}

/// The certificate of a minimum whose pose blocks `eliminated` holds, and whose cost is `cost`.
pub(super) fn certify(
    problem: &Problem<'_>,
    state: &State,
    eliminated: &[Eliminated],
    cost: f64,
) -> Certificate {
    let views = problem.observations.len();
    let points: usize = problem.observations.iter().map(kernel_len).sum();
    let radial = kernel::is_radial(&state.camera, problem.free);
    let mut gain = 0.0;
    for part in chunks::map(problem.observations, |view, pairs| {
        let pose = &state.cam_from_target[view];
        fall(&kernel::view_strain(&state.camera, pose, pairs, problem.loss, radial), &eliminated[view])
    }) {
        gain += part;
    }
    // What rounding leaves of exact data proves nothing.
    let floor = (cost - gain).max(problem.rounding_cost()).min(cost);
    let lens = problem.free.iter().filter(|&p| p >= Parameter::K1).count();
    let floor_freedom = (2 * points).saturating_sub(8 * views + lens);
    Certificate::of(cost, floor, points, 2 * views, floor_freedom)
}

fn kernel_len(pairs: &super::normal::Observations) -> usize {
    pairs.len()
}

/// `g^T S^-1 g` of a view: the fall of its cost that a strain of its plane promises.
fn fall(strain: &Strain, pose: &Eliminated) -> f64 {
    let [a, b] = strain.pose.map(|column| pose.whiten(column));
    let dot = |x: &[f64; 6], y: &[f64; 6]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
    let (aa, ab, bb) = (
        strain.square[0] - dot(&a, &a),
        strain.square[1] - dot(&a, &b),
        strain.square[2] - dot(&b, &b),
    );
    let [ga, gb] = strain.gradient;
    // Without perspective and with few points a strain may be no more than rounding: it then says nothing.
    let known = |left: f64, whole: f64| left > SMALLEST_SHARE * whole;
    match (known(aa, strain.square[0]), known(bb, strain.square[2])) {
        (true, true) => {
            let rest = bb - ab * ab / aa;
            let first = ga * ga / aa;
            let turned = gb - ga * ab / aa;
            if known(rest, strain.square[2]) { first + turned * turned / rest } else { first }
        }
        (true, false) => ga * ga / aa,
        (false, true) => gb * gb / bb,
        (false, false) => 0.0,
    }
}

/// A strain of which less than this part is left beside the pose is known by rounding only.
const SMALLEST_SHARE: f64 = 1e-11;

