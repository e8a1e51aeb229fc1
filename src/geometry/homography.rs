//! Which projective map takes one plane to another? Normalised DLT, then the maximum-likelihood estimate.

use super::{Mat3, Vec2, Vec3};
use nalgebra::{SMatrix, SVector};

/// A projective map of the plane: `s [u v 1]^T = H [X Y 1]^T`, defined up to scale.
#[derive(Debug, Clone, Copy, PartialEq)]
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
        /// `target` or `image`.
        side: &'static str,
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

    /// The homography `from -> to` that minimises the squared distances in `to`: the maximum-likelihood estimate under
    /// Gaussian noise on `to` alone.
    ///
    /// Start: the direct linear transform in coordinates normalised to centroid 0 and mean square radius 2
    /// (Hartley 1997), with `h33 = 1` there, which holds for any view that has the centroid of the points in front of the
    /// camera. Then Gauss-Newton on the geometric error (Zhang 2000, appendix A), halving steps that do not improve.
    ///
    /// # Errors
    /// Fewer than four pairs, or points that do not span a plane on either side.
    pub fn fit(from: &[Vec2], to: &[Vec2]) -> Result<HomographyFit, HomographyError> {
        if from.len() != to.len() {
            return Err(HomographyError::Lengths { from: from.len(), to: to.len() });
        }
        if from.len() < 4 {
            return Err(HomographyError::TooFewPoints { need: 4, got: from.len() });
        }
        let from_frame = Frame::of(from, "target")?;
        let to_frame = Frame::of(to, "image")?;
        let pairs = Pairs { from, to, from_frame, to_frame };
        let mut estimate = pairs.linear_estimate()?;
        let mut system = pairs.normal_equations(&estimate);
        let mut iterations = 0;
        while iterations < MAX_ITERATIONS {
            let Some(step) = system.solve() else { break };
            let (next, next_system) = pairs.descend(&estimate, &system, &step);
            iterations += 1;
            let gain = system.cost - next_system.cost;
            let improved = gain > 0.0;
            if improved {
                estimate = next;
                system = next_system;
            }
            if !improved || gain <= RELATIVE_GAIN * system.cost {
                break;
            }
        }
        let h = to_frame.unnormalise() * matrix(&estimate) * from_frame.normalise();
        let homography = Homography(if h[(2, 2)] != 0.0 { h / h[(2, 2)] } else { h });
        let cost = system.cost / (to_frame.scale * to_frame.scale);
        Ok(HomographyFit { homography, cost, iterations })
    }
}

/// Gauss-Newton halves the error at the very least; 30 steps are far past convergence for any usable data.
const MAX_ITERATIONS: usize = 30;
/// Convergence is quadratic-like near the optimum: a step that gained less than this leaves the estimate exact to rounding.
const RELATIVE_GAIN: f64 = 1e-12;
/// A line seen with rounding errors has 1e-16; points that leave their line by a millionth of its length still pass.
const SMALLEST_FLATNESS: f64 = 1e-12;
/// Smallest pivot, relative to its diagonal, of a well-posed normalised system: a 9 x 7 grid has 1e-2, rounding gives 1e-16.
const SMALLEST_PIVOT: f64 = 1e-11;

/// A normalising similarity: `scale (p - centroid)`.
#[derive(Debug, Clone, Copy)]
struct Frame {
    centroid: Vec2,
    scale: f64,
}

impl Frame {
    fn of(points: &[Vec2], side: &'static str) -> Result<Frame, HomographyError> {
        let count = points.len() as f64;
        let centroid = points.iter().sum::<Vec2>() / count;
        let mean_square = points.iter().map(|p| (p - centroid).norm_squared()).sum::<f64>() / count;
        let scale = (2.0 / mean_square).sqrt();
        let scatter = points.iter().fold(nalgebra::Matrix2::zeros(), |sum, p| {
            let offset = p - centroid;
            sum + offset * offset.transpose()
        });
        let flatness = 4.0 * scatter.determinant() / (scatter.trace() * scatter.trace());
        if scale.is_finite() && flatness > SMALLEST_FLATNESS {
            Ok(Frame { centroid, scale })
        } else {
            Err(HomographyError::Collinear { side, points: points.len(), flatness })
        }
    }

    fn apply(&self, p: &Vec2) -> Vec2 {
        (p - self.centroid) * self.scale
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

type Vec8 = SVector<f64, 8>;

/// `[[h0, h1, h2], [h3, h4, h5], [h6, h7, 1]]`.
fn matrix(h: &Vec8) -> Mat3 {
    Mat3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0)
}

/// Normal equations `J^T J step = -J^T r`.
struct NormalEquations {
    matrix: SMatrix<f64, 8, 8>,
    gradient: Vec8,
    cost: f64,
}

impl NormalEquations {
    fn zero() -> NormalEquations {
        NormalEquations { matrix: SMatrix::zeros(), gradient: Vec8::zeros(), cost: 0.0 }
    }

