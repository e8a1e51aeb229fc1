//! What is left of a view once its pose is eliminated? Small dense algebra of fixed size, written out.
#![allow(clippy::needless_range_loop, reason = "indices are those of the equations")]

use super::blocks::{Coupling, Intrinsics, N, PoseBlock, ViewBlock};
use crate::geometry::lanes::{Kernel, LANES, Lanes, dispatch};
use nalgebra::{DMatrix, MatrixXx6, SVector};

/// A view's Cholesky factor and whitened coupling.
#[derive(Debug, Clone)]
pub(super) struct Eliminated<const W: usize = N> {
    /// `L`, lower triangle, with the inverse of its diagonal in place of the diagonal.
    factor: [[f64; 6]; 6],
    /// `W = L^-1 B^T`, and `z = L^-1 g` in column n.
    whitened: [[f64; W]; 6],
}

/// `S` (upper triangle) with the right-hand side `g_a - sum W_i^T z_i` in column n.
#[derive(Debug, Clone)]
pub(super) struct Reduced<const W: usize = N> {
    rows: [[f64; W]; W],
    right: [f64; W],
}

/// Combinations that are known worse than each unknown alone by more than this part of its square count as
/// held: rounding may have left nothing of them.
const HARDLY: f64 = 1e-10;

impl<const W: usize> Reduced<W> {
    /// The intrinsics' own part.
    pub fn of(intrinsics: &Intrinsics<W>, gradient: &SVector<f64, W>, damping: f64) -> Reduced<W> {
        let mut rows = [[0.0; W]; W];
        for (i, row) in rows.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate().skip(i) {
                *entry = intrinsics[(i, j)];
            }
            row[i] *= 1.0 + damping;
        }
        Reduced { rows, right: (*gradient).into() }
    }

    /// Less the share of some views.
    pub fn less(mut self, share: &[[f64; W]; W], n: usize) -> Reduced<W> {
        for (i, row) in share.iter().enumerate().take(n) {
            for (entry, part) in self.rows[i].iter_mut().zip(row).take(n).skip(i) {
                *entry -= part;
            }
            self.right[i] -= row[n];
        }
        self
    }

    /// `S`.
    pub fn matrix(&self, n: usize) -> DMatrix<f64> {
        DMatrix::from_fn(n, n, |i, j| self.rows[i.min(j)][i.max(j)])
    }

    /// That of some of the unknowns, in the order of `rows`, the others held, damped by [`HARDLY`].
    pub fn part(&self, rows: &[usize]) -> Reduced<W> {
        let mut part = Reduced { rows: [[0.0; W]; W], right: [0.0; W] };
        for (i, &row) in rows.iter().enumerate() {
            for (j, &column) in rows.iter().enumerate().skip(i) {
                part.rows[i][j] = self.rows[row.min(column)][row.max(column)];
            }
            part.rows[i][i] *= 1.0 + HARDLY;
            part.right[i] = self.right[row];
        }
        part
    }

    /// What the cost falls by, to second order, at the minimum over some of the unknowns, `right^T S^-1
    /// right`; `None` if it is not determined.
    pub fn gain(&self, rows: &[usize]) -> Option<f64> {
        let part = self.part(rows);
        let step = part.solve(rows.len())?;
        Some((0..rows.len()).map(|i| -step[i] * part.right[i]).sum())
    }

    /// `-S^-1 right`, 0 beyond `n`; `None` if `S` is not positive definite.
    pub fn solve(&self, n: usize) -> Option<SVector<f64, W>> {
        let mut lower = [[0.0; W]; W];
        for (i, row) in lower.iter_mut().enumerate().take(n) {
            for (j, entry) in row.iter_mut().enumerate().take(i + 1) {
                *entry = self.rows[j][i];
            }
        }
        factor_in_place(&mut lower, n)?;
        let mut x = [0.0; W];
        for i in 0..n {
            let known: f64 = (0..i).map(|k| lower[i][k] * x[k]).sum();
            x[i] = (-self.right[i] - known) * lower[i][i];
        }
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|k| lower[k][i] * x[k]).sum();
            x[i] = (x[i] - known) * lower[i][i];
        }
        Some(SVector::from(x))
    }
}

