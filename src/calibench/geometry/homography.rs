//! Which projective map takes one plane to another? Normalised DLT, then the maximum-likelihood estimate.

use super::homography_system::NormalEquations;
use super::lanes::{Kernel, LANES, Lanes, PairBlock, PairBlocks, dispatch};
use super::scatter::SMALLEST_FLATNESS;
use super::{Mat3, Vec2, Vec3};
use std::fmt;

/// A projective map of the plane: `s [u v 1]^T = H [X Y 1]^T`, defined up to scale.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Homography(pub Mat3);

/// A fitted homography with its fit quality.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HomographyFit {
    /// The map, scaled to `h33 = 1`.
    pub homography: Homography,
    /// Sum of squared distances in the image, px^2.
    pub cost: f64,
    /// Gauss-Newton steps taken.
    pub iterations: usize,
}

/// Why no homography can be found.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum HomographyError {
    /// Four pairs are the least.
    #[error("a homography needs at least {need} point pairs, got {got}")]
    TooFewPoints {
        /// Least number.
        need: usize,
        /// Number given.
        got: usize,
    },
    /// All points on one line or in one place.
    #[error(
        "the {points} {side} points do not span a plane (flatness {flatness:.1e}): they are collinear or coincide"
    )]
    Collinear {
        /// Which points.
        side: Side,
        /// Number of points.
        points: usize,
        /// `4 det / trace^2` of the scatter matrix: 1 for a round cloud, 0 for a line.
        flatness: f64,
    },
    /// Fewer than four points in general position: all but one on a line, or repeated points.
    #[error(
        "the {points} point pairs do not fix a homography (smallest pivot {pivot:.1e}): four of them must be in general \
         position, no three on a line"
    )]
    Degenerate {
        /// Number of points.
        points: usize,
        /// Smallest relative pivot of the normalised system.
        pivot: f64,
    },
    /// The lists differ in length.
    #[error("{from} points on one side but {to} on the other")]
    Lengths {
        /// Number on the first side.
        from: usize,
        /// Number on the second.
        to: usize,
    },
}

/// The two sets of points that a homography relates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
pub enum Side {
    /// What is mapped.
    Target,
    /// Where it is mapped to.
    Image,
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Side::Target => "target",
            Side::Image => "image",
        })
    }
}

impl Homography {
    /// The image of a point; `None` on the line that maps to infinity.
    pub fn apply(&self, point: &Vec2) -> Option<Vec2> {
        let image = self.0 * Vec3::new(point.x, point.y, 1.0);
        (image.z != 0.0).then(|| Vec2::new(image.x / image.z, image.y / image.z))
    }

    /// The inverse map; `None` if singular.
    pub fn inverse(&self) -> Option<Homography> {
        self.0.try_inverse().map(Homography)
    }

    /// The homography `from -> to` that minimises the squared distances in `to`: the maximum-likelihood
    /// estimate under Gaussian noise on `to` alone.
    ///
    /// Start: the direct linear transform in coordinates normalised to centroid 0 and mean square radius 2
    /// (Hartley 1997), with `h33 = 1` there, which holds for any view that has the centroid of the points in
    /// front of the camera. Then Gauss-Newton on the geometric error (Zhang 2000, appendix A), halving steps
    /// that do not improve.
    ///
    /// # Errors
    /// Fewer than four pairs, or points that do not span a plane on either side.
    ///
    /// ```
    /// use calibench::geometry::{Homography, Vec2};
    ///
    /// let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(x, y)| Vec2::new(x, y));
    /// let seen = [(100.0, 80.0), (300.0, 90.0), (280.0, 260.0), (120.0, 250.0)].map(|(u, v)| Vec2::new(u, v));
    /// let fit = Homography::fit(&square, &seen)?;
    /// // Four pairs are met exactly.
    /// let corner = fit.homography.apply(&square[2]).expect("in front of the camera");
    /// assert!((corner - seen[2]).norm() < 1e-9);
    /// # Ok::<(), calibench::geometry::HomographyError>(())
    /// ```
    pub fn fit(from: &[Vec2], to: &[Vec2]) -> Result<HomographyFit, HomographyError> {
        if from.len() != to.len() {
            return Err(HomographyError::Lengths { from: from.len(), to: to.len() });
        }
        Homography::fit_pairs(&PairBlocks::new(from.iter().copied().zip(to.iter().copied())), RELATIVE_GAIN)
    }

