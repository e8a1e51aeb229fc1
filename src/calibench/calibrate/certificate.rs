//! Is a minimum the right one? Its cost is held against the floor of a model in which nothing is ambiguous.
//!
//! Give every view a homography of its own instead of a pose, behind the same lens: the *relaxed model*. It
//! holds every camera and every pose, and it knows no focal length, no distance and no choice between two
//! tilts, so that its own minimum is easily found. If a minimum of the calibration is the right one and the
//! model holds, its cost exceeds the relaxed one by chance only: by `sigma^2` times a chi-squared variable
//! with at most two degrees of freedom a view (a homography has eight parameters, a pose six).
//!
//! At a minimum of the calibration the relaxed model's gradient is left in the two strains of each plane
//! alone ([`super::kernel::Strain`]). A Gauss-Newton step of the whole relaxed model tells how far the cost
//! would fall (Rao's score test): with the columns `E` of the strains, poses and intrinsics eliminated from
//! them,
//!
//! ```text
//! T = g^T (E^T E)^-1 g,   floor F = cost - T,   statistic (T / d1) / (F / d2),   d1 = 2 V - m,   d2 = 2 N - 8 V - (n - m)
//! ```
//! for `V` views, `N` points and `n` free parameters, `m` combinations of which free homographies leave
//! undetermined (the focal length; without distortion the principal point too). To first order the statistic
//! follows Fisher's distribution.
//!
//! **Priors.** The floor is what the pixels alone reach: no prior enters it, not one on a coefficient of the
//! lens, which the relaxed model shares, nor one on the focal length, which it does not know. A prior is one
//! more measurement that the calibration must meet and the relaxed model need not, so that the excess counts
//! the priors' share of the cost and `d1` grows by their number. A prior that the pixels contradict is a part
//! of the model that does not hold, and is not certified.
//!
//! **Robust losses.** What chance adds to the cost there is less than the mean cost of a degree of freedom, which strays
//! raise: `u = S / (f s)` ([`super::noise`]). The floor's own `u` is taken to be as much less than its mean
//! cost as that of the minimum is. And the score, whose matrix is weighted, is `s / w` of the fall that the
//! curvature says.
#![allow(clippy::needless_range_loop, reason = "indices are those of the equations")]

use super::blocks::N;
use super::chance::fisher_tail;
use super::chunks;
use super::elimination::Eliminated;
use super::estimate::Fit;
use super::kernel::{self, Strain};
use super::loss::Loss;
use super::minimise::{Minimum, Problem, State};
use super::noise::Noise;
use super::prior::Priors;
use super::system::{Reduction, System};
use crate::camera::Parameter;

/// A right minimum of a model that holds misses its certificate with this probability at most: rare among the
/// calibrations of a lifetime, while wrong minima of consequence lie tens of orders below.
pub(super) const FALSE_ALARM: f64 = 1e-6;

/// How the cost of a minimum compares with the least that any camera and any poses could reach.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Certificate {
    /// RMSE of the minimum per point, px; with a robust loss the root of the mean loss of its marks.
    pub rmse_px: f64,
    /// RMSE per point, px, that the views reach with homographies of their own in place of poses; with a
    /// robust loss the root of the mean loss.
    pub floor_rmse_px: f64,
    /// By how much the cost exceeds that floor, in variances of a pixel coordinate; with a robust loss in
    /// what one standard deviation costs.
    pub excess: f64,
    /// Degrees of freedom of the excess: two a view less those of the intrinsics that homographies do not
    /// determine; at 0 nothing can be certified.
    pub freedom: usize,
    /// Degrees of freedom of the floor; 0 where the homographies leave none, and nothing can be certified.
    pub floor_freedom: usize,
    /// Probability that chance makes such an excess where the minimum is the right one and the lens model
    /// holds.
    pub p_value: f64,
}

impl Certificate {
    /// Whether there is anything to be certified by: more measurements than homographies need, and more views
    /// than the camera needs.
    pub fn is_possible(&self) -> bool {
        self.freedom > 0 && self.floor_freedom > 0
    }

    /// Whether the excess can be chance, at a false-alarm rate of 1e-6.
    pub fn holds(&self) -> bool {
        self.p_value >= FALSE_ALARM
    }