/// Cholesky factor of a lower triangle in its place, with the inverse of the diagonal in place of the
/// diagonal. `None` if not positive definite.
#[inline(always)]
fn factor_in_place<const K: usize>(lower: &mut [[f64; K]; K], n: usize) -> Option<()> {
    for j in 0..n {
        let mut pivot = lower[j][j];
        for k in 0..j {
            pivot -= lower[j][k] * lower[j][k];
        }
        if pivot.is_nan() || pivot <= 0.0 {
            return None;
        }
        let inverse = 1.0 / pivot.sqrt();
        lower[j][j] = inverse;
        for i in j + 1..n {
            let mut entry = lower[i][j];
            for k in 0..j {
                entry -= lower[i][k] * lower[j][k];
            }
            lower[i][j] = entry * inverse;
        }
    }
    Some(())
}

/// Eliminates the poses of `views`; returns `sum W^T [W z]`, of which the upper triangle is filled. `None`
/// where a block is not positive definite.
pub(super) fn eliminate<const W: usize>(
    views: &[ViewBlock<W>],
    eliminated: &mut [Eliminated<W>],
    damping: f64,
    n: usize,
) -> Option<[[f64; W]; W]> {
    match vectors::<W>(n) {
        2 => dispatch(Eliminate::<W, 2> { views, eliminated, damping, n }),
        3 => dispatch(Eliminate::<W, 3> { views, eliminated, damping, n }),
        4 => dispatch(Eliminate::<W, 4> { views, eliminated, damping, n }),
        _ => dispatch(Eliminate::<W, 6> { views, eliminated, damping, n }),
    }
}

/// Vectors of lanes that `n` numbers and one more fill: 2, 3, 4 or 6, and no more than a row has.
#[inline(always)]
fn vectors<const W: usize>(n: usize) -> usize {
    debug_assert!(n < W);
    match n / LANES {
        0 | 1 => 2,
        2 => 3,
        _ if W <= 3 * LANES => 3,
        3 => 4,
        _ => 6,
    }
}

/// Works on the first `V` vectors of every row; `n < 4 V`.
struct Eliminate<'a, const W: usize, const V: usize> {
    views: &'a [ViewBlock<W>],
    eliminated: &'a mut [Eliminated<W>],
    damping: f64,
    n: usize,
}

impl<const W: usize, const V: usize> Kernel for Eliminate<'_, W, V> {
    type Output = Option<[[f64; W]; W]>;

    #[inline(always)]
    fn run<L: Lanes>(self) -> Option<[[f64; W]; W]> {
        let mut squares = [[L::zero(); V]; W];
        for (view, out) in self.views.iter().zip(self.eliminated) {
            let mut lower = [[0.0; 6]; 6];
            for (i, row) in lower.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate().take(i + 1) {
                    *entry = view.pose[(j, i)];
                }
                row[i] *= 1.0 + self.damping;
            }
            factor_in_place(&mut lower, 6)?;
            let mut w = [[L::zero(); V]; 6];
            for i in 0..6 {
                w[i] = row_of::<L, W, V>(&view.coupling, view.gradient[i], i, self.n);
                for k in 0..i {
                    let factor = L::splat(lower[i][k]);
                    for v in 0..V {
                        w[i][v] = w[i][v] - factor * w[k][v];
                    }
                }
                let inverse = L::splat(lower[i][i]);
                for v in 0..V {
                    w[i][v] = w[i][v] * inverse;
                    store(&mut out.whitened[i], v, w[i][v]);
                }
            }
            out.factor = lower;
            for k in 0..6 {
                for i in 0..V * LANES {
                    let factor = L::splat(out.whitened[k][i]);
                    for v in i / LANES..V {
                        squares[i][v] = squares[i][v] + factor * w[k][v];
                    }
                }
            }
        }
        let mut sums = [[0.0; W]; W];
        for (row, target) in squares.iter().zip(&mut sums) {
            for (v, &lanes) in row.iter().enumerate() {
                store(target, v, lanes);
            }
        }
        Some(sums)
    }
}