    /// [`Homography::fit`] for pairs that are already in blocks, ended when the next step promises to lower
    /// the cost by less than `relative_gain` of it.
    pub(crate) fn fit_pairs(
        pairs: &PairBlocks,
        relative_gain: f64,
    ) -> Result<HomographyFit, HomographyError> {
        if pairs.len() < 4 {
            return Err(HomographyError::TooFewPoints { need: 4, got: pairs.len() });
        }
        let [from_frame, to_frame] = Frame::both(pairs)?;
        let pairs = normalised(pairs, &from_frame, &to_frame);
        let mut estimate = linear_estimate(&pairs)?;
        let mut system = NormalEquations::geometric(&pairs, &estimate);
        let mut iterations = 0;
        let rounding_cost = (ROUNDINGS * f64::EPSILON) * (ROUNDINGS * f64::EPSILON) * pairs.len() as f64;
        while iterations < MAX_ITERATIONS {
            let Some((step, predicted_gain)) = system.solve() else { break };
            if predicted_gain <= relative_gain * system.cost || system.cost <= rounding_cost {
                break;
            }
            let (next, next_system) = descend(&pairs, &estimate, &system, &step);
            iterations += 1;
            if next_system.cost >= system.cost {
                break;
            }
            estimate = next;
            system = next_system;
        }
        let h = to_frame.unnormalise() * matrix(&estimate) * from_frame.normalise();
        let homography = Homography(if h[(2, 2)] != 0.0 { h / h[(2, 2)] } else { h });
        let cost = system.cost / (to_frame.scale * to_frame.scale);
        Ok(HomographyFit { homography, cost, iterations })
    }
}

/// Gauss-Newton halves the error at the very least; 30 steps are far past convergence for any usable data.
const MAX_ITERATIONS: usize = 30;
/// Convergence is quadratic-like near the optimum: when the next step would gain less than this part of the
/// cost, the estimate is within `1e-6 sqrt(degrees of freedom)` of a standard deviation of the minimum, and
/// the step before gained about as much more.
const RELATIVE_GAIN: f64 = 1e-12;
/// Residuals of normalised coordinates, of size 1, below this many roundings are rounding.
const ROUNDINGS: f64 = 2.0;
/// Smallest pivot, relative to its diagonal, of a well-posed normalised system: a 9 x 7 grid has 1e-2,
/// rounding gives 1e-16.
const SMALLEST_PIVOT: f64 = 1e-11;

/// A normalising similarity: `scale (p - centroid)`.
#[derive(Debug, Clone, Copy)]
struct Frame {
    centroid: Vec2,
    scale: f64,
}

impl Frame {
    /// The frames of target and image points.
    fn both(pairs: &PairBlocks) -> Result<[Frame; 2], HomographyError> {
        let [target, image] = dispatch(Moments { pairs });
        Ok([Frame::of(target, pairs.len(), Side::Target)?, Frame::of(image, pairs.len(), Side::Image)?])
    }

    fn of(spread: Spread, points: usize, side: Side) -> Result<Frame, HomographyError> {
        let Spread { centroid, xx, yy, xy } = spread;
        let trace = xx + yy;
        let scale = (2.0 * points as f64 / trace).sqrt();
        let flatness = 4.0 * (xx * yy - xy * xy) / (trace * trace);
        if scale.is_finite() && flatness > SMALLEST_FLATNESS {
            Ok(Frame { centroid, scale })
        } else {
            Err(HomographyError::Collinear { side, points, flatness })
        }
    }