    /// Least cost that the views' homographies reach, over `points` marks.
    pub(super) fn floor(&self, points: usize) -> f64 {
        self.floor_rmse_px * self.floor_rmse_px * points as f64
    }

    /// The same with a floor that was fitted.
    pub(super) fn with_floor(&self, problem: &Problem<'_>, minimum: &Minimum, floor: f64) -> Certificate {
        let cost = minimum.system.cost;
        let Chance { share, .. } = Chance::of(problem, &minimum.state);
        let freedoms = [self.freedom, self.floor_freedom];
        Certificate {
            rmse_px: self.rmse_px,
            ..Certificate::of(cost, floor.min(cost), points(problem), freedoms, share)
        }
    }

    /// Compares a cost with a floor.
    fn of(
        cost: f64,
        floor: f64,
        points: usize,
        [freedom, floor_freedom]: [usize; 2],
        share: f64,
    ) -> Certificate {
        let variance = share * (floor / floor_freedom.max(1) as f64);
        let excess = (cost - floor).max(0.0) / variance;
        let p_value = if floor_freedom == 0 || freedom == 0 || excess.is_nan() {
            1.0
        } else {
            fisher_tail(excess / freedom as f64, freedom, floor_freedom)
        };
        let root_mean = |cost: f64| (cost / points as f64).sqrt();
        Certificate {
            rmse_px: root_mean(cost),
            floor_rmse_px: root_mean(floor),
            excess: if excess.is_nan() { 0.0 } else { excess },
            freedom,
            floor_freedom,
            p_value,
        }
    }
}

/// The certificate of a minimum: its pose blocks and reduced equations stand in `reduction`, and its cost is
/// `cost`.
pub(super) fn certify(problem: &Problem<'_>, state: &State, reduction: &Reduction, cost: f64) -> Certificate {
    let views = problem.observations.len();
    let points = points(problem);
    let Chance { share, stretch } = Chance::of(problem, state);
    // What rounding leaves of exact data proves nothing.
    let (gain, undetermined) = if problem.priors.list.is_empty() {
        score(problem, state, reduction, [0.0; N])
    } else {
        score_of_pixels(problem, state)
    };
    let of_pixels = cost - problem.priors.cost(&state.camera);
    let floor = (of_pixels - stretch * gain).max(problem.rounding_cost).min(cost);
    let freedom = (2 * views + problem.priors.list.len()).saturating_sub(undetermined);
    let lens = problem.free.len() - undetermined;
    let floor_freedom = (2 * points).saturating_sub(8 * views + lens);
    let certificate = Certificate::of(cost, floor, points, [freedom, floor_freedom], share);
    Certificate { rmse_px: (of_pixels / points as f64).sqrt(), ..certificate }
}

/// Number of marks.
fn points(problem: &Problem<'_>) -> usize {
    problem.observations.iter().map(|pairs| pairs.len()).sum()
}

/// What chance costs under a loss, beside least squares.
struct Chance {
    /// What one standard deviation costs, over the mean cost of a degree of freedom.
    share: f64,
    /// The fall of a step's cost over its score: the curvature is less than the weighted normal matrix.
    stretch: f64,
}

impl Chance {
    fn of(problem: &Problem<'_>, state: &State) -> Chance {
        if problem.loss == Loss::Squares {
            return Chance { share: 1.0, stretch: 1.0 };
        }
        let fit = Fit::of(state, problem.observations);
        let residuals = fit.residuals.iter().flatten();
        let cost: f64 = residuals.map(|residual| problem.loss.at(residual.norm_squared()).0).sum();
        let Noise { variance, rise, .. } = Noise::of_all(&fit.residuals, problem.loss);
        Chance { share: (rise / cost).min(1.0), stretch: variance / rise }
    }
}

/// The score of the pixels alone, at a minimum under priors: there the priors hold the balance to the pixels'
/// gradient.
fn score_of_pixels(problem: &Problem<'_>, state: &State) -> (f64, usize) {
    let pixels = Problem { priors: Priors::NONE, ..*problem };
    let mut system = System::new(problem.free, problem.observations.len());
    pixels.linearise_into(state, &mut system);
    let Some(reduction) = system.reduction() else { return (0.0, 0) };
    let mut right = [0.0; N];
    for (prior, weight) in problem.priors.weighted() {
        if let Some(row) = problem.free.position(prior.parameter) {
            right[row] = weight.cost * (state.camera.get(prior.parameter) - prior.mean);
        }
    }
    score(&pixels, state, &reduction, right)
}