    /// Adds the rows of one point. The rows for u and v share their pattern: `[a, 0, -u a], [0, a, -v a]` with three, three
    /// and two entries, so the matrix is built from one outer product of `a = (x, y, 1)`.
    fn add(&mut self, a: &Vec3, weight: f64, u: f64, v: f64, residual: &Vec2) {
        let outer = a * a.transpose() * (weight * weight);
        let square = u * u + v * v;
        for i in 0..3 {
            for j in 0..3 {
                self.matrix[(i, j)] += outer[(i, j)];
                self.matrix[(i + 3, j + 3)] += outer[(i, j)];
            }
            for j in 0..2 {
                self.matrix[(i, j + 6)] -= u * outer[(i, j)];
                self.matrix[(i + 3, j + 6)] -= v * outer[(i, j)];
            }
        }
        for i in 0..2 {
            for j in 0..2 {
                self.matrix[(i + 6, j + 6)] += square * outer[(i, j)];
            }
        }
        let along = u * residual.x + v * residual.y;
        for i in 0..3 {
            self.gradient[i] += weight * a[i] * residual.x;
            self.gradient[i + 3] += weight * a[i] * residual.y;
        }
        for i in 0..2 {
            self.gradient[i + 6] -= weight * a[i] * along;
        }
        self.cost += residual.norm_squared();
    }

    fn solve(&self) -> Option<Vec8> {
        let mut full = self.matrix;
        full.fill_lower_triangle_with_upper_triangle();
        full.cholesky().map(|c| -c.solve(&self.gradient))
    }

    /// Smallest squared pivot of the Cholesky factor relative to its diagonal entry.
    fn smallest_pivot(&self) -> f64 {
        let mut full = self.matrix;
        full.fill_lower_triangle_with_upper_triangle();
        full.cholesky().map_or(0.0, |c| {
            (0..8).map(|i| c.l_dirty()[(i, i)] * c.l_dirty()[(i, i)] / full[(i, i)]).fold(1.0, f64::min)
        })
    }
}

/// Point pairs seen in their normalised frames.
struct Pairs<'a> {
    from: &'a [Vec2],
    to: &'a [Vec2],
    from_frame: Frame,
    to_frame: Frame,
}

impl Pairs<'_> {
    fn normalised(&self) -> impl Iterator<Item = (Vec3, Vec2)> {
        self.from.iter().zip(self.to).map(|(f, t)| {
            let f = self.from_frame.apply(f);
            (Vec3::new(f.x, f.y, 1.0), self.to_frame.apply(t))
        })
    }

    /// The direct linear transform: `u (h6 x + h7 y + 1) = h0 x + h1 y + h2` and the same for v, least squares.
    fn linear_estimate(&self) -> Result<Vec8, HomographyError> {
        let mut system = NormalEquations::zero();
        for (a, to) in self.normalised() {
            system.add(&a, 1.0, to.x, to.y, &-to);
        }
        let pivot = system.smallest_pivot();
        let degenerate = HomographyError::Degenerate { points: self.from.len(), pivot };
        if pivot < SMALLEST_PIVOT {
            return Err(degenerate);
        }
        system.solve().ok_or(degenerate)
    }

    /// Normal equations of the geometric error; infinite cost where a point falls behind the line at infinity.
    fn normal_equations(&self, h: &Vec8) -> NormalEquations {
        let h = matrix(h);
        let mut system = NormalEquations::zero();
        for (a, to) in self.normalised() {
            let image = h * a;
            if image.z.is_nan() || image.z <= 0.0 {
                system.cost = f64::INFINITY;
                return system;
            }
            let weight = 1.0 / image.z;
            let (u, v) = (image.x * weight, image.y * weight);
            system.add(&a, weight, u, v, &Vec2::new(u - to.x, v - to.y));
        }
        system
    }

    /// The step, halved until the cost falls (at most ten times).
    fn descend(&self, at: &Vec8, system: &NormalEquations, step: &Vec8) -> (Vec8, NormalEquations) {
        let mut factor = 1.0;
        loop {
            let next = at + step * factor;
            let next_system = self.normal_equations(&next);
            if next_system.cost < system.cost || factor < 1e-3 {
                return (next, next_system);
            }
            factor *= 0.5;
        }
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
            Err(HomographyError::Collinear { side: "target", .. })
        ));
        assert!(matches!(
            Homography::fit(&plane, &line),
            Err(HomographyError::Collinear { side: "image", .. })
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