/// Column `i` of the coupling as a row, with the gradient in column `n`.
#[inline(always)]
fn row_of<L: Lanes, const W: usize, const V: usize>(
    coupling: &Coupling<W>,
    gradient: f64,
    i: usize,
    n: usize,
) -> [L; V] {
    let mut row = [0.0; W];
    row.copy_from_slice(&coupling.as_slice()[i * W..(i + 1) * W]);
    row[n] = gradient;
    std::array::from_fn(|v| load(&row, v))
}

/// Vector `v` of a row.
#[inline(always)]
fn load<L: Lanes, const W: usize>(row: &[f64; W], v: usize) -> L {
    let at = v * LANES;
    L::load(&[row[at], row[at + 1], row[at + 2], row[at + 3]])
}

#[inline(always)]
fn store<L: Lanes, const W: usize>(row: &mut [f64; W], v: usize, lanes: L) {
    row[v * LANES..(v + 1) * LANES].copy_from_slice(&lanes.store());
}

impl<const W: usize> Default for Eliminated<W> {
    fn default() -> Eliminated<W> {
        Eliminated { factor: [[0.0; 6]; 6], whitened: [[0.0; W]; 6] }
    }
}

impl<const W: usize> Eliminated<W> {
    /// `-L^-T (z + W d_a)`.
    pub fn pose_step(&self, intrinsics: &SVector<f64, W>, n: usize) -> SVector<f64, 6> {
        let mut rest = [0.0; 6];
        for (r, row) in rest.iter_mut().zip(&self.whitened) {
            *r = -row[n];
            for (w, d) in row.iter().zip(intrinsics.iter()).take(n) {
                *r -= w * d;
            }
        }
        SVector::from(self.solve_transposed(rest))
    }

    /// `C^-1 B^T a = L^-T W a`: how far the pose follows an intrinsics step, with the opposite sign.
    pub fn response(&self, intrinsics: &SVector<f64, W>, n: usize) -> SVector<f64, 6> {
        let along = self
            .whitened
            .map(|row| row.iter().zip(intrinsics.iter()).take(n).map(|(w, d)| w * d).sum::<f64>());
        SVector::from(self.solve_transposed(along))
    }

    /// `W^T y` for a whitened vector, `n` entries: the intrinsics' share of it.
    pub fn coupled(&self, y: &[f64; 6], n: usize) -> [f64; W] {
        let mut sum = [0.0; W];
        for (row, y) in self.whitened.iter().zip(y) {
            for (sum, w) in sum.iter_mut().zip(row).take(n) {
                *sum += w * y;
            }
        }
        sum
    }

    /// `L^-1 b`.
    pub fn whiten(&self, mut b: [f64; 6]) -> [f64; 6] {
        for i in 0..6 {
            for k in 0..i {
                b[i] -= self.factor[i][k] * b[k];
            }
            b[i] *= self.factor[i][i];
        }
        b
    }

    /// `L^-T b`.
    #[inline(always)]
    fn solve_transposed(&self, mut b: [f64; 6]) -> [f64; 6] {
        for i in (0..6).rev() {
            for k in i + 1..6 {
                b[i] -= self.factor[k][i] * b[k];
            }
            b[i] *= self.factor[i][i];
        }
        b
    }

    /// Covariance of the pose, `C^-1 + Y P Y^T` with `Y = C^-1 B^T` and `P` that of the intrinsics, and
    /// theirs with it, `-P Y^T`.
    pub fn covariance(&self, intrinsics: &Intrinsics<W>, n: usize) -> (PoseBlock, MatrixXx6<f64>) {
        let (pose, minus_cross) = match vectors::<W>(n) {
            2 => dispatch(PoseCovariance::<W, 2> { view: self, intrinsics }),
            3 => dispatch(PoseCovariance::<W, 3> { view: self, intrinsics }),
            4 => dispatch(PoseCovariance::<W, 4> { view: self, intrinsics }),
            _ => dispatch(PoseCovariance::<W, 6> { view: self, intrinsics }),
        };
        let pose = PoseBlock::from_fn(|i, j| 0.5 * (pose[i][j] + pose[j][i]));
        (pose, MatrixXx6::from_fn(n, |i, j| -minus_cross[j][i]))
    }
}

struct PoseCovariance<'a, const W: usize, const V: usize> {
    view: &'a Eliminated<W>,
    intrinsics: &'a Intrinsics<W>,
}