/// `T`: with the strains of a view eliminated after its pose, `S_i = E_i^T E_i - ...`, `U_i` their coupling
/// with the intrinsics and `g_i` their gradient, `T = sum g_i^T S_i^-1 g_i + w^T (S - sum U_i^T S_i^-1 U_i)^+
/// w` with `w = sum U_i^T S_i^-1 g_i`. The inverse is a pseudo-inverse: free homographies know no focal
/// length. Where the gradient of the intrinsics does not vanish, `right` is it with the other sign and `w`
/// starts there. Returns `T` and how many combinations of the intrinsics they leave undetermined.
fn score(problem: &Problem<'_>, state: &State, reduction: &Reduction, mut right: [f64; N]) -> (f64, usize) {
    let radial = kernel::is_radial(&state.camera, problem.free);
    let parameters: Vec<usize> = problem.free.iter().map(|p| p as usize).collect();
    let n = parameters.len();
    let mut matrix = [[0.0; N]; N];
    for (i, row) in matrix.iter_mut().enumerate().take(n) {
        for (j, entry) in row.iter_mut().enumerate().take(n) {
            *entry = reduction.schur[(i, j)];
        }
    }
    let scale: [f64; N] = std::array::from_fn(|i| if i < n { matrix[i][i] } else { 0.0 });
    let mut gain = 0.0;
    let shares = chunks::map(problem.observations, |view, pairs| {
        let strain =
            kernel::view_strain(&state.camera, &state.cam_from_target[view], pairs, problem.loss, radial);
        let strain = problem.fy_per_fx.map_or(strain, |ratio| strain.with_tie(ratio));
        Share::of(&strain, &reduction.eliminated[view], &parameters)
    });
    for share in &shares {
        for (column, gradient) in share.columns.iter().zip(share.gradient) {
            gain += gradient * gradient;
            for i in 0..n {
                right[i] += column[i] * gradient;
                for j in i..n {
                    matrix[i][j] -= column[i] * column[j];
                }
            }
        }
    }
    let (through_lens, undetermined) = quadratic_form(&mut matrix, &mut right, &scale, n);
    (gain + through_lens, undetermined)
}

/// What the strains of a view say: two orthonormal combinations of them, each with its coupling to the
/// intrinsics and its gradient.
struct Share {
    columns: [[f64; N]; 2],
    gradient: [f64; 2],
}

impl Share {
    fn of(strain: &Strain, pose: &Eliminated, parameters: &[usize]) -> Share {
        let n = parameters.len();
        let [a, b] = strain.pose.map(|column| pose.whiten(column));
        let dot = |x: &[f64; 6], y: &[f64; 6]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        let coupling = |own: &[f64; Parameter::COUNT], whitened: &[f64; 6]| {
            let through_pose = pose.coupled(whitened, n);
            let mut left = [0.0; N];
            for (i, &parameter) in parameters.iter().enumerate() {
                left[i] = own[parameter] - through_pose[i];
            }
            left
        };
        let mut columns = [coupling(&strain.intrinsics[0], &a), coupling(&strain.intrinsics[1], &b)];
        let mut gradient = strain.gradient;
        let (aa, ab) = (strain.square[0] - dot(&a, &a), strain.square[1] - dot(&a, &b));
        // Without perspective and with few points a strain may be no more than rounding: it then says
        // nothing.
        let first = inverse_root(aa, strain.square[0]);
        columns[0] = columns[0].map(|x| x * first);
        gradient[0] *= first;
        let along = ab * first;
        let rest = strain.square[2] - dot(&b, &b) - along * along;
        let second = inverse_root(rest, strain.square[2]);
        for i in 0..n {
            columns[1][i] = (columns[1][i] - along * columns[0][i]) * second;
        }
        gradient[1] = (gradient[1] - along * gradient[0]) * second;
        Share { columns, gradient }
    }
}

/// `1 / sqrt(left)`, or 0 where too little is left of the whole.
fn inverse_root(left: f64, whole: f64) -> f64 {
    if left > SMALLEST_SHARE * whole { 1.0 / left.sqrt() } else { 0.0 }
}

