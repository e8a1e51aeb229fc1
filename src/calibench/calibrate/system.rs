//! How are thousands of poses solved for without a matrix of thousands of rows? Schur elimination of the pose
//! blocks.
//!
//! The normal equations of a calibration are an arrow: intrinsics `A` (n x n), one pose block `C_i` (6 x 6) a
//! view, and couplings `B_i` (n x 6). Poses do not couple with each other, so with `C_i = L_i L_i^T`, `W_i =
//! L_i^-1 B_i^T`, `z_i = L_i^-1 g_i`
//!
//! ```text
//! S = A - sum W_i^T W_i,   S d_a = -(g_a - sum W_i^T z_i),   L_i^T d_i = -(z_i + W_i d_a)
//! ```
//! and time and memory grow linearly in the number of views.

use super::Covariance;
use super::blocks::{Intrinsics, N, PoseBlock, ViewBlock};
use super::chunks::{self, CHUNK};
use super::elimination::{self, Eliminated, Reduced};
use crate::camera::FreeParameters;
use nalgebra::{DMatrix, MatrixXx6, SMatrix, SVector};

/// Normal equations `J^T w J` and gradient `J^T w r` of all views.
#[derive(Debug, Clone)]
pub struct System<const W: usize = N> {
    pub(super) free: FreeParameters,
    /// How many unknowns all views share: the free intrinsics, and a board's shape.
    pub(super) shared: usize,
    pub(super) intrinsics: Intrinsics<W>,
    pub(super) gradient: SVector<f64, W>,
    pub(super) views: Vec<ViewBlock<W>>,
    pub(super) cost: f64,
}

/// Normal equations without the poses: what uncertainty and conditioning are both read from.
pub(super) struct Reduction<const W: usize = N> {
    free: FreeParameters,
    shared: usize,
    /// The views' factors.
    pub eliminated: Vec<Eliminated<W>>,
    /// `S`, the intrinsics' information when the poses are unknown too.
    pub schur: DMatrix<f64>,
    /// `R` with `R^T R = S`, upper triangle, where it comes from the Jacobian and so has digits that `S` has
    /// lost.
    pub root: Option<DMatrix<f64>>,
}

/// An acceleration beyond this part of its step is not trusted (Transtrum & Sethna 2012).
const LARGEST_BEND: f64 = 0.75;

/// A step of all unknowns.
#[derive(Debug, Clone)]
pub(super) struct Step<const W: usize = N> {
    /// One entry per free intrinsic parameter.
    pub intrinsics: SVector<f64, W>,
    /// Rotation vector and translation of each view.
    pub poses: Vec<SVector<f64, 6>>,
    /// Predicted fall of the cost, `-(2 g^T d + d^T H d)`, without the damping.
    pub predicted_gain: f64,
    /// The views' factors, kept between the two passes over them.
    eliminated: Vec<Eliminated<W>>,
}

impl<const W: usize> Default for Step<W> {
    fn default() -> Step<W> {
        Step { intrinsics: SVector::zeros(), poses: Vec::new(), predicted_gain: 0.0, eliminated: Vec::new() }
    }
}

impl<const W: usize> Step<W> {
    /// A step that was not solved for.
    pub fn along(intrinsics: SVector<f64, W>, poses: Vec<SVector<f64, 6>>) -> Step<W> {
        Step { intrinsics, poses, ..Step::default() }
    }

    /// A part of the step.
    pub fn times(&self, part: f64) -> Step<W> {
        Step::along(part * self.intrinsics, self.poses.iter().map(|pose| part * pose).collect())
    }

    /// Adds half of an acceleration. False, and unchanged, where that is so long, in the metric of `system`,
    /// that the path is not known to second order.
    pub fn bend(&mut self, acceleration: &Step<W>, system: &System<W>) -> bool {
        let is_known = acceleration.square(system) <= LARGEST_BEND * LARGEST_BEND * self.square(system);
        if is_known {
            self.intrinsics += 0.5 * acceleration.intrinsics;
            for (pose, bend) in self.poses.iter_mut().zip(&acceleration.poses) {
                *pose += 0.5 * bend;
            }
        }
        is_known
    }

    /// `d^T diag(H) d`.
    fn square(&self, system: &System<W>) -> f64 {
        let weighed = |diagonal: f64, d: f64| diagonal * d * d;
        let shared: f64 =
            (0..system.shared).map(|i| weighed(system.intrinsics[(i, i)], self.intrinsics[i])).sum();
        let of_view = |(view, pose): (&ViewBlock<W>, &SVector<f64, 6>)| -> f64 {
            (0..6).map(|i| weighed(view.pose[(i, i)], pose[i])).sum()
        };
        shared + system.views.iter().zip(&self.poses).map(of_view).sum::<f64>()
    }
}

