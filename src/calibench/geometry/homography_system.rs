//! What are the normal equations of a homography? Sums over its points, and their solution.
//!
//! Unknowns `h0 .. h7` of `[[h0, h1, h2], [h3, h4, h5], [h6, h7, 1]]`. The rows of a point for u and v are `w
//! [a, 0, -u b]` and `w [0, a, -v b]` with `a = (x, y, 1)`, `b = (x, y)`, so that with `M = sum w^2 a a^T`,
//! `P = -sum w^2 u a b^T`, `Q = -sum w^2 v a b^T`, `T = sum w^2 (u^2 + v^2) b b^T`
//!
//! ```text
//! J^T J = [[M, 0, P], [0, M, Q], [P^T, Q^T, T]]
//! ```
//! One 3 x 3 factor of `M` serves both halves, and a 2 x 2 block is left.

use super::lanes::{Kernel, Lanes, PairBlocks, dispatch};

/// Normal equations `J^T J step = -J^T r`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NormalEquations {
    sums: [f64; SUMS],
    /// Sum of squared residuals.
    pub cost: f64,
}

/// Sums kept: six of `M`, five each of `P` and `Q`, three of `T`, eight of the gradient, the cost; in whole
/// lanes.
const SUMS: usize = 28;
/// First of `M`: xx, xy, x, yy, y, 1.
const M: usize = 0;
/// First of `P` (the negative of it): xx, xy, yy, x, y.
const P: usize = 6;
/// First of `Q`, as `P`.
const Q: usize = 11;
/// First of `T`: xx, xy, yy.
const T: usize = 16;
/// First of the gradient.
const G: usize = 19;
const COST: usize = 27;

/// The Cholesky factor: `M = L L^T`, `[P; Q]` whitened by `L`, and the 2 x 2 rest, diagonals inverted.
struct Factor {
    l: [[f64; 3]; 3],
    p: [[f64; 2]; 3],
    q: [[f64; 2]; 3],
    rest: [[f64; 2]; 2],
    /// Squared pivots.
    pivots: [f64; 5],
}

impl NormalEquations {
    /// Those of the direct linear transform: `w = 1`, residual `-(u, v)` of the image points.
    pub fn linear(pairs: &PairBlocks) -> NormalEquations {
        dispatch(Sum { pairs, h: None })
    }

    /// Those of the geometric error at `h`; infinite cost where a point falls behind the line at infinity.
    pub fn geometric(pairs: &PairBlocks, h: &[f64; 8]) -> NormalEquations {
        dispatch(Sum { pairs, h: Some(h) })
    }

    /// The step and the fall of the cost it promises, `-g^T step`; `None` where the matrix is not positive
    /// definite.
    pub fn solve(&self) -> Option<([f64; 8], f64)> {
        if !self.cost.is_finite() {
            return None;
        }
        let f = self.factor()?;
        Some(self.solve_with(&f))
    }

    /// The solution of linear equations, or the smallest squared pivot of the factor relative to its diagonal
    /// entry where that is below `smallest_pivot`; 0 if there is no factor.
    pub fn solve_if_regular(&self, smallest_pivot: f64) -> Result<[f64; 8], f64> {
        let factor = self.factor().ok_or(0.0)?;
        let diagonal = [self.sums[M], self.sums[M + 3], self.sums[M + 5], self.sums[T], self.sums[T + 2]];
        let smallest = factor.pivots.iter().zip(diagonal).map(|(p, d)| p / d).fold(1.0, f64::min);
        if smallest < smallest_pivot { Err(smallest) } else { Ok(self.solve_with(&factor).0) }
    }