    fn normalise(&self) -> Mat3 {
        let (s, c) = (self.scale, self.centroid);
        Mat3::new(s, 0.0, -s * c.x, 0.0, s, -s * c.y, 0.0, 0.0, 1.0)
    }

    fn unnormalise(&self) -> Mat3 {
        let (s, c) = (1.0 / self.scale, self.centroid);
        Mat3::new(s, 0.0, c.x, 0.0, s, c.y, 0.0, 0.0, 1.0)
    }
}

/// Centroid and scatter about it.
struct Spread {
    centroid: Vec2,
    xx: f64,
    yy: f64,
    xy: f64,
}

/// The spread of both sides of the pairs.
struct Moments<'a> {
    pairs: &'a PairBlocks,
}

impl Kernel for Moments<'_> {
    type Output = [Spread; 2];

    #[inline(always)]
    fn run<L: Lanes>(self) -> [Spread; 2] {
        let full = self.pairs.len() / LANES;
        let (blocks, rest) = self.pairs.blocks.split_at(full);
        let mask = L::load(&self.pairs.mask(full.min(self.pairs.blocks.len() - 1)).unwrap_or([1.0; LANES]));
        let mut totals = [L::zero(); 4];
        for block in blocks {
            let at = coordinates::<L>(block);
            for i in 0..4 {
                totals[i] = totals[i] + at[i];
            }
        }
        for block in rest {
            let at = coordinates::<L>(block);
            for i in 0..4 {
                totals[i] = totals[i] + at[i] * mask;
            }
        }
        let count = self.pairs.len() as f64;
        let means = L::sums(totals).map(|sum| sum / count);
        let mut scatter = [[L::zero(); 4]; 2];
        for (index, block) in self.pairs.blocks.iter().enumerate() {
            let mut offsets = coordinates::<L>(block);
            for i in 0..4 {
                offsets[i] = offsets[i] - L::splat(means[i]);
                if index >= full {
                    offsets[i] = offsets[i] * mask;
                }
            }
            for (side, sums) in scatter.iter_mut().enumerate() {
                let (x, y) = (offsets[2 * side], offsets[2 * side + 1]);
                sums[0] = sums[0] + x * x;
                sums[1] = sums[1] + y * y;
                sums[2] = sums[2] + x * y;
            }
        }
        std::array::from_fn(|side| {
            let [xx, yy, xy, _] = L::sums(scatter[side]);
            Spread { centroid: Vec2::new(means[2 * side], means[2 * side + 1]), xx, yy, xy }
        })
    }
}

#[inline(always)]
fn coordinates<L: Lanes>(block: &PairBlock) -> [L; 4] {
    [L::load(&block.x), L::load(&block.y), L::load(&block.u), L::load(&block.v)]
}

/// The pairs in their frames.
fn normalised(pairs: &PairBlocks, from: &Frame, to: &Frame) -> PairBlocks {
    let mut out = pairs.clone();
    let move_to = |values: &mut [f64; LANES], origin: f64, scale: f64| {
        for value in values {
            *value = (*value - origin) * scale;
        }
    };
    for block in &mut out.blocks {
        move_to(&mut block.x, from.centroid.x, from.scale);
        move_to(&mut block.y, from.centroid.y, from.scale);
        move_to(&mut block.u, to.centroid.x, to.scale);
        move_to(&mut block.v, to.centroid.y, to.scale);
    }
    out
}

/// `[[h0, h1, h2], [h3, h4, h5], [h6, h7, 1]]`.
fn matrix(h: &[f64; 8]) -> Mat3 {
    Mat3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0)
}

/// The direct linear transform: `u (h6 x + h7 y + 1) = h0 x + h1 y + h2` and the same for v, least squares.
fn linear_estimate(pairs: &PairBlocks) -> Result<[f64; 8], HomographyError> {
    let system = NormalEquations::linear(pairs);
    system
        .solve_if_regular(SMALLEST_PIVOT)
        .map_err(|pivot| HomographyError::Degenerate { points: pairs.len(), pivot })
}