impl<const W: usize> System<W> {
    /// An empty system with room for `views` views.
    pub(super) fn new(free: FreeParameters, views: usize) -> System<W> {
        System {
            free,
            shared: free.len(),
            intrinsics: Intrinsics::zeros(),
            gradient: SVector::zeros(),
            views: Vec::with_capacity(views),
            cost: 0.0,
        }
    }

    /// With `others` unknowns that all views share besides the intrinsics.
    pub(super) fn sharing(mut self, others: usize) -> System<W> {
        self.shared = self.free.len() + others;
        self
    }

    /// Factors the damped pose blocks; returns `S` and the right-hand side. `None` where a block is not
    /// positive definite.
    pub(super) fn eliminate(&self, damping: f64, eliminated: &mut Vec<Eliminated<W>>) -> Option<Reduced<W>> {
        let n = self.shared;
        eliminated.resize_with(self.views.len(), Eliminated::default);
        let mut reduced = Some(Reduced::of(&self.intrinsics, &self.gradient, damping));
        let chunk = |index: usize, chunk: &mut [Eliminated<W>]| {
            let views = &self.views[index * CHUNK..][..chunk.len()];
            elimination::eliminate(views, chunk, damping, n)
        };
        chunks::fold(eliminated, chunk, |part| {
            reduced = match (reduced.take(), part) {
                (Some(sum), Some(part)) => Some(sum.less(&part, n)),
                _ => None,
            };
        });
        reduced
    }

    /// Solves for the step of `H + damping diag(H)`. `None` where the damped matrix is not positive definite.
    pub(super) fn solve_into(&self, damping: f64, step: &mut Step<W>) -> Option<()> {
        let n = self.shared;
        let reduced = self.eliminate(damping, &mut step.eliminated)?;
        step.intrinsics = reduced.solve(n)?;
        let a = step.intrinsics;
        // (H + damping D) d = -g turns -(2 g^T d + d^T H d) into -g^T d + damping d^T D d.
        let gain_of = |g: f64, d: f64, diagonal: f64| d * (damping * diagonal * d - g);
        let mut gain: f64 = (0..n).map(|i| gain_of(self.gradient[i], a[i], self.intrinsics[(i, i)])).sum();
        step.poses.resize(self.views.len(), SVector::zeros());
        let eliminated = &step.eliminated;
        let chunk = |index: usize, poses: &mut [SVector<f64, 6>]| {
            let mut gain = 0.0;
            for (k, pose) in poses.iter_mut().enumerate() {
                let (view, factors) = (&self.views[index * CHUNK + k], &eliminated[index * CHUNK + k]);
                *pose = factors.pose_step(&a, n);
                gain += (0..6).map(|i| gain_of(view.gradient[i], pose[i], view.pose[(i, i)])).sum::<f64>();
            }
            gain
        };
        chunks::fold(&mut step.poses, chunk, |part| gain += part);
        step.predicted_gain = gain;
        Some(())
    }

    /// The undamped equations with the poses eliminated; `None` where a pose is undetermined.
    pub(super) fn reduction(&self) -> Option<Reduction<W>> {
        let mut eliminated = Vec::new();
        let schur = self.eliminate(0.0, &mut eliminated)?.matrix(self.shared);
        Some(Reduction { free: self.free, shared: self.shared, eliminated, schur, root: None })
    }

    /// The inverse of the normal matrix, block by block, for unit noise; `None` if it is singular.
    pub fn covariance(&self) -> Option<Covariance> {
        self.reduction()?.covariance()
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.shared + 6 * self.views.len()
    }
}

impl<const W: usize> Reduction<W> {
    /// The intrinsics' covariance for unit noise; `None` if it is singular.
    pub fn intrinsics_covariance(&self) -> Option<DMatrix<f64>> {
        if self.shared == 0 {
            return Some(DMatrix::zeros(0, 0));
        }
        match &self.root {
            Some(root) => inverse_of_square(root),
            None => Some(self.schur.clone().cholesky()?.inverse()),
        }
    }

    /// The step of what views share with that of every pose which lowers the cost most.
    pub fn following(&self, intrinsics: SVector<f64, W>) -> Step<W> {
        let follow = |factors: &Eliminated<W>| -factors.response(&intrinsics, self.shared);
        Step::along(intrinsics, self.eliminated.iter().map(follow).collect())
    }

    /// See [`System::covariance`].
    pub fn covariance(&self) -> Option<Covariance> {
        let n = self.shared;
        let intrinsics = self.intrinsics_covariance()?;
        let padded = SMatrix::from_fn(|i, j| if i < n && j < n { intrinsics[(i, j)] } else { 0.0 });
        let blocks: Vec<(PoseBlock, MatrixXx6<f64>)> =
            chunks::map(&self.eliminated, |_, factors| factors.covariance(&padded, n));
        let (poses, cross) = blocks.into_iter().unzip();
        Some(Covariance::untied(self.free, intrinsics, poses, cross))
    }
}