    fn solve_with(&self, f: &Factor) -> ([f64; 8], f64) {
        let g: [f64; 8] = std::array::from_fn(|i| self.sums[G + i]);
        let forward = |b: [f64; 3]| {
            let y0 = b[0] * f.l[0][0];
            let y1 = (b[1] - f.l[1][0] * y0) * f.l[1][1];
            let y2 = (b[2] - f.l[2][0] * y0 - f.l[2][1] * y1) * f.l[2][2];
            [y0, y1, y2]
        };
        let back = |y: [f64; 3]| {
            let x2 = y[2] * f.l[2][2];
            let x1 = (y[1] - f.l[2][1] * x2) * f.l[1][1];
            let x0 = (y[0] - f.l[1][0] * x1 - f.l[2][0] * x2) * f.l[0][0];
            [x0, x1, x2]
        };
        let (yu, yv) = (forward([-g[0], -g[1], -g[2]]), forward([-g[3], -g[4], -g[5]]));
        let left = |j: usize| (0..3).fold(-g[6 + j], |sum, i| sum - (f.p[i][j] * yu[i] + f.q[i][j] * yv[i]));
        let z0 = left(0) * f.rest[0][0];
        let z1 = (left(1) - f.rest[1][0] * z0) * f.rest[1][1];
        let h7 = z1 * f.rest[1][1];
        let h6 = (z0 - f.rest[1][0] * h7) * f.rest[0][0];
        let less =
            |y: [f64; 3], w: &[[f64; 2]; 3]| std::array::from_fn(|i| y[i] - w[i][0] * h6 - w[i][1] * h7);
        let ([h0, h1, h2], [h3, h4, h5]) = (back(less(yu, &f.p)), back(less(yv, &f.q)));
        let step = [h0, h1, h2, h3, h4, h5, h6, h7];
        let gain = -(0..8).map(|i| g[i] * step[i]).sum::<f64>();
        (step, gain)
    }

    fn factor(&self) -> Option<Factor> {
        let s = &self.sums;
        let m = [s[M], s[M + 1], s[M + 2], s[M + 3], s[M + 4], s[M + 5]];
        let d0 = inverse_root(m[0])?;
        let (l10, l20) = (m[1] * d0, m[2] * d0);
        let pivot1 = m[3] - l10 * l10;
        let d1 = inverse_root(pivot1)?;
        let l21 = (m[4] - l20 * l10) * d1;
        let pivot2 = m[5] - l20 * l20 - l21 * l21;
        let d2 = inverse_root(pivot2)?;
        let whiten = |first: usize| {
            let column = |b: [f64; 3]| {
                let y0 = -b[0] * d0;
                let y1 = (-b[1] - l10 * y0) * d1;
                let y2 = (-b[2] - l20 * y0 - l21 * y1) * d2;
                [y0, y1, y2]
            };
            let (x, y) = (
                column([s[first], s[first + 1], s[first + 3]]),
                column([s[first + 1], s[first + 2], s[first + 4]]),
            );
            [[x[0], y[0]], [x[1], y[1]], [x[2], y[2]]]
        };
        let (p, q) = (whiten(P), whiten(Q));
        let rest = |i: usize, j: usize, own: f64| {
            (0..3).fold(own, |sum, k| sum - (p[k][i] * p[k][j] + q[k][i] * q[k][j]))
        };
        let pivot6 = rest(0, 0, s[T]);
        let d6 = inverse_root(pivot6)?;
        let l76 = rest(0, 1, s[T + 1]) * d6;
        let pivot7 = rest(1, 1, s[T + 2]) - l76 * l76;
        let d7 = inverse_root(pivot7)?;
        Some(Factor {
            l: [[d0, 0.0, 0.0], [l10, d1, 0.0], [l20, l21, d2]],
            p,
            q,
            rest: [[d6, 0.0], [l76, d7]],
            pivots: [m[0], pivot1, pivot2, pivot6, pivot7],
        })
    }
}

/// `1 / sqrt(pivot)`; `None` if it is not positive.
fn inverse_root(pivot: f64) -> Option<f64> {
    (pivot > 0.0).then(|| 1.0 / pivot.sqrt())
}

/// Sums over the pairs, at a homography or for the linear equations.
struct Sum<'a> {
    pairs: &'a PairBlocks,
    h: Option<&'a [f64; 8]>,
}