impl<const W: usize, const V: usize> Kernel for PoseCovariance<'_, W, V> {
    /// Pose block, and `Y P` row by row; entries beyond those asked for mean nothing.
    type Output = ([[f64; 2 * LANES]; 6], [[f64; W]; 6]);

    #[inline(always)]
    fn run<L: Lanes>(self) -> Self::Output {
        let factor = &self.view.factor;
        // Y = L^-T W, from the last row up.
        let mut y: [[L; V]; 6] =
            std::array::from_fn(|i| std::array::from_fn(|v| load(&self.view.whitened[i], v)));
        solve_rows_transposed(factor, &mut y);
        let mut y_rows = [[0.0; W]; 6];
        for (row, target) in y.iter().zip(&mut y_rows) {
            for (v, &lanes) in row.iter().enumerate() {
                store(target, v, lanes);
            }
        }
        // Y P, row by row. P is symmetric, so its columns are its rows.
        let mut product = [[L::zero(); V]; 6];
        let columns = self.intrinsics.as_slice();
        for k in 0..V * LANES {
            let at: [L; V] = std::array::from_fn(|v| {
                let first = k * W + v * LANES;
                L::load(&[columns[first], columns[first + 1], columns[first + 2], columns[first + 3]])
            });
            for i in 0..6 {
                let factor = L::splat(y_rows[i][k]);
                for v in 0..V {
                    product[i][v] = product[i][v] + factor * at[v];
                }
            }
        }
        let mut minus_cross = [[0.0; W]; 6];
        for (row, target) in product.iter().zip(&mut minus_cross) {
            for (v, &lanes) in row.iter().enumerate() {
                store(target, v, lanes);
            }
        }
        // C^-1 = L^-T L^-1, then + (Y P) Y^T.
        let mut pose: [[L; 2]; 6] = inverse_rows(factor);
        solve_rows_transposed(factor, &mut pose);
        for k in 0..V * LANES {
            let column = |i: usize| if i < 6 { y_rows[i][k] } else { 0.0 };
            let at: [L; 2] = [
                L::load(&[column(0), column(1), column(2), column(3)]),
                L::load(&[column(4), column(5), 0.0, 0.0]),
            ];
            for i in 0..6 {
                let factor = L::splat(minus_cross[i][k]);
                pose[i] = [pose[i][0] + factor * at[0], pose[i][1] + factor * at[1]];
            }
        }
        let mut rows = [[0.0; 2 * LANES]; 6];
        for (row, target) in pose.iter().zip(&mut rows) {
            target[..LANES].copy_from_slice(&row[0].store());
            target[LANES..].copy_from_slice(&row[1].store());
        }
        (rows, minus_cross)
    }
}

/// `L^-1` in rows.
#[inline(always)]
fn inverse_rows<L: Lanes>(factor: &[[f64; 6]; 6]) -> [[L; 2]; 6] {
    let unit = |i: usize, v: usize| {
        L::load(&std::array::from_fn(|lane| if i == v * LANES + lane { 1.0 } else { 0.0 }))
    };
    let mut rows: [[L; 2]; 6] = std::array::from_fn(|i| [unit(i, 0), unit(i, 1)]);
    for i in 0..6 {
        for k in 0..i {
            let entry = L::splat(factor[i][k]);
            rows[i] = [rows[i][0] - entry * rows[k][0], rows[i][1] - entry * rows[k][1]];
        }
        let inverse = L::splat(factor[i][i]);
        rows[i] = [rows[i][0] * inverse, rows[i][1] * inverse];
    }
    rows
}

/// Rows of `L^-T X`.
#[inline(always)]
fn solve_rows_transposed<L: Lanes, const V: usize>(factor: &[[f64; 6]; 6], rows: &mut [[L; V]; 6]) {
    for i in (0..6).rev() {
        for k in i + 1..6 {
            let entry = L::splat(factor[k][i]);
            for v in 0..V {
                rows[i][v] = rows[i][v] - entry * rows[k][v];
            }
        }
        let inverse = L::splat(factor[i][i]);
        for v in 0..V {
            rows[i][v] = rows[i][v] * inverse;
        }
    }
}