/// The step, halved until the cost falls (at most ten times).
fn descend(
    pairs: &PairBlocks,
    at: &[f64; 8],
    system: &NormalEquations,
    step: &[f64; 8],
) -> ([f64; 8], NormalEquations) {
    let mut factor = 1.0;
    loop {
        let next = std::array::from_fn(|i| at[i] + step[i] * factor);
        let next_system = NormalEquations::geometric(pairs, &next);
        if next_system.cost < system.cost || factor < 1e-3 {
            return (next, next_system);
        }
        factor *= 0.5;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grid() -> Vec<Vec2> {
        (0..35).map(|i| Vec2::new(f64::from(i % 7) * 10.0, f64::from(i / 7) * 10.0)).collect()
    }

    proptest! {
        #[test]
        fn a_noiseless_homography_is_found_to_rounding(
            a in -0.5f64..0.5, b in -0.5f64..0.5, p in -2e-3f64..2e-3, q in -2e-3f64..2e-3,
        ) {
            let truth = Homography(Mat3::new(3.0 + a, b, 100.0, -b, 3.0 - a, 80.0, p, q, 1.0));
            let to: Vec<Vec2> = grid().iter().map(|x| truth.apply(x).unwrap()).collect();
            let fit = Homography::fit(&grid(), &to).unwrap();
            for (x, y) in grid().iter().zip(&to) {
                prop_assert!((fit.homography.apply(x).unwrap() - y).norm() < 1e-11);
            }
        }
    }

    #[test]
    fn collinear_points_are_refused() {
        let line: Vec<Vec2> = (0..9).map(|i| Vec2::new(f64::from(i), 2.0 * f64::from(i))).collect();
        let plane: Vec<Vec2> = (0..9).map(|i| Vec2::new(f64::from(i % 3), f64::from(i / 3))).collect();
        assert!(matches!(
            Homography::fit(&line, &plane),
            Err(HomographyError::Collinear { side: Side::Target, .. })
        ));
        assert!(matches!(
            Homography::fit(&plane, &line),
            Err(HomographyError::Collinear { side: Side::Image, .. })
        ));
        assert!(matches!(
            Homography::fit(&plane[..3], &plane[..3]),
            Err(HomographyError::TooFewPoints { .. })
        ));
        let same = vec![Vec2::new(1.0, 1.0); 9];
        assert!(matches!(Homography::fit(&same, &plane), Err(HomographyError::Collinear { .. })));
        let mut all_but_one = line.clone();
        all_but_one[8] = Vec2::new(3.0, -4.0);
        let truth = Homography(Mat3::new(3.0, 0.2, 100.0, -0.1, 3.1, 80.0, 1e-3, -5e-4, 1.0));
        let image: Vec<Vec2> = all_but_one.iter().map(|x| truth.apply(x).unwrap()).collect();
        assert!(matches!(Homography::fit(&all_but_one, &image), Err(HomographyError::Degenerate { .. })));
    }

    #[test]
    fn the_estimate_is_stationary_under_noise() {
        let truth = Homography(Mat3::new(3.0, 0.2, 100.0, -0.1, 3.1, 80.0, 1e-3, -5e-4, 1.0));
        let jitter = |i: usize| Vec2::new(libm::sin(7.0 * i as f64), libm::cos(11.0 * i as f64)) * 0.3;
        let to: Vec<Vec2> =
            grid().iter().enumerate().map(|(i, x)| truth.apply(x).unwrap() + jitter(i)).collect();
        let fit = Homography::fit(&grid(), &to).unwrap();
        let cost = |h: &Mat3| -> f64 {
            grid().iter().zip(&to).map(|(x, y)| (Homography(*h).apply(x).unwrap() - y).norm_squared()).sum()
        };
        assert!((cost(&fit.homography.0) - fit.cost).abs() < 1e-10);
        for i in 0..8 {
            let mut moved = fit.homography.0;
            moved[(i / 3, i % 3)] *= 1.0 + 1e-6;
            assert!(cost(&moved) >= fit.cost * (1.0 - 1e-13), "entry {i}");
        }
    }
}