impl Kernel for Sum<'_> {
    type Output = NormalEquations;

    #[inline(always)]
    fn run<L: Lanes>(self) -> NormalEquations {
        let h = self.h.map(|h| h.map(L::splat));
        let one = L::splat(1.0);
        let mut sums = [L::zero(); SUMS];
        for (index, block) in self.pairs.blocks.iter().enumerate() {
            let (x, y) = (L::load(&block.x), L::load(&block.y));
            let (mut u, mut v) = (L::load(&block.u), L::load(&block.v));
            let (mut ru, mut rv, mut w) = (-u, -v, one);
            if let Some(h) = h {
                let depth = h[6] * x + h[7] * y + one;
                if !depth.all_positive() {
                    return NormalEquations { sums: [0.0; SUMS], cost: f64::INFINITY };
                }
                w = one / depth;
                u = (h[0] * x + h[1] * y + h[2]) * w;
                v = (h[3] * x + h[4] * y + h[5]) * w;
                (ru, rv) = (ru + u, rv + v);
            }
            if let Some(mask) = self.pairs.mask(index) {
                let mask = L::load(&mask);
                (ru, rv, w) = (ru * mask, rv * mask, w * mask);
            }
            let (wx, wy) = (w * x, w * y);
            let (xx, xy, yy) = (wx * wx, wx * wy, wy * wy);
            let (x1, y1) = (wx * w, wy * w);
            let square = u * u + v * v;
            let along = u * ru + v * rv;
            let terms = [
                [xx, xy, x1, yy],
                [y1, w * w, u * xx, u * xy],
                [u * yy, u * x1, u * y1, v * xx],
                [v * xy, v * yy, v * x1, v * y1],
                [square * xx, square * xy, square * yy, wx * ru],
                [wy * ru, w * ru, wx * rv, wy * rv],
                [w * rv, -(wx * along), -(wy * along), ru * ru + rv * rv],
            ];
            for (row, group) in terms.iter().enumerate() {
                for (column, &term) in group.iter().enumerate() {
                    sums[4 * row + column] = sums[4 * row + column] + term;
                }
            }
        }
        let mut totals = [0.0; SUMS];
        for row in 0..SUMS / 4 {
            let group = [sums[4 * row], sums[4 * row + 1], sums[4 * row + 2], sums[4 * row + 3]];
            totals[4 * row..4 * row + 4].copy_from_slice(&L::sums(group));
        }
        NormalEquations { sums: totals, cost: totals[COST] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec2;
    use crate::geometry::lanes::run_portable;
    use nalgebra::{SMatrix, SVector};

    const AT: [f64; 8] = [1.1, 0.1, 0.05, -0.08, 0.9, -0.03, 0.07, -0.04];

    fn pairs(count: usize) -> PairBlocks {
        PairBlocks::new((0..count).map(|i| {
            let angle = i as f64;
            (
                Vec2::new(libm::sin(2.0 * angle), libm::cos(3.0 * angle)),
                Vec2::new(libm::sin(2.1 * angle), libm::cos(2.9 * angle)),
            )
        }))
    }

    #[test]
    fn the_block_solution_solves_the_full_equations() {
        let pairs = pairs(23);
        let (mut square, mut gradient, mut cost) =
            (SMatrix::<f64, 8, 8>::zeros(), SVector::<f64, 8>::zeros(), 0.0);
        for (from, to) in pairs.iter() {
            let w = 1.0 / (AT[6] * from.x + AT[7] * from.y + 1.0);
            let u = (AT[0] * from.x + AT[1] * from.y + AT[2]) * w;
            let v = (AT[3] * from.x + AT[4] * from.y + AT[5]) * w;
            let a = [from.x * w, from.y * w, w];
            let rows = [
                (SVector::from([a[0], a[1], a[2], 0.0, 0.0, 0.0, -u * a[0], -u * a[1]]), u - to.x),
                (SVector::from([0.0, 0.0, 0.0, a[0], a[1], a[2], -v * a[0], -v * a[1]]), v - to.y),
            ];
            for (row, residual) in rows {
                square += row * row.transpose();
                gradient += row * residual;
                cost += residual * residual;
            }
        }
        let system = NormalEquations::geometric(&pairs, &AT);
        let (step, gain) = system.solve().unwrap();
        let expected = -square.lu().solve(&gradient).unwrap();
        // The condition number of the normalised equations is below 1e3.
        assert!((SVector::from(step) - expected).norm() <= 1e-12 * expected.norm());
        assert!((gain + gradient.dot(&expected)).abs() <= 1e-12 * gain);
        assert!((system.cost - cost).abs() <= 1e-13 * cost);
        let factor = square.cholesky().unwrap();
        let pivot =
            (0..8).map(|i| factor.l()[(i, i)] * factor.l()[(i, i)] / square[(i, i)]).fold(1.0, f64::min);
        assert_eq!(system.solve_if_regular(0.0), Ok(step));
        assert!((system.solve_if_regular(1.0).unwrap_err() - pivot).abs() <= 1e-12);
    }

    #[test]
    fn wide_registers_give_the_bits_of_plain_code() {
        for count in [4, 5, 6, 7, 63] {
            let pairs = pairs(count);
            for h in [None, Some(&AT)] {
                let (wide, plain) =
                    (dispatch(Sum { pairs: &pairs, h }), run_portable(Sum { pairs: &pairs, h }));
                assert_eq!(wide.sums.map(f64::to_bits), plain.sums.map(f64::to_bits));
            }
        }
    }
}