/// Of which less than this part is left after an elimination is known by rounding only.
const SMALLEST_SHARE: f64 = 1e-11;
/// Likewise for the intrinsics, of which free homographies leave some undetermined: several eliminations'
/// rounding.
const SMALLEST_PIVOT: f64 = 1e-9;

/// `r^T M^+ r` for a positive semi-definite `M` (upper triangle) and `r` in its range, by elimination with
/// the largest pivot first; what is left of a parameter is compared with `scale`, its size at first. Returns
/// also the rank that `M` lacks.
fn quadratic_form(
    matrix: &mut [[f64; N]; N],
    right: &mut [f64; N],
    scale: &[f64; N],
    n: usize,
) -> (f64, usize) {
    let mut sum = 0.0;
    let mut left: [bool; N] = std::array::from_fn(|i| i < n);
    for _ in 0..n {
        let share = |i: usize| matrix[i][i] / scale[i];
        let Some(p) = (0..n).filter(|&i| left[i]).max_by(|&i, &j| share(i).total_cmp(&share(j))) else {
            break;
        };
        if share(p).is_nan() || share(p) <= SMALLEST_PIVOT {
            break;
        }
        left[p] = false;
        let pivot = matrix[p][p];
        sum += right[p] * right[p] / pivot;
        let row: [f64; N] = std::array::from_fn(|j| if j < n { matrix[p.min(j)][p.max(j)] } else { 0.0 });
        for i in (0..n).filter(|&i| left[i]) {
            let factor = row[i] / pivot;
            right[i] -= factor * right[p];
            for j in (i..n).filter(|&j| left[j]) {
                matrix[i][j] -= factor * row[j];
            }
        }
    }
    (sum, left.iter().filter(|&&left| left).count())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Termination;
    use crate::calibrate::from_relaxed::beside;
    use crate::calibrate::normal::Observations;
    use crate::calibrate::tests::{four_views, observations, plain_problem};
    use crate::calibrate::{Settings, calibrate};
    use crate::camera::{Camera, FreeParameters};
    use crate::geometry::{Mat3, Pose, Vec2, Vec3};

    #[test]
    fn the_floor_is_what_pixels_reach_whatever_is_known_beforehand() {
        let views = four_views(0.1);
        // A search would fit the floor; here it is told by the score alone.
        let settings = Settings::standard().without_search();
        let alone = calibrate(&views, &settings).unwrap();
        let floor = alone.certificate.unwrap();
        // Homographies do not know the focal length: one of six intrinsics.
        assert_eq!((floor.freedom, floor.floor_freedom), (2 * 4 - 1, 504 - 8 * 4 - 5));
        for parameter in [Parameter::K1, Parameter::Cx] {
            let (value, sd) = (alone.camera.get(parameter), alone.standard_deviation(parameter).unwrap());
            // A prior as narrow as what the pixels say, six standard deviations beside.
            let known = settings.clone().with_prior(parameter, value + 6.0 * sd, sd);
            let both = calibrate(&views, &known).unwrap();
            assert!(both.rmse_px > 1.005 * alone.rmse_px);
            let own = both.certificate.unwrap();
            let ratio = own.floor_rmse_px / floor.floor_rmse_px;
            assert!((ratio - 1.0).abs() < 1e-4, "{parameter}: {ratio}");
            assert_eq!((own.freedom, own.floor_freedom), (2 * 4 - 1 + 1, floor.floor_freedom));
        }
    }

    #[test]
    fn the_quadratic_form_of_a_matrix_without_full_rank_is_that_of_its_pseudo_inverse() {
        // M = a a^T + 4 e3 e3^T with a = (2, 1, 0): r^T M^+ r = 9 + 1 for r = 3 a + 2 e3, and one rank is
        // missing.
        let (mut matrix, mut right, mut scale) = ([[0.0; N]; N], [0.0; N], [0.0; N]);
        matrix[0][..3].copy_from_slice(&[4.0, 2.0, 0.0]);
        matrix[1][..3].copy_from_slice(&[2.0, 1.0, 0.0]);
        matrix[2][..3].copy_from_slice(&[0.0, 0.0, 4.0]);
        right[..3].copy_from_slice(&[6.0, 3.0, 2.0]);
        scale[..3].copy_from_slice(&[4.0, 1.0, 4.0]);
        assert_eq!(quadratic_form(&mut matrix, &mut right, &scale, 3), (10.0, 1));
    }

    fn problem(observations: &[Observations], loss: Loss) -> Problem<'_> {
        Problem { loss, ..plain_problem(observations, FreeParameters::STANDARD) }
    }

    #[test]
    fn the_probability_of_an_excess_is_the_tail_of_fishers_distribution() {
        // Of 2 and d degrees of freedom F is exceeded with probability (1 + 2 F / d)^(-d / 2). A floor of 10
        // px^2 on 10 degrees of freedom is a variance of 1 px^2, an excess of 6 then F = 3.
        let own = Certificate::of(16.0, 10.0, 8, [2, 10], 1.0);
        assert!((own.p_value / libm::pow(1.6, -5.0) - 1.0).abs() < 1e-9, "{own:?}");
        assert_eq!((own.excess, own.rmse_px), (6.0, 2f64.sqrt()));
        assert!((own.floor(8) / 10.0 - 1.0).abs() < 1e-15);
        // Where one deviation costs half of the mean the same excess is twice as many variances.
        assert_eq!(Certificate::of(16.0, 10.0, 8, [2, 10], 0.5).excess, 12.0);
    }

    #[test]
    fn without_degrees_of_freedom_nothing_is_certified_and_nothing_held_against_a_minimum() {
        for (freedoms, is_possible) in [([0, 5], false), ([5, 0], false), ([5, 5], true)] {
            let own = Certificate::of(20.0, 1.0, 10, freedoms, 1.0);
            assert_eq!(own.is_possible(), is_possible);
            assert_eq!(own.p_value == 1.0, !is_possible, "{own:?}");
        }
        // Neither cost nor floor: no number is no excess.
        let exact = Certificate::of(0.0, 0.0, 10, [5, 5], 1.0);
        assert_eq!((exact.p_value, exact.excess), (1.0, 0.0));
    }

    #[test]
    fn what_chance_costs_under_hubers_loss_is_that_of_its_influence() {
        let camera = Camera::pinhole(600.0, 600.0, 320.0, 240.0);
        let pose = Pose { rotation: Mat3::identity(), translation: Vec3::new(0.0, 0.0, 100.0) };
        // Half of the marks lie half of delta off, half twice.
        let pair = |i: u32| {
            let point = Vec2::new(f64::from(i % 4), f64::from(i / 4)) * 10.0;
            let off = if i.is_multiple_of(2) { 0.5 } else { 2.0 };
            (point, camera.project(&Vec3::new(point.x, point.y, 100.0)).unwrap() + Vec2::new(off, 0.0))
        };
        let observations = [Observations::new((0..8).map(pair))];
        let state = State { camera, cam_from_target: vec![pose] };
        let Chance { share, stretch } =
            Chance::of(&problem(&observations, Loss::Huber { delta_px: 1.0 }), &state);
        // Weights 1 and 1/2, mean slopes of the influence 1 and 1/4; it squares to 1/4 and 1, and half the
        // marks cost 1/4, half 4 - 1.
        let (weight, slope, square, cost) = (0.75, 0.625, 0.625, 1.625);
        assert!((stretch - weight / slope).abs() < 1e-12, "{stretch}");
        assert!((share - square / slope / cost).abs() < 1e-12, "{share}");
    }

    #[test]
    fn the_floor_by_the_score_is_the_minimum_of_the_relaxed_model() {
        let views = four_views(0.1);
        let found = calibrate(&views, &Settings::standard().without_search()).unwrap();
        let observations = observations(&views);
        let problem = problem(&observations, Loss::Squares);
        let minimum =
            problem.minimise(State { camera: found.camera, cam_from_target: found.cam_from_target });
        assert_eq!(minimum.termination, Termination::Converged);
        let cost = minimum.system.cost;
        let certificate = certify(&problem, &minimum.state, &minimum.system.reduction().unwrap(), cost);
        let floor = beside(&problem, &minimum).unwrap().cost;
        // The excess is that of seven degrees of freedom, some 0.07 px^2; the score has it to second order.
        let excess = cost - floor;
        assert!((0.01..0.3).contains(&excess), "{excess}");
        assert!((certificate.floor(252) - floor).abs() < 0.02 * excess, "{} {floor}", certificate.floor(252));
    }
}