/// `(R^T R)^-1` of an upper triangle; `None` if that is singular. Every sum is written out: a library's
/// product of matrices may round otherwise on another processor.
fn inverse_of_square(root: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = root.nrows();
    let inverse = root.solve_upper_triangular(&DMatrix::identity(n, n))?;
    let entry = |i: usize, j: usize| (i.max(j)..n).map(|k| inverse[(i, k)] * inverse[(j, k)]).sum();
    Some(DMatrix::from_fn(n, n, entry))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::tests::equations;
    use nalgebra::DVector;

    /// The same matrix written out in full.
    fn dense(system: &System) -> DMatrix<f64> {
        let n = system.free.len();
        let mut full = DMatrix::zeros(system.unknowns(), system.unknowns());
        for i in 0..n {
            for j in 0..n {
                full[(i, j)] = system.intrinsics[(i, j)];
            }
        }
        for (k, view) in system.views.iter().enumerate() {
            let at = n + 6 * k;
            full.fixed_view_mut::<6, 6>(at, at).copy_from(&view.pose);
            for i in 0..n {
                for j in 0..6 {
                    full[(i, at + j)] = view.coupling[(i, j)];
                    full[(at + j, i)] = view.coupling[(i, j)];
                }
            }
        }
        full
    }

    #[test]
    fn elimination_gives_the_inverse_of_the_full_matrix() {
        let system = equations();
        let inverse = dense(&system).try_inverse().unwrap();
        let covariance = system.covariance().unwrap();
        let n = system.free.len();
        // Both lose digits with the condition number of the scaled matrix (about 1e6): compare at 1e-8 of the
        // scale.
        let close = |a: f64, b: f64, i: usize, j: usize| {
            (a - b).abs() <= 1e-8 * (inverse[(i, i)] * inverse[(j, j)]).sqrt()
        };
        for i in 0..n {
            for j in 0..n {
                assert!(close(covariance.intrinsics[(i, j)], inverse[(i, j)], i, j));
            }
        }
        for k in 0..3 {
            let at = n + 6 * k;
            for i in 0..6 {
                for j in 0..6 {
                    assert!(close(covariance.poses[k][(i, j)], inverse[(at + i, at + j)], at + i, at + j));
                }
                for j in 0..n {
                    assert!(close(covariance.cross[k][(j, i)], inverse[(j, at + i)], j, at + i));
                }
            }
        }
    }

    #[test]
    fn the_step_solves_the_full_equations() {
        let mut system = equations();
        for (i, g) in system.gradient.iter_mut().take(6).enumerate() {
            *g = 1.0 + i as f64;
        }
        for view in &mut system.views {
            view.gradient = SVector::from_fn(|i, _| 0.5 - i as f64);
        }
        let mut step = Step::default();
        system.solve_into(0.0, &mut step).unwrap();
        let n = system.free.len();
        let mut gradient = DVector::zeros(system.unknowns());
        let mut stacked = DVector::zeros(system.unknowns());
        gradient.rows_mut(0, n).copy_from(&system.gradient.rows(0, n));
        stacked.rows_mut(0, n).copy_from(&step.intrinsics.rows(0, n));
        for k in 0..3 {
            gradient.rows_mut(n + 6 * k, 6).copy_from(&system.views[k].gradient);
            stacked.rows_mut(n + 6 * k, 6).copy_from(&step.poses[k]);
        }
        let expected = -dense(&system).lu().solve(&gradient).unwrap();
        assert!((&stacked - &expected).norm() <= 1e-8 * expected.norm());
        assert!((step.predicted_gain + gradient.dot(&expected)).abs() <= 1e-8 * step.predicted_gain);
    }

    #[test]
    fn a_step_is_bent_by_half_of_an_acceleration_that_is_short_in_the_systems_metric() {
        let system = equations();
        let pose = |k: f64| SVector::from_fn(|i, _| k * (i as f64 - 2.2));
        let own =
            Step::along(SVector::from_fn(|i, _| 0.1 * (i as f64 + 1.0)), [1.0, -2.0, 3.0].map(pose).to_vec());
        let mut step = own.clone();
        assert!(!step.bend(&own.times(-0.76), &system));
        assert_eq!((step.intrinsics, &step.poses), (own.intrinsics, &own.poses));
        assert!(step.bend(&own.times(-0.74), &system));
        assert!((step.intrinsics - 0.63 * own.intrinsics).norm() < 1e-12);
        assert!(step.poses.iter().zip(&own.poses).all(|(bent, own)| (bent - 0.63 * own).norm() < 1e-12));
    }

    #[test]
    fn the_inverse_of_a_square_is_that_of_the_whole_matrix() {
        let root = DMatrix::from_row_slice(3, 3, &[2.0, -1.0, 0.5, 0.0, 3.0, 0.7, 0.0, 0.0, 0.4]);
        let expected = (root.transpose() * &root).try_inverse().unwrap();
        let own = inverse_of_square(&root).unwrap();
        assert!((&own - &expected).norm() < 1e-12 * expected.norm(), "{own} {expected}");
    }
}
